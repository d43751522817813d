#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a backup that is restored is the database that it was made of; a second one copies only what
#   changed; whatever is damaged is found and named; whatever ends a backup leaves the older ones
#   whole; a restore writes into nothing that is there. The same beside a daemon.
# Method: bytes of backups flipped, cut and deleted; backups killed at random instants; a limit on
#   the size of files in place of a full disk. KILLS=200 by hand.
# usage: tests/cli/backup_test.py VEDUTA VEDUTA_STREET
import glob
import json
import os
import random
import shutil
import signal
import subprocess
import time

from city import (PHOTO_COUNT, PHOTOS, VEDUTA, WHOLE, Case, at, main, make_whole, must,
                  new_database, photo, read, run, write)
from daemon import Daemon

WHOLE_DIGEST = None


def setUpModule():
    global WHOLE_DIGEST
    WHOLE_DIGEST = make_whole()[1]


def copy_of_whole(name):
    return shutil.copytree(WHOLE, at(name))


def backup(db, folder, *more):
    return json.loads(must('backup', db, folder, '--json', *more))


def names_in(folder):
    return sorted(os.path.basename(path) for path in glob.glob(os.path.join(folder, '*')))


def numbers(folder):
    listed = json.loads(must('backups', 'list', folder, '--json'))
    return [one['backup'] for one in listed['backups']]


def bytes_in(folder):
    return sum(os.path.getsize(path) for path in glob.glob(os.path.join(folder, 'files', '*')))


class Backup(Case):
    def restored(self, folder, name, *more):
        """The digest of the restored database, which is sound."""
        must('restore', folder, at(name), *more)
        self.assertEqual(must('verify', at(name)), 'sound\n')
        return must('digest', at(name))

    def test_what_is_restored_is_what_was_there(self):
        db, folder = copy_of_whole('kept'), at('kept backups')
        first = backup(db, folder)
        self.assertEqual((first['backup'], first['database']), (1, db))
        self.assertEqual(first['copied_files'], first['files'])
        self.assertNotIn('backup-links', names_in(db))
        again = backup(db, folder)
        # The note in the journal that the first was made, and RocksDB's own lists.
        self.assertLess(again['copied_bytes'], first['bytes'] / 20)
        must('remove', db, 'photo0001.jpg')
        must('settle', db)
        later = must('digest', db)
        self.assertNotEqual(later, WHOLE_DIGEST)
        self.assertEqual(backup(db, folder)['backup'], 3)
        self.assertEqual(numbers(folder), [1, 2, 3])
        self.assertIn('all files are whole', must('backups', 'check', folder))
        self.assertEqual(self.restored(folder, 'newest'), later)
        self.assertEqual(self.restored(folder, 'first', '--backup', '1'), WHOLE_DIGEST)
        bare = subprocess.run([VEDUTA, 'restore', folder, 'bare'], cwd=at('.'), check=False)
        self.assertEqual((bare.returncode, must('digest', at('bare'))), (0, later))
        self.refused(1, 'inside of the database', 'copy', db, db + '/copy')
        code, lines, _ = run('add', at('first'), '--camera', 'c', PHOTOS)
        self.assertEqual((code, lines.count('duplicate')), (0, PHOTO_COUNT))
        self.refused(1, 'exists', 'restore', folder, at('first'))
        os.mkdir(at('empty'))
        self.refused(1, 'exists', 'restore', folder, at('empty'))
        self.refused(1, 'no backup 9', 'restore', folder, at('ninth'), '--backup', '9')
        self.assertEqual(glob.glob(at('*.restoring')), [])

    def test_old_ones_are_thinned_out(self):
        db, folder = copy_of_whole('thin'), at('thin backups')
        for n in range(4):
            must('camera', 'add', db, f'c{n}', '--size', '640x480', '--params', '500,500,320,240')
            made = backup(db, folder, '--keep', '3')
        self.assertEqual((made['deleted'], numbers(folder)), (1, [2, 3, 4]))
        before = bytes_in(folder)
        self.assertEqual(must('backups', 'thin', folder, '--keep', '1'), 'deleted 2 backups\n')
        self.assertEqual(numbers(folder), [4])
        self.assertLess(bytes_in(folder), before)
        self.assertEqual(self.restored(folder, 'thinned'), must('digest', db))
        self.assertEqual(backup(db, folder)['backup'], 5)

    def test_only_a_folder_of_this_databases_backups_will_do(self):
        db, other = copy_of_whole('one'), new_database('other')
        self.refused(1, 'inside of the database', 'backup', db, os.path.join(db, 'inside'))
        self.refused(1, 'not empty', 'backup', db, PHOTOS)
        folder = at('of one')
        backup(db, folder)
        self.refused(1, 'has backups of ' + db, 'backup', other, folder)
        for command in (('list', at('none')), ('check', PHOTOS), ('thin', PHOTOS, '--keep', '1')):
            self.refused(1, 'no folder of backups', 'backups', *command)
        self.assertEqual(numbers(folder), [1])

    def test_a_removal_names_the_folder(self):
        db, folder = copy_of_whole('removed'), at('removed backups')
        backup(db, folder)
        backup(db, folder)
        answer = json.loads(must('remove', db, 'photo0002.jpg', '--json'))
        self.assertEqual(answer['copies'], [folder])

    def test_damage_is_found_and_named(self):
        db, folder = copy_of_whole('damaged'), at('damaged backups')
        backup(db, folder)
        # The same seed makes the same damage.
        chance = random.Random(7)
        for path in sorted(glob.glob(os.path.join(folder, 'files', '*'))):
            whole = read(path)
            where = chance.randrange(len(whole))
            flipped = bytearray(whole)
            flipped[where] ^= 1 << chance.randrange(8)
            for damage in (bytes(flipped), whole[:where], whole + b'\0', None):
                os.remove(path)
                if damage is not None:
                    write(path, damage)
                code, out, err = run('backups', 'check', folder)
                self.assertEqual((code, err), (3, ''), path)
                self.assertEqual(out.count(' of backup 1'), 1)
                self.assertIn(path, out)
                self.refused(3, path, 'restore', folder, at('never'))
                self.assertEqual(glob.glob(at('never*')), [])
            write(path, whole)
        self.assertIn('all files are whole', must('backups', 'check', folder))
        manifest = os.path.join(folder, 'backups', '1')
        write(manifest, read(manifest).replace(b'0', b'1', 1))
        for command in (('backups', 'list', folder), ('backups', 'check', folder)):
            code, out, _ = run(*command)
            self.assertEqual(code, 3)
            self.assertIn(manifest, out)
        self.refused(3, manifest, 'restore', folder, at('never'))
        # The next one is a backup of its own, and does not delete what the damaged one may name.
        before = set(names_in(os.path.join(folder, 'files')))
        self.assertEqual(backup(db, folder)['backup'], 2)
        self.assertLessEqual(before, set(names_in(os.path.join(folder, 'files'))))
        self.assertEqual(self.restored(folder, 'second', '--backup', '2'), WHOLE_DIGEST)

    def test_a_file_that_was_cut_is_copied_anew(self):
        db, folder = copy_of_whole('cut'), at('cut backups')
        backup(db, folder)
        for path in glob.glob(os.path.join(folder, 'files', '*')):
            write(path, read(path)[:-1])
        backup(db, folder)
        self.assertEqual(self.restored(folder, 'uncut'), WHOLE_DIGEST)

    def test_of_a_damaged_database_there_is_none(self):
        db, folder = copy_of_whole('rotten'), at('rotten backups')
        must('copy', db, at('sound'))
        backup(db, folder)
        older = names_in(os.path.join(folder, 'files'))
        for path in glob.glob(os.path.join(db, '*.blob')):
            rotten = bytearray(read(path))
            rotten[len(rotten) // 2] ^= 1
            write(path, bytes(rotten))
        self.refused(3, '.blob is damaged', 'backup', db, at('first of it'))
        self.refused(3, 'older ones are as they were', 'backup', db, folder)
        self.assertEqual(names_in(os.path.join(folder, 'files')), older)
        self.assertEqual(self.restored(folder, 'not rotten'), WHOLE_DIGEST)

    def test_a_killed_one_leaves_the_older_ones_whole(self):
        db, folder = copy_of_whole('killed'), at('killed backups')
        started = time.monotonic()
        backup(db, folder)
        took = time.monotonic() - started
        chance, killed = random.Random(3), 0
        for n in range(int(os.environ.get('KILLS', '12'))):
            # All is new to it: copied again in full.
            shutil.rmtree(at('killed again'), ignore_errors=True)
            if n % 2:
                folder_now = folder
                must('camera', 'add', db, f'k{n}', '--size', '640x480', '--params',
                     '500,500,320,240')
            else:
                folder_now = at('killed again')
            process = subprocess.Popen([VEDUTA, 'backup', db, folder_now],
                                       stdout=subprocess.DEVNULL)
            time.sleep(chance.uniform(0, took))
            process.send_signal(signal.SIGKILL)
            killed += process.wait() == -signal.SIGKILL
            self.assertIn('all files are whole', must('backups', 'check', folder))
            if n % 2 == 0:
                backup(db, folder_now)
                self.assertIn('all files are whole', must('backups', 'check', folder_now))
        self.assertGreater(killed, 0)
        self.assertEqual(self.restored(folder, 'of the first', '--backup', '1'), WHOLE_DIGEST)
        backup(db, folder)
        self.assertEqual(self.restored(folder, 'of the last'), must('digest', db))
        self.assertEqual(names_in(db).count('backup-links'), 0)

    def test_a_full_disk_leaves_the_older_ones_whole(self):
        db, folder = new_database('full'), at('full backups')
        backup(db, folder)
        older = names_in(os.path.join(folder, 'files'))
        must('add', db, '--camera', 'c', PHOTOS)
        must('copy', db, at('flushed'))  # so that opening it writes no large file
        largest = max(os.path.getsize(path) for path in glob.glob(os.path.join(db, '*.blob')))
        limited = subprocess.run(
            ['bash', '-c', f'ulimit -f {largest // 2048}; exec "$@"', 'bash', VEDUTA, 'backup', db,
             folder], capture_output=True, text=True)
        self.assertEqual(limited.returncode, 1, limited.stderr)
        self.assertIn('File too large', limited.stderr)
        self.assertIn('no backup was made', limited.stderr)
        self.assertEqual(names_in(os.path.join(folder, 'files')), older)
        self.assertEqual(numbers(folder), [1])
        self.assertIn('all files are whole', must('backups', 'check', folder))
        backup(db, folder)
        self.assertEqual(self.restored(folder, 'of a full disk'), must('digest', db))
        process = subprocess.run(
            ['bash', '-c', f'ulimit -f {largest // 2048}; exec "$@"', 'bash', VEDUTA, 'restore',
             folder, at('no room')], capture_output=True, text=True)
        self.assertEqual(process.returncode, 1)
        self.assertIn('File too large', process.stderr)
        self.assertEqual(glob.glob(at('no room*')), [])


class BesideADaemon(Case):
    def test_the_daemon_makes_it(self):
        db, folder = new_database('served'), at('served backups')
        with Daemon(db) as daemon:
            for n in range(1, 5):
                self.assertEqual(daemon.send(f'photo{n:04}.jpg', photo(n))[0], 201)
            first = backup(db, folder)
            self.assertEqual((first['backup'], first['copied_files']), (1, first['files']))
            digest = must('digest', db)
            # Photos come while the second one is made.
            for n in range(5, 9):
                self.assertEqual(daemon.send(f'photo{n:04}.jpg', photo(n), waits=False)[0], 202)
            self.assertRegex(must('backup', db, folder, '--keep', '5'),
                             r'^backup 2 of .* UTC: \d+ files, \d+ bytes\ncopied \d+ files, ')
            daemon.wait_for_uploads()
            self.refused(1, 'not empty', 'backup', db, PHOTOS)
            must('copy', db, at('a copy'))
            self.refused(1, 'exists', 'copy', db, at('a copy'))
            for path in ('/v1/backups', '/v1/copies', '/v1/settle', '/v1/densify',
                         '/v1/vocabulary/train', '/v1/vocabulary/import', '/v1/models',
                         '/v1/cameras/calibrate'):
                code, _, answer = daemon.ask('POST', path, '{}')
                self.assertEqual(code, 403, answer)
        must('restore', folder, at('first served'), '--backup', '1')
        self.assertEqual(must('digest', at('first served')), digest)
        must('restore', folder, at('second served'))
        self.assertEqual(must('verify', at('second served')), 'sound\n')
        must('settle', at('second served'))
        must('settle', db)
        # Photos that waited when it was made are in it, and are placed in the same order.
        self.assertLessEqual(4, json.loads(must('status', at('second served'), '--json'))['images'])
        self.assertEqual(must('verify', at('a copy')), 'sound\n')


if __name__ == '__main__':
    main()
