#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: an include without its declared library is refused, as is a source that no target compiles,
#   and a library that CMake links past its floor.
# Method: CMake writes what each target declares into declarations.json. Each file of a target is
#   read, and every header that it includes must belong to the target itself, to a library that the
#   target links, or to one that such a library hands on. Before that, each check is shown a made-up
#   tree that breaks it once, and must find that and nothing else.
# usage: tests/tidy/includes_test.py DECLARATIONS
import json
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import tidy_test  # noqa: E402 (the line above finds it)

# How a header of others begins: the targets of which one must be declared.
PACKAGES = {
    'Eigen/': ('Eigen3::Eigen',),
    'Eigen/CholmodSupport': ('SuiteSparse::CHOLMOD',),
    'opencv2/core': ('opencv_core',),
    'opencv2/calib3d': ('opencv_calib3d',),
    'opencv2/imgcodecs': ('opencv_imgcodecs',),
    'opencv2/imgproc': ('opencv_imgproc',),
    'rocksdb/': ('RocksDB::rocksdb-shared',),
    'capnp/': ('CapnProto::capnp',),
    'kj/': ('CapnProto::capnp', 'CapnProto::kj'),
    'suitesparse/': ('SuiteSparse::CHOLMOD',),
    'ceres/': ('Ceres::ceres',),
    'glog/': ('glog::glog',),
    'opengv/': ('opengv',),
    'embree3/': ('embree',),
    'OpenMesh/': ('OpenMeshCore',),
    'flann/': ('flann::flann',),
    'CL/': ('OpenCL::OpenCL',),
    'CLI/': ('CLI11::CLI11',),
    'nlohmann/': ('nlohmann_json::nlohmann_json',),
    'openssl/': ('OpenSSL::Crypto',),
    'turbojpeg.h': ('turbojpeg::turbojpeg',),
    'png.h': ('PNG::PNG',),
    'tiffio.h': ('TIFF::TIFF',),
    'exiv2/': ('exiv2lib',),
    'GeographicLib/': ('GeographicLib::GeographicLib',),
    'proj.h': ('PROJ::proj',),
    'sodium.h': ('sodium::sodium',),
    'seccomp.h': ('seccomp::seccomp',),
    'libheif/': ('heif::heif',),
    'libde265/': ('de265::de265',),
    'webp/mux.h': ('webpmux::webpmux',),
    'webp/': ('webp::webp',),
    'tinyxml2.h': ('tinyxml2::tinyxml2',),
    'yaml-cpp/': ('yaml-cpp',),
    'hpdf.h': ('hpdf::hpdf',),
    'gtest/': ('GTest::gtest_main',),
    'benchmark/': ('benchmark::benchmark',),
}
# What the compiler and the C library bring: the standard library's headers have no dot and no
# slash, and these.
SYSTEM = re.compile(r'[a-z_0-9]+|sys/[a-z]+\.h'
                    r'|(arpa/inet|netinet/(in|tcp)|unistd|fcntl|malloc|spawn)\.h'
                    r'|([a-z]?mmintrin|immintrin)\.h')
LINK_ONLY = re.compile(r'\$<LINK_ONLY:(.*)>')


PROGRAM = 'a program'


class Declarations:
    """What the targets declare, and which one each file belongs to."""

    def __init__(self, targets, files):
        self.targets = targets
        self.files = files
        self.closures = {}
        self.owners, self.folders = {}, {}
        libraries_last = sorted(targets, key=lambda name: self.is_library(name))
        # where both have a file in a folder, the library has its headers
        for name in libraries_last:
            for source in targets[name]['sources']:
                self.owners[source] = name
                for ending in ('.h', '.inc.h', '.inc'):
                    self.owners[source.removesuffix('.cc') + ending] = name
                self.folders[os.path.dirname(source)] = name
            if targets[name]['header_folder']:
                self.folders[targets[name]['header_folder']] = name

    def is_library(self, name):
        return self.targets[name]['type'] != 'EXECUTABLE'

    def owner(self, path):
        """The library that a header belongs to, or PROGRAM for one beside a program or a test,
        which is read as a part of each source that includes it; None for one of nobody."""
        folder = os.path.dirname(path)
        name = self.owners.get(path)
        if name is None and not tidy_test.is_under(path, 'tests'):
            name = self.folders.get(folder)
        if name is None or not self.is_library(name):
            is_beside = folder in self.folders or tidy_test.is_under(path, 'tests')
            return PROGRAM if is_beside else None
        return name

    def resolve(self, path, header):
        """The project's file that an include means; None when it is a header of others."""
        beside = os.path.join(os.path.dirname(path), header)
        found = [name for name in (header, beside) if name in self.files or name in self.owners]
        return found[0] if found else None

    def handed_on(self, name):
        """The target and all that it hands on to whoever links it."""
        if name not in self.closures:
            self.closures[name] = {name}
            for link in self.targets.get(name, {}).get('interface', ()):
                if not LINK_ONLY.fullmatch(link):
                    self.closures[name] |= self.handed_on(link)
        return self.closures[name]

    def allowed(self, name):
        """All targets whose headers the files of a target may include."""
        links = self.targets[name]['links'] or self.targets[name]['interface']
        return {name}.union(*(self.handed_on(link) for link in links))


def needed_packages(header):
    """The targets of others of which one must be declared for a header; empty for the system's;
    None when the header is not known."""
    found = [prefix for prefix in PACKAGES if header.startswith(prefix)]
    if found:
        return PACKAGES[max(found, key=len)]
    return () if SYSTEM.fullmatch(header) else None


def check_file(declared, target, path, seen):
    """What a file includes, as a part of a target."""
    seen.add(path)
    for number, header in tidy_test.included(path, declared.files[path].splitlines()):
        where = f'{path}:{number}: '
        own = declared.resolve(path, header)
        needed = (declared.owner(own),) if own else needed_packages(header)
        if needed is None:
            yield f'{where}unknown: PACKAGES does not say which package brings {header}'
        elif needed == (None,):
            yield f'{where}ownership: {header} belongs to no target'
        elif needed == (PROGRAM,):
            if own in declared.files and own not in seen:
                yield from check_file(declared, target, own, seen)
        elif needed and not declared.allowed(target).intersection(needed):
            yield (f'{where}include: {target} declares no {" or ".join(needed)}, which {header} '
                   'needs')


def check_includes(declared):
    for name, target in sorted(declared.targets.items()):
        for path in target['sources']:
            if path in declared.files:
                yield from check_file(declared, name, path, set())
    for path in sorted(declared.files):
        owner = declared.owner(path)
        if owner not in (None, PROGRAM) and path not in declared.targets[owner]['sources']:
            yield from check_file(declared, owner, path, set())


def check_orphans(declared):
    compiled = {source for target in declared.targets.values() for source in target['sources']}
    for path in sorted(declared.files):
        if path.endswith('.cc') and path not in compiled:
            yield f'{path}: orphan: no target compiles it'


def check_floors(declared):
    floors = {name: int(target['floor']) for name, target in declared.targets.items()
              if target['floor'] != ''}
    for name, floor in floors.items():
        for link in declared.targets[name]['links']:
            if link in floors and floors[link] >= floor:
                yield f'{name}: floors: floor {floor} links {link} of floor {floors[link]}'


def check_rooms(declared):
    """The floors of CMake and those of tidy_test.py are the same."""
    for name, target in sorted(declared.targets.items()):
        rooms = {tidy_test.room_of(source) for source in target['sources']} - {None}
        for room in rooms if target['floor'] != '' else ():
            if tidy_test.ROOMS[room] != int(target['floor']):
                yield (f'{name}: rooms: floor {target["floor"]} here, and its folder {room} has '
                       f'floor {tidy_test.ROOMS[room]} in tidy_test.py')


CHECKS = (check_includes, check_orphans, check_floors, check_rooms)


def violations(declared):
    return [text for check in CHECKS for text in check(declared)]


def target(sources, links=(), interface=(), floor='', type_='STATIC_LIBRARY', header_folder=''):
    return {'type': type_, 'floor': floor, 'sources': list(sources), 'links': list(links),
            'interface': list(interface), 'header_folder': header_folder}


def sample(**changes):
    """A clean made-up tree; `changes` replaces the text of a file, or what a target declares."""
    targets = {
        'base': target(['storage/base/ids.cc'], ['Eigen3::Eigen'], ['Eigen3::Eigen'], '0'),
        'model': target([], [], ['base'], '5', header_folder='storage/model'),
        'store': target(['storage/db.cc', 'storage/made.c++'],
                        ['RocksDB::rocksdb-shared', 'model'],
                        ['$<LINK_ONLY:RocksDB::rocksdb-shared>', 'model'], '10'),
        'tree': target(['index/tree.cc'], ['store'], ['store'], '20'),
        'program': target(['cli/main.cc'], ['tree'], type_='EXECUTABLE'),
    }
    files = {
        'storage/base/ids.cc': '#include "storage/base/ids.h"\n',
        'storage/base/ids.h': '#include <Eigen/Core>\n#include <vector>\n',
        'storage/model/view.h': '#include "storage/base/ids.h"\n',
        'storage/db.cc': '#include <rocksdb/db.h>\n#include "storage/model/view.h"\n',
        'storage/db.h': '#include <unistd.h>\n#include "storage/base/ids.h"\n',
        'index/tree.cc': '#include <Eigen/Dense>\n#include "storage/db.h"\n',
        'index/tree.h': '',
        'cli/main.cc': '#include "index/tree.h"\n#include "command.h"\n',
        'cli/command.h': '#include "storage/model/view.h"\n',
    }
    files.update(changes.get('files', {}))
    targets.update(changes.get('targets', {}))
    return Declarations(targets, files)


# What is broken, in words; the changes to the made-up tree; how the one violation begins.
BROKEN = (
    ('a library not declared', {'files': {'storage/base/ids.cc': '#include "storage/db.h"\n'}},
     'storage/base/ids.cc:1: include: base declares no store'),
    ('a library not declared, in a header',
     {'files': {'storage/model/a.h': '#include "index/tree.h"\n'}},
     'storage/model/a.h:1: include: model declares no tree'),
    ('a private library of a library', {'files': {'index/tree.cc': '#include <rocksdb/db.h>\n'}},
     'index/tree.cc:1: include: tree declares no RocksDB'),
    ('a package not declared', {'files': {'index/tree.h': '\n#include <ceres/ceres.h>\n'}},
     'index/tree.h:2: include: tree declares no Ceres::ceres'),
    ('a program without the library', {'targets': {'program': target(['cli/main.cc'], ['model'],
                                                                     type_='EXECUTABLE')}},
     'cli/main.cc:1: include: program declares no tree'),
    ('a package nobody knows', {'files': {'index/tree.h': '#include <boost/any.hpp>\n'}},
     'index/tree.h:1: unknown: PACKAGES does not say which package brings boost'),
    ('a header of no target',
     {'files': {'fusion/a.h': '', 'cli/main.cc': '#include "fusion/a.h"\n'}},
     'cli/main.cc:1: ownership: fusion/a.h'),
    ('a source that no target compiles', {'files': {'index/lost.cc': ''}},
     'index/lost.cc: orphan'),
    ('a library linked upwards', {'targets': {'base': target(
        ['storage/base/ids.cc'], ['Eigen3::Eigen', 'tree'], ['Eigen3::Eigen'], '0')}},
     'base: floors: floor 0 links tree'),
    ('another floor than tidy_test.py has', {'targets': {'tree': target(
        ['index/tree.cc'], ['store'], ['store'], '21')}},
     'tree: rooms: floor 21'),
)


def self_test():
    wrong = [f'self-test: the clean tree: {text}' for text in violations(sample())]
    for what, changes, beginning in BROKEN:
        found = violations(sample(**changes))
        if len(found) != 1 or not found[0].startswith(beginning):
            wrong.append(f'self-test: {what}: `{beginning}` was to be found, not {found}')
    for check in CHECKS:
        if not any(list(check(sample(**changes))) for _, changes, _ in BROKEN):
            wrong.append(f'self-test: {check.__name__} never fails')
    return wrong


def read_declarations(path):
    """The targets, with paths from the root (those that the build makes: from the build folder)."""
    with open(path, encoding='utf-8') as file:
        read = json.load(file)
    root, build = read['root'], os.path.dirname(os.path.abspath(path))
    for made in read['targets'].values():
        sources = [os.path.join(made['folder'], source) for source in made['sources']
                   if not source.startswith('$<')]
        made['sources'] = [os.path.relpath(source, build if source.startswith(build + '/')
                                           else root)
                           for source in sources]
        if made['header_folder']:
            made['header_folder'] = os.path.relpath(made['header_folder'], root)
        # The compiler of schemas writes NAME.capnp.c++, whose header is NAME.capnp.h.
        made['sources'] = [re.sub(r'\.capnp\.c\+\+$', '.capnp.cc', path)
                           for path in made['sources']]
    return root, read['targets']


def main():
    wrong = self_test()
    root, targets = read_declarations(sys.argv[1])
    if not os.path.exists(os.path.join(root, '.git')):
        print(f'{root} is no git checkout: nothing says which files are the project\'s')
        return 77  # ctest: skipped
    tree = tidy_test.read_tree(root)
    files = {path: text for path, text in tree.items() if path.endswith(tidy_test.INCLUDERS)}
    wrong += violations(Declarations(targets, files))
    for text in wrong:
        print(text)
    print(f'{len(targets)} targets, {len(files)} files read, {len(BROKEN)} made-up trees, '
          f'{len(wrong)} violations')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
