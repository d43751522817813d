#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Copies JPEGs with EXIF that says who took them, as telephones write it, right or wrong.

tools/bench/write_exif.py PHOTOS OUT --model MODEL --focal-mm F --focal-35mm F [--make MAKE]

EXIF that the photos have is left out. The equivalent on film is a whole number of millimetres, as
EXIF has it.
"""

import argparse
import pathlib
import struct

ASCII, SHORT, LONG, RATIONAL = 2, 3, 4, 5


def directory(entries, start):
    """An IFD whose values lie behind it; `start` is where it begins in the block."""
    head, tail = b'', b''
    values_at = start + 2 + 12 * len(entries) + 4
    for tag, kind, count, value in sorted(entries):
        if len(value) <= 4:
            held = value.ljust(4, b'\0')
        else:
            held = struct.pack('<I', values_at + len(tail))
            tail += value + b'\0' * (len(value) % 2)
        head += struct.pack('<HHI', tag, kind, count) + held
    return struct.pack('<H', len(entries)) + head + b'\0' * 4 + tail


def text(tag, value):
    data = value.encode('ascii') + b'\0'
    return tag, ASCII, len(data), data


def exif_block(make, model, focal_mm, focal_35mm):
    photo = [(0x920A, RATIONAL, 1, struct.pack('<II', round(focal_mm * 1000), 1000)),
             (0xA405, SHORT, 1, struct.pack('<H', round(focal_35mm)))]
    image = [text(0x010F, make), text(0x0110, model), (0x8769, LONG, 1, b'\0' * 4)]
    photo_at = 8 + len(directory(image, 8))
    image[2] = (0x8769, LONG, 1, struct.pack('<I', photo_at))
    return b'II*\0' + struct.pack('<I', 8) + directory(image, 8) + directory(photo, photo_at)


def with_exif(jpeg, block):
    if jpeg[:2] != b'\xFF\xD8':
        raise SystemExit('not a JPEG')
    at, kept = 2, b''
    while jpeg[at + 1] in (*range(0xE0, 0xF0), 0xFE):
        length = struct.unpack('>H', jpeg[at + 2:at + 4])[0]
        segment = jpeg[at:at + 2 + length]
        if segment[4:10] != b'Exif\0\0':
            kept += segment
        at += 2 + length
    payload = b'Exif\0\0' + block
    app1 = b'\xFF\xE1' + struct.pack('>H', len(payload) + 2) + payload
    return jpeg[:2] + app1 + kept + jpeg[at:]


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('photos', type=pathlib.Path)
    parser.add_argument('out', type=pathlib.Path)
    parser.add_argument('--make', default='Maker')
    parser.add_argument('--model', required=True)
    parser.add_argument('--focal-mm', type=float, required=True)
    parser.add_argument('--focal-35mm', type=float, required=True)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    block = exif_block(arguments.make, arguments.model, arguments.focal_mm, arguments.focal_35mm)
    for path in sorted(arguments.photos.iterdir()):
        if path.suffix.lower() in ('.jpg', '.jpeg'):
            (arguments.out / path.name).write_bytes(with_exif(path.read_bytes(), block))


if __name__ == '__main__':
    main()
