#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: `veduta markers` writes sheets that a printer takes, and says what it cannot do.
# Method: the built binary; PDFs looked at from outside; wrong arguments and a folder that is not there.
# usage: tests/cli/markers_test.py VEDUTA
import os
import re
import subprocess
import sys
import tempfile
import unittest


def markers(*arguments):
    return subprocess.run([VEDUTA, 'markers', *arguments], capture_output=True, text=True, check=False)


class Markers(unittest.TestCase):
    def test_sheets_are_written(self):
        with tempfile.TemporaryDirectory() as folder:
            for paper, count, sheets, box in (('a4', 96, 16, (595, 842)), ('letter', 178, 30, (612, 792))):
                path = os.path.join(folder, paper + '.pdf')
                done = markers('--out', path, '--paper', paper, '--count', str(count))
                self.assertEqual((done.returncode, done.stderr), (0, ''))
                self.assertIn(f'{count} markers on {sheets} sheets', done.stdout)
                with open(path, 'rb') as file:
                    pdf = file.read().decode('latin-1')
                self.assertTrue(pdf.startswith('%PDF-'))
                self.assertIn(f'/Count {sheets}', pdf)
                media = re.search(r'/MediaBox \[ *0 0 ([\d.]+) ([\d.]+)', pdf)
                self.assertEqual(tuple(round(float(side)) for side in media.groups()), box)

    def test_what_cannot_be_done_is_said(self):
        for code, words, arguments in (
                (2, '--out', ()), (2, '--count', ('--out', 'x.pdf', '--count', '179')),
                (2, '--count', ('--out', 'x.pdf', '--count', '0')), (2, '--paper', ('--out', 'x.pdf', '--paper', 'a5')),
                (1, 'cannot write', ('--out', os.path.join(os.devnull, 'x.pdf')))):
            done = markers(*arguments)
            self.assertEqual(done.returncode, code, arguments)
            self.assertIn(words, done.stderr + done.stdout)


if __name__ == '__main__':
    VEDUTA = sys.argv.pop(1)
    unittest.main()
