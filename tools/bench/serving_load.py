#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Measures the daemon under the load of several clients. What is measured, by the name of --what:
# orders    eight clients send all photos in an order of their own, as often as --seeds says; the
#           same photos by `veduta add` in the order of the journal have to give the same digest
# localize  every fourth photo is held back, and eight clients ask where it was taken, while three
#           clients send the others, and afterwards; with --truth, how many answers are right: the
#           poses that are stored at that moment are fitted to the truth by a similarity
# dense     the last --sent photos are sent one after the other, each when the one before it was
#           judged, into a city of the others: five beside a dense pass, five while it is paused,
#           and so on, so that other work on the machine weighs on both alike
# usage: tools/bench/serving_load.py VEDUTA PHOTOS CAMERA --what orders|localize|dense
#          [--truth FOLDER] [--seeds N] [--sent N] [--dense-size N] [--rounds N]
#   CAMERA: WIDTHxHEIGHT,fx,fy,cx,cy[,...]
import argparse
import concurrent.futures
import itertools
import math
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse

from serving import SENDERS, Served, make_database, photos_in

CLIENTS = 8
BLOCK = 5                 # photos beside a dense pass, and then without
FITTED_MIN = 6            # images of a reconstruction that are fitted to the truth
ERROR_M, ERROR_DEG = 0.5, 2.0  # of a right answer
JPEG = {'Content-Type': 'image/jpeg'}


def read(path):
    with open(path, 'rb') as file:
        return file.read()


def told(times):
    """Median and 99th percentile, of seconds."""
    times = sorted(times)
    at = [times[min(len(times) - 1, math.ceil(share * len(times)) - 1)] for share in (0.5, 0.99)]
    return f'median {at[0]:.2f} s, 99th percentile {at[1]:.2f} s, of {len(times)}'


def product(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transposed(a):
    return [list(row) for row in zip(*a)]


def rotation_of(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def fit(from_points, to_points, turns):
    """Scale, rotation and translation of the similarity that fits best: Horn, Closed-form solution
    of absolute orientation using unit quaternions, 1987. `turns`: the rotations that the photos'
    own orientations ask for, which count as much as the points do: photos of a street stand in a
    line, and points in a line leave open how far all is turned about it."""
    count = len(from_points)
    means = [[sum(column) / count for column in zip(*points)]
             for points in (from_points, to_points)]
    a, b = ([[x - m for x, m in zip(point, mean)] for point in points]
            for points, mean in zip((from_points, to_points), means))
    s = product(transposed(a), b)
    size = math.sqrt(sum(x * x for row in s for x in row))
    s = [[s[i][j] / size + sum(turn[j][i] for turn in turns) / count for j in range(3)]
         for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = s
    n = [[xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
         [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]]
    # The eigenvector of the largest eigenvalue: squared again and again, the matrix becomes it.
    size = math.sqrt(sum(x * x for row in n for x in row))
    n = [[x / size + (i == j) for j, x in enumerate(row)] for i, row in enumerate(n)]
    for _ in range(60):
        n = product(n, n)
        largest = max(abs(x) for row in n for x in row)
        n = [[x / largest for x in row] for row in n]
    q = max(n, key=lambda row: sum(x * x for x in row))
    length = math.sqrt(sum(x * x for x in q))
    rotation = rotation_of(*(x / length for x in q))
    turned = [[sum(x * y for x, y in zip(row, point)) for row in rotation] for point in a]
    scale = sum(x * y for p, t in zip(b, turned) for x, y in zip(p, t)) / sum(
        x * x for p in a for x in p)
    shift = [m - scale * sum(x * y for x, y in zip(row, means[0]))
             for m, row in zip(means[1], rotation)]
    return scale, rotation, shift


class Truth:
    """Where photos were taken: NAME.camera, as of Strecha's sets."""

    def __init__(self, folder):
        self.poses = {}  # rotation from camera to world, centre in metres
        for name in os.listdir(folder):
            if name.endswith('.camera'):
                rows = [[float(x) for x in line.split()]
                        for line in read(os.path.join(folder, name)).decode().splitlines()]
                self.poses[name.removesuffix('.camera')] = rows[4:7], rows[7]

    def errors(self, name, answer, stored):
        """Metres and degrees by which a localised photo is off; None where too few stored photos
        are there to tell."""
        known = [photo for photo in stored if photo['center'] and
                 photo['reconstruction'] == answer['reconstruction']]
        if len(known) < FITTED_MIN:
            return None
        scale, rotation, shift = fit(
            [photo['center'] for photo in known],
            [self.poses[photo['image']][1] for photo in known],
            [product(self.poses[photo['image']][0], rotation_of(*photo['rotation_wxyz']))
             for photo in known])
        world_from_cam, center = self.poses[name]
        off = [scale * sum(x * y for x, y in zip(row, answer['pose']['center'])) + s - c
               for row, s, c in zip(rotation, shift, center)]
        turn = product(product(rotation_of(*answer['pose']['rotation_wxyz']),
                               transposed(rotation)), world_from_cam)
        cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2
        return math.hypot(*off), math.degrees(math.acos(max(-1, min(1, cosine))))


class Asking:
    """Clients that ask where photos were taken, each all of them in an order of its own."""

    def __init__(self, served, photos, truth):
        self.served, self.photos, self.truth = served, photos, truth
        self.times = []
        self.localized = self.judged = self.right = 0
        self.worst = (0, 0)
        self.lock, self.ends = threading.Lock(), threading.Event()

    def ask(self, path):
        start, name = time.monotonic(), os.path.basename(path)
        query = urllib.parse.urlencode({'camera': 'c', 'name': name})
        code, answer = self.served.ask('POST', '/v1/localize?' + query, read(path), JPEG)
        seconds = time.monotonic() - start
        assert code == 200, (code, answer)
        errors = None
        if answer['verdict'] == 'localized' and self.truth:
            stored = self.served.ask('GET', '/v1/photos?count=1000')[1]
            errors = self.truth.errors(name, answer, stored)
        with self.lock:
            self.times.append(seconds)
            self.localized += answer['verdict'] == 'localized'
            if errors:
                self.judged += 1
                self.right += errors[0] <= ERROR_M and errors[1] <= ERROR_DEG
                self.worst = tuple(map(max, self.worst, errors))

    def repeat(self, number, rounds):
        rng = random.Random(number)
        while rounds != 0 and not self.ends.is_set():
            for path in rng.sample(self.photos, len(self.photos)):
                if not self.ends.is_set():
                    self.ask(path)
            rounds -= 1

    def start(self, rounds=-1):
        """Asks for each photo `rounds` times; -1: until it is stopped."""
        self.pool = concurrent.futures.ThreadPoolExecutor(CLIENTS)
        self.clients = [self.pool.submit(self.repeat, i, rounds) for i in range(CLIENTS)]

    def wait(self):
        for client in self.clients:
            client.result()
        self.pool.shutdown()
        text = f'{told(self.times)}; {self.localized} localised'
        if self.truth:
            text += (f'; {self.right} right of {self.judged} that could be judged, the worst off '
                     f'by {self.worst[0]:.2f} m and {self.worst[1]:.2f} degrees')
        return text


def measure_orders(args, photos, folder):
    """Whether all digests are the same."""
    is_same = True
    for seed in range(1, args.seeds + 1):
        order = random.Random(seed).sample(photos, len(photos))
        paths = {os.path.basename(path): path for path in photos}
        db, again = (make_database(args.veduta, os.path.join(folder, f'{what}{seed}'), args.camera)
                     for what in ('served', 'added'))
        served, start = Served(args.veduta, db), time.monotonic()
        with concurrent.futures.ThreadPoolExecutor(CLIENTS) as pool:
            list(pool.map(lambda i: [served.send(path, f'who{i}') for path in order[i::CLIENTS]],
                          range(CLIENTS)))
        seconds = time.monotonic() - start
        stored = served.ask('GET', '/v1/photos?count=1000')[1]
        served.stop()
        subprocess.run([args.veduta, 'settle', db], check=True, capture_output=True)
        # A run of photos of one contributor is added by one command.
        for who, run in itertools.groupby(stored, lambda photo: photo['contributor']):
            subprocess.run([args.veduta, 'add', again, '--camera', 'c', '--contributor', who,
                            *(paths[photo['image']] for photo in run)], check=True,
                           capture_output=True)
        digests = [subprocess.run([args.veduta, 'digest', path], check=True, capture_output=True,
                                  text=True).stdout.strip() for path in (db, again)]
        is_same = is_same and digests[0] == digests[1]
        placed = sum(photo['center'] is not None for photo in stored)
        print(f'seed {seed}: {len(stored)} photos by {CLIENTS} clients in {seconds:.2f} s, '
              f'{placed} with a pose, digest {digests[0][:16]}, by `veduta add` '
              f'{digests[1][:16]}', flush=True)
    return is_same


def measure_localize(args, photos, folder):
    asked, sent = photos[::4], [path for i, path in enumerate(photos) if i % 4]
    served = Served(args.veduta, make_database(args.veduta, os.path.join(folder, 'city'),
                                               args.camera))
    truth = Truth(args.truth) if args.truth else None
    beside, start = Asking(served, asked, truth), time.monotonic()
    beside.start()
    with concurrent.futures.ThreadPoolExecutor(SENDERS) as pool:
        list(pool.map(served.send, sent))
    seconds = time.monotonic() - start
    beside.ends.set()
    print(f'while {len(sent)} photos came in ({seconds:.1f} s), {len(asked)} held back: '
          f'{beside.wait()}', flush=True)
    alone = Asking(served, asked, truth)
    alone.start(args.rounds)
    print(f'afterwards: {alone.wait()}', flush=True)
    served.stop()


def measure_dense(args, photos, folder):
    db = make_database(args.veduta, os.path.join(folder, 'city'), args.camera)
    subprocess.run([args.veduta, 'add', db, '--camera', 'c', *photos[:-args.sent]], check=True,
                   capture_output=True)
    served = Served(args.veduta, db, '--dense', '--device', 'cpp', '--dense-size',
                    str(args.dense_size))

    def state():
        return served.ask('GET', '/v1/dense')[1]['state']

    times = {'paused': [], 'working': []}
    for start in range(len(photos) - args.sent, len(photos), BLOCK):
        wanted = 'working' if start // BLOCK % 2 else 'paused'
        served.ask('POST', '/v1/dense/' + ('resume' if wanted == 'working' else 'pause'))
        deadline = time.monotonic() + 300
        while state() != wanted:
            assert time.monotonic() < deadline, f'the dense pass is {state()}, and not {wanted}'
            time.sleep(0.1)
        for path in photos[start:start + BLOCK]:
            begun = time.monotonic()
            served.send(path)
            seconds = time.monotonic() - begun
            if state() == wanted:  # the pass has not come to its end meanwhile
                times[wanted].append(seconds)
    for what, seconds in times.items():
        print(f'the dense pass is {what}: {told(seconds)} photos', flush=True)
    served.stop()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('veduta')
    parser.add_argument('photos')
    parser.add_argument('camera')
    parser.add_argument('--what', choices=('orders', 'localize', 'dense'), required=True)
    parser.add_argument('--truth', help='folder of NAME.camera')
    parser.add_argument('--seeds', type=int, default=5)
    parser.add_argument('--sent', type=int, default=60)
    parser.add_argument('--dense-size', type=int, default=768)
    parser.add_argument('--rounds', type=int, default=2)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        photos = photos_in(args.photos)
        if args.what == 'orders':
            return 0 if measure_orders(args, photos, folder) else 1
        {'localize': measure_localize, 'dense': measure_dense}[args.what](args, photos, folder)
    return 0


if __name__ == '__main__':
    sys.exit(main())
