#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: every C++ file stands as clang-format writes it by the repository's .clang-format.
# Method: clang-format 14 in its dry run over all C++ files that git tracks; the version is fixed,
#   for versions differ in what they write. Before that, a made-up file must be refused.
# usage: tests/tidy/format_test.py [ROOT]
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import tidy_test  # noqa: E402 (the line above finds it)

CLANG_FORMAT = 'clang-format-14'
ENDINGS = ('.cc', '.h', '.inc')
BATCH = 64  # files per process; chosen by hand, far below the limit of a command line


def complaints(root, paths):
    done = subprocess.run([CLANG_FORMAT, '--dry-run', '-Werror', '--ferror-limit=1', *paths],
                          cwd=root, capture_output=True, text=True)
    return done.stderr if done.returncode else ''


def self_test(root):
    """By the repository's style, and not by the tool's own, which would break at 80 columns."""
    wrong = []
    long_line = 'int Sum(int first_number, int second_number, int third_number, int fourth_number);'
    for text, is_right in (('int  x;\n', False), ('int x;\n', True), (long_line + '\n', True)):
        done = subprocess.run([CLANG_FORMAT, '--dry-run', '-Werror', '--assume-filename=a.cc'],
                              cwd=root, input=text, capture_output=True, text=True)
        if (done.returncode == 0) != is_right:
            wrong.append(f'self-test: {text!r} gave {done.returncode}')
    return wrong


def main():
    root = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else '.')
    if not shutil.which(CLANG_FORMAT) or not os.path.exists(os.path.join(root, '.git')):
        print(f'no {CLANG_FORMAT} here (tools/install.sh installs it), or no git checkout')
        return 77  # ctest: skipped
    wrong = self_test(root)
    paths = [path for path in sorted(tidy_test.read_tree(root)) if path.endswith(ENDINGS)]
    for i in range(0, len(paths), BATCH):
        found = complaints(root, paths[i:i + BATCH])
        wrong += [line for line in found.splitlines() if ': error: ' in line]
    for text in wrong:
        print(text)
    print(f'{len(paths)} files looked at, {len(wrong)} violations; '
          f'`{CLANG_FORMAT} -i FILE` writes a file anew')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
