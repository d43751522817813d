#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: `veduta calibrate --points` and `--scene` and `camera add --from` do as docs/calibration.md
#   says: files, messages, exit codes; a city begins with photos whose camera nobody names.
# Method: points of a made-up session written here, without the program's own projection; photos of
#   a rendered street; real processes.
# usage: tests/cli/calibration_test.py VEDUTA VEDUTA_STREET
import json
import math
import os
import random

from city import PARAMS, PHOTOS, SIZE, Case, ask, at, main, must, read, render, run, write

WIDTH, HEIGHT, FOCAL, K1, CENTER = 1600, 1200, 1800.0, -0.12, (805.0, 590.0)


def session(photos=9, tilt=(15, 50), noise=0.1):
    """points.json as a dictionary: 8 by 6 points on a floor, and cameras all around that look at
    its middle."""
    dice = random.Random(7)
    floor = [((i % 8 - 3.5) * 0.14, (i // 8 - 2.5) * 0.16) for i in range(48)]
    views = []
    for photo in range(photos):
        azimuth = 2 * math.pi * photo / photos
        lean = math.radians(tilt[0] + (tilt[1] - tilt[0]) * (photo % 3) / 2)
        distance = 1.5 + 0.3 * (photo % 4)
        away = (math.sin(lean) * math.cos(azimuth), math.sin(lean) * math.sin(azimuth),
                math.cos(lean))
        right = (-math.sin(azimuth), math.cos(azimuth), 0)
        down = (away[1] * right[2] - away[2] * right[1], away[2] * right[0] - away[0] * right[2],
                away[0] * right[1] - away[1] * right[0])
        down = tuple(-d for d in down)
        points = []
        for number, (x, y) in enumerate(floor):
            depth = distance - (x * away[0] + y * away[1])
            u = (x * right[0] + y * right[1]) / depth
            v = (x * down[0] + y * down[1]) / depth
            factor = 1 + K1 * (u * u + v * v)
            px = CENTER[0] + FOCAL * u * factor + dice.gauss(0, noise)
            py = CENTER[1] + FOCAL * v * factor + dice.gauss(0, noise)
            if 0 <= px <= WIDTH - 1 and 0 <= py <= HEIGHT - 1:
                points.append({'id': number, 'x': px, 'y': py, 'sigma': noise})
        views.append({'name': f'photo{photo}.jpg', 'points': points})
    return {'width': WIDTH, 'height': HEIGHT, 'views': views}


def points_file(name, content):
    write(at(name), (content if isinstance(content, str) else json.dumps(content)).encode())
    return at(name)


class Calibrate(Case):
    def expect_json_is_the_file(self, points, camera):
        """In the order of its keys, too."""
        code, out, err = run('calibrate', '--points', points, '--out', camera, '--json')
        self.assertEqual(code, 0, err)
        self.assertEqual(len(out.splitlines()), 1)
        self.assertEqual(json.dumps(json.loads(out)), json.dumps(json.loads(read(camera))))

    def test_points_to_camera_to_database(self):
        points = points_file('p/points.json', session())
        camera, report = at('camera.json'), at('report.html')
        out = must('calibrate', '--points', points, '--out', camera, '--report', report)
        self.assertRegex(out, r'(?m)^fx 1[78]\d\d\.\d+ \+- 0?\d*\.\d+ px$')
        self.assertIn('in 9 of 9 photos', out)
        made = json.loads(read(camera))
        self.assertEqual((made['format'], made['version'], made['width']),
                         ('veduta camera', 1, WIDTH))
        self.assertAlmostEqual(made['intrinsics']['fx'] / FOCAL, 1, delta=0.005)
        self.assertAlmostEqual(made['intrinsics']['cx'], CENTER[0], delta=8)
        self.assertLess(abs(made['intrinsics']['fx'] - FOCAL),
                        5 * made['standard_deviations']['fx'])
        page = read(report).decode()
        self.assertEqual(page.count('<svg'), 4)
        self.assertIn('photo3.jpg', page)
        self.expect_json_is_the_file(points, camera)

        db = at('calibrated')
        must('init', db)
        must('camera', 'add', db, 'mine', '--from', camera)
        must('camera', 'add', db, 'mine', '--from', camera)
        listed, = ask('camera', 'list', db)
        self.assertEqual(listed['size'], f'{WIDTH}x{HEIGHT}')
        self.assertEqual([float(n) for n in listed['params'].split(',')],
                         [made['intrinsics'][n]
                          for n in ('fx', 'fy', 'cx', 'cy', 'k1', 'k2', 'u0', 'v0')])
        self.assertIn('calibrated from points.json: 9 photos', listed['source'])

    def test_gross_errors_are_left_out_with_a_word(self):
        spoilt = session()
        for point in spoilt['views'][4]['points']:
            point['x'] += 300 * math.sin(point['id'])
        spoilt['views'][2]['points'][10]['y'] += 40
        code, out, err = run('calibrate', '--points', points_file('spoilt.json', spoilt), '--out',
                             at('spoilt.camera'))
        self.assertEqual(code, 0, err)
        self.assertIn('in 8 of 9 photos', out)
        self.assertIn('note: photo4.jpg was left out', err)
        self.assertRegex(err, r'point \d+ in photo2\.jpg')
        self.expect_json_is_the_file(at('spoilt.json'), at('spoilt.camera'))

    def test_what_cannot_be_told_is_an_error_that_says_what_to_do(self):
        out = ('--out', at('never.json'))
        for name, content, words in (
                ('few', session(photos=2), 'take at least 8'),
                ('flat', session(tilt=(0, 0.2), noise=0.3), 'Tilt the camera'),
                ('no json', '{"width": 3', 'not JSON'),
                ('no views', '{"width": 640, "height": 480, "views": []}', 'too few')):
            self.refused(1, words, 'calibrate', '--points', points_file(name, content), *out)
        two = session()
        two['views'][3].update(width=HEIGHT, height=WIDTH)
        self.refused(1, 'same way round', 'calibrate', '--points', points_file('two', two), *out)
        self.refused(1, 'cannot read', 'calibrate', '--points', at('missing'), *out)
        self.assertFalse(os.path.exists(at('never.json')))
        self.refused(1, 'cannot write', 'calibrate', '--points', points_file('good', session()),
                     '--out',
                     at('no folder', 'camera.json'))
        self.refused(2, '--points', 'calibrate', *out)
        self.refused(2, '--out', 'calibrate', '--points', at('good'))


class Scene(Case):
    FOCAL = float(PARAMS.split(',')[0])

    @classmethod
    def setUpClass(cls):
        render('street', '--photos', '12', '--size', SIZE, '--trajectory', 'street', '--seed', '3')
        write(os.path.join(PHOTOS, 'notes.txt'), b'no photo')

    def test_photos_of_a_street(self):
        camera = at('scene.json')
        code, out, err = run('calibrate', '--scene', PHOTOS, '--out', camera, '--threads', '2',
                             '--json')
        self.assertEqual(code, 0, err)
        made = json.loads(out)
        self.assertEqual(made, json.loads(read(camera)))
        self.assertLess(abs(made['intrinsics']['fx'] / self.FOCAL - 1), 0.015)
        self.assertGreater(made['standard_deviations']['fx'], 0)
        self.assertGreaterEqual(made['calibration']['photos_used'], 4)
        self.assertIn('photos of a place', made['calibration']['from'])
        self.assertIn('notes.txt: left out: the file is not a JPEG', err)
        db = at('by scene')
        must('init', db)
        must('camera', 'add', db, 'phone', '--from', camera)
        self.assertEqual(ask('camera', 'list', db)[0]['name'], 'phone')

    def test_a_city_begins_with_them(self):
        db = at('begun')
        must('init', db)
        photos = [os.path.join(PHOTOS, name) for name in sorted(os.listdir(PHOTOS))
                  if name.endswith('.jpg')]
        code, out, err = run('add', db, '--json', '--threads', '2', *photos)
        self.assertEqual(code, 0, err)
        self.assertIn('nothing is placed yet', err)
        self.assertIn("the camera of 12 photos is 'photos of 512x384' now", err)
        camera, = ask('camera', 'list', db)
        self.assertLess(abs(float(camera['params'].split(',')[0]) / self.FOCAL - 1), 0.015)
        self.assertIn('photos together', camera['source'])
        self.assertGreaterEqual(ask('status', db)['placed'], 8)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_what_cannot_be_told(self):
        out = ('--out', at('never.json'))
        photos = [os.path.join(PHOTOS, f'photo{i:04}.jpg') for i in (1, 2)]
        self.refused(1, 'ten or more', 'calibrate', '--scene', *photos, *out)
        self.assertFalse(os.path.exists(at('never.json')))
        self.refused(2, '--scene', 'calibrate', '--scene', '--points', at('a'), *out)
        self.refused(2, '--scene', 'calibrate', '--scene', '--markers', '9', *photos, *out)
        self.refused(2, 'PHOTO', 'calibrate', '--scene', *out)
        db = at('begun by two')
        must('init', db)
        code, out, _ = run('add', db, *photos)
        self.assertNotEqual(code, 0)
        self.assertIn('begin a city with some ten photos', out)


class CameraFrom(Case):
    def test_files_of_other_programs(self):
        db = at('imported')
        must('init', db)
        colmap = points_file('cameras.txt', '# Camera list\n1 PINHOLE 640 480 500 510 320.5 240.5\n'
                             '2 OPENCV 640 480 500 500 320 240 -0.2 0.05 0.003 -0.0005\n')
        self.refused(1, 'choose one by --id: 1, 2', 'camera', 'add', db, 'a', '--from', colmap)
        self.refused(1, 'no camera 3', 'camera', 'add', db, 'a', '--from', colmap, '--id', '3')
        must('camera', 'add', db, 'a', '--from', colmap, '--id', '1')
        code, _, err = run('camera', 'add', db, 'b', '--from', colmap, '--id', '2')
        self.assertEqual(code, 0)
        self.assertRegex(err, r'off by 0\.\d+ px in the mean and \d\.\d+ px at most')
        self.assertIn('warning', err)
        yaml = points_file('opencv.yml', '%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n'
                           'camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n'
                           '   data: [ 533., 0., 341., 0., 534., 232., 0., 0., 1. ]\n'
                           'distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   '
                           'dt: d\n'
                           '   data: [ -0.28, 0.1, 0., 0. ]\n')
        must('camera', 'add', db, 'c', '--from', yaml)
        self.assertEqual([(c['name'], c['params']) for c in ask('camera', 'list', db)
                          if c['name'] != 'b'],
                         [('a', '500,510,320,240'), ('c', '533,534,341,232,-0.28,0.1')])

    def test_usage(self):
        db = at('usage')
        must('init', db)
        good = points_file('one.txt', '1 PINHOLE 640 480 500 510 320.5 240.5\n')
        self.refused(2, '--from', 'camera', 'add', db, 'a')
        self.refused(2, 'excludes', 'camera', 'add', db, 'a', '--from', good, '--size', '640x480')
        self.refused(2, '--id', 'camera', 'add', db, 'a', '--id', '1')
        self.refused(1, 'cannot read', 'camera', 'add', db, 'a', '--from', at('missing'))
        self.refused(1, 'is a folder', 'camera', 'add', db, 'a', '--from', db)
        for content in ('', 'rubbish', '{}', '%YAML:1.0\n---\nx: [', '{"format": "veduta camera"}',
                        '\0' * 100):
            self.refused(1, 'camera', 'camera', 'add', db, 'a', '--from',
                         points_file('bad', content))
        self.assertEqual(ask('camera', 'list', db), [])


if __name__ == '__main__':
    main()
