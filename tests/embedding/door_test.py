#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: the door drags in little: it compiles alone, reaches at most 24 headers of the project and
#   none of other libraries, and exactly the headers that it reaches are installed.
# Method: the compiler reads a file that includes the door alone, with no include path but the root;
#   its own list of what it read is compared with a walk over the #include lines and with CMake's
#   list. Before that, a made-up tree that drags in more is walked.
# usage: tests/embedding/door_test.py ROOT COMPILER DOOR INSTALLED_HEADER...
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, '..'), os.path.join(HERE, '..', 'tidy')]
import includes_test  # noqa: E402 (the line above finds it)
import tidy_test  # noqa: E402

# 10 by the issue "A house to live in"; the earth, tokens, contributions and questions since
PROJECT_HEADERS_MAX = 24


def reach(door, tree):
    """The project's headers, and those of other libraries, that the door drags in."""
    own, others, left = [], [], [door]
    while left:
        path = left.pop()
        own.append(path)
        for _, header in tidy_test.included(path, tree[path].splitlines()):
            if header in tree:
                if header not in own and header not in left:
                    left.append(header)
            elif includes_test.needed_packages(header) != ():
                others.append(header)
    return sorted(own), sorted(others)


def self_test():
    tree = {'a.h': '#include "b.h"\n#include <vector>\n#include "c.h"\n',
            'b.h': '#include "c.h"\n#include <Eigen/Core>\n', 'c.h': '#include <boost/any.hpp>\n',
            'd.h': ''}
    reached = reach('a.h', tree)
    expected = (['a.h', 'b.h', 'c.h'], ['Eigen/Core', 'boost/any.hpp'])
    return [] if reached == expected else [f'self-test: {expected} was to be found, not {reached}']


def compiled_headers(root, compiler, door):
    """What the compiler read, and its errors."""
    done = subprocess.run([compiler, '-std=c++20', '-fsyntax-only', '-Wall', '-Wextra', '-Werror',
                           '-I', root, '-H', '-x', 'c++', '-'],
                          input=f'#include "{door}"\n', capture_output=True, text=True, cwd='/')
    read = [line.lstrip('. ') for line in done.stderr.splitlines() if line.startswith('.')]
    own = {os.path.relpath(path, root) for path in read if path.startswith(root + '/')}
    errors = '\n'.join(line for line in done.stderr.splitlines() if not line.startswith('.'))
    return sorted(own), errors if done.returncode else ''


def main():
    root, compiler, door, *installed = sys.argv[1:]
    tree = {path: text for path, text in tidy_test.read_tree(root).items() if path.endswith('.h')}
    own, others = reach(door, tree)
    compiled, errors = compiled_headers(root, compiler, door)
    wrong = self_test()
    if errors:
        wrong.append(f'{door} does not compile alone:\n{errors}')
    elif compiled != own:
        wrong.append(f'the compiler read {compiled}, the walk {own}')
    if len(own) > PROJECT_HEADERS_MAX:
        wrong.append(f'{door} reaches {len(own)} headers of the project: {", ".join(own)}')
    if others:
        wrong.append(f'{door} reaches headers of other libraries: {", ".join(others)}')
    if sorted(installed) != own:
        wrong.append(f'installed are {sorted(installed)}, reached are {own}')
    for text in wrong:
        print(text)
    print(f'{len(own)} headers of the project, {len(others)} of other libraries')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
