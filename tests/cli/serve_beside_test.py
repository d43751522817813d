#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: commands that add go through the daemon that has the database open, and print what they
#   print without one; the dense city follows while photos come.
# Method: real daemons on photos of a rendered street; the same commands with and without one.
# usage: tests/cli/serve_beside_test.py VEDUTA VEDUTA_STREET
import json
import os
import signal
import time

from city import (PARAMS, PHOTO_COUNT, SIZE, Case, ask, at, main, make_whole, must,
                  new_database, photo, run, write)
from daemon import Daemon


def setUpModule():
    make_whole()


NUMBERS = range(1, PHOTO_COUNT + 1)


CURATED = ('add', 'remove', 'forbid', 'allow')


def journal(db):
    return [json.loads(line) for line in must('journal', db, '--json').splitlines()]


def must_end(wanted, *arguments):
    code, out, err = run(*arguments)
    assert code == wanted, f'{arguments} ended with {code}: {out}{err}'
    return out


def name_of(number):
    return f'photo{number:04}.jpg'


class Beside(Case):
    def test_add_goes_through_the_daemon(self):
        beside, alone = new_database('beside'), new_database('alone')
        photos = [at('street', 'photos', name_of(n)) for n in NUMBERS]
        write(at('letter.txt'), b'no photo')
        photos.append(at('letter.txt'))
        told = {}
        with Daemon(beside) as daemon:
            for db in (beside, alone):
                code, out, err = run('add', db, '--camera', 'c', '--contributor', 'anna', *photos)
                self.assertEqual(code, 1, err)  # the letter
                # What a photo brings about is told without a daemon alone.
                told[db] = [line for line in out.splitlines() if not line.startswith('  ')]
                self.assertIn('1 rejected', err)
            self.assertEqual(told[beside], told[alone])
            lines = must_end(1, 'add', beside, '--camera', 'c', '--contributor', 'anna', '--json',
                             photos[0], photos[-1])
            self.assertEqual([json.loads(line)['verdict'] for line in lines.splitlines()],
                             ['duplicate', 'rejected'])
            self.refused(1, 'there is no camera', 'add', beside, '--camera', 'none', photos[0])
            self.refused(1, 'no file or folder', 'add', beside, '--camera', 'c', at('none.jpg'))
            must('camera', 'add', beside, 'd', '--size', SIZE, '--params', PARAMS)
            self.assertEqual(daemon.get('/v1/cameras/d')['params'], PARAMS)
            self.refused(1, 'other intrinsics', 'camera', 'add', beside, 'd', '--size', SIZE,
                         '--params', '400,400,256,192')
        must('settle', beside)
        self.assertFalse(os.path.exists(os.path.join(beside, 'daemon.sock')))
        must('camera', 'add', alone, 'd', '--size', SIZE, '--params', PARAMS)
        self.assertEqual(must('digest', beside), must('digest', alone))

    def test_a_city_begins_without_a_named_camera_as_without_a_daemon(self):
        photos = [at('street', 'photos', name_of(n)) for n in NUMBERS]
        beside, alone, later = at('nameless'), at('nameless_alone'), at('nameless_later')
        told = {}
        for db in (beside, alone, later):
            must('init', db)
        with Daemon(beside) as daemon:
            for db in (beside, alone):
                code, out, err = run('add', db, '--contributor', 'anna', *photos)
                self.assertEqual(code, 0, err)
                self.assertIn("is 'photos of 512x384' now", err)
                told[db] = [line for line in out.splitlines() if not line.startswith('  ')]
            self.assertEqual(told[beside], told[alone])
            self.assertEqual(daemon.get('/v1/uploads'), [])
        must('settle', beside)
        self.assertEqual(must('digest', beside), must('digest', alone))

        # Those that a daemon has taken and could not place are placed by `settle`.
        with Daemon(later) as daemon:
            for n in NUMBERS:
                code, _, answer = daemon.send(name_of(n), photo(n), 'anna', camera='')
                self.assertEqual((code, answer['awaits_camera']), (202, True), answer)
        code, out, err = run('settle', later)
        self.assertEqual(code, 0, err)
        self.assertIn("is 'photos of 512x384' now", err)
        self.assertEqual(must('digest', later), must('digest', alone))

    def test_the_owner_removes_and_forbids_through_the_daemon(self):
        beside, alone = new_database('curated'), new_database('curated_alone')
        photos = [at('street', 'photos', name_of(n)) for n in NUMBERS]
        commands = [('add', '--camera', 'c', '--contributor', 'anna', *photos[:10]),
                    ('add', '--camera', 'c', '--contributor', 'bela', *photos[10:]),
                    ('remove', name_of(3), '--by', 'cara', '--why', 'asked'),
                    ('forbid', name_of(1), name_of(9), '--by', 'cara'),
                    ('forbid', name_of(5), '--pose'), ('allow', name_of(5), '--pose'),
                    ('remove', '--contributor', 'bela')]
        with Daemon(beside, '--dense', '--dense-size', '64', '--device', 'cpp') as daemon:
            for command, *more in commands:
                told = must(command, beside, *more)
                self.assertIn(command, ('add', 'remove') if told else ('forbid', 'allow'))
            self.refused(1, 'none.jpg', 'remove', beside, 'none.jpg')
            self.refused(1, name_of(3), 'forbid', beside, name_of(3), '--pose')
            for path in ('/v1/removals', '/v1/forbidden', '/v1/allowed'):
                code, _, answer = daemon.ask('POST', path, '{}',
                                             {'Content-Type': 'application/json'})
                self.assertEqual(code, 403, answer)
            self.assertEqual(daemon.get('/v1/status')['images'], 9)
        for command, *more in commands:
            must(command, alone, *more)
        self.assertEqual(ask('forbidden', beside)[0]['actor'], 'cara')
        self.assertEqual([e['action'] for e in journal(beside) if e['action'] in CURATED],
                         [e['action'] for e in journal(alone) if e['action'] in CURATED])
        self.assertEqual(must('verify', beside), 'sound\n')

    def test_a_socket_that_a_killed_daemon_has_left_is_no_obstacle(self):
        db = new_database('left')
        Daemon(db).stop(signal.SIGKILL)
        self.assertTrue(os.path.exists(os.path.join(db, 'daemon.sock')))
        must('add', db, '--camera', 'c', at('street', 'photos', name_of(1)))
        with Daemon(db) as daemon:
            self.assertEqual(daemon.get('/v1/status')['images'], 1)
        self.assertEqual(must('verify', db), 'sound\n')


class Dense(Case):
    def test_the_dense_city_follows_and_rests(self):
        db = new_database('dense')
        with Daemon(db, '--dense', '--dense-size', '64', '--device', 'cpp') as daemon:
            self.assertEqual(daemon.ask('POST', '/v1/dense/pause')[0], 200)
            for n in NUMBERS[:6]:
                self.assertEqual(daemon.send(name_of(n), photo(n))[0], 201)
            self.assertEqual(daemon.get('/v1/dense')['state'], 'paused')
            self.assertEqual(daemon.ask('POST', '/v1/dense/resume')[0], 200)
            while daemon.get('/v1/dense')['passes'] == 0:
                time.sleep(0.1)
            first = daemon.get('/v1/reconstructions')[0]['depth_maps']
            self.assertGreater(first, 0)
            for n in NUMBERS[6:]:
                self.assertEqual(daemon.send(name_of(n), photo(n))[0], 201)
            while daemon.get('/v1/reconstructions')[0]['depth_maps'] == first:
                time.sleep(0.1)
            self.assertIsNone(daemon.get('/v1/dense')['why_not'])
        self.assertEqual(must('verify', db), 'sound\n')

    def test_it_is_off_where_nobody_asks_for_it(self):
        with Daemon(new_database('sparse')) as daemon:
            self.assertEqual(daemon.get('/v1/dense')['state'], 'off')
            self.assertEqual(daemon.ask('POST', '/v1/dense/pause')[0], 400)


if __name__ == '__main__':
    main()
