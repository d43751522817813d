#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Measures the daemon on photos: how many questions it answers in a second when nothing else is
# done, how long answers take while photos come in, and how much longer the photos take for it.
# Questions are asked by wrk (Debian's package of that name).
# With the program veduta-bench-rpc the same is asked by RPC.
# usage: tools/bench/serving.py VEDUTA PHOTOS CAMERA [--clients N] [--rate N] [--seconds N]
#          [--rpc VEDUTA_BENCH_RPC]
#   CAMERA: WIDTHxHEIGHT,fx,fy,cx,cy
import argparse
import concurrent.futures
import contextlib
import http.client
import json
import os
import re
import subprocess
import tempfile
import time
import urllib.parse

SENDERS = 3  # connections that photos come by: one is placed while others are prepared

# Each connection asks for poses and neighbours in turn, after a pause that differs each time, so
# that they do not all ask at once. PAUSE_MS is its mean.
SCRIPT = '''
local paths, next_path = {PATHS}, 0
function request()
  next_path = next_path + 1
  return wrk.format("GET", paths[next_path % #paths + 1])
end
PAUSE
function done(summary, latency)
  io.write(string.format("figures %.3f %.3f %.3f %.0f\\n", latency:percentile(50) / 1000,
    latency:percentile(99) / 1000, latency.max / 1000,
    summary.requests / summary.duration * 1e6))
end
'''


class Served:
    def __init__(self, veduta, db, *more):
        self.process = subprocess.Popen(
            [veduta, 'serve', db, '--http', '127.0.0.1:0', '--listen', '127.0.0.1:0', '--json',
             *more], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        started = json.loads(self.process.stdout.readline())
        self.address, self.rpc = started['http'], started['rpc']
        # What it prints of photos is read by nobody, and the pipe must not fill.
        self.drain = subprocess.Popen(['cat'], stdin=self.process.stdout,
                                      stdout=subprocess.DEVNULL)

    def processor_s(self):
        """Processor time that the daemon has used, which tells more than the clock on a machine
        where others work."""
        with open(f'/proc/{self.process.pid}/stat', encoding='utf-8') as file:
            fields = file.read().rsplit(')', 1)[1].split()
        return sum(map(int, fields[11:13])) / os.sysconf('SC_CLK_TCK')

    def stop(self):
        self.process.terminate()
        self.process.wait()
        self.drain.wait()

    def ask(self, method, path, body=None, headers={}):
        """The code and the JSON of the answer."""
        host = self.address.removeprefix('http://')
        with contextlib.closing(http.client.HTTPConnection(host)) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, json.loads(answer.read())

    def send(self, path, contributor='anonymous'):
        query = urllib.parse.urlencode({'name': os.path.basename(path), 'camera': 'c',
                                        'contributor': contributor})
        with open(path, 'rb') as file:
            code, told = self.ask('POST', '/v1/photos?' + query, file.read(),
                                  {'Content-Type': 'image/jpeg'})
        assert code == 201, (path, code, told)


def make_database(veduta, db, camera):
    size, params = camera.split(',', 1)
    subprocess.run([veduta, 'init', db], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([veduta, 'camera', 'add', db, 'c', '--size', size, '--params', params],
                   check=True, stdout=subprocess.DEVNULL)
    return db


def photos_in(folder):
    return sorted(os.path.join(folder, name) for name in os.listdir(folder)
                  if name.lower().endswith(('.jpg', '.png')))


def wrk(folder, address, names, clients, seconds, pause_ms):
    """Starts asking; read_wrk has the figures."""
    paths = [f'/v1/photos/{urllib.parse.quote(name)}/{what}' for name in names
             for what in ('pose', 'neighbors')]
    pause = f'function delay() return math.random(0, {2 * pause_ms}) end' if pause_ms else ''
    script = os.path.join(folder, 'wrk.lua')
    with open(script, 'w') as file:
        file.write(SCRIPT.replace('PATHS', ', '.join(json.dumps(path) for path in paths))
                   .replace('PAUSE', pause))
    return subprocess.Popen(['wrk', '-t1', f'-c{clients}', f'-d{seconds}', '-s', script, address],
                            stdout=subprocess.PIPE, text=True)


def read_wrk(process):
    """Median, 99th percentile and largest latency in ms; answers a second."""
    out = process.communicate()[0]
    return re.search(r'figures (\S+) (\S+) (\S+) (\S+)', out).groups()


def by_rpc(program, address, names, seconds, clients, pipelined):
    """As read_wrk."""
    out = subprocess.run([program, address, *names, '--seconds', str(seconds), '--clients',
                          str(clients), '--pipelined', str(pipelined)], check=True,
                         stdout=subprocess.PIPE, text=True).stdout
    return tuple(out.split()[1:])


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument('veduta')
    parser.add_argument('photos')
    parser.add_argument('camera')
    parser.add_argument('--clients', type=int, default=200)
    parser.add_argument('--rate', type=int, default=2000, help='questions a second, of all clients')
    parser.add_argument('--seconds', type=int, default=5)
    parser.add_argument('--rpc', help='the program veduta-bench-rpc')
    return parser.parse_args()


def main():
    args = arguments()
    photos = photos_in(args.photos)
    names = [os.path.basename(path) for path in photos]
    pause_ms = max(1, 1000 * args.clients // args.rate)

    with tempfile.TemporaryDirectory() as folder:
        def new_database(name):
            return make_database(args.veduta, os.path.join(folder, name), args.camera)

        def send_all(served):
            start = time.monotonic()
            with concurrent.futures.ThreadPoolExecutor(SENDERS) as pool:
                list(pool.map(served.send, photos))
            return time.monotonic() - start

        start = time.monotonic()
        subprocess.run([args.veduta, 'add', new_database('added'), '--camera', 'c', *photos],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        print(f'{len(photos)} photos by `veduta add`: {time.monotonic() - start:.2f} s')
        served = Served(args.veduta, new_database('alone'))
        print(f'by the daemon, nobody asks: {send_all(served):.2f} s')

        def tell_idle(what, ask):
            start = served.processor_s()
            figures = ask()
            each_us = 1e6 * (served.processor_s() - start) / (float(figures[3]) * args.seconds)
            print(f'idle, {what}: median %s ms, 99th percentile %s, largest %s; %s answers a second'
                  % figures + f'; {each_us:.0f} us of the daemon\'s processor time each')

        for what, clients in (('one client', 1), (f'{args.clients} clients', args.clients)):
            tell_idle(f'{what} without pause', lambda clients=clients: read_wrk(
                wrk(folder, served.address, names, clients, args.seconds, 0)))
        if args.rpc:
            for clients, pipelined in ((1, 1), (args.clients, 1), (8, 32)):
                tell_idle(f'by RPC, {clients} clients with {pipelined} questions each',
                          lambda clients=clients, pipelined=pipelined: by_rpc(
                              args.rpc, served.rpc, names, args.seconds, clients, pipelined))
        served.stop()
        served = Served(args.veduta, new_database('beside'))
        # Longer than the photos take at any rate; it is ended when they are in.
        asking = wrk(folder, served.address, names, args.clients, 3600, pause_ms)
        seconds = send_all(served)
        asking.send_signal(subprocess.signal.SIGINT)
        figures = read_wrk(asking)
        print(f'by the daemon, {args.clients} clients ask meanwhile: {seconds:.2f} s; median %s '
              'ms, 99th percentile %s, largest %s; %s answers a second' % figures)
        served.stop()


if __name__ == '__main__':
    main()
