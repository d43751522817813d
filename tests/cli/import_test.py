#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what is exported for COLMAP, as text and binary, is imported again with the same poses, and
#   grows on; names with spaces survive; an import that is killed at any instant goes on to the
#   same digest; what was left out is named, and exit codes say so.
# Method: real processes on photos of a rendered street, in a folder and with names that have
#   spaces.
# usage: tests/cli/import_test.py VEDUTA VEDUTA_STREET [TEST...]
import json
import os
import random
import shutil
import signal
import subprocess
import urllib.parse

from city import (VEDUTA, WHOLE, Case, add, ask, at, main, must, new_database, photo,
                  read, render, run, write, SIZE)
from daemon import Daemon

COUNT = 16
KILLS = int(os.environ.get('KILLS', '6'))
NAMED = None  # the folder of the photos
MODEL = []  # those that have a pose in the model


def name_of(number):
    return f'a street/photo {number:02}.jpg'


def setUpModule():
    global NAMED, MODEL
    render('street', '--photos', str(COUNT), '--length', '10', '--size', SIZE)
    NAMED = at('named')
    for number in range(COUNT):
        write(os.path.join(NAMED, name_of(number)), photo(number + 1))
    new_database('whole')
    code, _, err = add(WHOLE, NAMED)
    assert code == 0, err
    must('export', WHOLE, at('text'), '--format', 'colmap')
    must('export', WHOLE, at('binary'), '--format', 'colmap-binary')
    MODEL = sorted(poses(at('text', '0')))
    assert len(MODEL) >= 8, MODEL


def poses(model):
    """Name -> quaternion and translation, of a model's images.txt."""
    with open(os.path.join(model, 'images.txt'), encoding='utf-8') as file:
        rows = [line.split() for line in file if not line.startswith('#')][0::2]
    return {urllib.parse.unquote(row[9]): [float(x) for x in row[1:8]] for row in rows}


def centre(pose):
    w, x, y, z, *t = pose
    rows = ((1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
            (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
            (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)))
    return [-sum(r * p for r, p in zip(row, t)) for row in rows]


def distance(a, b):
    return sum((p - q) ** 2 for p, q in zip(a, b)) ** 0.5


def without(folder, missing):
    shutil.copytree(NAMED, at(folder))
    for name in missing:
        os.remove(os.path.join(at(folder), name))
    return at(folder)


def import_command(db, model, photos):
    return ('import', db, model, '--images', photos, '--threads', '2')


class Import(Case):
    def compare(self, db, shown):
        """The poses of the database with those of the model that it came from."""
        must('export', db, at(shown), '--format', 'colmap')
        before, after = poses(at('text', '0')), poses(at(shown, '0'))
        self.assertEqual(set(before), set(after))
        size = max(distance(centre(a), centre(b)) for a in before.values()
                   for b in before.values())
        for name, pose in after.items():
            self.assertLess(distance(centre(pose), centre(before[name])), 0.002 * size, name)

    def test_both_formats_come_back_with_the_same_poses(self):
        for model in ('text', 'binary'):
            db = at('of ' + model)
            must('init', db)
            out = must(*import_command(db, at(model, '0'), NAMED))
            self.assertEqual(out.count('by the model'), len(MODEL))
            self.assertIn(f'{len(MODEL)} of {len(MODEL)} photos by the poses of the model', out)
            self.assertEqual(must('verify', db), 'sound\n')
            self.compare(db, 'again of ' + model)
        self.assertEqual(must('digest', at('of text')), must('digest', at('of binary')))

    def test_it_grows_on(self):
        db, missing = at('grown'), (MODEL[2], MODEL[5])
        must('init', db)
        answer = json.loads(run(*import_command(db, at('text', '0'), without('few', missing)),
                                '--json')[1])
        self.assertEqual(answer['reconstruction'], 1)
        self.assertEqual([p['image'] for p in answer['photos'] if not p['was_given_pose']],
                         [name.replace(' ', '%20') for name in missing])
        camera = ask('camera', 'list', db)[0]['name']
        for name in missing:
            out = must('add', db, '--camera', camera, os.path.join(NAMED, name))
            self.assertIn('placed', out)
        self.assertEqual(ask('status', db)['placed'], len(MODEL))
        self.assertEqual(must('verify', db), 'sound\n')

    def test_what_is_left_out_is_named(self):
        db = at('left out')
        must('init', db)
        code, out, _ = run(*import_command(db, at('text', '0'), without('fewer', (MODEL[4],))))
        self.assertEqual(code, 1)
        self.assertIn('left out   ' + MODEL[4].replace(' ', '%20') + ': there is no such file', out)
        self.refused(1, 'has neither cameras.bin nor cameras.txt',
                     *import_command(db, at('none'), NAMED))
        self.refused(1, 'no photo of the model is in',
                     *import_command(db, at('text', '0'), at('text')))
        self.refused(1, 'there is no database', *import_command(at('no'), at('text', '0'), NAMED))
        self.assertEqual(run('import', db, at('text', '0'))[0], 2)

    def test_a_daemon_does_it(self):
        alone, db = at('alone'), at('beside')
        command = import_command(alone, at('binary', '0'), without('of a daemon', (MODEL[4],)))
        for folder in (alone, db):
            must('init', folder)
        expected = run(*command)
        self.assertEqual(expected[0], 1, 'one is left out')
        with Daemon(db) as daemon:
            # The daemon's folder is another one than the command's.
            done = subprocess.run([VEDUTA, 'import', db, os.path.relpath(at('binary', '0')),
                                   '--images', os.path.relpath(at('of a daemon'))],
                                  capture_output=True)
            self.assertEqual((done.returncode, done.stdout.decode()), expected[:2])
            self.refused(1, 'has neither cameras.bin nor cameras.txt',
                         *import_command(db, at('none'), NAMED)[:5])
            self.assertEqual(run('import', db, at('binary', '0'), '--images', NAMED, '--json')[0],
                             0, 'the one that was left out is there now')
            answer = ask('import', db, at('binary', '0'), '--images', NAMED)
            self.assertEqual({photo['image'] for photo in answer['photos']}, set(MODEL))
            code, _, told = daemon.ask('POST', '/v1/models', json.dumps(
                {'model': at('binary', '0'), 'photos': NAMED, 'contributor': 'eve'}))
            self.assertEqual(code, 403, told)
        must(*import_command(alone, at('binary', '0'), NAMED))
        self.assertEqual(must('verify', db), 'sound\n')
        self.assertEqual(must('digest', db), must('digest', alone))

    def test_a_cut_file_stores_nothing(self):
        db, model = at('cut'), at('cut model')
        must('init', db)
        shutil.copytree(at('binary', '0'), model)
        data = read(os.path.join(model, 'points3D.bin'))
        write(os.path.join(model, 'points3D.bin'), data[:len(data) // 2])
        self.refused(1, 'points3D.bin', *import_command(db, model, NAMED))
        self.assertEqual(ask('status', db)['images'], 0)

    def test_a_killed_import_goes_on(self):
        whole = at('unkilled')
        must('init', whole)
        must(*import_command(whole, at('binary', '0'), NAMED))
        chance = random.Random(int(os.environ.get('SEED', '1')))
        db = at('killed')
        must('init', db)
        for kill in range(KILLS):
            process = subprocess.Popen([VEDUTA, *import_command(db, at('binary', '0'), NAMED)],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                process.wait(chance.uniform(0.2, 1.0 + kill))
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
            self.assertEqual(must('verify', db), 'sound\n')
        must(*import_command(db, at('binary', '0'), NAMED))
        self.assertEqual(must('digest', db), must('digest', whole))


if __name__ == '__main__':
    main()
