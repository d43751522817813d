#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the built binary keeps what the command line promises: verdicts with reasons, every field of
#   the JSON, exit codes 0 to 3, messages that say what to do.
# Method: photos of a rendered street, and files that are none; real processes.
# usage: tests/cli/command_line_test.py VEDUTA VEDUTA_STREET
import hashlib
import json
import os
import random
import re
import struct
import subprocess
import zlib
from resource import RLIMIT_AS, setrlimit
from urllib.parse import unquote

from city import (PARAMS, PHOTOS, PLACED, SIZE, VEDUTA, WHOLE, Case, add, add_command, ask, at,
                  main, make_whole, must, new_database, photo, read, render, run, write)

ADD_FIELDS = {'image', 'id', 'verdict', 'reason', 'reconstruction', 'neighbors', 'inliers', 'ms'}
MS_FIELDS = {'decode', 'undistort', 'features', 'retrieve', 'match', 'verify', 'map', 'adjust',
             'commit', 'total'}


def setUpModule():
    global WHOLE_LINES, WHOLE_DIGEST
    WHOLE_LINES, WHOLE_DIGEST = make_whole()


def black_png(width, height, comment=b''):
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I',
                                                                        zlib.crc32(kind + data))
    rows = bytes((1 + 3 * width) * height)
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 2, 0,
                                                              0, 0)) +
            chunk(b'tEXt', b'Comment\0' + comment) + chunk(b'IDAT', zlib.compress(rows)) +
            chunk(b'IEND', b''))


class Usage(Case):
    def test_bad_usage_is_2(self):
        for words, arguments in (
                ('subcommand is required', ()), ("no command 'paint'", ('paint',)),
                ('DB is required', ('init',)),
                ('--camera', ('add', WHOLE, '--camera', '', PHOTOS)),
                ('PHOTO', ('add', WHOLE, '--camera', 'c')),
                ('--threads', ('add', WHOLE, '--camera', 'c', PHOTOS, '--threads', '0')),
                ('--threads', ('add', WHOLE, '--camera', 'c', PHOTOS, '--threads', 'many')),
                ('--bogus', ('add', WHOLE, '--camera', 'c', PHOTOS, '--bogus')),
                ('--list', ('add', WHOLE, '--camera', 'c', PHOTOS, PHOTOS, '--list', os.devnull)),
                ('--format', ('export', WHOLE, at('never'), '--format', 'obj')),
                ('--count', ('neighbors', WHOLE, 'photo0001.jpg', '--count', '0')),
                ('subcommand is required', ('vocabulary',)),
                ('subcommand is required', ('camera',))):
            self.refused(2, words, *arguments)
        self.assertFalse(os.path.exists(at('never')))

    def test_help_names_every_command(self):
        listed = must('--help')
        without_database = {'camera': 'SUBCOMMAND', 'vocabulary': 'SUBCOMMAND',
                            'token': 'SUBCOMMAND', 'backups': 'SUBCOMMAND',
                            'devices': '--device', 'calibrate': '--points', 'markers': '--out'}
        for command in ('init', 'camera', 'markers', 'calibrate', 'add', 'settle', 'status',
                        'reconstruction', 'show', 'neighbors', 'pose', 'export', 'densify',
                        'render', 'verify', 'digest', 'vocabulary', 'journal', 'backup', 'repair',
                        'remove', 'forbid', 'allow', 'forbidden', 'devices', 'localize', 'serve',
                        'georeference', 'token', 'backups', 'restore', 'copy', 'import', 'hide',
                        'unhide', 'hidden', 'report', 'reports', 'dismiss'):
            self.assertRegex(listed, rf'(?m)^  {command} ')
            self.assertIn(without_database.get(command, 'DB'), must(command, '--help'))
        count = len(re.findall(r'(?m)^  [a-z]+ ', listed.split('Subcommands:')[1]))
        self.assertEqual(count, 39, 'a command is not in this list')
        self.assertRegex(must('--version'), r'^\d+\.\d+\.\d+\n$')

    def test_init_again_changes_nothing(self):
        self.refused(1, 'already', 'init', WHOLE)
        self.refused(1, 'not empty', 'init', PHOTOS)
        self.assertEqual(must('digest', WHOLE), WHOLE_DIGEST)

    def test_what_is_no_database(self):
        os.mkdir(at('nothing in it'))
        for path, words in ((at('missing'), 'veduta init'),
                            (at('nothing in it'), 'not a veduta database'),
                            (PHOTOS, 'not a veduta database'),
                            (os.path.join(PHOTOS, 'photo0001.jpg'), 'is a file')):
            for command in (('status',), ('digest',), ('verify',), ('show', 'x'),
                            ('export', at('never')),
                            ('add', '--camera', 'c', PHOTOS)):
                self.refused(1, words, command[0], path, *command[1:])
        self.assertFalse(os.path.exists(at('missing')))
        self.assertEqual(os.listdir(at('nothing in it')), [])


class Settle(Case):
    def test_nothing_is_left_after_an_add(self):
        self.assertEqual(must('settle', WHOLE), '')
        self.assertEqual(must('settle', WHOLE, '--json', '--threads', '1'), '')
        self.assertEqual(must('digest', WHOLE), WHOLE_DIGEST)
        self.refused(1, 'there is no database', 'settle', at('nowhere'))


class Camera(Case):
    def test_add_and_list(self):
        db = at('cameras')
        must('init', db)

        def camera(name, size, params):
            return 'camera', 'add', db, name, '--size', size, '--params=' + params
        for words, size, params in (
                ('size', '512', PARAMS), ('size', '512X384', PARAMS), ('size', '0x384', PARAMS),
                ('size', '512x384x3', PARAMS), ('size', '512x70000', PARAMS),
                ('4, 6 or 8', SIZE, '450,450,255'),
                ('4, 6 or 8', SIZE, PARAMS + ',0.1'), ('cx', SIZE, '450,450,middle,191'),
                ('fy', SIZE, '450,nan,255,191'),
                ('fx', SIZE, '-450,450,255,191'), ('fx', SIZE, '1e999,450,255,191'),
                ('cy', SIZE, '450,450,255,')):
            self.refused(2, words, *camera('bad', size, params))
        self.refused(1, 'needs a name', *camera('', SIZE, PARAMS))
        self.assertEqual(ask('camera', 'list', db), [])
        must(*camera('c', SIZE, PARAMS))
        must(*camera('c', SIZE, PARAMS))
        self.refused(1, 'other intrinsics', *camera('c', SIZE, '451,450.56,255.5,191.5'))
        self.refused(1, 'other intrinsics', *camera('c', '511x384', PARAMS))
        must(*camera('my lens', '1536x1024', '1200,1210,767.5,511.5,-0.06,0.01,760,500'))
        listed = ask('camera', 'list', db)
        self.assertEqual([(c['name'], c['size'], c['params']) for c in listed],
                         [('c', SIZE, PARAMS), ('my lens', '1536x1024',
                                                '1200,1210,767.5,511.5,-0.06,0.01,760,500')])
        self.assertIn('my lens', must('camera', 'list', db))
        self.refused(1, 'the database has: c, my lens', 'add', db, '--camera', 'other', PHOTOS)


class Add(Case):
    def test_every_line_has_every_field(self):
        self.assertEqual([line['image'] for line in WHOLE_LINES], sorted(os.listdir(PHOTOS)))
        self.assertEqual([line['id'] for line in WHOLE_LINES], list(range(1, 13)))
        for line in WHOLE_LINES:
            self.assertLessEqual(ADD_FIELDS, set(line))
            self.assertLessEqual(MS_FIELDS, set(line['ms']))
            self.assertTrue(line['reason'])
            self.assertEqual(line['reconstruction'] is not None, line['verdict'] in PLACED, line)
            self.assertGreater(line['ms']['total'], line['ms']['commit'])
        self.assertGreaterEqual(sum(line['verdict'] in PLACED for line in WHOLE_LINES), 3)

    def test_a_folder_of_everything(self):
        folder = at('everything')
        good = {'a.jpg': 1, 'b with spaces.jpg': 2, 'c \u00e9\u4e2d\U0001f3e0.jpg': 3,
                'd line\nbreak.jpg': 4,
                'e \"quoted\" \\.jpg': 5, 'sub/folder/g.jpg': 6}
        for name, number in good.items():
            write(os.path.join(folder, name), photo(number))
        write(os.path.join(os.fsencode(folder), b'f caf\xe9.jpg'), photo(7))
        bad = {'black.png': (black_png(512, 384), 'nothing to recognise it by'),
               'blurred.jpg': (read(os.path.join(render('blurred', '--photos', '1', '--size', SIZE,
                                                        '--blur', '20'),
                                                 'photo0001.jpg')), 'out of focus'),
               'broken.jpg': (photo(8)[:700], 'cannot be read'),
               'empty.jpg': (b'', 'an empty file'),
               'film.mp4': (b'\0\0\0\x18ftypmp42' + random.Random(1).randbytes(5000),
                            'not a format that is read'),
               'noise.jpg': (b'\xff\xd8\xff\xe0' + random.Random(2).randbytes(5000),
                             'cannot be read'),
               'notes.txt': (b'Monday: rain.\n', 'not a format that is read'),
               'wide.png': (black_png(600, 384), 'not the size of its camera')}
        for name, (data, _) in bad.items():
            write(os.path.join(folder, name), data)
        write(os.path.join(folder, 'sub/twin.jpg'), photo(1))
        write(os.path.join(folder, '.hidden.jpg'), photo(9))
        write(os.path.join(folder, '.git/hidden.jpg'), photo(9))

        db = new_database('of everything')
        code, lines, err = add(db, folder)
        self.assertEqual(code, 1)  # some were asked for and could not be added
        verdicts = {line['image']: line for line in lines}
        self.assertEqual(set(verdicts), {*good, *bad, 'sub/twin.jpg', 'f caf\ufffd.jpg'})
        for name in (*good, 'f caf\ufffd.jpg'):
            self.assertIn(verdicts[name]['verdict'], (*PLACED, 'postponed'))
        self.assertGreaterEqual(ask('status', db)['placed'], 3)
        for name, (_, reason) in bad.items():
            self.assertEqual(verdicts[name]['verdict'], 'rejected', name)
            self.assertIn(reason, verdicts[name]['reason'], name)
            shown = ask('show', db, name)
            self.assertEqual((shown['verdict'], shown['reason']),
                             ('rejected', verdicts[name]['reason']))
        self.assertIn('600x384', verdicts['wide.png']['reason'])
        self.assertEqual(verdicts['sub/twin.jpg']['verdict'], 'duplicate')
        self.assertIn('a.jpg', verdicts['sub/twin.jpg']['reason'])
        self.assertEqual(verdicts['sub/twin.jpg']['id'], verdicts['a.jpg']['id'])
        self.assertIn('8 rejected', err)
        for name in good:
            self.assertEqual(ask('show', db, name)['image'], name)
        self.assertEqual(must('verify', db), 'sound\n')

        digest = must('digest', db)
        code, again, _ = add(db, folder)
        self.assertEqual(code, 1)
        self.assertEqual({line['image']: line['verdict'] for line in again},
                         {name: 'rejected' if name in bad else 'duplicate' for name in verdicts})
        self.assertEqual(must('digest', db), digest)
        code, again, _ = add(db, os.path.join(folder, 'sub'))
        self.assertEqual((code, [line['verdict'] for line in again]), (0, ['duplicate'] * 2))
        self.check_export_has_whole_lines(db)

    def check_export_has_whole_lines(self, db):
        must('export', db, at('exported everything'))
        posed = []
        for model in os.listdir(at('exported everything')):
            with open(at('exported everything', model, 'images.txt'), errors='replace') as file:
                posed += file.read().split('\n')[2:-1:2]
        self.assertEqual(len(posed), ask('status', db)['placed'])
        names = [line.split(' ', 9)[9] for line in posed]
        self.assertIn('d%20line%0Abreak.jpg', names)
        for name in names:
            self.assertNotIn(' ', name, 'COLMAP reads a name up to the first space')
            self.assertIn(ask('show', db, unquote(name))['verdict'], PLACED)

    def test_a_rejected_photo_may_come_again_mended(self):
        db = new_database('mended')
        write(at('mending', 'x.jpg'), photo(1)[:700])
        code, lines, _ = add(db, at('mending'))
        self.assertEqual((code, lines[0]['verdict']), (1, 'rejected'))
        write(at('mending', 'x.jpg'), photo(1))
        code, lines, _ = add(db, at('mending'))
        self.assertEqual((code, lines[0]['verdict'], lines[0]['id']), (0, 'postponed', 1))
        # Another photo under the name of a stored one is refused, and its bytes stay welcome under
        # another name, also where both are under way at once.
        write(at('other', 'x.jpg'), photo(2))
        write(at('other', 'y.jpg'), photo(2))
        code, lines, _ = add(db, at('other'))
        self.assertEqual((code, [line['verdict'] for line in lines]),
                         (1, ['rejected', 'postponed']))
        self.assertEqual((lines[0]['id'], lines[1]['id']), (None, 2))
        self.assertIn('the name is taken', lines[0]['reason'])
        self.assertEqual(must('verify', db), 'sound\n')
        self.assertEqual(ask('status', db)['images'], 2)

    def test_contributors_name_their_photos_each_for_themselves(self):
        db = new_database('namesakes')
        for number, who in ((1, 'anna'), (2, 'bert')):
            write(at('of ' + who, 'x.jpg'), photo(number))
            added = ask('add', db, '--camera', 'c', '--contributor', who, at('of ' + who))
            self.assertEqual(added['id'], number)
        self.assertEqual(must('verify', db), 'sound\n')
        for command in (('show',), ('pose',), ('neighbors',), ('remove',), ('forbid', '--pose')):
            self.refused(1, "#1 is 'anna/x.jpg', #2 is 'bert/x.jpg'", command[0], db, 'x.jpg',
                         *command[1:])
        sha256 = hashlib.sha256(photo(2)).hexdigest()
        for text in ('bert/x.jpg', '#2', sha256, sha256[:8].upper()):
            shown = ask('show', db, text)
            self.assertEqual((shown['id'], shown['contributor'], shown['sha256']),
                             (2, 'bert', sha256))
        self.refused(1, "there is no image 'carl/x.jpg'", 'show', db, 'carl/x.jpg')
        must('remove', db, 'anna/x.jpg')
        self.assertEqual(ask('show', db, 'x.jpg')['id'], 2)
        self.assertEqual(must('verify', db), 'sound\n')

    def test_large_photos_need_no_more_memory_than_there_is(self):
        bytes_max = 3 << 29  # 1.5 GB

        def limited(*command):
            return subprocess.run(command, capture_output=True, preexec_fn=lambda: setrlimit(
                RLIMIT_AS, (bytes_max, bytes_max)))
        if limited(VEDUTA, '--version').returncode != 0:
            self.skipTest('a sanitizer needs more addresses')
        db = at('large.db')
        must('init', db)
        must('camera', 'add', db, 'c', '--size', '12240x8160', '--params', '11000,11000,6119,4079')
        for number in range(3):
            write(at('large', f'{number}.png'), black_png(12240, 8160, b'%d' % number))
        done = limited(VEDUTA, 'add', db, '--camera', 'c', '--threads', '8', '--json', at('large'))
        verdicts = [json.loads(line)['verdict'] for line in done.stdout.splitlines()]
        self.assertEqual(verdicts, 3 * ['rejected'], done.stdout)

    def test_the_digest_knows_neither_the_user_nor_the_folder(self):
        digests = set()
        for user in 'anna', 'bela':
            folder = at(f'photos of {user}')
            for number in 1, 2:
                write(os.path.join(folder, f'photo{number}.jpg'), photo(number))
            write(os.path.join(folder, 'broken.jpg'), photo(3)[:700])
            write(os.path.join(folder, 'empty.jpg'), b'')
            with open(at(f'list of {user}'), 'w') as file:
                file.write('photo1.jpg\nbroken.jpg\nempty.jpg\nabsent.jpg\nphoto2.jpg\n')
            db = new_database(f'city of {user}')
            done = subprocess.run([VEDUTA, 'add', db, '--camera', 'c', folder, '--list',
                                   at(f'list of {user}')], capture_output=True,
                                  env={**os.environ, 'USER': user})
            self.assertEqual(done.returncode, 1)
            self.assertIn(b'failed', done.stdout)
            self.assertEqual(ask('show', db, 'photo1.jpg')['contributor'], 'anonymous')
            digests.add(must('digest', db))
        self.assertEqual(len(digests), 1)

    def test_lists(self):
        db = new_database('listed')
        must('camera', 'add', db, 'other', '--size', '600x384', '--params', PARAMS)
        with open(at('list'), 'w') as file:
            file.write('# in this order\nphoto0003.jpg\r\nphoto0001.jpg\tc\n\n./photo0002.jpg\n'
                       'photo0004.jpg\tother\nphoto0099.jpg\n')
        code, lines, _ = add(db, PHOTOS, '--list', at('list'))
        self.assertEqual(code, 1)
        self.assertEqual([line['image'] for line in lines],
                         ['photo0003.jpg', 'photo0001.jpg', 'photo0002.jpg', 'photo0004.jpg',
                          'photo0099.jpg'])
        self.assertIn('not the size of its camera', lines[3]['reason'])
        self.assertIn('No such file', lines[4]['reason'])
        self.assertEqual((lines[4]['verdict'], lines[4]['id']), ('failed', None))
        self.assertEqual(ask('status', db)['images'], 4, 'an absent file is not stored')
        with open(at('absolute'), 'w') as file:
            file.write(f'{PHOTOS}/photo0002.jpg\n{at("street")}/camera.txt\n')
        code, lines, _ = add(db, '--list', at('absolute'))
        self.assertEqual([(line['image'], line['verdict']) for line in lines],
                         [('photos/photo0002.jpg', 'duplicate'), ('camera.txt', 'rejected')])
        with open(at('absolute'), 'a') as file:
            file.write('photo0005.jpg\tunknown\n')
        digest = must('digest', db)
        self.refused(1, "no camera 'unknown'", *add_command(db, '--list', at('absolute')))
        self.refused(1, 'cannot read', *add_command(db, '--list', at('no list')))
        self.refused(1, 'is a folder', *add_command(db, '--list', PHOTOS))
        self.refused(1, 'no file or folder', *add_command(db, PHOTOS, at('no folder')))
        self.assertEqual(must('digest', db), digest)

    def test_plain_output_has_a_line_a_photo(self):
        code, out, err = run('add', new_database('plain'), '--camera', 'c', '--contributor',
                             'anna', PHOTOS)
        self.assertEqual(code, 0)
        self.assertEqual(must('digest', at('plain')), WHOLE_DIGEST)
        name_of = {whole['id']: whole['image'] for whole in WHOLE_LINES}
        expected = []
        for whole in WHOLE_LINES:
            expected.append(f'{whole["verdict"]:10} {whole["image"]}: {whole["reason"]}')
            expected += [f'  then     {name_of[id]}: ' for id in whole['propagated']]
        self.assertTrue(any(line.startswith('  then') for line in expected))
        for line, start in zip(out.splitlines(), expected, strict=True):
            self.assertTrue(line.startswith(start), f'{line!r}, not {start!r}')
        self.assertRegex(err, r'12 of 12 photos, .* a second')


if __name__ == '__main__':
    main()
