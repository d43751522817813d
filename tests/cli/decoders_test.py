#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a photo that ends the process which decodes it is refused, and costs nothing else: others
#   are placed as by `veduta add`, whoever kills decoding processes meanwhile, and nothing is left
#   open; without processes that are shut in the daemon does not begin.
# Method: real daemons on photos of a rendered street, with a decoder whose TurboJPEG has faults
#   (fragile_decoder.cc) that comments in JPEGs set off; kills at random instants while several
#   clients send; a daemon that may not use seccomp.
# usage: tests/cli/decoders_test.py VEDUTA VEDUTA_STREET FRAGILE_DECODER
import concurrent.futures
import ctypes
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

FRAGILE = sys.argv.pop(3)

import city  # noqa: E402 (it reads the arguments that are left)
from city import (PHOTO_COUNT, Case, add, at, main, make_whole, must,  # noqa: E402
                  new_database, photo, write)
from daemon import JPEG, Daemon  # noqa: E402

NUMBERS = range(1, PHOTO_COUNT + 1)
DIGEST = ''  # of the database that `veduta add` makes


def setUpModule():
    global DIGEST
    _, DIGEST = make_whole()


def name_of(number):
    return f'photo{number:04}.jpg'


def with_fault(fault, number=1):
    """The photo with a comment that sets off the fault."""
    data, comment = photo(number), b'fault:' + fault.encode()
    return data[:2] + b'\xff\xfe' + (len(comment) + 2).to_bytes(2, 'big') + comment + data[2:]


def children_of(process):
    """Process ids and states."""
    children = []
    for name in filter(str.isdigit, os.listdir('/proc')):
        try:
            with open(f'/proc/{name}/stat') as file:
                state, parent = file.read().rpartition(')')[2].split()[:2]
        except OSError:
            continue
        if int(parent) == process:
            children.append((int(name), state))
    return children


def open_count(process):
    return len(os.listdir(f'/proc/{process}/fd'))


def kill_at_random(daemon, stop, killed):
    """Kills children of decoder processes, and decoder processes that wait."""
    chance = random.Random(7)
    while not stop.wait(chance.uniform(0, 0.03)):
        processes = children_of(daemon)
        below = [child for process, _ in processes for child in children_of(process)]
        idle = processes[:1] if chance.random() < 0.4 else []
        for victim, _ in below or idle:
            try:
                os.kill(victim, signal.SIGKILL)
                killed.append(victim)
            except ProcessLookupError:
                pass


class Fragile(Case):
    """Daemons whose decoder has faults: copies of the programs, as they are installed."""

    @classmethod
    def setUpClass(cls):
        os.makedirs(at('fragile', 'bin'))
        os.makedirs(at('fragile', 'libexec', 'veduta'))
        shutil.copy(city.VEDUTA, at('fragile', 'bin', 'veduta'))
        shutil.copy(FRAGILE, at('fragile', 'libexec', 'veduta', 'veduta-decoder'))

    def serve(self, db, *more):
        return Daemon(db, *more, program=at('fragile', 'bin', 'veduta'))

    def test_a_photo_that_ends_its_decoder_is_refused(self):
        whys = {'crash': 'SIGSEGV', 'open': 'reach beyond its process',
                'loop': '20 s of the processor|longer than 80 s',
                'hoard': 'MiB that a photo of this size may'}
        with self.serve(new_database('faults'), '--threads', '2') as daemon:
            self.assertEqual(daemon.send('first.jpg', photo(1))[0], 201)
            before = open_count(daemon.process.pid)
            with concurrent.futures.ThreadPoolExecutor(8) as pool:
                sent = {fault: pool.submit(daemon.send, fault + '.jpg', with_fault(fault))
                        for fault in whys}
                others = [pool.submit(daemon.send, name_of(n), photo(n)) for n in NUMBERS[1:6]]
                for fault, answer in sent.items():
                    code, _, body = answer.result()
                    self.assertEqual((code, body['photo']['verdict']), (422, 'rejected'), body)
                    self.assertRegex(body['detail'], whys[fault])
                    self.assertIn('save it as a JPEG', body['detail'])
                for answer in others:
                    self.assertEqual(answer.result()[0], 201, answer.result()[2])
            # Questions about such a photo are answered, too.
            code, _, body = daemon.ask('POST', '/v1/localize?camera=c&name=x', with_fault('crash'),
                                       JPEG)
            self.assertIn(b'the decoder died on the photo (SIGSEGV)', body)
            code, _, body = daemon.ask('POST', '/v1/candidates?camera=c', with_fault('open'), JPEG)
            self.assertIn(b'the decoder died', body)
            metrics = daemon.ask('GET', '/metrics')[2].decode()
            deaths, = re.findall(r'^veduta_decoder_deaths_total{cause="photo"} (\d+)$', metrics,
                                 re.MULTILINE)
            self.assertGreaterEqual(int(deaths), 5)
            self.assertIn('veduta_decoder_deaths_total{cause="kill"} 0\n', metrics)
            # It may come once more, mended.
            self.assertEqual(daemon.send('crash.jpg', photo(7))[0], 201)
            self.assertLessEqual(open_count(daemon.process.pid), before + 8)
            children = children_of(daemon.process.pid)
            self.assertLessEqual(len(children), 8)
            self.assertNotIn('Z', [state for _, state in children])
            for child, _ in children:
                self.assertEqual(children_of(child), [])
        for child, _ in children:
            self.assertFalse(os.path.exists(f'/proc/{child}'), 'it ends with its daemon')

    def test_kills_cost_no_photo_and_change_nothing(self):
        db, clients, killed = new_database('killed'), 3, []
        stop = threading.Event()

        def sent(name, data):
            write(at('sent', name), data)
            return name, data

        def send_all(daemon, client):
            answers = []
            for n in NUMBERS[client::clients]:
                code, answer = daemon.send_until_taken(*sent(name_of(n), photo(n)))
                answers.append((code, answer))
                code, _, answer = daemon.send(*sent(f'{n}.jpg', with_fault('crash', n)))
                self.assertIn(code, (202, 422, 503), answer)
            return answers

        with self.serve(db, '--threads', '2') as daemon:
            killer = threading.Thread(target=kill_at_random,
                                      args=(daemon.process.pid, stop, killed))
            killer.start()
            try:
                with concurrent.futures.ThreadPoolExecutor(4) as pool:
                    sending = [pool.submit(send_all, daemon, client)
                               for client in range(clients)]
                    for answers in sending:
                        for code, answer in answers.result():
                            self.assertIn(code, (201, 202), answer)
            finally:
                stop.set()
                killer.join()
            must_wait = time.monotonic() + 200
            while daemon.get('/v1/uploads') and time.monotonic() < must_wait:
                time.sleep(0.2)
            self.assertEqual(daemon.get('/v1/uploads'), [])
            self.assertGreaterEqual(len(killed), 3)
            self.assertLessEqual(len(children_of(daemon.process.pid)), 8)
            # A process that was killed while it waited is found out when a photo comes to it.
            for n in range(PHOTO_COUNT):
                if 'Z' not in [state for _, state in children_of(daemon.process.pid)]:
                    break
                daemon.send(*sent(f'{n}-more.jpg', with_fault('crash', n + 1)))
            self.assertNotIn('Z', [state for _, state in children_of(daemon.process.pid)])
            images = daemon.get('/v1/photos?count=1000')
        must('settle', db)
        placed = [image['image'] for image in images if image['verdict'] != 'rejected']
        self.assertEqual(sorted(placed), [name_of(n) for n in NUMBERS])
        # In the same order without kills, with the photos that are refused: they count as well.
        again = new_database('killed_again')
        write(at('order'), '\n'.join(image['image'] for image in images).encode())
        done = subprocess.run([at('fragile', 'bin', 'veduta'), *city.add_command(
            again, '--decoders', 'sandboxed', '--list', at('order'), at('sent'))],
            capture_output=True)
        self.assertEqual(must('digest', again), must('digest', db), done.stderr)
        self.assertEqual(must('verify', db), 'sound\n')


class Real(Case):
    def test_the_daemon_and_add_make_the_same_city(self):
        db = new_database('served')
        with Daemon(db) as daemon:
            self.assertGreaterEqual(len(children_of(daemon.process.pid)), 1)
            for n in NUMBERS:
                self.assertEqual(daemon.send(name_of(n), photo(n))[0], 201)
            self.assertEqual(daemon.ask('GET', '/v1/photos/photo0002.jpg/thumbnail?side=64')[0],
                             200)
        must('settle', db)
        self.assertEqual(must('digest', db), DIGEST)
        sandboxed = new_database('sandboxed')
        code, _, err = add(sandboxed, city.PHOTOS, '--decoders', 'sandboxed')
        self.assertEqual((code, must('digest', sandboxed)), (0, DIGEST), err)

    def test_in_process_there_are_no_processes(self):
        with Daemon(new_database('inside'), '--decoders', 'in-process') as daemon:
            self.assertEqual(daemon.send('a.jpg', photo(1))[0], 201)
            self.assertEqual(children_of(daemon.process.pid), [])

    def test_processes_end_with_a_daemon_that_is_killed(self):
        with Daemon(new_database('gone')) as daemon:
            children = children_of(daemon.process.pid)
            daemon.stop(signal.SIGKILL)
        for child, _ in children:
            for _ in range(100):
                if not os.path.exists(f'/proc/{child}'):
                    break
                time.sleep(0.05)
            self.assertFalse(os.path.exists(f'/proc/{child}'))

    def test_without_a_decoder_it_does_not_begin(self):
        os.makedirs(at('alone'))
        alone = shutil.copy(city.VEDUTA, at('alone', 'veduta'))
        done = subprocess.run([alone, 'serve', new_database('lonely'), '--http', '127.0.0.1:0'],
                              capture_output=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout), (1, b''))
        self.assertIn(b'veduta-decoder: No such file', done.stderr)
        self.assertIn(b'--decoders in-process', done.stderr)

    def test_without_seccomp_it_does_not_begin(self):
        done = subprocess.run([city.VEDUTA, 'serve', new_database('open'), '--http',
                               '127.0.0.1:0'], capture_output=True, timeout=60,
                              preexec_fn=forbid_seccomp)
        self.assertEqual((done.returncode, done.stdout), (1, b''))
        self.assertIn(b'(seccomp)', done.stderr)
        self.assertIn(b'--decoders in-process', done.stderr)

    def test_nobody_else_starts_a_decoder(self):
        decoder = os.path.join(os.path.dirname(city.VEDUTA), 'veduta-decoder')
        done = subprocess.run([decoder], stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout), (2, b''))


def forbid_seccomp():
    """As a kernel without it: both calls that lead to it fail."""
    library = ctypes.CDLL('libseccomp.so.2', use_errno=True)
    library.seccomp_init.restype = ctypes.c_void_p
    context = ctypes.c_void_p(library.seccomp_init(0x7fff0000))  # allow what no rule names
    invalid = 0x00050000 | 22

    class Argument(ctypes.Structure):
        _fields_ = [('arg', ctypes.c_uint), ('op', ctypes.c_int), ('a', ctypes.c_uint64),
                    ('b', ctypes.c_uint64)]

    set_seccomp = (Argument * 1)(Argument(0, 4, 22, 0))  # prctl's first argument equals it
    call = library.seccomp_syscall_resolve_name
    assert library.seccomp_rule_add_array(context, ctypes.c_uint32(invalid), call(b'seccomp'), 0,
                                          None) == 0
    assert library.seccomp_rule_add_array(context, ctypes.c_uint32(invalid), call(b'prctl'), 1,
                                          set_seccomp) == 0
    assert library.seccomp_load(context) == 0


if __name__ == '__main__':
    main()
