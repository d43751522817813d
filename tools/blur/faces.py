#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# An example for `veduta serve DB --blur`: finds faces by OpenCV's cascades. It reads a JPEG from
# standard input and tells the areas that are to be filled (engine/photo/blur_command.h).
# Debian's packages python3-opencv and opencv-data have what it needs. These cascades are fast, and
# miss faces that are turned; who publishes photos of streets wants a better detector, and one of
# number plates, which answers in the same way.
import json
import sys

import cv2
import numpy

CASCADES = '/usr/share/opencv4/haarcascades/'
NAMES = ('haarcascade_frontalface_default.xml', 'haarcascade_profileface.xml')


def main():
    picture = cv2.imdecode(numpy.frombuffer(sys.stdin.buffer.read(), numpy.uint8),
                           cv2.IMREAD_GRAYSCALE)
    height, width = picture.shape
    areas = []
    for name in NAMES:
        cascade = cv2.CascadeClassifier(CASCADES + name)
        if cascade.empty():
            sys.exit(f'{CASCADES}{name} cannot be read: install the package opencv-data')
        for x, y, w, h in cascade.detectMultiScale(picture, 1.1, 4):
            # Hair and chin, too.
            areas.append([int(x - w // 5), int(y - h // 5), int(w + 2 * (w // 5)),
                          int(h + 2 * (h // 5))])
    print(json.dumps({'width': width, 'height': height, 'areas': areas}))


if __name__ == '__main__':
    main()
