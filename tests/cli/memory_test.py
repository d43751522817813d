#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: `veduta serve --memory` bounds what it says: too little is refused with the least that
#   works, with the least photos are placed, and bodies that arrive have an eighth of it, of which
#   one token has half.
# Method: a real daemon; bodies that come in part and stay so.
# usage: tests/cli/memory_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json

from city import Case, main, must, new_database, photo, render, SIZE
from daemon import Daemon

MIB = 1 << 20


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


class Memory(Case):
    def test_too_little_is_refused(self):
        db = new_database('little')
        for size in ('1', '1023MiB', '1073741823'):
            self.refused(2, '1 GiB (1073741824)', 'serve', db, '--memory', size)
        for wrong in ('0', '-1', 'much'):
            self.refused(2, 'memory', 'serve', db, '--memory', wrong)

    def answer_beside(self, db, held, *options):
        """The code for a photo while a body of so many bytes is arriving."""
        with Daemon(db, *options) as daemon, contextlib.closing(daemon.connect()) as connection:
            connection.putrequest('POST', '/v1/localize')
            connection.putheader('Content-Type', 'image/jpeg')
            connection.putheader('Content-Length', str(held + 1))
            connection.endheaders()
            connection.send(bytes(held))
            code, _, answer = daemon.send('a.jpg', bytes(16 * MIB))
            return code, json.dumps(answer)

    def test_bodies_have_their_share(self):
        db = new_database('bodies')
        code, answer = self.answer_beside(db, 120 * MIB, '--memory', '1GiB')
        self.assertEqual(code, 429, answer)
        self.assertIn('arriving', answer)
        for options in (('--memory', '2GiB'), ()):
            self.assertEqual(self.answer_beside(db, 120 * MIB, *options)[0], 422, 'it is no photo')

    def test_one_who_sends_leaves_half_of_it_to_others(self):
        db = new_database('halves')
        tokens = [must('token', 'create', db, name, '--role', 'contributor').strip()
                  for name in ('anna', 'ben')]
        with Daemon(db, '--memory', '1GiB') as daemon, contextlib.ExitStack() as held:
            def send(token, size):
                """A body of which a byte is missing; the answer, where one comes all the same."""
                connection = held.enter_context(contextlib.closing(daemon.connect()))
                connection.putrequest('POST', '/v1/localize')
                connection.putheader('Content-Type', 'image/jpeg')
                connection.putheader('Authorization', f'Bearer {token}')
                connection.putheader('Content-Length', str(size + 1))
                connection.endheaders()
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                    connection.send(bytes(size))
                connection.sock.settimeout(2)
                try:
                    return connection.getresponse().status
                except TimeoutError:
                    return None
            self.assertIsNone(send(tokens[0], 40 * MIB))
            self.assertEqual(send(tokens[0], 40 * MIB), 429)
            self.assertIsNone(send(tokens[0], 10 * MIB), 'half of 128 MiB')
            self.assertIsNone(send(tokens[1], 60 * MIB))

    def test_the_least_places_photos(self):
        with Daemon(new_database('least'), '--memory', '1GiB') as daemon:
            for number in range(1, 7):
                self.assertEqual(daemon.send(f'{number}.jpg', photo(number))[0], 201)
            self.assertGreater(daemon.get('/v1/status')['placed'], 2)


if __name__ == '__main__':
    main()
