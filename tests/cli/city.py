# SPDX-License-Identifier: Apache-2.0
# What the tests of the command line share: the programs, run as processes; photos of a rendered
# street; a database of them that no test changes. A test's arguments: VEDUTA VEDUTA_STREET
# [TEST...]
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

if len(sys.argv) < 3:
    sys.exit(f'usage: {sys.argv[0]} VEDUTA VEDUTA_STREET [TEST...]')
VEDUTA, STREET = sys.argv[1:3]
SIZE, PARAMS = '512x384', '450.56,450.56,255.5,191.5'
PHOTO_COUNT = 12
PLACED = ('placed', 'merged', 'founded')
FOLDER = tempfile.mkdtemp(prefix='veduta_cli_')
PHOTOS = os.path.join(FOLDER, 'street', 'photos')
WHOLE = os.path.join(FOLDER, 'whole')  # the database of all photos


def render(name, *more):
    subprocess.run([STREET, at(name), '--quiet', *more], check=True, stdout=subprocess.DEVNULL)
    return os.path.join(at(name), 'photos')


def at(*names):
    return os.path.join(FOLDER, *names)


def run(*arguments):
    done = subprocess.run([VEDUTA, *arguments], capture_output=True)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def must(*arguments):
    code, out, err = run(*arguments)
    assert code == 0, f'{arguments} ended with {code}: {out}{err}'
    return out


def ask(*arguments):
    return json.loads(must(*arguments, '--json'))


def new_database(name):
    must('init', at(name))
    must('camera', 'add', at(name), 'c', '--size', SIZE, '--params', PARAMS)
    return at(name)


def add_command(db, *what):
    return ('add', db, '--camera', 'c', '--threads', '2', '--contributor', 'anna', '--json', *what)


def add(db, *what):
    """Exit code, the JSON lines, standard error."""
    code, out, err = run(*add_command(db, *what))
    return code, [json.loads(line) for line in out.splitlines()], err


def write(path, data):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, 'wb') as file:
        file.write(data)


def read(path):
    with open(path, 'rb') as file:
        return file.read()


def photo(number):
    return read(os.path.join(PHOTOS, f'photo{number:04}.jpg'))


def make_whole():
    """The lines that `add` printed, and the digest."""
    render('street', '--photos', str(PHOTO_COUNT), '--size', SIZE)
    new_database('whole')
    code, lines, err = add(WHOLE, PHOTOS)
    assert code == 0, err
    return lines, must('digest', WHOLE)


class Case(unittest.TestCase):
    def refused(self, code, words, *arguments):
        """The command ends with the code, says the words on standard error and nothing on standard
        output."""
        got, out, err = run(*arguments)
        self.assertEqual((got, out), (code, ''), f'{arguments}: {err}')
        self.assertIn(words, err, arguments)


def main():
    unittest.main('__main__', argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)


unittest.addModuleCleanup(shutil.rmtree, FOLDER)
