#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: no two sources need each other, and no two folders do, on whatever way round.
# Method: a header and the source of the same name are one unit. The units, and then the folders,
#   must have no circle of includes. Before that, made-up trees with a circle are shown to the
#   check.
# usage: tests/tidy/circles_test.py [ROOT]
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import tidy_test  # noqa: E402 (the line above finds it)

ENDING = re.compile(r'\.(h|cc|inc)$')


def unit_of(path):
    return ENDING.sub('', path)


def uses(tree, name_of):
    """The names of files, and those that each includes."""
    used = {}
    for path, text in tree.items():
        if not ENDING.search(path) or path.startswith(tidy_test.LEAVES):
            continue
        own = used.setdefault(name_of(path), set())
        for _, header in tidy_test.included(path, text.splitlines()):
            if header in tree and name_of(header) != name_of(path):
                own.add(name_of(header))
    return used


def in_circles(used):
    """What is left once whatever uses nothing that is left has been taken away, again and again,
    and then whatever nothing that is left uses."""
    left = {name: set(others) for name, others in used.items()}
    for _ in range(2):
        while free := [name for name, others in left.items() if not others & left.keys()]:
            for name in free:
                del left[name]
        turned = {name: set() for name in left}
        for name, others in left.items():
            for other in others & left.keys():
                turned[other].add(name)
        left = turned
    return sorted(left)


def violations(tree):
    for what, name_of in (('sources', unit_of), ('folders', os.path.dirname)):
        found = in_circles(uses(tree, name_of))
        if found:
            yield f'{found[0]}: these {what} need each other: {", ".join(found)}'


CLEAN = {
    'engine/a.h': '#include "engine/c.h"\n',
    'engine/a.cc': '#include "engine/a.h"\n#include "engine/b.h"\n#include <vector>\n',
    'engine/b.h': '#include "engine/c.h"\n#include "storage/d.h"\n',
    'engine/c.h': '',
    'storage/d.h': '',
    'tests/e.h': '#include "tests/f.h"\n',
    'tests/f.h': '#include "tests/e.h"\n',
}
BROKEN = (  # what is broken, in words; the changes; how what is found begins
    ('two headers', {'engine/c.h': '#include "engine/b.h"\n'},
     'engine/b: these sources need each other: engine/b, engine/c'),
    ('a header and a source', {'engine/b.cc': '#include "engine/a.h"\n'},
     'engine/a: these sources need each other: engine/a, engine/b'),
    ('two folders', {'storage/g.h': '#include "engine/c.h"\n'},
     'engine: these folders need each other: engine, storage'),
)


def self_test():
    wrong = [f'self-test: in a clean tree: {found}' for found in violations(CLEAN)]
    for what, changes, beginning in BROKEN:
        found = list(violations({**CLEAN, **changes}))
        if found != [beginning]:
            wrong.append(f'self-test: {what}: `{beginning}` was to be found, not {found}')
    return wrong


if __name__ == '__main__':
    sys.exit(tidy_test.run(self_test, violations))
