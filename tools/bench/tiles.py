#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# What serving and drawing a large surface and many points takes: made-up ones in a small city,
# asked for over HTTP as a viewer does, drawn by the page in Debian's chromium without a
# graphics card.
# usage: tools/bench/tiles.py BUILD [--triangles 5000000] [--points 0]
#   BUILD: a build folder with veduta, veduta-street and veduta-bench-tiles
import argparse
import http.client
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time


def kilobytes(process, what):
    with open(f'/proc/{process.pid}/status') as file:
        return next(int(line.split()[1]) for line in file if line.startswith(what + ':'))


def get(host, path):
    """Seconds and body."""
    start = time.monotonic()
    connection = http.client.HTTPConnection(host, timeout=600)
    connection.request('GET', path)
    answer = connection.getresponse()
    body = answer.read()
    assert answer.status == 200, (path, answer.status, body)
    connection.close()
    return time.monotonic() - start, body


def nodes_below(node):
    yield node
    for child in node.get('children', []):
        yield from nodes_below(child)


def told(seconds):
    seconds = sorted(seconds)
    return (f'median {1e3 * seconds[len(seconds) // 2]:.1f} ms, '
            f'99th percentile {1e3 * seconds[int(0.99 * (len(seconds) - 1))]:.1f} ms')


class Daemon:
    def __init__(self, veduta, db):
        self.process = subprocess.Popen([veduta, 'serve', db, '--http', '127.0.0.1:0', '--json'],
                                        stdout=subprocess.PIPE)
        self.host = json.loads(self.process.stdout.readline())['http'].removeprefix('http://')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait()


def tell_memory(daemon):
    print(f'memory {kilobytes(daemon.process, "VmRSS") / 1e3:.0f} MB, at most '
          f'{kilobytes(daemon.process, "VmHWM") / 1e3:.0f} MB', flush=True)


def make_city(build, folder, triangles, points):
    veduta = os.path.join(build, 'cli', 'veduta')
    street = os.path.join(build, 'tools', 'render', 'street', 'veduta-street')
    run = lambda *command: subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    run(street, os.path.join(folder, 'street'), '--quiet', '--photos', '16', '--size', '512x384')
    db = os.path.join(folder, 'city')
    run(veduta, 'init', db)
    run(veduta, 'camera', 'add', db, 'c', '--size', '512x384', '--params',
        '450.56,450.56,255.5,191.5')
    run(veduta, 'add', db, '--camera', 'c', os.path.join(folder, 'street', 'photos'))
    start = time.monotonic()
    subprocess.run([os.path.join(build, 'tools', 'bench', 'tiles', 'veduta-bench-tiles'), db,
                    '--triangles', str(triangles), '--points', str(points)], check=True)
    print(f'stored in {time.monotonic() - start:.1f} s', flush=True)
    return veduta, db


def measure_daemon(veduta, db):
    with Daemon(veduta, db) as daemon:
        reconstruction = json.loads(get(daemon.host, '/v1/reconstructions')[1])[0]['id']
        base = f'/v1/reconstructions/{reconstruction}/surface/'
        print(f'memory at the start {kilobytes(daemon.process, "VmRSS") / 1e3:.0f} MB')
        seconds, body = get(daemon.host, base + 'tileset.json')
        root = json.loads(body)['root']
        nodes = list(nodes_below(root))
        print(f'tileset.json: {1e3 * seconds:.0f} ms, {len(body) / 1e3:.0f} kB, '
              f'{len(nodes)} tiles')
        seconds, body = get(daemon.host, base + root['content']['uri'])
        print(f'the root, first time: {seconds:.2f} s, {len(body) / 1e3:.0f} kB; memory '
              f'{kilobytes(daemon.process, "VmRSS") / 1e3:.0f} MB')
        for what, wanted in (('coarse', lambda n: 'children' in n),
                             ('leaves', lambda n: 'children' not in n)):
            answers = [get(daemon.host, base + n['content']['uri']) for n in nodes if wanted(n)]
            size = sum(len(body) for _, body in answers)
            print(f'{len(answers)} {what}: {told([s for s, _ in answers])}, '
                  f'{size / len(answers) / 1e3:.0f} kB each')
        tell_memory(daemon)
        for _ in range(3):
            seconds, body = get(daemon.host, f'/v1/reconstructions/{reconstruction}/points')
            print(f'{len(body) // 16} points: {seconds:.2f} s, {len(body) / 1e6:.1f} MB')
            tell_memory(daemon)


def measure_page(build, veduta, db):
    page = os.path.join(build, 'cli', 'page', 'copy')
    script = os.path.join(page, 'test', 'surface_frames.mjs')
    with Daemon(veduta, db) as daemon:
        for what in ('first visit, cold daemon', 'a new visitor, warm daemon'):
            print(what, flush=True)
            subprocess.run([shutil.which('node'), script, 'http://' + daemon.host,
                            shutil.which('chromium'), os.environ.get('PAGE_PICTURES', '')],
                           check=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('build')
    parser.add_argument('--triangles', type=int, default=5_000_000)
    parser.add_argument('--points', type=int, default=0)
    arguments = parser.parse_args()
    folder = tempfile.mkdtemp(prefix='veduta_tiles_')
    try:
        veduta, db = make_city(arguments.build, folder, arguments.triangles, arguments.points)
        measure_daemon(veduta, db)
        measure_page(arguments.build, veduta, db)
    finally:
        shutil.rmtree(folder)


if __name__ == '__main__':
    main()
