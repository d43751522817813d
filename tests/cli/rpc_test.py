#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the daemon answers by RPC what it answers over HTTP, takes photos in the order in which they
#   were sent, tells who follows it every change once, across lost connections and killed daemons,
#   and lets nobody do what the role does not allow.
# Method: real daemons on photos of a rendered street, and of a real place where the data is there;
#   the client in Python that is handed out; the table of roles is written down here once more.
# usage: tests/cli/rpc_test.py VEDUTA VEDUTA_STREET [TEST...]
import glob
import json
import os
import re
import signal
import struct
import subprocess
import sys
import threading
import time
import unittest

from city import (PHOTO_COUNT, WHOLE, Case, at, main, make_whole, must, new_database, photo, read,
                  write)
from daemon import JPEG, Daemon, part
import rpc_layout

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'cli', 'rpc'))
import veduta_rpc  # noqa: E402 (the line above finds it)

DATA = os.environ.get('VEDUTA_TEST_DATA', '')
NUMBERS = range(1, PHOTO_COUNT + 1)


def setUpModule():
    make_whole()


def name_of(number):
    return f'photo{number:04}.jpg'


def vector(told):
    return [told.x, told.y, told.z]


class Rpc(Case):
    def serve(self, db, *more, listen='127.0.0.1:0', http='127.0.0.1:0'):
        daemon = Daemon(db, '--listen', listen, *more, http=http)
        self.addCleanup(daemon.__exit__, None, None, None)
        return daemon

    def connect(self, daemon, token=''):
        city = veduta_rpc.connect(daemon.started['rpc'], token)
        self.addCleanup(city.close)
        return city

    def fails(self, code, words, ask, *arguments, **named):
        with self.assertRaises(veduta_rpc.Failure) as raised:
            ask(*arguments, **named)
        self.assertEqual(raised.exception.code, code, raised.exception)
        self.assertIn(words, str(raised.exception))
        return raised.exception


class Layout(Case):
    def test_the_client_knows_where_fields_are(self):
        schema = os.path.join(ROOT, 'cli', 'rpc', 'veduta.capnp')
        self.assertEqual(veduta_rpc.LAYOUT.replace('\n    ', ' ').strip().split('\n'),
                         rpc_layout.layouts(schema))
        text = read(schema).decode()
        told, = re.findall(r'enum Verdict {(.*?)}', text, re.DOTALL)
        self.assertEqual(re.findall(r'(\w+) @', told), list(veduta_rpc.VERDICTS))

    def test_messages_of_many_segments(self):
        """Pointers to other segments, of both kinds, by a message that is made by hand: a Return
        whose results are told in segment 1, and whose capabilities by two words in segment 2."""
        def pointer(low, high):
            return struct.pack('<II', low & 0xffffffff, high)

        segments = [
            pointer(0, 1 | 1 << 16) + struct.pack('<HHI', 3, 0, 0)  # Message: a return
            + pointer(0, 2 | 1 << 16) + struct.pack('<IHHQ', 7, 0, 0, 0)  # its answer is 7
            + pointer(2, 1),                                     # far: Payload at word 0 of 1
            pointer(0, 0 | 2 << 16)                              # the landing pad
            + pointer(0, 0)                                      # no content
            + pointer(2 | 4, 2),                                 # far, by two words at 0 of 2
            pointer(2 | 2 << 3, 2) + pointer(1, 7 | 2 << 3)      # where it is, and what
            + pointer(1 << 2, 1 | 1 << 16) + struct.pack('<HHI', 1, 0, 42) + bytes(8)]
        data = struct.pack('<I3I', 2, *(len(s) // 8 for s in segments)) + b''.join(segments)
        root = veduta_rpc.unframe(bytearray(data)).struct_at('Message', 0, 0)
        told = getattr(root, 'return')
        self.assertEqual((root.which, told.answerId, told.which), ('return', 7, 'results'))
        self.assertEqual([c.senderHosted for c in told.results.capTable], [42])
        self.assertIsNone(veduta_rpc.unframe(bytearray(data[:-1])))


class Asking(Rpc):
    def setUp(self):
        self.daemon = self.serve(WHOLE)
        self.city = self.connect(self.daemon)

    def test_answers_are_those_of_http(self):
        get, city = self.daemon.get, self.city
        status = city.status()
        told = get('/v1/status')
        for key in ('images', 'placed', 'postponed', 'rejected', 'unsure', 'cameras', 'uploads',
                    'backlog'):
            self.assertEqual(getattr(status, key), told[key], key)
        placed = 0
        for image in get('/v1/photos'):
            name = '#' + str(image['id'])
            code, _, body = self.daemon.ask('GET', f'/v1/photos/{part(name)}/pose')
            pose = json.loads(body)
            if code == 404:
                self.fails(404, pose['detail'], city.pose, name)
                continue
            placed += 1
            mine = city.pose(name)
            self.assertEqual([getattr(mine.pose.rotation, axis) for axis in 'wxyz'],
                             pose['rotation_wxyz'])
            self.assertEqual(vector(mine.pose.translation), pose['translation'])
            self.assertEqual(vector(mine.pose.center), pose['center'])
            self.assertEqual(mine.pose.reconstruction, pose['reconstruction'])
            self.assertIsNone(mine.onEarth)
            self.assertEqual(mine.snapshot, status.snapshot)
            neighbors = city.neighbors(name)
            self.assertEqual(
                [(n.id, n.name, n.verdict, n.matches) for n in neighbors.neighbors],
                [(n['id'], n['image'], n['verdict'], n['matches'])
                 for n in get(f'/v1/photos/{part(name)}/neighbors')])
            self.assertEqual(neighbors.snapshot, status.snapshot)
        self.assertEqual(placed, status.placed)

    def test_points_come_in_chunks(self):
        told = self.city.reconstructions().reconstructions
        self.assertEqual([(r.id, r.images, r.points) for r in told],
                         [(r['id'], r['images'], r['points'])
                          for r in self.daemon.get('/v1/reconstructions')])
        for reconstruction in told:
            path = f'/v1/reconstructions/{reconstruction.id}/points'
            whole = self.daemon.ask('GET', path)[2]
            for count in (0, 7, 100_000):
                chunks = list(self.city.points(reconstruction.id, count))
                self.assertEqual(b''.join(chunks), whole)
                self.assertLessEqual(max(map(len, chunks)), 16 * min(count or 4096, 4096))
        self.fails(404, '77', list, self.city.points(77))
        self.fails(404, '0', list, self.city.points(0))

    def test_a_link_for_a_part_shows_no_other_reconstruction(self):
        db = new_database('parts')
        must('add', db, '--camera', 'c', *(at('street', 'photos', name_of(n)) for n in NUMBERS))
        admin = must('token', 'create', db, 'ada', '--role', 'admin').strip()
        daemon = self.serve(db)
        code, _, body = daemon.ask('POST', '/v1/contributions', '{}', {
            'Content-Type': 'application/json', 'Authorization': 'Bearer ' + admin})
        self.assertEqual(code, 201, body)
        number = str(json.loads(body)['contribution'])
        link = must('token', 'link', db, 'x', '--contribution', number).strip().split('=')[1]
        whole, part_alone = self.connect(daemon, admin), self.connect(daemon, link)
        first = whole.reconstructions().reconstructions[0]
        self.assertTrue(list(whole.points(first.id)))
        self.assertEqual(part_alone.reconstructions().reconstructions, [])
        self.fails(404, 'no reconstruction', list, part_alone.points(first.id))

    def test_a_photo_is_asked_about_and_not_stored(self):
        digest = must('digest', WHOLE)
        code, _, body = self.daemon.ask('POST', '/v1/localize?camera=c', photo(5), JPEG)
        http = json.loads(body)
        examined = self.city.examine(photo(5))
        localized = examined.localize('c').localized
        self.assertEqual((code, localized.verdict, http['verdict']), (200, 'placed', 'localized'))
        self.assertEqual(vector(localized.pose.center), http['pose']['center'])
        self.assertEqual((localized.stored, localized.reason), (http['stored'], http['reason']))
        ranked = examined.candidates('c', 3).candidates
        self.assertEqual((len(ranked), ranked[0].name), (3, name_of(5)))
        near = self.city.examine(photo(5)).localize('c', near=name_of(4)).localized
        self.assertEqual(near.verdict, 'placed')
        self.fails(404, 'absent.jpg', self.city.examine(photo(5)).localize, 'c', 'absent.jpg')
        self.fails(400, 'LATITUDE', self.city.examine(photo(5)).localize, 'c', '', '47')
        nothing = self.city.examine(b'no photo').localize('c').localized
        self.assertEqual((nothing.verdict, nothing.pose), ('rejected', None))
        self.fails(400, 'no bytes', self.city.examine(b'').localize)
        self.fails(404, 'none', self.city.examine(photo(5)).localize, 'none')
        self.assertEqual(must('digest', WHOLE), digest)

    def test_journal(self):
        entries = self.city.journal().entries
        self.assertEqual(
            [(e.number, e.time, e.actor, e.action, e.detail) for e in entries],
            [(e['sequence'], e['time'], e['actor'], e['action'], e['detail'])
             for e in self.daemon.get('/v1/journal')])
        self.assertEqual([e.number for e in self.city.journal(3, 2).entries], [3, 4])
        self.fails(400, '256', self.city.journal, 1, 257)

    def test_what_is_wrong_is_said(self):
        self.fails(404, "'none.jpg'", self.city.pose, 'none.jpg')
        self.fails(404, "'none.jpg'", self.city.neighbors, 'none.jpg')
        self.fails(400, 'longer than 4096', self.city.pose, 'x' * 5000)
        self.fails(400, 'no name', self.city.add('', photo(1)).number)
        self.fails(400, 'control', self.city.add('x.jpg', photo(1), contributor='an\nna').number)
        self.fails(404, 'upload 99', self.city.verdict, 99)
        self.fails(404, 'none', self.city.add('x.jpg', photo(1), camera='none').number)


class Adding(Rpc):
    def test_photos_are_sent_at_once_and_placed_in_order(self):
        daemon = self.serve(new_database('sent'), '--threads', '2')
        city = self.connect(daemon)
        photos = [city.add(name_of(n), photo(n), 'c', 'anna') for n in NUMBERS]
        self.assertEqual([sent.number() for sent in photos], list(NUMBERS))
        verdicts = [sent.verdict() for sent in photos]
        self.assertEqual([v.outcome.id for v in verdicts], list(NUMBERS))
        snapshots = [v.snapshot for v in verdicts]
        self.assertGreaterEqual(snapshots[-1], snapshots[0])
        self.assertIn('founded', {v.outcome.verdict for v in verdicts})
        again = city.verdict(photos[-1].number())
        self.assertEqual(again.outcome, verdicts[-1].outcome)
        same = city.add('again.jpg', photo(1), 'c').verdict().outcome
        self.assertEqual((same.verdict, same.id), ('duplicate', 1))
        self.assertIn(name_of(1), same.reason)
        refused = city.add('text.jpg', b'no photo', 'c').verdict().outcome
        self.assertEqual(refused.verdict, 'rejected')
        self.assertIn('JPEG', refused.reason)
        self.assertEqual(city.add('text.jpg', photo(2), 'c').verdict().outcome.verdict,
                         'duplicate')
        self.assertEqual(daemon.stop()[0], 0)
        must('settle', at('sent'))
        must('verify', at('sent'))
        lines = [json.loads(line) for line in must('journal', at('sent')).splitlines()]
        self.assertEqual({e['actor'] for e in lines if e['action'] == 'add'},
                         {'anna', 'anonymous'})

    def test_the_same_order_gives_the_same_city(self):
        daemon = self.serve(new_database('same'), '--threads', '2')
        city = self.connect(daemon)
        sent = [city.add(name_of(n), photo(n), 'c', 'anna') for n in NUMBERS]
        self.assertTrue(all(one.verdict().outcome.id for one in sent))
        self.assertEqual(daemon.stop()[0], 0)
        must('settle', at('same'))
        self.assertEqual(must('digest', at('same')), must('digest', WHOLE))

    def test_a_full_line_says_when_to_come_again(self):
        city = self.connect(self.serve(new_database('full'), '--waiting', '2'))
        sent = [city.add(name_of(n), photo(n), 'c') for n in NUMBERS[:8]]
        accepted = 0
        for one in sent:
            try:
                one.number()
                accepted += 1
            except veduta_rpc.Failure as failure:
                self.assertEqual(failure.code, 429, failure)
                self.assertGreaterEqual(failure.retry_s, 1)
        self.assertGreater(accepted, 0)
        self.assertLess(accepted, 8)

    def test_more_photos_than_a_connection_may_hold(self):
        daemon = self.serve(new_database('many'))
        drain = subprocess.Popen(['cat'], stdin=daemon.process.stdout, stdout=subprocess.DEVNULL)
        city = self.connect(daemon)
        sent = [city.add(f'{n}.txt', b'no photo %d' % n, 'c') for n in range(1100)]
        self.assertEqual(sent[-1].number(), 1100)
        self.assertEqual({one.verdict().outcome.verdict for one in sent}, {'rejected'})
        self.assertEqual(daemon.stop()[0], 0)
        drain.wait()

    def test_what_was_accepted_outlives_the_daemon(self):
        address = 'unix:' + at('kept.sock')
        daemon = self.serve(new_database('kept'), listen=address)
        city = self.connect(daemon)
        sent = [city.add(name_of(n), photo(n), 'c') for n in NUMBERS]
        numbers = [one.number() for one in sent]
        daemon.stop(signal.SIGKILL)
        with self.assertRaises(veduta_rpc.Disconnected):
            for one in sent:
                one.verdict()
        city = self.connect(self.serve(at('kept'), listen=address))
        deadline = time.monotonic() + 120
        while city.status().images < len(numbers):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        self.assertEqual(city.verdict(numbers[-1]).outcome.name, name_of(len(numbers)))

    def test_closing_answers_who_waits(self):
        daemon = self.serve(new_database('closing'))
        city, follower = self.connect(daemon), self.connect(daemon)
        sent = [city.add(name_of(n), photo(n), 'c') for n in NUMBERS]
        numbers = [one.number() for one in sent]
        following = follower.city.call('City.follow', exports=[0], **{'from': 999, 'watcher': 0})
        start = time.monotonic()
        code, err = daemon.stop()
        self.assertEqual(code, 0, err)
        self.assertLess(time.monotonic() - start, 10)
        left = []
        for number, one in zip(numbers, sent):
            try:
                self.assertNotEqual(one.verdict().outcome.id, 0)
            except veduta_rpc.Failure as failure:
                self.assertEqual(failure.code, 503, failure)
                self.assertIn(f'upload {number} ', str(failure))
                left.append(number)
        self.assertGreater(len(left), 0)
        with self.assertRaises(veduta_rpc.Failure):
            following.wait()
        # The next daemon goes on with them, but for those that the first applied while it ended:
        # these are stored.
        city = self.connect(self.serve(at('closing')))
        for number in left:
            try:
                self.assertNotEqual(city.verdict(number).outcome.id, 0)
            except veduta_rpc.Failure as failure:
                self.assertEqual(failure.code, 404, failure)
                city.neighbors(name_of(numbers.index(number) + 1))
        self.assertEqual(city.status().images, PHOTO_COUNT)

    @unittest.skipUnless(glob.glob(DATA + '/strecha/fountain-P11/*.jpg'),
                         'the real photos are not there: VEDUTA_TEST_DATA')
    def test_real_photos(self):
        db = at('fountain')
        must('init', db)
        must('camera', 'add', db, 'canon', '--size', '1536x1024', '--params',
             '1379.74,1382.08,760.095,503.155')
        daemon = self.serve(db, '--threads', '2')
        city = self.connect(daemon)
        paths = sorted(glob.glob(DATA + '/strecha/fountain-P11/*.jpg'))[:5]
        sent = [city.add(os.path.basename(path), read(path), 'canon') for path in paths]
        self.assertEqual(sent[-1].verdict().outcome.verdict, 'placed')
        self.assertEqual(city.status().placed, 5)
        pose = self.daemon_pose(daemon, '0004.jpg')
        self.assertEqual(vector(city.pose('0004.jpg').pose.center), pose['center'])
        # A photo that was not added, by its place between two that were.
        other = glob.glob(DATA + '/strecha/fountain-P11/0005.jpg')[0]
        localized = city.examine(read(other)).localize('canon').localized
        self.assertEqual((localized.verdict, localized.stored), ('placed', 0))
        self.assertGreater(localized.centerStddev, 0)
        self.assertGreater(localized.inliers, 100)

    def daemon_pose(self, daemon, name):
        return daemon.get(f'/v1/photos/{name}/pose')


class Following(Rpc):
    def test_no_change_is_missed_and_none_comes_twice(self):
        """A client follows while photos come in, connections are cut and daemons are killed."""
        db, address = new_database('followed'), 'unix:' + at('followed.sock')
        daemon = self.serve(db, listen=address)
        follower = veduta_rpc.connect(address)
        self.addCleanup(follower.close)
        heard = []

        def follow():
            for entry in follower.changes(1, retry_s=0.05, timeout_s=8):
                heard.append(entry)

        thread = threading.Thread(target=follow)
        thread.start()
        for round_number, n in enumerate(NUMBERS):
            city = self.connect(daemon)
            number = city.add(name_of(n), photo(n), 'c').number()
            if round_number % 3 == 0:
                follower.connection.socket.shutdown(2)
            if round_number % 4 == 3:
                daemon.stop(signal.SIGKILL)
                daemon = self.serve(db, listen=address)
            else:
                city.verdict(number)
        city = self.connect(daemon)
        while city.status().uploads:
            time.sleep(0.05)
        thread.join()
        self.assertEqual(daemon.stop()[0], 0)
        told = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertEqual([(e.number, e.action, e.detail) for e in heard],
                         [(e['sequence'], e['action'], e['detail'])
                          for e in told[:len(heard)]])
        # What follows from the last photo may have come after the follower left.
        adds = [e['sequence'] for e in told if e['action'] == 'add']
        self.assertGreaterEqual(len(heard), adds[-1])

    def test_it_begins_where_it_is_told_and_ends_when_dropped(self):
        city = self.connect(self.serve(WHOLE))
        count = len(city.journal().entries)
        for _ in range(20):  # more than may follow at the same time: each has ended
            self.assertEqual([e.number for e in city.changes(count - 1, timeout_s=0.1)],
                             [count - 1, count])
        many = [city.city.call('City.follow', exports=[i], **{'from': count + 1, 'watcher': 0})
                for i in range(9)]
        self.fails(429, 'watchers', many[8].wait, 10)


class Rights(Rpc):
    # Who may call, as the least role: 1 viewer, 2 contributor, 3 curator, 4 admin.
    ROLES = ('viewer', 'contributor', 'curator', 'admin')
    METHODS = {
        'status': (1, lambda city: city.status()),
        'pose': (1, lambda city: city.pose('none')),
        'neighbors': (1, lambda city: city.neighbors('none')),
        'reconstructions': (1, lambda city: city.reconstructions()),
        'points': (1, lambda city: list(city.points(1))),
        'journal': (1, lambda city: city.journal()),
        'follow': (1, lambda city: list(city.follow(1, 0.05))),
        'examine': (1, lambda city: city.call('examine', name='').wait()),
        'addPhoto': (2, lambda city: city.call('addPhoto', name='a', camera='',
                                               contributor='').wait()),
        'addPhoto of another': (3, lambda city: city.call('addPhoto', name='a', camera='',
                                                          contributor='other').wait()),
        'findUpload': (2, lambda city: city.verdict(77)),
    }

    def code(self, ask, city):
        try:
            ask(city)
            return 200
        except veduta_rpc.Failure as failure:
            return failure.code

    def test_every_role_against_every_method(self):
        told = {name[5:] for name in veduta_rpc.METHODS if name.startswith('City.')}
        self.assertEqual(told, {name.split(' ')[0] for name in self.METHODS})
        db = new_database('roles')
        before = self.connect(self.serve(db))  # of the time before there were tokens
        self.assertEqual({self.code(ask, before) for _, ask in self.METHODS.values()}, {200, 404})
        tokens = [must('token', 'create', db, role, '--role', role).strip() for role in self.ROLES]
        daemon = Daemon.__new__(Daemon)
        daemon.started = {'rpc': before.address}
        self.fails(401, 'log in with a token', self.connect, daemon)
        self.fails(401, 'revoked', self.connect, daemon, tokens[0][:-1])
        for name, (least, ask) in self.METHODS.items():
            self.assertEqual(self.code(ask, before), 401, name)
        for role, token in enumerate(tokens, 1):
            city = self.connect(daemon, token)
            for name, (least, ask) in self.METHODS.items():
                code = self.code(ask, city)
                if role < least:
                    self.assertEqual(code, 403, (role, name))
                else:
                    self.assertIn(code, (200, 404), (role, name))
        # Under the token's own name, and good no more from the next call on.
        city = self.connect(daemon, tokens[1])
        sent = city.add('a.jpg', photo(1), 'c')
        self.assertEqual(sent.verdict().outcome.id, 1)
        examined = city.examine(photo(2))
        must('token', 'revoke', db, '2', '--by', 'owner')
        for ask in (city.status, examined.localize, city.add('b.jpg', photo(2), 'c').number):
            self.fails(401, 'revoked', ask)
        self.assertIn('"contributor"', must('show', db, '#1', '--json'))

    def test_a_token_does_as_much_as_its_quota_says(self):
        db = new_database('quotas')
        few = must('token', 'create', db, 'anna', '--role', 'contributor', '--photos-per-day', '1')
        slow = must('token', 'create', db, 'vera', '--role', 'viewer',
                    '--requests-per-second', '1')
        daemon = self.serve(db)
        city = self.connect(daemon, few.strip())
        self.assertEqual(city.add('a.jpg', photo(1), 'c').verdict().outcome.id, 1)
        failure = self.fails(429, 'quota of photos', city.add('b.jpg', photo(2), 'c').number)
        self.assertGreater(failure.retry_s, 80_000)
        city = self.connect(daemon, slow.strip())
        codes = [self.code(lambda asked: asked.status(), city) for _ in range(20)]
        self.assertEqual(codes[:9], [200] * 9)  # and one to log in
        self.assertIn(429, codes[9:])

    def test_the_owner_needs_no_token(self):
        db = new_database('owned')
        must('token', 'create', db, 'vera', '--role', 'viewer')
        daemon = self.serve(db, listen='unix:' + os.path.join(db, 'rpc.sock'))
        self.assertEqual(os.stat(os.path.join(db, 'rpc.sock')).st_mode & 0o777, 0o600)
        city = self.connect(daemon)
        outcome = city.add('a.jpg', photo(1), 'c', 'somebody').verdict().outcome
        self.assertEqual(outcome.id, 1)
        self.assertEqual(daemon.stop()[0], 0)
        self.assertFalse(os.path.exists(os.path.join(db, 'rpc.sock')))

    def test_where_it_listens(self):
        for address in ('0.0.0.0:0', 'example.com:80', '127.0.0.1', ''):
            if address:
                self.refused(2, 'localhost', 'serve', WHOLE, '--listen', address)
        self.refused(1, 'cannot serve', 'serve', WHOLE, '--listen', '127.0.0.1:99999')
        write(at('file'), b'kept')
        self.refused(1, 'no socket', 'serve', WHOLE, '--listen', 'unix:' + at('file'))
        self.assertEqual(read(at('file')), b'kept')
        self.refused(1, 'cannot listen', 'serve', WHOLE, '--listen', 'unix:' + at('no', 'where'))
        daemon = self.serve(WHOLE, listen='unix:' + at('taken'))
        self.refused(1, 'another program', 'serve', new_database('second'), '--http',
                     '127.0.0.1:0', '--listen', 'unix:' + at('taken'))
        self.assertEqual(self.connect(daemon).status().images, PHOTO_COUNT)
        must('token', 'create', at('second'), 'vera', '--role', 'viewer')
        self.serve(at('second'), listen='0.0.0.0:0')


if __name__ == '__main__':
    main()
