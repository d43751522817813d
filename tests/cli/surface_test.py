#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the daemon serves the dense surface as valid 3D Tiles 1.1, names of which stand for the same
#   bytes for ever, and the page shows it.
# Method: real daemons on a rendered street. The tileset is held against the rules of the
#   specification (OGC 22-025r4) by a reader written here; its contents are validated by Khronos's
#   gltf-validator from npm. Debian's chromium, driven by page/surface_test.mjs, sees the surface
#   appear and change. Pictures are left in PAGE_PICTURES, if that is set.
# usage: tests/cli/surface_test.py VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]
#   BUILT_PAGE: the folder in the build tree in which the page was built
import json
import math
import os
import shutil
import struct
import subprocess
import sys

from city import SIZE, Case, add, at, main, must, new_database, photo, render, write
from daemon import Daemon

if len(sys.argv) < 4:
    sys.exit(f'usage: {sys.argv[0]} VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]')
BUILT_PAGE = sys.argv.pop(3)
CHROMIUM = shutil.which('chromium')
NODE = shutil.which('node') or shutil.which('nodejs')
SURFACE = '/v1/reconstructions/1/surface/'
DENSE = ('--dense', '--dense-size', '128', '--device', 'cpp')


def setUpModule():
    """SPARSE, a city of a few photos of a street; LEFT, the path of one photo more."""
    global SPARSE, LEFT
    render('street', '--photos', '16', '--size', SIZE, '--gps', '0.05')
    for i in range(9, 14):  # they make one reconstruction, which the next one belongs to
        write(at('first', f'{i:02}.jpg'), photo(i))
    LEFT = at('left.jpg')
    write(LEFT, photo(14))
    SPARSE = new_database('sparse')
    code, _, err = add(SPARSE, at('first'))
    assert code == 0, err


def copy_of(db, name):
    shutil.copytree(db, at(name))
    return at(name)


def nodes_below(node):
    yield node
    for child in node.get('children', []):
        yield from nodes_below(child)


def corners(box):
    """Lowest and highest corner of an axis-aligned box of 12 numbers."""
    half = [box[3], box[7], box[11]]
    assert all(box[i] == 0 for i in (4, 5, 6, 8, 9, 10)) and min(half) > 0, box
    return [box[i] - half[i] for i in range(3)], [box[i] + half[i] for i in range(3)]


def contains(outer, inner):
    (outer_low, outer_high), (low, high) = corners(outer), corners(inner)
    return all(outer_low[i] <= low[i] + 1e-6 and high[i] <= outer_high[i] + 1e-6
               for i in range(3))


def content_box(glb):
    """Lowest and highest corner of a content, z up as 3D Tiles have it, and its triangles; None
    where it is empty."""
    magic, version, size, text = struct.unpack_from('<4sIII', glb)
    assert (magic, version, size) == (b'glTF', 2, len(glb))
    document = json.loads(glb[20:20 + text])
    if 'meshes' not in document:
        return None
    primitive = document['meshes'][0]['primitives'][0]
    position = document['accessors'][primitive['attributes']['POSITION']]
    x, y, z = document['nodes'][0]['translation']
    low, high = position['min'], position['max']
    return ([low[0] + x, -(high[2] + z), low[1] + y], [high[0] + x, -(low[2] + z), high[1] + y],
            document['accessors'][primitive['indices']]['count'] // 3)


class Surface(Case):
    def check_tileset(self, tileset):
        """The rules of the specification for what the daemon makes use of."""
        self.assertEqual(set(tileset), {'asset', 'geometricError', 'root'})
        self.assertEqual(tileset['asset']['version'], '1.1')
        root = tileset['root']
        self.assertEqual(root['refine'], 'REPLACE')
        self.assertGreaterEqual(tileset['geometricError'], root['geometricError'])
        for node in nodes_below(root):
            allowed = {'boundingVolume', 'geometricError', 'content', 'children'}
            self.assertLessEqual(set(node) - ({'refine', 'transform'} if node is root else set()),
                                 allowed)
            self.assertEqual(set(node['content']), {'uri'})
            self.assertTrue(math.isfinite(node['geometricError']))
            self.assertGreaterEqual(node['geometricError'], 0)
            self.assertNotEqual(node.get('children'), [], 'no empty list of children')
            for child in node.get('children', []):
                self.assertLess(child['geometricError'], node['geometricError'])
                self.assertTrue(contains(node['boundingVolume']['box'],
                                         child['boundingVolume']['box']))
        uris = [node['content']['uri'] for node in nodes_below(root)]
        self.assertEqual(len(uris), len(set(uris)))

    def check_place(self, root, georeference):
        """The transform puts the origin of the world where the reconstruction says that it is."""
        place = georeference['reconstructions'][0]
        self.assertTrue(place['known'])
        transform = root['transform']
        self.assertEqual((len(transform), transform[15]), (16, 1))
        scale = math.hypot(*transform[0:3])
        self.assertAlmostEqual(scale / place['scale'], 1, 9)
        # The origin of its metres is within its translation of it.
        latitude, longitude = (math.radians(place['origin'][key])
                               for key in ('latitude', 'longitude'))
        bulge = 6378137 / math.sqrt(1 - 0.00669437999014 * math.sin(latitude) ** 2)
        height = place['origin']['height']
        origin = ((bulge + height) * math.cos(latitude) * math.cos(longitude),
                  (bulge + height) * math.cos(latitude) * math.sin(longitude),
                  (bulge * (1 - 0.00669437999014) + height) * math.sin(latitude))
        self.assertAlmostEqual(math.dist(origin, transform[12:15]),
                               math.hypot(*place['translation']), 3)

    def check_content(self, node, glb):
        """How many triangles it has."""
        found = content_box(glb)
        if found is None:
            return 0
        low, high = corners(node['boundingVolume']['box'])
        for i in range(3):
            self.assertGreaterEqual(found[0][i], low[i] - 1e-6)
            self.assertLessEqual(found[1][i], high[i] + 1e-6)
        return found[2]

    def test_the_surface_is_served_as_3d_tiles(self):
        db = copy_of(SPARSE, 'dense')
        with Daemon(db) as daemon:
            code, headers, body = daemon.ask('GET', SURFACE + 'tileset.json')
            self.assertEqual((code, headers['Content-Type']), (404, 'application/problem+json'))
            self.assertIn('veduta densify', json.loads(body)['detail'])
        report = json.loads(must('densify', db, '--size', '160', '--device', 'cpp', '--json'))
        paths, triangles = [], 0
        with Daemon(db) as daemon:
            code, headers, body = daemon.ask('GET', SURFACE + 'tileset.json')
            self.assertEqual((code, headers['Content-Type']), (200, 'application/json'))
            tileset, tag = json.loads(body), headers['ETag']
            self.check_tileset(tileset)
            self.check_place(tileset['root'], daemon.get('/v1/georeference'))
            self.assertEqual(daemon.ask('GET', SURFACE + 'tileset.json',
                                        headers={'If-None-Match': tag})[0::2], (304, b''))
            for node in nodes_below(tileset['root']):
                uri = node['content']['uri']
                code, headers, glb = daemon.ask('GET', SURFACE + uri)
                self.assertEqual((code, headers['Content-Type']), (200, 'model/gltf-binary'), glb)
                self.assertIn('immutable', headers['Cache-Control'])
                self.assertEqual(daemon.ask('GET', SURFACE + uri,
                                            headers={'If-None-Match': headers['ETag']})[0], 304)
                count = self.check_content(node, glb)
                triangles += count if 'children' not in node else 0
                paths.append(at('contents', os.path.basename(uri)))
                write(paths[-1], glb)
            self.assertEqual(triangles, report['triangles'])
            self.assertGreater(len(paths), 8)
            for wrong in ('tiles/none.glb', 'tiles/0_0_0_0_0123456789abcdef.glb', 'tiles/..',
                          'tiles/' + 'x' * 5000):
                self.assertEqual(daemon.ask('GET', SURFACE + wrong)[0], 404, wrong)
            self.assertEqual(daemon.ask('GET', '/v1/reconstructions/0/surface/tileset.json')[0],
                             400)
            self.assertEqual(daemon.ask('GET', '/v1/reconstructions/9/surface/tileset.json')[0],
                             404)
        if NODE is None:
            self.skipTest('there is no node: tools/install.sh installs it')
        done = subprocess.run([NODE, os.path.join(BUILT_PAGE, 'test', 'contents_check.mjs'),
                               *paths], capture_output=True)
        self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())
        self.assertIn(f'{len(paths)} files, 0 issues', done.stdout.decode())

    def test_what_is_wrong_with_a_content_is_found(self):
        if NODE is None:
            self.skipTest('there is no node: tools/install.sh installs it')
        write(at('wrong.glb'), b'glTF' + struct.pack('<II', 2, 12))
        done = subprocess.run([NODE, os.path.join(BUILT_PAGE, 'test', 'contents_check.mjs'),
                               at('wrong.glb')], capture_output=True)
        self.assertEqual(done.returncode, 1)
        outer = [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
        self.assertFalse(contains(outer, [0.5, *outer[1:]]))

    def test_the_page_shows_it(self):
        if CHROMIUM is None or NODE is None:
            self.skipTest('there is no chromium, or no node: tools/install.sh installs them')
        pictures = os.environ.get('PAGE_PICTURES', at('pictures'))
        with Daemon(copy_of(SPARSE, 'page'), *DENSE) as daemon:
            done = subprocess.run(
                [NODE, os.path.join(BUILT_PAGE, 'test', 'surface_test.mjs'),
                 'http://' + daemon.host, LEFT, pictures, CHROMIUM], capture_output=True)
        print(done.stdout.decode())
        self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())


if __name__ == '__main__':
    main()
