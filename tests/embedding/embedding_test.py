#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a program outside of this repository can embed Veduta as docs/embedding.md says: the very
#   lines of that page build against an installed package and do what the page promises.
# Method: installs into a temporary folder, takes the C++ and the CMake block out of the page,
#   builds them with find_package(veduta) and runs them on a few photos of a rendered street.
# usage: tests/embedding/embedding_test.py ROOT BUILD COMPILER VEDUTA_STREET [SANITIZE]
import glob
import os
import re
import subprocess
import sys
import tempfile

PHOTO_COUNT = 6
CAMERA = ('512x384', '450.56,450.56,255.5,191.5')  # of veduta-street at this size


def run(*command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)
    if done.returncode:
        sys.exit(f'{" ".join(command)} ended with {done.returncode}:\n{done.stdout}')
    return done.stdout


def block(page, language):
    """The text of the page's one block in a language."""
    found = re.findall(rf'^```{language}\n(.*?)^```$', page, re.MULTILINE | re.DOTALL)
    if len(found) != 1:
        sys.exit(f'docs/embedding.md has {len(found)} blocks in {language}; one is wanted')
    return found[0]


def build_program(root, prefix, compiler, sanitize, folder):
    """Builds what the page shows; the path of the program."""
    os.mkdir(folder)
    with open(os.path.join(root, 'docs', 'embedding.md'), encoding='utf-8') as file:
        page = file.read()
    for name, language in (('main.cc', 'cpp'), ('CMakeLists.txt', 'cmake')):
        with open(os.path.join(folder, name), 'w', encoding='utf-8') as file:
            file.write(block(page, language))
    flags = '-Wall -Wextra -Werror' + (f' -fsanitize={sanitize}' if sanitize else '')
    build = os.path.join(folder, 'build')
    run('cmake', '-G', 'Ninja', '-S', folder, '-B', build, f'-DCMAKE_PREFIX_PATH={prefix}',
        f'-DCMAKE_CXX_COMPILER={compiler}', f'-DCMAKE_CXX_FLAGS={flags}')
    run('cmake', '--build', build)
    return os.path.join(build, 'embedding')


def check_run(told, database, model, prefix):
    """What the program printed and left behind agrees with the installed command line."""
    verdicts = re.findall(r'^.*/photo\d+\.jpg: (\w+)$', told, re.MULTILINE)
    assert len(verdicts) == PHOTO_COUNT, told
    placed = int(re.search(rf'^(\d+) of {PHOTO_COUNT} photos have a pose$', told, re.MULTILINE)[1])
    assert placed >= 3, told  # a reconstruction begins with three
    veduta = os.path.join(prefix, 'bin', 'veduta')
    assert f'"placed":{placed}' in run(veduta, 'status', database, '--json').replace(' ', ''), told
    run(veduta, 'verify', database)
    for name in ('cameras.txt', 'images.txt', 'points3D.txt'):
        assert os.path.getsize(os.path.join(model, '0', name)) > 0, name


def main():
    root, build, compiler, street, *sanitize = sys.argv[1:]
    with tempfile.TemporaryDirectory(prefix='veduta_embedding_') as work:
        prefix = os.path.join(work, 'installed')
        run('cmake', '--install', build, '--prefix', prefix)
        program = build_program(root, prefix, compiler, ''.join(sanitize[:1]),
                                os.path.join(work, 'program'))
        photos = os.path.join(work, 'street')
        run(street, photos, '--photos', str(PHOTO_COUNT), '--size', CAMERA[0], '--quiet')
        database, model = os.path.join(work, 'city'), os.path.join(work, 'model')
        listed = sorted(glob.glob(os.path.join(photos, 'photos', '*.jpg')))
        told = run(program, database, *CAMERA, model, *listed)
        check_run(told, database, model, prefix)
        print(told)
    return 0


if __name__ == '__main__':
    sys.exit(main())
