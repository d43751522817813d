#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: each request and each call by RPC is a line of the log, with the id that its answer has, and
#   each photo one with the number that its request has; no token, no query and no part of a path
#   that a client chose is in any line. Calls by RPC are counted. Whoever started the daemon is told
#   when it is ready.
# Method: a real daemon that logs as JSON, and as text; requests of all kinds with secrets in them.
# usage: tests/cli/request_log_test.py VEDUTA VEDUTA_STREET
import json
import os
import re
import socket
import sys

from city import Case, at, main, must, new_database, photo, render
from daemon import JPEG, Daemon

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'cli', 'rpc'))
import veduta_rpc  # noqa: E402 (the line above finds it)

GUESS = 'x' * 43  # no token
ID = re.compile(r'^[0-9a-f]{16}$')


def setUpModule():
    render('street', '--photos', '4', '--size', '512x384')


class Log(Case):
    def log_of(self, daemon):
        code, err = daemon.stop()
        self.assertEqual(code, 0, err)
        return err, [json.loads(line) for line in err.splitlines() if line.startswith('{')]

    def test_requests_and_photos(self):
        db = new_database('logged')
        token = must('token', 'create', db, 'anna', '--role', 'curator').strip()
        with Daemon(db, '--log', 'json') as daemon:
            bearer = {'Authorization': 'Bearer ' + token}
            ids = []
            for path, headers in (('/v1/status', bearer), ('/v1/status?secret=1', bearer),
                                  ('/v1/photos/' + token, bearer), ('/v1/status', {}),
                                  ('/' + token, bearer),
                                  ('/v1/status', {'Authorization': 'Bearer veduta-1-' + GUESS})):
                _, told, _ = daemon.ask('GET', path, None, headers)
                ids.append(told['X-Request-Id'])
                self.assertRegex(ids[-1], ID)
            self.assertEqual(len(set(ids)), len(ids))
            for wanted, kept in (('my-own.id_1', True), ('a' * 65, False), ('two words', False),
                                 ('"quoted"', False), ('', False)):
                _, told, _ = daemon.ask('GET', '/healthz', None, {'X-Request-Id': wanted})
                self.assertEqual(told['X-Request-Id'] == wanted, kept)
            code, told, _ = daemon.ask('POST', '/v1/photos?name=a.jpg&camera=c', photo(1),
                                       {**JPEG, **bearer, 'X-Request-Id': 'upload-1'})
            self.assertEqual((code, told['X-Request-Id']), (201, 'upload-1'))
            must('add', db, '--camera', 'c', at('street', 'photos', 'photo0002.jpg'))
            err, lines = self.log_of(daemon)
        for secret in (token, token.split('-')[-1], 'secret', GUESS):
            self.assertNotIn(secret, err)
        by_id = {line['request']: line for line in lines if 'request' in line}
        found = [[by_id[one][key] for key in ('door', 'method', 'route', 'status', 'who')]
                 for one in ids]
        self.assertEqual(found, [['http', 'GET', '/v1/status', 200, 'anna'],
                                 ['http', 'GET', None, 400, None],
                                 ['http', 'GET', '/v1/photos/{photo}', 404, 'anna'],
                                 ['http', 'GET', '/v1/status', 401, None],
                                 ['http', 'GET', None, 404, None],
                                 ['http', 'GET', '/v1/status', 401, None]])
        self.assertGreater(by_id[ids[0]]['bytes'], 0)
        upload = by_id['upload-1']
        self.assertEqual((upload['who'], upload['status']), ('anna', 201))
        self.assertGreater(upload['ms'], 0)
        photos = {line['image']: line for line in lines if 'image' in line}
        self.assertEqual(photos['a.jpg']['upload'], upload['upload'])
        self.assertEqual(photos['a.jpg']['verdict'], 'postponed')
        owners = [line for line in lines if line.get('who') == 'owner']
        self.assertIn('/v1/photos', {line['route'] for line in owners})
        for line in lines:
            self.assertRegex(line['time'], r'^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$')

    def test_calls_by_rpc(self):
        db = new_database('called')
        token = must('token', 'create', db, 'bela', '--role', 'admin').strip()
        bearer = {'Authorization': 'Bearer ' + token}
        with Daemon(db, '--log', 'json', '--listen', '127.0.0.1:0') as daemon:
            city = veduta_rpc.connect(daemon.started['rpc'], token)
            city.status()
            city.close()
            _, _, text = daemon.ask('GET', '/metrics', None, bearer)
            _, lines = self.log_of(daemon)
        counted = re.findall(r'^veduta_rpc_calls_total\{request="([^"]*)",code="(\d+)"\} (\d+)$',
                             text.decode(), re.MULTILINE)
        self.assertIn(('GET /v1/status', '200', '2'), counted)
        calls = [line for line in lines if line.get('door') == 'rpc']
        self.assertEqual({line['who'] for line in calls}, {'bela'})

    def test_text(self):
        db = new_database('as text')
        with Daemon(db, '--log', 'text') as daemon:
            daemon.get('/v1/status')
            self.assertEqual(daemon.send('two "words".jpg', photo(1))[0], 201)
            code, err = daemon.stop()
        self.assertEqual(code, 0)
        self.assertRegex(err, r'(?m)^time="[^"]+" request="[0-9a-f]{16}" door="http" method="GET" '
                              r'route="/v1/status" status=200 bytes=\d+ ms=[0-9.]+$')
        self.assertRegex(err, r'(?m)^time="[^"]+" upload=1 image="two \\+"words\\+"\.jpg" id=1 ')

    def test_none(self):
        with Daemon(new_database('quiet')) as daemon:
            _, headers, _ = daemon.ask('GET', '/v1/status')
            self.assertRegex(headers['X-Request-Id'], ID)
            self.assertEqual(daemon.stop(), (0, '\nveduta: finishing the photo at hand; press '
                                                'Ctrl-C again to stop at once\n'))


class Supervisor(Case):
    def test_is_told_when_the_daemon_is_ready(self):
        for name in (at('notices'), '\0veduta-test-' + str(os.getpid())):
            notices = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            notices.bind(name)
            notices.setblocking(False)
            os.environ['NOTIFY_SOCKET'] = name.replace('\0', '@')
            try:
                db = new_database('noticed' + str(len(name)))
                self.assertRaises(BlockingIOError, notices.recv, 100)
                notices.settimeout(60)
                daemon = Daemon(db)
                self.assertEqual(notices.recv(100), b'READY=1')
                self.assertEqual(daemon.get('/readyz')['status'], 'ready')
                self.assertEqual(daemon.stop()[0], 0)
                self.assertEqual(notices.recv(100), b'STOPPING=1')
            finally:
                del os.environ['NOTIFY_SOCKET']
                notices.close()


if __name__ == '__main__':
    main()
