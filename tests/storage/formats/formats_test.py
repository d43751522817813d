#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a database that an earlier veduta wrote is still good. A reader answers or says what to do,
#   the first writer brings the database to today's format, nothing is lost on the way, and the city
#   goes on growing.
# Method: fixtures that the binaries of their time wrote (make_fixture.sh says how). The digest and
#   the counts are compared with what the old binary said of its own database. The upgrade is killed
#   at random instants, as many times as KILLS says.
# usage: [KILLS=20] [SEED=1] tests/storage/formats/formats_test.py VEDUTA [TEST...]
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import unittest

if len(sys.argv) < 2:
    sys.exit(f'usage: {sys.argv[0]} VEDUTA [TEST...]')
VEDUTA = sys.argv[1]
HERE = os.path.dirname(os.path.abspath(__file__))
KILLS = int(os.environ.get('KILLS', '20'))
SEED = int(os.environ.get('SEED', '1'))
PLACED, POSTPONED, REJECTED = 'photo0019.jpg', 'photo0001.jpg', 'broken.jpg'
# Written ahead by an `add` that was killed, so it is not part of the city yet.
LATER = 'photo0020.jpg'
# Of `status`, these say the same before and after; the size in bytes does not.
COUNTS = ('images', 'placed', 'postponed', 'rejected', 'cameras', 'backlog',
          'vocabulary_generation')
RECONSTRUCTION_COUNTS = ('id', 'images', 'points', 'observations')


def run(*arguments):
    done = subprocess.run([VEDUTA, *arguments], capture_output=True)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def must(*arguments):
    code, out, err = run(*arguments)
    assert code == 0, f'{arguments} ended with {code}: {out}{err}'
    return out


def ask(*arguments):
    return json.loads(must(*arguments, '--json'))


class Fixture:
    """A copy of a stored database in a folder of its own, and what the old binary said of it."""

    def __init__(self, name):
        with open(os.path.join(HERE, name + '.json'), encoding='utf-8') as file:
            said = json.load(file)
        self.digest, self.status = said['digest'], said['status']
        self.folder = tempfile.mkdtemp(prefix='veduta_' + name + '_')
        with tarfile.open(os.path.join(HERE, name + '.tar.gz')) as archive:
            archive.extractall(self.folder)
        self.city = os.path.join(self.folder, 'city')
        self.later = os.path.join(self.folder, 'more', LATER)

    def copy(self, name):
        path = os.path.join(self.folder, name)
        shutil.copytree(self.city, path)
        return path

    def remove(self):
        shutil.rmtree(self.folder)


class Formats(unittest.TestCase):
    def fixture(self, name):
        fixture = Fixture(name)
        self.addCleanup(fixture.remove)
        return fixture

    def check_city(self, fixture, city):
        """The whole of the old city is there: its counts, what its digest covers, its verdicts."""
        self.assertEqual(must('verify', city), 'sound\n')
        self.check_counts(fixture, ask('status', city))
        self.assertEqual(must('digest', city).strip(), fixture.digest)
        for name in (PLACED, 'anna/' + PLACED):
            self.assertIn(ask('show', city, name)['verdict'], ('placed', 'founded'))
        self.assertEqual(ask('show', city, POSTPONED)['verdict'], 'postponed')
        self.assertEqual(ask('show', city, REJECTED)['verdict'], 'rejected')
        self.assertEqual(run('show', city, LATER)[0], 1)

    def check_counts(self, fixture, status):
        for name in COUNTS:
            self.assertEqual(status[name], fixture.status[name], name)
        self.assertEqual(len(status['reconstructions']), len(fixture.status['reconstructions']))
        for now, then in zip(status['reconstructions'], fixture.status['reconstructions']):
            for name in RECONSTRUCTION_COUNTS:
                self.assertEqual(now[name], then[name], name)
            for name in ('depth_maps', 'triangles'):  # format 1 knew neither
                self.assertEqual(now[name], then.get(name, 0), name)

    def check_growing(self, fixture, city):
        """The photo whose `add` was killed long ago is added, and the city is made dense."""
        out = must('add', city, '--camera', 'phone', '--threads', '1', '--json', fixture.later)
        lines = out.splitlines()
        self.assertEqual(len(lines), 1)
        added = json.loads(lines[0])
        self.assertEqual((added['image'], added['verdict']), (LATER, 'placed'))
        self.assertEqual(added['reconstruction'], 1)
        must('densify', city, '--device', 'cpp', '--threads', '1', '--size', '64',
             '--voxel', '0.4')
        self.assertEqual(must('verify', city), 'sound\n')
        status = ask('status', city)
        self.assertEqual(status['images'], fixture.status['images'] + 1)
        self.assertEqual(status['placed'], fixture.status['placed'] + 1)
        self.assertEqual(status['reconstructions'][0]['depth_maps'], status['placed'])
        self.assertGreater(status['reconstructions'][0]['triangles'], 0)

    def check_reader_before_upgrade(self, fixture, city):
        """A reader answers rightly, or ends with 3 and names the command that upgrades."""
        code, out, err = run('status', city, '--json')
        if code == 0:
            self.check_counts(fixture, json.loads(out))
        else:
            self.assertEqual((code, out), (3, ''), err)
            self.assertIn(f"'veduta settle {city}'", err)
        return code

    def check_kills(self, fixture):
        """The first writer is killed again and again, and the next one finds and loses nothing."""
        rng = random.Random(SEED)
        start = time.monotonic()
        must('settle', fixture.copy('timed'))
        seconds = time.monotonic() - start
        killed_before_end = 0
        for number in range(KILLS):
            city = fixture.copy(f'killed{number}')
            for _ in range(rng.randint(1, 3)):
                process = subprocess.Popen([VEDUTA, 'settle', city], stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL)
                time.sleep(rng.uniform(0, 1.1 * seconds))
                process.kill()
                killed_before_end += process.wait() == -signal.SIGKILL
                self.check_reader_before_upgrade(fixture, city)
            must('settle', city)
            self.check_city(fixture, city)
            if number % 5 == 0:
                self.check_growing(fixture, city)
            shutil.rmtree(city)
        self.assertGreater(killed_before_end, 0, 'no kill came before the end')

    def check_reader_says_what_to_do(self, fixture, number):
        for command in (('status',), ('digest',), ('show', PLACED),
                        ('export', 'out', '--format', 'colmap')):
            code, out, err = run(command[0], fixture.city, *command[1:])
            self.assertEqual((code, out), (3, ''), command)
            self.assertIn(f'has format {number} of an earlier veduta', err)
            self.assertIn(f"'veduta settle {fixture.city}'", err)

    def check_settle_upgrades(self, fixture):
        self.assertEqual(self.check_reader_before_upgrade(fixture, fixture.city), 3)
        must('settle', fixture.city)
        self.check_city(fixture, fixture.city)
        self.check_growing(fixture, fixture.city)

    def test_format_1_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format1'), 1)

    def test_format_1_is_upgraded_by_settle(self):
        self.check_settle_upgrades(self.fixture('format1'))

    def test_format_1_is_upgraded_by_adding(self):
        fixture = self.fixture('format1')
        self.check_growing(fixture, fixture.city)

    def test_format_1_upgrade_is_killed(self):
        self.check_kills(self.fixture('format1'))

    def test_format_2_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format2'), 2)

    def test_format_2_is_upgraded_by_settle(self):
        self.check_settle_upgrades(self.fixture('format2'))

    def test_format_3_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format3'), 3)

    def test_format_3_is_upgraded_by_settle(self):
        self.check_settle_upgrades(self.fixture('format3'))

    def test_format_3_is_upgraded_by_adding(self):
        fixture = self.fixture('format3')
        self.check_growing(fixture, fixture.city)

    def test_format_3_upgrade_is_killed(self):
        self.check_kills(self.fixture('format3'))

    def test_format_4_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format4'), 4)

    def test_format_4_is_upgraded_by_settle(self):
        self.check_settle_upgrades(self.fixture('format4'))

    def test_format_4_is_upgraded_by_adding(self):
        fixture = self.fixture('format4')
        self.check_growing(fixture, fixture.city)

    def test_format_4_is_repaired(self):
        self.check_repair(self.fixture('format4'), 4)

    def test_format_5_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format5'), 5)

    def test_format_5_is_upgraded_by_adding(self):
        fixture = self.fixture('format5')
        self.check_growing(fixture, fixture.city)

    def test_format_5_is_repaired(self):
        self.check_repair(self.fixture('format5'), 5)

    def test_format_6_reader_says_what_to_do(self):
        self.check_reader_says_what_to_do(self.fixture('format6'), 6)

    def test_format_6_is_upgraded_by_adding(self):
        fixture = self.fixture('format6')
        self.check_growing(fixture, fixture.city)

    def test_format_6_is_repaired(self):
        self.check_repair(self.fixture('format6'), 6)

    def test_format_3_is_repaired(self):
        self.check_repair(self.fixture('format3'), 3)

    def test_format_1_is_repaired(self):
        self.check_repair(self.fixture('format1'), 1)

    def test_format_2_is_repaired(self):
        self.check_repair(self.fixture('format2'), 2)

    def check_repair(self, fixture, number):
        self.assertIn(f'has format {number} of an earlier veduta; the new one has format 7',
                      must('repair', fixture.city, '--yes'))
        self.assertEqual(must('verify', fixture.city), 'sound\n')
        self.check_counts(fixture, ask('status', fixture.city))
        self.check_growing(fixture, fixture.city)

    def test_format_2_is_upgraded_by_adding(self):
        fixture = self.fixture('format2')
        self.check_growing(fixture, fixture.city)

    def test_format_2_upgrade_is_killed(self):
        self.check_kills(self.fixture('format2'))


if __name__ == '__main__':
    unittest.main('__main__', argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)
