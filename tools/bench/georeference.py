#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# How well photos with GPS, and surveyed points, place a street on the earth, and whether what is
# said of the errors is so. Each seed is a street of its own, whose GPS errs by --gps metres, half
# of the variance in common. Printed of each street, over its placed photos: the root mean square
# error on the plan and in height, the same over the stated standard deviations, the largest such
# ratio on the plan, and the errors of heading, with and without four surveyed points.
# usage: tools/bench/georeference.py VEDUTA VEDUTA_STREET [--seeds 1 2 ...] [--photos 60]
#   [--gps 5] [--extra "--trajectory loop"]
import argparse
import json
import math
import os
import subprocess
import tempfile

ORIGIN = (47.07, 15.44, 350.0)  # of the street: tools/render/street/gps_tags.h
DEGREE_NORTH = 111132.954 - 559.822 * math.cos(2 * math.radians(ORIGIN[0])) + 1.175 * math.cos(
    4 * math.radians(ORIGIN[0]))
DEGREE_EAST = math.radians(1) * 6378137.0 * math.cos(math.radians(ORIGIN[0])) / math.sqrt(
    1 - 0.00669437999 * math.sin(math.radians(ORIGIN[0])) ** 2)


def run(*command):
    done = subprocess.run(command, capture_output=True, check=False)
    return done.stdout.decode()


def truth(folder, name):
    """Focal length and centre in px, rotation from camera to world, centre."""
    with open(os.path.join(folder, 'truth', name + '.camera'), encoding='utf-8') as file:
        rows = [[float(x) for x in line.split()] for line in file]
    return rows[0:3], rows[4:7], rows[7]


def metres(place):
    return ((place['longitude'] - ORIGIN[1]) * DEGREE_EAST,
            (place['latitude'] - ORIGIN[0]) * DEGREE_NORTH, place['height'] - ORIGIN[2])


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def score(veduta, db, folder, names):
    """Errors of all placed photos whose reconstruction has a place."""
    plan, height, heading, plan_ratio, height_ratio = [], [], [], [], []
    for name in names:
        shown = json.loads(run(veduta, 'show', db, name, '--json'))
        place = shown['on_earth']
        if place is None:
            continue
        _, world_from_cam, center = truth(folder, name)
        off = [a - b for a, b in zip(metres(place), center)]
        plan.append(math.hypot(off[0], off[1]))
        height.append(abs(off[2]))
        plan_ratio.append(plan[-1] / place['horizontal_stddev_m'])
        height_ratio.append(height[-1] / place['vertical_stddev_m'])
        east, north = world_from_cam[0][2], world_from_cam[1][2]
        turned = place['heading_deg'] - math.degrees(math.atan2(east, north))
        heading.append((turned + 180) % 360 - 180)
    if not plan:
        return 'no photo on the earth'
    return (f'{len(plan)} photos on the earth; plan {rms(plan):.3f} m, {rms(plan_ratio):.2f} of '
            f'the stated (largest {max(plan_ratio):.2f}); height {rms(height):.3f} m, '
            f'{rms(height_ratio):.2f} of the stated; heading {rms(heading):.2f} degrees')


def write_points(path, folder, names, size):
    """Four points at the fronts, as the true cameras see them, to half a pixel."""
    centers = [truth(folder, name)[2] for name in names]
    with open(path, 'w', encoding='utf-8') as file:
        file.write('EPSG:4326\n')
        for number in range(4):
            middle = centers[(2 * number + 1) * len(centers) // 8]
            point = [middle[0] + 1.5 * number, middle[1] + (6 if number % 2 else -6),
                     1 + 2 * number]
            for name in names:
                k, world_from_cam, center = truth(folder, name)
                away = [p - c for p, c in zip(point, center)]
                x, y, z = (sum(world_from_cam[j][i] * away[j] for j in range(3)) for i in range(3))
                if z <= 0.5:
                    continue
                px = (round(2 * (k[0][0] * x / z + k[0][2])) / 2,
                      round(2 * (k[1][1] * y / z + k[1][2])) / 2)
                if 0 <= px[0] < size[0] and 0 <= px[1] < size[1]:
                    file.write(f'{ORIGIN[1] + point[0] / DEGREE_EAST:.10f} '
                               f'{ORIGIN[0] + point[1] / DEGREE_NORTH:.10f} '
                               f'{ORIGIN[2] + point[2]:.4f} {px[0]} {px[1]} {name} p{number}\n')


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('veduta')
    parser.add_argument('street')
    parser.add_argument('--seeds', nargs='+', default=['1'])
    parser.add_argument('--photos', default='60')
    parser.add_argument('--gps', default='5')
    parser.add_argument('--extra', default='')
    options = parser.parse_args()
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            street, db = os.path.join(folder, 'street'), os.path.join(folder, 'db')
            run(options.street, street, '--photos', options.photos, '--size', '512x384', '--seed',
                seed, '--gps', options.gps, '--noise', '2', '--exposure', '0.3', '--shuffle', 'yes',
                '--quiet', *options.extra.split())
            names = sorted(os.listdir(os.path.join(street, 'photos')))
            run(options.veduta, 'init', db)
            run(options.veduta, 'camera', 'add', db, 'c', '--size', '512x384', '--params',
                '450.56,450.56,255.5,191.5')
            run(options.veduta, 'add', db, '--camera', 'c', os.path.join(street, 'photos'))
            print(f'seed {seed}, GPS: {score(options.veduta, db, street, names)}', flush=True)
            points = os.path.join(folder, 'gcp_list.txt')
            write_points(points, street, names, (512, 384))
            run(options.veduta, 'georeference', db, '--gcp', points, '--deviation', '0.02')
            print(f'seed {seed}, and points: {score(options.veduta, db, street, names)}',
                  flush=True)


if __name__ == '__main__':
    main()
