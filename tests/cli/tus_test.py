#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: photos arrive in parts by the tus protocol, each once and whole, over lines that break and
#   daemons that are killed; what is wrong is refused by the right code, and whoever means harm gets
#   nowhere.
# Method: real daemons on photos of a rendered street; a line that cuts connections; SIGKILL; raw
#   sockets for clients that are slow.
# usage: tests/cli/tus_test.py VEDUTA VEDUTA_STREET [TEST...]
import base64
import contextlib
import hashlib
import http.client
import json
import os
import random
import resource
import signal
import socket
import threading
import time

from city import Case, ask, main, must, new_database, photo, render, SIZE
from daemon import Daemon
from tus_client import (PART, VERSION, BreakingLine, begin, metadata, must_begin, offset_of, send,
                        send_stubbornly)

KILLS = int(os.environ.get('KILLS', '10'))


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


def padded(number, size):
    """A photo of that many bytes: what comes after the end of a JPEG means nothing."""
    data = photo(number)
    return data + random.Random(number).randbytes(size - len(data))


def sha256(data):
    return hashlib.sha256(data).hexdigest()


class Tus(Case):
    def finished(self, daemon, path):
        """What became of a photo that has arrived."""
        code, _, body = daemon.ask('GET', path)
        self.assertEqual(code, 200, body)
        number = json.loads(body)['upload']
        self.assertIsNotNone(number)
        while True:
            told = daemon.get(f'/v1/uploads/{number}')
            if told['state'] != 'waiting':
                return told
            time.sleep(0.05)

    def is_there_once(self, db, name, data):
        shown = ask('show', db, name)
        self.assertEqual(shown['sha256'], sha256(data))
        added = [entry for line in must('journal', db).splitlines()
                 if (entry := json.loads(line))['action'] == 'add']
        self.assertEqual(len(added), 1, added)
        self.assertEqual(must('verify', db), 'sound\n')


class Protocol(Tus):
    @classmethod
    def setUpClass(cls):
        cls.db = new_database('protocol')
        cls.daemon = Daemon(cls.db)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_a_photo_arrives_in_parts(self):
        data = photo(1)
        path = must_begin(self.daemon, len(data), filename='walk/1.jpg', camera='c',
                          contributor='anna', filetype='image/jpeg')
        code, headers, body = self.daemon.ask('HEAD', path, headers=VERSION)
        self.assertEqual((code, body), (200, b''))
        for name, value in (('Upload-Offset', '0'), ('Upload-Length', str(len(data))),
                            ('Cache-Control', 'no-store'), ('Tus-Resumable', '1.0.0')):
            self.assertEqual(headers.get_all(name), [value])
        self.assertIn('GMT', headers['Upload-Expires'])
        third = len(data) // 3
        for begins, ends in ((0, third), (third, third), (third, len(data))):
            code, headers, body = send(self.daemon, path, begins, data[begins:ends])
            self.assertEqual((code, headers['Upload-Offset'], body), (204, str(ends), b''))
            self.assertEqual(headers['Tus-Resumable'], '1.0.0')
        outcome = self.finished(self.daemon, path)['outcome']
        self.assertEqual(outcome['image'], 'walk/1.jpg')
        shown = self.daemon.get('/v1/photos/walk%2F1.jpg')
        self.assertEqual((shown['sha256'], shown['contributor']), (sha256(data), 'anna'))
        # The last part once more, by a client that has not heard the answer.
        self.assertEqual(send(self.daemon, path, third, data[third:])[0], 409)
        self.assertEqual(send(self.daemon, path, len(data), b'')[0], 204)
        self.assertEqual(offset_of(self.daemon, path), len(data))
        self.assertEqual(len(self.daemon.get('/v1/uploads')), 0)
        # The same bytes once more are a duplicate, as by POST /v1/photos.
        again = must_begin(self.daemon, len(data), body=data, headers={'Content-Type': PART},
                           filename='again.jpg', camera='c')
        self.assertEqual(self.finished(self.daemon, again)['outcome']['verdict'], 'duplicate')

    def test_what_there_is_of_the_protocol(self):
        code, headers, body = self.daemon.ask('OPTIONS', '/v1/tus')
        self.assertEqual((code, body), (204, b''))
        self.assertEqual((headers['Tus-Version'], headers['Tus-Max-Size']), ('1.0.0', str(2**27)))
        self.assertEqual(headers['Tus-Extension'],
                         'creation,creation-with-upload,expiration,checksum,termination')
        self.assertEqual(headers['Tus-Checksum-Algorithm'], 'sha1,sha256')

    def test_a_first_part_with_the_announcement(self):
        data = padded(2, 300_000)
        code, headers, _ = begin(self.daemon, len(data), {'Content-Type': PART}, data[:100_000],
                                 filename='2.jpg', camera='c')
        self.assertEqual((code, headers['Upload-Offset']), (201, '100000'))
        path = headers['Location']
        # By a client that can send no PATCH.
        code, headers, _ = self.daemon.ask(
            'POST', path, data[100_000:],
            {**VERSION, 'Content-Type': PART, 'Upload-Offset': '100000',
             'X-HTTP-Method-Override': 'PATCH'})
        self.assertEqual((code, headers['Upload-Offset']), (204, '300000'))
        self.assertEqual(self.finished(self.daemon, path)['state'], 'done')

    def test_checksums(self):
        data = photo(3)
        path = must_begin(self.daemon, len(data), filename='3.jpg', camera='c')
        for algorithm in ('sha1', 'sha256'):
            def checked(part, offset, algorithm=algorithm):
                sum64 = base64.b64encode(hashlib.new(algorithm, data[:1000]).digest()).decode()
                return send(self.daemon, path, offset, part,
                            {'Upload-Checksum': f'{algorithm} {sum64}'})[0]

            at = offset_of(self.daemon, path)
            self.assertEqual(checked(data[1:1001], at), 460)
            self.assertEqual(offset_of(self.daemon, path), at, 'nothing is stored')
            # The sum is of this part alone, wherever it lies.
            self.assertEqual(checked(data[:1000], at), 204)
        for wrong in ('md5 AAAA', 'sha1', 'sha1 !!!', 'sha1 AAAA'):
            code = send(self.daemon, path, 2000, data[2000:], {'Upload-Checksum': wrong})[0]
            self.assertEqual(code, 400, wrong)
        self.assertEqual(offset_of(self.daemon, path), 2000)

    def test_an_upload_is_given_up(self):
        path = must_begin(self.daemon, 100, filename='gone.jpg')
        self.assertEqual(send(self.daemon, path, 0, b'x' * 50)[0], 204)
        self.assertEqual(self.daemon.ask('DELETE', path, headers=VERSION)[0], 204)
        for code in (-offset_of(self.daemon, path), send(self.daemon, path, 50, b'x' * 50)[0],
                     self.daemon.ask('DELETE', path, headers=VERSION)[0]):
            self.assertEqual(code, 404)

    def test_what_is_wrong_is_said(self):
        path = must_begin(self.daemon, 100, filename='wrong.jpg')
        good = {**VERSION, 'Content-Type': PART, 'Upload-Offset': '0'}
        new = {**VERSION, 'Upload-Length': '100', 'Upload-Metadata': metadata(filename='a.jpg')}
        named = lambda **pairs: {**new, 'Upload-Metadata': metadata(**pairs)}
        for code, method, where, headers, words in [
                (412, 'PATCH', path, {**good, 'Tus-Resumable': '0.2.2'}, '1.0.0'),
                (412, 'POST', '/v1/tus', {'Upload-Length': '5'}, '1.0.0'),
                (412, 'HEAD', path, {'Tus-Resumable': '2.0.0'}, None),
                (409, 'PATCH', path, {**good, 'Upload-Offset': '7'}, 'from 0 on'),
                (409, 'PATCH', path, {**good, 'Upload-Offset': str(2**64 - 1)}, 'from 0 on'),
                (400, 'PATCH', path, {**good, 'Upload-Offset': '-1'}, 'Upload-Offset'),
                (400, 'PATCH', path, {**VERSION, 'Content-Type': PART}, 'Upload-Offset'),
                (415, 'PATCH', path, {**good, 'Content-Type': 'image/jpeg'}, PART),
                (404, 'PATCH', '/v1/tus/' + '0' * 32, good, 'begin anew'),
                (404, 'PATCH', '/v1/tus/x', good, 'begin anew'),
                (404, 'PATCH', '/v1/tus/..%2F..%2Fetc', good, 'begin anew'),
                (405, 'PUT', path, good, 'GET'),
                (400, 'POST', '/v1/tus', {**VERSION, 'Upload-Metadata': 'filename YQ=='},
                 'Upload-Length'),
                (400, 'POST', '/v1/tus', {**new, 'Upload-Length': '0'}, 'Upload-Length'),
                (400, 'POST', '/v1/tus', {**new, 'Upload-Length': '1e3'}, 'Upload-Length'),
                (400, 'POST', '/v1/tus', {**new, 'Upload-Defer-Length': '1'}, 'length'),
                (400, 'POST', '/v1/tus', {**new, 'Upload-Concat': 'partial'}, 'one upload'),
                (413, 'POST', '/v1/tus', {**new, 'Upload-Length': str(2**27 + 1)}, 'larger'),
                (413, 'POST', '/v1/tus', {**new, 'Upload-Length': str(2**64 - 1)}, 'larger'),
                (415, 'POST', '/v1/tus', named(filename='a', filetype='text/html'), 'text/html'),
                (404, 'POST', '/v1/tus', named(filename='a', camera='none'), 'none'),
                (404, 'POST', '/v1/tus', named(filename='a', contribution='7'), '7'),
                (400, 'POST', '/v1/tus', named(filename='a', contribution='x'), 'contribution')]:
            with self.subTest(f'{code} {method} {where} {headers}'):
                body = b'' if method == 'POST' else b'x' * 10
                got, answered, told = self.daemon.ask(method, where,
                                                      None if method == 'HEAD' else body, headers)
                self.assertEqual(got, code, told)
                self.assertEqual(answered['Content-Type'], 'application/problem+json')
                self.assertEqual(answered['Tus-Resumable'], '1.0.0')
                if words is not None:
                    self.assertIn(words, json.loads(told)['detail'])
        self.assertEqual(send(self.daemon, path, 0, b'x' * 101)[0], 413)
        self.assertEqual(offset_of(self.daemon, path), 0)

    def test_metadata_that_means_harm(self):
        new = {**VERSION, 'Upload-Length': '100'}
        texts = ['', 'filename', 'filename !!!', 'filename YQ', 'filename YQ== x', ', ,',
                 'filename YQ==,filename Yg==', '\u00e9 YQ==', 'filename YQ==,' + 'a' * 5000,
                 'filename YQ==,' + ','.join(f'k{i} YQ==' for i in range(40))]
        texts += [metadata(filename=name) for name in (
            '../../etc/passwd', '/etc/passwd', 'a/../b', 'a//b', './a', 'a/', '..',
            'a\r\nSet-Cookie: x=1', 'a\0.jpg', 'a\x1b[31m', b'\xff\xfe', b'\xc0\xaf', 'x' * 1025)]
        texts += [metadata(filename='a', contributor=name)
                  for name in ('a\nb', b'\xff', 'x' * 1025)]
        for text in texts:
            code, headers, body = self.daemon.ask(
                'POST', '/v1/tus', b'', {**new, 'Upload-Metadata': text.encode()})
            self.assertEqual(code, 400, (text, body))
            self.assertNotIn('Set-Cookie', headers)
            json.loads(body)
        # What a name may be.
        for name in ('.hidden', 'a..b', 'Straße/Häuser 1.jpg', '\U0001f3db.jpg', 'x' * 1024):
            must_begin(self.daemon, 100, filename=name)


class Arriving(Tus):
    def test_a_line_that_breaks_all_the_time(self):
        db, data = new_database('breaking'), padded(1, 2_500_000)
        with Daemon(db) as daemon:
            path = must_begin(daemon, len(data), filename='1.jpg', camera='c')
            with BreakingLine(daemon, 70_000) as line:
                breaks = send_stubbornly(line, path, data)
                self.assertGreater(breaks, 30)
                self.assertEqual(breaks, line.cuts)
            self.assertEqual(self.finished(daemon, path)['state'], 'done')
        self.is_there_once(db, '1.jpg', data)

    def test_a_daemon_that_is_killed_all_the_time(self):
        db, data, rng = new_database('killed'), padded(1, 6_000_000), random.Random(1)
        daemon, told, kills, offset = Daemon(db), 0, 0, 0
        path = must_begin(daemon, len(data), filename='1.jpg', camera='c')
        while offset < len(data):
            # What was told is there, and nothing is there that was not sent.
            offset = offset_of(daemon, path)
            self.assertGreaterEqual(offset, told)
            killer = threading.Timer(rng.uniform(0, 0.03), daemon.process.kill)
            if kills < KILLS:
                killer.start()
            with contextlib.suppress(OSError, http.client.HTTPException):
                while offset < len(data) - (kills < KILLS):
                    ends = min(offset + rng.randrange(1, 300_000), len(data) - (kills < KILLS))
                    code, headers, _ = send(daemon, path, offset, data[offset:ends])
                    self.assertEqual(code, 204)
                    offset = told = int(headers['Upload-Offset'])
            if kills < KILLS:
                killer.join()
                daemon.process.communicate()
                kills += 1
                daemon = Daemon(db)
        self.assertEqual(send(daemon, path, told - 1, data[told - 1:])[0], 409)
        daemon.wait_for_uploads()
        daemon.__exit__()
        self.is_there_once(db, '1.jpg', data)

    def test_a_kill_between_the_last_byte_and_the_line(self):
        db, data = new_database('last'), photo(1)
        with Daemon(db) as daemon:
            path = must_begin(daemon, len(data), filename='1.jpg', camera='c')
            send(daemon, path, 0, data[:-1])
        for wait_s in (0, 0.001, 0.002, 0.004, 0.008):
            daemon = Daemon(db)
            threading.Timer(wait_s, daemon.process.kill).start()
            with contextlib.suppress(OSError, http.client.HTTPException):
                send(daemon, path, len(data) - 1, data[-1:])
            daemon.process.communicate()
        with Daemon(db) as daemon:
            offset = offset_of(daemon, path)
            self.assertIn(offset, (len(data) - 1, len(data)))
            if offset < len(data):
                self.assertEqual(send(daemon, path, offset, data[offset:])[0], 204)
            daemon.wait_for_uploads()
        self.is_there_once(db, '1.jpg', data)

    def test_many_at_once(self):
        db = new_database('many')
        with Daemon(db) as daemon:
            def bring(number):
                data = padded(number, 900_000)
                path = must_begin(daemon, len(data), filename=f'{number}.jpg', camera='c')
                with BreakingLine(daemon, 300_000) as line:
                    send_stubbornly(line, path, data)

            threads = [threading.Thread(target=bring, args=(n,)) for n in range(1, 9)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            daemon.wait_for_uploads()
            self.assertEqual(daemon.get('/v1/status')['images'], 8)
        for number in range(1, 9):
            self.assertEqual(ask('show', db, f'{number}.jpg')['sha256'],
                             sha256(padded(number, 900_000)))

    def test_two_connections_of_one_upload(self):
        db, data = new_database('two'), padded(1, 400_000)
        with Daemon(db) as daemon:
            path = must_begin(daemon, len(data), filename='1.jpg', camera='c')
            # The first one sends half of its body and then nothing any more, as a phone does that
            # has lost the net.
            host, port = daemon.host.split(':')
            with socket.create_connection((host, int(port))) as lost:
                lost.sendall((f'PATCH {path} HTTP/1.1\r\nHost: {daemon.host}\r\n'
                              f'Tus-Resumable: 1.0.0\r\nContent-Type: {PART}\r\n'
                              f'Upload-Offset: 0\r\nContent-Length: {len(data)}\r\n\r\n').encode() +
                             data[:200_000])
                self.assertEqual(send(daemon, path, 0, data[:300_000])[0], 204)
            time.sleep(0.2)
            self.assertEqual(offset_of(daemon, path), 300_000)
            self.assertEqual(send(daemon, path, 300_000, data[300_000:])[0], 204)
            self.assertEqual(self.finished(daemon, path)['state'], 'done')
        self.is_there_once(db, '1.jpg', data)

    def test_a_full_disk_passes(self):
        db, data = new_database('full'), padded(1, 600_000)
        with Daemon(db) as daemon:
            def limit_files(size):
                limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
                resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (size, limits[1]))

            path = must_begin(daemon, len(data), filename='1.jpg', camera='c')
            self.assertEqual(send(daemon, path, 0, data[:300_000])[0], 204)
            limit_files(1000)  # stands for a full disk, as in full_disk_test.sh
            code, headers, body = send(daemon, path, 300_000, data[300_000:400_000])
            self.assertEqual(code, 503, body)
            self.assertGreaterEqual(int(headers['Retry-After']), 1)
            limit_files(resource.RLIM_INFINITY)
            offset = 300_000
            while offset < len(data):
                code, headers, body = send(daemon, path, offset, data[offset:])
                # Also at the moment when the files are opened again.
                self.assertIn(code, (204, 503), body)
                if code == 503:
                    self.assertGreaterEqual(int(headers['Retry-After']), 1)
                time.sleep(0.2)
                told = offset_of(daemon, path)
                offset = told if told >= 0 else offset
            daemon.wait_for_uploads()
        self.is_there_once(db, '1.jpg', data)

    def test_a_client_that_is_too_slow(self):
        with Daemon(new_database('slow')) as daemon:
            path = must_begin(daemon, 1000, filename='1.jpg')
            host, port = daemon.host.split(':')
            with socket.create_connection((host, int(port)), timeout=60) as slow:
                slow.sendall((f'PATCH {path} HTTP/1.1\r\nHost: {daemon.host}\r\n'
                              f'Tus-Resumable: 1.0.0\r\nContent-Type: {PART}\r\n'
                              'Upload-Offset: 0\r\nContent-Length: 1000\r\n\r\n').encode() +
                             b'x' * 300)
                self.assertIn(b'408', slow.recv(1000))
            self.assertEqual(offset_of(daemon, path), 300, 'what has come is kept')

    def test_what_comes_no_further_expires(self):
        with Daemon(new_database('expiring'), '--parts-kept', '10') as daemon:
            path = must_begin(daemon, 1000, filename='1.jpg')
            self.assertEqual(send(daemon, path, 0, b'x' * 300)[0], 204)
            time.sleep(6)
            self.assertEqual(send(daemon, path, 300, b'x' * 300)[0], 204, 'it goes on in time')
            time.sleep(6)
            self.assertEqual(offset_of(daemon, path), 600)
            time.sleep(5)
            self.assertEqual(offset_of(daemon, path), -410)
            self.assertEqual(send(daemon, path, 600, b'x' * 300)[0], 410)


class Rights(Tus):
    def test_an_upload_is_its_tokens_own(self):
        db = new_database('rights')
        anna, bela, viewer, curator = (
            {'Authorization': 'Bearer ' + must('token', 'create', db, name, '--role', role).strip()}
            for name, role in (('anna', 'contributor'), ('bela', 'contributor'),
                               ('vera', 'viewer'), ('kai', 'curator')))
        data = photo(1)
        with Daemon(db) as daemon:
            self.assertEqual(daemon.ask('OPTIONS', '/v1/tus')[0], 204)
            self.assertEqual(begin(daemon, 10, filename='a')[0], 401)
            self.assertEqual(begin(daemon, 10, viewer, filename='a')[0], 403)
            self.assertEqual(begin(daemon, 10, anna, filename='a', contributor='bela')[0], 403)
            self.assertEqual(begin(daemon, 10, curator, filename='a', contributor='bela')[0], 201)
            path = must_begin(daemon, len(data), anna, filename='1.jpg', camera='c')
            for other in (bela, curator):
                self.assertEqual(offset_of(daemon, path, other), -404)
                self.assertEqual(send(daemon, path, 0, data, other)[0], 404)
                self.assertEqual(daemon.ask('DELETE', path, headers={**VERSION, **other})[0], 404)
            self.assertEqual(offset_of(daemon, path), -401)
            self.assertEqual(offset_of(daemon, path, viewer), -403)
            self.assertEqual(send(daemon, path, 0, data, anna)[0], 204)
        must('settle', db)
        self.assertEqual(ask('show', db, '1.jpg')['contributor'], 'anna')

    def test_a_strangers_body_is_not_read(self):
        db = new_database('strangers')
        must('token', 'create', db, 'vera')
        with Daemon(db) as daemon:
            host, port = daemon.host.split(':')
            with socket.create_connection((host, int(port)), timeout=60) as client:
                client.sendall((f'PATCH /v1/tus/{os.urandom(16).hex()} HTTP/1.1\r\n'
                                f'Host: {daemon.host}\r\nTus-Resumable: 1.0.0\r\n'
                                f'Content-Type: {PART}\r\nUpload-Offset: 0\r\n'
                                'Content-Length: 100000000\r\n\r\n').encode())
                self.assertIn(b'401', client.recv(100))


if __name__ == '__main__':
    main()
