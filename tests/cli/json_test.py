#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: docs/json.md tells the truth: each command prints the keys that it lists, of the types that
#   it lists, and nothing else reaches standard output.
# Method: the tables of the page are read; every command is run with --json on databases of rendered
#   streets, one of which has twin facades, so that merges are proposed and not believed; each line
#   of its output is parsed, and the keys are compared both ways.
# usage: tests/cli/json_test.py VEDUTA VEDUTA_STREET [TEST...]
import collections
import json
import os
import re

from city import (PHOTOS, SIZE, WHOLE, Case, add_command, at, main, make_whole, must, new_database,
                  photo, read, render, run, write)
from daemon import Daemon
from exif_time import with_time

PAGE = os.path.join(os.path.dirname(__file__), '..', '..', 'docs', 'json.md')
# Sections that list no keys: they point to another page.
ELSEWHERE = {'veduta calibrate'}
# Keys of what these databases have none of; tests/cli/wire sees them.
NOT_HERE = {
    'veduta remove': {'removed[].unplaced[]', 'copies[]'},
    'veduta add': {'damaged[].id', 'damaged[].what', 'unplaced[].id', 'unplaced[].why',
                   'split_off[]'},
    'veduta localize': {'damaged[].id', 'damaged[].what'},
    'veduta settle': {'step', 'image', 'reconstruction', 'other', 'merged_into', 'placed',
                      'placed[]', 'error', 'unplaced', 'unplaced[].id', 'unplaced[].why',
                      'split_off', 'split_off[]', 'ms', 'turn_ms'},
    'veduta densify': {'without_depth[].id', 'without_depth[].image', 'without_depth[].reason'},
    'veduta verify': {'violations[]'},
    'veduta repair': {'findings[].damage', 'findings[].remedy', 'lost[]', 'retried[]',
                      'written_out[]'},
}
ROW = re.compile(r'\| `([^`]+)` \| ([a-z]+(?: or null)?) \|')


def documented():
    """Section -> key path -> set of types."""
    sections = {}
    for line in read(PAGE).decode().splitlines():
        if line.startswith('## '):
            section = sections.setdefault(line[3:], {})
        row = ROW.match(line)
        if row:
            assert row[1] not in section, f'{row[1]} is documented twice'
            section[row[1]] = set(row[2].split(' or '))
    return sections


def type_of(value):
    if value is None:
        return 'null'
    return {bool: 'boolean', int: 'integer', float: 'number', str: 'string', list: 'array',
            dict: 'object'}[type(value)]


def flatten(value, path=''):
    """(key path, type) of everything in the value."""
    if path and not path.endswith('[]') or not isinstance(value, (dict, list)):
        yield path, type_of(value)
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flatten(inner, f'{path}.{key}' if path else key)
    if isinstance(value, list):
        for inner in value:
            yield from flatten(inner, path + '[]')


def lines_of(*arguments, code=0):
    """Every line of standard output, parsed; anything that is no JSON fails here."""
    got, out, err = run(*arguments)
    assert got == code, f'{arguments} ended with {got}: {err}'
    return [json.loads(line) for line in out.splitlines()]


def make_merged():
    """Both ends of a street found a reconstruction, and the photos between them join the two."""
    photos = render('long', '--photos', '24', '--length', '14', '--size', SIZE)
    with open(at('ends first'), 'w', encoding='utf-8') as file:
        for number in (*range(1, 9), *range(17, 25), *range(9, 17)):
            file.write(f'photo{number:04}.jpg\n')
    db = new_database('merged')
    return db, lines_of(*add_command(db, photos, '--list', at('ends first')))


def make_doubtful(keep):
    """Two facades that are exactly alike stand so near that photos of both propose a merge, which
    what is around them contradicts."""
    photos, db = render('twins', '--photos', '30', '--length', '38', '--size', SIZE,
                        '--twin-facades', 'near'), new_database('doubtful')
    PRINTED['veduta add'] += lines_of(*add_command(db, photos))
    keep('status', 'status', db)
    seams = PRINTED['veduta status'][-1]['doubtful_seams']
    assert seams, 'nobody has proposed a merge of the twins, or it was believed'
    for seam in seams:
        keep('reconstruction', 'reconstruction', db, str(seam['a']))
        assert seam in PRINTED['veduta reconstruction'][-1]['hypotheses']
    for name in sorted(os.listdir(photos)):
        keep('show', 'show', db, name)
    assert any(shown['hypotheses'] for shown in PRINTED['veduta show'])


def make_on_earth(keep):
    """Photos with GPS, and a surveyed point that three of them show."""
    photos = render('gps', '--photos', '24', '--length', '20', '--size', SIZE, '--gps', '2')
    db = new_database('on earth')
    PRINTED['veduta add'] += lines_of(*add_command(db, photos))
    must('export', db, at('for points'), '--format', 'colmap')
    with open(at('for points', '0', 'images.txt'), encoding='utf-8') as file:
        rows = [line.split() for line in file if not line.startswith('#')]
    seen = collections.defaultdict(list)
    for image, points in zip(rows[0::2], rows[1::2]):
        for x, y, point in zip(points[0::3], points[1::3], points[2::3]):
            seen[point].append((image[9], float(x) - 0.5, float(y) - 0.5))
    seen.pop('-1', None)
    point = max(seen.values(), key=len)
    write(at('gcp.txt'), '\n'.join(
        ['EPSG:4326'] + [f'15.44 47.07 350 {x} {y} {name} corner' for name, x, y in point]
        + ['15.44 47.07 350 1 2 none.jpg corner']).encode())
    keep('georeference', 'georeference', db, '--gcp', at('gcp.txt'), code=1)
    keep('show', 'show', db, point[0][0])
    keep('pose', 'pose', db, point[0][0])
    write(at('timed.jpg'), with_time(read(os.path.join(photos, point[1][0])), '2023:11:14 22:13:20',
                                     '+01:00'))
    PRINTED['veduta add'] += lines_of(*add_command(db, at('timed.jpg')))
    keep('show', 'show', db, 'timed.jpg')
    write(at('asked.jpg'), read(os.path.join(photos, point[0][0])) + b'\0')
    keep('localize', 'localize', db, '--camera', 'c', at('asked.jpg'))


def make_imported():
    """A model of which a photo is missing, imported twice: the second time nothing is made."""
    db = at('imported')
    must('init', db)
    must('export', WHOLE, at('for import'), '--format', 'colmap')
    model = read(at('for import', '0', 'images.txt')).decode()
    missing = next(name for name in sorted(os.listdir(PHOTOS)) if name in model)
    for name in os.listdir(PHOTOS):
        if name != missing:
            write(at('without one', name), read(os.path.join(PHOTOS, name)))
    for _ in range(2):
        PRINTED['veduta import'] += lines_of('import', db, at('for import', '0'), '--images',
                                             at('without one'), '--json', code=1)
    assert PRINTED['veduta import'][1]['reconstruction'] is None


def make_dense():
    """A database with one reconstruction and its surface."""
    photos, db = render('sixteen', '--photos', '16', '--size', SIZE), new_database('dense')
    for number in range(9, 14):
        name = f'photo{number:04}.jpg'
        write(at('five', name), read(os.path.join(photos, name)))
    must(*add_command(db, at('five')))
    return db


def moderate(keep, db):
    """Photos that are reported, and one that is hidden."""
    must('report', db, '#2', 'privacy', '--text', 'my window')
    must('report', db, '#5', 'wrong')
    must('remove', db, '#5')
    keep('reports', 'reports', db, '--all')
    must('hide', db, '#2', '--reason', 'asked')
    keep('hidden', 'hidden', db)
    keep('show', 'show', db, '#2')
    keep('reports', 'reports', db, '--all')
    must('unhide', db, '#2')
    must('report', db, '#4', 'other')
    must('dismiss', db, '3')


def setUpModule():
    """Every command once: section of the page -> what was printed."""
    global PRINTED
    PRINTED = collections.defaultdict(list)

    def keep(section, *arguments, code=0):
        PRINTED['veduta ' + section] += lines_of(*arguments, '--json', code=code)
    PRINTED['veduta add'], _ = make_whole()
    for number, data in enumerate((b'no photo', photo(1))):
        write(at('odd', f'odd{number}.jpg'), data)
    PRINTED['veduta add'] += lines_of(*add_command(WHOLE, at('odd')), code=1)
    merged, lines = make_merged()
    PRINTED['veduta add'] += lines
    for number in sorted({line['reconstruction'] for line in lines} - {None}):
        keep('reconstruction', 'reconstruction', merged, str(number))
    make_doubtful(keep)
    make_on_earth(keep)
    make_imported()
    dense = make_dense()
    keep('densify', 'densify', dense, '--size', '160', '--device', 'cpp')
    keep('export', 'export', dense, at('model'), '--format', 'ply')
    keep('render', 'render', dense, at('a.png'), '--from', 'photo0011.jpg', '--compare')
    keep('settle', 'settle', dense)
    keep('devices', 'devices')
    must('vocabulary', 'train', dense)
    keep('vocabulary info', 'vocabulary', 'info', dense)
    for db, names in ((WHOLE, sorted(os.listdir(PHOTOS))), (dense, sorted(os.listdir(at('five'))))):
        for command in ('status', 'journal', 'verify', 'digest', 'repair'):
            keep(command, command, db)
        keep('camera list', 'camera', 'list', db)
        for name in names:
            keep('show', 'show', db, name)
            keep('neighbors', 'neighbors', db, name)
            if PRINTED['veduta show'][-1]['reconstruction'] is not None:
                keep('pose', 'pose', db, name)
    must('forbid', merged, 'photo0001.jpg', 'photo0024.jpg')
    must('forbid', merged, 'photo0003.jpg', '--pose')
    keep('forbidden', 'forbidden', merged)
    moderate(keep, merged)
    for name, days in (('anna', ()), ('bela', ('--days', '9'))):
        keep('token create', 'token', 'create', merged, name, *days)
    keep('token link', 'token', 'link', merged, 'cara')
    must('token', 'revoke', merged, '1')
    keep('token list', 'token', 'list', merged)
    keep('remove', 'remove', merged, 'photo0012.jpg')
    for _ in range(2):
        keep('backup', 'backup', merged, at('backups'))
    keep('backups thin', 'backups', 'thin', at('backups'), '--keep', '1')
    keep('restore', 'restore', at('backups'), at('restored'))
    write(at('backups', 'backups', '1'), b'')  # a manifest that is damaged
    PRINTED['veduta backups list'] += lines_of('backups', 'list', at('backups'), '--json', code=3)
    write(at('new.jpg'), photo(5) + b'\0')
    with Daemon(WHOLE, '--listen', '127.0.0.1:0') as daemon:
        PRINTED['veduta serve'].append(daemon.started)
    keep('localize', 'localize', WHOLE, '--camera', 'c', at('new.jpg'))
    keep('localize', 'localize', WHOLE, at('new.jpg'))
    keep('neighbors (of a photo that is not stored)', 'neighbors', WHOLE, at('new.jpg'))


class Page(Case):
    def test_what_is_printed_is_documented(self):
        page = documented()
        for section, values in PRINTED.items():
            self.assertIn(section, page)
            for path, kind in (pair for value in values for pair in flatten(value)):
                self.assertIn(path, page[section], f'{section} prints it')
                wanted = page[section][path]
                self.assertTrue(kind in wanted or (kind == 'integer' and 'number' in wanted),
                                f'{section}: {path} is {kind}, not one of {wanted}')

    def test_what_is_documented_is_printed(self):
        for section, keys in documented().items():
            if section in ELSEWHERE:
                self.assertEqual(keys, {})
                continue
            printed = {path for value in PRINTED[section] for path, _ in flatten(value)}
            missing = set(keys) - printed - NOT_HERE.get(section, set())
            self.assertEqual(missing, set(), section)

    def test_every_command_that_answers_in_json_has_a_section(self):
        page = ' '.join(documented())
        for line in must('--help').split('Subcommands:')[1].splitlines():
            found = re.match(r'  (\w+) ', line)
            if found and '--json' in must(found[1], '--help'):
                self.assertIn('veduta ' + found[1], page)

    def test_numbers_are_those_of_the_text(self):
        status = next(s for s in PRINTED['veduta status'] if not s['doubtful_seams'])
        self.assertIn(f'{status["images"]} images: {status["placed"]} placed',
                      must('status', WHOLE))
        digests = [value['digest'] for value in PRINTED['veduta digest']]
        self.assertEqual(digests[0] + '\n', must('digest', WHOLE))
        self.assertTrue(all(value['sound'] for value in PRINTED['veduta verify']))

    def test_a_merged_reconstruction_says_where_it_went(self):
        gone = [r for r in PRINTED['veduta reconstruction'] if r['merged_into'] is not None]
        self.assertEqual(len(gone), 1)
        into = gone[0]['merged_into']
        self.assertAlmostEqual(sum(q * q for q in into['rotation_wxyz']), 1)
        self.assertGreater(into['scale'], 0)
        text = must('reconstruction', at('merged'), str(gone[0]['id']))
        self.assertIn(f'was merged into reconstruction {into["reconstruction"]}', text)
        self.refused(1, 'no reconstruction 99', 'reconstruction', at('merged'), '99')


if __name__ == '__main__':
    main()
