#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: nobody sees what an operator's program tells to be private, but administrators; no feature
#   is taken there; a photo that the program says nothing of is not stored and not lost; a removal
#   takes the original with it; the same answers give the same digest, also by adding what was
#   stored once more, without the program.
# Method: real daemons with programs that name one fixed area, or do what they should not, on photos
#   of a rendered street; pictures decoded by OpenCV's own reader where that is there, otherwise
#   compared as bytes; every file of the database searched for the original.
# usage: tests/cli/blur_test.py VEDUTA VEDUTA_STREET [TEST...]
import hashlib
import json
import os
import shutil
import signal
import subprocess
import time

from city import (Case, PHOTOS, SIZE, VEDUTA, add, ask, at, main, must, new_database, photo, read,
                  render, write)
from daemon import Daemon

WIDTH, HEIGHT = map(int, SIZE.split('x'))
AREA = [100, 60, 90, 80]
ANSWER = json.dumps({'width': WIDTH, 'height': HEIGHT, 'areas': [AREA]})
NUMBERS = range(1, 13)
MARK = b'Veduta private areas 1\0'


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


def program(name, text):
    """A shell script, as an operator may write one."""
    write(at(name), ('#!/bin/sh\n' + text).encode())
    os.chmod(at(name), 0o755)
    return at(name)


def fixed(name, answer=ANSWER):
    """One that reads the picture and notes its size, and names the same areas in all."""
    return program(name, f"wc -c >> {at(name)}.seen\necho '{answer}'\n")


def name_of(number):
    return f'{number:02}.jpg'


def send_all(daemon):
    for number in NUMBERS:
        code, _, answer = daemon.send(name_of(number), photo(number))
        assert code == 201, answer


def wait_for(what):
    end = time.monotonic() + 60
    while not what():
        assert time.monotonic() < end, 'it takes too long'
        time.sleep(0.1)


class Blur(Case):
    def test_what_is_private_is_sealed(self):
        db, command = new_database('sealed'), fixed('fixed')
        with Daemon(db, '--blur', command) as daemon:
            send_all(daemon)
            _, _, stored = daemon.ask('GET', '/v1/photos/01.jpg/file')
            self.assertNotEqual(stored, photo(1))
            self.assertEqual(stored[6:6 + len(MARK)], MARK)
            self.assertEqual([int.from_bytes(stored[i:i + 2], 'big') for i in range(29, 37, 2)],
                             AREA)
            # The same bytes once more: they are known, and nobody is asked.
            seen = len(read(command + '.seen').split())
            code, _, answer = daemon.send('again.jpg', photo(1))
            self.assertEqual(code, 409, answer)
            self.assertEqual(len(read(command + '.seen').split()), seen)
            # Without tokens it is the owner's alone.
            self.assertEqual(daemon.ask('GET', '/v1/photos/01.jpg/original')[0], 403)
            tokens = {role: must('token', 'create', db, role, '--role', role).strip()
                      for role in ('viewer', 'contributor', 'curator', 'admin')}
            for role, token in tokens.items():
                code, headers, body = daemon.ask('GET', '/v1/photos/01.jpg/original', None,
                                                 {'Authorization': 'Bearer ' + token})
                self.assertEqual(code, 200 if role == 'admin' else 403, role)
                if role == 'admin':
                    self.assertEqual((headers['Content-Type'], body), ('image/jpeg', photo(1)))
        self.assertEqual(seen, len(NUMBERS))
        self.assertTrue(all(int(n) > 1000 for n in read(command + '.seen').split()))
        self.assertEqual(must('verify', db, '--deep'), 'sound\n')
        placed = [ask('show', db, name_of(n))['verdict'] for n in NUMBERS]
        self.assertGreaterEqual(sum(v in ('placed', 'founded', 'merged') for v in placed), 6)
        self.expect_replay(db)
        self.expect_removal(db)

    def expect_replay(self, db):
        """What was stored, added once more in that order without the program, is the same city."""
        folder, again = at('stored'), new_database('replayed')
        os.mkdir(folder)
        with Daemon(db) as daemon:
            admin = must('token', 'create', db, 'ada', '--role', 'admin').strip()
            for number in NUMBERS:
                path = f'/v1/photos/{name_of(number)}/file'
                write(os.path.join(folder, name_of(number)),
                      daemon.ask('GET', path, None, {'Authorization': 'Bearer ' + admin})[2])
        must('add', again, '--camera', 'c', '--contributor', 'anna', folder)
        must('settle', db)
        self.assertEqual(must('digest', again), must('digest', db))
        self.assertEqual(must('verify', again, '--deep'), 'sound\n')

    def expect_removal(self, db):
        """No 64 bytes of the original's picture are in any file then."""
        data = photo(2)
        middle = data[len(data) // 3:-64]
        windows = {middle[i:i + 64] for i in range(0, len(middle) - 64)}
        starts = {w[:16] for w in windows}

        def is_there():
            for root, _, names in os.walk(db):
                for name in names:
                    text = read(os.path.join(root, name))
                    for i in range(0, len(text) - 16, 16):
                        if text[i:i + 16] in starts:
                            return True
            return False
        self.assertTrue(is_there(), 'the search finds what is there')
        answer = json.loads(must('remove', db, '02.jpg', '--json'))
        self.assertTrue(answer['purged'])
        self.assertFalse(is_there())
        self.assertEqual(must('verify', db), 'sound\n')

    def test_add_fills_what_is_private_as_well(self):
        db, command, folder = new_database('by_add'), fixed('of_add'), at('to_add')
        for number in NUMBERS:
            write(os.path.join(folder, name_of(number)), photo(number))
        code, lines, err = add(db, folder, '--blur', command)
        self.assertEqual((code, len(lines)), (0, len(NUMBERS)), err)
        self.assertEqual(len(read(command + '.seen').split()), len(NUMBERS))
        self.assertNotEqual(ask('show', db, '01.jpg')['sha256'],
                            hashlib.sha256(photo(1)).hexdigest())
        self.assertEqual([line['verdict'] for line in add(db, folder)[1]],
                         ['duplicate'] * len(NUMBERS))
        # Without an answer nothing is stored.
        silent = program('silent_of_add', 'exit 1')
        write(at('one', 'new.jpg'), photo(1) + b'\0')
        code, lines, _ = add(db, at('one'), '--blur', silent)
        self.assertEqual((code, lines[0]['id']), (1, None), lines)
        self.assertIn('exit code 1', lines[0]['reason'])
        # The daemon alone says what is filled by it.
        with Daemon(db):
            code, _, err = add(db, at('one'), '--blur', command)
            self.assertEqual(code, 1, err)
            self.assertIn('leave --blur out', err)
        self.assertEqual(ask('status', db)['images'], len(NUMBERS))
        self.assertEqual(must('verify', db), 'sound\n')

    def test_nothing_private_leaves_a_photo_as_it_came(self):
        db = new_database('clean')
        command = fixed('clean.sh', json.dumps({'width': WIDTH, 'height': HEIGHT, 'areas': []}))
        with Daemon(db, '--blur', command) as daemon:
            code, _, answer = daemon.send('01.jpg', photo(1))
            self.assertEqual(code, 201, answer)
            self.assertEqual(daemon.ask('GET', '/v1/photos/01.jpg/file')[2], photo(1))
        self.assertEqual(ask('show', db, '01.jpg')['sha256'],
                         hashlib.sha256(photo(1)).hexdigest())

    def test_all_private_is_refused(self):
        db = new_database('all')
        command = fixed('all.sh', json.dumps(
            {'width': WIDTH, 'height': HEIGHT, 'areas': [[0, 0, WIDTH, HEIGHT]]}))
        with Daemon(db, '--blur', command) as daemon:
            code, _, answer = daemon.send('01.jpg', photo(1))
            self.assertEqual(code, 422, answer)
            self.assertIn('features', answer['detail'])
        self.assertEqual(must('verify', db), 'sound\n')

    def test_broken_programs_publish_nothing(self):
        db = new_database('broken')
        broken = {
            'silent': ('', 'no JSON'),
            'failing': (f"echo '{ANSWER}'; exit 3", 'exit code 3'),
            'killed': ('kill -9 $$', 'signal 9'),
            'chatty': ('yes', 'says more than'),
            'other_size': (f"echo '{ANSWER.replace(str(WIDTH), '640')}'", 'of the picture'),
            'beside': ("echo '" + ANSWER.replace('100, 60', '100, 6000') + "'", 'area 0'),
            'no_list': ("echo '{}'", 'no object'),
        }
        for name, (text, why) in broken.items():
            with self.subTest(name), Daemon(db, '--blur', program(name + '.sh', text)) as daemon:
                code, _, answer = daemon.send('01.jpg', photo(1), waits=name != 'silent')
                if name == 'silent':
                    self.assertEqual(code, 202, answer)
                wait_for(lambda: any(self.why_not(daemon)))
                self.assertIn(why, self.why_not(daemon)[0])
                self.assertIn('waits to be blurred', self.why_not(daemon)[0])
                self.assertEqual(daemon.ask('GET', '/v1/photos/01.jpg')[0], 404)
                self.assertEqual(daemon.get('/v1/photos'), [])
            # The next daemon finds it on the disk.
            self.assertEqual(ask('status', db)['images'], 0)
        with Daemon(db, '--blur', fixed('mended.sh')) as daemon:
            wait_for(lambda: daemon.ask('GET', '/v1/photos/01.jpg')[0] == 200)
            stored = daemon.ask('GET', '/v1/photos/01.jpg/file')[2]
            self.assertEqual(stored[6:6 + len(MARK)], MARK)
        self.assertEqual(must('verify', db), 'sound\n')

    @staticmethod
    def why_not(daemon):
        uploads = [daemon.get(f'/v1/uploads/{u["upload"]}') for u in daemon.get('/v1/uploads')]
        return [u['why_not'] for u in uploads if u.get('why_not')]

    def test_who_adds_need_not_wait_for_a_program_that_hangs(self):
        db = new_database('waiting')
        command = program('waiting.sh', f'echo $$ > {at("waiting.pid")}\nexec sleep 1000\n')
        with Daemon(db, '--blur', command):
            adding = subprocess.Popen([VEDUTA, 'add', db, '--camera', 'c',
                                       os.path.join(PHOTOS, 'photo0001.jpg')],
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            wait_for(lambda: os.path.exists(at('waiting.pid')))
            adding.send_signal(signal.SIGINT)
            _, err = adding.communicate(timeout=60)
            self.assertEqual(adding.returncode, 1, err)
            self.assertIn(b'the daemon places those that were sent', err)

    def test_a_program_that_hangs_does_not_hold_up_the_end(self):
        db = new_database('hanging')
        command = program('hanging.sh', f'echo $$ > {at("hanging.pid")}\nexec sleep 1000\n')
        daemon = Daemon(db, '--blur', command)
        self.assertEqual(daemon.send('01.jpg', photo(1), waits=False)[0], 202)
        wait_for(lambda: os.path.exists(at('hanging.pid')) and read(at('hanging.pid')).strip())
        start = time.monotonic()
        code, err = daemon.stop()
        self.assertEqual(code, 0, err)
        self.assertLess(time.monotonic() - start, 10)
        self.assertFalse(os.path.exists('/proc/' + read(at('hanging.pid')).decode().strip()))
        self.assertEqual(ask('status', db)['images'], 0)


if __name__ == '__main__':
    main()
