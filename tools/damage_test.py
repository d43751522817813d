#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Damages the files of a database at random, one damage at a time, and looks who notices.

usage: tools/damage_test.py VEDUTA DATABASE PHOTOS [--flips N] [--cuts N] [--repair-every N]
                            [--seed N]

The database is copied; the original is only read. PHOTOS is the folder that its photos came
from. Each trial flips one bit of one file of the copy, or cuts the file's end off, each byte of the
database being equally likely. It asks `veduta verify`, and where that finds the database sound,
`veduta digest`. A trial ends in one of these ways:

  noticed    verify or digest names something: exit code 3
  harmless   verify says "sound", and the digest is what it was
  SILENT     verify says "sound", and the digest is another
  BROKEN     a program was ended by a signal, or by a code that it should not end with

Every N-th noticed trial is repaired in a second copy, with `veduta repair --yes`. Afterwards verify
must find nothing, and no photo may be missing but those whose own bytes were damaged: the photos'
bytes are searched for in the files beforehand. SIGINT or SIGTERM ends the run after the trial at
hand, and what was done by then is told.

Exit codes: 0 nothing was silent, broken or lost; 1 something was; 2 bad usage.
"""
import argparse
import collections
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile

TRIAL_SECONDS_MAX = 300
UNUSABLE = 3  # the exit code of a database that is damaged


class Trial:
    """What one damage did."""

    def __init__(self, way, text):
        self.way = way
        self.text = text


def run(veduta, *arguments):
    """The exit code, negative for a signal, and what was printed."""
    try:
        done = subprocess.run([veduta, *arguments], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=TRIAL_SECONDS_MAX, check=False,
                              start_new_session=True)  # a Ctrl-C is for this script alone
    except subprocess.TimeoutExpired:
        return -1, f'did not end within {TRIAL_SECONDS_MAX} s'
    return done.returncode, done.stdout.decode(errors='replace').strip()


def files_of(folder):
    """The files that are not empty, with their sizes. LOCK and RocksDB's own logs hold nothing."""
    found = []
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        if os.path.isfile(path) and os.path.getsize(path) > 0:
            found.append((name, os.path.getsize(path)))
    return found


def kind_of(name):
    """Groups files for the table: 000012.sst is a .sst, MANIFEST-000004 a MANIFEST."""
    return os.path.splitext(name)[1] or re.sub(r'-\d+$', '', name)


def choose(files, generator):
    """One byte, each being equally likely: the file's name and the place."""
    place = generator.randrange(sum(size for _, size in files))
    for name, size in files:
        if place < size:
            return name, place
        place -= size
    raise AssertionError('the place lies behind the last file')


class Damage:
    """One flipped bit or one cut, to be made and taken back."""

    def __init__(self, folder, name, place, bit):
        self.path = os.path.join(folder, name)
        self.name, self.place, self.bit = name, place, bit
        with open(self.path, 'rb') as file:
            file.seek(place)
            self.lost = file.read(1 if bit is not None else -1)

    def make(self):
        if self.bit is None:
            os.truncate(self.path, self.place)
        else:
            self.write(bytes([self.lost[0] ^ (1 << self.bit)]))

    def take_back(self):
        self.write(self.lost)

    def write(self, data):
        with open(self.path, 'r+b') as file:
            file.seek(self.place)
            file.write(data)

    def touches(self, name, first, end):
        """Whether it damages one of the bytes [first, end) of a file."""
        if self.name != name:
            return False
        return self.place < end and (self.bit is None or self.place >= first)

    def __str__(self):
        if self.bit is None:
            return f'{self.name} cut at byte {self.place}'
        return f'{self.name}, byte {self.place}, bit {self.bit}'


def look(veduta, database, digest):
    """What verify and digest say of the damaged database."""
    code, text = run(veduta, 'verify', database)
    if code == UNUSABLE:
        return Trial('noticed', text)
    if code != 0:
        return Trial('BROKEN', f'verify ended with {code}: {text[-300:]}')
    code, text = run(veduta, 'digest', database)
    if code == 0:
        return Trial('harmless' if text == digest else 'SILENT', text)
    way = 'noticed' if code == UNUSABLE else 'BROKEN'
    return Trial(way, f'digest ended with {code}: {text[-300:]}')


class StoredPhotos:
    """Where the photos' bytes lie in the files of a database."""

    WINDOW = 64            # bytes; no two photos have one in common behind their headers
    WINDOW_STEP = 4096
    LOG_BLOCK = 32768      # a log is cut into blocks of this size, each with
    LOG_HEADER = 7         # headers of this size; RocksDB's log_format.h
    LOG_RECORD_HEAD = 256  # what stands before a photo in its record of the log, at most

    def __init__(self, database, photos):
        """Searches for all files below the folder `photos` in the database's logs and blobs."""
        files = [name for name, _ in files_of(database) if kind_of(name) in ('.log', '.blob')]
        contents = {}
        for name in files:
            with open(os.path.join(database, name), 'rb') as file:
                contents[name] = file.read()
        self.copies = {}  # by a photo's name: (file, first byte, byte behind the last one)
        for folder, _, names in os.walk(photos):
            for name in names:
                path = os.path.join(folder, name)
                with open(path, 'rb') as file:
                    photo = file.read()
                copies = [copy for found, content in contents.items()
                          for copy in self.find(found, content, photo)]
                if copies:
                    self.copies[os.path.relpath(path, photos)] = copies

    def find(self, name, content, photo):
        """The copies of a photo in a file; one at most of a log, where it lies in pieces."""
        if kind_of(name) == '.blob':
            place = content.find(photo)
            while place >= 0:
                yield name, place, place + len(photo)
                place = content.find(photo, place + 1)
            return
        starts, ends = [], []
        headers = self.LOG_HEADER * (len(photo) // self.LOG_BLOCK + 2)
        for offset in range(self.WINDOW_STEP, len(photo) - self.WINDOW, self.WINDOW_STEP):
            place = content.find(photo[offset:offset + self.WINDOW])
            if place >= 0:
                starts.append(place - offset - headers - self.LOG_RECORD_HEAD)
                ends.append(place - offset + len(photo) + headers)
        if starts:
            yield name, max(0, min(starts)), max(ends)

    def damaged_by(self, damage):
        """The names of the photos that have no whole copy left."""
        return {photo for photo, copies in self.copies.items()
                if all(damage.touches(*copy) for copy in copies)}


def count_photos(veduta, database):
    """How many photos the database holds; -1 where `status` cannot tell."""
    code, text = run(veduta, 'status', database, '--json')
    return json.loads(text)['images'] if code == 0 else -1


def repair(veduta, database, copy, photos, damaged):
    """Repairs a copy of the damaged database; what is wrong then, or nothing."""
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(database, copy)
    code, text = run(veduta, 'repair', copy, '--yes', '--json')
    if code != 0:
        return f'repair ended with {code}: {text[-300:]}'
    answer = json.loads(text)
    shutil.rmtree(answer['kept_path'], ignore_errors=True)
    code, text = run(veduta, 'verify', '--deep', copy)
    if code != 0:
        return f'verify after repair ended with {code}: {text[-300:]}'
    left = count_photos(veduta, copy) + len(answer['written_out'])
    if left < photos - len(damaged):
        return f'{left} of {photos} photos are left after repair, {len(damaged)} were damaged'
    wrong = set(answer['lost']) - damaged
    return f'repair calls {sorted(wrong)} lost, whose bytes are whole' if wrong else None


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('veduta')
    parser.add_argument('database')
    parser.add_argument('photos')
    parser.add_argument('--flips', type=int, default=1000)
    parser.add_argument('--cuts', type=int, default=200)
    parser.add_argument('--repair-every', type=int, default=20, help='0: never')
    parser.add_argument('--seed', type=int, default=1)
    return parser.parse_args()


class Stop:
    """Whether a signal has asked for the end."""

    def __init__(self):
        self.is_asked = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self.ask)

    def ask(self, _number, _frame):
        self.is_asked = True


def measure(arguments, work):
    """All trials; the table by kind of damage and file and way, and what failed."""
    stop = Stop()
    veduta = os.path.abspath(arguments.veduta)
    database, copy = os.path.join(work, 'db'), os.path.join(work, 'copy')
    shutil.copytree(arguments.database, database)
    code, digest = run(veduta, 'digest', database)
    if code != 0 or run(veduta, 'verify', '--deep', database)[0] != 0:
        sys.exit(f'damage_test.py: {arguments.database} is not sound')
    photos, stored = count_photos(veduta, database), StoredPhotos(database, arguments.photos)
    if len(stored.copies) != photos:
        sys.exit(f'damage_test.py: {arguments.photos} has {len(stored.copies)} of the {photos} '
                 'photos')
    generator = random.Random(arguments.seed)
    table, failures, noticed, repaired = collections.Counter(), [], 0, 0
    for number in range(arguments.flips + arguments.cuts):
        if stop.is_asked:
            break
        name, place = choose(files_of(database), generator)
        is_flip = number < arguments.flips
        damage = Damage(database, name, place, generator.randrange(8) if is_flip else None)
        damage.make()
        trial = look(veduta, database, digest)
        table[('flip' if is_flip else 'cut', kind_of(name), trial.way)] += 1
        if trial.way in ('SILENT', 'BROKEN'):
            failures.append(f'{damage}: {trial.way}: {trial.text}')
        noticed += trial.way == 'noticed'
        if trial.way == 'noticed' and arguments.repair_every:
            if noticed % arguments.repair_every == 0:
                wrong = repair(veduta, database, copy, photos, stored.damaged_by(damage))
                repaired += 1
                if wrong:
                    failures.append(f'{damage}: {wrong}')
        damage.take_back()
        if failures and len(failures) <= 20 and failures[-1].startswith(str(damage)):
            print(failures[-1], flush=True)
    return table, failures, repaired


def main():
    arguments = parse_arguments()
    with tempfile.TemporaryDirectory(prefix='veduta_damage_') as work:
        table, failures, repaired = measure(arguments, work)
    print('| damage | file | what became of it | trials |')
    print('| --- | --- | --- | ---: |')
    for (damage, kind, way), count in sorted(table.items()):
        print(f'| {damage} | {kind} | {way} | {count} |')
    done = collections.Counter()
    for (damage, _, _), count in table.items():
        done[damage] += count
    print(f'{done["flip"]} flips, {done["cut"]} cuts, {repaired} repaired: '
          f'{len(failures)} failures')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
