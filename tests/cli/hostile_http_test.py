#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: heads that are no HTTP, or say two things, are refused as problems that tell nothing of what
#   is within the daemon; no number that a client makes up tells it what it did not ask for.
# Method: bytes over a socket, as no client sends them, to a real daemon.
# usage: tests/cli/hostile_http_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json
import socket
import time

from city import Case, main, new_database
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


if __name__ == '__main__':
    main()
