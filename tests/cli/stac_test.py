#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the daemon serves its photos as STAC: items that are valid and true, found by when and where
#   they were taken, in pages that stand while photos come and go.
# Method: a real daemon on a rendered street whose photos tell where they were taken, and some of
#   them when. Answers are held against the rules of STAC 1.0.0, STAC API 1.0.0 and OGC API Features
#   by a reader written here, and against the types that stac-ts has made of STAC's schemas; the
#   description of the API is validated by the schema of OpenAPI. Both are packages of npm.
# usage: tests/cli/stac_test.py VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]
#   BUILT_PAGE: the folder in the build tree in which the page was built
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.parse

from city import SIZE, Case, add, at, main, must, new_database, photo, render, write
from daemon import JPEG, Daemon
from exif_time import with_time

if len(sys.argv) < 4:
    sys.exit(f'usage: {sys.argv[0]} VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]')
BUILT_PAGE = sys.argv.pop(3)
NODE = shutil.which('node') or shutil.which('nodejs')
STAC = '/v1/stac'
ITEMS = STAC + '/collections/photos/items'
MOMENT = re.compile(r'\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ')
# Of photo 9, and of photo 10, whose camera does not tell its zone.
TIMES = {9: ('2023:11:14 22:13:20', '+01:00'), 10: ('2024:02:29 12:00:00', None)}


def setUpModule():
    """CITY, a database of five photos that make a reconstruction with a place on the earth."""
    global CITY
    render('street', '--photos', '16', '--size', SIZE, '--gps', '0.05')
    for i in range(9, 14):
        data = photo(i)
        write(at('first', f'{i:02}.jpg'), with_time(data, *TIMES[i]) if i in TIMES else data)
    CITY = new_database('city')
    code, _, err = add(CITY, at('first'))
    assert code == 0, err


def copy_of(name):
    shutil.copytree(CITY, at(name))
    return at(name)


class Stac(Case):
    def check_links(self, daemon, links):
        for link in links:
            self.assertLessEqual({'rel', 'href'}, set(link))
            self.assertTrue(link['href'].startswith(f'http://{daemon.host}/v1/'), link)

    def check_item(self, daemon, item):
        """The rules of STAC's item specification, and that what it links to is there."""
        self.assertLessEqual({'type', 'stac_version', 'id', 'geometry', 'properties', 'links',
                              'assets', 'collection', 'stac_extensions'}, set(item))
        self.assertEqual((item['type'], item['stac_version']), ('Feature', '1.0.0'))
        properties = item['properties']
        if properties['datetime'] is None:
            self.assertRegex(properties['start_datetime'], MOMENT)
            self.assertLess(properties['start_datetime'], properties['end_datetime'])
        else:
            self.assertRegex(properties['datetime'], MOMENT)
        if item['geometry'] is None:
            self.assertNotIn('bbox', item)
        else:
            longitude, latitude = item['geometry']['coordinates']
            self.assertEqual(item['bbox'], [longitude, latitude] * 2)
        if 'view:off_nadir' in properties:
            self.assertTrue(0 <= properties['view:off_nadir'] <= 90)
        self.check_links(daemon, item['links'])
        for asset in item['assets'].values():
            self.assertIsInstance(asset['roles'], list)
            self.assertIsInstance(asset['roles'][0], str)
            code, headers, data = daemon.ask('GET', self.path_of(asset['href']))
            self.assertEqual((code, headers['Content-Type']), (200, asset['type']))
            self.assertEqual(len(data), asset.get('file:size', len(data)))
        for link in item['links']:
            code, headers, _ = daemon.ask('GET', self.path_of(link['href']))
            self.assertEqual((code, headers['Content-Type']), (200, link['type']), link)

    def path_of(self, href):
        parts = urllib.parse.urlsplit(href)
        return parts.path + ('?' + parts.query if parts.query else '')

    def ids(self, features):
        return [int(item['id']) for item in features['features']]

    def search(self, daemon, **members):
        code, headers, body = daemon.ask('POST', STAC + '/search', json.dumps(members),
                                         {'Content-Type': 'application/json'})
        self.assertEqual((code, headers['Content-Type']), (200, 'application/geo+json'), body)
        return json.loads(body)

    def node(self, script, *paths):
        if NODE is None:
            self.skipTest('there is no node: tools/install.sh installs it')
        done = subprocess.run([NODE, os.path.join(BUILT_PAGE, 'test', script), *paths],
                              capture_output=True)
        return done.returncode, (done.stdout + done.stderr).decode()

    def test_the_catalog_leads_to_all_items(self):
        with Daemon(CITY) as daemon:
            root = daemon.get(STAC)
            self.assertEqual((root['type'], root['stac_version']), ('Catalog', '1.0.0'))
            self.check_links(daemon, root['links'])
            rels = {link['rel'] for link in root['links']}
            self.assertLessEqual({'self', 'root', 'service-desc', 'conformance', 'data', 'search'},
                                 rels)
            self.assertEqual({link['method'] for link in root['links'] if link['rel'] == 'search'},
                             {'GET', 'POST'})
            conformance = daemon.get(STAC + '/conformance')
            self.assertEqual(conformance['conformsTo'], root['conformsTo'])
            for link in root['links']:
                if link.get('method') != 'POST':
                    self.assertEqual(daemon.ask('GET', self.path_of(link['href']))[0], 200, link)
            listed = daemon.get(STAC + '/collections')['collections']
            collection = daemon.get(STAC + '/collections/photos')
            self.assertEqual(listed, [collection])
            west, south, east, north = collection['extent']['spatial']['bbox'][0]
            self.assertTrue(-180 <= west <= east <= 180 and -90 <= south <= north <= 90)
            items = daemon.get(ITEMS)
            self.assertEqual(items['type'], 'FeatureCollection')
            self.assertEqual(len(items['features']), 5)
            paths = [at('catalog.json'), at('collection.json')]
            write(paths[0], json.dumps(root).encode())
            write(paths[1], json.dumps(collection).encode())
            for item in items['features']:
                self.check_item(daemon, item)
                longitude, latitude = item['geometry']['coordinates']
                self.assertTrue(west <= longitude <= east and south <= latitude <= north)
                self.assertEqual(daemon.get(f'{ITEMS}/{item["id"]}'), item)
                paths.append(at(f'item{item["id"]}.json'))
                write(paths[-1], json.dumps(item).encode())
            for wrong in ('/99', '/x', '/4294967295', '/0'):
                self.assertEqual(daemon.ask('GET', ITEMS + wrong)[0], 404, wrong)
            self.assertEqual(daemon.ask('GET', STAC + '/collections/x/items')[0], 404)
        code, text = self.node('stac_check.mjs', *paths)
        self.assertEqual((code, text.strip()), (0, f'{len(paths)} files, 0 issues'))

    def test_what_is_wrong_with_an_item_is_found(self):
        write(at('wrong.json'), b'{"type":"Feature","stac_version":"1.0.0","id":7}')
        code, text = self.node('stac_check.mjs', at('wrong.json'))
        self.assertEqual(code, 1, text)
        write(at('wrong_api.json'), b'{"openapi":"3.0.3","paths":{}}')
        code, text = self.node('openapi_check.mjs', at('wrong_api.json'))
        self.assertEqual(code, 1, text)

    def test_the_description_of_the_api_is_valid(self):
        with Daemon(CITY) as daemon:
            write(at('openapi.json'), json.dumps(daemon.get('/v1/openapi.json')).encode())
        code, text = self.node('openapi_check.mjs', at('openapi.json'))
        self.assertEqual((code, text.strip()), (0, 'OpenAPI 3.0: valid'))

    def test_items_tell_what_is_known_and_no_more(self):
        with Daemon(CITY) as daemon:
            first, second, third = daemon.get(ITEMS)['features'][:3]
            told = first['properties']
            self.assertEqual(told['datetime'], '2023-11-14T21:13:20Z')
            self.assertEqual(told['veduta:camera_clock'], '2023-11-14T22:13:20')
            self.assertNotIn('start_datetime', told)
            told = second['properties']
            self.assertIsNone(told['datetime'])
            self.assertEqual((told['start_datetime'], told['end_datetime']),
                             ('2024-02-28T22:00:00Z', '2024-03-01T00:00:00Z'))
            told = third['properties']
            self.assertIsNone(told['datetime'])
            self.assertEqual((told['start_datetime'], told['end_datetime']),
                             ('1826-01-01T00:00:00Z', told['created']))
            self.assertNotIn('veduta:camera_clock', told)
            shown = daemon.get('/v1/photos/09.jpg')
            self.assertEqual(shown['taken'], {'clock': '2023-11-14T22:13:20', 'offset_s': 3600})
            earth = shown['on_earth']
            self.assertEqual(first['properties']['veduta:position'], 'pose')
            self.assertEqual(first['geometry']['coordinates'],
                             [earth['longitude'], earth['latitude']])
            self.assertEqual(first['properties']['view:azimuth'], earth['heading_deg'])
            self.assertEqual(first['assets']['photo']['file:checksum'], '1220' + shown['sha256'])
            self.assertEqual(first['assets']['photo']['proj:shape'],
                             [shown['height'], shown['width']])
            self.assertNotIn('license', first['properties'])
        self.assertEqual(must('verify', CITY, '--deep'), 'sound\n')

    def test_a_search_by_time_and_place(self):
        with Daemon(CITY) as daemon:
            everything = daemon.get(ITEMS)['features']
            for query, wanted in (
                    ('datetime=2023-11-14T21:13:20Z', [1, 3, 4, 5]),
                    ('datetime=2023-11-14T21:13:21Z', [3, 4, 5]),
                    ('datetime=2024-02-29T23:00:00Z/..', [2, 3, 4, 5]),
                    ('datetime=../1825-12-31T23:59:59Z', []),
                    ('ids=2,5,77,x', [2, 5]), ('ids=2&collections=other', []),
                    ('bbox=-180,-90,180,90', [1, 2, 3, 4, 5]), ('bbox=0,-90,1,-80', [])):
                self.assertEqual(self.ids(daemon.get(f'{STAC}/search?{query}')), wanted, query)
            longitude, latitude = everything[1]['geometry']['coordinates']
            tiny = [longitude - 1e-9, latitude - 1e-9, longitude + 1e-9, latitude + 1e-9]
            self.assertEqual(self.ids(self.search(daemon, bbox=tiny)), [2])
            west, south, east, north = tiny
            ring = [[west, south], [east, south], [east, north], [west, north], [west, south]]
            area = {'type': 'Polygon', 'coordinates': [ring]}
            self.assertEqual(self.ids(self.search(daemon, intersects=area)), [2])
            self.assertEqual(self.ids(daemon.get(
                STAC + '/search?intersects=' + urllib.parse.quote(json.dumps(area)))), [2])
            self.assertEqual(self.ids(self.search(daemon, intersects=area, ids=['3'])), [])
            for wrong in ('bbox=1,2,3', 'limit=0', 'datetime=yesterday', 'sortby=id', 'token=x',
                          'bbox=0,0,1,1&intersects=' + urllib.parse.quote(json.dumps(area))):
                self.assertEqual(daemon.ask('GET', f'{STAC}/search?{wrong}')[0], 400, wrong)
            for body, kind, wanted in (('[]', 'application/json', 400),
                                       ('{"limit":1}', 'text/plain', 415),
                                       ('{"x":1}', 'application/json', 400),
                                       ('{"ids":' + 16 * '[' + 16 * ']' + '}', 'application/json',
                                        400)):
                self.assertEqual(daemon.ask('POST', STAC + '/search', body,
                                            {'Content-Type': kind})[0], wanted)

    def test_pages_stand_while_photos_come_and_go(self):
        with Daemon(copy_of('paged')) as daemon:
            page = daemon.get(ITEMS + '?limit=2')
            self.assertEqual(self.ids(page), [1, 2])
            code, _, answer = daemon.send('14.jpg', photo(14))
            self.assertEqual(code, 201, answer)
            must('remove', at('paged'), '13.jpg')
            seen = self.ids(page)
            while True:
                links = [link for link in page['links'] if link['rel'] == 'next']
                if not links:
                    break
                page = daemon.get(self.path_of(links[0]['href']))
                self.assertLessEqual(len(page['features']), 2)
                seen += self.ids(page)
            self.assertEqual(seen, [1, 2, 3, 4, 6], 'the one that was removed is in no answer')
            page = self.search(daemon, limit=4)
            link, = [link for link in page['links'] if link['rel'] == 'next']
            self.assertEqual(link['method'], 'POST')
            self.assertEqual(self.ids(self.search(daemon, **link['body'])), [6])
            self.assertEqual(self.ids(self.search(daemon, ids=['5'])), [])

    def test_the_licence_of_a_contribution(self):
        with Daemon(copy_of('licensed')) as daemon:
            numbers = []
            for licence in ('CC-BY-4.0', 'https://example.org/terms', 'ask me'):
                code, _, body = daemon.ask(
                    'POST', '/v1/contributions',
                    json.dumps({'licence': licence, 'contributor': 'bela'}),
                    {'Content-Type': 'application/json'})
                self.assertEqual(code, 201)
                numbers.append(json.loads(body)['contribution'])
            for i, number in enumerate(numbers):
                code, _, answer = daemon.ask(
                    'POST', f'/v1/photos?name={i}.jpg&camera=c&contribution={number}',
                    photo(14 + i) if i < 2 else photo(1), JPEG)
                self.assertEqual(code, 201, answer)
            items = self.search(daemon, ids=['6', '7', '8'])['features']
            told = [item['properties'] for item in items]
            self.assertEqual([one.get('license') for one in told],
                             ['CC-BY-4.0', 'proprietary', None])
            self.assertEqual([one['veduta:licence'] for one in told],
                             ['CC-BY-4.0', 'https://example.org/terms', 'ask me'])
            rels = [{link['rel']: link['href'] for link in item['links']} for item in items]
            self.assertEqual(rels[1]['license'], 'https://example.org/terms')
            self.assertTrue(rels[0]['contribution'].endswith(f'/v1/contributions/{numbers[0]}'))
            self.assertEqual(daemon.get('/v1/photos/0.jpg')['contribution'], numbers[0])

    def test_ranges_of_bytes(self):
        with Daemon(CITY) as daemon:
            path = '/v1/photos/09.jpg/file'
            whole = daemon.ask('GET', path)
            self.assertEqual(whole[1]['Accept-Ranges'], 'bytes')
            code, headers, data = daemon.ask('GET', path, None, {'Range': 'bytes=100-199'})
            self.assertEqual((code, data), (206, whole[2][100:200]))
            self.assertEqual(headers['Content-Range'], f'bytes 100-199/{len(whole[2])}')
            code, _, data = daemon.ask('GET', path, None, {'Range': 'bytes=-7'})
            self.assertEqual((code, data), (206, whole[2][-7:]))
            code, headers, _ = daemon.ask('GET', path, None, {'Range': 'bytes=99999999-'})
            self.assertEqual((code, headers['Content-Range']), (416, f'bytes */{len(whole[2])}'))
            code, _, data = daemon.ask('GET', path, None, {'Range': 'bytes=1-0'})
            self.assertEqual((code, data), (200, whole[2]))

    def test_links_lead_to_the_address_that_was_asked(self):
        with Daemon(CITY) as daemon:
            port = daemon.host.split(':')[1]
            _, _, body = daemon.ask('GET', STAC, None, {'Host': f'localhost:{port}',
                                                        'X-Forwarded-Proto': 'https'})
            self.assertEqual(json.loads(body)['links'][0]['href'],
                             f'https://localhost:{port}/v1/stac')


if __name__ == '__main__':
    main()
