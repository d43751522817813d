#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what a curator hides is told to no viewer and no contributor, by no route and no call by
#   RPC, and comes back when it is shown again, over restarts and backups; the map stays. Photos
#   are reported by whoever may read, and curators resolve the reports. What a token has used
#   outlives the daemon. A link for a part of the city shows that part alone.
# Method: real daemons; every GET of the description of the API is asked by each role, and its
#   answer searched for the name and the contributor of the hidden photo.
# usage: tests/cli/moderation_test.py VEDUTA VEDUTA_STREET [TEST...]
import contextlib
import json
import os
import signal
import sys

from city import Case, add, ask, at, main, must, new_database, photo, read, render, run, SIZE
from daemon import JPEG, Daemon, part

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
sys.path.insert(0, os.path.join(ROOT, 'cli', 'rpc'))
import veduta_rpc  # noqa: E402 (the line above finds it)

AS_JSON = {'Content-Type': 'application/json'}
NAME, WHO = 'secret-4711.jpg', 'zenobia'  # of the photo that is hidden, which is photo 4
PHOTOS = 8


def setUpModule():
    # So near to each other that all of the first ones get a pose.
    render('street', '--photos', '20', '--length', '10', '--size', SIZE)


def bearer(token):
    return {'Authorization': 'Bearer ' + token}


def make(db, name, role, *more):
    return must('token', 'create', db, name, '--role', role, *more).strip()


def city(name):
    """A database of photos of anna, and one of somebody else."""
    db = new_database(name)
    photos = os.path.join(at('street'), 'photos')
    for number in range(1, PHOTOS + 1):
        source = os.path.join(photos, f'photo{number:04}.jpg')
        if number != 4:
            code, _, err = add(db, source)
            assert code == 0, err
            continue
        renamed = at(name + '-photos', NAME)
        os.makedirs(os.path.dirname(renamed))
        os.link(source, renamed)
        must('add', db, '--camera', 'c', '--contributor', WHO, renamed)
    return db


class Moderation(Case):
    def ask(self, daemon, token, method, path, body=None, headers={}):
        """Code, headers and body."""
        if isinstance(body, dict):
            body, headers = json.dumps(body), {**headers, **AS_JSON}
        return daemon.ask(method, path, body, {**headers, **(bearer(token) if token else {})})

    def answers(self, daemon, token):
        """All that is told of photos, by "METHOD path"."""
        told = {}
        paths = json.loads(daemon.ask('GET', '/v1/openapi.json')[2])['paths']
        photos = [NAME, f'{WHO}/{NAME}', '#4', '#3', 'photo0005.jpg']
        for path, methods in paths.items():
            if 'get' not in methods or path == '/v1/events':
                continue
            for one in photos if '{photo}' in path else ['']:
                asked = path.replace('{photo}', part(one))
                for name, value in (('collection', 'photos'), ('item', '4'), ('camera', 'c'),
                                    ('reconstruction', '1'), ('upload', '1'), ('tus', 'x'),
                                    ('contribution', '1'), ('tile', 'x.glb')):
                    asked = asked.replace('{' + name + '}', value)
                self.assertNotIn('{', asked)
                told['GET ' + asked] = self.ask(daemon, token, 'GET', asked)
        for path in ('/v1/localize?camera=c', '/v1/candidates?camera=c'):
            for number in (4, 9):
                told[f'POST {path} {number}'] = self.ask(daemon, token, 'POST', path,
                                                         photo(number), JPEG)
        told['POST search'] = self.ask(daemon, token, 'POST', '/v1/stac/search',
                                       {'ids': ['3', '4'], 'limit': 100})
        with contextlib.closing(daemon.connect()) as connection:
            connection.request('GET', '/v1/events?from=1', headers=bearer(token))
            answer, text, count = connection.getresponse(), b'', 0
            while count < PHOTOS:
                line = answer.readline()
                text, count = text + line, count + line.startswith(b'data: ')
            told['GET /v1/events'] = (answer.status, answer.headers, text)
        return told

    def tells(self, daemon, token):
        """What of that names the photo or who has sent it."""
        naming = {}
        for asked, (code, headers, body) in self.answers(daemon, token).items():
            # A refusal may repeat the name that was asked for.
            of_refusal = code >= 400 and b'there is no image' in body
            text = body + str(headers.items()).encode()
            if not of_refusal and (NAME.encode() in text or WHO.encode() in text):
                naming[asked] = code
        return naming

    def told_by_rpc(self, daemon, token):
        texts = []
        with contextlib.closing(veduta_rpc.connect(daemon.started['rpc'], token)) as rpc:
            for one in (NAME, '#4'):
                for call in (rpc.pose, rpc.neighbors):
                    try:
                        texts.append(str(call(one)))
                    except veduta_rpc.Failure as failure:
                        self.assertEqual(failure.code, 404)
                        texts.append('refused')
            texts.append(str(rpc.neighbors('#3')))
            texts.append(str(rpc.journal()))
            for number in (4, 9):
                examined = rpc.examine(photo(number))
                texts.append(str(examined.localize('c')))
                texts.append(str(examined.candidates('c', 20)))
            for entry in rpc.changes(1):
                texts.append(str(entry))
                if entry.number >= PHOTOS:
                    break
        return texts

    def check_the_same_bytes(self, daemon, sender):
        """They are there, and no more is said of it."""
        code, headers, body = self.ask(daemon, sender, 'POST', '/v1/photos?name=x.jpg&camera=c',
                                       photo(4), JPEG)
        self.assertEqual((code, json.loads(body)['detail'], headers['Location']),
                         (409, 'the same bytes are stored', None))
        code, _, body = self.ask(daemon, sender, 'POST', '/v1/photos?name=x.jpg&camera=c',
                                 photo(4), {**JPEG, 'Prefer': 'respond-async'})
        upload = json.loads(body)['upload']
        while True:
            news = json.loads(self.ask(daemon, sender, 'GET', f'/v1/uploads/{upload}')[2])
            if news['state'] != 'waiting':
                break
        self.assertEqual((news['outcome']['verdict'], news['outcome']['id']),
                         ('duplicate', None))
        self.assertNotIn(NAME, json.dumps(news))

    def check_curators(self, daemon, viewer, curator, seen):
        # One snapshot has another tag for whoever sees more.
        tags = {self.ask(daemon, token, 'GET', '/v1/photos')[1]['ETag']
                for token in (viewer, curator)}
        self.assertEqual(len(tags), 2)
        # Curators see it, marked.
        self.assertEqual(set(seen) - set(self.tells(daemon, curator)), set())
        code, _, body = self.ask(daemon, curator, 'GET', '/v1/photos/%234')
        self.assertEqual((code, json.loads(body)['hidden']), (200, True))
        listed = json.loads(self.ask(daemon, curator, 'GET', '/v1/photos')[2])
        self.assertEqual([one['id'] for one in listed if one['hidden']], [4])
        item = json.loads(self.ask(daemon, curator, 'GET',
                                   '/v1/stac/collections/photos/items/4')[2])
        self.assertIs(item['properties']['veduta:hidden'], True)
        hidden, = json.loads(self.ask(daemon, curator, 'GET', '/v1/hidden')[2])
        self.assertEqual((hidden['id'], hidden['image'], hidden['actor'], hidden['reason']),
                         (4, NAME, 'kai', 'it shows a home'))

    def test_what_is_hidden_is_told_to_nobody_but_curators(self):
        db = city('hiding')
        before = must('digest', db)
        viewer, sender, curator = (make(db, name, role) for name, role in (
            ('vera', 'viewer'), ('anna', 'contributor'), ('kai', 'curator')))
        with Daemon(db, '--listen', '127.0.0.1:0') as daemon:
            seen = self.tells(daemon, viewer)
            self.assertGreater(len(seen), 12, seen)
            self.assertTrue(any(NAME in text for text in self.told_by_rpc(daemon, viewer)))
            must('hide', db, NAME, '--by', 'kai', '--reason', 'it shows a home')
            for token in (viewer, sender):
                self.assertEqual(self.tells(daemon, token), {})
                texts = self.told_by_rpc(daemon, token)
                self.assertEqual(texts[:4], ['refused'] * 4)
                self.assertEqual([t for t in texts if NAME in t or WHO in t], [])
                for path in ('', '/pose', '/thumbnail', '/neighbors', '/uncertainty'):
                    for one in (NAME, '#4'):
                        code, _, body = self.ask(daemon, token, 'GET',
                                                 f'/v1/photos/{part(one)}{path}')
                        self.assertEqual((code, json.loads(body)['detail']),
                                         (404, f"there is no image '{one}' in the database"))
                listed = json.loads(self.ask(daemon, token, 'GET', '/v1/photos')[2])
                self.assertEqual([one['id'] for one in listed], [1, 2, 3, 5, 6, 7, 8])
                code, headers, body = self.ask(daemon, token, 'GET', '/v1/reconstructions/1')
                self.assertEqual(json.loads(body)['images'], PHOTOS, 'the map stays')
            self.check_the_same_bytes(daemon, sender)
            self.check_curators(daemon, viewer, curator, seen)
            must('backup', db, at('hiding-backups'))
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        self.assertEqual(must('digest', db), before)
        self.assertEqual(must('verify', db), 'sound\n')
        must('restore', at('hiding-backups'), at('hiding-restored'))
        for one in (db, at('hiding-restored')):
            with Daemon(one) as daemon:
                self.assertEqual(self.tells(daemon, viewer), {})
                if one != db:
                    continue
                for body, code in (({'photos': ['#4']}, 200), ({'photos': ['#4']}, 404),
                                   ({'photos': 4}, 400), ({}, 400), ({'photos': ['#99']}, 404)):
                    self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/shown', body)[0], code)
                self.assertEqual(set(self.tells(daemon, viewer)), set(seen))
        done = [json.loads(line) for line in must('journal', db).splitlines()]
        self.assertEqual([(e['actor'], e['action'], e['image'], e['detail']) for e in done
                          if e['action'] in ('hide', 'unhide')],
                         [('kai', 'hide', 4, 'image 4: it shows a home'),
                          ('kai', 'unhide', 4, 'image 4')])

    def test_without_tokens_the_owner_alone_hides_and_sees(self):
        db = city('owner')
        must('hide', db, NAME)  # without a daemon
        self.assertIn('hidden', must('show', db, NAME))
        self.assertEqual(must('hidden', db), f'{NAME} (#4) (anonymous)\n')
        must('forbid', db, NAME, 'photo0005.jpg', '--reason', f'{NAME} is its twin')
        with Daemon(db) as daemon:
            self.assertEqual(self.tells(daemon, ''), {})
            self.assertEqual(self.ask(daemon, '', 'POST', '/v1/hidden', {'photos': ['#1']})[0], 403)
            must('unhide', db, '#4', '--by', 'owner')
            self.assertIn('GET /v1/photos', self.tells(daemon, ''))
            self.refused(1, 'is not hidden', 'unhide', db, '#4')
            self.refused(1, 'no image', 'hide', db, 'none.jpg')
        self.refused(2, 'name photos, or a contribution', 'hide', db)
        self.refused(2, 'name photos, or a contribution', 'hide', db, '#1', '--contribution', '1')
        self.refused(1, 'no contribution 7', 'hide', db, '--contribution', '7')

    def test_exports_leave_hidden_photos_out(self):
        db = city('exports')
        must('hide', db, NAME)
        for form in ('colmap', 'nerfstudio', 'ply'):
            for flags in ([], ['--with-hidden']):
                out = at(f'export-{form}-{len(flags)}')
                must('export', db, out, '--format', form, *flags)
                names = ''.join(read(os.path.join(folder, file)).decode('latin-1')
                                for folder, _, files in os.walk(out) for file in files
                                if file in ('images.txt', 'transforms.json', 'cameras.json'))
                self.assertIn('photo0003.jpg', names)
                self.assertEqual(NAME in names, bool(flags), (form, flags))

    def test_a_contribution_is_hidden_with_all_that_comes(self):
        db = new_database('contribution')
        viewer, sender, curator = (make(db, name, role) for name, role in (
            ('vera', 'viewer'), (WHO, 'contributor'), ('kai', 'curator')))
        with Daemon(db) as daemon:
            send = '/v1/photos?contribution=1&camera=c&name='
            self.assertEqual(self.ask(daemon, sender, 'POST', '/v1/contributions',
                                      {'comment': 'of my street'})[0], 201)
            self.assertEqual(self.ask(daemon, sender, 'POST', send + '1.jpg', photo(1), JPEG)[0],
                             201)
            must('hide', db, '--contribution', '1', '--by', 'kai', '--reason', 'asked')
            self.assertEqual(self.ask(daemon, sender, 'POST', send + '2.jpg', photo(2), JPEG)[0],
                             201)
            # Who may not see it is not told whose it is.
            other = make(db, 'olga', 'contributor')
            code, _, body = self.ask(daemon, other, 'POST', '/v1/contributions/1/close')
            self.assertEqual((code, WHO.encode() in body), (404, False))
            for token in (viewer, sender):
                self.assertEqual(json.loads(self.ask(daemon, token, 'GET', '/v1/photos')[2]), [])
                for path in ('/v1/contributions/1', '/v1/contributions/1/photos'):
                    self.assertEqual(self.ask(daemon, token, 'GET', path)[0], 404)
                self.assertEqual(self.ask(daemon, token, 'GET', '/v1/contributions')[2].strip(),
                                 b'[]')
                found = self.ask(daemon, token, 'GET', '/v1/stac/search')[2]
                self.assertNotIn(WHO.encode(), found)
                # That there is a token of that name is no secret.
                journal = json.loads(self.ask(daemon, token, 'GET', '/v1/journal')[2])
                self.assertEqual([entry for entry in journal if entry['action'] != 'token'
                                  and WHO in json.dumps(entry)], [])
            told = json.loads(self.ask(daemon, curator, 'GET', '/v1/contributions/1')[2])
            self.assertEqual((told['contributor'], told['hidden']), (WHO, True))
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/shown',
                                      {'contribution': 1})[0], 200)
            self.assertEqual(len(json.loads(self.ask(daemon, viewer, 'GET', '/v1/photos')[2])), 2)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_reports_are_kept_and_resolved(self):
        db = city('reports')
        viewer, sender, curator = (make(db, name, role) for name, role in (
            ('vera', 'viewer'), ('anna', 'contributor'), ('kai', 'curator')))
        with Daemon(db) as daemon:
            def report(photo_text, token, **body):
                code, _, told = self.ask(daemon, token, 'POST',
                                         f'/v1/photos/{part(photo_text)}/report', body)
                return code, json.loads(told)
            self.assertEqual(report('#4', '', reason='privacy')[0], 401)
            self.assertEqual(report('#4', viewer, reason='privacy', text='my\nwindow'),
                             (201, {'report': 1}))
            self.assertEqual(report(NAME, viewer, reason='other'), (201, {'report': 1}))
            self.assertEqual(report('#2', sender, reason='wrong'), (201, {'report': 2}))
            self.assertEqual(report('#3', viewer, reason='copyright'), (201, {'report': 3}))
            for body in ({}, {'reason': 'x'}, {'reason': 'other', 'text': 'x' * 2001},
                         {'reason': 'other', 'text': 'a\0b'}, {'reason': 'other', 'text': 7}):
                self.assertEqual(report('#1', viewer, **body)[0], 400, body)
            self.assertEqual(report('#99', viewer, reason='other')[0], 404)
            self.assertEqual(self.ask(daemon, viewer, 'POST', '/v1/photos/%231/report', b'{}',
                                      {'Content-Type': 'text/plain'})[0], 415)
            for token, code in ((viewer, 403), (sender, 403), (curator, 200)):
                self.assertEqual(self.ask(daemon, token, 'GET', '/v1/reports')[0], code)
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        self.assertEqual(must('reports', db).splitlines()[0],
                         f'   1  {NAME} (#4)  privacy, by vera: my\\nwindow')
        with Daemon(db) as daemon:
            open_ones = json.loads(self.ask(daemon, curator, 'GET', '/v1/reports')[2])
            self.assertEqual([(one['report'], one['id'], one['image'], one['reason'], one['text'],
                               one['reporter'], one['state']) for one in open_ones[:1]],
                             [(1, 4, NAME, 'privacy', 'my\nwindow', 'vera', 'open')])
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/hidden',
                                      {'photos': [NAME], 'reason': 'report 1'})[0], 200)
            self.assertEqual(self.ask(daemon, viewer, 'POST', '/v1/reports/2/dismiss', {})[0], 403)
            must('dismiss', db, '2', '--by', 'owner')
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/reports/2/dismiss', {})[0], 409)
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/reports/9/dismiss', {})[0], 404)
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/reports/x/dismiss', {})[0], 400)
            must('remove', db, '#3', '--by', 'ada')
            self.assertEqual(json.loads(self.ask(daemon, curator, 'GET', '/v1/reports')[2]), [])
            told = json.loads(self.ask(daemon, curator, 'GET', '/v1/reports?state=all')[2])
            self.assertEqual([(one['state'], one['resolver'], one['image']) for one in told],
                             [('hidden', 'kai', NAME), ('dismissed', 'owner', 'photo0002.jpg'),
                              ('erased', 'ada', None)])
            self.assertEqual(self.ask(daemon, curator, 'GET', '/v1/reports?state=x')[0], 400)
            # Who has reported what is for curators.
            entries = json.loads(self.ask(daemon, viewer, 'GET', '/v1/journal')[2])
            self.assertEqual({one['actor'] for one in entries if one['action'] == 'report'}, {''})
        self.assertEqual(ask('reports', db, '--all'), told)
        self.assertEqual(must('reports', db), '')
        self.assertEqual(must('verify', db), 'sound\n')

    def test_reports_are_counted_by_address(self):
        db = new_database('addresses')
        viewers = [make(db, f'v{n}', 'viewer') for n in range(3)]
        curator = make(db, 'cleo', 'curator')
        with Daemon(db, '--trust-proxy', '127.0.0.1') as daemon:
            self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/photos?camera=c&name=1.jpg',
                                      photo(1), JPEG)[0], 201)

            def report(viewer, address):
                return self.ask(daemon, viewer, 'POST', '/v1/photos/%231/report',
                                {'reason': 'other'}, {'X-Forwarded-For': address})

            # One who has many tokens, and says that its requests come from elsewhere.
            for viewer in viewers[:2]:
                codes = {report(viewer, f'198.51.100.{n}, 192.0.2.1')[0] for n in range(100)}
                self.assertEqual(codes, {201})
            code, headers, body = report(viewers[2], '192.0.2.1')
            self.assertEqual((code, 'your address' in json.loads(body)['detail']), (429, True))
            self.assertGreaterEqual(int(headers['Retry-After']), 1)
            self.assertEqual(report(viewers[2], '192.0.2.2')[0], 201)
        with Daemon(db) as daemon:  # that trusts nobody
            for viewer in viewers:
                self.assertIn(report(viewer, '192.0.2.9')[0], (201, 429))
        self.refused(2, 'an address', 'serve', db, '--trust-proxy', 'localhost')

    def test_what_a_token_has_used_outlives_the_daemon(self):
        db = new_database('quotas')
        few = make(db, 'anna', 'contributor', '--photos-per-day', '2')
        viewer = make(db, 'vera', 'viewer', '--requests-per-second', '1000')
        send = '/v1/photos?camera=c&name='
        with Daemon(db) as daemon:
            for number in (1, 2):
                self.assertEqual(self.ask(daemon, few, 'POST', f'{send}{number}.jpg',
                                          photo(number), JPEG)[0], 201)
            codes = [self.ask(daemon, viewer, 'POST', '/v1/photos/%231/report',
                              {'reason': 'other'})[0] for _ in range(101)]
            self.assertEqual(codes, [201] * 100 + [429])
            daemon.process.send_signal(signal.SIGKILL)
            daemon.process.wait()
        with Daemon(db) as daemon:
            code, headers, body = self.ask(daemon, few, 'POST', send + '3.jpg', photo(3), JPEG)
            self.assertEqual(code, 429, body)
            self.assertGreater(int(headers['Retry-After']), 40_000)
            code, headers, body = self.ask(daemon, viewer, 'POST', '/v1/photos/%231/report',
                                           {'reason': 'other'})
            self.assertEqual((code, 'reports' in json.loads(body)['detail']), (429, True))
        self.assertEqual(must('verify', db), 'sound\n')

    def test_a_link_for_a_part_shows_that_part(self):
        db = city('parts')
        sender, curator = make(db, 'bela', 'contributor'), make(db, 'kai', 'curator')
        with Daemon(db) as daemon:
            self.ask(daemon, sender, 'POST', '/v1/contributions', {})
            self.assertEqual(self.ask(daemon, sender, 'POST', '/v1/photos?contribution=1&camera=c'
                                      '&name=mine.jpg', photo(9), JPEG)[0], 201)
            for wrong, code in (({'contribution': 9}, 404), ({'reconstruction': 9}, 404),
                                ({'contribution': 1, 'reconstruction': 1}, 400),
                                ({'contribution': 'x'}, 400)):
                self.assertEqual(self.ask(daemon, curator, 'POST', '/v1/links',
                                          {'name': 'x', 'days': 1, **wrong})[0], code, wrong)
            code, _, body = self.ask(daemon, curator, 'POST', '/v1/links',
                                     {'name': 'a friend', 'days': 1, 'contribution': 1})
            self.assertEqual(code, 201, body)
            of_contribution = json.loads(body)['path'].split('=')[1]
            of_reconstruction = must('token', 'link', db, 'x', '--reconstruction',
                                     '1').strip().split('=')[1]

            def photos(token):
                listed = json.loads(self.ask(daemon, token, 'GET', '/v1/photos')[2])
                found = json.loads(self.ask(daemon, token, 'GET', '/v1/stac/search?limit=99')[2])
                self.assertEqual([str(one['id']) for one in listed],
                                 [one['id'] for one in found['features']])
                return [one['image'] for one in listed]
            self.assertEqual(photos(of_contribution), ['mine.jpg'])
            self.assertEqual(len(photos(of_reconstruction)), PHOTOS + 1)
            for token in (of_contribution, of_reconstruction):
                for path, code in (('/v1/status', 200), ('/v1/reconstructions/1/points', 200),
                                   ('/v1/photos/mine.jpg/thumbnail', 200), ('/v1/journal', 200),
                                   ('/v1/cameras', 200), ('/v1/hypotheses', 200), ('/v1/me', 200),
                                   ('/v1/dense', 403),
                                   ('/metrics', 403), ('/v1/uploads', 403), ('/v1/links', 403)):
                    self.assertEqual(self.ask(daemon, token, 'GET', path)[0], code, path)
                self.assertEqual(self.ask(daemon, token, 'POST', '/v1/localize', photo(1),
                                          JPEG)[0], 403)
            for path in ('/v1/photos/photo0001.jpg', '/v1/photos/%231/thumbnail'):
                self.assertEqual(self.ask(daemon, of_contribution, 'GET', path)[0], 404)
            self.assertEqual(self.ask(daemon, of_contribution, 'GET', '/v1/contributions/1')[0],
                             200)
            told = self.ask(daemon, of_contribution, 'GET', '/v1/journal')[2]
            self.assertNotIn(WHO.encode(), told)
            self.assertNotIn(b'"anna"', told)
            must('hide', db, 'mine.jpg')
            self.assertEqual(photos(of_contribution), [])
        listed = must('token', 'list', db)
        self.assertIn('for contribution 1', listed)
        self.assertIn('for reconstruction 1', listed)
        code, _, err = run('token', 'link', db, 'x', '--reconstruction', '1', '--contribution', '1')
        self.assertEqual(code, 2, err)


if __name__ == '__main__':
    main()
