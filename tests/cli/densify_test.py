#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the dense pass can be killed at any instant and ends in the same database; it redoes only
#   what is stale; the C++ path and the device give the same bytes; others read meanwhile; what it
#   makes can be exported and drawn.
# Method: a rendered street of a few photos, small depth maps; kills at random instants, as many as
#   KILLS says (6; 50 by hand); the digest decides. Exported files are read by a parser of their
#   own.
# usage: [KILLS=50] tests/cli/densify_test.py VEDUTA VEDUTA_STREET [TEST...]
import json
import os
import random
import shutil
import signal
import struct
import subprocess
import time

from city import (VEDUTA, Case, add, ask, at, main, must, new_database, photo, read, render, run,
                  write)

KILLS = int(os.environ.get('KILLS', '6'))
SEED = int(os.environ.get('SEED', '1'))
# Photos of the street that make one reconstruction: before the pass that is looked at, and added
# after it.
FIRST, MORE = range(9, 14), range(14, 16)
COMMAND = ('densify', '--size', '160', '--device', 'cpp')
STAGES = ('depth_maps', 'checks', 'volume', 'fusion', 'surface', 'exposures', 'colors')


def densify(db, *more):
    return json.loads(must(*COMMAND, db, '--json', *more))


def copy_of(db, name):
    shutil.copytree(db, at(name))
    return at(name)


def setUpModule():
    global SPARSE, DENSE, REPORT, SECONDS
    render('street', '--photos', '16', '--size', '512x384')
    SPARSE = new_database('sparse')
    for folder, numbers in (('first', FIRST), ('more', MORE)):
        for i in numbers:
            write(at(folder, f'{i:02}.jpg'), photo(i))
    code, lines, err = add(SPARSE, at('first'))
    assert code == 0, err
    DENSE = copy_of(SPARSE, 'dense')
    start = time.monotonic()
    REPORT = densify(DENSE)
    SECONDS = time.monotonic() - start


def read_ply(path):
    """Vertices with their properties, and triangles."""
    data = read(path)
    end = data.index(b'end_header\n') + len(b'end_header\n')
    header = data[:end].decode().split('\n')
    assert header[:2] == ['ply', 'format binary_little_endian 1.0'], header
    counts, properties, element = {}, {}, None
    for line in header:
        words = line.split()
        if words[:1] == ['element']:
            element = words[1]
            counts[element], properties[element] = int(words[2]), []
        elif words[:1] == ['property']:
            properties[element].append(words[1:])
    codes = {'float': 'f', 'uchar': 'B', 'float32': 'f', 'uint8': 'B'}
    row = struct.Struct('<' + ''.join(codes[p[0]] for p in properties['vertex']))
    vertices = [row.unpack_from(data, end + i * row.size) for i in range(counts['vertex'])]
    at_byte, triangles = end + row.size * counts['vertex'], []
    for _ in range(counts.get('face', 0)):
        assert data[at_byte] == 3
        triangles.append(struct.unpack_from('<3I', data, at_byte + 1))
        at_byte += 13
    assert at_byte == len(data)
    return [p[-1] for p in properties['vertex']], vertices, triangles


class Densify(Case):
    def test_makes_a_surface_once(self):
        self.assertEqual(REPORT['device'], 'C++')
        self.assertEqual(REPORT['depth_maps']['computed'], len(FIRST))
        self.assertGreater(REPORT['triangles'], 1000)
        again = densify(DENSE)
        for stage in STAGES:
            self.assertEqual((again[stage]['computed'], again[stage]['removed']), (0, 0), stage)
        self.assertEqual(again['triangles'], REPORT['triangles'])
        self.assertEqual(must('verify', DENSE), 'sound\n')
        status = ask('status', DENSE)['reconstructions'][0]
        self.assertEqual(status['triangles'], REPORT['triangles'])
        self.assertEqual(status['depth_maps'], REPORT['depth_maps']['computed'])
        self.assertIn('dense: ', must('status', DENSE))
        journal = must('journal', DENSE)
        self.assertEqual(journal.count('densify'), 1, 'the second pass did nothing')
        shown = ask('show', DENSE, '11.jpg')['depth_map']
        self.assertEqual((shown['width'], shown['height'], len(shown['sensors'])), (160, 120, 2))
        self.assertIn('depth map of 160x120 px', must('show', DENSE, '11.jpg'))

    def test_same_bytes_on_any_device_and_thread_count(self):
        db = copy_of(SPARSE, 'device')
        must('densify', db, '--size', '160', '--threads', '1', '--device', 'cpu')
        self.assertEqual(must('digest', db), must('digest', DENSE))

    def test_killed_at_any_instant_ends_the_same(self):
        rng = random.Random(SEED)
        expected = must('digest', DENSE)
        kills, database = 0, 0
        while kills < KILLS:
            database += 1
            db = copy_of(SPARSE, f'killed{database}')
            while True:
                process = subprocess.Popen([VEDUTA, *COMMAND, db], stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL)
                if kills < KILLS:
                    time.sleep(rng.uniform(0, SECONDS / 3))
                    process.kill()
                code = process.wait()
                if code != -signal.SIGKILL:
                    self.assertEqual(code, 0)
                    break
                kills += 1
                if rng.random() < 0.3:
                    self.assertEqual(must('verify', db), 'sound\n')
            self.assertEqual(must('digest', db), expected, f'after kills with SEED={SEED}')
            shutil.rmtree(db)

    def test_more_photos_cost_what_they_touch(self):
        db = copy_of(DENSE, 'grown')
        code, lines, err = add(db, at('more'))
        self.assertEqual(code, 0, err)
        grown = densify(db)
        self.assertGreaterEqual(grown['depth_maps']['computed'], len(MORE))
        self.assertGreater(grown['depth_maps']['kept'], 0)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_other_settings_are_kept(self):
        db = copy_of(DENSE, 'settings')
        voxel = 1.5 * REPORT['voxel_size']
        coarse = densify(db, '--voxel', str(voxel))
        self.assertEqual(coarse['depth_maps']['computed'], 0)
        self.assertLess(coarse['triangles'], REPORT['triangles'])
        again = densify(db)
        self.assertEqual(again['voxel_size'], voxel)
        self.assertEqual(again['colors']['computed'], 0)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_readers_go_on(self):
        db = copy_of(SPARSE, 'read')
        process = subprocess.Popen([VEDUTA, *COMMAND, db], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        looks = 0
        while process.poll() is None:
            code, out, err = run('status', db)
            # A file that a compaction has just deleted asks for opening again.
            self.assertTrue(code == 0 or 'No such file' in err, err)
            looks += code == 0
        self.assertEqual(process.returncode, 0)
        self.assertGreater(looks, 3)

    def test_stops_on_request(self):
        db = copy_of(SPARSE, 'stopped')
        process = subprocess.Popen([VEDUTA, *COMMAND, db], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE)
        time.sleep(SECONDS / 4)
        process.send_signal(signal.SIGINT)
        err = process.communicate()[1].decode()
        self.assertEqual(process.returncode, 1, err)
        self.assertIn('what is finished is stored', err)
        densify(db)
        self.assertEqual(must('digest', db), must('digest', DENSE))

    def test_stops_when_the_time_is_over(self):
        db = copy_of(SPARSE, 'in time')
        self.refused(1, 'stopped after 1e-09 hours: what is finished is stored', *COMMAND, db,
                     '--hours', '1e-9')
        code, _, err = run(*COMMAND, db, '--hours', str(SECONDS / 3 / 3600))
        self.assertEqual(code, 1, err)
        self.assertIn('what is finished is stored', err)
        report = json.loads(must(*COMMAND, db, '--hours', '10', '--json'))
        self.assertGreater(report['depth_maps']['kept'], 0)
        self.assertEqual(must('digest', db), must('digest', DENSE))

    def test_usage(self):
        self.refused(1, 'there is no database', 'densify', at('nowhere'))
        self.refused(1, 'abacus', 'densify', DENSE, '--device', 'abacus')
        self.refused(1, 'there is no reconstruction 77', 'densify', DENSE, '--reconstruction', '77')
        self.refused(1, 'depth_side_px is 5', 'densify', DENSE, '--size', '5')
        before = must('digest', DENSE)
        self.refused(1, 'too small', 'densify', DENSE, '--voxel', '1e-12')
        self.refused(1, 'too large', 'densify', DENSE, '--voxel', '1e300')
        self.assertEqual(must('digest', DENSE), before)
        for wrong in (('--voxel', '-1'), ('--sensors', '0'), ('--threads', '0'),
                      ('--hours', '0'), ('--hours', '1e9')):
            self.assertEqual(run('densify', DENSE, *wrong)[0], 2, wrong)
        empty = new_database('empty')
        self.refused(1, 'add photos first', 'densify', empty)


class Output(Case):
    def test_ply(self):
        out = must('export', DENSE, at('ply'), '--format', 'ply')
        self.assertIn(f'{REPORT["triangles"]} triangles', out)
        names, vertices, triangles = read_ply(at('ply', '0', 'mesh.ply'))
        self.assertEqual(names, ['x', 'y', 'z', 'nx', 'ny', 'nz', 'red', 'green', 'blue'])
        self.assertEqual(len(triangles), REPORT['triangles'])
        self.assertEqual(max(max(t) for t in triangles), len(vertices) - 1)
        # Welded: no edge is cut open between tiles, so no two vertices lie in one place.
        self.assertEqual(len({v[:3] for v in vertices}), len(vertices))
        self.assertGreater(len({v[6:] for v in vertices}), 50, 'colours')
        status = ask('status', DENSE)['reconstructions'][0]
        _, points, faces = read_ply(at('ply', '0', 'points.ply'))
        self.assertEqual((len(points), faces), (status['points'], []))
        cameras = json.loads(read(at('ply', '0', 'cameras.json')))
        self.assertEqual(len(cameras), status['images'])
        self.refused(1, 'choose another folder', 'export', DENSE, at('ply'), '--format', 'ply')

    def test_fewer_triangles(self):
        must('export', DENSE, at('simple'), '--format', 'ply', '--error',
             str(REPORT['voxel_size'] / 4))
        _, _, triangles = read_ply(at('simple', '0', 'mesh.ply'))
        self.assertLess(len(triangles), 0.8 * REPORT['triangles'])

    def test_gltf(self):
        must('export', DENSE, at('gltf'), '--format', 'gltf')
        data = read(at('gltf', '0', 'model.glb'))
        magic, version, length, json_length, kind = struct.unpack_from('<4sIII4s', data)
        self.assertEqual((magic, version, length, kind), (b'glTF', 2, len(data), b'JSON'))
        scene = json.loads(data[20:20 + json_length])
        status = ask('status', DENSE)['reconstructions'][0]
        self.assertEqual(len(scene['cameras']), status['images'])
        modes = sorted(p.get('mode', 4) for mesh in scene['meshes'] for p in mesh['primitives'])
        self.assertEqual(modes, [0, 4], 'points and triangles')

    def test_without_a_surface(self):
        out = must('export', SPARSE, at('none'), '--format', 'ply')
        self.assertIn("no surface yet: 'veduta densify' makes one", out)
        self.assertFalse(os.path.exists(at('none', '0', 'mesh.ply')))
        must('render', SPARSE, at('points.png'))
        self.assertEqual(read(at('points.png'))[:8], b'\x89PNG\r\n\x1a\n')

    def test_render_is_like_the_photo(self):
        out = must('render', DENSE, at('photo.png'), '--from', '11.jpg', '--compare')
        covered = float(out.split('covered ')[1].split()[0])
        error = float(out.split('error ')[1].split()[0])
        self.assertGreater(covered, 40, out)
        self.assertLess(error, 12, out)
        for side in ('front', 'left', 'right'):
            must('render', DENSE, at(f'{side}.png'), '--side', side, '--size', '200')
        self.assertNotEqual(read(at('left.png')), read(at('right.png')))
        self.refused(1, "there is no image 'x.jpg'", 'render', DENSE, at('x.png'), '--from',
                     'x.jpg')
        self.refused(1, 'nowhere', 'render', DENSE, at('nowhere', 'x.png'))
        self.assertEqual(run('render', DENSE, at('x.png'), '--compare')[0], 2)


if __name__ == '__main__':
    main()
