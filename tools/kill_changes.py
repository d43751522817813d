#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# The second half of tools/kill_test.sh, which says what it checks and starts it: what changes a
# city that is there (remove, forbid, allow, settle) is killed at random instants and done again.
# usage: tools/kill_changes.py VEDUTA FOLDER_OF_PHOTOS WORK_FOLDER KILLS SEED

import collections
import os
import shutil
import signal
import subprocess
import sys
import time

from killing import (camera_of_photos, fail, failures, kills_wanted, must, photos, rng, run, veduta,
                     work)

kills = collections.Counter()


def make_city(path, names):
    """All photos; the last third is somebody else's."""
    size, params = camera_of_photos()
    must('init', path)
    must('camera', 'add', path, 'c', '--size', size, '--params', params)
    own_count = 2 * len(names) // 3
    for who, part in (('one', names[:own_count]), ('other', names[own_count:])):
        must('add', path, *(os.path.join(photos, name) for name in part), '--camera', 'c',
             '--contributor', who)


def changes_of(names):
    """Removals, facts that take poses and pairs away and give them back, and what follows."""
    a, b, c, d, e = (names[i * (2 * len(names) // 3) // 5] for i in range(5))
    return [('forbid', b, c), ('settle', ), ('forbid', '--pose', d), ('settle', ), ('remove', a),
            ('settle', ), ('allow', b, c), ('allow', '--pose', d), ('settle', ), ('remove', c, e),
            ('settle', ), ('remove', '--contributor', 'other'), ('settle', )]


def arguments_of(change, path, threads):
    what, *rest = change
    more = ['--threads', str(threads)] if what in ('remove', 'settle') else []
    return [what, path, *rest, *more]


def do_again(change, path, threads):
    """Does to its end what may have been killed in the middle, or after it was done. Photos are
    removed one by one, so some of those that are named may be gone; those that are left go in one
    command, for what follows comes after all of them."""
    what, *rest = change
    if what == 'remove' and rest[0] != '--contributor':
        rest = [name for name in rest if run('show', path, name)[0] == 0]
    code, out, err = run(*arguments_of((what, *rest), path, threads))
    is_done = (what == 'allow' and 'not forbidden' in err) or (
        what == 'remove' and 'there is no photo of' in err)
    if code != 0 and not is_done:
        fail(f'{" ".join(change)} ended with {code} after a kill: {err.strip()}')


def change_and_kill(change, path, threads, seconds):
    """Kills the command, once or a few times, and ends it then."""
    while not failures and sum(kills.values()) < kills_wanted and rng.random() < 0.7:
        process = subprocess.Popen([veduta, *arguments_of(change, path, threads)],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(0, 1.1 * seconds))
        process.send_signal(signal.SIGKILL)
        code = process.wait()
        if code == -signal.SIGKILL:
            kills[change[0]] += 1
        elif code < 0:
            fail(f'{" ".join(change)} was ended by signal {-code}')
        code, out, err = run('verify', path)
        if code != 0:
            fail(f'verify ended with {code} after a killed {" ".join(change)}: '
                 f'{(out + err).strip()}')
    if not failures:
        do_again(change, path, threads)


def undisturbed(city, changes, threads):
    path = os.path.join(work, f'changed_{threads}')
    shutil.copytree(city, path)
    seconds = []
    for change in changes:
        start = time.monotonic()
        must(*arguments_of(change, path, threads))
        seconds.append(time.monotonic() - start)
    return must('digest', path).strip(), seconds


names = sorted(name for name in os.listdir(photos)
               if os.path.isfile(os.path.join(photos, name)) and not name.endswith('.txt'))
if len(names) < 8:
    sys.exit(f'kill_test.sh: {len(names)} photos in {photos}; 8 are needed')
city = os.path.join(work, 'city')
make_city(city, names)
changes = changes_of(names)
digest, seconds = undisturbed(city, changes, 1)
digest_2, seconds_2 = undisturbed(city, changes, 2)
if digest_2 != digest:
    fail(f'two threads change the city to {digest_2}, one to {digest}')
databases = 0
while sum(kills.values()) < kills_wanted and not failures:
    databases += 1
    threads = 1 + databases % 2
    path = os.path.join(work, f'killed_change_{databases}')
    shutil.copytree(city, path)
    for change, took in zip(changes, (seconds, seconds_2)[threads - 1]):
        change_and_kill(change, path, threads, took)
        if failures:
            break
    if not failures:
        got = must('digest', path).strip()
        if got != digest:
            fail(f'digest {got} after kills, {digest} without; {threads} threads')
    if not failures:
        shutil.rmtree(path)
told = ', '.join(f'{count} of {what}' for what, count in kills.most_common())
print(f'{sum(kills.values())} kills of changes over {databases} databases ({told}); '
      f'{len(failures)} failures')
if failures:
    os.rename(work, work + '.failed')
    print(f'what is left of it: {work}.failed')
sys.exit(1 if failures else 0)
