#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: what the house style asks of every file and a compiler does not see holds: licence lines,
#   includes that point down, a command line that goes through the door, third-party headers in
#   their rooms, sizes, libraries that print nothing, no path of one machine.
# Method: reads every file that git tracks or would track. Before that, each check is shown a
#   made-up tree that breaks it once, and must find that and nothing else; a check that cannot fail
#   fails here.
# usage: tests/tidy_test.py [ROOT]
import os
import re
import subprocess
import sys
import tempfile

CODE = ('.h', '.cc', '.cl', '.capnp', '.sh', '.py', '.inc', '.cmake', 'CMakeLists.txt')
NARROW = (*CODE, '.md', 'CMakePresets.json', 'tools/packages', 'tools/packages-dev', '.clang-tidy')
INCLUDERS = ('.h', '.cc', '.cl', '.inc')
ROOMS = {'storage/base': 0, 'storage/model': 5, 'storage/records': 8, 'storage': 10,
         'index': 20, 'kernels': 20,
         'engine/door': 29, 'engine/earth': 33, 'engine/camera': 30, 'engine/features': 30,
         'engine/camera/calibration': 31, 'engine/camera/files': 32, 'engine/camera/markers': 32,
         'engine/camera/sandbox': 31, 'engine/camera/sandbox/process': 32,
         'engine/colmap': 32, 'engine/matching': 31, 'engine/mapping': 32, 'engine/journal': 33,
         'engine/photo': 33, 'engine/writer': 34, 'engine/retrieval': 34, 'engine/query': 35,
         'engine/ingest': 36, 'engine/localization': 37, 'engine/schedule': 37,
         'engine': 39, 'fusion/depth': 40, 'fusion/volume': 41, 'fusion/surface': 42,
         'fusion/tileset': 43, 'fusion/pass': 43, 'fusion/export': 44, 'fusion': 45,
         'engine/repair': 46,
         'cli/page': 49, 'cli/wire': 49, 'cli/photos': 50, 'cli/service': 50,
         'cli/rpc': 51, 'cli': 52}
LEAVES = ('tests', 'tools')  # they include what they like, and nothing includes them
TOP_FOLDERS = {'.ci', 'docs', *LEAVES, *(room.split('/')[0] for room in ROOMS)}

# First folder of a third-party header: the rooms that may include it. Tests of a room may what the
# room may.
THIRD_PARTY = {
    # tests of the engine stand on the file system that fails
    'rocksdb': ('storage', 'tests/engine', 'tools/fuzz'),
    'opengv': ('engine/mapping', 'tests/engine/matching', 'tools/bench/matching'),
    'ceres': ('engine/mapping', 'engine/camera/calibration', 'engine/camera/markers'),
    'embree3': ('fusion', 'tools/render/street'),
    'capnp': ('storage', 'cli', 'tools/bench/rpc', 'tools/fuzz'),
    'kj': ('storage', 'cli', 'tools/bench/rpc', 'tools/fuzz'),
    'CL': ('kernels',),
    'CLI': ('cli', 'tools'),
}

SOURCE_LINES_MAX, HEADER_LINES_MAX, COLUMNS_MAX = 500, 250, 100
# What people take away as one file, and may so be longer: lines at most.
TAKEN_AWAY = {'cli/rpc/veduta_rpc.py': 750}
# In pieces, for this file is read too.
MACHINE_FOLDERS = ('wo' + 'rk/', 'fa' + 'rm/', 'ho' + 'me/', 'tmp/bu' + 'ild')
MACHINE_PATH = re.compile('(?<![A-Za-z0-9_.~$}*])/(' + '|'.join(MACHINE_FOLDERS) + ')')
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


# The rooms that others embed, and the one file of them that says why the process ends.
LIBRARIES = ('storage/', 'index/', 'engine/', 'kernels/', 'fusion/')
MAY_SPEAK = ('storage/base/status.cc',)
SPEAKS = re.compile(r'\b(getenv|f?printf|f?puts)\s*\(|\bstd::(cout|cerr|clog)\b')
# Algorithms that return a std::ranges::subrange: clang 14, by which fuzz targets are built, cannot
# read that class of libstdc++ 12.
SUBRANGES = re.compile(r'\bstd::ranges::(unique|remove(_if)?|rotate|(stable_)?partition|'
                       r'equal_range|search(_n)?|find_(end|last)|subrange)\b')


# What the command line may include of ours: itself, the door, and the ground under all rooms, whose
# Status, ids and reader of whole files decide nothing of the domain.
COMMAND_LINE, DOOR = 'cli', ('engine/engine.h', 'engine/door/', 'storage/base/')


def is_under(path, folder):
    return path.startswith(folder + '/')


def room_of(path):
    """The innermost room a file lies in; None outside all."""
    return max((room for room in ROOMS if is_under(path, room)), key=len, default=None)


def check_licence(path, lines):
    if not path.endswith(CODE):
        return
    first = 1 if lines and lines[0].startswith('#!') else 0
    if len(lines) <= first or not re.fullmatch(r'(//|#) SPDX-License-Identifier: Apache-2\.0',
                                               lines[first]):
        yield (f'{path}:{first + 1}: licence: `SPDX-License-Identifier: Apache-2.0` must stand '
               f'here '
               'as a comment')


def included(path, lines):
    if path.endswith(INCLUDERS):
        for number, line in enumerate(lines, 1):
            found = INCLUDE.match(line)
            if found:
                yield number, found[1]


def check_floors(path, lines):
    if path.startswith(tuple(leaf + '/' for leaf in LEAVES)):
        return
    own = room_of(path)
    for number, header in included(path, lines):
        where = f'{path}:{number}: floors: '
        if '..' in header.split('/'):
            yield f'{where}{header} climbs; include by the path from the root'
        elif header.startswith(tuple(leaf + '/' for leaf in LEAVES)):
            yield f'{where}{header}: nothing includes tests or tools'
        else:
            room = room_of(header)
            if room and own and room != own and ROOMS[room] >= ROOMS[own]:
                yield (f'{where}{own} (floor {ROOMS[own]}) must not include {header} of {room} '
                       f'(floor {ROOMS[room]})')


def check_door(path, lines):
    if not is_under(path, COMMAND_LINE):
        return
    for number, header in included(path, lines):
        if room_of(header) and not is_under(header, COMMAND_LINE) and not header.startswith(DOOR):
            yield (f'{path}:{number}: door: {header} lies behind the door; what {COMMAND_LINE}/ '
                   f'needs of it belongs into engine/engine.h')


def check_third_party(path, lines):
    for number, header in included(path, lines):
        rooms = THIRD_PARTY.get(header.split('/')[0], ()) if '/' in header else ()
        if rooms and not any(is_under(path, room) or is_under(path, 'tests/' + room)
                             for room in rooms):
            yield f'{path}:{number}: third party: {header} is for {", ".join(rooms)} only'


def check_size(path, lines):
    if not path.endswith(CODE):
        return
    # code included several times counts as source
    is_header = path.endswith('.h') and not path.endswith('.inc.h')
    limit = TAKEN_AWAY.get(path, HEADER_LINES_MAX if is_header else SOURCE_LINES_MAX)
    if len(lines) > limit:
        kind = 'header' if is_header else 'source'
        yield f'{path}: size: {len(lines)} lines; a {kind} has {limit} at most'


def cannot_break(path, line):
    """A row of a Markdown table, or a line of one word with a link in it."""
    words = line.lstrip(' #/*->').split()
    is_link = len(words) == 1 and ('://' in line or '](' in line)
    return is_link or path.endswith('.md') and line.lstrip().startswith('|')


def check_columns(path, lines):
    if not path.endswith(NARROW):
        return
    for number, line in enumerate(lines, 1):
        if len(line) > COLUMNS_MAX and not cannot_break(path, line):
            yield f'{path}:{number}: columns: {len(line)}; {COLUMNS_MAX} at most'


def check_machine_paths(path, lines):
    for number, line in enumerate(lines, 1):
        found = MACHINE_PATH.search(line)
        if found:
            yield f'{path}:{number}: machine: {found[0]} is a path of one machine'


def check_top_folders(path, lines):
    top = path.split('/')[0]
    if '/' in path and top not in TOP_FOLDERS:
        yield f'{path}: top folder: {top}/ is not one of {", ".join(sorted(TOP_FOLDERS))}'


def check_quiet(path, lines):
    """Whoever embeds the engine owns the streams and the environment."""
    if not path.startswith(LIBRARIES) or path in MAY_SPEAK or not path.endswith(INCLUDERS):
        return
    for number, line in enumerate(lines, 1):
        found = SPEAKS.search(line)
        if found:
            yield (f'{path}:{number}: quiet: {found[0]}: a library neither prints nor reads the '
                   f'environment')


def check_subranges(path, lines):
    if not path.startswith((*LIBRARIES, 'cli/', 'tools/fuzz/')) or not path.endswith(INCLUDERS):
        return
    for number, line in enumerate(lines, 1):
        found = SUBRANGES.search(line)
        if found:
            yield f'{path}:{number}: subranges: {found[0]}: clang 14 cannot read what it returns'


def check_test_opening(path, lines):
    if is_under(path, 'tests') and re.search(r'_test\.(cc|py)$', path):
        for word in ('Goal:', 'Method:'):
            if not any(re.match(rf'(//|#) {word} ', line) for line in lines[:12]):
                yield f'{path}: opening: a test begins by saying its `{word}`'


CHECKS = (check_licence, check_floors, check_door, check_third_party, check_size, check_columns,
          check_machine_paths,
          check_top_folders, check_quiet, check_subranges, check_test_opening)


def violations(tree):
    """tree: path -> text."""
    found = []
    for path in sorted(tree):
        lines = tree[path].splitlines()
        for check in CHECKS:
            found.extend(check(path, lines))
    return found


def read_tree(root):
    """The files that git tracks or would track, path -> text; binary ones are left out."""
    command = ['git', '-c', f'safe.directory={root}', '-C', root, 'ls-files', '-z', '--cached',
               '--others',
               '--exclude-standard']
    listed = subprocess.run(command, capture_output=True, check=True).stdout.decode()
    tree = {}
    for path in listed.split('\0'):
        full = os.path.join(root, path)
        # a deletion that is not committed yet
        if not path or os.path.islink(full) or not os.path.isfile(full):
            continue
        try:
            with open(full, encoding='utf-8') as file:
                tree[path] = file.read()
        except UnicodeDecodeError:
            if path.endswith(CODE):
                raise
    return tree


SPDX = '// SPDX-License-Identifier: Apache-2.0\n'
CLEAN = {
    'storage/base/ids.h': SPDX + '#pragma once\n',
    'storage/database.cc': SPDX
    + '#include <rocksdb/db.h>\n#include <vector>\n#include "storage/base/ids.h"\n',
    'index/tree.cc': SPDX + '#include "storage/database.h"\n',
    'engine/mapping/map.cc': SPDX
    + '#include <ceres/ceres.h>\n#include "storage/model/pinhole.h"\n',
    'engine/engine.cc': SPDX
    + '#include "engine/mapping/map.h"\n#include "engine/engine.h"\n#include "index/tree.h"\n',
    'engine/features/kernels.inc.h': SPDX + 'int x;\n' * (SOURCE_LINES_MAX - 1),
    'cli/main.cc': SPDX + '#include <CLI/CLI.hpp>\n#include "engine/engine.h"\n'
                          '#include "cli/command.h"\n#include "engine/door/answers.h"\n'
                          '#include "storage/base/status.h"\n',
    'tests/storage/database_test.cc':
        SPDX
        + '// Goal: a\n// Method: b\n#include <rocksdb/env.h>\n#include '
          '"tools/render/street/plan.h"\n',
    'tools/run.sh': '#!/usr/bin/env bash\n# SPDX-License-Identifier: Apache-2.0\ncd ../home/work\n',
    'README.md': '| ' + 'x ' * 100 + '|\n- https://example.org/wo' + 'rk/' + 'a' * 100
                 + '\n../wo' + 'rk/b\n',
}
# What is broken, in words; the file that breaks it; the kind of violation that must be found, once.
BROKEN = (
    ('no licence', 'storage/a.cc', 'int x;\n', 'licence'),
    ('another licence', 'storage/a.h', '// SPDX-License-Identifier: MIT\n', 'licence'),
    ('an empty file', 'kernels/a.cl', '', 'licence'),
    ('the licence not straight after the shebang', 'tools/a.py',
     '#!/bin/x\n\n# SPDX-License-Identifier: Apache-2.0\n',
     'licence'),
    ('a schema without a licence', 'storage/a.capnp', '@0x1;\n', 'licence'),
    ('an include upwards', 'storage/a.cc', SPDX + '#include "engine/engine.h"\n', 'floors'),
    ('an include upwards within a folder', 'storage/base/a.h', SPDX
     + '#include "storage/database.h"\n', 'floors'),
    ('an include upwards by angle brackets', 'engine/matching/a.h', SPDX
     + ' # include <engine/mapping/map.h>\n',
     'floors'),
    ('an include across one floor', 'index/a.cc', SPDX + '#include "kernels/device.h"\n', 'floors'),
    ('an include of tools', 'cli/a.cc', SPDX + '#include "tools/render/street/plan.h"\n', 'floors'),
    ('an include of tests', 'engine/a.cc', SPDX + '#include "tests/storage/samples.h"\n', 'floors'),
    ('an include that climbs', 'engine/a.cc', SPDX + '#include "../cli/command.h"\n', 'floors'),
    ('a command that includes a room', 'cli/a.cc', SPDX
     + '#include "engine/query/city_answers.h"\n', 'door'),
    ('a shape that includes storage', 'cli/wire/a.h', SPDX
     + '#include "storage/model/camera.h"\n', 'door'),
    ('RocksDB outside its room', 'engine/a.cc', SPDX + '#include <rocksdb/db.h>\n', 'third party'),
    ('RocksDB in a test of another room', 'tests/cli/a.cc', SPDX + '#include <rocksdb/db.h>\n',
     'third party'),
    ('OpenGV outside its rooms', 'engine/camera/a.cc', SPDX + '#include <opengv/types.hpp>\n',
     'third party'),
    ('Ceres outside its room', 'engine/matching/a.cc', SPDX + '#include <ceres/jet.h>\n',
     'third party'),
    ('Embree outside its rooms', 'tools/render/picture/a.cc', SPDX
     + '#include <embree3/rtcore.h>\n',
     'third party'),
    ("Cap'n Proto outside its rooms", 'engine/a.cc', SPDX + '#include <capnp/message.h>\n',
     'third party'),
    ('KJ outside its rooms', 'index/a.cc', SPDX + '#include <kj/io.h>\n', 'third party'),
    ('OpenCL outside its room', 'fusion/a.cc', SPDX + '#include <CL/cl.h>\n', 'third party'),
    ('a source too long', 'cli/a.cc', SPDX + 'int x;\n' * SOURCE_LINES_MAX, 'size'),
    ('a header too long', 'cli/a.h', SPDX + 'int x;\n' * HEADER_LINES_MAX, 'size'),
    ('a script too long', 'tools/a.sh', '# SPDX-License-Identifier: Apache-2.0\n'
     + ':\n' * SOURCE_LINES_MAX, 'size'),
    ('a line too long', 'cli/a.cc', SPDX + '//' + 'é' * (COLUMNS_MAX - 1) + '\n', 'columns'),
    ('prose too long', 'docs/a.md', 'x ' * (COLUMNS_MAX // 2) + 'x\n', 'columns'),
    ('a link with prose around it', 'docs/a.md',
     'see https://example.org/' + 'a' * COLUMNS_MAX + '\n', 'columns'),
    ('a preset too long', 'CMakePresets.json', ' ' * COLUMNS_MAX + '{}\n', 'columns'),
    ('a CMake file too long', 'cli/CMakeLists.txt',
     '# SPDX-License-Identifier: Apache-2.0\n#' + '#' * COLUMNS_MAX + '\n', 'columns'),
    ('a CMake file without a licence', 'tools/cmake/a.cmake', 'project(x)\n', 'licence'),
    ('a path of one machine in code', 'cli/a.cc', SPDX + 'f("/wo' + 'rk/shared");\n', 'machine'),
    ('a path of one machine in a document', 'docs/a.md', 'see /ho' + 'me/me/x\n', 'machine'),
    ('a build folder of one machine', 'docs/a.md', '`/tmp/bu' + 'ild-me`\n', 'machine'),
    ('a folder at the top that nobody planned', 'utils/a.md', 'x\n', 'top folder'),
    ('a library that prints', 'engine/a.cc', SPDX + 'std::fprintf(stderr, "x");\n', 'quiet'),
    ('a library that reads the environment', 'storage/a.h', SPDX + 'getenv("X");\n', 'quiet'),
    ('an algorithm that returns a subrange', 'index/a.cc', SPDX + 'std::ranges::unique(x);\n',
     'subranges'),
    ('a test without its goal', 'tests/storage/a_test.cc', SPDX + '// Method: b\n', 'opening'),
    ('a test without its method', 'tests/storage/a_test.cc', SPDX + '// Goal: a\n', 'opening'),
)


def self_test():
    """What the checks get wrong on made-up trees."""
    wrong = [f'self-test: the clean tree: {text}' for text in violations(CLEAN)]
    for what, path, text, kind in BROKEN:
        found = violations({**CLEAN, path: text})
        if len(found) != 1 or not found[0].startswith(path) or f' {kind}: ' not in found[0]:
            wrong.append(f'self-test: {what}: one of `{kind}` in {path} was to be found, not '
                         f'{found}')
    for check in CHECKS:
        if not any(list(check(path, text.splitlines())) for _, path, text, _ in BROKEN):
            wrong.append(f'self-test: {check.__name__} never fails')
    return wrong + self_test_listing()


def self_test_listing():
    """Tracked and new files are read; ignored and deleted ones are not."""
    with tempfile.TemporaryDirectory() as root:
        def git(*arguments):
            subprocess.run(['git', '-C', root, *arguments], check=True, capture_output=True)
        git('init')
        for path in ('tracked.md', 'deleted.md', '.gitignore', 'ignored.md', 'new name.md'):
            with open(os.path.join(root, path), 'w', encoding='utf-8') as file:
                file.write('ignored.md\n')
        with open(os.path.join(root, 'picture.png'), 'wb') as file:
            file.write(b'\x89PNG\xff')
        git('add', 'tracked.md', 'deleted.md')
        os.remove(os.path.join(root, 'deleted.md'))
        read = sorted(read_tree(root))
    expected = ['.gitignore', 'new name.md', 'tracked.md']
    return [] if read == expected else [f'self-test: {expected} were to be read, not {read}']


def try_trees(clean, broken, violations):
    """What a check gets wrong on a clean tree, and on each that one file of `broken` breaks."""
    wrong = [f'self-test: the clean tree: {text}' for text in violations(clean)]
    for what, path, text in broken:
        found = list(violations({**clean, path: text}))
        if len(found) != 1 or not found[0].startswith(path):
            wrong.append(f'self-test: {what}: one violation in {path} was to be found, not {found}')
    return wrong


def run(self_test, violations):
    """Shows a script's check its made-up trees, then the project; returns the exit status."""
    root = os.path.abspath(sys.argv[1] if len(sys.argv) > 1
                           else os.path.join(os.path.dirname(__file__), '..'))
    if not os.path.exists(os.path.join(root, '.git')):
        print(f'{root} is no git checkout: nothing says which files are the project\'s')
        return 77  # ctest: skipped
    tree = read_tree(root)
    wrong = [*self_test(), *violations(tree)]
    for text in wrong:
        print(text)
    print(f'{len(tree)} files read, {len(wrong)} violations')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(run(self_test, violations))
