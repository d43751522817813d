#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what is removed is gone: no command finds it, no file of the database has 64 bytes in a row
#   of it, `verify` is content, the rest is a city as before, and a removal that is killed is
#   finished by the next one, with the same digest. What people forbid is kept, obeyed, listed and
#   taken back.
# Method: photos of a rendered street in copies of one database; every file is searched for every
#   window of the removed photos that no other photo has (JPEG files share their tables), before
#   the removal too, where it must be found.
# usage: tests/cli/remove_test.py VEDUTA VEDUTA_STREET [TEST...]
import json
import os
import random
import shutil
import subprocess

from city import (PHOTOS, VEDUTA, WHOLE, Case, add, ask, at, main, make_whole, must, new_database,
                  read, run, write)

WINDOW, HALF = 64, 32
NAMES = [f'photo{number:04}.jpg' for number in range(1, 13)]


def setUpModule():
    make_whole()
    assert ask('status', WHOLE)['placed'] >= 9, 'most of the street is placed'


def copy_of_whole(name):
    shutil.copytree(WHOLE, at(name))
    return at(name)


def windows_of(removed, kept):
    """All windows of the removed files' bytes that no kept file has."""
    def all_of(names):
        for data in (read(os.path.join(PHOTOS, name)) for name in names):
            for i in range(len(data) - WINDOW + 1):
                yield data[i:i + WINDOW]
    return set(all_of(removed)) - set(all_of(kept))


def files_with(windows, folder):
    """The files that have a window: one of its halves or the middle lies on a multiple of 32."""
    starts = {window[i:i + HALF] for window in windows for i in range(HALF + 1)}
    found = set()
    for root, _, names in os.walk(folder):
        for name in names:
            data = read(os.path.join(root, name))
            for block in range(0, len(data), HALF):
                if data[block:block + HALF] in starts and any(
                        data[i:i + WINDOW] in windows
                        for i in range(max(0, block - HALF), block + 1)):
                    found.add(name)
                    break
    return found


class Remove(Case):
    def expect_gone(self, db, removed):
        self.assertEqual(must('verify', db, '--deep').strip().splitlines()[-1:],
                         must('verify', WHOLE, '--deep').strip().splitlines()[-1:])
        kept = [name for name in NAMES if name not in removed]
        self.assertEqual(files_with(windows_of(removed, kept), db), set())
        for name in removed:
            self.refused(1, name, 'show', db, name)
        for name in kept:
            self.assertEqual(ask('show', db, name)['image'], name)
        self.assertEqual(ask('status', db)['images'], len(kept))
        for number in ask('status', db)['reconstructions']:
            self.assertGreaterEqual(number['images'], 3)

    def test_one(self):
        db, name = copy_of_whole('one'), 'photo0006.jpg'
        shown = ask('show', db, name)
        before = files_with(windows_of([name], [n for n in NAMES if n != name]), db)
        self.assertTrue(before, 'the search finds what is there')
        answer = json.loads(must('remove', db, name, '--by', 'bea', '--why', 'my door', '--json'))
        self.assertEqual([r['image'] for r in answer['removed']], [name])
        self.assertEqual(answer['removed'][0]['observations'], shown['observations'])
        self.assertTrue(answer['purged'])
        self.expect_gone(db, [name])
        entries = [json.loads(line) for line in must('journal', db).splitlines()]
        entry = next(e for e in entries if e['action'] == 'remove')
        self.assertEqual((entry['actor'], entry['detail'], entry['image']),
                         ('bea', 'my door', shown['id']))
        self.assertNotIn(name, must('journal', db), 'the journal has numbers alone')
        self.assertNotIn(shown['sha256'], must('journal', db))
        placed = [ask('show', db, n)['verdict'] for n in NAMES if n != name]
        self.assertGreaterEqual(sum(v in ('placed', 'merged', 'founded') for v in placed), 6)

    def test_all_of_a_contributor(self):
        db = new_database('two people')
        for who, numbers in (('anna', (1, 2, 3, 4, 5, 6, 7, 8)), ('ben', (9, 10, 11, 12))):
            paths = [os.path.join(PHOTOS, NAMES[n - 1]) for n in numbers]
            must('add', db, '--camera', 'c', '--threads', '2', '--contributor', who, *paths)
        out = must('remove', db, '--contributor', 'ben')
        self.assertEqual(out.count('removed '), 4 + 1, out)
        self.expect_gone(db, NAMES[8:])
        self.refused(1, "no photo of 'nobody'", 'remove', db, '--contributor', 'nobody')

    def test_all(self):
        db = copy_of_whole('all')
        must('remove', db, *NAMES)
        self.assertEqual(ask('status', db)['images'], 0)
        self.assertEqual(ask('status', db)['reconstructions'], [])
        must('verify', db)
        self.assertEqual(files_with(windows_of(NAMES, []), db), set())
        self.assertTrue(ask('repair', db)['sound'])
        code, lines, err = add(db, os.path.join(PHOTOS, NAMES[0]))
        self.assertEqual((code, lines[0]['id']), (0, 13), err)

    def test_again_under_a_new_number(self):
        db, name = copy_of_whole('again'), 'photo0005.jpg'
        must('remove', db, name, 'photo0004.jpg')
        code, lines, err = add(db, os.path.join(PHOTOS, name))
        self.assertEqual(code, 0, err)
        self.assertEqual(lines[0]['id'], 13)
        must('verify', db, '--deep')

    def test_what_was_not_placed(self):
        db = new_database('not placed')
        add(db, os.path.join(PHOTOS, NAMES[0]))
        write(at('odd', 'odd.jpg'), b'no photo')
        add(db, at('odd'))
        self.assertEqual([ask('show', db, name)['verdict'] for name in (NAMES[0], 'odd.jpg')],
                         ['postponed', 'rejected'])
        must('remove', db, NAMES[0], '#2')
        self.assertEqual(ask('status', db)['images'], 0)
        must('verify', db)
        self.assertEqual(files_with(windows_of(NAMES[:1], []), db), set())

    def test_nothing_is_removed_where_a_name_is_wrong(self):
        db = copy_of_whole('wrong')
        self.refused(1, 'nonsense.jpg', 'remove', db, NAMES[0], 'nonsense.jpg')
        self.refused(2, '--contributor', 'remove', db, NAMES[0], '--contributor', 'anna')
        self.assertEqual(must('digest', db), must('digest', WHOLE))

    def test_copies_are_named(self):
        db = copy_of_whole('copied')
        must('copy', db, at('copy of it'))
        answer = json.loads(must('remove', db, NAMES[0], '--json'))
        self.assertEqual(answer['copies'], [at('copy of it')])
        self.assertEqual(ask('show', at('copy of it'), NAMES[0])['image'], NAMES[0])

    def test_surface(self):
        db = copy_of_whole('surface')
        densify = ('densify', db, '--size', '160', '--device', 'cpp')
        must(*densify)
        tiles = sum(r['tiles'] for r in ask('status', db)['reconstructions'])
        self.assertGreater(tiles, 0)
        answer = json.loads(must('remove', db, 'photo0006.jpg', '--json'))
        self.assertTrue(answer['removed'][0]['was_dense'])
        must('verify', db)
        left = sum(r['tiles'] for r in ask('status', db)['reconstructions'])
        self.assertLess(left, tiles)
        must(*densify)
        must('verify', db)
        self.assertGreater(sum(r['tiles'] for r in ask('status', db)['reconstructions']), left)

    def test_killed(self):
        removed = NAMES[2:6]
        timer = random.Random(7)
        never_killed = copy_of_whole('never killed')
        must('remove', never_killed, *removed, '--threads', '2')
        digest = must('digest', never_killed)
        for attempt in range(int(os.environ.get('KILLS', '4'))):
            db = copy_of_whole(f'killed {attempt}')
            process = subprocess.Popen([VEDUTA, 'remove', db, *removed, '--threads', '1'],
                                       stdout=subprocess.DEVNULL)
            try:
                process.wait(timer.uniform(0.02, 1.2))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            must('verify', db)
            left = [name for name in removed if run('show', db, name)[0] == 0]
            must('remove', db, *left)
            self.expect_gone(db, removed)
            self.assertEqual(must('digest', db), digest)
            shutil.rmtree(db)

    def test_of_an_image_that_repair_knows(self):
        db = copy_of_whole('repaired')
        must('remove', db, NAMES[3])
        self.assertTrue(ask('repair', db)['sound'])


class Forbid(Case):
    def test_a_pair(self):
        db = copy_of_whole('pair')
        other = ask('show', db, NAMES[4])['neighbors'][0]['image']
        must('forbid', db, NAMES[4], other, '--by', 'bea', '--reason', 'two towers')
        self.assertNotIn(other, [n['image'] for n in ask('show', db, NAMES[4])['neighbors']])
        must('verify', db)
        listed = ask('forbidden', db)
        self.assertEqual(len(listed), 1)
        self.assertEqual({listed[0]['image_a'], listed[0]['image_b']}, {NAMES[4], other})
        self.assertEqual((listed[0]['kind'], listed[0]['actor'], listed[0]['reason']),
                         ('pair', 'bea', 'two towers'))
        must('forbid', db, other, NAMES[4])  # once more changes nothing
        self.assertEqual(ask('forbidden', db), listed)
        self.assertIn('do not show the same place', must('forbidden', db))
        must('allow', db, other, NAMES[4])
        self.assertEqual(ask('forbidden', db), [])
        self.refused(1, 'not forbidden', 'allow', db, other, NAMES[4])
        actions = [json.loads(line)['action'] for line in must('journal', db).splitlines()]
        self.assertEqual(actions[-2:], ['forbid', 'allow'])

    def test_goes_with_a_removed_photo(self):
        db = copy_of_whole('pair and removal')
        must('forbid', db, NAMES[0], NAMES[11])
        must('remove', db, NAMES[0])
        self.assertEqual(ask('forbidden', db), [])
        must('verify', db)

    def test_a_pose(self):
        db = copy_of_whole('pose')
        name = next(n for n in NAMES if ask('show', db, n)['reconstruction'] is not None)
        must('forbid', db, name, '--pose', '--by', 'bea', '--reason', 'the other tower')
        self.refused(1, 'no pose', 'pose', db, name)
        shown = ask('show', db, name)
        self.assertEqual(shown['verdict'], 'postponed')
        self.assertIn('somebody has forbidden that it has a pose', shown['reason'])
        must('settle', db)
        must('verify', db)
        self.refused(1, 'no pose', 'pose', db, name)
        listed = ask('forbidden', db)
        self.assertEqual([(f['kind'], f['a'], f['b'], f['image_a'], f['image_b']) for f in listed],
                         [('pose', shown['id'], None, name, None)])
        self.assertEqual(must('forbidden', db),
                         f'{name} (#{shown["id"]}) has no pose (bea: the other tower)\n')
        must('allow', db, name, '--pose')
        must('settle', db)
        must('pose', db, name)
        must('verify', db)
        self.assertEqual(ask('forbidden', db), [])
        self.refused(1, 'is not forbidden', 'allow', db, name, '--pose')

    def test_what_makes_no_sense(self):
        db = copy_of_whole('no sense')
        self.refused(2, 'one too many', 'forbid', db, NAMES[0], NAMES[1], '--pose')
        self.refused(2, 'only one', 'forbid', db, NAMES[0])
        self.refused(2, '', 'forbid', db, '1', '--pose', '--reconstructions')
        self.refused(1, 'itself', 'forbid', db, NAMES[0], NAMES[0])
        self.refused(1, 'nobody.jpg', 'forbid', db, NAMES[0], 'nobody.jpg')
        self.refused(1, 'are one already', 'forbid', db, '1', '1', '--reconstructions')
        self.refused(1, 'no number', 'forbid', db, 'one', '2', '--reconstructions')


if __name__ == '__main__':
    main()
