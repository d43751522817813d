#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: settle, densify and vocabulary print the same and end alike whether or not a daemon has the
#   database open.
# Method: the same commands on two copies of one database, of which one has a daemon.
# usage: tests/cli/owner_beside_test.py VEDUTA VEDUTA_STREET
import json
import os
import re
import shutil

from city import PHOTO_COUNT, WHOLE, Case, at, main, make_whole, must, new_database, photo, run
from daemon import Daemon


def setUpModule():
    make_whole()


def copy_of_whole(name):
    return shutil.copytree(WHOLE, at(name))


def without_times(text):
    return re.sub(r'"ms":[0-9.e+-]+|[0-9.]+ s$', '', text, flags=re.MULTILINE)


def without_progress(text):
    """How far a pass has come is told without a daemon alone."""
    return re.sub(r'^\d+ of \d+ .* left\n', '', text, flags=re.MULTILINE)


class Beside(Case):
    def same(self, beside, alone, *command):
        """The command does the same to both; what it printed."""
        told = [run(command[0], *command[1:-1], db, *command[-1]) for db in (beside, alone)]
        outputs = [(code, without_times(out), without_progress(err).replace(db, 'DB'))
                   for (code, out, err), db in zip(told, (beside, alone))]
        self.assertEqual(outputs[0], outputs[1], command)
        return told[0]

    def test_densify(self):
        beside, alone = copy_of_whole('dense beside'), copy_of_whole('dense alone')
        options = ('--size', '96', '--device', 'cpp')
        with Daemon(beside, '--dense', '--device', 'cpp') as daemon:
            self.assertEqual(daemon.ask('POST', '/v1/dense/pause')[0], 200)
            code, out, _ = self.same(beside, alone, 'densify', options)
            self.assertEqual(code, 0)
            self.assertIn('depth maps', out)
            self.assertEqual(self.same(beside, alone, 'densify', ('--json', *options))[0], 0)
            code, _, err = self.same(beside, alone, 'densify',
                                     ('--reconstruction', '99', *options))
            self.assertEqual(code, 1)
            self.assertIn('99', err)
            self.assertEqual(self.same(beside, alone, 'densify', ('--device', 'none such'))[0], 1)
            # Nothing is left to do, but it is looked at piece by piece.
            code, _, err = self.same(beside, alone, 'densify', ('--hours', '1e-9', *options))
            self.assertEqual(code, 1)
            self.assertIn('stopped after 1e-09 hours', err)
        self.assertEqual(must('digest', beside), must('digest', alone))
        self.assertEqual(must('verify', beside), 'sound\n')

    def test_vocabulary(self):
        beside, alone = copy_of_whole('words beside'), copy_of_whole('words alone')
        with Daemon(beside):
            shape = ('--branch', '4', '--levels', '3')
            self.assertEqual(self.same(beside, alone, 'vocabulary', 'train', shape)[0], 0)
            self.assertEqual(self.same(beside, alone, 'vocabulary', 'info', ())[0], 0)
            code, _, err = self.same(beside, alone, 'vocabulary', 'train', ('--branch', '65'))
            self.assertEqual(code, 1)
            self.assertIn('branch is 65, but must be', err)
            must('vocabulary', 'export', beside, at('tree'))
            # The daemon has another folder of its own: paths are made absolute.
            here = os.path.relpath(at('tree'))
            self.assertEqual(self.same(beside, alone, 'vocabulary', 'import', (here,))[0], 0)
            self.assertEqual(self.same(beside, alone, 'vocabulary', 'import',
                                       (at('no tree'),))[0], 1)
        self.assertEqual(must('digest', beside), must('digest', alone))

    def test_settle(self):
        db = new_database('settled')
        with Daemon(db) as daemon:
            self.assertEqual(must('settle', db), '')
            for n in range(1, PHOTO_COUNT + 1):
                self.assertEqual(daemon.send(f'photo{n:04}.jpg', photo(n), waits=False)[0], 202)
            told = must('settle', db)
            self.assertEqual(daemon.get('/v1/uploads'), [])
            self.assertEqual(daemon.get('/v1/status')['images'], PHOTO_COUNT)
            for line in told.splitlines():
                self.assertRegex(line, r'^(placed|postponed|founded|merged|done:|  then) *\S')
            self.assertEqual(must('settle', db, '--json'), '')
            code, _, err = run('settle', db, '--threads', '3')
            self.assertEqual((code, '--threads' in err), (0, True))
        self.assertEqual(must('settle', db), '')
        self.assertEqual(must('verify', db), 'sound\n')

    def test_settle_tells_what_follows(self):
        beside, alone = copy_of_whole('healed beside'), copy_of_whole('healed alone')
        for db in (beside, alone):
            must('forbid', db, 'photo0005.jpg', '--pose')
            must('settle', db)
            must('allow', db, 'photo0005.jpg', '--pose')
        with Daemon(beside):
            code, out, err = self.same(beside, alone, 'settle', ())
            self.assertEqual((code, err), (0, ''))
            self.assertIn('photo0005.jpg', out)
        self.assertEqual(must('digest', beside), must('digest', alone))
        told = json.loads(must('show', beside, 'photo0005.jpg', '--json'))
        self.assertEqual(told['verdict'], 'placed')


if __name__ == '__main__':
    main()
