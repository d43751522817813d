#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Reads camera.txt, which lies beside photos or one folder above them: the size first, then
# `fx V fy V cx V cy V`, and where the lens distorts `k1 V k2 V [u0 V v0 V]`. Prints "WxH PARAMS" as
# `veduta camera add` takes them, or nothing where there is no such file.
# usage: tools/camera_text.py FOLDER_OF_PHOTOS
import os
import re
import sys

NUMBER = r'-?[0-9.]+(?:[eE][-+]?[0-9]+)?'


def parse(text):
    """(size, params); None where one is missing."""
    size = re.search(r'\b(\d+)\s*[x\s]\s*(\d+)\b', text)
    got = dict(re.findall(rf'\b(fx|fy|cx|cy|k1|k2|u0|v0)\b\s*[=:]?\s*({NUMBER})', text))
    names = ['fx', 'fy', 'cx', 'cy']
    names += ['k1', 'k2'] if 'k1' in got else []
    names += ['u0', 'v0'] if 'u0' in got else []
    if not size or not all(name in got for name in names):
        return None
    return f'{size[1]}x{size[2]}', ','.join(got[name] for name in names)


def beside(photos):
    """(size, params) from the camera.txt of a folder of photos; None without a good one."""
    for folder in (photos, os.path.join(photos, '..')):
        path = os.path.join(folder, 'camera.txt')
        if os.path.isfile(path):
            with open(path, encoding='utf-8') as file:
                camera = parse(file.read())
            if camera:
                return camera
    return None


if __name__ == '__main__':
    found = beside(sys.argv[1])
    if found:
        print(*found)
