# SPDX-License-Identifier: Apache-2.0
# Writes into a photo of the tests when it was taken.
import struct

EXIF_IFD, ORIGINAL, OFFSET = 0x8769, 0x9003, 0x9011


def with_time(jpeg, time, offset=None):
    """The photo with EXIF's DateTimeOriginal ('2023:11:14 22:13:20'), and OffsetTimeOriginal
    ('+01:00') if it is given. What its EXIF says already, little-endian, stays."""
    tiff, rest = b'II*\0' + struct.pack('<IHI', 8, 0, 0), jpeg[2:]
    at = 2
    while jpeg[at:at + 2] != b'\xff\xda':
        size = struct.unpack_from('>H', jpeg, at + 2)[0]
        if jpeg[at + 1] == 0xe1 and jpeg[at + 4:at + 10] == b'Exif\0\0':
            tiff = jpeg[at + 10:at + 2 + size]
            rest = jpeg[2:at] + jpeg[at + 2 + size:]
            break
        at += 2 + size
    assert tiff[:4] == b'II*\0', 'it is little-endian'
    first = struct.unpack_from('<I', tiff, 4)[0]
    count = struct.unpack_from('<H', tiff, first)[0]
    entries = [tiff[first + 2 + 12 * i:first + 14 + 12 * i] for i in range(count)]
    tiff += b'\0' * (len(tiff) % 2)
    texts = [(ORIGINAL, time.encode() + b'\0')]
    if offset:
        texts.append((OFFSET, offset.encode() + b'\0'))
    exif_at = len(tiff)
    data_at = exif_at + 2 + 12 * len(texts) + 4
    table, data = struct.pack('<H', len(texts)), b''
    for tag, text in texts:
        table += struct.pack('<HHII', tag, 2, len(text), data_at + len(data))
        data += text + b'\0' * (len(text) % 2)
    tiff += table + struct.pack('<I', 0) + data
    entries = sorted([*entries, struct.pack('<HHII', EXIF_IFD, 4, 1, exif_at)],
                     key=lambda entry: struct.unpack_from('<H', entry)[0])
    new_first = len(tiff)
    tiff += struct.pack('<H', len(entries)) + b''.join(entries) + struct.pack('<I', 0)
    tiff = tiff[:4] + struct.pack('<I', new_first) + tiff[8:]
    block = b'Exif\0\0' + tiff
    return b'\xff\xd8\xff\xe1' + struct.pack('>H', len(block) + 2) + block + rest
