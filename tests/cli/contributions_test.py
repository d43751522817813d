#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: photos that are sent together, at once or in parts, are told together: the verdicts of a
#   contribution are right as soon as a photo's answer is there, over restarts; it is closed and
#   removed by those who may.
# Method: real daemons on photos of a rendered street, asked as people do.
# usage: tests/cli/contributions_test.py VEDUTA VEDUTA_STREET [TEST...]
import json
import os
import sys
import urllib.parse

from city import Case, ask, main, must, new_database, photo, render, SIZE
from daemon import JPEG, Daemon
from tus_client import begin, must_begin, offset_of, send

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'cli', 'rpc'))
import veduta_rpc  # noqa: E402 (the line above finds it)

NONE = dict.fromkeys(('arriving', 'waiting', 'placed', 'postponed', 'refused', 'duplicates',
                      'failed', 'removed'), 0)


def setUpModule():
    render('street', '--photos', '12', '--size', SIZE)


class Contributions(Case):
    def ask(self, daemon, method, path, body=None, headers={}):
        """Code and JSON of the answer."""
        as_json = {} if body is None else {'Content-Type': 'application/json'}
        text = None if body is None else json.dumps(body)
        code, _, told = daemon.ask(method, path, text, {**as_json, **headers})
        return code, json.loads(told)

    def open(self, daemon, headers={}, **texts):
        code, told = self.ask(daemon, 'POST', '/v1/contributions', texts, headers)
        self.assertEqual(code, 201, told)
        return told['contribution']

    def sums(self, daemon, number):
        verdicts = daemon.get(f'/v1/contributions/{number}')['verdicts']
        return {key: verdicts[key] for key in NONE}, verdicts['reasons']

    def post(self, daemon, name, data, number, headers={}, **query):
        query = urllib.parse.urlencode({'name': name, 'camera': 'c', 'contribution': number,
                                        **query})
        return daemon.ask('POST', '/v1/photos?' + query, data, {**JPEG, **headers})[0]

    def test_verdicts_in_sum_right_after_each_photo(self):
        db = new_database('sums')
        with Daemon(db) as daemon:
            code, headers, body = daemon.ask(
                'POST', '/v1/contributions',
                json.dumps({'comment': 'a walk\nby the river', 'licence': 'CC BY 4.0',
                            'contributor': 'anna'}), {'Content-Type': 'application/json'})
            self.assertEqual((code, headers['Location']), (201, '/v1/contributions/1'))
            told = json.loads(body)
            self.assertEqual((told['contributor'], told['comment'], told['licence'], told['closed'],
                              told['photos']),
                             ('anna', 'a walk\nby the river', 'CC BY 4.0', None, 0))
            self.assertEqual(self.sums(daemon, 1), (NONE, []))
            self.assertEqual(self.post(daemon, '1.jpg', photo(1), 1), 201)
            sums, reasons = self.sums(daemon, 1)
            self.assertEqual(sums, {**NONE, 'postponed': 1})
            self.assertEqual([reason['photos'] for reason in reasons], [1])
            self.assertEqual(self.post(daemon, 'again.jpg', photo(1), 1), 409)
            self.assertEqual(self.sums(daemon, 1)[0], {**NONE, 'postponed': 1, 'duplicates': 1})
            self.assertEqual(self.post(daemon, 'none.jpg', b'no photo', 1), 422)
            data = photo(2)
            path = must_begin(daemon, len(data), filename='2.jpg', camera='c', contribution='1')
            self.assertEqual(self.sums(daemon, 1)[0], {**NONE, 'postponed': 1, 'duplicates': 1,
                                                       'refused': 1, 'arriving': 1})
            self.assertEqual(send(daemon, path, 0, data)[0], 204)
            daemon.wait_for_uploads()
            self.assertEqual(self.post(daemon, '3.jpg', photo(3), 1), 201)
        with Daemon(db) as daemon:
            sums, _ = self.sums(daemon, 1)
            self.assertEqual(sum(sums.values()), 5)
            self.assertEqual((sums['duplicates'], sums['refused'],
                              sums['placed'] + sums['postponed']), (1, 1, 3))
            photos = daemon.get('/v1/contributions/1/photos')
            self.assertEqual([one['image'] for one in photos],
                             ['1.jpg', '1.jpg', 'none.jpg', '2.jpg', '3.jpg'])
            self.assertEqual([photos[1]['state'], photos[2]['state']], ['duplicate', 'rejected'])
            self.assertEqual(daemon.get('/v1/contributions/1/photos?from=2&count=2'), photos[1:3])
            for one in photos:
                if one['id'] is not None and one['state'] != 'duplicate':
                    shown = daemon.get(f'/v1/photos/%23{one["id"]}')
                    self.assertEqual((shown['image'], shown['contributor'], shown['verdict']),
                                     (one['image'], 'anna', one['state']))
        self.assertEqual(must('verify', db), 'sound\n')

    def test_listing_closing_and_what_is_wrong(self):
        db = new_database('closing')
        with Daemon(db) as daemon:
            for who in ('anna', 'bela', 'anna'):
                self.open(daemon, contributor=who)
            listed = daemon.get('/v1/contributions')
            self.assertEqual([one['contribution'] for one in listed], [1, 2, 3])
            self.assertEqual(daemon.get('/v1/contributions?from=2&count=1'), listed[1:2])
            self.assertEqual(self.post(daemon, '1.jpg', photo(1), 2, contributor='anna'), 400)
            code, told = self.ask(daemon, 'POST', '/v1/contributions/1/close')
            self.assertEqual(code, 200)
            self.assertGreater(told['closed'], 0)
            self.assertEqual(self.ask(daemon, 'POST', '/v1/contributions/1/close'), (200, told))
            self.assertEqual(self.post(daemon, '1.jpg', photo(1), 1), 409)
            self.assertEqual(begin(daemon, 9, filename='1.jpg', contribution='1')[0], 409)
            for code, method, path, body in [
                    (404, 'GET', '/v1/contributions/9', None),
                    (400, 'GET', '/v1/contributions/x', None),
                    (400, 'GET', '/v1/contributions/0', None),
                    (400, 'GET', '/v1/contributions?from=0', None),
                    (400, 'GET', '/v1/contributions/1/photos?count=1001', None),
                    (404, 'GET', '/v1/contributions/9/photos', None),
                    (404, 'POST', '/v1/contributions/9/close', None),
                    (403, 'DELETE', '/v1/contributions/1', None),  # the owner's, without tokens
                    (415, 'POST', '/v1/contributions', None),
                    (400, 'POST', '/v1/contributions', []),
                    (400, 'POST', '/v1/contributions', {'comment': 7}),
                    (400, 'POST', '/v1/contributions', {'comment': 'x' * 2001}),
                    (400, 'POST', '/v1/contributions', {'licence': 'a\nb'}),
                    (400, 'POST', '/v1/contributions', {'comment': 'a\u0000b'}),
                    (413, 'POST', '/v1/contributions', {'comment': 'x' * 70_000})]:
                got, told = self.ask(daemon, method, path, body)
                self.assertEqual(got, code, (method, path, told))
        done = [(entry['actor'], entry['detail']) for line in must('journal', db).splitlines()
                if (entry := json.loads(line))['action'] == 'contribution']
        self.assertEqual(done, [('anna', 'opened 1'), ('bela', 'opened 2'), ('anna', 'opened 3'),
                                ('anna', 'closed 1')])

    def test_it_is_removed_with_its_photos(self):
        db = new_database('removing')
        with Daemon(db) as daemon:
            for number in (1, 2):
                self.open(daemon, contributor='anna', comment='of mine')
                self.assertEqual(self.post(daemon, f'{number}.jpg', photo(number), number), 201)
            path = must_begin(daemon, 9, filename='3.jpg', contribution='2')
            removed = ask('remove', db, '--contribution', '2', '--by', 'kai')
            self.assertEqual([one['image'] for one in removed['removed']], ['2.jpg'])
            self.assertEqual((removed['uploads'], removed['purged']), (1, True))
            self.assertEqual(offset_of(daemon, path), -404)
            self.assertEqual(self.ask(daemon, 'GET', '/v1/contributions/2')[0], 404)
            self.assertEqual(self.open(daemon, contributor='anna'), 3)
        self.refused(1, 'contribution 2', 'remove', db, '--contribution', '2')
        self.refused(2, '--contributor', 'remove', db, '--contribution', '2', '--contributor', 'x')
        must('remove', db, '--contribution', '1')
        self.assertEqual(ask('status', db)['images'], 0)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_who_may(self):
        db = new_database('who')
        anna, bela, viewer, curator = (
            {'Authorization': 'Bearer ' + must('token', 'create', db, name, '--role', role).strip()}
            for name, role in (('anna', 'contributor'), ('bela', 'contributor'),
                               ('vera', 'viewer'), ('kai', 'curator')))
        with Daemon(db) as daemon:
            def code(method, path, body=None, headers={}):
                return self.ask(daemon, method, path, body, headers)[0]

            self.assertEqual(code('POST', '/v1/contributions', {}), 401)
            self.assertEqual(code('POST', '/v1/contributions', {}, viewer), 403)
            self.assertEqual(code('POST', '/v1/contributions', {'contributor': 'bela'}, anna), 403)
            self.assertEqual(code('POST', '/v1/contributions', {'coment': 'x'}, anna), 400)
            self.assertEqual(self.open(daemon, anna), 1)
            self.assertEqual(self.post(daemon, '1.jpg', photo(1), 1, anna), 201)
            self.assertEqual(self.post(daemon, '2.jpg', photo(2), 1, bela), 400)
            self.assertEqual(begin(daemon, 9, bela, filename='2', contribution='1')[0], 400)
            self.assertEqual(self.post(daemon, '2.jpg', photo(2), 1, curator), 201)
            told = self.ask(daemon, 'GET', '/v1/contributions/1', None, viewer)[1]
            self.assertEqual((told['contributor'], told['photos']), ('anna', 2))
            self.assertEqual(code('POST', '/v1/contributions/1/close', None, bela), 403)
            self.assertEqual(code('POST', '/v1/contributions/1/close', None, anna), 200)
            self.assertEqual(code('DELETE', '/v1/contributions/1', None, anna), 403)
            self.assertEqual(code('DELETE', '/v1/contributions/1', None, curator), 200)
            self.assertEqual(code('GET', '/v1/contributions/1', None, viewer), 404)
        self.assertEqual(ask('status', db)['images'], 0)
        done = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertEqual([entry['actor'] for entry in done if entry['action'] == 'contribution'],
                         ['anna', 'anna', 'kai'])

    def test_a_token_opens_so_many_a_day(self):
        db = new_database('many')
        anna, bela = ({'Authorization': 'Bearer ' + must('token', 'create', db, name, '--role',
                                                         'contributor').strip()}
                      for name in ('anna', 'bela'))
        with Daemon(db) as daemon:
            for _ in range(1000):
                self.open(daemon, anna)
            code, headers, body = daemon.ask('POST', '/v1/contributions', '{}',
                                             {**anna, 'Content-Type': 'application/json'})
            self.assertEqual((code, 'contributions' in json.loads(body)['detail']), (429, True))
            self.assertTrue(1 <= int(headers['Retry-After']) <= 87, headers['Retry-After'])
            self.assertEqual(self.open(daemon, bela), 1001)
            self.assertEqual(self.post(daemon, '1.jpg', photo(1), 1, anna), 201)

    def test_photos_come_by_rpc_as_well(self):
        with Daemon(new_database('rpc'), '--listen', '127.0.0.1:0') as daemon:
            number = self.open(daemon, contributor='anna')
            city = veduta_rpc.connect(daemon.started['rpc'])
            self.addCleanup(city.close)

            def fails(code, words, contribution):
                with self.assertRaises(veduta_rpc.Failure) as raised:
                    city.add('2.jpg', photo(2), 'c', contribution=contribution).number()
                self.assertEqual(raised.exception.code, code)
                self.assertIn(words, str(raised.exception))

            city.add('1.jpg', photo(1), 'c', contribution=number).verdict()
            self.assertEqual(self.sums(daemon, number)[0], {**NONE, 'postponed': 1})
            self.assertEqual(daemon.get('/v1/photos')[0]['contributor'], 'anna')
            fails(404, 'no contribution 77', 77)
            self.assertEqual(daemon.ask('POST', f'/v1/contributions/{number}/close', '')[0], 200)
            fails(409, 'closed', number)


if __name__ == '__main__':
    main()
