#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what README.md, CHANGELOG.md and docs/*.md say about the repository's files stays true:
#   every path that they name exists, and their prose has lines of at most 100 columns.
# Method: reads every document for paths in backquotes, in code blocks and in links, and looks each
#   one up among the files that git tracks or would track. Before that, made-up documents are shown
#   to each check, which must find what is wrong with them and nothing else; a check that cannot
#   fail fails here.
# usage: tests/docs_test.py [ROOT]
import os
import posixpath
import re
import subprocess
import sys

COLUMNS_MAX = 100
# A path begins with a folder at the top of the repository.
TOP_FOLDERS = ('.ci', 'cli', 'docs', 'engine', 'fusion', 'index', 'kernels', 'storage', 'tests',
               'tools')
PATH = re.compile(r'(?<![\w./$~-])((?:' + '|'.join(map(re.escape, TOP_FOLDERS)) + r')/[\w./*-]*)')
# A source without its folder: somewhere in the repository there must be one of that name.
SOURCE = re.compile(r'(?<![\w./*-])([\w-]+\.(?:h|cc|cl|capnp|py|sh))(?![\w/])')
CODE_SPAN = re.compile(r'`([^`]+)`')
LINK = re.compile(r'\[[^\]]*\]\(([^)\s]+)\)')
# tools/bench/bench.py writes what lies between these.
GENERATED_BEGIN, GENERATED_END = '<!-- bench ', '<!-- /bench '


def is_document(path):
    return path in ('README.md', 'CHANGELOG.md') or re.fullmatch('docs/.*[.]md', path)


def exists(path, files):
    """A file, a folder, or one of either where `*` stands for any name."""
    path = path.rstrip('/')
    if '*' in path:
        pattern = re.compile(re.escape(path).replace(r'\*', '[^/]*') + '(/|$)')
        return any(pattern.match(file) for file in files)
    return path in files or any(file.startswith(path + '/') for file in files)


def read(text):
    """Number, line, whether it is inside a code block, and whether a program wrote it."""
    in_block = generated = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith(GENERATED_BEGIN):
            generated = True
        if line.startswith('```'):
            in_block = not in_block
        yield number, line, in_block, generated
        if line.startswith(GENERATED_END):
            generated = False


def check_paths(path, text, files):
    names = {posixpath.basename(file) for file in files}
    for number, line, in_block, _ in read(text):
        for code in [line] if in_block else CODE_SPAN.findall(line):
            for named in PATH.findall(code):
                named = named.rstrip('.')
                if not exists(named, files):
                    yield f'{path}:{number}: path: there is no {named}'
            for named in SOURCE.findall(code):
                if named not in names:
                    yield f'{path}:{number}: path: no folder has a file {named}'


def check_links(path, text, files):
    for number, line, in_block, _ in read(text):
        for target in [] if in_block else LINK.findall(line):
            target = target.split('#')[0]
            if not target or re.match(r'[a-z]+:', target):
                continue
            full = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
            if not exists(full, files):
                yield f'{path}:{number}: link: there is no {full}'


def check_columns(path, text, files):
    """Rows of tables, what a program wrote, and lines without a space may be longer."""
    for number, line, _, generated in read(text):
        may_be_long = generated or line.startswith('|') or ' ' not in line.strip()
        if len(line) > COLUMNS_MAX and not may_be_long:
            yield f'{path}:{number}: columns: {len(line)}; {COLUMNS_MAX} at most'


CHECKS = (check_paths, check_links, check_columns)


def violations(tree, files):
    """tree: path of a document -> text."""
    return [wrong for path in sorted(tree) for check in CHECKS
            for wrong in check(path, tree[path], files)]


FILES = {'README.md', 'docs/a.md', 'engine/engine.h', 'tools/bench/bench.py',
         'tests/cli/stops_test.py'}
CLEAN = '\n'.join((
    '# A title',
    'The door is `engine/engine.h`; `engine/`, `tools/bench/bench.py --out docs/a.md` are there,',
    '`tests/*/stops_test.py`, `bench.py` too. `build/dev/cli/veduta`, `model/cameras.txt`',
    'are no files of the repository, and neither is engine/nothing.h, which is not in backquotes.',
    '[A link](../README.md#title), [another](https://example.org/docs/x.md).',
    '```',
    '  tools/bench/bench.py OUT',
    '```',
    '| a row | `engine/engine.h` ' + 'x' * 100 + ' |',
    '<!-- bench castle -->',
    'A line that a program wrote ' + 'x' * 100,
    '<!-- /bench castle -->',
    ''))
# What is wrong, in words; the line that is wrong; the kind of violation that must be found, once.
BROKEN = (
    ('a file that is not there', 'See `engine/motor.h`.', 'path'),
    ('a folder that is not there', 'See `engine/motor/`.', 'path'),
    ('a file that is not there, at the end of a sentence', 'See `in engine/motor.h.`', 'path'),
    ('a pattern that nothing fits', 'See `tools/*/motor.py`.', 'path'),
    ('a path within a command', 'Run `tools/motor.sh --out OUT`.', 'path'),
    ('a path in a row of a table', '| `engine/motor.h` |', 'path'),
    ('a path in a code block', '```\n  tools/motor.sh\n```', 'path'),
    ('the name of a source that is not there', 'See `motor.h`.', 'path'),
    ('a link to nothing', 'See [this](motor.md).', 'link'),
    ('a link to nothing with a place in it', 'See [this](motor.md#part).', 'link'),
    ('a line too long', 'x ' * 51, 'columns'),
    ('a line too long in a code block', '```\n' + 'x ' * 51 + '\n```', 'columns'),
)


def self_test():
    wrong = [f'self-test: the clean document: {text}'
             for text in violations({'docs/a.md': CLEAN}, FILES)]
    for what, line, kind in BROKEN:
        found = violations({'docs/a.md': CLEAN + line + '\n'}, FILES)
        if len(found) != 1 or f' {kind}: ' not in found[0]:
            wrong.append(f'self-test: {what}: one of `{kind}` was to be found, not {found}')
    return wrong


def list_files(root):
    command = ['git', '-c', f'safe.directory={root}', '-C', root, 'ls-files', '-z', '--cached',
               '--others', '--exclude-standard']
    listed = subprocess.run(command, capture_output=True, check=True).stdout.decode()
    return {path for path in listed.split('\0')
            if path and os.path.isfile(os.path.join(root, path))}


def main():
    above = os.path.join(os.path.dirname(__file__), '..')
    root = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else above)
    if not os.path.exists(os.path.join(root, '.git')):
        print(f'{root} is no git checkout: nothing says which files are the project\'s')
        return 77  # ctest: skipped
    files = list_files(root)
    tree = {}
    for path in filter(is_document, files):
        with open(os.path.join(root, path), encoding='utf-8') as file:
            tree[path] = file.read()
    wrong = self_test() + violations(tree, files)
    for text in wrong:
        print(text)
    print(f'{len(tree)} documents read, {len(BROKEN)} made-up ones, {len(wrong)} violations')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
