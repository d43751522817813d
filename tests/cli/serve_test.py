#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the daemon answers over HTTP what the command line answers, takes photos of many at once so
#   that the journal's order gives the same city, refuses what is wrong and says why, loses nothing
#   that it has acknowledged, and outlives clients that misbehave and a disk that was full.
# Method: real daemons on photos of a rendered street; clients in threads; raw sockets for what no
#   client would send.
# usage: tests/cli/serve_test.py VEDUTA VEDUTA_STREET
import concurrent.futures
import contextlib
import hashlib
import http.client
import json
import re
import resource
import signal
import socket
import time

from city import (PARAMS, PHOTO_COUNT, SIZE, WHOLE, Case, ask, at, main, make_whole, must,
                  new_database, photo)
from daemon import JPEG, Daemon, part


def setUpModule():
    make_whole()


NUMBERS = range(1, PHOTO_COUNT + 1)


def name_of(number):
    return f'photo{number:04}.jpg'


def without(answer, *keys):
    return {key: value for key, value in answer.items() if key not in keys}


class Asking(Case):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(WHOLE)
        cls.addClassCleanup(cls.daemon.__exit__, None, None, None)

    def test_answers_are_those_of_the_command_line(self):
        get, name = self.daemon.get, name_of(3)
        # How much a process has written and read differs from process to process.
        self.assertEqual(without(get('/v1/status'), 'storage'),
                         without(ask('status', WHOLE), 'storage'))
        self.assertEqual(get('/v1/cameras'), ask('camera', 'list', WHOLE))
        self.assertEqual(get('/v1/cameras/c'), ask('camera', 'list', WHOLE)[0])
        pose = ask('pose', WHOLE, name)
        self.assertEqual(get('/v1/photos/' + name + '/pose'), without(pose, 'uncertainty'))
        self.assertEqual(get('/v1/photos/' + name + '/uncertainty'), pose['uncertainty'])
        self.assertEqual(get('/v1/photos/' + name + '/neighbors'), ask('neighbors', WHOLE, name))
        self.assertEqual(get('/v1/hypotheses'), [])
        reconstructions = get('/v1/reconstructions')
        self.assertEqual(reconstructions, ask('status', WHOLE)['reconstructions'])
        number = str(reconstructions[0]['id'])
        self.assertEqual(get('/v1/reconstructions/' + number),
                         ask('reconstruction', WHOLE, number))
        journal = get('/v1/journal')
        self.assertEqual(get('/v1/journal?from=3&count=2'), journal[2:4])

    def test_a_photo_is_found_by_all_that_it_is_known_by(self):
        shown = ask('show', WHOLE, name_of(3))
        told = self.daemon.get('/v1/photos/' + name_of(3))
        self.assertEqual(told, without(shown, 'uncertainty'))
        for other in ('anna/' + name_of(3), f'#{shown["id"]}'):
            self.assertEqual(self.daemon.get('/v1/photos/' + part(other)), told)

    def test_what_is_wrong_is_said(self):
        for code, method, path, words in [
                (404, 'GET', '/none.html', 'there is nothing at '),
                (404, 'GET', '/v1/nothing', '/v1/nothing'),
                (404, 'GET', '/v1/photos/none.jpg', 'none.jpg'),
                (404, 'GET', '/v1/photos/none.jpg/pose', 'none.jpg'),
                (404, 'GET', '/v1/cameras/none', 'none'),
                (404, 'GET', '/v1/reconstructions/77', '77'),
                (400, 'GET', '/v1/reconstructions/x', 'whole number'),
                (400, 'GET', '/v1/reconstructions/0', 'from 1'),
                (400, 'GET', '/v1/reconstructions/4294967296', 'whole number'),
                (400, 'GET', '/v1/journal?count=0', "'count'"),
                (404, 'GET', '/v1/photos/none.jpg/uncertainty', 'none.jpg'),
                (400, 'GET', '/v1/journal?from=-1', "'from'"),
                (400, 'GET', '/v1/journal?from=1&from=2', 'twice'),
                (400, 'GET', '/v1/status?verbose=yes', "'verbose'"),
                (400, 'GET', '/v1/events?from=last', 'NUMBER'),
                (400, 'POST', '/v1/photos', 'no name'),
                (400, 'POST', '/v1/photos?name=../a.jpg', 'leads out'),
                (400, 'POST', '/v1/photos?name=/a.jpg', 'leads out'),
                (400, 'POST', '/v1/photos?name=a%0a%00.jpg', 'control characters'),
                (400, 'POST', '/v1/photos?name=a.jpg&contributor=a%0a', 'control characters'),
                (400, 'POST', '/v1/localize?count=3', "'count'"),
                (400, 'POST', '/v1/candidates?count=x', "'count'"),
                (404, 'POST', '/v1/photos?name=a.jpg&camera=none', 'none'),
                (404, 'POST', '/v1/localize?camera=none', 'none'),
                (405, 'DELETE', '/v1/photos/a.jpg', 'GET'),
                (405, 'GET', '/v1/localize', 'POST'),
                (400, 'GET', '/v1/photos?count=0', "'count'"),
                (405, 'POST', '/v1/status', 'GET')]:
            with self.subTest(f'{method} {path}'):
                sent = b'x' if method == 'POST' else None
                got, headers, body = self.daemon.ask(method, path, sent, JPEG)
                self.assertEqual(headers['Content-Type'], 'application/problem+json')
                problem = json.loads(body)
                self.assertEqual((got, problem['status']), (code, code), body)
                self.assertIn(words, problem['detail'])
                if code == 405:
                    self.assertEqual(headers['Allow'], words)

    def test_a_body_that_is_no_photo(self):
        ask_daemon = self.daemon.ask
        for path in ('/v1/photos?name=a.jpg', '/v1/localize', '/v1/candidates'):
            self.assertEqual(ask_daemon('POST', path, b'x', {'Content-Type': 'text/plain'})[0], 415)
            self.assertEqual(ask_daemon('POST', path, b'', JPEG)[0], 400)
        self.assertEqual(ask_daemon('POST', '/v1/localize?camera=c', b'no photo', JPEG)[0], 200)

    def test_a_body_that_is_too_large(self):
        with contextlib.closing(self.daemon.connect()) as connection:
            connection.putrequest('POST', '/v1/photos?name=a.jpg')
            connection.putheader('Content-Type', 'image/jpeg')
            connection.putheader('Content-Length', str(1 << 40))
            connection.endheaders()
            answer = connection.getresponse()
            self.assertEqual((answer.status, answer.read()[:1]), (413, b'{'))
        # One that is not wanted for another reason is sent to its end before the answer is read.
        self.assertEqual(self.daemon.ask('POST', '/v1/nothing', b'x' * 5_000_000, JPEG)[0], 404)

    def test_lists_and_bytes(self):
        listed, last = [], 0
        while page := self.daemon.get(f'/v1/photos?from={last + 1}&count=5'):
            self.assertLessEqual(len(page), 5)
            listed += page
            last = page[-1]['id']
        self.assertEqual(len(listed), self.daemon.get('/v1/status')['images'])
        placed = next(image for image in listed if image['center'])
        pose = self.daemon.get('/v1/photos/%23' + str(placed['id']) + '/pose')
        self.assertEqual((placed['center'], placed['rotation_wxyz'], placed['reconstruction']),
                         (pose['center'], pose['rotation_wxyz'], pose['reconstruction']))
        path = '/v1/photos/' + part(placed['image'])
        code, headers, data = self.daemon.ask('GET', path + '/thumbnail?side=64')
        self.assertEqual((code, headers['Content-Type'], data[:2]),
                         (200, 'image/jpeg', b'\xff\xd8'))
        code, headers, data = self.daemon.ask('GET', path + '/file')
        self.assertEqual((code, headers['Content-Type']), (200, 'image/jpeg'))
        self.assertEqual(hashlib.sha256(data).hexdigest(), self.daemon.get(path)['sha256'])
        for wrong in ('/thumbnail?side=8', '/thumbnail?side=9999'):
            self.assertEqual(self.daemon.ask('GET', path + wrong)[0], 400)
        for reconstruction in self.daemon.get('/v1/reconstructions'):
            code, headers, data = self.daemon.ask(
                'GET', f'/v1/reconstructions/{reconstruction["id"]}/points')
            self.assertEqual((code, len(data)), (200, 16 * reconstruction['points']))
            self.assertEqual(set(data[15::16]), {0})
        self.assertEqual(self.daemon.ask('GET', '/v1/reconstructions/99/points')[0], 404)

    def test_the_document_of_all_routes(self):
        document = self.daemon.get('/v1/openapi.json')
        for path, methods in document['paths'].items():
            if 'get' in methods and path != '/v1/events':  # which never ends
                asked = path.replace('{photo}', 'none.jpg').replace('{camera}', 'c')
                code = self.daemon.ask('GET', re.sub(r'{\w+}', '1', asked))[0]
                self.assertIn(code, (200, 403, 404), path)

    def test_localizing_changes_nothing(self):
        before = must('digest', WHOLE)
        code, _, body = self.daemon.ask('POST', '/v1/localize?camera=c', photo(5), JPEG)
        told = json.loads(body)
        self.assertEqual((code, told['verdict']), (200, 'localized'))
        self.assertEqual(told['stored'], ask('show', WHOLE, name_of(5))['id'])
        code, _, body = self.daemon.ask('POST', '/v1/candidates?camera=c&count=3', photo(5), JPEG)
        ranked = json.loads(body)
        self.assertEqual((code, len(ranked)), (200, 3))
        self.assertEqual(ranked[0]['image'], name_of(5))
        self.assertEqual(must('digest', WHOLE), before)

    def test_a_tag_saves_the_answer(self):
        path = '/v1/photos/' + name_of(1)
        code, headers, body = self.daemon.ask('GET', path)
        tag = {'If-None-Match': headers['ETag']}
        self.assertEqual(self.daemon.ask('GET', path, headers=tag)[::2], (304, b''))
        code, headers, none = self.daemon.ask('HEAD', '/v1/events')
        self.assertEqual((code, headers['Content-Type'], none), (200, 'text/event-stream', b''))
        code, headers, none = self.daemon.ask('HEAD', path)
        self.assertEqual((code, none), (200, b''))
        self.assertEqual(int(headers['Content-Length']), len(body))
        self.assertEqual(self.daemon.ask('GET', path, headers={'If-None-Match': 'W/"x"'})[2], body)

    def test_health_and_metrics(self):
        self.assertEqual(self.daemon.get('/healthz'), {'status': 'alive'})
        self.assertEqual(self.daemon.get('/readyz'), {'status': 'ready'})
        code, headers, body = self.daemon.ask('GET', '/metrics')
        self.assertEqual(code, 200)
        self.assertTrue(headers['Content-Type'].startswith('text/plain'))
        placed = ask('status', WHOLE)['placed']
        self.assertIn(f'veduta_images{{verdict="placed"}} {placed}\n', body.decode())
        self.assertIn('veduta_http_requests_total{code="200"} ', body.decode())

    def test_pages_of_others_are_refused(self):
        for headers in ({'Host': 'evil.example'}, {'Host': 'evil.example:80'},
                        {'Origin': 'http://evil.example'}, {'Origin': 'null'},
                        {'Sec-Fetch-Site': 'cross-site'}, {'Sec-Fetch-Site': 'same-site'}):
            self.assertEqual(self.daemon.ask('GET', '/v1/status', headers=headers)[0], 403, headers)
        host = 'localhost:' + self.daemon.host.split(':')[1]
        own = {'Host': host, 'Origin': 'http://' + host, 'Sec-Fetch-Site': 'same-origin'}
        self.assertEqual(self.daemon.ask('GET', '/v1/status', headers=own)[0], 200)
        behind_tls = {**own, 'Origin': 'https://' + host}
        self.assertEqual(self.daemon.ask('GET', '/v1/status', headers=behind_tls)[0], 200)
        link = {'Sec-Fetch-Site': 'cross-site'}
        self.assertEqual(self.daemon.ask('GET', '/', headers=link)[0], 200)
        self.assertEqual(self.daemon.ask('POST', '/', headers=link)[0], 405)

    def test_clients_that_misbehave_end_their_own_connection_alone(self):
        host, port = self.daemon.host.split(':')
        head = b'POST /v1/photos?name=x.jpg HTTP/1.1\r\nHost: localhost\r\n'
        for data in (b'\0' * 5000, b'GET\r\n\r\n', b'GET / HTTP/9.9\r\n\r\n',
                     b'GET / HTTP/1.1\r\nHost: localhost\r\n' + b'a: b\r\n' * 200_000,
                     b'GET ' + b'/' * 1_000_000, b'GET /%zz HTTP/1.1\r\nHost: localhost\r\n\r\n',
                     b'GET /v1/status HTTP/1.1\r\n\r\n',
                     head + b'Content-Length: 9\r\nContent-Length: 3\r\n\r\nabcGET /v1/x',
                     head + b'Content-Length: -5\r\n\r\nabc',
                     head + b'Transfer-Encoding: chunked\r\n\r\nzz\r\n',
                     head + b'Content-Length: 1000\r\n\r\nhalf'):
            with socket.create_connection((host, int(port)), timeout=60) as client:
                answer = b''
                try:
                    client.sendall(data)
                    client.shutdown(socket.SHUT_WR)
                    answer = client.recv(1000)
                except OSError as cut_off:  # which may happen at any moment
                    self.assertNotIsInstance(cut_off, TimeoutError, data[:80])
                self.assertFalse(answer.startswith(b'HTTP/1.1 2'), (data[:80], answer))
        self.assertEqual(self.daemon.get('/healthz'), {'status': 'alive'})
        self.assertEqual(self.daemon.ask('GET', '/v1/photos/x.jpg')[0], 404)

    def test_questions_have_no_body(self):
        for method, path in (('GET', '/v1/status'), ('HEAD', '/v1/status'), ('OPTIONS', '/v1/tus')):
            self.assertEqual(self.daemon.ask(method, path, b'x' * 1000)[0], 413, method)

    def test_connections_that_cannot_be_taken_pass(self):
        """Where the process has no file to spare, nobody is let in, and all are afterwards."""
        with Daemon(new_database('no_files'), limits={resource.RLIMIT_NOFILE: 120}) as daemon:
            host, port = daemon.host.split(':')
            time.sleep(3)  # until all of its threads have begun, which want files themselves
            with contextlib.ExitStack() as held:
                for _ in range(150):
                    held.enter_context(socket.create_connection((host, int(port)), timeout=60))
                time.sleep(0.5)
            self.assertEqual(daemon.get('/healthz'), {'status': 'alive'})

    def test_broken_messages_are_told_and_fill_no_log(self):
        with Daemon(new_database('broken_messages')) as daemon:
            host, port = daemon.host.split(':')
            for path in ('/v1/photos?name=x.jpg', '/v1/none'):
                with socket.create_connection((host, int(port)), timeout=60) as client:
                    client.sendall(f'POST {path} HTTP/1.1\r\nHost: localhost\r\n'
                                   'Content-Type: image/jpeg\r\n'
                                   'Transfer-Encoding: chunked\r\n\r\nzz\r\n'.encode())
                    self.assertIn(client.recv(12), (b'HTTP/1.1 400', b'HTTP/1.1 404'))
            code, err = daemon.stop()
            self.assertEqual((code, 'kj/' in err), (0, False), err)

    def test_a_second_writer_is_sent_away(self):
        self.refused(3, 'another veduta process', 'repair', WHOLE, '--yes')
        self.refused(3, 'another veduta process', 'serve', WHOLE)


class Starting(Case):
    def test_no_other_machine_may_ask(self):
        for address in ('0.0.0.0:0', '192.168.1.1:80', 'example.com:80', '[::]:80', '127.0.0.1',
                        ''):
            self.refused(2, 'localhost', 'serve', WHOLE, '--http', address)
        self.refused(1, 'cannot serve', 'serve', WHOLE, '--http', '127.0.0.1:99999')
        self.refused(1, 'none', 'serve', at('none'))
        self.refused(1, 'no OpenCL device is "abacus"', 'serve', WHOLE, '--device', 'abacus')
        self.refused(2, 'not executable', 'serve', WHOLE, '--blur', WHOLE + '/CURRENT')


class Taking(Case):
    def test_the_journals_order_gives_the_same_city(self):
        db, people = new_database('many'), ['anna', 'bela', 'cara', 'dora']
        with Daemon(db, '--threads', '2') as daemon:
            def send_all(who):
                return [daemon.send(name_of(n), photo(n), who)
                        for n in NUMBERS[people.index(who)::len(people)]]

            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                sent, counts = [pool.submit(send_all, who) for who in people], []
                while not all(answers.done() for answers in sent):
                    counts.append(daemon.get('/v1/status')['images'])
            self.assertEqual(counts, sorted(counts))
            self.assertGreater(len(set(counts)), 2, 'readers see the city grow')
            for answers in sent:
                for code, headers, outcome in answers.result():
                    self.assertEqual(code, 201, outcome)
                    shown = json.loads(daemon.ask('GET', headers['Location'])[2])
                    self.assertEqual(shown['image'], outcome['image'])
            order = [daemon.get(f'/v1/photos/%23{n}') for n in NUMBERS]
        again = new_database('many_again')
        must('settle', db)  # what follows from the last photo
        for image in order:
            must('add', again, '--camera', 'c', '--contributor', image['contributor'],
                 at('street', 'photos', image['image']))
        self.assertEqual(must('digest', again), must('digest', db))
        self.assertEqual(must('verify', db), 'sound\n')

    def test_what_is_of_no_use_is_told_as_such(self):
        with Daemon(new_database('copy')) as daemon:
            self.assertEqual(daemon.send('a.jpg', photo(1))[0], 201)
            code, headers, answer = daemon.send('b.jpg', photo(1))
            self.assertEqual((code, headers['Location']), (409, '/v1/photos/%231'))
            self.assertIn('a.jpg', answer['detail'])
            self.assertEqual(daemon.send('a.jpg', photo(2))[0], 422)
            code, headers, answer = daemon.send('text.jpg', b'no photo')
            self.assertEqual((code, answer['photo']['verdict']), (422, 'rejected'))
            shown = json.loads(daemon.ask('GET', headers['Location'])[2])
            self.assertIn(answer['detail'], shown['reason'])

    def test_cameras_come_in(self):
        with Daemon(new_database('cameras')) as daemon:
            def post(camera, kind='application/json'):
                return daemon.ask('POST', '/v1/cameras', camera, {'Content-Type': kind})[0]

            camera = {'name': 'd', 'size': SIZE, 'params': PARAMS}
            self.assertEqual(post(json.dumps(camera)), 201)
            self.assertEqual(post(json.dumps(camera)), 201)
            self.assertEqual(post(json.dumps({**camera, 'params': '400,400,256,192'})), 409)
            self.assertEqual(daemon.get('/v1/cameras/d')['params'], PARAMS)
            for wrong in ('', '[', '[1]', '{}', json.dumps({**camera, 'size': 3}),
                          json.dumps({**camera, 'params': 'x'}), '[' * 60_000):
                self.assertEqual(post(wrong), 400, wrong[:50])
            self.assertEqual(post('[' * 1_000_000), 413)
            self.assertEqual(post(json.dumps(camera), 'text/plain'), 415)

    def test_a_full_line_sends_away_and_loses_nothing(self):
        db = new_database('full')
        with Daemon(db, '--waiting', '1') as daemon:
            with concurrent.futures.ThreadPoolExecutor(6) as pool:
                sent = [pool.submit(daemon.send_until_taken, name_of(n), photo(n))
                        for n in NUMBERS[:6]]
                self.assertEqual({done.result()[0] for done in sent}, {201})
            self.assertEqual(daemon.get('/v1/status')['images'], 6)
            self.assertGreater(self.count(daemon, 'veduta_http_requests_total{code="429"}'), 0)

    def count(self, daemon, name):
        """A sample of the metrics."""
        for line in daemon.ask('GET', '/metrics')[2].decode().splitlines():
            if line.startswith(name + ' '):
                return int(line.split()[-1])
        return 0

    def test_clients_that_vanish_leave_room(self):
        with Daemon(new_database('vanish'), '--waiting', '2') as daemon:
            for n in NUMBERS[:8]:
                for path in (f'/v1/photos?name={name_of(n)}&camera=c', '/v1/localize?camera=c'):
                    connection = daemon.connect()
                    connection.request('POST', path, photo(n), JPEG)
                    connection.close()
            code, answer = daemon.send_until_taken('last.jpg', photo(9))
            self.assertEqual(code, 201, answer)
            while self.count(daemon, 'veduta_photos_waiting') > 0:
                time.sleep(0.05)
            for n in NUMBERS[9:]:
                self.assertEqual(daemon.send(name_of(n), photo(n))[0], 201)

    def test_who_follows_hears_all_once(self):
        db = new_database('events')
        with Daemon(db) as daemon:
            def follow(count, headers={}):
                """So many events, as they come."""
                connection = daemon.connect()
                connection.request('GET', '/v1/events', headers=headers)
                answer, events = connection.getresponse(), []
                self.assertEqual(answer.headers['Content-Type'], 'text/event-stream')
                while len(events) < count:
                    line = answer.readline().decode()
                    if line.startswith('data: '):
                        events.append(json.loads(line.removeprefix('data: ')))
                connection.close()
                return events

            with concurrent.futures.ThreadPoolExecutor(1) as pool:
                following = pool.submit(follow, 5)
                for n in NUMBERS[:4]:
                    self.assertEqual(daemon.send(name_of(n), photo(n))[0], 201)
                first = following.result()
            journal = daemon.get('/v1/journal')
            rest = follow(len(journal) - 5, {'Last-Event-ID': str(first[-1]['sequence'])}) \
                if len(journal) > 5 else []
            self.assertEqual(first + rest, journal)


class Failing(Case):
    def test_a_full_disk_passes(self):
        db = new_database('full_disk')
        with Daemon(db) as daemon:
            self.assertEqual(daemon.send(name_of(1), photo(1))[0], 201)

            def limit_files(size):
                limits = resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE)
                resource.prlimit(daemon.process.pid, resource.RLIMIT_FSIZE, (size, limits[1]))

            limit_files(1000)  # stands for a full disk, as in full_disk_test.sh
            code, headers, answer = daemon.send(name_of(2), photo(2))
            self.assertEqual(code, 503, answer)
            self.assertIn('File too large', answer['detail'])
            for _ in range(20):  # also while the files would be opened again
                self.assertEqual(daemon.get('/v1/status')['images'], 1)
                time.sleep(0.05)
            limit_files(resource.RLIM_INFINITY)
            for n in NUMBERS[1:4]:
                code, answer = daemon.send_until_taken(name_of(n), photo(n))
                self.assertEqual(code, 201, answer)
            self.assertEqual(daemon.get('/v1/status')['images'], 4)
        self.assertEqual(must('verify', db), 'sound\n')


class Stopping(Case):
    def check_stop(self, how, name):
        """Whatever was acknowledged is there; what was not may be sent again."""
        db = new_database(name)
        daemon, taken, accepted = Daemon(db, '--threads', '2'), [], []

        def send(n):
            try:
                code, _, answer = daemon.send(name_of(n), photo(n), f'who{n % 3}')
            except (ConnectionError, http.client.HTTPException):
                if how == signal.SIGKILL:
                    return
                raise
            self.assertIn(code, (201, 202, 503), answer)
            if code == 201:
                taken.append(n)
            if code == 202:
                accepted.append(n)

        with concurrent.futures.ThreadPoolExecutor(PHOTO_COUNT) as pool:
            sent = [pool.submit(send, n) for n in NUMBERS]
            while len(taken) < 3:
                time.sleep(0.01)
            start = time.monotonic()
            code, err = daemon.stop(how)
            self.assertLess(time.monotonic() - start, 30)
            for done in sent:
                done.result()
        self.assertEqual(code, 0 if how == signal.SIGTERM else -how, err)
        self.assertEqual(must('verify', db), 'sound\n')
        with Daemon(db) as daemon:
            daemon.wait_for_uploads()
            for n in NUMBERS:
                code, answer = daemon.send_until_taken(name_of(n), photo(n), f'who{n % 3}')
                self.assertIn(code, (409,) if n in taken + accepted else (201, 409), answer)
            self.assertEqual(daemon.get('/v1/status')['images'], PHOTO_COUNT)

    def test_a_request_to_stop(self):
        self.check_stop(signal.SIGTERM, 'stopped')

    def test_a_kill(self):
        self.check_stop(signal.SIGKILL, 'killed')

    def test_those_who_follow_are_not_cut_off_where_the_files_are_opened_again(self):
        db = at('followed.veduta')
        must('copy', WHOLE, db)
        with Daemon(db) as daemon:
            first = len(must('journal', db).splitlines()) + 1
            connections = [daemon.connect() for _ in range(8)]
            for connection in connections:
                connection.request('GET', f'/v1/events?from={first}')
            answers = [connection.getresponse() for connection in connections]
            names = [image['image'] for image in daemon.get('/v1/photos')][:3]
            for name in names:  # each of them opens the files again
                must('remove', db, name)
            for answer in answers:
                removed = 0
                while removed < len(names):
                    line = answer.readline()
                    self.assertNotEqual(line, b'', 'the events have ended')
                    if line.startswith(b'data: '):
                        removed += json.loads(line[6:])['action'] == 'remove'
            for connection in connections:
                connection.close()

    def test_one_who_follows_does_not_hold_it_up(self):
        daemon = Daemon(WHOLE)
        connection = daemon.connect()
        connection.request('GET', '/v1/events')
        answer = connection.getresponse()
        while not answer.readline().startswith(b'data: '):
            pass
        self.assertEqual(daemon.stop()[0], 0)
        answer.read()  # it ends
        connection.close()


if __name__ == '__main__':
    main()
