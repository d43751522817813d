#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Kills `veduta add` of photos whose camera nobody names at random instants, again and again, and
# checks that the database is sound after every kill and that the city ends up the same to the last
# bit as without any. A part of tools/kill_test.sh where UNNAMED is set: the photos calibrate their
# cameras first, which takes longer than adding them.
# usage: tools/kill_unnamed.py VEDUTA FOLDER_OF_PHOTOS WORK_FOLDER KILLS SEED

import os
import shutil
import subprocess
import sys
import time

from killing import fail, failures, kills_wanted, must, photos, rng, run, veduta, work

KILLS_OF_ONE = 6  # of one database at most


def command(path, threads):
    return [veduta, 'add', path, photos, '--threads', str(threads)]


def undisturbed():
    """The digest, and how long it took."""
    path = os.path.join(work, 'unnamed')
    must('init', path)
    start = time.monotonic()
    done = subprocess.run(command(path, 1), capture_output=True, text=True)
    if done.returncode not in (0, 1):  # 1: a photo was rejected, or its camera cannot be told
        sys.exit(f'kill_unnamed.py: the undisturbed run ended with {done.returncode}: '
                 f'{done.stderr}')
    if 'founded' not in done.stdout:
        sys.exit(f'kill_unnamed.py: no city began: {done.stdout}{done.stderr}')
    must('verify', path)
    return must('digest', path).strip(), time.monotonic() - start


def one_database(index, threads, kills_max):
    """Kills until it ends by itself, `kills_max` times at most; how often it was killed."""
    path = os.path.join(work, f'unnamed_{index}')
    must('init', path)
    history = []
    while not failures:
        seconds = rng.uniform(0, 0.8 * elapsed) if len(history) < kills_max else None
        try:
            subprocess.run(command(path, threads), capture_output=True, timeout=seconds)
            break
        except subprocess.TimeoutExpired:  # it was killed
            history.append(f'{seconds:.1f} s')
        code, out, err = run('verify', path)
        if code != 0:
            fail(f'verify ended with {code}: {(out + err).strip()}')
    got = must('digest', path).strip()
    if got != digest:
        fail(f'digest {got} after kills, {digest} without; {threads} threads; {", ".join(history)}')
    else:
        shutil.rmtree(path)
    print(f'database {index}: {threads} threads, killed after {", ".join(history) or "nothing"}',
          flush=True)
    return len(history)


digest, elapsed = undisturbed()
print(f'undisturbed, without cameras: {elapsed:.1f} s, digest {digest[:16]}', flush=True)
kills = databases = 0
while kills < kills_wanted and not failures:
    databases += 1
    kills += one_database(databases, 1 + databases % 2, min(KILLS_OF_ONE, kills_wanted - kills))
print(f'{kills} kills of add without cameras over {databases} databases; {len(failures)} failures')
sys.exit(1 if failures else 0)
