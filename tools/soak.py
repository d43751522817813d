#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# A daemon under mixed load with faults for as long as is wanted: people who send photos and read,
# forms, uploads in parts that are left half done, clients that vanish, messages that are none, a
# line that is full, a disk that is full for a while, photos that are removed and sent again. Says
# how memory and file handles have gone, whether all that was accepted is there, and whether the
# database is sound. After the first third the city grows no more, so memory should not either.
# usage: tools/soak.py VEDUTA PHOTOS CAMERA [--minutes N] [--seed N] [--keep FOLDER]
#   CAMERA: WIDTHxHEIGHT,fx,fy,cx,cy
# Exit code 1 where something was lost, was answered wrongly, or has grown.
import argparse
import base64
import collections
import contextlib
import hashlib
import http.client
import json
import os
import random
import resource
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse

TUS = {'Tus-Resumable': '1.0.0'}
PART = 'application/offset+octet-stream'
SAMPLE_S = 2
# Growth of the median from the second to the last third that is no leak: what allocators and
# RocksDB's caches take on the way.
MEMORY_SHARE, MEMORY_MB, HANDLES = 1.10, 48, 16
QUESTIONS = ('/v1/status', '/v1/photos?count=100', '/v1/reconstructions', '/v1/journal?count=50',
             '/v1/stac/search?limit=20', '/v1/reconstructions/1/points', '/metrics', '/healthz',
             '/v1/uploads', '/v1/photos/none/pose', '/v1/openapi.json', '/')


class Soak:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        names = sorted(os.listdir(options.photos))
        self.photos = {}
        for name in names:
            with open(os.path.join(options.photos, name), 'rb') as file:
                self.photos[name] = file.read()
        self.db = os.path.join(folder, 'soak.veduta')
        self.run('init', self.db)
        size, _, params = options.camera.partition(',')
        self.run('camera', 'add', self.db, 'c', '--size', size, '--params', params)
        self.counts = collections.Counter()  # by what was done and what was answered
        self.faults = []                     # what must not be
        self.accepted = {}                   # names, by the SHA-256 of what was accepted
        self.lock = threading.Lock()
        self.samples = []                    # (seconds, memory in MB, handles)
        self.ends = threading.Event()
        self.daemon = subprocess.Popen(
            [options.veduta, 'serve', self.db, '--http', '127.0.0.1:0', '--json',
             '--waiting', '24'], stdout=subprocess.PIPE)
        self.host = json.loads(self.daemon.stdout.readline())['http'].removeprefix('http://')
        # What it prints of photos is read by nobody, and the pipe must not fill.
        threading.Thread(target=self.daemon.stdout.read, daemon=True).start()

    def run(self, *arguments, codes=(0,)):
        done = subprocess.run([self.options.veduta, *arguments], capture_output=True, text=True)
        if done.returncode not in codes:
            sys.exit(f'soak.py: {arguments} ended with {done.returncode}: {done.stderr}')
        return done.stdout

    def ask(self, method, path, body=None, headers={}):
        with contextlib.closing(http.client.HTTPConnection(self.host, timeout=120)) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    def note(self, what, code, body, expected):
        with self.lock:
            self.counts[f'{what} {code}'] += 1
            if code not in expected and len(self.faults) < 20:
                self.faults.append(f'{what} is answered by {code}: {body[:300]}')

    def accept(self, name, data):
        with self.lock:
            self.accepted[hashlib.sha256(data).hexdigest()] = name

    def connect(self):
        host, _, port = self.host.rpartition(':')
        return socket.create_connection((host, int(port)), timeout=30)

    def pick(self, rng):
        """The first photo is the one that is removed and sent again."""
        name = rng.choice(list(self.photos)[1:])
        return name, self.photos[name]

    # What clients do, each a piece of a second or so.
    def send(self, rng):
        name, data = self.pick(rng)
        headers = {'Content-Type': 'image/jpeg'}
        if rng.random() < 0.3:
            headers['Prefer'] = 'respond-async'
        query = urllib.parse.urlencode({'name': name, 'contributor': f'who{rng.randrange(3)}',
                                        'camera': 'c'})
        code, _, body = self.ask('POST', '/v1/photos?' + query, data, headers)
        self.note('photo', code, body, (201, 202, 409, 422, 429, 503))
        if code in (201, 202):
            self.accept(name, data)

    def send_what_is_no_photo(self, rng):
        data = self.pick(rng)[1][:2000] if rng.random() < 0.5 else b'no photo at all'
        code, _, body = self.ask('POST', f'/v1/photos?name=bad{len(data)}.jpg&camera=c', data,
                                 {'Content-Type': 'image/jpeg'})
        self.note('no photo', code, body, (202, 409, 422, 429, 503))

    def send_form(self, rng):
        parts, sent = b'', [self.pick(rng) for _ in range(2)]
        for name, data in sent:
            parts += (f'--soak\r\nContent-Disposition: form-data; name="p"; filename="{name}"\r\n'
                      'Content-Type: image/jpeg\r\n\r\n').encode() + data + b'\r\n'
        form = parts + b'--soak--\r\n'
        is_cut = rng.random() < 0.3
        if is_cut:
            form = form[:rng.randrange(len(form) - 20)]
        code, _, body = self.ask('POST', '/v1/photos?camera=c', form,
                                 {'Content-Type': 'multipart/form-data; boundary=soak'})
        self.note('cut form' if is_cut else 'form', code, body,
                  (400, 503) if is_cut else (202, 409, 429, 503))
        if code == 202:
            for one, (name, data) in zip(json.loads(body)['photos'], sent):
                if one['status'] == 202:
                    self.accept(name, data)

    def send_in_parts(self, rng):
        name, data = self.pick(rng)
        pairs = {'filename': name, 'camera': 'c', 'contributor': 'tus'}
        metadata = ','.join(f'{key} {base64.b64encode(value.encode()).decode()}'
                            for key, value in pairs.items())
        code, headers, body = self.ask('POST', '/v1/tus', b'', {
            **TUS, 'Upload-Length': str(len(data)), 'Upload-Metadata': metadata})
        self.note('tus begin', code, body, (201, 429, 503))
        if code != 201:
            return
        path, offset = headers['Location'], 0
        stops_at = rng.choice((len(data), len(data), len(data) // 2))
        while offset < stops_at:
            part = data[offset:min(offset + 40_000, stops_at)]
            if rng.random() < 0.2:
                self.vanish(f'PATCH {path} HTTP/1.1\r\nHost: {self.host}\r\n'
                            f'Tus-Resumable: 1.0.0\r\nContent-Type: {PART}\r\n'
                            f'Upload-Offset: {offset}\r\n', part)
            code, headers, body = self.ask('PATCH', path, part, {
                **TUS, 'Content-Type': PART, 'Upload-Offset': str(offset)})
            self.note('tus part', code, body, (204, 409, 503))
            code, headers, _ = self.ask('HEAD', path, headers=TUS)
            self.note('tus head', code, b'', (200, 503))
            if code == 200:
                offset = int(headers['Upload-Offset'])
            if self.ends.is_set():
                return
        if offset == len(data):
            self.accept(name, data)
        elif rng.random() < 0.8:  # the others lie about until they are given up
            self.note('tus end', self.ask('DELETE', path, headers=TUS)[0], b'', (204, 503))

    def vanish(self, head, data):
        """Sends half of a body, and goes."""
        with contextlib.suppress(OSError), self.connect() as client:
            client.sendall(head.encode() + f'Content-Length: {len(data)}\r\n\r\n'.encode())
            client.sendall(data[:len(data) // 2])
        self.note('vanished', 0, b'', (0,))

    def send_half(self, rng):
        name, data = self.pick(rng)
        kind = rng.choice(('image/jpeg', 'multipart/form-data; boundary=soak'))
        path = rng.choice((f'/v1/photos?name={name}&camera=c', '/v1/localize?camera=c'))
        self.vanish(f'POST {path} HTTP/1.1\r\nHost: {self.host}\r\nContent-Type: {kind}\r\n', data)

    def send_nonsense(self, rng):
        text = rng.choice((
            rng.randbytes(rng.randrange(1, 4000)), b'GET / HTTP/9.9\r\n\r\n', b'GET\r\n\r\n',
            b'POST /v1/photos HTTP/1.1\r\nContent-Length: -1\r\n\r\n',
            b'POST /v1/photos HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n',
            b'GET /' + b'a' * 100_000 + b' HTTP/1.1\r\n\r\n', b'\0' * 5000))
        with contextlib.suppress(OSError), self.connect() as client:
            client.sendall(text)
            client.settimeout(0.2)
            client.recv(1000)
        self.note('nonsense', 0, b'', (0,))

    def read(self, rng):
        name = self.pick(rng)[0]
        path = rng.choice((*QUESTIONS, *(f'/v1/photos/{name}{what}' for what in (
            '', '/pose', '/neighbors', '/thumbnail?side=256', '/uncertainty'))))
        code, _, body = self.ask('GET', path)
        # A name of several contributors' photos is no answer.
        self.note('question', code, body, (200, 400, 404, 503))

    def follow(self, rng):
        with contextlib.suppress(OSError), self.connect() as client:
            client.sendall(f'GET /v1/events?from=1 HTTP/1.1\r\nHost: {self.host}\r\n\r\n'.encode())
            client.recv(1000)
            time.sleep(rng.uniform(0, 1))
        self.note('follower', 0, b'', (0,))

    def localize(self, rng):
        code, _, body = self.ask('POST', '/v1/localize?camera=c&name=x', self.pick(rng)[1],
                                 {'Content-Type': 'image/jpeg'})
        self.note('localize', code, body, (200, 422, 429, 503))

    def remove_and_send(self, rng):
        name = next(iter(self.photos))
        query = urllib.parse.urlencode({'name': name, 'contributor': 'gone', 'camera': 'c'})
        code, _, body = self.ask('POST', '/v1/photos?' + query, self.photos[name],
                                 {'Content-Type': 'image/jpeg'})
        self.note('photo that goes', code, body, (201, 202, 409, 429, 503))
        done = subprocess.run([self.options.veduta, 'remove', self.db, f'gone/{name}'],
                              capture_output=True, text=True)
        self.note('remove', done.returncode, done.stderr, (0, 1, 3))
        time.sleep(10)

    def fill_disk(self, rng):
        """A limit on the size of files stands for a full disk."""
        time.sleep(20)
        pid, endless = self.daemon.pid, resource.RLIM_INFINITY
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (1000, endless))
        time.sleep(2)
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (endless, endless))
        self.note('full disk', 0, b'', (0,))

    def repeat(self, what, seed):
        rng = random.Random(seed)
        while not self.ends.is_set():
            try:
                what(rng)
            except (OSError, http.client.HTTPException) as error:
                if not self.ends.is_set():
                    self.note(what.__name__, 'broke', repr(error).encode(), ())
                time.sleep(0.5)
            time.sleep(rng.uniform(0, 0.1))

    def sample(self, since):
        with open(f'/proc/{self.daemon.pid}/status') as file:
            kb = next(int(line.split()[1]) for line in file if line.startswith('VmRSS'))
        handles, folder = 0, f'/proc/{self.daemon.pid}/fd'
        for handle in os.listdir(folder):
            with contextlib.suppress(OSError):  # it was closed meanwhile
                # RocksDB keeps the tables open that the city has.
                handles += not os.readlink(os.path.join(folder, handle)).startswith(self.db)
        self.samples.append((time.monotonic() - since, kb / 1024, handles))
        return self.samples[-1]

    def go_on(self):
        work = [self.send] * 2 + [self.read] * 3 + [
            self.send_what_is_no_photo, self.send_form, self.send_in_parts, self.send_half,
            self.send_nonsense, self.follow, self.localize, self.remove_and_send, self.fill_disk]
        threads = [threading.Thread(target=self.repeat, args=(what, f'{self.options.seed} {i}'))
                   for i, what in enumerate(work)]
        start = time.monotonic()
        idle = self.sample(start)
        for thread in threads:
            thread.start()
        while time.monotonic() < start + self.options.minutes * 60 and self.daemon.poll() is None:
            time.sleep(SAMPLE_S)
            if self.daemon.poll() is None:
                self.sample(start)
        self.ends.set()
        for thread in threads:
            thread.join()
        if self.daemon.poll() is not None:
            self.faults.append(f'the daemon has ended with {self.daemon.returncode}')
            return
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
        deadline = time.monotonic() + 180
        while json.loads(self.ask('GET', '/v1/uploads')[2]) and time.monotonic() < deadline:
            time.sleep(0.5)
        time.sleep(5)
        self.judge_growth(idle, self.sample(start))

    def judge_growth(self, idle, end):
        third = len(self.samples) // 3
        middle, last = self.samples[third:2 * third], self.samples[2 * third:-1]
        for what, column, limit in (
                ('memory in MB', 1, lambda before: before * MEMORY_SHARE + MEMORY_MB),
                ('file handles', 2, lambda before: before + HANDLES)):
            before, after = (statistics.median(one[column] for one in part)
                             for part in (middle, last))
            most = max(one[column] for one in self.samples)
            print(f'{what}: {idle[column]:.0f} at the start, median {before:.0f} in the second '
                  f'third, {after:.0f} in the last, {most:.0f} at most, {end[column]:.0f} at rest')
            if after > limit(before):
                self.faults.append(f'{what} has grown from {before:.0f} to {after:.0f}')
        if end[2] > idle[2] + HANDLES:
            self.faults.append(f'{end[2]} file handles are open at rest, {idle[2]} at the start')

    def judge_photos(self):
        missing = []
        for digest, name in self.accepted.items():
            code, _, body = self.ask('GET', f'/v1/photos/{digest}')
            if code != 200:
                missing.append(f'{name}: {code} {body[:100]}')
        print(f'{len(self.accepted)} photos were accepted, {len(missing)} of them are not there')
        self.faults += missing
        self.daemon.terminate()
        if self.daemon.wait(timeout=60) != 0:
            self.faults.append(f'the daemon ended with {self.daemon.returncode}')
        verdict = self.run('verify', self.db, codes=(0, 1, 3))
        print('verify:', verdict.strip())
        if verdict != 'sound\n':
            self.faults.append('the database is not sound')


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('veduta')
    parser.add_argument('photos')
    parser.add_argument('camera')
    parser.add_argument('--minutes', type=float, default=60)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--keep', help='an empty folder for the database, which stays')
    options = parser.parse_args()
    with contextlib.ExitStack() as stack:
        folder = options.keep or stack.enter_context(tempfile.TemporaryDirectory(prefix='soak_'))
        soak = Soak(options, folder)
        stack.callback(soak.daemon.kill)
        soak.go_on()
        if soak.daemon.poll() is None:
            soak.judge_photos()
        for what, count in sorted(soak.counts.items()):
            print(f'  {what}: {count}')
    for fault in soak.faults:
        print('FAILED:', fault)
    return 1 if soak.faults else 0


if __name__ == '__main__':
    sys.exit(main())
