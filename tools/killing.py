# SPDX-License-Identifier: Apache-2.0
# What tools/kill_test.py, tools/kill_changes.py and tools/kill_unnamed.py share: how they are
# called, how they call veduta, and how they tell what did not hold.
# usage of each: PROGRAM VEDUTA FOLDER_OF_PHOTOS WORK_FOLDER KILLS SEED

import random
import subprocess
import sys

import camera_text

veduta, photos, work = sys.argv[1:4]
kills_wanted, seed = map(int, sys.argv[4:])
rng = random.Random(seed)
failures = []


def run(*arguments):
    done = subprocess.run([veduta, *arguments], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def must(*arguments):
    code, out, err = run(*arguments)
    if code != 0:
        sys.exit(f'kill_test.sh: {" ".join(arguments)} ended with {code}: {err or out}')
    return out


def fail(text):
    failures.append(text)
    print('FAILED: ' + text, flush=True)


def camera_of_photos():
    """Size and parameters, as `veduta camera add` takes them."""
    camera = camera_text.beside(photos)
    if camera is None:
        sys.exit(f'kill_test.sh: no camera.txt with size, fx, fy, cx and cy in {photos} or above')
    return camera
