#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Kills a daemon at random instants while eight clients send photos (three wait for the verdict, two
# do not, three send in parts), two read, two follow the journal and the dense pass runs. After each
# kill the next daemon goes on, or `veduta verify` looks first. Once all photos are in, all that was
# promised (docs/serving.md) is checked, and the next database begins:
# - what was answered by 201, 202 or 409 is stored, once, and was there whenever it was asked for;
# - what was sent in parts never went back behind an offset that was told, and is stored once and
#   whole;
# - each entry of the journal was told once, in order, by events and by RPC, as the journal has it;
# - `verify` finds nothing, `veduta add` in the journal's order gives the same model, each placed
#   photo gets its depth map, and no process of a killed daemon is left.
# usage: tools/kill_daemon.py VEDUTA PHOTOS CAMERA KILLS [SEED]
#   CAMERA: WIDTHxHEIGHT,fx,fy,cx,cy[,...]. Exit code 1 where a promise was broken; what is left of
#   that database stays, and is named.
import collections
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

from daemon_clients import Door, Load

DENSE_SIDE_PX = 96
VERIFY_EVERY = 3      # kills
EARLY_SHARE, DENSE_SHARE = 0.1, 0.2  # of kills: while it begins; while the dense pass runs


def processes_below(pid):
    """(pid, when it began) of all that a process has started, and what these have."""
    parents = {}
    for name in filter(str.isdigit, os.listdir('/proc')):
        state = state_of(int(name))
        if state:
            parents.setdefault(state[1], []).append((int(name), state[2]))
    found, unseen = [], [pid]
    while unseen:
        below = parents.get(unseen.pop(), [])
        found += below
        unseen += [one for one, _ in below]
    return found


def state_of(pid):
    """State, parent and beginning of a process; None where there is none."""
    try:
        with open(f'/proc/{pid}/stat', encoding='utf-8', errors='replace') as file:
            fields = file.read().rsplit(')', 1)[1].split()
        return fields[0], int(fields[1]), fields[19]
    except OSError:
        return None


class Database:
    """A database, and the daemons that serve it one after another."""

    def __init__(self, veduta, folder, camera, rng):
        self.veduta, self.folder, self.camera, self.rng = veduta, folder, camera, rng
        self.path, self.socket = os.path.join(folder, 'city'), os.path.join(folder, 'rpc.sock')
        self.door = Door()
        self.moments = collections.Counter()  # what daemons were at when they were killed
        self.left = []                        # processes of killed daemons
        self.make(self.path)

    def make(self, path):
        size, _, params = self.camera.partition(',')
        self.must('init', path)
        self.must('camera', 'add', path, 'c', '--size', size, '--params', params)

    def run(self, *arguments):
        done = subprocess.run([self.veduta, *arguments], capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    def must(self, *arguments):
        code, out, err = self.run(*arguments)
        if code != 0:
            self.door.fault(f'{" ".join(arguments)} ended with {code}: {out[-500:]}{err[-500:]}')
        return out

    def begin(self):
        self.errors = open(os.path.join(self.folder, 'errors'), 'ab')
        self.daemon = subprocess.Popen(
            [self.veduta, 'serve', self.path, '--http', '127.0.0.1:0', '--json', '--dense',
             '--device', 'cpp', '--dense-size', str(DENSE_SIDE_PX), '--listen',
             'unix:' + self.socket], stdout=subprocess.PIPE, stderr=self.errors)

    def serve(self):
        """Waits until the daemon listens, and lets the clients in; whether it does."""
        line = self.daemon.stdout.readline()
        if not line:
            self.door.fault(f'the daemon ends with {self.daemon.wait()}: {self.tell_errors()}')
            return False
        threading.Thread(target=self.daemon.stdout.read, daemon=True).start()
        self.door.open(json.loads(line)['http'].removeprefix('http://'))
        return True

    def tell_errors(self):
        with open(os.path.join(self.folder, 'errors'), errors='replace') as file:
            return file.read()[-1000:]

    def wait_for_dense(self):
        """Who sends rests, until the dense pass has begun or has nothing to do."""
        self.door.be_quiet(True)
        deadline = time.monotonic() + 20
        while time.monotonic() < deadline and not self.door.faults:
            told = self.door.get('/v1/dense')
            if told is None or told['state'] == 'working' or told['passes']:
                break
            time.sleep(0.02)
        self.door.be_quiet(False)

    def live_and_die(self):
        """One daemon, from its beginning to its kill."""
        self.begin()
        kind = self.rng.random()
        if kind < EARLY_SHARE:
            time.sleep(self.rng.uniform(0, 0.3))
            self.moments['it began'] += 1
        elif self.serve():
            if kind < EARLY_SHARE + DENSE_SHARE:
                self.wait_for_dense()
                time.sleep(self.rng.uniform(0, 1.5))
            else:
                time.sleep(self.rng.uniform(0.2, 4))
            dense = self.door.get('/v1/dense')
            waiting = (self.door.get('/v1/status') or {}).get('uploads')
            at = ['photos waited'] if waiting else []
            at += ['the dense pass ran'] if dense and dense['state'] == 'working' else []
            self.moments[' and '.join(at) or 'no photo waited'] += 1
        if self.daemon.poll() is not None:
            self.door.fault(f'the daemon has ended with {self.daemon.returncode}: '
                            f'{self.tell_errors()}')
        below = processes_below(self.daemon.pid)
        self.door.close()
        self.daemon.send_signal(signal.SIGKILL)
        self.daemon.wait()
        self.errors.close()
        self.left += below

    def verify(self, *more):
        code, out, err = self.run('verify', self.path, *more)
        if (code, out) != (0, 'sound\n'):
            self.door.fault(f'verify ends with {code}: {out[-1000:]}{err[-1000:]}')

    def stop(self):
        self.door.ends.set()
        self.door.close()
        self.daemon.terminate()
        try:
            code = self.daemon.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.daemon.kill()
            code = 'a minute later not at all'
        if code != 0:
            self.door.fault(f'told to stop, the daemon ends with {code}: {self.tell_errors()}')
        time.sleep(1)
        for pid, began in self.left:
            state = state_of(pid)
            if state and state[2] == began and state[0] != 'Z':
                self.door.fault(f'process {pid} of a killed daemon is still there')

    def check_at_rest(self, load, stored):
        """What is on the disk when the last daemon has ended. `stored`: its photos, in order."""
        self.must('settle', self.path)
        self.verify()
        journal = [json.loads(line) for line in self.must('journal', self.path).splitlines()]
        told = [(entry['sequence'], entry['action'], entry['detail']) for entry in journal]
        for follower in (load.events, load.calls):
            if follower.heard != told[:len(follower.heard)]:
                self.door.fault(f'{follower.what} told other entries than the journal has')
        added = collections.Counter(entry['image'] for entry in journal if entry['action'] == 'add')
        if added != collections.Counter(photo['id'] for photo in stored):
            self.door.fault(f'not each photo was added once: {added}')
        self.check_replay(load.photos, stored)
        told = self.check_dense()
        self.verify('--deep')
        return told

    def check_dense(self):
        """A pass now gives each placed photo its depth map, but for those that it names."""
        without = [photo for line in self.must(
            'densify', self.path, '--device', 'cpp', '--size', str(DENSE_SIDE_PX),
            '--json').splitlines() for photo in json.loads(line)['without_depth']]
        told = json.loads(self.must('status', self.path, '--json'))
        maps = sum(one['depth_maps'] for one in told['reconstructions'])
        placed = sum(one['images'] for one in told['reconstructions'])
        if maps + len(without) != placed or placed != told['placed']:
            self.door.fault(f'{maps} depth maps of {placed} photos, without: {without}')
        return f'{placed} placed, {maps} depth maps'

    def check_replay(self, photos, stored):
        """The same photos by `veduta add`, in the order of the journal, give the same model. The
        digest has the dense city, too, whose voxels depend on when the first pass came."""
        again, paths = os.path.join(self.folder, 'again'), []
        self.make(again)
        for photo in stored:
            paths.append(os.path.join(self.folder, photo['image']))
            with open(paths[-1], 'wb') as file:
                file.write(photos[photo['image']])
        self.must('add', again, '--camera', 'c', *paths)
        models = []
        for path in (self.path, again):
            self.must('export', path, path + '.model')
            models.append({os.path.relpath(os.path.join(at, name), path + '.model'):
                           open(os.path.join(at, name), 'rb').read()
                           for at, _, names in os.walk(path + '.model') for name in names})
        if not models[0] or models[0] != models[1]:
            self.door.fault('`veduta add` in the order of the journal gives another model')


def one_database(index, veduta, camera, photos, kills_max, seed):
    """Kills until all photos are in, `kills_max` times at most. Number of kills, and whether all
    held."""
    folder, start = tempfile.mkdtemp(prefix='veduta_kill_'), time.monotonic()
    database = Database(veduta, folder, camera, random.Random(f'{seed} {index}'))
    door, kills, rest = database.door, 0, ''
    load = Load(door, 'unix:' + database.socket, photos, f'{seed} {index}')
    load.start()
    while kills < kills_max and load.is_sending():
        database.live_and_die()
        kills += 1
        if kills % VERIFY_EVERY == 0:
            database.verify()
    database.begin()
    stored = []
    if database.serve():
        load.wait_for_the_last()
        if not door.faults:
            load.check_answers()
            stored = door.get('/v1/photos?count=1000') or []
    database.stop()
    load.end()
    if not door.faults:
        rest = ', ' + database.check_at_rest(load, stored)
    told = [f'{count} {what}' for what, count in (*database.moments.most_common(),
                                                  *sorted(door.counts.items()))]
    print(f'database {index}: {kills} kills, {len(stored)} photos{rest}, '
          f'{time.monotonic() - start:.0f} s; {", ".join(told)}: '
          f'{"FAILED, " + folder if door.faults else "ok"}', flush=True)
    if not door.faults:
        shutil.rmtree(folder)
    return kills, not door.faults


def main():
    if len(sys.argv) not in (5, 6):
        sys.exit('usage: tools/kill_daemon.py VEDUTA PHOTOS CAMERA KILLS [SEED]')
    veduta, folder, camera, wanted = sys.argv[1:5]
    seed = sys.argv[5] if len(sys.argv) == 6 else '1'
    photos = {}
    for name in sorted(os.listdir(folder)):
        with open(os.path.join(folder, name), 'rb') as file:
            photos[name] = file.read()
    done, databases, holds = 0, 0, True
    while done < int(wanted) and holds:
        databases += 1
        kills, holds = one_database(databases, veduta, camera, photos, int(wanted) - done, seed)
        done += kills
    print(f'{done} kills of the daemon over {databases} databases; '
          f'{"all promises were kept" if holds else "a promise was broken"}')
    return 0 if holds else 1


if __name__ == '__main__':
    sys.exit(main())
