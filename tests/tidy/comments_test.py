#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: a file or folder that a comment names exists.
# Method: reads the comments of every source and script for paths below a top folder, such as
#   engine/engine.h, and for sources without their folder, such as engine.h. It looks each one up
#   among the files that git tracks or would track; a word in capitals stands for any name. Before
#   that, made-up sources are shown to the check, which must find what is wrong and nothing else.
# usage: tests/tidy/comments_test.py [ROOT]
import fnmatch
import io
import os
import posixpath
import re
import sys
import tokenize

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import docs_test  # noqa: E402 (the line above finds it)
import tidy_test  # noqa: E402

READ = (*tidy_test.CODE, 'tests/tidy/tested_through')
STRING = re.compile(r'"(?:\\.|[^"\\\n])*"')
AFTER_SLASHES, AFTER_HASH = re.compile(r'(?<!:)//(.*)'), re.compile(r'(?:^|\s)#(.*)')
ANY_NAME = re.compile(r'(?<![A-Za-z])[A-Z]{3,}(?![A-Za-z])')


def comments(path, text):
    """Number and text of each line's comment."""
    if path.endswith('.py'):
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                yield token.start[0], token.string
        return
    after = AFTER_SLASHES if path.endswith(tidy_test.INCLUDERS) else AFTER_HASH
    for number, line in enumerate(text.splitlines(), 1):
        found = after.search(STRING.sub('""', line))
        if found:
            yield number, found[1]


def is_path(named, tree):
    return docs_test.exists(named, tree) or docs_test.exists(ANY_NAME.sub('*', named), tree)


def violations(tree):
    names = {posixpath.basename(file) for file in tree}
    for path in sorted(path for path in tree if path.endswith(READ)):
        for number, comment in comments(path, tree[path]):
            for named in docs_test.PATH.findall(comment):
                if not is_path(named.rstrip('.'), tree):
                    yield f'{path}:{number}: there is no {named}'
            for named in docs_test.SOURCE.findall(comment):
                if not fnmatch.filter(names, ANY_NAME.sub('*', named)):
                    yield f'{path}:{number}: no folder has a file {named}'


CLEAN = {
    'engine/engine.h': '// See engine/engine.cc, engine/, engine.cc and tests/NAME_test.py.\n',
    'engine/engine.cc': 'F("engine/lost.h");  // NAME_test.py, https://example.org/engine/lost.h\n'
                        '#include "engine/lost.h"\n// db/blob/lost.h of a library\n',
    'tests/a_test.py': 'f("# engine/lost.h")  # engine/engine.h\n',
    'tools/a.sh': 'a "# tools/lost.sh" b#tools/lost.sh  # tools/*.sh\n',
    'docs/a.md': '# engine/lost.h\n',
}
BROKEN = (  # what is broken, in words; the file that breaks it; its text
    ('a file that is gone', 'engine/a.h', '// storage/gone.h checks it.\n'),
    ('a file that is gone, behind code', 'engine/a.cc', 'F("//");  // as engine/gone.cc does\n'),
    ('a folder that is gone', 'kernels/a.cl', '// measured by tools/gone, on a card\n'),
    ('a source that is in no folder', 'engine/a.h', '// gone.cc runs it.\n'),
    ('a file that is gone, in a script', 'tools/b.py', 'x = 1  # tools/gone.py\n'),
    ('a file that is gone, in a CMake file', 'tools/CMakeLists.txt', '# tools/gone.cmake\n'),
    ('a pattern that nothing fits', 'tools/b.sh', '# tools/NAME.gone\n'),
    ('a name that nothing fits', 'tools/b.sh', '# NAME_gone.cc\n'),
)


if __name__ == '__main__':
    sys.exit(tidy_test.run(lambda: tidy_test.try_trees(CLEAN, BROKEN, violations), violations))
