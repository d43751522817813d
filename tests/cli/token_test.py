#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: once there is a token, the daemon lets nobody in without one, and each role does what it may
#   and nothing else; tokens are made and revoked beside the daemon and count at once.
# Method: a real daemon on a few photos, asked by each role as people do; the table of every role
#   against every route is tests/cli/service/gatekeeper_test.cc.
# usage: tests/cli/token_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json
import socket
import urllib.parse

from city import Case, ask, at, main, must, new_database, photo, render, run, SIZE
from daemon import JPEG, Daemon


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


def bearer(token):
    return {'Authorization': 'Bearer ' + token}


def make(db, name, role, *more):
    return must('token', 'create', db, name, '--role', role, *more).strip()


class Tokens(Case):
    def code(self, daemon, method, path, token=None, body=None, headers={}):
        return daemon.ask(method, path, body,
                          {**headers, **(bearer(token) if token else {})})[0]

    def test_each_role_does_what_it_may(self):
        db = new_database('roles')
        viewer, sender, curator, admin = (
            make(db, name, role) for name, role in (
                ('vera', 'viewer'), ('anna', 'contributor'), ('kai', 'curator'),
                ('ada', 'admin')))
        with Daemon(db) as daemon:
            self.assertEqual(self.code(daemon, 'GET', '/healthz'), 200)
            code, headers, body = daemon.ask('GET', '/v1/status')
            self.assertEqual(code, 401)
            self.assertTrue(headers['WWW-Authenticate'].startswith('Bearer'))
            self.assertIn('Authorization', json.loads(body)['detail'])
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', viewer), 200)
            self.assertEqual(self.code(daemon, 'GET', '/v1/events?from=1'), 401)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', viewer[:-1]), 401)
            send = '/v1/photos?camera=c&name='
            self.assertEqual(self.code(daemon, 'POST', send + 'a.jpg', viewer, photo(1), JPEG),
                             403)
            self.assertEqual(self.code(daemon, 'POST', send + 'a.jpg', sender, photo(1), JPEG),
                             201)
            self.assertEqual(self.code(daemon, 'POST', send + 'b.jpg&contributor=kai', sender,
                                       photo(2), JPEG), 403)
            self.assertEqual(self.code(daemon, 'POST', send + 'b.jpg&contributor=bela', curator,
                                       photo(2), JPEG), 201)
            code, _, body = daemon.ask('GET', '/v1/photos/a.jpg', None, bearer(viewer))
            self.assertEqual((code, json.loads(body)['contributor']), (200, 'anna'))
            removal = json.dumps({'photos': ['a.jpg'], 'why': 'asked'})
            as_json = {'Content-Type': 'application/json'}
            for token, wanted in ((None, 401), (sender, 403), (curator, 200)):
                self.assertEqual(self.code(daemon, 'POST', '/v1/removals', token, removal,
                                           as_json), wanted)
            self.assertEqual(self.code(daemon, 'GET', '/v1/tokens', curator), 403)
            wish = json.dumps({'name': 'zoe', 'role': 'viewer'})
            code, _, body = daemon.ask('POST', '/v1/tokens', wish, {**as_json, **bearer(admin)})
            self.assertEqual(code, 201)
            made = json.loads(body)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', made['token']), 200)
            self.assertEqual(self.code(daemon, 'POST', f'/v1/tokens/{made["number"]}/revoke',
                                       admin, '{}', as_json), 200)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', made['token']), 401)
        done = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertEqual([e['actor'] for e in done if e['action'] == 'remove'], ['kai'])
        self.assertIn(('ada', 'made viewer token 5 of zoe'),
                      [(e['actor'], e['detail']) for e in done])
        self.assertEqual(must('verify', db), 'sound\n')

    def test_tokens_are_made_beside_the_daemon(self):
        db = new_database('beside')
        with Daemon(db) as daemon:
            self.assertEqual(self.code(daemon, 'GET', '/v1/status'), 200)
            proxied = {'Host': 'city.example'}
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', None, None, proxied), 403)
            token = make(db, 'anna', 'viewer', '--days', '3')
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', token, None, proxied), 200)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status'), 401)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', token), 200)
            must('add', db, '--camera', 'c', at('street', 'photos', 'photo0003.jpg'))  # the owner
            must('token', 'revoke', db, '1', '--by', 'owner')
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', token), 401)
            self.refused(1, 'no token 7', 'token', 'revoke', db, '7')
        listed, = ask('token', 'list', db)
        self.assertEqual((listed['name'], listed['role']), ('anna', 'viewer'))
        self.assertGreater(listed['revoked'], 0)
        self.assertNotIn(token, must('token', 'list', db))
        self.refused(2, 'viewer, contributor, curator or admin', 'token', 'create', db, 'x',
                     '--role', 'king')
        self.refused(2, 'name', 'token', 'create', db, '')
        self.refused(2, 'control characters', 'token', 'create', db, 'an\nna')
        self.refused(1, 'control characters', 'camera', 'add', db, 'a\x1b[1m', '--size', SIZE,
                     '--params', '400,400,256,192')

    def test_a_link_lets_whoever_has_it_read_until_it_ends(self):
        db = new_database('links')
        curator, sender = make(db, 'kai', 'curator'), make(db, 'anna', 'contributor')
        as_json = {'Content-Type': 'application/json'}
        with Daemon(db) as daemon:
            def post(path, token, **members):
                code, _, body = daemon.ask('POST', path, json.dumps(members),
                                           {**as_json, **bearer(token)})
                return code, json.loads(body)
            self.assertEqual(post('/v1/links', sender, name='x', days=1)[0], 403)
            for members in ({'name': 'x'}, {'name': 'x', 'days': 0}, {'name': 'x', 'days': 400},
                            {'days': 1}):
                self.assertEqual(post('/v1/links', curator, **members)[0], 400, members)
            code, made = post('/v1/links', curator, name='the council', days=3)
            self.assertEqual(code, 201)
            path, token = made['path'].split('=')
            self.assertEqual(path, '/#link')
            self.assertEqual(self.code(daemon, 'GET', '/v1/photos', token), 200)
            self.assertEqual(self.code(daemon, 'POST', '/v1/photos?name=a.jpg', token, photo(1),
                                       JPEG), 403)
            self.assertEqual(self.code(daemon, 'GET', '/v1/links', token), 403)
            # A token is taken from the header alone.
            self.assertEqual(self.code(daemon, 'GET', '/v1/status?link=' + token), 400)
            code, _, body = daemon.ask('GET', '/v1/links', None, bearer(curator))
            listed, = json.loads(body)
            self.assertEqual((listed['number'], listed['name'], listed['role'], listed['link']),
                             (made['number'], 'the council', 'viewer', True))
            self.assertEqual(listed['expires'] - listed['created'], 3 * 86_400)
            self.assertNotIn(token.encode(), body)
            # Tokens of people are not theirs to revoke.
            self.assertEqual(post('/v1/links/2/revoke', curator)[0], 404)
            self.assertEqual(post(f'/v1/links/{made["number"]}/revoke', curator)[0], 200)
            self.assertEqual(self.code(daemon, 'GET', '/v1/photos', token), 401)
            printed = must('token', 'link', db, 'a friend', '--at', 'https://city.example').strip()
            self.assertTrue(printed.startswith('https://city.example/#link=veduta-4-'), printed)
            self.assertEqual(self.code(daemon, 'GET', '/v1/photos', printed.split('=')[1]), 200)
            code, headers, _ = daemon.ask('GET', '/')
            self.assertEqual((code, headers['Referrer-Policy']), (200, 'no-referrer'))
        self.assertRegex(must('token', 'list', db), r'\n +4  link +a friend, .*, until ')
        done = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertIn(('kai', 'made link 3 of the council'),
                      [(e['actor'], e['detail']) for e in done])
        for secret in (token, printed.split('=')[1]):
            self.assertNotIn(secret.split('-', 2)[2], json.dumps(done))
        self.refused(2, 'Value 0 not in range', 'token', 'link', db, 'x', '--days', '0')

    def test_other_machines_may_ask_once_there_is_a_token(self):
        db = new_database('open')
        self.refused(2, 'token create', 'serve', db, '--http', '0.0.0.0:0')
        token = make(db, 'vera', 'viewer')
        self.refused(1, 'no address of this machine', 'serve', db, '--http', 'example.com:80')
        with Daemon(db, http='0.0.0.0:0') as daemon:
            self.assertTrue(daemon.host.startswith('0.0.0.0:'))
            host = {'Host': 'city.example'}
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', token, None, host), 200)
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', None, None, host), 401)
            other = {**host, 'Origin': 'http://evil.example'}
            self.assertEqual(self.code(daemon, 'GET', '/v1/status', token, None, other), 403)

    def test_a_token_does_as_much_as_its_quota_says(self):
        db = new_database('quotas')
        few = make(db, 'anna', 'contributor', '--photos-per-day', '2')
        small = make(db, 'bela', 'contributor', '--bytes-per-day', '100')
        slow = make(db, 'vera', 'viewer', '--requests-per-second', '1')
        with Daemon(db) as daemon:
            beside = make(db, 'cara', 'contributor', '--photos-per-day', '3')
            send = '/v1/photos?camera=c&name='

            def refused(method, path, token, body=None, headers=JPEG):
                code, answered, told = daemon.ask(method, path, body,
                                                  {**headers, **bearer(token)})
                self.assertEqual(code, 429, told)
                self.assertIn('quota', json.loads(told)['detail'])
                return int(answered['Retry-After'])

            for number in (1, 2):
                self.assertEqual(self.code(daemon, 'POST', f'{send}{number}.jpg', few,
                                           photo(number), JPEG), 201)
            wait = refused('POST', send + '3.jpg', few, photo(3))
            self.assertTrue(0.9 * 43_200 < wait <= 43_200, wait)
            announced = {'Tus-Resumable': '1.0.0', 'Upload-Length': '101',
                         'Upload-Metadata': 'filename YQ=='}
            refused('POST', '/v1/tus', few, b'', announced)
            refused('POST', '/v1/tus', small, b'', announced)
            refused('POST', send + '3.jpg', small, photo(3))
            self.assertEqual(self.code(daemon, 'POST', send + '3.jpg', beside, photo(3), JPEG),
                             201)
            codes = [self.code(daemon, 'GET', '/v1/status', slow) for _ in range(20)]
            self.assertEqual(codes[:10], [200] * 10)
            self.assertIn(429, codes[10:])
        listed = ask('token', 'list', db)
        self.assertEqual([(one['photos_per_day'], one['bytes_per_day'],
                           one['requests_per_second']) for one in listed],
                         [(2, None, None), (None, 100, None), (None, None, 1), (3, None, None)])
        self.assertIn('2 photos a day', must('token', 'list', db))

    def test_a_size_is_not_negative(self):
        db = new_database('negative')
        self.assertEqual(run('token', 'create', db, 'eve', '--role', 'contributor',
                             '--bytes-per-day', '-5')[0], 2)

    def test_who_follows_is_cut_off_where_the_token_is_revoked(self):
        db = new_database('revoked')
        make(db, 'ada', 'admin')
        token = make(db, 'vera', 'viewer')
        with Daemon(db) as daemon:
            host, port = daemon.host.split(':')
            with contextlib.closing(socket.create_connection((host, int(port)),
                                                             timeout=60)) as client:
                client.sendall(f'GET /v1/events HTTP/1.1\r\nHost: {daemon.host}\r\n'
                               f'Authorization: Bearer {token}\r\n\r\n'.encode())
                self.assertIn(b'200', client.recv(100))
                number = next(one['number'] for one in ask('token', 'list', db)
                              if one['name'] == 'vera')
                must('token', 'revoke', db, str(number))
                told = b''
                while not told.endswith(b'\r\n0\r\n\r\n'):  # the last chunk
                    told += client.recv(10_000)

    def test_a_strangers_body_is_not_read(self):
        db = new_database('bodies')
        make(db, 'vera', 'viewer')
        with Daemon(db) as daemon:
            host, port = daemon.host.split(':')
            query = urllib.parse.urlencode({'name': 'x.jpg'})
            with contextlib.closing(socket.create_connection((host, int(port)),
                                                             timeout=60)) as client:
                client.sendall(f'POST /v1/photos?{query} HTTP/1.1\r\nHost: {daemon.host}\r\n'
                               'Content-Type: image/jpeg\r\nContent-Length: 100000000\r\n\r\n'
                               .encode())
                self.assertIn(b'401', client.recv(100))


if __name__ == '__main__':
    main()
