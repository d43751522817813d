#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the daemon takes photos as plain HTML forms and `curl -F` send them, and nothing that is
#   broken or hostile: then nothing is stored, and it goes on.
# Method: a real daemon on a rendered street; curl itself where there is one; forms that are cut,
#   nested, never end, or name files that lead out of a folder.
# usage: tests/cli/form_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json
import os
import shutil
import socket
import subprocess
import unittest

from city import PHOTOS, SIZE, Case, main, must, new_database, photo, render
from daemon import Daemon

CURL = shutil.which('curl')


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


def field(name, value):
    return (f'--b\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n').encode() + \
        value + b'\r\n'


def file(name, data):
    return (f'--b\r\nContent-Disposition: form-data; name="photo"; filename="{name}"\r\n'
            'Content-Type: image/jpeg\r\n\r\n').encode() + data + b'\r\n'


END = b'--b--\r\n'
FORM = {'Content-Type': 'multipart/form-data; boundary=b'}


class Forms(Case):
    def send(self, daemon, body, path='/v1/photos', headers={}):
        code, told, answer = daemon.ask('POST', path, body, {**FORM, **headers})
        return code, told, json.loads(answer)

    def test_one_photo_is_answered_as_its_bytes_are(self):
        with Daemon(new_database('one')) as daemon:
            code, headers, answer = self.send(
                daemon, field('camera', b'c') + field('contributor', b'anna') +
                file('1.jpg', photo(1)) + END)
            self.assertEqual((code, answer['image'], answer['verdict']),
                             (201, '1.jpg', 'postponed'))
            self.assertEqual(headers['Location'], '/v1/photos/%231')
            shown = daemon.get('/v1/photos/1.jpg')
            self.assertEqual((shown['contributor'], shown['bytes']), ('anna', len(photo(1))))
            self.assertEqual(self.send(daemon, file('1.jpg', photo(1)) + END)[0], 409)
            code, _, answer = self.send(daemon, field('name', b'my 2.jpg') +
                                        file('../x.jpg', photo(2)) + END, '/v1/photos?camera=c',
                                        {'Prefer': 'respond-async'})
            self.assertEqual((code, answer['image']), (202, 'my 2.jpg'))
            self.assertEqual(self.send(daemon, file('n.jpg', b'no photo') +
                                       field('camera', b'c') + END)[0], 422)

    def test_several_photos_are_put_in_line(self):
        db = new_database('several')
        with Daemon(db) as daemon:
            code, _, answer = self.send(
                daemon, file('d/1.jpg', photo(1)) + field('camera', b'c') +
                file('2.jpg', photo(2)) + file('', b'') + file('3.jpg', photo(3)) + END)
            self.assertEqual(code, 202)
            self.assertEqual([(one['image'], one['status']) for one in answer['photos']],
                             [('d/1.jpg', 202), ('2.jpg', 202), ('3.jpg', 202)])
            for one in answer['photos']:
                self.assertEqual(daemon.get(f'/v1/uploads/{one["upload"]}')['image'], one['image'])
            daemon.wait_for_uploads()
            self.assertEqual([one['image'] for one in daemon.get('/v1/photos')],
                             ['d/1.jpg', '2.jpg', '3.jpg'])
            code, _, answer = self.send(daemon, file('4.jpg', photo(4)) + file('5.jpg', photo(5)) +
                                        field('camera', b'no camera') + END)
            self.assertEqual((code, len(answer['photos'])), (404, 2))
        self.assertEqual(must('verify', db), 'sound\n')

    @unittest.skipIf(CURL is None, 'there is no curl')
    def test_curl(self):
        with Daemon(new_database('curl')) as daemon:
            path = os.path.join(PHOTOS, 'photo0003.jpg')
            done = subprocess.run(
                [CURL, '-s', '-w', ' %{http_code}', '-F', 'photo=@' + path, '-F', 'camera=c',
                 f'http://{daemon.host}/v1/photos'], capture_output=True, check=True)
            answer, code = done.stdout.decode().rsplit(' ', 1)
            self.assertEqual((code, json.loads(answer)['image']), ('201', 'photo0003.jpg'))
            self.assertEqual(daemon.get('/v1/photos/photo0003.jpg')['bytes'], len(photo(3)))

    def test_wrong_forms_store_nothing(self):
        good = file('1.jpg', photo(1))
        with Daemon(new_database('wrong')) as daemon:
            for body, word in (
                    (good, 'within a part'), (good[:-20], 'within a part'), (b'', 'begin'),
                    (b'x' + good + END, 'begin'), (END, 'no photo'),
                    (field('licence', b'x') + good + END, 'licence'),
                    (file('../../1.jpg', photo(1)) + END, 'leads out'),
                    (file('/etc/passwd', photo(1)) + END, 'leads out'),
                    (good + file('..', photo(2)) + END, 'leads out'),
                    (b'--b\r\nX: ' + b'x' * 100_000 + b'\r\n\r\n' + good + END, 'do not end'),
                    (field('camera', b'c') * 200 + END, 'twice|more than 128'),
                    (good.replace(b'image/jpeg', b'multipart/mixed; boundary=c') + END,
                     'form itself')):
                code, _, answer = self.send(daemon, body)
                self.assertEqual(code, 400, body[:100])
                self.assertRegex(answer['detail'], word)
            for kind in ('multipart/form-data', 'multipart/form-data; boundary="'):
                self.assertEqual(self.send(daemon, good + END, headers={'Content-Type': kind})[0],
                                 400)
            self.assertEqual(daemon.ask('POST', '/v1/photos', good + END,
                                        {'Content-Type': 'multipart/mixed; boundary=b'})[0], 415)
            self.assertEqual(self.send(daemon, good + END, headers={
                'Origin': 'http://elsewhere.example'})[0], 403, "another page's form")
            self.assertEqual(daemon.get('/v1/photos'), [])
            self.assertEqual(daemon.get('/v1/uploads'), [])

    def test_a_part_that_never_ends(self):
        with Daemon(new_database('endless')) as daemon:
            host, port = daemon.host.split(':')
            with contextlib.closing(socket.create_connection((host, int(port)), 60)) as line:
                line.sendall(b'POST /v1/photos HTTP/1.1\r\nHost: ' + daemon.host.encode() +
                             b'\r\nContent-Type: multipart/form-data; boundary=b\r\n'
                             b'Transfer-Encoding: chunked\r\n\r\n')
                piece = b'%x\r\n' % (1 << 20) + b'x' * (1 << 20) + b'\r\n'
                with contextlib.suppress(OSError):
                    for _ in range(200):
                        line.sendall(piece)
                with contextlib.suppress(OSError):
                    self.assertIn(b' 413 ', line.recv(1000)[:20])
            self.assertEqual(daemon.get('/v1/uploads'), [])

    def test_nobody_sends_under_another_name_by_a_field(self):
        db = new_database('names')
        token = must('token', 'create', db, 'anna', '--role', 'contributor').strip()
        with Daemon(db) as daemon:
            bearer = {'Authorization': 'Bearer ' + token}
            good = file('1.jpg', photo(1)) + field('camera', b'c')
            self.assertEqual(self.send(daemon, good + END)[0], 401)
            self.assertEqual(self.send(daemon, good + field('contributor', b'kai') + END,
                                       headers=bearer)[0], 403)
            self.assertEqual(self.send(daemon, good + field('contributor', b'anna') + END,
                                       headers=bearer)[0], 201)


if __name__ == '__main__':
    main()
