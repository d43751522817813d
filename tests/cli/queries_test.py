#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what a database is asked for agrees with itself: status, show, pose, neighbors, the COLMAP
#   export, journal, copy and vocabulary tell the same city.
# Method: photos of a rendered street; every answer is compared with another command's.
# usage: tests/cli/queries_test.py VEDUTA VEDUTA_STREET
import json
import math
import os

from city import (PARAMS, PHOTOS, SIZE, WHOLE, Case, add, ask, at, main, make_whole, must,
                  new_database, photo, read, render, run, write)


def setUpModule():
    global WHOLE_LINES, WHOLE_DIGEST
    WHOLE_LINES, WHOLE_DIGEST = make_whole()


def rows_of(folder, name):
    """The fields of every line that is no comment."""
    with open(os.path.join(folder, name)) as file:
        return [line.split() for line in file if not line.startswith('#')]


def project(camera, p):
    """COLMAP's PINHOLE or OPENCV (without its tangential terms, which are 0)."""
    fx, fy, cx, cy, k1, k2 = (*camera, 0, 0)[:6]
    assert p[2] > 0
    x, y = p[0] / p[2], p[1] / p[2]
    factor = 1 + k1 * (x * x + y * y) + k2 * (x * x + y * y) ** 2
    return fx * x * factor + cx, fy * y * factor + cy


def rotate(wxyz, p):
    w, x, y, z = wxyz
    return [(1 - 2 * (y * y + z * z)) * p[0] + 2 * (x * y - w * z) * p[1]
            + 2 * (x * z + w * y) * p[2],
            2 * (x * y + w * z) * p[0] + (1 - 2 * (x * x + z * z)) * p[1]
            + 2 * (y * z - w * x) * p[2],
            2 * (x * z - w * y) * p[0] + 2 * (y * z + w * x) * p[1]
            + (1 - 2 * (x * x + y * y)) * p[2]]


class Ask(Case):
    def test_status(self):
        status = ask('status', WHOLE)
        self.assertEqual(status['images'], 12)
        self.assertEqual(status['placed'] + status['postponed'] + status['rejected'], 12)
        self.assertEqual(sum(r['images'] for r in status['reconstructions']), status['placed'])
        sizes = [r['images'] for r in status['reconstructions']]
        self.assertEqual(sizes, sorted(sizes, reverse=True))
        for r in status['reconstructions']:
            self.assertGreater(r['points'], 50)
            self.assertTrue(0 < r['reprojection_error_px_mean'] < 1.3)
        self.assertIn(f'12 images: {status["placed"]} placed', must('status', WHOLE))

    def test_show_and_pose(self):
        placed = 0
        for line in WHOLE_LINES:
            shown = ask('show', WHOLE, line['image'])
            self.assertEqual(shown, ask('show', WHOLE, f'#{line["id"]}'))
            self.assertEqual((shown['image'], shown['contributor'], shown['width'],
                              shown['height']),
                             (line['image'], 'anna', 512, 384))
            self.assertIn(shown['verdict'], must('show', WHOLE, line['image']))
            if shown['reconstruction'] is None:
                self.assertEqual(shown['verdict'], 'postponed')
                self.assertIsNone(shown['uncertainty'])
                self.refused(1, 'has no pose', 'pose', WHOLE, line['image'])
                continue
            placed += 1
            pose = ask('pose', WHOLE, line['image'])
            self.assertEqual(pose['reconstruction'], shown['reconstruction'])
            back = rotate(pose['rotation_wxyz'], pose['center'])
            for a, b in zip(back, pose['translation']):
                self.assertAlmostEqual(a, -b, places=9)  # x_in_cam = R x + t, so R c = -t
            told = must('pose', WHOLE, line['image'])
            self.assertIn(f'reconstruction {pose["reconstruction"]}\n', told)
            sure = pose['uncertainty']
            self.assertEqual(shown['uncertainty'], sure)
            variances = [sure['covariance'][i][i] for i in range(6)]
            self.assertGreater(min(variances), 0)
            self.assertAlmostEqual(math.degrees(math.sqrt(sum(variances[:3]))),
                                   sure['rotation_stddev_deg'])
            self.assertAlmostEqual(math.sqrt(sum(variances[3:])), sure['center_stddev'])
            self.assertLess(sure['rotation_stddev_deg'], 1)
            self.assertEqual(sure['points'], shown['observations'])
            self.assertIn(f'{variances[5]:.5g}', told.splitlines()[-1])
            self.assertIn('standard deviation', must('show', WHOLE, line['image']))
        self.assertEqual(placed, ask('status', WHOLE)['placed'])
        for command in ('show', 'pose'):
            for name in ('nobody.jpg', '#99', '#', ''):
                self.refused(1, 'no image', command, WHOLE, name)

    def test_neighbors(self):
        for line in WHOLE_LINES:
            listed = ask('neighbors', WHOLE, line['image'])
            matches = [neighbor['matches'] for neighbor in listed]
            self.assertEqual(matches, sorted(matches, reverse=True))
            for neighbor in listed:  # neighbours are mutual
                back = {n['image']: n['matches'] for n in ask('neighbors', WHOLE,
                                                              neighbor['image'])}
                self.assertEqual(back[line['image']], neighbor['matches'])
        # A file that is not stored: the pixels of one that is, with a byte more.
        write(at('new', 'a new one.jpg'), photo(5) + b'\0')
        ranked = ask('neighbors', WHOLE, at('new', 'a new one.jpg'), '--camera', 'c', '--count',
                     '3')
        self.assertEqual(len(ranked), 3)
        self.assertEqual(ranked[0]['image'], 'photo0005.jpg')
        self.assertGreater(ranked[0]['score'], 2 * ranked[1]['score'])
        self.assertIn('photo0005.jpg', must('neighbors', WHOLE,
                                            at('new', 'a new one.jpg')).splitlines()[0])
        self.refused(1, 'neither an image in the database nor a file', 'neighbors', WHOLE,
                     'nobody.jpg')
        self.refused(1, 'no camera', 'neighbors', WHOLE, at('new', 'a new one.jpg'), '--camera',
                     'd')
        self.refused(1, 'not a JPEG, PNG, TIFF, WebP or HEIC', 'neighbors', WHOLE,
                     at('street', 'camera.txt'))
        self.assertEqual(must('digest', WHOLE), WHOLE_DIGEST)

    def test_localize(self):
        # The pixels of a stored photo, with a byte more; a stored one; and one that is no photo.
        write(at('asked', 'a new one.jpg'), photo(5) + b'\0')
        write(at('asked', 'known.jpg'), photo(6))
        command = ('localize', WHOLE, '--camera', 'c', '--json')
        new, known = (json.loads(line) for line in must(*command, at('asked')).splitlines())
        for line, name, number in ((new, 'a new one.jpg', 5), (known, 'known.jpg', 6)):
            stored = ask('pose', WHOLE, f'photo{number:04}.jpg')
            self.assertEqual((line['image'], line['verdict'], line['reconstruction']),
                             (name, 'localized', stored['reconstruction']))
            for a, b in zip(line['pose']['rotation_wxyz'], stored['rotation_wxyz']):
                self.assertAlmostEqual(a, b, delta=1e-3)
            back = rotate(line['pose']['rotation_wxyz'], line['pose']['center'])
            for a, b in zip(back, line['pose']['translation']):
                self.assertAlmostEqual(a, -b, places=9)
            self.assertTrue(line['support'])
            self.assertGreater(line['uncertainty']['center_stddev'], 0)
        self.assertIsNone(new['stored'])
        self.assertEqual(new['support'][0]['image'], 'photo0005.jpg')
        self.assertEqual(f'#{known["stored"]}', f'#{ask("show", WHOLE, "photo0006.jpg")["id"]}')
        told = must('localize', WHOLE, '--camera', 'c', at('asked'))
        self.assertIn('localized  a new one.jpg', told)
        self.assertIn('standard deviation of the centre', told)

        # Of an unknown camera: the focal length is found as well.
        unknown = json.loads(must('localize', WHOLE, '--json', at('asked', 'a new one.jpg')))
        focal = float(PARAMS.split(',')[0])
        self.assertEqual(unknown['verdict'], 'localized')
        self.assertAlmostEqual(unknown['camera']['focal'] / focal, 1, delta=0.02)
        self.assertGreater(unknown['camera']['focal_stddev'], 0)
        self.assertIsNone(new['camera'])
        for a, b in zip(unknown['pose']['center'], new['pose']['center']):
            self.assertAlmostEqual(a, b, delta=0.2)
        self.assertIn('focal length', must('localize', WHOLE, at('asked', 'a new one.jpg')))

        write(at('asked too', 'text.jpg'), b'no photo')
        code, out, _ = run(*command, at('asked too'), at('asked', 'known.jpg'))
        self.assertEqual((code, [json.loads(line)['verdict'] for line in out.splitlines()]),
                         (1, ['rejected', 'localized']))
        self.refused(1, 'no camera', 'localize', WHOLE, '--camera', 'd', at('asked'))
        self.refused(2, 'camera', 'localize', WHOLE, '--camera', '', at('asked'))
        self.refused(1, 'nobody.jpg', 'localize', WHOLE, '--camera', 'c', at('nobody.jpg'))
        self.refused(2, 'PHOTO or --list', 'localize', WHOLE, '--camera', 'c')
        self.assertEqual(must('digest', WHOLE), WHOLE_DIGEST)

    def test_export_agrees_with_pose(self):
        must('export', WHOLE, at('exported'), '--format', 'colmap')
        reconstructions = ask('status', WHOLE)['reconstructions']
        self.assertEqual(sorted(os.listdir(at('exported'))),
                         [str(i) for i in range(len(reconstructions))])
        for i, reconstruction in enumerate(reconstructions):
            self.check_model(WHOLE, at('exported', str(i)), reconstruction,
                             ['PINHOLE', 450.56, 450.56, 256, 192])
        self.refused(1, 'not empty', 'export', WHOLE, at('exported'))

    def test_export_of_bent_photos(self):
        bent = render('bent', '--photos', '6', '--size', SIZE, '--k1', '-0.1', '--k2', '0.02')
        for name, more, camera in (
                ('opencv', ',-0.1,0.02', ['OPENCV', 450.56, 450.56, 256, 192, -0.1, 0.02, 0, 0]),
                # COLMAP has no centre of distortion: such photos go out straight.
                ('own centre', ',-0.1,0.02,256,191', ['PINHOLE', 450.56, 450.56, 256, 192])):
            must('init', at(name))
            must('camera', 'add', at(name), 'c', '--size', SIZE, '--params', PARAMS + more)
            self.assertEqual(add(at(name), bent)[0], 0)
            must('export', at(name), at(name + ' model'))
            self.check_model(at(name), at(name + ' model', '0'),
                             ask('status', at(name))['reconstructions'][0], camera)

    def check_model(self, db, folder, reconstruction, camera):
        """The camera has half a pixel more than ours: the corner of COLMAP's first pixel is at 0,
        and so is the centre of ours."""
        row, = rows_of(folder, 'cameras.txt')
        self.assertEqual(row[:4], ['1', camera[0], '512', '384'])
        self.assertEqual(list(map(float, row[4:])), camera[1:])
        points = {row[0]: row[1:] for row in rows_of(folder, 'points3D.txt')}
        self.assertEqual(len(points), reconstruction['points'])
        rows = rows_of(folder, 'images.txt')
        self.assertEqual(len(rows), 2 * reconstruction['images'])
        errors, tracks = [], set()
        for pose, features in zip(rows[::2], rows[1::2]):
            stored = ask('pose', db, pose[9])
            self.assertEqual(stored['reconstruction'], reconstruction['id'])
            self.assertEqual(ask('show', db, pose[9])['id'], int(pose[0]))
            rotation, translation = list(map(float, pose[1:5])), list(map(float, pose[5:8]))
            self.assertEqual((rotation, translation, pose[8]),
                             (stored['rotation_wxyz'], stored['translation'], row[0]))
            for feature in range(len(features) // 3):
                u, v, point = features[3 * feature:3 * feature + 3]
                if point == '-1':
                    continue
                tracks.add((point, pose[0], str(feature)))
                turned = rotate(rotation, list(map(float, points[point][:3])))
                at_u, at_v = project(camera[1:], [a + b for a, b in zip(turned, translation)])
                errors.append(((at_u - float(u)) ** 2 + (at_v - float(v)) ** 2) ** 0.5)
        self.assertEqual(len(errors), reconstruction['observations'])
        # Ours is measured in the straightened photo, where distances differ by a few per cent.
        error_mean = sum(errors) / len(errors)
        self.assertAlmostEqual(error_mean / reconstruction['reprojection_error_px_mean'], 1,
                               delta=1e-4 if camera[0] == 'PINHOLE' else 0.1)
        told = {(point, *one[i:i + 2]) for point, one in points.items()
                for i in range(7, len(one), 2)}
        self.assertEqual(told, tracks)

    def test_journal(self):
        lines = [json.loads(line) for line in must('journal', WHOLE).splitlines()]
        self.assertEqual([line['sequence'] for line in lines], list(range(1, len(lines) + 1)))
        added = [line for line in lines if line['action'] == 'add']
        self.assertEqual([(line['image'], line['actor']) for line in added],
                         [(i, 'anna') for i in range(1, 13)])
        self.assertEqual([json.loads(line) for line in must('journal', WHOLE, '--from',
                                                            '5').splitlines()], lines[4:])

    def test_copy_is_a_database(self):
        must('copy', WHOLE, at('copied'))
        self.assertEqual(must('digest', at('copied')), WHOLE_DIGEST)
        self.assertEqual(must('verify', at('copied')), 'sound\n')
        self.refused(1, 'exists', 'copy', WHOLE, at('copied'))
        code, lines, _ = add(at('copied'), PHOTOS)
        self.assertEqual((code, {line['verdict'] for line in lines}), (0, {'duplicate'}))

    def test_vocabulary(self):
        self.refused(1, 'no vocabulary yet', 'vocabulary', 'info', WHOLE)
        self.refused(1, 'no vocabulary yet', 'vocabulary', 'export', WHOLE, at('none.tree'))
        trained = at('trained')
        must('copy', WHOLE, trained)
        must('vocabulary', 'train', trained)
        info = json.loads(must('vocabulary', 'info', trained))
        self.assertEqual((info['generation'], info['images_at_training'], info['imported']),
                         (1, 12, False))
        self.assertGreater(info['words'], 100)
        must('vocabulary', 'train', trained, '--branch', '4', '--levels', '3', '--sample', '2000')
        shaped = json.loads(must('vocabulary', 'info', trained))
        self.assertEqual((shaped['generation'], shaped['branch'], shaped['depth'],
                          shaped['training_descriptors']), (2, 4, 3, 2000))
        self.assertLessEqual(shaped['words'], 64)
        self.refused(1, 'branch is 65, but must be',
                     'vocabulary', 'train', trained, '--branch', '65')
        must('vocabulary', 'train', trained)
        info = json.loads(must('vocabulary', 'info', trained))
        self.assertEqual(must('verify', trained), 'sound\n')
        must('vocabulary', 'export', trained, at('a.tree'))
        self.refused(1, 'cannot write', 'vocabulary', 'export', trained, at('no', 'such', 'folder'))
        # A stored photo, asked for as if it were new, scores 1.
        ranked = ask('neighbors', trained, os.path.join(PHOTOS, 'photo0004.jpg'))
        self.assertEqual((ranked[0]['image'], round(ranked[0]['score'], 6)), ('photo0004.jpg', 1))

        young = new_database('young')
        must('vocabulary', 'import', young, at('a.tree'))
        imported = json.loads(must('vocabulary', 'info', young))
        self.assertTrue(imported['imported'])
        self.assertEqual({key: imported[key] for key in ('branch', 'depth', 'words')},
                         {key: info[key] for key in ('branch', 'depth', 'words')})
        code, lines, _ = add(young, PHOTOS)
        self.assertEqual((code, len(lines)), (0, 12))
        self.assertEqual(must('verify', young), 'sound\n')
        must('vocabulary', 'export', young, at('b.tree'))
        self.assertEqual(read(at('b.tree')), read(at('a.tree')))
        write(at('half.tree'), read(at('a.tree'))[:5000])
        for path, words in ((at('half.tree'), 'not a vocabulary'),
                            (os.path.join(PHOTOS, 'photo0001.jpg'), 'not a'),
                            (at('no.tree'), 'cannot read')):
            self.refused(1, words, 'vocabulary', 'import', young, path)


if __name__ == '__main__':
    main()
