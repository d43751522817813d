#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: photos with GPS put the city on the earth without anybody asking; surveyed points put it
#   there exactly; the commands tell it, and models are exported in metres on the earth.
# Method: a rendered street with GPS in its photos, errors of 2 m; its truth, whose origin is known.
# usage: tests/cli/georeference_test.py VEDUTA VEDUTA_STREET [TEST...]
import json
import math
import os
import shutil
import struct

from city import Case, PARAMS, SIZE, add, ask, at, main, must, new_database, render, run
from daemon import Daemon

ORIGIN = (47.07, 15.44, 350.0)
GPS_M = 2.0
CITY = None


def metres(place):
    """East, north and up of the street's origin; the street is far too short for more terms."""
    latitude = math.radians(ORIGIN[0])
    north = 111132.954 - 559.822 * math.cos(2 * latitude) + 1.175 * math.cos(4 * latitude)
    east = (math.pi / 180) * 6378137.0 * math.cos(latitude) / math.sqrt(
        1 - 0.00669437999 * math.sin(latitude) ** 2)
    return ((place['longitude'] - ORIGIN[1]) * east, (place['latitude'] - ORIGIN[0]) * north,
            place['height'] - ORIGIN[2])


def truth(name):
    """K, rotation from camera to world, centre."""
    with open(at('gps', 'truth', name + '.camera'), encoding='utf-8') as file:
        rows = [[float(x) for x in line.split()] for line in file]
    return rows[0:3], rows[4:7], rows[7]


def seen(name, point):
    """Where the true camera sees the point; nothing outside of the photo."""
    k, world_from_cam, center = truth(name)
    away = [p - c for p, c in zip(point, center)]
    x, y, z = (sum(world_from_cam[j][i] * away[j] for j in range(3)) for i in range(3))
    if z <= 0:
        return None
    px = (k[0][0] * x / z + k[0][2], k[1][1] * y / z + k[1][2])
    return px if 0 <= px[0] <= 511 and 0 <= px[1] <= 383 else None


def write_ground_points(path, names, is_swapped=False):
    with open(path, 'w', encoding='utf-8') as file:
        file.write('EPSG:4326\n')
        for number, point in enumerate([(8, 6, 3), (12, 6.5, 1), (16, 6, 5), (10, -6, 2)]):
            latitude = ORIGIN[0] + point[1] / metres(
                {'latitude': ORIGIN[0] + 1, 'longitude': ORIGIN[1], 'height': 0})[1]
            longitude = ORIGIN[1] + point[0] / metres(
                {'latitude': ORIGIN[0], 'longitude': ORIGIN[1] + 1, 'height': 0})[0]
            place = f'{longitude:.10f} {latitude:.10f}'
            if is_swapped:
                place = f'{latitude:.10f} {longitude:.10f}'
            for name in names:
                px = seen(name, point)
                if px:
                    file.write(f'{place} {ORIGIN[2] + point[2]} {px[0]:.2f} {px[1]:.2f} {name} '
                               f'point{number} extra\n')


def without_exif(path, to):
    """The JPEG without its first segment, which is that of EXIF."""
    with open(path, 'rb') as file:
        jpeg = file.read()
    at_exif = jpeg.index(b'\xff\xe1')
    size, = struct.unpack('>H', jpeg[at_exif + 2:at_exif + 4])
    with open(to, 'wb') as file:
        file.write(jpeg[:at_exif] + jpeg[at_exif + 2 + size:])


def off(place, name):
    return math.dist(metres(place), truth(name)[2])


def setUpModule():
    global CITY
    photos = render('gps', '--photos', '24', '--length', '20', '--size', SIZE, '--gps',
                    str(GPS_M))
    CITY = new_database('city')
    code, lines, err = add(CITY, photos)
    assert code == 0, err
    assert all(pose['reconstruction'] == 1 for pose in
               (ask('pose', CITY, line['image']) for line in lines)), lines


class Georeference(Case):
    def names(self):
        return sorted(os.listdir(at('gps', 'photos')))

    def copy(self, name):
        shutil.copytree(CITY, at(name))
        return at(name)

    def test_the_city_is_on_the_earth(self):
        answer = ask('georeference', CITY)
        self.assertEqual(answer['ground_points'], [])
        earth, = answer['reconstructions']
        self.assertTrue(earth['known'])
        self.assertGreaterEqual(earth['gps']['agreeing'], 20)
        for name in self.names():
            shown = ask('show', CITY, name)
            self.assertEqual(shown['gps']['accuracy_m'], GPS_M)
            place = ask('pose', CITY, name)['on_earth']
            self.assertEqual(place, shown['on_earth'])
            self.assertLess(off(place, name), 3 * GPS_M)
            self.assertGreater(place['horizontal_stddev_m'], GPS_M / 2)
        self.assertRegex(must('pose', CITY, name), 'latitude 4[67]')
        self.assertIn('GPS positions agree', must('georeference', CITY))
        self.assertEqual(must('verify', CITY), 'sound\n')

    def test_geopose(self):
        name = self.names()[0]
        geopose = json.loads(must('pose', CITY, name, '--geopose'))
        self.assertEqual(set(geopose), {'position', 'quaternion'})
        self.assertEqual(set(geopose['position']), {'lat', 'lon', 'h'})
        place = ask('pose', CITY, name)['on_earth']
        self.assertEqual(geopose['position']['lat'], place['latitude'])
        x, y, z, w = (geopose['quaternion'][key] for key in 'xyzw')
        self.assertAlmostEqual(x * x + y * y + z * z + w * w, 1, places=12)
        # The optical axis, turned by the quaternion, looks along the heading.
        east, north = 2 * (x * z + w * y), 2 * (y * z - w * x)
        self.assertAlmostEqual(math.degrees(math.atan2(east, north)) % 360, place['heading_deg'],
                               places=6)
        self.refused(1, 'no image', 'pose', CITY, 'none.jpg', '--geopose')

    def test_who_prefers_a_geopose_gets_one(self):
        name = self.names()[5]
        told = ask('pose', CITY, name)
        geopose = json.loads(must('pose', CITY, name, '--geopose'))
        with Daemon(CITY) as daemon:
            tags = set()
            for path, accept, kind, wanted in (
                    ('pose', None, 'application/json', told),
                    ('pose', 'application/json, application/geopose+json', 'application/json',
                     told),
                    ('pose', 'application/geopose+json, */*;q=0.5', 'application/geopose+json',
                     geopose),
                    ('geopose', None, 'application/json', geopose),
                    ('geopose', 'application/geopose+json;version=1.0', 'application/geopose+json',
                     geopose)):
                headers = {'Accept': accept} if accept else {}
                code, answered, body = daemon.ask('GET', f'/v1/photos/{name}/{path}', None,
                                                  headers)
                self.assertEqual((code, answered['Content-Type'], answered['Vary']),
                                 (200, kind, 'Accept'), (path, accept))
                answer = json.loads(body)
                self.assertEqual(answer, {key: wanted[key] for key in answer})
                tags.add((kind, answered['ETag']))
                again = daemon.ask('GET', f'/v1/photos/{name}/{path}', None,
                                   {**headers, 'If-None-Match': answered['ETag']})
                self.assertEqual(again[0], 304)
            self.assertEqual(len({tag for _, tag in tags}), 2, 'each form has a tag of its own')

    def test_surveyed_points(self):
        db = self.copy('surveyed')
        write_ground_points(at('gcp.txt'), self.names())
        before = ask('georeference', db)['reconstructions'][0]['version']
        answer = ask('georeference', db, '--gcp', at('gcp.txt'), '--deviation', '0.02', '--by',
                     'surveyor')
        self.assertEqual(answer['reconstructions'][0]['version'], before + 1)
        self.assertGreaterEqual(answer['points_read'], 3)
        for point in answer['ground_points']:
            self.assertEqual(point['reconstruction'], 1)
            self.assertLess(max(map(abs, point['error_m'])), 0.1)
        for name in self.names():
            self.assertLess(off(ask('pose', db, name)['on_earth'], name), 0.3)
        self.assertIn('root mean square', must('georeference', db))
        last = must('journal', db).splitlines()[-1]
        self.assertEqual(json.loads(last)['action'], 'georeference')
        self.assertEqual(json.loads(last)['actor'], 'surveyor')
        self.assertEqual(must('verify', db), 'sound\n')
        answer = ask('georeference', db, '--forget')
        self.assertEqual(answer['ground_points'], [])
        self.assertTrue(answer['reconstructions'][0]['known'])

    def test_the_points_must_fit_where_nothing_else_tells_the_place(self):
        os.mkdir(at('bare'))
        names = self.names()[:12]
        for name in names:
            without_exif(at('gps', 'photos', name), at('bare', name))
        db = new_database('nowhere')
        code, _, err = add(db, at('bare'))
        self.assertEqual(code, 0, err)
        self.assertFalse(ask('georeference', db)['reconstructions'][0]['known'])
        only = next(name for name in names if seen(name, (12, 6.5, 1)))
        write_ground_points(at('few.txt'), [only])
        code, out, err = run('georeference', db, '--gcp', at('few.txt'))
        self.assertEqual(code, 1, out)
        self.assertIn('0 surveyed points are seen from different sides', err)
        self.assertIn('no two with poses', out)
        must('georeference', db, '--forget')
        # The axes in the wrong order. A mirror image of few points in one plane may fit after all,
        # but a street that stands on its head does not.
        write_ground_points(at('swapped.txt'), names, is_swapped=True)
        code, out, err = run('georeference', db, '--gcp', at('swapped.txt'))
        self.assertEqual(code, 1, out)
        self.assertIn('east comes before north', err)
        self.assertIn('the place of their reconstruction is not known', out)
        self.assertNotIn('no two with poses', out)
        told = ask('georeference', db)
        self.assertTrue(any(point['error_px'] for point in told['ground_points']))
        self.assertTrue(all(point['error_m'] is None for point in told['ground_points']))
        self.assertIsNone(told['coordinates'], 'nothing was read')
        write_ground_points(at('right.txt'), names)
        code, out, err = run('georeference', db, '--gcp', at('right.txt'))
        self.assertEqual((code, err), (0, ''), out)
        self.assertTrue(ask('georeference', db)['reconstructions'][0]['known'])

    def test_a_datum_that_is_known_to_metres_is_told(self):
        db = self.copy('datum')
        with open(at('datum.txt'), 'w', encoding='utf-8') as file:
            file.write(f'EPSG:27700\n400000 300000 50 100 100 {self.names()[0]} far\n')
        for options, is_told in (((), True), (('--deviation', '100'), False)):
            code, out, err = run('georeference', db, '--gcp', at('datum.txt'), '--json', *options)
            self.assertEqual(code, 0, err)
            coordinates = json.loads(out)['coordinates']
            self.assertEqual(coordinates['name'], 'EPSG:27700')
            self.assertGreater(coordinates['accuracy_m'], 1)
            self.assertIn('OSGB36 to WGS 84', coordinates['operation'])
            self.assertEqual('coordinates in EPSG:27700 are brought to WGS 84 by "OSGB36 to WGS 84'
                             in err, is_told, err)

    def test_surveyed_points_beside_a_daemon(self):
        beside, alone = self.copy('beside'), self.copy('alone')
        write_ground_points(at('beside.txt'), self.names()[:20])
        with open(at('beside.txt'), 'a', encoding='utf-8') as file:
            file.write('15.44 47.07 350 1 2 none.jpg point9\n')
        with Daemon(beside) as daemon:
            answers = []
            for db in (beside, alone):
                code, out, err = run('georeference', db, '--gcp', at('beside.txt'), '--by',
                                     'surveyor', '--json')
                self.assertEqual(code, 1, 'a line is left out')
                self.assertIn("no photo 'none.jpg'", err)
                self.assertNotIn('warning', err)
                answers.append(json.loads(out))
            told = answers[0]
            self.assertEqual(told, answers[1])
            self.assertEqual(told['unknown_photos'], ['none.jpg'])
            self.assertEqual((told['coordinates']['name'], told['coordinates']['accuracy_m']),
                             ('EPSG:4326', 0))
            self.refused(1, __file__ + ': line 1', 'georeference', beside, '--gcp', __file__)
            self.assertEqual(daemon.ask('POST', '/v1/georeference')[0], 403)
            self.assertEqual(daemon.get('/v1/georeference')['ground_points'],
                             told['ground_points'])
            self.assertEqual(ask('georeference', beside, '--forget')['ground_points'], [])
        must('georeference', alone, '--forget')
        self.assertEqual(must('digest', beside), must('digest', alone))

    def test_wrong_points_are_named(self):
        db = self.copy('wrong')
        digest = must('digest', db)
        for text, words in (('', 'is empty'), ('the moon\n', 'names no coordinates'),
                            ('EPSG:4326\n1 2\n', 'line 2'),
                            ('EPSG:4326\n15 47 0 1 2 none.jpg\n', 'none.jpg')):
            with open(at('wrong.txt'), 'w', encoding='utf-8') as file:
                file.write(text)
            self.refused(1, words, 'georeference', db, '--gcp', at('wrong.txt'))
        self.refused(1, 'no file.txt', 'georeference', db, '--gcp', at('no file.txt'))
        self.refused(2, 'deviation', 'georeference', db, '--deviation', '-1')
        self.assertEqual(must('digest', db), digest)

    def test_models_on_the_earth(self):
        self.refused(2, 'ply and gltf', 'export', CITY, at('no'), '--on-earth')
        model, = [json.loads(line) for line in must(
            'export', CITY, at('earth'), '--format', 'ply', '--on-earth', '--json').splitlines()]
        self.assertTrue(model['on_earth'])
        with open(at('earth', '0', 'earth.json'), encoding='utf-8') as file:
            earth = json.load(file)
        self.assertEqual((earth['scale'], earth['translation']), (1.0, [0.0, 0.0, 0.0]))
        origin = metres(earth['origin'])
        with open(at('earth', '0', 'cameras.json'), encoding='utf-8') as file:
            cameras = json.load(file)
        self.assertEqual(len(cameras), 24)
        for camera in cameras:
            there = [c + o for c, o in zip(camera['center'], origin)]
            self.assertLess(math.dist(there, truth(camera['name'])[2]), 3 * GPS_M)
        # In its own frame the model says how it gets there.
        must('export', CITY, at('own'), '--format', 'ply')
        with open(at('own', '0', 'earth.json'), encoding='utf-8') as file:
            own = json.load(file)
        self.assertNotEqual(own['scale'], 1.0)
        self.assertEqual(own['origin'], earth['origin'])
        must('export', CITY, at('gltf'), '--format', 'gltf', '--on-earth')
        with open(at('gltf', '0', 'model.glb'), 'rb') as file:
            magic, version, _ = struct.unpack('<4sII', file.read(12))
        self.assertEqual((magic, version), (b'glTF', 2))


if __name__ == '__main__':
    main()
