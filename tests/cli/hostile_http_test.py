#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: heads that are no HTTP, or say two things, are refused as problems that tell nothing of what
#   is within the daemon; no number that a client makes up tells it what it did not ask for.
# Method: bytes over a socket, as no client sends them, to a real daemon.
# usage: tests/cli/hostile_http_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json
import select
import socket
import time

from city import Case, main, must, new_database
from daemon import Daemon


class Hostile(Case):
    def setUp(self):
        self.daemon = Daemon(new_database(self.id()))
        self.addCleanup(self.daemon.__exit__, None, None, None)

    def connect(self):
        host, port = self.daemon.host.split(':')
        return contextlib.closing(socket.create_connection((host, int(port)), timeout=60))

    def test_a_head_that_cannot_be_read_is_told_so_without_what_is_within(self):
        head = b'POST /v1/photos?name=x.jpg HTTP/1.1\r\nHost: localhost\r\n'
        for wanted, data in ((400, head + b'Content-Length: 9\r\nContent-Length: 3\r\n\r\nabc'),
                             (400, head + b'Content-Length: five\r\n\r\nabc'),
                             (400, b'GET / HTTP/1.1\r\nno colon\r\n\r\n'),
                             (501, b'BREW / HTTP/1.1\r\nHost: localhost\r\n\r\n')):
            with self.connect() as client:
                client.sendall(data)
                answer = b''
                while more := client.recv(10_000):
                    answer += more
            top, _, body = answer.partition(b'\r\n\r\n')
            self.assertTrue(top.startswith(b'HTTP/1.1 %d ' % wanted), (data, answer))
            self.assertIn(b'\r\nContent-Type: application/problem+json\r\n', top + b'\r\n')
            self.assertEqual(json.loads(body)['status'], wanted)
            for inner in (b'kj', b'c++', b'stack', b'rror:'):
                self.assertNotIn(inner, body)

    def test_one_address_leaves_half_of_the_connections_to_others(self):
        host, port = self.daemon.host.split(':')
        with contextlib.ExitStack() as held:
            # Another address of this machine, which stands for a stranger's.
            strangers = [held.enter_context(contextlib.closing(socket.create_connection(
                (host, int(port)), timeout=60, source_address=('127.0.0.2', 0))))
                for _ in range(300)]
            ask = b'GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n'
            answered = 0
            for one in strangers:
                with contextlib.suppress(OSError):
                    one.sendall(ask)
                    answered += one.recv(100).startswith(b'HTTP/1.1 200 ')
            self.assertEqual(answered, 256)
            with self.connect() as other:
                other.sendall(ask)
                self.assertTrue(other.recv(100).startswith(b'HTTP/1.1 200 '))

    def answers(self, data):
        """Codes of what is answered to these bytes, and whether the connection was closed then."""
        told, is_closed = b'', True
        with self.connect() as client:
            client.sendall(data)
            client.settimeout(1)
            try:
                while more := client.recv(10_000):
                    told += more
            except ConnectionResetError:
                pass
            except TimeoutError:
                is_closed = False
        return [int(part[:3]) for part in told.split(b'HTTP/1.1 ')[1:]], is_closed

    def test_no_body_is_taken_for_another_request(self):
        """What proxies may see other ends of. The second request is one that the daemon would
        answer by 404."""
        second = b'GET /v1/none HTTP/1.1\r\nHost: localhost\r\n\r\n'
        size = str(len(second)).encode()
        length, chunked = b'Content-Length: ' + size, b'Transfer-Encoding: chunked'
        end = b'0\r\n\r\n'
        head = b'POST /v1/hidden HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n'

        def told(headers, body, top=head):
            return self.answers(top + headers + b'\r\n\r\n' + body)
        for headers, body in (
                (length + b'\r\n' + chunked, end + second),
                (chunked + b'\r\n' + length, end + second),
                (length + b'\r\nTransfer-Encoding : chunked', end + second),
                (chunked + b'\r\n' + chunked, end + second),
                (b'Transfer-Encoding: identity\r\n' + chunked, end + second),
                (b'Transfer-Encoding: chunked, identity', end + second),
                (b'Transfer-Encoding:\r\n chunked', end + second),
                (b'Transfer-Encoding: xchunked', end + second),
                (b'Content-Length:\r\n ' + size, second),
                (b'Content-Length: +' + size, second), (b'Content-Length: -5', second),
                (b'Content-Length: 5, 5', second), (length + b'\r\n' + length, second),
                (b'Content-Length: 0x5', second),
                (b'Content-Length: 18446744073709551617', second)):
            self.assertEqual(told(headers, body), ([400], True), headers)
        self.assertEqual(told(length + b'\r\n' + chunked, end + second,
                              b'GET /v1/status HTTP/1.1\r\nHost: localhost\r\n'), ([400], True))
        # Lines that end by a line feed alone, and a space before the colon: kj takes the length.
        for data in ((head + length + b'\r\n\r\n').replace(b'\r\n', b'\n') + second,
                     head + b'X: y\n' + length + b'\r\n\r\n' + second,
                     head + b'X: y\r' + length + b'\r\n\r\n' + second,
                     head + b'Content-Length : ' + size + b'\r\n\r\n' + second):
            self.assertEqual(self.answers(data), ([403], False), data)
        # Chunks, also such as others may read in another way: nothing is taken after them.
        for end in (end, b'0;a=b\r\n\r\n', b'0x0\r\n\r\n', b'10000000000000000\r\n\r\n'):
            self.assertEqual(told(chunked, end + second), ([403], True), end)
        self.assertEqual(self.daemon.ask('GET', '/healthz')[0], 200)

    def events(self, last):
        """What is told within two seconds to who has the entry `last`."""
        told = b''
        with self.connect() as client:
            client.sendall(b'GET /v1/events HTTP/1.1\r\nHost: localhost\r\n'
                           b'Last-Event-ID: %d\r\n\r\n' % last)
            end = time.monotonic() + 2
            client.settimeout(2)
            with contextlib.suppress(TimeoutError):
                while time.monotonic() < end and (more := client.recv(10_000)):
                    told += more
        self.assertIn(b': veduta', told)
        return told

    def test_who_has_the_last_number_of_all_is_told_no_journal(self):
        self.assertIn(b'data:', self.events(0))
        for last in (2**63, 2**64 - 2, 2**64 - 1):
            self.assertNotIn(b'data:', self.events(last), last)

    def test_one_token_leaves_half_of_what_is_held_to_others(self):
        """From this machine, as all come by a proxy there: event streams, and bodies that do not
        end."""
        db = new_database('held')
        tokens = [must('token', 'create', db, name, '--role', 'viewer').strip().encode()
                  for name in ('vera', 'ben')]
        self.daemon.__exit__()
        self.daemon = Daemon(db)
        self.addCleanup(self.daemon.__exit__, None, None, None)
        held = contextlib.ExitStack()
        self.addCleanup(held.close)

        def ask(count, what, token, rest=b''):
            """So many connections on which that is asked."""
            asking = [held.enter_context(self.connect()) for _ in range(count)]
            for one in asking:
                one.sendall(what + b' HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer '
                            + token + b'\r\n' + rest + b'\r\n')
            return asking

        def code(one):
            return int(one.recv(10_000)[9:12])
        events, body = b'GET /v1/events', b'POST /v1/localize'
        slow = b'Content-Type: image/jpeg\r\nContent-Length: 1000\r\n'
        streams = ask(150, events, tokens[0])
        codes = [code(one) for one in streams]
        self.assertEqual((codes.count(200), codes.count(429)), (128, 22))
        bodies, refused = ask(150, body, tokens[0], slow), []
        while len(refused) < 22:
            refused += select.select([one for one in bodies if one not in refused], [], [], 60)[0]
        self.assertEqual(len(refused), 22, '256 in sum')
        for one in refused:
            told = b''
            while more := one.recv(10_000):  # to the end: it is closed
                told += more
            self.assertTrue(told.startswith(b'HTTP/1.1 429 '), told)
            self.assertIn(b'\r\nRetry-After: 5\r\n', told)
            self.assertIn(b'half of the connections', told)
        self.assertEqual(self.daemon.ask('GET', '/healthz')[0], 200)
        self.assertEqual(code(ask(1, events, tokens[1])[0]), 200)
        other = ask(1, body, tokens[1], slow)
        self.assertEqual(select.select(other, [], [], 0.5)[0], [], 'the rest is waited for')
        # What has ended makes room.
        next(one for one in bodies if one not in refused).close()
        while select.select(ask(1, body, tokens[0], slow), [], [], 0.5)[0]:
            pass  # its end may be seen a little later


if __name__ == '__main__':
    main()
