#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: whoever sends the daemon of RPC what is no message, half of one, too much, or nothing at
#   all, harms the own connection alone, and what the connection held is given back.
# Method: a real daemon on a few photos; sockets that speak as no client would, and clients that
#   vanish; then a good client is answered, and the daemon's open files are counted. Limits of time
#   that take a minute are tested by tests/cli/rpc/rpc_connection_test.cc.
# usage: tests/cli/rpc_hostile_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import itertools
import os
import random
import select
import socket
import struct
import sys
import time

from city import PHOTO_COUNT, WHOLE, Case, main, make_whole, must, new_database, photo
from daemon import Daemon

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'cli', 'rpc'))
import veduta_rpc  # noqa: E402 (the line above finds it)

LOGIN_S = 15  # as cli/rpc/rpc_connection.h has it
BOOTSTRAP = {'bootstrap': {'questionId': 0}}


def setUpModule():
    make_whole()


def call(question, interface, method, target, payload):
    return {'call': {'questionId': question, 'target': target, 'interfaceId': interface,
                     'methodId': method, 'params': payload}}


def login(question=1):
    interface, method = veduta_rpc.METHODS['Gate.login']
    return call(question, interface, method, {'promisedAnswer': {'questionId': 0}},
                {'content': ('Gate.login()', {'token': ''})})


class Hostile(Case):
    def setUp(self):
        self.daemon = Daemon(WHOLE, '--listen', '127.0.0.1:0')
        self.addCleanup(self.end)
        self.address = self.daemon.started['rpc']
        with self.connect() as city:
            city.status()
        self.files = self.open_sockets()

    def end(self):
        """Nothing of what strangers sent was worth a line."""
        if self.daemon.process.poll() is None:
            code, err = self.daemon.stop()
            self.assertEqual(code, 0)
            self.assertEqual([line for line in err.splitlines() if line
                              and 'finishing the photo' not in line], [])

    def connect(self):
        return veduta_rpc.connect(self.address)

    def socket(self):
        host, port = self.address.split(':')
        return socket.create_connection((host, int(port)), timeout=60)

    def open_sockets(self):
        """How many sockets the daemon has; files of the database come and go."""
        folder, count = f'/proc/{self.daemon.process.pid}/fd', 0
        for name in os.listdir(folder):
            with contextlib.suppress(FileNotFoundError):
                count += os.readlink(os.path.join(folder, name)).startswith('socket:')
        return count

    def check_alive(self):
        """A good client is answered, and the files of the others are closed."""
        with self.connect() as city:
            self.assertEqual(city.status().images, PHOTO_COUNT)
        deadline = time.monotonic() + 20
        while self.open_sockets() > self.files:
            self.assertLess(time.monotonic(), deadline, 'sockets stay open')
            time.sleep(0.05)

    def is_closed(self, data):
        """Whether the daemon closes a connection on which this was sent."""
        with contextlib.closing(self.socket()) as client:
            try:
                client.sendall(data)
                while client.recv(1 << 16):
                    pass
                return True
            except TimeoutError:
                return False
            except OSError:
                return True

    def test_what_is_no_message(self):
        framed = veduta_rpc.frame
        huge = struct.pack('<II', 0, 0x7fffffff)
        for data in (b'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n', b'\xff' * 64,
                     struct.pack('<I', 0xffffffff) + bytes(64), struct.pack('<II', 511, 1),
                     struct.pack('<II', 64, 1) + bytes(600), huge,
                     struct.pack('<IIII', 1, 0x10000, 0x10000, 0),
                     struct.pack('<II', 0, 1) + struct.pack('<Q', 0xffffffffffffffff),
                     struct.pack('<II', 0, 1) + struct.pack('<Q', 0xfffffffc),
                     framed({'finish': {'questionId': 77}}),
                     framed({'release': {'id': 5, 'referenceCount': 1}}),
                     framed({'return': {'answerId': 9, 'canceled': 0}}),
                     framed(BOOTSTRAP) + framed(BOOTSTRAP)):
            self.assertTrue(self.is_closed(bytes(data)), data[:40])
        self.check_alive()

    def test_messages_that_are_mutated(self):
        good = bytes(veduta_rpc.frame(BOOTSTRAP) + veduta_rpc.frame(login()))
        draw = random.Random(15)
        for _ in range(400):
            data = bytearray(good)
            for _ in range(draw.randint(1, 8)):
                data[draw.randrange(len(data))] = draw.choice((0, 1, 2, 3, 127, 255,
                                                               draw.randrange(256)))
            cut = draw.randint(1, len(data))
            with contextlib.closing(self.socket()) as client:
                with contextlib.suppress(OSError):
                    client.sendall(data[:cut])
                    client.setblocking(False)
                    client.recv(1 << 16)
        for _ in range(100):
            with contextlib.closing(self.socket()) as client:
                with contextlib.suppress(OSError):
                    client.sendall(draw.randbytes(draw.randint(1, 5000)))
        self.check_alive()

    def test_calls_of_what_is_not_there(self):
        with self.connect() as city:
            connection, number = city.connection, city.city.number
            payload = {'content': ('City.pose()', {'photo': 'x'})}
            for interface, method in ((1, 0), (veduta_rpc.METHODS['City.pose'][0], 999)):
                answer = connection.ask(call(connection.next_number, interface, method,
                                             {'importedCap': number}, payload), 'City.pose=')
                with self.assertRaises(veduta_rpc.Failure):
                    answer.wait()
            self.assertEqual(city.status().images, PHOTO_COUNT)
            # Another message than the method takes is read as far as it fits.
            interface, method = veduta_rpc.METHODS['City.pose']
            answer = connection.ask(call(connection.next_number, interface, method,
                                         {'importedCap': number},
                                         {'content': ('City.journal()', {'from': 3})}),
                                    'City.pose=')
            with self.assertRaises(veduta_rpc.Failure):
                answer.wait()
            # A capability that is none ends the connection, or fails.
            answer = connection.ask(call(connection.next_number, interface, method,
                                         {'importedCap': 12345}, payload), 'City.pose=')
            with self.assertRaises(veduta_rpc.Failure):
                answer.wait()
        self.check_alive()

    def test_a_text_that_nests_without_end(self):
        """Pointers that lead to themselves, and lists of lists, in the parameters of a call."""
        with self.connect() as city:
            for word in (0x00000000fffffffc, 0x00000001fffffffc, 0xffffffff00000001,
                         0x00000007fffffffd, 0x0000000600000001):
                message = call(city.connection.next_number, *veduta_rpc.METHODS['City.pose'],
                               {'importedCap': city.city.number},
                               {'content': ('City.pose()', {'photo': 'x' * 64})})
                data = bytearray(veduta_rpc.frame(message))
                at = data.index(b'x' * 64)
                struct.pack_into('<Q', data, at - 8, word)  # the pointer of the text
                answer = veduta_rpc.Answer(city.connection, city.connection.next_number,
                                           'City.pose=')
                city.connection.questions[answer.number] = answer
                city.connection.next_number += 1
                city.connection.write(data)
                with self.assertRaises(veduta_rpc.Failure):
                    answer.wait()
                if city.connection.lost:
                    city.open()
        self.check_alive()

    def test_who_says_nothing_is_disconnected(self):
        half = bytes(veduta_rpc.frame(BOOTSTRAP))
        begun = [b'', half[:3], half[:11], half]
        clients = [self.socket() for _ in begun]
        start = time.monotonic()
        for client, data in zip(clients, begun):
            client.sendall(data)
        for client, data in zip(clients, begun):
            client.settimeout(LOGIN_S + 15)
            with contextlib.suppress(ConnectionResetError):
                while client.recv(1 << 16):
                    pass
            client.close()
        self.assertGreater(time.monotonic() - start, LOGIN_S - 2)
        self.check_alive()

    def test_clients_that_vanish(self):
        db = new_database('vanish')
        self.daemon.stop()
        # Processes that decode have sockets of their own, which stay.
        self.daemon = Daemon(db, '--listen', '127.0.0.1:0', '--decoders', 'in-process')
        self.addCleanup(self.daemon.__exit__, None, None, None)
        self.address = self.daemon.started['rpc']
        files = self.open_sockets()
        for n in range(40):
            city = self.connect()
            number = n % PHOTO_COUNT + 1
            if n % 4 == 0:  # in the middle of a photo
                upload = city.call('addPhoto', name='half.jpg', camera='c', contributor='')
                upload.capability('upload').call('PhotoSink.write', chunk=photo(number)[:5000])
            elif n % 4 == 1:  # while its answer is computed
                city.examine(photo(number)).sink.call('Examination.localize', camera='c')
            elif n % 4 == 2:  # while it is told what happens
                city.city.call('City.follow', exports=[0], **{'from': 1, 'watcher': 0})
            else:  # before the verdict
                city.add(f'photo{n}.jpg', photo(number), 'c')
            city.close()
        with self.connect() as city:
            whole = city.add('whole.jpg', photo(PHOTO_COUNT), 'c').verdict().outcome
            self.assertIn(whole.verdict, ('placed', 'founded', 'postponed', 'duplicate'))
            while city.status().uploads:
                time.sleep(0.05)
            with self.assertRaises(veduta_rpc.Failure):
                city.pose('half.jpg')
        deadline = time.monotonic() + 30
        while self.open_sockets() > files:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        self.assertEqual(self.daemon.stop()[0], 0)
        must('settle', db)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_too_much_of_everything(self):
        with self.connect() as city:
            upload = city.call('addPhoto', name='a', camera='c', contributor='').wait().upload
            failure = None
            try:
                upload.call('PhotoSink.write', chunk=bytes((512 << 10) + 1)).wait()
            except veduta_rpc.Failure as raised:
                failure = raised
            self.assertEqual(failure.code, 413)
            # A photo that has had a wrong chunk has failed.
            with self.assertRaises(veduta_rpc.Failure) as raised:
                upload.call('Upload.done').wait()
            self.assertEqual(raised.exception.code, 413)
            large = city.add('large.jpg', bytes((128 << 20) + 1), 'c')
            with self.assertRaises(veduta_rpc.Failure) as raised:
                large.number()
            self.assertEqual(raised.exception.code, 413)
            self.assertIn('134217728 bytes', str(raised.exception))
            held = []
            with self.assertRaises(veduta_rpc.Failure) as raised:
                for _ in range(1100):
                    held.append(city.call('examine', name='x').wait())
            self.assertEqual(raised.exception.code, 429)
            self.assertGreater(len(held), 1000)
            held.clear()  # and they are released
            many = [city.city.call('City.status') for _ in range(190)]
            codes = set()
            for one in many:
                try:
                    one.wait()
                except veduta_rpc.Failure as refused:
                    codes.add(refused.code)
                    self.assertEqual(refused.retry_s, 5)
            self.assertLessEqual(codes, {429})
            self.assertEqual(city.status().images, PHOTO_COUNT)
            self.assertTrue(city.call('examine', name='x').wait())
        message = veduta_rpc.frame(login(1))
        long = veduta_rpc.frame(call(1, 1, 1, {'importedCap': 0}, {
            'content': ('PhotoSink.write()', {'chunk': bytes(1 << 20)})}))
        self.assertTrue(self.is_closed(bytes(veduta_rpc.frame(BOOTSTRAP) + message + long)))
        # Whoever finishes with no question is cut off before the answers fill the memory.
        questions = b''.join(bytes(veduta_rpc.frame({'bootstrap': {'questionId': i}}))
                             for i in range(5000))
        self.assertTrue(self.is_closed(questions))
        self.check_alive()

    def test_a_watcher_that_does_not_return_is_told_nothing_more(self):
        with self.connect() as city:
            told = []
            city.connection.exports[0] = lambda question, page: told.append((question, page))
            city.city.call('City.follow', exports=[0], **{'from': 1, 'watcher': 0})
            city.connection.pump(lambda: told)
            time.sleep(1)
            self.assertEqual(city.status().images, PHOTO_COUNT)
            self.assertEqual(len(told), 1)
            self.assertEqual(told[0][1].next, told[0][1].entries[-1].number + 1)

    def test_who_follows_is_one_request_until_the_token_is_revoked(self):
        db = new_database('followed')
        rules, token = (must('token', 'create', db, name, '--role', role, *more).strip()
                        for name, role, more in (('ada', 'admin', ()), (
                            'vera', 'viewer', ('--requests-per-second', '1'))))
        with Daemon(db, '--listen', '127.0.0.1:0') as daemon:
            with veduta_rpc.connect(daemon.started['rpc'], token) as city:
                # Ten requests may come at once, and it looks for news three times a second.
                self.assertEqual(list(city.follow(1_000_000, 6)), [])
                _, _, metrics = daemon.ask('GET', '/metrics',
                                           headers={'Authorization': 'Bearer ' + rules})
                self.assertIn(b'{request="GET /v1/events",code="200"} 1\n', metrics)
                following = city.city.call('City.follow', exports=[0],
                                           **{'from': 1_000_000, 'watcher': 0})
                city.status()
                must('token', 'revoke', db, '2')
                with self.assertRaises(veduta_rpc.Failure) as raised:
                    following.wait()
                self.assertEqual(raised.exception.code, 401)

    def test_one_token_leaves_half_of_the_connections_to_others(self):
        db = new_database('halves')
        tokens = [must('token', 'create', db, name, '--role', 'viewer').strip()
                  for name in ('vera', 'ben')]
        with (Daemon(db, '--listen', '127.0.0.1:0') as daemon, contextlib.ExitStack() as held):
            address = daemon.started['rpc']
            hers = [held.enter_context(veduta_rpc.connect(address, tokens[0]))
                    for _ in range(128)]
            with self.assertRaises(veduta_rpc.Failure) as raised:
                veduta_rpc.connect(address, tokens[0])
            self.assertEqual(raised.exception.code, 429)
            self.assertIn('half of the connections', str(raised.exception))
            with veduta_rpc.connect(address, tokens[1]) as city:
                self.assertEqual(city.status().images, 0)
            self.assertEqual(hers[-1].status().images, 0)
            hers[0].close()
            for attempt in itertools.count():  # its end may be seen a little later
                try:
                    veduta_rpc.connect(address, tokens[0]).close()
                    break
                except veduta_rpc.Failure:
                    self.assertLess(attempt, 100)
                    time.sleep(0.05)

    def test_a_long_message_waits_for_the_login_before_it(self):
        """Calls that are sent ahead of the login's answer may be long, and those of a stranger are
        not read."""
        long = call(2, *veduta_rpc.METHODS['City.pose'], {'promisedAnswer': {
            'questionId': 1, 'transform': [{'getPointerField': 0}]}},
            {'content': ('City.pose()', {'photo': 'x' * 100_000})})
        frames = [veduta_rpc.frame(message) for message in (BOOTSTRAP, login(), long)]
        with contextlib.closing(self.socket()) as client:
            client.sendall(b''.join(bytes(frame) for frame in frames))
            told = b''
            while b'longer than' not in told:  # the answer to the long one
                told += client.recv(1 << 16)
        start = time.monotonic()
        self.assertTrue(self.is_closed(bytes(frames[0]) + bytes(frames[2])))
        self.assertGreater(time.monotonic() - start, LOGIN_S - 2)

    def test_who_does_not_read_holds_up_nobody(self):
        """Asks for points again and again and reads none of them: others are answered, and the
        daemon takes no more of its calls."""
        with contextlib.closing(self.socket()) as client, self.connect() as city:
            client.sendall(veduta_rpc.frame(BOOTSTRAP) + veduta_rpc.frame(login()))
            client.setblocking(False)
            interface, method = veduta_rpc.METHODS['City.journal']
            ask = {'promisedAnswer': {'questionId': 1, 'transform': [{'getPointerField': 0}]}}
            sent, number = 0, 2
            for number in range(2, 100_000):
                message = veduta_rpc.frame(call(number, interface, method, ask, {
                    'content': ('City.journal()', {'from': 1})}))
                if number > 300:  # of a call that was answered long ago
                    message += veduta_rpc.frame({'finish': {'questionId': number - 200}})
                try:
                    sent += client.send(message)
                except BlockingIOError:
                    break
                if number % 50 == 0:
                    self.assertEqual(city.status().images, PHOTO_COUNT)
            self.assertFalse(select.select([], [client], [], 0.5)[1], f'{sent} bytes were taken')
            start = time.monotonic()
            self.assertEqual(city.status().images, PHOTO_COUNT)
            self.assertLess(time.monotonic() - start, 5)
        self.check_alive()


if __name__ == '__main__':
    main()
