#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: no twelve lines of code stand in two places.
# Method: compares all runs of twelve lines of all sources and scripts, without comments, includes
#   and lines of punctuation alone. Vector twins may share theirs: kernels that are written once for
#   each isa, in files that differ in its name only (storage/base/cpu_isa.h says why). Before that,
#   made-up trees are shown to the check.
# usage: tests/tidy/duplicates_test.py [ROOT]
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import tested_test  # noqa: E402 (the line above finds it)
import tidy_test  # noqa: E402

LINES_MAX = 11  # the issue "A house to live in" asks for no duplicates of 12 lines and more
TRIVIAL = re.compile(r'\W*|#\s*include\b.*|import \w+|\}?\s*namespace\b.*')


def code_lines(path, text):
    """Number and text of each line that says something, without its comment."""
    comment = r'//.*' if path.endswith(tidy_test.INCLUDERS) else r'(?:^|\s)#(?!\s*include).*'
    for number, line in enumerate(text.splitlines(), 1):
        line = ' '.join(re.sub(comment, '', line).split())
        if not TRIVIAL.fullmatch(line):
            yield number, line


def are_twins(a, b):
    """Whether two files are the same kernels for two isas."""
    stems = [path.removesuffix('.cc') for path in (a, b)]
    kernels = {tested_test.TWIN.sub('', stem) for stem in stems}
    return a != b and len(kernels) == 1 and not kernels & set(stems)


def violations(tree):
    length = LINES_MAX + 1
    first_of = {}  # a run of lines: each path with the index and the number of its first line
    told = {}  # two paths: where the last duplicate of the two that was told ends in the second
    for path in sorted(path for path in tree if path.endswith(tidy_test.CODE)):
        lines = list(code_lines(path, tree[path]))
        for i in range(len(lines) - LINES_MAX):
            places = first_of.setdefault(tuple(line for _, line in lines[i:i + length]), {})
            for other, (at, number) in places.items():
                overlaps = other == path and i < at + length
                if overlaps or are_twins(other, path):
                    continue
                if i >= told.get((other, path), 0):
                    yield (f'{path}:{lines[i][0]}: {length} lines or more stand in '
                           f'{other}:{number}, too')
                told[other, path] = i + length
            places.setdefault(path, (i, lines[i][0]))


def numbered(name, count):
    """Code of so many lines."""
    return ''.join(f'  {name} += {i};  // {name}\n' for i in range(count))


CLEAN = {
    'engine/a.cc': numbered('a', 12) + numbered('b', 11),
    'engine/b.cc': numbered('b', 11) + '#include <vector>\n}\n\n  // c\n' + numbered('c', 3),
    'engine/c.cc': '#include <vector>\n' * 12 + '  });\n' * 12 + '  x = y;\n' * 23,
    'engine/d.cc': '#include <vector>\n' * 12 + '  });\n' * 12,
    'engine/e_avx2.cc': numbered('e', 12),
    'engine/e_avx512.cc': numbered('e', 12),
    'docs/a.md': numbered('a', 12),
}
BROKEN = (  # what is broken, in words; the file that breaks it; its text
    ('twelve lines of another file', 'engine/z.cc', numbered('a', 12)),
    ('the same lines with other comments and spaces', 'engine/z.cc',
     numbered('a', 12).replace('// a', '').replace('  a', 'a')),
    ('the same lines with others between that say nothing', 'engine/z.cc',
     numbered('a', 12).replace('5;', '5;\n  }\n\n// why\n')),
    ('more than twelve lines, which are told once', 'engine/z.cc',
     numbered('a', 12) + numbered('b', 11)),
    ('twelve lines twice in one file', 'engine/z.cc', numbered('z', 12) + numbered('z', 12)),
    ('a copy of a kernel that is no twin of it', 'engine/z_avx2.cc', numbered('a', 12)),
)


if __name__ == '__main__':
    sys.exit(tidy_test.run(lambda: tidy_test.try_trees(CLEAN, BROKEN, violations), violations))
