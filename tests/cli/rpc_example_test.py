#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the program in C++ that docs/rpc.md shows builds against the schema that is installed, and
#   does against a daemon what the page says; the lines in Python run as well.
# Method: the C++ and the CMake block of the page, built in a temporary folder; a real daemon.
# usage: tests/cli/rpc_example_test.py VEDUTA VEDUTA_STREET ROOT COMPILER
import glob
import os
import re
import shutil
import subprocess
import sys

# city.py takes what follows its two programs for names of tests.
ROOT, COMPILER = sys.argv[3:5]
del sys.argv[3:5]
from city import Case, at, main, must, new_database, photo, render, write, SIZE  # noqa: E402
from daemon import Daemon  # noqa: E402

PHOTO_COUNT = 6


def block(page, language):
    found = re.findall(rf'^```{language}\n(.*?)^```$', page, re.MULTILINE | re.DOTALL)
    assert len(found) == 1, f'docs/rpc.md has {len(found)} blocks in {language}'
    return found[0]


def run(*command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)
    assert done.returncode == 0, f'{command} ended with {done.returncode}:\n{done.stdout}'
    return done.stdout


class Example(Case):
    @classmethod
    def setUpClass(cls):
        render('street', '--photos', str(PHOTO_COUNT), '--size', SIZE)
        with open(os.path.join(ROOT, 'docs', 'rpc.md'), encoding='utf-8') as file:
            cls.page = file.read()

    def test_the_program_in_cpp(self):
        folder, build = at('program'), at('program', 'build')
        for name, language in (('main.cc', 'cpp'), ('CMakeLists.txt', 'cmake')):
            write(os.path.join(folder, name), block(self.page, language).encode())
        shutil.copy(os.path.join(ROOT, 'cli', 'rpc', 'veduta.capnp'), folder)
        run('cmake', '-G', 'Ninja', '-S', folder, '-B', build, f'-DCMAKE_CXX_COMPILER={COMPILER}',
            '-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror')
        run('cmake', '--build', build)
        db = new_database('cpp')
        photos = sorted(glob.glob(at('street', 'photos', '*.jpg')))
        with Daemon(db, '--listen', '127.0.0.1:0') as daemon:
            told = run(os.path.join(build, 'rpc_example'), daemon.started['rpc'], '', 'c', *photos)
            refused = subprocess.run([os.path.join(build, 'rpc_example'), daemon.started['rpc'],
                                      '', 'none', photos[0]], capture_output=True, text=True)
            center = daemon.get(f'/v1/photos/%23{PHOTO_COUNT}/pose')['center']
        verdicts = re.findall(r'^photo\d+\.jpg: (\w+): ', told, re.MULTILINE)
        self.assertEqual(len(verdicts), PHOTO_COUNT, told)
        self.assertIn('founded', verdicts)
        self.assertIn(f'the last was taken at x = {center[0]:f}\n', told)
        self.assertEqual(refused.returncode, 1)
        self.assertIn('404 Not Found', refused.stderr)
        must('verify', db)

    def test_the_lines_in_python(self):
        folder = at('lines')
        for number in (1, 2, 3):
            write(os.path.join(folder, f'{number}.jpg'), photo(number))
        db = new_database(os.path.join('lines', 'city.veduta'))
        must('camera', 'add', db, 'phone', '--size', SIZE, '--params', '450.56,450.56,255.5,191.5')
        # Which would follow the city for ever.
        lines = block(self.page, 'python').replace('first=1', 'first=1, timeout_s=1')
        with Daemon(db, '--listen', 'unix:' + os.path.join(db, 'rpc.sock')):
            told = run(sys.executable, '-c', lines, cwd=folder, env={
                **os.environ, 'PYTHONPATH': os.path.join(ROOT, 'cli', 'rpc')})
        self.assertTrue(told.startswith('[1, 2]\n1.jpg postponed '), told)
        self.assertIn('\n3 add ', told)


if __name__ == '__main__':
    main()
