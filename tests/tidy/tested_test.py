#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: every source with logic has a test of its own.
# Method: a file of tests/ must include the header of each .cc file (of the same name; for a vector
#   twin without its ending), or name a class or a function that the source defines. The file
#   tested_through lists the exceptions. Before that, made-up trees are shown to the check.
# usage: tests/tidy/tested_test.py [ROOT]
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import functions_test  # noqa: E402 (the line above finds it)
import tidy_test  # noqa: E402

THROUGH = 'tests/tidy/tested_through'
ROOMS = ('storage', 'index', 'engine', 'kernels', 'fusion')
TWIN = re.compile(r'_(portable|baseline|avx2|avx512|avx512vnni|vnni)$')
ANONYMOUS = re.compile(r'^namespace \{$.*?^\}  // namespace$', re.DOTALL | re.MULTILINE)


def own_headers(path):
    stem = path.removesuffix('.cc')
    return {stem + '.h', TWIN.sub('', stem) + '.h'}


def defined(text):
    """The classes and functions that a source defines for others."""
    seen = ANONYMOUS.sub(functions_test.blank, text)
    for _, _, name in functions_test.cpp_functions(seen):
        yield name.split('(')[0].split('::')[0]


def reasons_alone(text):
    """The first line of each paragraph without a source, but for the one that opens the file."""
    for paragraph in text.split('\n\n')[1:]:
        lines = paragraph.strip().splitlines()
        if all(line.startswith('#') for line in lines):
            yield lines[0] if lines else ''


def violations(tree):
    tests = {path: text for path, text in tree.items()
             if path.startswith('tests/') and path.endswith(tidy_test.INCLUDERS)}
    included = {header for path, text in tests.items()
                for _, header in tidy_test.included(path, text.splitlines())}
    words = {word for text in tests.values() for word in re.findall(r'\w+', text)}
    through = dict(line.split() for line in tree[THROUGH].splitlines()
                   if line and not line.startswith('#'))
    for path in sorted(tree):
        if path.endswith('.cc') and path.split('/')[0] in ROOMS:
            names = set(defined(tree[path]))
            if own_headers(path) & included or names & words:
                continue
            if through.pop(path, None) not in tests:
                told = ', '.join(sorted(names)) or 'anything of it'
                yield f'{path}: no test includes its header or names {told}'
    for first in reasons_alone(tree[THROUGH]):
        yield f'{THROUGH}: no source stands below `{first}`'
    for path in through:
        yield f'{THROUGH}: {path} has a test of its own, or is gone: take it out'


CLEAN = {
    'index/tree.h': '', 'index/tree.cc': '#include "index/tree.h"\n',
    'index/rows.h': '', 'index/rows_avx2.cc': '#include "index/rows.h"\n',
    'index/walk.cc': 'int Tree::Walk() {\n}\n',
    'cli/main.cc': '',
    'storage/part.cc': 'int Part() {\n}\n',
    THROUGH: '# why\nstorage/part.cc tests/index/tree_test.cc\n',
    'tests/index/tree_test.cc': '#include "index/rows.h"\n#include "index/tree.h"\nTree tree;\n',
}
BROKEN = (  # what is broken, in words; the changes; how the one violation begins
    ('a source whose header no test includes',
     {'index/lost.h': '', 'index/lost.cc': '#include "index/lost.h"\nint Lost::F() {\n}\n',
      'index/rows.h': '#include "index/lost.h"\n'}, 'index/lost.cc: '),
    ('a source without a header', {'engine/lost.cc': '#include <vector>\n'}, 'engine/lost.cc: '),
    ('a function of the source alone that a test happens to name', {
        'kernels/a.cc': 'namespace {\nint tree() {\n}\n}  // namespace\n'}, 'kernels/a.cc: '),
    ('an exception whose test is gone',
     {THROUGH: 'storage/part.cc tests/index/lost_test.cc\n'}, 'storage/part.cc: '),
    ('a reason whose sources are gone',
     {THROUGH: '# how\n\n# lost\n\n# why\nstorage/part.cc tests/index/tree_test.cc\n'}, THROUGH),
    ('an exception that is not needed', {'tests/storage/a_test.cc': 'Part();\n'}, THROUGH),
)


def self_test():
    wrong = [f'self-test: the clean tree: {text}' for text in violations(CLEAN)]
    for what, changes, beginning in BROKEN:
        found = list(violations({**CLEAN, **changes}))
        if len(found) != 1 or not found[0].startswith(beginning):
            wrong.append(f'self-test: {what}: `{beginning}` was to be found, not {found}')
    return wrong


if __name__ == '__main__':
    sys.exit(tidy_test.run(self_test, violations))
