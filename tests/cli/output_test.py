#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: standard output carries results and tells by the exit code when it could not; nothing that a
#   terminal would act on gets out of a name.
# Method: real processes that write to the device that is always full, to a closed descriptor, and
#   photos with control characters in their names.
# usage: tests/cli/output_test.py VEDUTA VEDUTA_STREET [TEST...]
import os
import re
import subprocess
import unittest

from city import (PHOTOS, VEDUTA, WHOLE, Case, add_command, ask, at, main, make_whole, must,
                  new_database, photo, run, write)

# What a terminal acts on: C0 without the line's end, DEL, and C1, which it takes in UTF-8 too.
CONTROL = re.compile(r'[\x00-\x09\x0b-\x1f\x7f-\x9f]')
# Name -> how a person sees it.
NAMES = {b'bell\x07.jpg': r'bell\x07.jpg', b'caf\xe9.jpg': r'caf\xe9.jpg',
         b'csi\xc2\x9b31m.jpg': r'csi\xc2\x9b31m.jpg', 'gut é中.jpg'.encode(): 'gut é中.jpg',
         b'line\nbreak.jpg': r'line\nbreak.jpg', b'red\x1b[31m.jpg': r'red\x1b[31m.jpg',
         b'tab\there.jpg': r'tab\there.jpg'}


def setUpModule():
    make_whole()


class Full(Case):
    COMMANDS = (('digest', WHOLE), ('digest', WHOLE, '--json'), ('status', WHOLE),
                ('status', WHOLE, '--json'), ('journal', WHOLE), ('show', WHOLE, '#1'),
                ('show', WHOLE, '#1', '--json'), ('pose', WHOLE, '#6'),
                ('pose', WHOLE, '#6', '--json'), ('neighbors', WHOLE, '#1'),
                ('neighbors', WHOLE, '#1', '--json'), ('camera', 'list', WHOLE),
                ('camera', 'list', WHOLE, '--json'), ('verify', WHOLE), ('verify', WHOLE, '--json'),
                ('devices', '--json'), ('--help',),
                ('--version',), add_command(WHOLE, PHOTOS))

    @unittest.skipUnless(os.path.exists('/dev/full'), 'no device that is always full here')
    def test_a_full_disk_is_told(self):
        for command in self.COMMANDS:
            with open('/dev/full', 'wb') as full:
                done = subprocess.run([VEDUTA, *command], stdout=full, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 1, command)
            self.assertIn(b'cannot write to standard output: No space left', done.stderr)

    def test_a_closed_descriptor_is_told(self):
        for command in self.COMMANDS:
            done = subprocess.run(['sh', '-c', '"$@" >&-', 'sh', VEDUTA, *command],
                                  stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, 1, command)
            self.assertIn(b'cannot write to standard output', done.stderr)
        self.assertEqual(must('verify', WHOLE), 'sound\n')

    def test_what_is_done_is_done_all_the_same(self):
        db = new_database('unheard')
        with open('/dev/full', 'wb') as full:
            done = subprocess.run([VEDUTA, *add_command(db, PHOTOS)], stdout=full,
                                  stderr=subprocess.PIPE)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(must('digest', db), must('digest', WHOLE))

    def test_standard_error_may_be_closed(self):
        done = subprocess.run(['sh', '-c', '"$@" 2>&-', 'sh', VEDUTA, 'digest', WHOLE],
                              stdout=subprocess.PIPE)
        self.assertEqual((done.returncode, done.stdout.decode()), (0, must('digest', WHOLE)))


class Names(Case):
    def check_safe(self, text):
        self.assertNotRegex(text, CONTROL)

    def test_no_control_character_gets_out(self):
        folder, db = os.fsencode(at('names')), new_database('of names')
        for number, name in enumerate(sorted(NAMES), 1):
            write(os.path.join(folder, name), photo(number))
        code, out, err = run('add', db, '--camera', 'c', os.fsdecode(folder))
        self.assertEqual(code, 0, err)
        lines = [line for line in out.splitlines() if not line.startswith('  then')]
        for line, name in zip(lines, sorted(NAMES), strict=True):
            self.check_safe(line)
            self.assertIn(f' {NAMES[name]}: ', line)
        for name in sorted(NAMES):
            stored = os.fsdecode(name)
            shown = must('show', db, stored)
            self.assertTrue(shown.startswith(NAMES[name] + ' (#'), shown)
            self.check_safe(shown + must('neighbors', db, stored))
            code, out, err = run('pose', db, stored)
            self.check_safe(out + err)
            # JSON keeps the name: only what is not UTF-8 is replaced.
            self.assertEqual(ask('show', db, stored)['image'], name.decode(errors='replace'))
            self.check_safe(must('show', db, stored, '--json'))
            code, out, err = run('show', db, stored + '\x1b[2J')
            self.assertEqual((code, out), (1, ''))
            self.check_safe(err)
            self.assertIn(NAMES[name] + r'\x1b[2J', err)

    def test_complaints_about_the_command_line_are_safe(self):
        code, out, err = run('status', 'db', '--x\x1b[2J')
        self.assertEqual((code, out), (2, ''))
        self.check_safe(err)
        self.assertIn(r'--x\x1b[2J', err)

    def test_other_text_is_safe_too(self):
        db, name = at('odd camera'), 'lens'
        must('init', db)
        size = ('--size', '512x384', '--params=450,450,255,191')
        self.refused(1, 'control characters', 'camera', 'add', db, 'lens\x1b[31m\n', *size)
        must('camera', 'add', db, name, *size)
        self.refused(1, r'le\x1b[31mns', 'add', db, '--camera', 'le\x1b[31mns', PHOTOS)
        write(at('twin', 'a\x1b[31m.jpg'), photo(1))
        write(at('twin', 'b.jpg'), photo(1))
        code, out, _ = run('add', db, '--camera', name, at('twin'))
        self.assertEqual(code, 0)
        self.check_safe(out)
        _, again, _ = run('add', db, '--camera', name, at('twin'))
        self.check_safe(again)  # a duplicate's reason names the other photo
        self.assertIn(r'a\x1b[31m.jpg', again.splitlines()[1])


class Pipes(Case):
    def test_nobody_waits_for_a_pipe(self):
        db, pipe = new_database('pipes'), at('pipe')
        os.mkfifo(pipe)
        for command in (('camera', 'add', db, 'b', '--from', pipe),
                        ('vocabulary', 'import', db, pipe), add_command(db, '--list', pipe),
                        ('calibrate', '--points', pipe, '--out', at('never.json'))):
            done = subprocess.run([VEDUTA, *command], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, timeout=60)
            self.assertEqual(done.returncode, 1, command)
            self.assertIn(b'is a pipe, not a file', done.stderr)
        for path in ('/dev/zero', '/dev/full'):
            self.refused(1, 'is a device, not a file', 'camera', 'add', db, 'b', '--from', path)
        write(at('mixed', 'a.jpg'), photo(1))
        os.mkfifo(at('mixed', 'p.jpg'))
        os.symlink('circle.jpg', at('mixed', 'circle.jpg'))
        code, out, err = run(*add_command(db, at('mixed')))
        self.assertEqual((code, len(out.splitlines())), (0, 1))
        self.assertIn('circle.jpg is passed over', err)
        self.assertIn('p.jpg is passed over: it is no file', err)


if __name__ == '__main__':
    main()
