#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a copy of a stored photo that was made smaller and encoded anew is answered by 409, however
#   it comes: as a body, as a form, in parts, beside the daemon; the photo itself takes the place of
#   such a copy where the better version is wanted, and keeps number, name and pose; an `add` that
#   is killed at any instant goes on to the same digest.
# Method: real daemons on photos of a rendered street, whose thumbnails are the copies.
# usage: tests/cli/doubles_test.py VEDUTA VEDUTA_STREET [TEST...]
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess

from city import (PARAMS, PHOTO_COUNT, PHOTOS, SIZE, VEDUTA, WHOLE, Case, ask, at, main,
                  make_whole, must, new_database, photo, read, run, write)
from daemon import Daemon
from form_test import END, FORM, field, file
from tus_client import PART, must_begin

KILLS = int(os.environ.get('KILLS', '5'))
SIDE = 384
COPIES = None  # the folder of the copies
SMALL = None  # a database of them
NUMBERS = range(1, PHOTO_COUNT + 1)


def name_of(number):
    return f'photo{number:04}.jpg'


def copy(number):
    return read(os.path.join(COPIES, name_of(number)))


def setUpModule():
    global COPIES, SMALL
    make_whole()
    COPIES, SMALL = at('copies'), at('small')
    with Daemon(WHOLE) as daemon:
        for number in NUMBERS:
            code, _, jpeg = daemon.ask(
                'GET', f'/v1/photos/{name_of(number)}/thumbnail?side={SIDE}')
            assert code == 200, jpeg
            write(os.path.join(COPIES, name_of(number)), jpeg)
    new_database('small')
    add_camera_of_copies(SMALL)
    must('add', SMALL, '--camera', 'small', '--contributor', 'anna', COPIES)


def add_camera_of_copies(db):
    width, height = (int(px) for px in SIZE.split('x'))
    shrink = SIDE / width
    fx, fy, cx, cy = (float(number) for number in PARAMS.split(','))
    must('camera', 'add', db, 'small', '--size', f'{SIDE}x{round(height * shrink)}', '--params',
         f'{fx * shrink},{fy * shrink},{(cx + .5) * shrink - .5},{(cy + .5) * shrink - .5}')


def a_copy_of(db, name):
    shutil.copytree(db, at(name))
    return at(name)


def journal(db):
    return [json.loads(line) for line in must('journal', db).splitlines()]


class Doubles(Case):
    def post(self, daemon, name, data, camera):
        code, headers, answer = daemon.send(name, data, 'bea', camera)
        return code, headers['Location'], answer

    def post_form(self, daemon, name, data, camera):
        form = field('camera', camera.encode()) + field('contributor', b'bea') + file(name, data)
        code, headers, answer = daemon.ask('POST', '/v1/photos', form + END, FORM)
        return code, headers['Location'], json.loads(answer)

    def send_parts(self, daemon, name, data, camera):
        """The outcome of a photo that comes in parts."""
        path = must_begin(daemon, len(data), body=data, headers={'Content-Type': PART},
                          filename=name, camera=camera, contributor='bea')
        number = path.rsplit('/', 1)[1]
        daemon.wait_for_uploads()
        ended = [upload for n in range(1, 100)
                 if (upload := self.upload(daemon, n)) and upload['image'] == name]
        self.assertEqual(len(ended), 1, (number, ended))
        return ended[0]['outcome']

    def upload(self, daemon, number):
        code, _, answer = daemon.ask('GET', f'/v1/uploads/{number}')
        return json.loads(answer) if code == 200 else None

    def test_copies_are_refused(self):
        db = a_copy_of(WHOLE, 'refusing')
        add_camera_of_copies(db)
        digest = must('digest', db)
        with Daemon(db, '--doubles', 'refuse') as daemon:
            for ways, number in ((self.post, 2), (self.post_form, 4)):
                code, where, answer = ways(daemon, 'c.jpg', copy(number), 'small')
                self.assertEqual((code, where), (409, f'/v1/photos/%23{number}'), answer)
                self.assertIn(f'the same picture as {name_of(number)} (#{number}), at 0.75 times',
                              answer['detail'])
                self.assertEqual((answer['photo']['verdict'], answer['photo']['replaced']),
                                 ('duplicate', False))
            outcome = self.send_parts(daemon, 'parts.jpg', copy(6), 'small')
            self.assertEqual((outcome['verdict'], outcome['id']), ('duplicate', 6))
            code, out, _ = run('add', db, '--camera', 'small', '--contributor', 'bea',
                               os.path.join(COPIES, name_of(7)))
            self.assertEqual(code, 0)
            self.assertRegex(out, r'^duplicate +\S+: the same picture as \S+ \(#7\)')
        self.assertEqual(must('digest', db), digest)

    def test_the_better_version_is_kept(self):
        db = a_copy_of(SMALL, 'better')
        before = {number: ask('show', db, f'#{number}') for number in NUMBERS}
        with Daemon(db, '--doubles', 'better') as daemon:
            for ways, number in ((self.post, 2), (self.post_form, 4)):
                code, where, answer = ways(daemon, name_of(number), photo(number), 'c')
                self.assertEqual((code, where), (200, f'/v1/photos/%23{number}'), answer)
                self.assertEqual((answer['verdict'], answer['replaced']), ('duplicate', True))
                self.assertEqual(daemon.ask('GET', where + '/file')[2], photo(number))
            outcome = self.send_parts(daemon, 'parts.jpg', photo(6), 'c')
            self.assertEqual((outcome['replaced'], outcome['id']), (True, 6))
            out = must('add', db, '--camera', 'c', '--contributor', 'bea',
                       os.path.join(PHOTOS, name_of(7)))
            self.assertRegex(out, r'^duplicate +\S+: the same picture as \S+ \(#7\), at 1.33 times '
                             'its width, and takes its place')
            # Its copy is not better than it.
            self.assertEqual(self.post(daemon, 'c.jpg', copy(2), 'small')[0], 409)
        for number in (2, 4, 6, 7):
            shown, was = ask('show', db, f'#{number}'), before[number]
            for key in ('image', 'contributor', 'verdict', 'reconstruction'):
                self.assertEqual(shown[key], was[key])
            self.assertEqual(shown['sha256'], hashlib.sha256(photo(number)).hexdigest())
            self.assertEqual(shown['bytes'], len(photo(number)))
        told = [entry for entry in journal(db) if entry['action'] == 'replace']
        self.assertEqual([entry['actor'] for entry in told], ['bea'] * 4)
        for entry, number in zip(told, (2, 4, 6, 7)):
            old, new = (hashlib.sha256(data).hexdigest()
                        for data in (copy(number), photo(number)))
            self.assertEqual(entry['detail'], f'{old} of 384x288 by {new} of {SIZE}')
        must('settle', db)
        self.assertEqual(must('verify', db, '--deep'), 'sound\n')
        self.assertEqual(ask('status', db)['images'], PHOTO_COUNT)
        # Nothing has the bytes of the copy any more.
        pieces = [copy(number)[len(copy(number)) // 2:][:64] for number in (2, 4, 6, 7)]
        for folder, _, files in os.walk(db):
            for name in files:
                data = read(os.path.join(folder, name))
                self.assertFalse(any(piece in data for piece in pieces), name)

    def test_a_killed_add_goes_on(self):
        command = ('--camera', 'c', '--threads', '2', '--contributor', 'bea', '--doubles',
                   'better', PHOTOS)
        whole = a_copy_of(SMALL, 'unkilled')
        out = must('add', whole, *command)
        self.assertEqual(out.count('takes its place'), PHOTO_COUNT, out)
        must('settle', whole)
        self.assertEqual(must('verify', whole, '--deep'), 'sound\n')
        chance = random.Random(int(os.environ.get('SEED', '1')))
        db, kills = a_copy_of(SMALL, 'killed'), 0
        for _ in range(KILLS):
            adding = subprocess.Popen([VEDUTA, 'add', db, *command], stdout=subprocess.DEVNULL,
                                      stderr=subprocess.DEVNULL)
            try:
                adding.wait(chance.uniform(0.3, 3))
            except subprocess.TimeoutExpired:
                adding.send_signal(signal.SIGKILL)
                adding.wait()
                kills += 1
            self.assertEqual(must('verify', db), 'sound\n')
        self.assertGreater(kills, 0)
        must('add', db, *command)
        must('settle', db)
        self.assertEqual(must('digest', db), must('digest', whole))


if __name__ == '__main__':
    main()
