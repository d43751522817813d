#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: CMake refuses a library that depends on its own floor or a higher one, a target that is not
#   there, one of our libraries named as if it were somebody else's, and tests that would not run.
# Method: configures made-up projects of a few lines, each with one such hole, and reads the error.
# usage: tests/tidy/library_test.py CMAKE FOLDER_OF_CMAKE_FILES
import os
import subprocess
import sys
import tempfile

HEAD = '''cmake_minimum_required(VERSION 3.25)
project(made_up LANGUAGES NONE)
add_library(veduta_flags INTERFACE)
add_library(other::other INTERFACE IMPORTED)
include({folder}/veduta_library.cmake)
include({folder}/veduta_tests.cmake)
veduta_library(low FLOOR 1 INTERFACE PUBLIC other::other)
'''
CASES = (  # what is tried, its lines, what the error must say; None: it must pass
    ('a lower floor', 'veduta_library(high FLOOR 2 INTERFACE DEPENDS low)', None),
    ('the same floor', 'veduta_library(high FLOOR 1 INTERFACE DEPENDS low)',
     'must not depend'),
    ('a higher floor', 'veduta_library(high FLOOR 0 INTERFACE DEPENDS low)',
     'must not depend'),
    ('no floor', 'veduta_library(high INTERFACE)', 'no FLOOR'),
    ('a library that is missing', 'veduta_library(high FLOOR 2 INTERFACE DEPENDS lost)',
     'no such target'),
    ('a package that is missing', 'veduta_library(high FLOOR 2 INTERFACE PUBLIC lost)',
     'no such target'),
    ('ours among the others', 'veduta_library(high FLOOR 2 INTERFACE PUBLIC low)',
     'name it in DEPENDS'),
    ('a library that a program misses', 'veduta_program(main SOURCES main.cc DEPENDS lost)',
     'no such target'),
    ('an argument with a typing error', 'veduta_library(high FLOOR 2 INTERFACE DEPEND low)',
     'not known'),
    ('a folder that is missing', 'add_subdirectory(lost)', 'is not an existing directory'),
    ('a folder of tests without a test', 'veduta_tests(empty low)', 'no test there'),
    ('a test in a folder that nobody names', 'veduta_refuse_unmade_tests()', 'lost_test.cc'),
)


def configure(cmake, folder, lines):
    """The exit code, and the error's text with its line breaks taken out."""
    with tempfile.TemporaryDirectory() as root:
        os.makedirs(os.path.join(root, 'unnamed'))
        open(os.path.join(root, 'unnamed', 'lost_test.cc'), 'w', encoding='utf-8').close()
        with open(os.path.join(root, 'CMakeLists.txt'), 'w', encoding='utf-8') as file:
            file.write(HEAD.format(folder=folder) + lines + '\n')
        command = [cmake, '-S', root, '-B', os.path.join(root, 'build')]
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, ' '.join(done.stderr.split())


def main():
    cmake, folder = sys.argv[1:]
    wrong = 0
    for what, lines, expected in CASES:
        code, error = configure(cmake, folder, lines)
        held = code == 0 if expected is None else code != 0 and expected in error
        if not held:
            wrong += 1
            print(f'{what}: `{expected}` was to be said, not {code}: {error}')
    print(f'{len(CASES)} projects configured, {wrong} wrong')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
