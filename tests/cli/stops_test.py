#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: Ctrl-C loses nothing, a second writer is sent away, readers are not, and damage is told by
#   exit code 3.
# Method: real processes. Where two must meet, one is held by a pipe that is full, so nothing
#   depends on time.
# usage: tests/cli/stops_test.py VEDUTA VEDUTA_STREET
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import unittest

from city import (PARAMS, PHOTOS, SIZE, VEDUTA, WHOLE, Case, add, add_command, ask, at, main,
                  make_whole, must, new_database, run)


def setUpModule():
    global WHOLE_DIGEST
    _, WHOLE_DIGEST = make_whole()


class HeldAdd:
    """An `add` that stands still once the pipe it writes to is full: it holds the database and has
    photos left."""

    def __init__(self, db):
        out, pipe = os.pipe()
        # A pipe of 4096 bytes takes fewer lines than there are photos.
        if fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, 4096) > 4096:
            raise unittest.SkipTest('no pipe as small as 4096 bytes here')
        self.process = subprocess.Popen([VEDUTA, *add_command(db, PHOTOS)], stdout=pipe,
                                        stderr=subprocess.PIPE)
        os.close(pipe)
        self.out = os.fdopen(out, 'rb', buffering=0)  # takes no more than the line it reads
        self.first = json.loads(self.out.readline())

    def interrupt(self):
        """Returns when the process has said that it knows."""
        self.process.send_signal(signal.SIGINT)
        while b'finishing the photo at hand' not in self.process.stderr.readline():
            assert self.process.poll() is None, 'it ended without a word'

    def finish(self):
        """Exit code, lines, the rest of standard error."""
        lines = [self.first, *(json.loads(line) for line in self.out)]
        err = self.process.stderr.read().decode()
        self.process.stderr.close()
        self.out.close()
        return self.process.wait(), lines, err


class Stops(Case):
    def check_going_on(self, db, acknowledged):
        """Everything acknowledged is there, the database is sound, and the same command completes
        the same city."""
        self.assertEqual(must('verify', db), 'sound\n')
        for line in acknowledged:
            self.assertEqual(ask('show', db, line['image'])['id'], line['id'])
        code, lines, _ = add(db, PHOTOS)
        self.assertEqual((code, len(lines)), (0, 12))
        for line in lines[:len(acknowledged)]:
            self.assertEqual(line['verdict'], 'duplicate')
        self.assertEqual(must('digest', db), WHOLE_DIGEST)

    def test_interrupt_finishes_the_photo_and_stops(self):
        db = new_database('interrupted')
        held = HeldAdd(db)
        held.interrupt()
        code, lines, err = held.finish()
        self.assertEqual(code, 1)
        self.assertRegex(err, r'stopped after \d+ of 12 photos; run the same command again')
        self.assertLess(len(lines), 12)
        self.assertEqual(ask('status', db)['images'], len(lines))  # what was finished was told
        self.check_going_on(db, lines)

    def test_second_interrupt_ends_at_once(self):
        db = new_database('interrupted twice')
        held = HeldAdd(db)
        held.interrupt()
        held.process.send_signal(signal.SIGINT)
        self.assertEqual(held.process.wait(), 130)
        self.check_going_on(db, held.finish()[1])

    def test_one_writer_many_readers(self):
        db = new_database('shared')
        held = HeldAdd(db)
        try:
            for command in (add_command(db, PHOTOS), ('camera', 'add', db, 'd', '--size', SIZE,
                                                      '--params', PARAMS),
                            ('vocabulary', 'train', db)):
                self.refused(3, 'in use by another veduta process', *command)
            self.assertGreaterEqual(ask('status', db)['images'], 1)
            self.assertEqual(ask('show', db, held.first['image'])['id'], held.first['id'])
            ask('neighbors', db, held.first['image'])
            must('digest', db)
            self.assertEqual(must('verify', db), 'sound\n')
        finally:
            code, lines, _ = held.finish()
        self.assertEqual((code, len(lines)), (0, 12))
        self.assertEqual(must('digest', db), WHOLE_DIGEST)

    def test_damage_is_3(self):
        damaged = 0
        for name in sorted(os.listdir(WHOLE)):
            kind = re.match(r'MANIFEST|CURRENT|.*\.(sst|blob)$', name)
            if not kind:
                continue
            db = at('damaged')
            shutil.copytree(WHOLE, db)
            size = os.path.getsize(os.path.join(db, name))
            os.truncate(os.path.join(db, name), size // 2)
            code, out, err = run('verify', db)
            self.assertEqual(code, 3, f'{name} cut to {size // 2} of {size} bytes: {out}{err}')
            self.assertTrue(out.strip() or err.strip())
            damaged += 1
            shutil.rmtree(db)
        self.assertGreater(damaged, 4)


if __name__ == '__main__':
    main()
