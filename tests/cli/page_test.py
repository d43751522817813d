#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: people see the city in a browser, look at photos, and contribute some; nothing is complained
#   about, by the browser or by axe-core, and no other host is asked.
# Method: a real daemon on a rendered street, and Debian's chromium, driven by the files of page/,
#   which say what they check. Pictures are left in PAGE_PICTURES, if that is set.
# usage: tests/cli/page_test.py VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]
#   BUILT_PAGE: the folder in the build tree in which the page was built
import json
import os
import shutil
import subprocess
import sys

from city import Case, add, ask, at, main, must, new_database, render, SIZE
from daemon import Daemon

if len(sys.argv) < 4:
    sys.exit(f'usage: {sys.argv[0]} VEDUTA VEDUTA_STREET BUILT_PAGE [TEST...]')
BUILT_PAGE = sys.argv.pop(3)
CHROMIUM = shutil.which('chromium')
NODE = shutil.which('node') or shutil.which('nodejs')


class Page(Case):
    def test_the_page_is_there_and_asks_nobody_else(self):
        with Daemon(new_database('empty.veduta')) as daemon:
            for path, kind in (('/', 'text/html'), ('/page.js', 'text/javascript'),
                               ('/page.css', 'text/css')):
                code, headers, body = daemon.ask('GET', path)
                self.assertEqual(code, 200)
                self.assertTrue(headers['Content-Type'].startswith(kind))
                self.assertIn("default-src 'none'", headers['Content-Security-Policy'])
                self.assertGreater(len(body), 300)
                again = daemon.ask('GET', path, headers={'If-None-Match': headers['ETag']})
                self.assertEqual((again[0], again[2]), (304, b''))
            self.assertEqual(daemon.ask('GET', '/page.html')[0], 404)
            self.assertEqual(daemon.ask('GET', '/?from=1')[0], 400)

    def test_people_see_the_city_and_add_to_it(self):
        if CHROMIUM is None or NODE is None:
            self.skipTest('there is no chromium, or no node: tools/install.sh installs them')
        photos = render('page', '--photos', '30', '--size', SIZE)
        more = at('more')
        os.makedirs(more)
        for name in sorted(os.listdir(photos))[-5:]:
            os.rename(os.path.join(photos, name), os.path.join(more, name))
        db = new_database('page.veduta')
        self.assertEqual(add(db, photos)[0], 0)
        pictures = os.environ.get('PAGE_PICTURES', at('pictures'))
        with Daemon(db) as daemon:
            done = subprocess.run(
                [NODE, os.path.join(BUILT_PAGE, 'test', 'page_test.mjs'),
                 'http://' + daemon.host, more, pictures, CHROMIUM], capture_output=True)
        self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())

    def test_the_plan(self):
        if CHROMIUM is None or NODE is None:
            self.skipTest('there is no chromium, or no node: tools/install.sh installs them')
        # In a circle, which gives several reconstructions; GPS tells a place of each.
        orbit = ('--photos', '24', '--trajectory', 'orbit', '--size', SIZE, '--gps', '0.3')
        street = ('--photos', '20', '--length', '10', '--size', SIZE)
        pictures = os.environ.get('PAGE_PICTURES', at('pictures'))
        for place, what in (('known', orbit), ('unknown', street)):
            photos = render(f'plan_{place}', *what)
            db = new_database(f'plan_{place}.veduta')
            self.assertEqual(add(db, photos)[0], 0)
            places = [one['known'] for one in ask('georeference', db)['reconstructions']]
            self.assertEqual(set(places), {place == 'known'})
            self.assertGreater(len(places), 1 if place == 'known' else 0)
            with Daemon(db) as daemon:
                done = subprocess.run(
                    [NODE, os.path.join(BUILT_PAGE, 'test', 'plan_test.mjs'),
                     'http://' + daemon.host, place, pictures, CHROMIUM], capture_output=True)
            self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())

    def test_photos_are_reported_and_hidden(self):
        if CHROMIUM is None or NODE is None:
            self.skipTest('there is no chromium, or no node: tools/install.sh installs them')
        photos = render('moderated', '--photos', '6', '--size', SIZE)
        db = new_database('moderated.veduta')
        self.assertEqual(add(db, photos)[0], 0)
        viewer, curator = (must('token', 'create', db, role, '--role', role).strip()
                           for role in ('viewer', 'curator'))
        pictures = os.environ.get('PAGE_PICTURES', at('pictures'))
        with Daemon(db) as daemon:
            done = subprocess.run(
                [NODE, os.path.join(BUILT_PAGE, 'test', 'moderation_test.mjs'),
                 'http://' + daemon.host, viewer, curator, pictures, CHROMIUM],
                capture_output=True)
        self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())
        reports = ask('reports', db, '--all')
        # What was said of the photo is erased with it.
        self.assertEqual([(one['reason'], one['text'], one['reporter'], one['state'], one['image'])
                          for one in reports],
                         [('privacy', '', 'viewer', 'hidden', None),
                          ('wrong', '', 'viewer', 'dismissed', reports[1]['image'])])
        journal = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertEqual([(one['actor'], "somebody's home" in one['detail']) for one in journal
                          if one['action'] == 'remove'], [('curator', True)])
        self.assertEqual(must('hidden', db), '')

    def test_a_link_for_reading_opens_the_city(self):
        if CHROMIUM is None or NODE is None:
            self.skipTest('there is no chromium, or no node: tools/install.sh installs them')
        photos = render('linked', '--photos', '20', '--length', '10', '--size', SIZE)
        db = new_database('linked.veduta')
        near = [os.path.join(photos, name) for name in sorted(os.listdir(photos))[:4]]
        self.assertEqual(add(db, *near)[0], 0)
        self.assertGreaterEqual(ask('status', db)['placed'], 3)
        for part in ((), ('--reconstruction', '1')):
            link = json.loads(must('token', 'link', db, 'a friend', '--json', *part))
            with Daemon(db) as daemon:
                self.assertEqual(daemon.ask('GET', '/v1/status')[0], 401)
                done = subprocess.run(
                    [NODE, os.path.join(BUILT_PAGE, 'test', 'link_test.mjs'),
                     'http://' + daemon.host, link['path'], CHROMIUM], capture_output=True)
            self.assertEqual(done.returncode, 0, (done.stdout + done.stderr).decode())


if __name__ == '__main__':
    main()
