#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What adding photos costs, step by step: the paper's Table 1 for Veduta, beside COLMAP.

Adds a folder's photos in one shuffled order per seed, each into a database of its own, and writes
one table per data set into a Markdown file. Times are those that `veduta add --json` reports; wall
clock, memory and the database's size are measured from outside. COLMAP runs on the CPU on the same
photos with the same fixed intrinsics and the same number of threads, once after each of as many
seeds as --colmap-runs says, so that both see the same machine.
"""
import argparse
import datetime
import glob
import json
import os
import random
import re
import shutil
import statistics
import subprocess
import sys
import textwrap
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SUFFIXES = ('.jpg', '.jpeg', '.png', '.tif', '.tiff')

# Milliseconds, of the paper's Table 1: an Athlon 64 X2 4400+, photos of 2272x1704, 3000 five-point
# samples a pair.
PAPER_MS = {'undistort': '1000', 'features': '1600', 'retrieve': '200', 'match': '350',
            'verify': '400', 'map': '500'}

INTRODUCTION = """# Benchmarks

Written by `tools/bench/bench.py`, one section per data set; a run replaces its own section only.
Every photo is added to the database that the photos before it made, in a shuffled order. Times of
steps are wall clock within one photo, with the threads that the run had; those of decoding,
undistorting and features are of one thread, for whole photos are prepared side by side. Compare
figures of one section: the machine differs, and its load at the start stands with each. On a busy
machine processor time is the fairer measure.
"""


def fail(message):
    sys.exit(f'bench.py: {message}')


def relative(path):
    return os.path.relpath(path, ROOT)


def run(command, **options):
    """Runs a command; its exit status, standard output and what it cost."""
    start = time.monotonic()
    child = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, **options)
    output = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    cost = {'seconds': time.monotonic() - start, 'cpu_seconds': usage.ru_utime + usage.ru_stime,
            'peak_mb': usage.ru_maxrss / 1024}
    return child.returncode, output, cost


def run_or_fail(command, log, accepted=(0,), **options):
    with open(log, 'w', encoding='utf-8', errors='replace') as errors:
        code, output, cost = run(command, stderr=errors, **options)
    if code not in accepted:
        with open(log, encoding='utf-8', errors='replace') as errors:
            tail = errors.read()[-2000:]
        fail(f'{" ".join(command[:3])} ... ended with {code}:\n{tail or output[-2000:]}')
    return output, cost


def parse_camera(text):
    match = re.fullmatch(r'(\d+x\d+),(.*)', text)
    params = match[2].split(',') if match else []
    if len(params) not in (4, 6):
        fail(f'--camera {text}: WxH,fx,fy,cx,cy[,k1,k2] is wanted')
    return match[1], [float(p) for p in params]


def score(models, arguments):
    """The scorer's line for the model with most images, as a dictionary; empty without truth or
    scorer."""
    if not (arguments.truth and arguments.scorer and models):
        return {}
    command = ['/usr/bin/python3', arguments.scorer, arguments.truth]
    command += [os.path.join(m, 'images.txt') for m in models]
    code, output, _ = run(command, stderr=subprocess.DEVNULL)
    best = {}
    pattern = (r'(\d+)/(\d+) registered\s+centre mean ([\d.]+).*max ([\d.]+) mm\s+'
               r'rotation mean ([\d.]+)')
    for line in output.splitlines() if code == 0 else []:
        found = re.search(pattern, line)
        if found and int(found[1]) > best.get('registered', 0):
            best = {'registered': int(found[1]), 'center_mm': float(found[3]),
                    'center_max_mm': float(found[4]),
                    'rotation_deg': float(found[5])}
    return best


def add_photos(photos, seed, folder, arguments):
    """One database from the photos in the seed's order: everything measured of it."""
    size, params = arguments.camera
    database = os.path.join(folder, 'city.veduta')
    order = list(photos)
    random.Random(seed).shuffle(order)
    photo_list = os.path.join(folder, 'photos.txt')
    with open(photo_list, 'w', encoding='utf-8') as file:
        file.writelines(os.path.abspath(p) + '\n' for p in order)
    log = os.path.join(folder, 'log.txt')
    veduta = arguments.veduta
    run_or_fail([veduta, 'init', database], log)
    intrinsics = ','.join(map(str, params))
    run_or_fail([veduta, 'camera', 'add', database, 'bench', '--size', size, '--params',
                 intrinsics], log)
    # Exit status 1 says that a photo was rejected: that is a result, not a failure.
    command = [veduta, 'add', database, '--camera', 'bench', '--list', photo_list, '--json',
               '--threads', str(arguments.threads)]
    output, cost = run_or_fail(command, log, accepted=(0, 1))
    lines = [json.loads(line) for line in output.splitlines()]
    if len(lines) != len(photos):
        fail(f'veduta add reported {len(lines)} of {len(photos)} photos')
    status = json.loads(run_or_fail([veduta, 'status', database, '--json'], log)[0])
    run_or_fail([veduta, 'export', database, os.path.join(folder, 'model'), '--format', 'colmap'],
                log)
    models = sorted(glob.glob(os.path.join(folder, 'model', '*')))
    return {'seed': seed, 'lines': lines, **cost, 'status': status,
            'score': score(models, arguments)}


def run_colmap(photos, folder, arguments):
    size, params = arguments.camera
    model, values = 'PINHOLE', list(params[:4])
    values[2] += 0.5  # COLMAP's pixel (0, 0) is the corner of the top-left pixel, ours its centre
    values[3] += 0.5
    if len(params) == 6:
        model, values = 'OPENCV', values + params[4:] + [0.0, 0.0]
    database, sparse = os.path.join(folder, 'colmap.db'), os.path.join(folder, 'sparse')
    os.makedirs(sparse)
    photo_list = os.path.join(folder, 'colmap-photos.txt')
    with open(photo_list, 'w', encoding='utf-8') as file:
        file.writelines(os.path.relpath(p, arguments.dataset) + '\n' for p in photos)
    threads = str(arguments.threads)
    environment = dict(os.environ, QT_QPA_PLATFORM='offscreen', OMP_NUM_THREADS=threads)
    images = ['--database_path', database, '--image_path', arguments.dataset]
    steps = {
        'features': ['feature_extractor', *images, '--image_list_path', photo_list,
                     '--ImageReader.single_camera', '1',
                     '--ImageReader.camera_model', model, '--ImageReader.camera_params',
                     ','.join(map(str, values)),
                     '--SiftExtraction.use_gpu', '0', '--SiftExtraction.num_threads', threads],
        'matching': ['exhaustive_matcher', '--database_path', database, '--SiftMatching.use_gpu',
                     '0',
                     '--SiftMatching.num_threads', threads],
        'mapping': ['mapper', *images, '--output_path', sparse, '--Mapper.ba_refine_focal_length',
                    '0',
                    '--Mapper.ba_refine_principal_point', '0', '--Mapper.ba_refine_extra_params',
                    '0',
                    '--Mapper.num_threads', threads],
    }
    log = os.path.join(folder, 'colmap-log.txt')
    costs = {name: run_or_fail(['colmap', *command], log, env=environment)[1] for name,
             command in steps.items()}
    result = {'steps': {name: cost['seconds'] for name, cost in costs.items()},
              'seconds': sum(cost['seconds'] for cost in costs.values()),
              'cpu_seconds': sum(cost['cpu_seconds'] for cost in costs.values()),
              'peak_mb': max(cost['peak_mb'] for cost in costs.values())}
    models = sorted(glob.glob(os.path.join(sparse, '*')))
    for path in models:
        run_or_fail(['colmap', 'model_converter', '--input_path', path, '--output_path', path,
                     '--output_type', 'TXT'],
                    log, env=environment)
    result['models'] = len(models)
    result['registered'] = max((count_images(path) for path in models), default=0)
    result['score'] = score(models, arguments)
    return result


def count_images(model):
    with open(os.path.join(model, 'images.txt'), encoding='utf-8') as file:
        return sum(1 for line in file if not line.startswith('#')) // 2


def digits(value):
    """Three significant ones, without an exponent; what is under a microsecond is nothing."""
    if value < 0.001:
        return '0'
    return f'{value:.0f}' if value >= 100 else f'{value:#.3g}'.rstrip('.')


def step_rows(lines):
    """(step, key of the paper's figure, values in ms): of photos that are not rejected, of all
    seeds."""
    stored = [line for line in lines if line['verdict'] not in ('rejected', 'duplicate')]
    ms = [line['ms'] for line in stored]
    matched = [line for line in stored if line['pairs_tried'] > 0]
    return [
        ('decode', None, [m['decode'] for m in ms]),
        ('undistort (a pinhole camera needs none)', 'undistort', [m['undistort'] for m in ms]),
        ('features', 'features', [m['features'] for m in ms]),
        ('retrieve', 'retrieve', [m['retrieve'] for m in ms]),
        ('match, a pair', 'match', [line['ms']['match'] / line['pairs_tried'] for line in matched]),
        ('verify, a pair', 'verify', [line['ms']['verify'] / line['pairs_tried']
                                      for line in matched]),
        ('map: pose, new points', 'map', [m['map'] for m in ms if m['map'] > 0]),
        ('local adjustment', None, [m['adjust'] for m in ms if m['adjust'] > 0]),
        ('global adjustment and other follow-up, where over 1 ms', None,
         [m['follow'] for m in ms if m['follow'] > 1]),
        ('commit', None, [m['commit'] for m in ms]),
        ('a photo, all of it', None, [m['total'] for m in ms]),
    ]


def listing(values, form):
    """The median, and where there are several values their range."""
    if not values:
        return '-'
    text = form.format(statistics.median(values))
    if len(values) == 1:
        return text
    return f'{text} ({form.format(min(values))} to {form.format(max(values))})'


def result_rows(runs, colmaps, photo_count):
    """(what, Veduta, COLMAP)."""
    lines = [line for one in runs for line in one['lines']]
    total_ms = sum(line['ms']['total'] for line in lines)
    commit_share = 100 * sum(line['ms']['commit'] for line in lines) / max(total_ms, 1e-9)

    def costs(key, form):
        return [listing([one[key] for one in results], form) for results in (runs, colmaps)]

    def scores(key, form):
        return [listing([r['score'][key] for r in results if key in r['score']], form)
                for results in (runs, colmaps)]

    placed = ' '.join(str(one['status']['placed']) for one in runs)
    models = ' '.join(str(len(one['status']['reconstructions'])) for one in runs)
    speeds = [listing([photo_count / one['seconds'] for one in results], '{:.2f}')
              for results in (runs, colmaps)]
    rows = [
        (f'photos placed, of {photo_count}, a run', placed,
         ' '.join(str(c['registered']) for c in colmaps)),
        ('reconstructions, a run', models, ' '.join(str(c['models']) for c in colmaps)),
        ('seconds in all', *costs('seconds', '{:.2f}')),
        ('seconds of processor time', *costs('cpu_seconds', '{:.2f}')),
        ('photos per second', *speeds),
        ('centre error, mean, mm', *scores('center_mm', '{:.2f}')),
        ('centre error, largest, mm', *scores('center_max_mm', '{:.2f}')),
        ('rotation error, mean, degrees', *scores('rotation_deg', '{:.4f}')),
        ('peak memory, MB', *costs('peak_mb', '{:.0f}')),
        ('database, MB a photo', listing([one['status']['bytes'] / photo_count / 1e6
                                          for one in runs], '{:.2f}'), ''),
        ('commits, share of the time of all photos', f'{commit_share:.1f} %', ''),
    ]
    if colmaps:
        steps = ', '.join(listing([c['steps'][name] for c in colmaps], '{:.1f}')
                          for name in colmaps[0]['steps'])
        rows.append(('seconds: ' + ', '.join(colmaps[0]['steps']), '', steps))
        for what, key in (('time', 'seconds'), ('processor time', 'cpu_seconds')):
            ratio = (statistics.median(one[key] for one in runs) /
                     statistics.median(c[key] for c in colmaps))
            rows.append((f'**{what}, Veduta : COLMAP**', f'**{ratio:.3f} : 1**',
                         f'{1 / ratio:.1f} times ours'))
    return rows


def machine():
    text = subprocess.run(['lscpu'], capture_output=True, text=True,
                          env=dict(os.environ, LC_ALL='C')).stdout
    name = re.search(r'Model name:\s*(.*)', text)
    return f'{name[1] if name else "unknown processor"}, {os.cpu_count()} cores'


def version():
    command = ['git', '--no-optional-locks', 'describe', '--always', '--dirty', '--tags']
    return subprocess.run(command, cwd=ROOT, capture_output=True,
                          text=True).stdout.strip() or 'unknown version'


def shell_block(command):
    """A command as Markdown, in lines of at most 100 columns."""
    lines = textwrap.wrap(command, 96, subsequent_indent='  ', break_long_words=False,
                          break_on_hyphens=False)
    return ['```sh', *[line + ' \\' for line in lines[:-1]], lines[-1], '```']


def section(name, runs, colmaps, photo_count, load, command):
    lines = [line for one in runs for line in one['lines']]
    text = [f'## {name}', '',
            f'{datetime.date.today().isoformat()} · {machine()}, load {load:.1f} at the start · '
            f'{version()} · '
            f'seeds {", ".join(str(one["seed"]) for one in runs)}', '', *shell_block(command), '',
            '| | Veduta | worst photo | COLMAP | paper, 2007 |',
            '| --- | ---: | ---: | ---: | ---: |',
            '| **median ms of a photo** | | | | |']
    for step, paper, values in step_rows(lines):
        if values and len(values) < len(lines):
            step += f' ({len(values)} of {len(lines)} photos)'
        ours = (digits(statistics.median(values)), digits(max(values))) if values else ('-', '-')
        text.append(f'| {step} | {" | ".join(ours)} | | {PAPER_MS.get(paper, "")} |')
    text.append('| **all photos** | | | | |')
    for what, ours, theirs in result_rows(runs, colmaps, photo_count):
        text.append(f'| {what} | {ours} | | {theirs if colmaps else ""} | |')
    return '\n'.join(text) + '\n'


def write_section(path, name, text):
    begin, end = f'<!-- bench {name} -->\n', f'<!-- /bench {name} -->\n'
    old = INTRODUCTION
    if os.path.exists(path):
        with open(path, encoding='utf-8') as file:
            old = file.read()
    marked = begin + text + end
    if begin in old and end in old:
        new = old[:old.index(begin)] + marked + old[old.index(end) + len(end):]
    else:
        new = old.rstrip('\n') + '\n\n' + marked
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    with open(path, 'w', encoding='utf-8') as file:
        file.write(new)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('dataset', metavar='DATASET_FOLDER',
                        help='its images, not those in folders below it')
    parser.add_argument('--camera', required=True,
                        help='WxH,fx,fy,cx,cy[,k1,k2]; the first pixel\'s centre is 0,0')
    parser.add_argument('--truth', help='folder of NAME.camera files')
    parser.add_argument('--scorer', help='path of score_poses.py')
    parser.add_argument('--threads', type=int, default=2)
    parser.add_argument('--seeds', default='1,2,3,4,5', help='one order of the photos each')
    parser.add_argument('--colmap', action='store_true', help='run COLMAP too (package colmap)')
    parser.add_argument('--colmap-runs', type=int, default=1, help='how often')
    parser.add_argument('--out',
                        help='Markdown file to update; without it the section is only printed')
    parser.add_argument('--veduta', default=os.path.join(ROOT, 'build/release/cli/veduta'))
    parser.add_argument('--keep', action='store_true',
                        help='leave databases and models in out/bench/')
    arguments = parser.parse_args()
    arguments.camera_text = arguments.camera
    arguments.camera = parse_camera(arguments.camera)
    arguments.seeds = [int(seed) for seed in arguments.seeds.split(',')]
    for name in ('dataset', 'truth', 'scorer', 'veduta', 'out'):
        value = getattr(arguments, name)
        if value:
            setattr(arguments, name, os.path.abspath(value))
            if name != 'out' and not os.path.exists(value):
                fail(f'there is no {value}')
    if arguments.truth and not arguments.scorer:
        fail('--truth needs --scorer')
    if arguments.colmap and not shutil.which('colmap'):
        fail('colmap is not installed; tools/install.sh --dev installs it')
    return arguments


def command_of(arguments):
    """The command as it can be given again in the repository's root."""
    words = ['tools/bench/bench.py', relative(arguments.dataset), '--camera', arguments.camera_text]
    for name in ('truth', 'scorer', 'veduta'):
        if getattr(arguments, name):
            words += [f'--{name}', relative(getattr(arguments, name))]
    words += ['--threads', str(arguments.threads), '--seeds', ','.join(map(str, arguments.seeds))]
    if arguments.colmap:
        words += ['--colmap'] + (['--colmap-runs', str(arguments.colmap_runs)]
                                 if arguments.colmap_runs != 1 else [])
    return ' '.join(words + (['--out', relative(arguments.out)] if arguments.out else []))


def main():
    arguments = parse_arguments()
    load = os.getloadavg()[0]
    photos = sorted(p for p in glob.glob(os.path.join(arguments.dataset, '*'))
                    if p.lower().endswith(SUFFIXES))
    if not photos:
        fail(f'{arguments.dataset} holds no photos')
    for photo in photos:  # into the page cache, for both programs alike
        with open(photo, 'rb') as file:
            file.read()
    name = os.path.basename(arguments.dataset)
    work = os.path.join(ROOT, 'out', 'bench', name)
    shutil.rmtree(work, ignore_errors=True)
    runs, colmaps = [], []
    for i, seed in enumerate(arguments.seeds):
        folder = os.path.join(work, str(seed))
        os.makedirs(folder)
        runs.append(add_photos(photos, seed, folder, arguments))
        print(f'{name} seed {seed}: {runs[-1]["seconds"]:.2f} s, '
              f'{runs[-1]["status"]["placed"]}/{len(photos)} placed, '
              f'{runs[-1]["score"]}', file=sys.stderr)
        if arguments.colmap and i < arguments.colmap_runs:
            colmaps.append(run_colmap(photos, folder, arguments))
            print(f'{name} COLMAP: {colmaps[-1]}', file=sys.stderr)
    text = section(name, runs, colmaps, len(photos), load, command_of(arguments))
    print(text)
    if arguments.out:
        write_section(arguments.out, name, text)
    if not arguments.keep:
        shutil.rmtree(work)


if __name__ == '__main__':
    main()
