#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# The killing part of tools/kill_test.sh, which says what it checks and starts it.
# usage: tools/kill_test.py VEDUTA FOLDER_OF_PHOTOS WORK_FOLDER KILLS SEED

import collections
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

from killing import (camera_of_photos, fail, failures, kills_wanted, must, photos, rng, run, veduta,
                     work)

PLACED = ('placed', 'merged', 'founded')
size, params = camera_of_photos()
list_path = sent_folder = None  # set below


def new_database(path):
    """Now and then init is killed as well; doing it again must work."""
    if rng.random() < 0.3:
        process = subprocess.Popen([veduta, 'init', path], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(0, 0.06))
        process.kill()
        process.wait()
        counts['init'] += 1
    code, out, err = run('init', path)
    if code != 0 and run('status', path)[0] != 0:
        fail(f'init after a killed init: {err}')
    add_cameras(path)


def write_list():
    """Every photo, and beside every third one the same bytes once more: under a wrong camera, under
    another camera of the same size, or under the name of another photo; before the photo itself or
    after it. A name is taken by a folder `again` whose `..` is elsewhere than the text says."""
    elsewhere = os.path.join(work, 'elsewhere', 'inside')
    os.makedirs(elsewhere)
    sent = os.path.join(work, 'sent')
    shutil.copytree(photos, sent)
    os.symlink(elsewhere, os.path.join(sent, 'again'))
    names = sorted(name for name in os.listdir(photos)
                   if os.path.isfile(os.path.join(photos, name)))
    lines = []
    for i, name in enumerate(names):
        again = []
        if i % 3 == 0:
            again = [(f'copy_{i}_{name}', ('wrong', 'bent')[i // 3 % 2])]
            shutil.copy(os.path.join(photos, name), os.path.join(sent, again[0][0]))
        elif i % 3 == 1 and i > 2:
            # The name of a photo two before this one, with this one's bytes.
            again = [(f'again/../{names[i - 2]}', 'c')]
            shutil.copy(os.path.join(photos, name), os.path.join(work, 'elsewhere', names[i - 2]))
        here = [(name, 'c')]
        lines += again + here if rng.random() < 0.5 else here + again
    path = os.path.join(work, 'list.txt')
    with open(path, 'w') as file:
        file.writelines(f'{name}\t{name_of_camera}\n' for name, name_of_camera in lines)
    return path, sent


def add_cameras(path):
    width, height = size.split('x')
    must('camera', 'add', path, 'c', '--size', size, '--params', params)
    must('camera', 'add', path, 'wrong', '--size', f'{int(width) + 2}x{height}', '--params', params)
    bent = ','.join(params.split(',')[:4] + ['-0.05', '0'])
    must('camera', 'add', path, 'bent', '--size', size, '--params', bent)


def add_command(path, threads):
    return [veduta, 'add', path, '--camera', 'c', '--list', list_path, sent_folder, '--threads',
            str(threads), '--json', '--contributor', 'kill_test']


def undisturbed(threads):
    path = os.path.join(work, f'undisturbed_{threads}')
    must('init', path)
    add_cameras(path)
    start = time.monotonic()
    done = subprocess.run(add_command(path, threads), capture_output=True, text=True)
    elapsed = time.monotonic() - start
    if done.returncode not in (0, 1):  # 1: a photo was rejected
        sys.exit(f'kill_test.sh: the undisturbed run ended with {done.returncode}: {done.stderr}')
    if run('verify', path)[0] != 0:
        fail('the undisturbed database is not sound')
    return must('digest', path).strip(), done.stdout.count('\n'), elapsed, done.returncode


class Adding:
    """One run of `veduta add`, its lines as they come."""

    def __init__(self, path, threads):
        self.lines = []
        self.process = subprocess.Popen(add_command(path, threads), stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL)
        self.reader = threading.Thread(target=self.read)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            if line.endswith(b'\n'):  # half a line acknowledges nothing
                self.lines.append(json.loads(line))

    def kill_after(self, seconds, line_count):
        """Kills once both have passed; whether it was still running."""
        start = time.monotonic()
        while self.process.poll() is None and len(self.lines) < line_count:
            time.sleep(0.001)
            start = time.monotonic()
        while self.process.poll() is None and time.monotonic() < start + seconds:
            time.sleep(min(0.001, max(0, start + seconds - time.monotonic())))
        self.process.send_signal(signal.SIGKILL)
        code = self.process.wait()
        self.reader.join()
        return code == -signal.SIGKILL


def pick_instant(done):
    """Kind, seconds, lines. A run goes over the `done` photos that are there, with one line for
    each, and then adds the others."""
    rest = photo_count - done
    kind = rng.random()
    if kind < 0.10:
        return 'early', rng.uniform(0, 0.08), 0
    if kind < 0.20 or rest == 0:
        return 'late', rng.uniform(0, 0.02), photo_count
    if kind < 0.50:
        return 'acknowledged', rng.uniform(0, 0.02), done + rng.randint(1, min(4, rest))
    return 'anywhere', rng.uniform(0, min(4, rest)) * seconds_a_photo, done


def phase_of(lines, done):
    """What the process was at when it was killed."""
    if lines == 0:
        return 'before its first photo'
    if lines < done:
        return 'going over what was there'
    return 'adding a photo' if lines < photo_count else 'after the last photo'


def was_doubted(path, image):
    code, out, _ = run('journal', path)
    entries = [json.loads(line) for line in out.splitlines()] if code == 0 else []
    return any(entry['action'] == 'doubt' and entry['image'] == image for entry in entries)


def check_photo(path, name, acknowledged):
    code, out, err = run('show', path, name, '--json')
    if code != 0:
        return fail(f'{name} was acknowledged as {acknowledged["verdict"]} and is gone: '
                    f'{err.strip()}')
    shown = json.loads(out)
    said, is_now = acknowledged['verdict'], shown['verdict']
    # By what followed from it or from a later one a postponed photo may have been placed since, and
    # a placed one may have lost its pose, where evidence has turned against it, and got another.
    held = said in (None, is_now) or (said == 'postponed' and is_now in PLACED) or was_doubted(
        path, shown['id'])
    if not held or shown['id'] != acknowledged['id']:
        fail(f'{name} was acknowledged as {said}, id {acknowledged["id"]}, and is {is_now}, id '
             f'{shown["id"]}')
    counts['photos'] += 1


def check_after_kill(path, fresh, acknowledged):
    code, out, err = run('verify', path)
    if code != 0:
        fail(f'verify ended with {code}: {(out + err).strip()}')
    older = [name for name in acknowledged if name not in fresh]
    for name in list(fresh) + rng.sample(older, min(5, len(older))):
        check_photo(path, name, acknowledged[name])


def one_database(index, threads, kills_max):
    """Kills and restarts until the command ends by itself, at most kills_max times. Returns the
    number of kills."""
    path = os.path.join(work, f'killed_{index}')
    new_database(path)
    acknowledged, kills, history, done = {}, 0, [], 0
    while not failures:
        adding = Adding(path, threads)
        kind, seconds, lines = pick_instant(done)
        if kills == kills_max or (done == photo_count and rng.random() < 0.5):
            seconds, lines = 1e9, 0  # enough: let it end
        killed = adding.kill_after(seconds, lines)
        fresh = {}
        for line in adding.lines:
            if line['id'] is None or line['image'] in acknowledged:
                continue
            own = f'the same bytes are stored as {line["image"]}'
            if line['verdict'] == 'duplicate' and line['reason'] != own:
                continue  # stored under another name
            # A duplicate that nobody was told of: it was killed between its commit and its line.
            fresh[line['image']] = {**line,
                                    'verdict': None} if line['verdict'] == 'duplicate' else line
        acknowledged.update(fresh)
        told = len(adding.lines)
        if not killed:
            # What was rejected is a duplicate by now where the same bytes were kept since.
            if adding.process.returncode not in (0, end_code):
                fail(f'the last run ended with {adding.process.returncode}, undisturbed it ends '
                     f'with {end_code}')
            break
        kills += 1
        phases[phase_of(told, done)] += 1
        done = max(done, told)
        history.append(f'{kind} {seconds:.3f} s, {len(adding.lines)} lines')
        check_after_kill(path, fresh, acknowledged)
    check_after_kill(path, acknowledged, acknowledged)
    got = run('digest', path)[1].strip()
    if got != digest:
        fail(f'digest {got} after {kills} kills, {digest} without; {threads} threads; kills: '
             + '; '.join(history))
    print(f'database {index}: {threads} threads, {kills} kills, {len(acknowledged)} photos, '
          f'{"FAILED" if failures else "ok"}', flush=True)
    if not failures:
        subprocess.run(['rm', '-rf', path], check=True)
    return kills


counts = {'init': 0, 'photos': 0}
list_path, sent_folder = write_list()
phases = collections.Counter()
digest, photo_count, elapsed, end_code = undisturbed(1)
print(f'undisturbed, 1 thread: {photo_count} photos in {elapsed:.1f} s, digest {digest[:16]}',
      flush=True)
digest_2, _, elapsed, _ = undisturbed(2)
print(f'undisturbed, 2 threads: {elapsed:.1f} s, digest {digest_2[:16]}', flush=True)
if digest_2 != digest:
    fail(f'two threads give another city: {digest_2}, one gives {digest}')
seconds_a_photo = elapsed / max(1, photo_count)
kills_done = databases = 0
while kills_done < kills_wanted and not failures:
    databases += 1
    left = kills_wanted - kills_done
    # Both numbers of threads get their turn, however few the kills.
    kills_done += one_database(databases, 1 + databases % 2, (left + 1) // 2 if databases == 1
                               else left)
told = ', '.join(f'{count} {phase}' for phase, count in phases.most_common())
print(f'{kills_done} kills of add over {databases} databases ({told}) and {counts["init"]} of '
      f'init; '
      f'{counts["photos"]} looks at acknowledged photos; {len(failures)} failures')
if failures:
    os.rename(work, work + '.failed')
    print(f'what is left of it: {work}.failed')
sys.exit(1 if failures else 0)
