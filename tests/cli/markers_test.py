#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: `veduta markers` writes sheets that a printer takes, and `veduta calibrate` takes photos of
#   them; both say what they cannot do, and which photo is not sharp.
# Method: the built binary; PDFs looked at from outside; wrong arguments and a folder that is not
#   there; rendered photos, one of them out of focus and one of a single marker.
# usage: tests/cli/markers_test.py VEDUTA VEDUTA_FLOOR
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest


def markers(*arguments):
    return subprocess.run([VEDUTA, 'markers', *arguments], capture_output=True, text=True,
                          check=False)


class Markers(unittest.TestCase):
    def test_sheets_are_written(self):
        with tempfile.TemporaryDirectory() as folder:
            for paper, count, sheets, box in (('a4', 96, 16, (595, 842)),
                                              ('letter', 178, 30, (612, 792))):
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
                (2, '--count', ('--out', 'x.pdf', '--count', '0')),
                (2, '--paper', ('--out', 'x.pdf', '--paper', 'a5')),
                (1, 'cannot write', ('--out', os.path.join(os.devnull, 'x.pdf')))):
            done = markers(*arguments)
            self.assertEqual(done.returncode, code, arguments)
            self.assertIn(words, done.stderr + done.stdout)


class Photos(unittest.TestCase):
    def test_camera_from_photos(self):
        with tempfile.TemporaryDirectory() as folder:
            def render(name, photos, markers, *more):
                subprocess.run([FLOOR, os.path.join(folder, name), '--photos', photos, '--size',
                                '800x600', '--markers',
                                markers, '--floor', 'plain', '--quiet', *more], check=True,
                                stdout=subprocess.DEVNULL)
                return os.path.join(folder, name, 'photos')

            photos = render('sharp', '9', '24')
            blurred, poor = 'photo0003.jpg', 'photo0007.jpg'
            shutil.copy(os.path.join(render('blurred', '9', '24', '--blur', '3'), blurred), photos)
            shutil.copy(os.path.join(render('one', '1', '1'), 'photo0001.jpg'),
                        os.path.join(photos, poor))
            camera, report = os.path.join(folder, 'camera.json'), os.path.join(folder,
                                                                               'report.html')
            done = subprocess.run([VEDUTA, 'calibrate', photos, '--out', camera, '--report',
                                   report],
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(camera, encoding='utf-8') as file, open(report,
                                                              encoding='utf-8') as file_of_report:
                made, page = json.load(file), file_of_report.read()
            for words in (blurred + ': it is out of focus or moved', poor
                          + ': only 1 marker found'):
                self.assertIn(words, done.stderr)
                self.assertIn(words, page)
                self.assertTrue(any(words in note for note in made['calibration']['notes']), made)
            self.assertEqual(done.stderr.count('focus or moved'), 1,
                             'sharp photos get no such note')
            self.assertEqual(made['calibration']['photos_used'], 8)
            self.assertAlmostEqual(made['intrinsics']['fx'] / (0.9 * 800), 1, delta=0.003)


if __name__ == '__main__':
    VEDUTA, FLOOR = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
