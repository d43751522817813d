#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Makes a large model of COLMAP, binary, to measure `veduta import` by: the true cameras of a street
# that veduta-street has rendered, and as many made points as are wanted, each of which 2 to 12
# photos in a row see.
# usage: large_model.py STREET OUT POINTS
import os
import random
import struct
import sys


def quaternion(r):
    """w, x, y, z of a rotation in rows."""
    trace = r[0][0] + r[1][1] + r[2][2]
    if trace > 0:
        s = (trace + 1) ** .5 * 2
        return (s / 4, (r[2][1] - r[1][2]) / s, (r[0][2] - r[2][0]) / s, (r[1][0] - r[0][1]) / s)
    i = max(range(3), key=lambda k: r[k][k])
    j, k = (i + 1) % 3, (i + 2) % 3
    s = (r[i][i] - r[j][j] - r[k][k] + 1) ** .5 * 2
    q = [(r[k][j] - r[j][k]) / s, 0, 0, 0]
    q[1 + i], q[1 + j], q[1 + k] = s / 4, (r[j][i] + r[i][j]) / s, (r[k][i] + r[i][k]) / s
    return tuple(q)


def camera_of(path):
    """The camera matrix, the size, and cam_from_world as quaternion and translation."""
    with open(path, encoding='utf-8') as file:
        rows = [[float(number) for number in line.split()] for line in file]
    world_from_cam, centre = rows[4:7], rows[7]
    rotation = [list(column) for column in zip(*world_from_cam)]
    translation = [-sum(a * b for a, b in zip(row, centre)) for row in rotation]
    return rows[:3], [int(px) for px in rows[8]], (*quaternion(rotation), *translation)


def main():
    street, out, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    os.makedirs(out)
    names = sorted(os.listdir(os.path.join(street, 'photos')))
    cameras = [camera_of(os.path.join(street, 'truth', name + '.camera')) for name in names]
    k, size, _ = cameras[0]
    with open(os.path.join(out, 'cameras.bin'), 'wb') as file:  # pixels begin at 0.5 there
        file.write(struct.pack('<QiiQQ4d', 1, 1, 1, *size, k[0][0], k[1][1], k[0][2] + .5,
                               k[1][2] + .5))
    chance = random.Random(1)
    seen = [[] for _ in names]
    with open(os.path.join(out, 'points3D.bin'), 'wb') as file:
        file.write(struct.pack('<Q', count))
        for point in range(1, count + 1):
            last = min(len(names), chance.randrange(len(names)) + chance.randint(2, 12))
            track = range(max(0, last - chance.randint(2, 12)), last)
            file.write(struct.pack('<Q3d3BdQ', point, 0, 0, 0, 9, 9, 9, .5, len(track)))
            for i in track:
                file.write(struct.pack('<ii', i + 1, len(seen[i])))
                seen[i].append(point)
    with open(os.path.join(out, 'images.bin'), 'wb') as file:
        file.write(struct.pack('<Q', len(names)))
        for i, (name, camera) in enumerate(zip(names, cameras), 1):
            file.write(struct.pack('<i7di', i, *camera[2], 1) + name.encode() + b'\0')
            file.write(struct.pack('<Q', len(seen[i - 1])))
            for point in seen[i - 1]:
                file.write(struct.pack('<2dq', 1, 1, point))
    print(len(names), 'images,', count, 'points,', sum(map(len, seen)), 'observations')


if __name__ == '__main__':
    main()
