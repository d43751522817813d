#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client of Veduta's daemon in one file, for Python 3.9 and later, without other packages.

    with veduta_rpc.connect('unix:city.veduta/rpc.sock') as city:
        photo = city.add('0001.jpg', data, camera='phone', contributor='anna')
        print(photo.number())            # once it is on the disk
        print(photo.verdict().outcome)   # once it was judged
        print(city.pose('0001.jpg').pose.center)
        for entry in city.changes():     # for ever; goes on after a lost connection
            print(entry.number, entry.action)

It speaks Cap'n Proto's RPC by itself, since Debian 12 has no package of it for Python: as much of
level 1 as the daemon's interface asks for (cli/rpc/veduta.capnp, which says what everything means).
Answers are objects with the fields of the schema's structs; a struct that is not there is None.
A failure of a call is a Failure. One thread at a time may use a connection.
"""
import collections
import contextlib
import os
import select
import socket
import struct
import time
import types

CHUNK_BYTES = 64 << 10     # pieces in which photos are sent
WINDOW_BYTES = 1 << 20     # of them that are on their way at the same time
CALLS_MAX = 200            # on their way at the same time
DEPTH_MAX = 64             # of answers within each other
WORDS_MAX = 1 << 23        # of one message
VERDICTS = ('rejected', 'postponed', 'placed', 'founded', 'merged', 'duplicate')

# Where Cap'n Proto puts the fields of messages:
#   NAME WORDS POINTERS [?place of the tag of its union] FIELD:TYPE@PLACE[?TAG][! true by default]
# The place of a number is counted in its own size; of a pointer in pointers. And of methods the
# numbers of their interface and their own. tests/cli/rpc_test.py compares this with the compiler.
LAYOUT = '''
Bootstrap 1 1 questionId:u32@0 deprecatedObjectId:any@0
Call 3 3 questionId:u32@0 target:MessageTarget@0 interfaceId:u64@1 methodId:u16@2 params:Payload@1
    allowThirdPartyTailCall:bool@128
Camera 10 0 widthPx:u32@0 heightPx:u32@1 fx:f64@1 fy:f64@2 cx:f64@3 cy:f64@4 k1:f64@5 k2:f64@6
    u0:f64@7 v0:f64@8 focalStddevShare:f64@9
CapDescriptor 1 1 ?0 none:void@0?0 senderHosted:u32@1?1 senderPromise:u32@1?2
    receiverHosted:u32@1?3 receiverAnswer:PromisedAnswer@0?4
    thirdPartyHosted:ThirdPartyCapDescriptor@0?5 attachedFd:u8@2
City.addPhoto 10284526029063047865 1
City.addPhoto() 1 3 name:text@0 camera:text@1 contributor:text@2 contribution:u32@0
City.addPhoto= 0 1 upload:cap@0
City.examine 10284526029063047865 5
City.examine() 0 1 name:text@0
City.examine= 0 1 examination:cap@0
City.findUpload 10284526029063047865 2
City.findUpload() 1 0 number:u64@0
City.findUpload= 0 1 ticket:cap@0
City.follow 10284526029063047865 9
City.follow() 1 1 from:u64@0 watcher:cap@0
City.follow= 0 0
City.journal 10284526029063047865 8
City.journal() 2 0 from:u64@0 count:u32@2
City.journal= 1 1 entries:[JournalEntry]@0 snapshot:u64@0
City.neighbors 10284526029063047865 4
City.neighbors() 0 1 photo:text@0
City.neighbors= 1 1 neighbors:[Neighbor]@0 snapshot:u64@0
City.points 10284526029063047865 7
City.points() 1 0 reconstruction:u32@0
City.points= 3 1 points:cap@0 count:u64@0 geometryVersion:u64@1 snapshot:u64@2
City.pose 10284526029063047865 3
City.pose() 0 1 photo:text@0
City.pose= 1 2 pose:Pose@0 onEarth:EarthPose@1 snapshot:u64@0
City.reconstructions 10284526029063047865 6
City.reconstructions() 0 0
City.reconstructions= 1 1 reconstructions:[Reconstruction]@0 snapshot:u64@0
City.status 10284526029063047865 0
City.status() 0 0
City.status= 0 1 status:Status@0
EarthPose 9 0 latitude:f64@0 longitude:f64@1 heightM:f64@2 headingDeg:f64@3 pitchDeg:f64@4
    rollDeg:f64@5 horizontalStddevM:f64@6 verticalStddevM:f64@7 headingStddevDeg:f64@8
Examination.candidates 12309695343511678577 1
Examination.candidates() 1 1 camera:text@0 count:u32@0
Examination.candidates= 1 1 candidates:[Neighbor]@0 snapshot:u64@0
Examination.localize 12309695343511678577 0
Examination.localize() 0 3 camera:text@0 near:text@1 place:text@2
Examination.localize= 1 1 localized:Localized@0 snapshot:u64@0
Exception 1 2 reason:text@0 obsoleteIsCallersFault:bool@0 obsoleteDurability:u16@1 type:u16@2
    trace:text@1
Finish 1 0 questionId:u32@0 releaseResultCaps:bool@32!
Gate.login 11152542621744991673 0
Gate.login() 0 1 token:text@0
Gate.login= 1 1 city:cap@0 version:u32@0
JournalEntry 3 3 number:u64@0 time:i64@1 actor:text@0 action:text@1 image:u32@4
    reconstruction:u32@5 detail:text@2
Localized 5 5 verdict:u16@0 reason:text@0 stored:u32@1 pose:Pose@1 onEarth:EarthPose@2
    centerStddev:f64@1 rotationStddevDeg:f64@2 camera:Camera@3 inliers:u32@6 neighbors:u32@7
    pairsTried:u32@8 support:[Support]@4
Message 1 1 ?0 unimplemented:Message@0?0 abort:Exception@0?1 call:Call@0?2 return:Return@0?3
    finish:Finish@0?4 resolve:Resolve@0?5 release:Release@0?6 obsoleteSave:any@0?7
    bootstrap:Bootstrap@0?8 obsoleteDelete:any@0?9 provide:Provide@0?10 accept:Accept@0?11
    join:Join@0?12 disembargo:Disembargo@0?13
MessageTarget 1 1 ?2 importedCap:u32@0?0 promisedAnswer:PromisedAnswer@0?1
Neighbor 3 1 id:u32@0 name:text@0 verdict:u16@2 matches:u32@2 score:f64@2
Outcome 3 3 name:text@0 id:u32@0 verdict:u16@2 reason:text@1 reconstruction:u32@2 camera:text@2
    neighbors:u32@3 inliers:u32@4 pairsTried:u32@5 replaced:bool@48
Payload 0 2 content:any@0 capTable:[CapDescriptor]@1
PhotoSink.write 11815648651148591353 0
PhotoSink.write() 0 1 chunk:data@0
PhotoSink.write= 0 0
PointReader.next 13185755686464044888 0
PointReader.next() 1 0 count:u32@0
PointReader.next= 0 1 points:data@0
Pose 1 3 reconstruction:u32@0 rotation:Quaternion@0 translation:Vector3@1 center:Vector3@2
PromisedAnswer 1 1 questionId:u32@0 transform:[PromisedAnswer.Op]@0
PromisedAnswer.Op 1 0 ?0 noop:void@0?0 getPointerField:u16@1?1
Quaternion 4 0 w:f64@0 x:f64@1 y:f64@2 z:f64@3
Reconstruction 5 0 id:u32@0 images:u32@1 points:u64@1 observations:u64@2
    reprojectionErrorPxMean:f64@3 geometryVersion:u64@4
Release 1 0 id:u32@0 referenceCount:u32@1
Resolve 1 1 ?2 promiseId:u32@0 cap:CapDescriptor@0?0 exception:Exception@0?1
Return 2 1 ?3 answerId:u32@0 releaseParamCaps:bool@32! results:Payload@0?0 exception:Exception@0?1
    canceled:void@0?2 resultsSentElsewhere:void@0?3 takeFromOtherQuestion:u32@2?4
    acceptFromThirdParty:any@0?5
Status 12 0 snapshot:u64@0 images:u64@1 placed:u64@2 postponed:u64@3 rejected:u64@4 unsure:u64@5
    cameras:u64@6 uploads:u64@7 backlog:u64@8 vocabularyGeneration:u32@18 openHypotheses:u64@10
    totalBytes:u64@11
Support 1 1 id:u32@0 name:text@0 points:u32@1
Ticket.verdict 12739459310213343992 0
Ticket.verdict() 0 0
Ticket.verdict= 1 1 outcome:Outcome@0 snapshot:u64@0
Upload.done 12131668395157228951 0
Upload.done() 0 0
Upload.done= 1 1 number:u64@0 ticket:cap@0
Vector3 3 0 x:f64@0 y:f64@1 z:f64@2
Watcher.entries 16346857032731934753 0
Watcher.entries() 2 1 entries:[JournalEntry]@0 next:u64@0 snapshot:u64@1
Watcher.entries= 0 0
'''
SIZES = {'bool': 1, 'u8': 8, 'u16': 16, 'u32': 32, 'u64': 64, 'i64': 64, 'f64': 64}
FORMATS = {'u8': '<B', 'u16': '<H', 'u32': '<I', 'u64': '<Q', 'i64': '<q', 'f64': '<d'}
Field = collections.namedtuple('Field', 'name type place tag default')
Struct = collections.namedtuple('Struct', 'words pointers tag fields')


class Failure(Exception):
    """A call failed. `code` is as of HTTP (0: none), `retry_s` when to come again (None: never)."""

    def __init__(self, text, code=None):
        super().__init__(text)
        first = text.split(' ', 1)[0]
        self.code = code if code is not None else int(first) if first.isdigit() else 0
        self.retry_s = None
        if self.code in (429, 503) and text.endswith(' s'):
            self.retry_s = int(text.rsplit(' ', 2)[1])


class Disconnected(Failure):
    """The connection is lost. What was asked may have been done."""

    def __init__(self, text):
        super().__init__(text, 0)


def read_layout(text):
    structs, methods = {}, {}
    for line in text.replace('\n    ', ' ').split('\n'):
        name, *parts = line.split() or [None]
        if name and '.' in name and name[-1] not in ')=' and len(parts) == 2 and int(parts[0]) > 99:
            methods[name] = (int(parts[0]), int(parts[1]))
        elif name:
            words, pointers, *rest = parts
            tag = int(rest.pop(0)[1:]) if rest and rest[0][0] == '?' else None
            structs[name] = Struct(int(words), int(pointers), tag, [read_field(r) for r in rest])
    return structs, methods


def read_field(text):
    name, rest = text.split(':', 1)
    default = rest.endswith('!')
    kind, rest = rest.rstrip('!').split('@')
    place, _, tag = rest.partition('?')
    return Field(name, kind, int(place), int(tag) if tag else None, default)


STRUCTS, METHODS = read_layout(LAYOUT)


def write_struct(out, at, name, values):
    """Writes a struct behind `out`, and the pointer to it at the byte `at`. In a union the member
    that is named is written."""
    layout, start = STRUCTS[name], len(out)
    out += bytes(8 * (layout.words + layout.pointers))
    write_pointer(out, at, start, layout.words | layout.pointers << 16)
    fill_struct(out, start, layout, values)


def write_pointer(out, at, start, high, kind=0):
    struct.pack_into('<iI', out, at, (start - at - 8) // 8 << 2 | kind, high)


def fill_struct(out, start, layout, values):
    for field in layout.fields:
        value = values.get(field.name)
        if field.name in values and field.tag is not None:
            struct.pack_into('<H', out, start + 2 * layout.tag, field.tag)
        if value is None or field.type == 'void':
            continue
        if field.type == 'bool':
            out[start + field.place // 8] |= (value != field.default) << field.place % 8
        elif field.type in FORMATS:
            struct.pack_into(FORMATS[field.type], out,
                             start + SIZES[field.type] // 8 * field.place, value)
        else:
            write_pointed(out, start + 8 * (layout.words + field.place), field.type, value)


def write_pointed(out, at, kind, value):
    if kind == 'cap':
        struct.pack_into('<II', out, at, 3, value)
    elif kind in ('text', 'data'):
        data = value.encode() + b'\0' if kind == 'text' else bytes(value)
        write_pointer(out, at, len(out), 2 | len(data) << 3, 1)
        out += data + bytes(-len(data) % 8)
    elif kind == 'any':  # a struct, with its name
        write_struct(out, at, *value)
    elif kind[0] == '[':
        layout = STRUCTS[kind[1:-1]]
        words, start = layout.words + layout.pointers, len(out)
        write_pointer(out, at, start, 7 | words * len(value) << 3, 1)
        out += struct.pack('<II', len(value) << 2, layout.words | layout.pointers << 16)
        out += bytes(8 * words * len(value))
        for i, item in enumerate(value):
            fill_struct(out, start + 8 + 8 * words * i, layout, item)
    else:
        write_struct(out, at, kind, value)


class Message:
    """A message that has come, and its parts."""

    def __init__(self, segments):
        self.segments = segments

    def pointer(self, segment, at):
        """What a pointer leads to: segment, byte and the pointer's own word; None: nothing."""
        word, = struct.unpack_from('<Q', self.segments[segment], at)
        if word == 0:
            return None
        if word & 3 != 2:
            offset = (word & 0xffffffff) >> 2
            return segment, at + 8 + 8 * (offset - (offset >> 29 << 30)), word
        segment, at = word >> 32, (word & 0xfffffff8)
        far, = struct.unpack_from('<Q', self.segments[segment], at)
        if not word & 4:
            return self.pointer(segment, at)
        # Two words: where the thing begins, and its own pointer without an offset.
        tag, = struct.unpack_from('<Q', self.segments[segment], at + 8)
        return far >> 32, far & 0xfffffff8, tag

    def struct_at(self, name, segment, at, depth=0):
        """The struct that a pointer leads to, None where there is none."""
        found = self.pointer(segment, at)
        if found is None:
            return None
        segment, start, word = found
        return self.struct(name, segment, start, word >> 32 & 0xffff, word >> 48, depth)

    def struct(self, name, segment, start, words, pointers, depth):
        if depth > DEPTH_MAX:
            raise Disconnected('an answer nests too deep')
        layout, value, data = STRUCTS[name], types.SimpleNamespace(), self.segments[segment]
        tag = None
        if layout.tag is not None:
            tag, = struct.unpack_from('<H', data, start + 2 * layout.tag)
        for field in layout.fields:
            if field.tag is not None and field.tag != tag:
                continue
            if field.tag is not None:
                value.which = field.name
            setattr(value, field.name, self.field(field, segment, start, words, pointers, depth))
        return value

    def field(self, field, segment, start, words, pointers, depth):
        kind, data = field.type, self.segments[segment]
        if kind in SIZES:
            # Fields that the sender knows nothing of are not there.
            if SIZES[kind] * (field.place + 1) > 64 * words:
                return field.default if kind == 'bool' else 0
            if kind == 'bool':
                bit = data[start + field.place // 8] >> field.place % 8 & 1
                return bool(bit) != field.default
            value, = struct.unpack_from(FORMATS[kind], data,
                                        start + SIZES[kind] // 8 * field.place)
            return VERDICTS[value] if field.name == 'verdict' and value < len(VERDICTS) else value
        if kind == 'void' or field.place >= pointers:
            return {'text': '', 'data': b''}.get(kind, [] if kind[0] == '[' else None)
        at = start + 8 * (words + field.place)
        if kind == 'any':
            return segment, at
        if kind == 'cap':
            found = self.pointer(segment, at)
            return None if found is None else found[2] >> 32
        if kind in ('text', 'data'):
            return self.bytes_at(segment, at, kind)
        if kind[0] == '[':
            return self.list_at(kind[1:-1], segment, at, depth + 1)
        return self.struct_at(kind, segment, at, depth + 1) if kind in STRUCTS else None

    def bytes_at(self, segment, at, kind):
        found = self.pointer(segment, at)
        if found is None:
            return '' if kind == 'text' else b''
        segment, start, word = found
        data = self.segments[segment][start:start + (word >> 35)]
        return bytes(data[:-1]).decode(errors='replace') if kind == 'text' else bytes(data)

    def list_at(self, name, segment, at, depth):
        found = self.pointer(segment, at)
        if found is None:
            return []
        segment, start, _ = found
        tag, = struct.unpack_from('<Q', self.segments[segment], start)
        words, pointers = tag >> 32 & 0xffff, tag >> 48
        count = (tag & 0xffffffff) >> 2
        if 8 * (words + pointers) * count > len(self.segments[segment]):
            raise Disconnected('an answer has a list that is longer than itself')
        step = 8 * (words + pointers)
        return [self.struct(name, segment, start + 8 + step * i, words, pointers, depth)
                for i in range(count)]


class Answer:
    """The answer to a call, perhaps still on its way."""

    def __init__(self, connection, number, results):
        self.connection, self.number, self.results = connection, number, results
        self.value = self.failure = None
        self.is_done = False
        self.keeps = True  # the capabilities that come with it

    def wait(self, timeout_s=600):
        """The results. Raises Failure, and TimeoutError."""
        self.connection.pump(lambda: self.is_done, timeout_s)
        if self.failure:
            raise self.failure
        return self.value

    def capability(self, name):
        """One of the results, to be called before they are there."""
        return Capability(self.connection, answer=self, name=name)

    def cancel(self):
        if not self.is_done:
            self.is_done, self.failure = True, Failure('the call was cancelled', 0)
            self.connection.finish(self.number, True)


class Capability:
    """What the daemon has and that can be called: one that it has told of, or one of an answer."""

    def __init__(self, connection, number=None, answer=None, name=None):
        self.connection, self.number, self.answer, self.name = connection, number, answer, name

    def target(self):
        if self.number is not None:
            return {'importedCap': self.number}
        if self.answer.is_done:
            if self.answer.failure:
                raise self.answer.failure
            return getattr(self.answer.value, self.name).target()
        field, = [f for f in STRUCTS[self.answer.results].fields if f.name == self.name]
        return {'promisedAnswer': {'questionId': self.answer.number,
                                   'transform': [{'getPointerField': field.place}]}}

    def call(self, method, exports=(), **values):
        return self.connection.call(self, method, exports, values)

    def __del__(self):
        if self.number is not None:
            self.connection.dropped.append(self.number)


class Connection:
    """The messages of one connection."""

    def __init__(self, address):
        if address.startswith('unix:'):
            self.socket = socket.socket(socket.AF_UNIX)
            try:
                self.socket.connect(address[len('unix:'):])
            except OSError:
                self.socket.close()
                raise
        else:
            host, port = address.rsplit(':', 1)
            self.socket = socket.create_connection((host.strip('[]'), int(port)))
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.setblocking(False)
        self.unread = bytearray()
        self.questions = {}            # by number
        self.next_number = 0
        self.exports = {}              # what the daemon calls: functions, by number
        self.dropped = []              # capabilities that are to be released
        self.lost = None               # why

    def close(self):
        self.socket.close()
        self.fail(Disconnected('the connection is closed'))

    def fail(self, why):
        self.lost = self.lost or why
        for answer in self.questions.values():
            answer.is_done, answer.failure = True, answer.failure or self.lost
        self.questions.clear()

    def bootstrap(self):
        return self.ask({'bootstrap': {'questionId': self.next_number}}, 'Payload')

    def call(self, callee, method, exports, values):
        interface, number = METHODS[method]
        payload = {'content': (method + '()', values),
                   'capTable': [{'senderHosted': export} for export in exports]}
        self.pump(lambda: len(self.questions) < CALLS_MAX)
        return self.ask({'call': {'questionId': self.next_number, 'target': callee.target(),
                                  'interfaceId': interface, 'methodId': number,
                                  'params': payload}}, method + '=')

    def ask(self, message, results):
        answer = Answer(self, self.next_number, results)
        self.next_number = (self.next_number + 1) % (1 << 32)
        self.questions[answer.number] = answer
        self.send(message)
        return answer

    def finish(self, number, release):
        self.send({'finish': {'questionId': number, 'releaseResultCaps': release}})

    def send(self, message):
        if self.lost:
            raise self.lost
        while self.dropped:
            released = {'id': self.dropped.pop(), 'referenceCount': 1}
            self.write(frame({'release': released}))
        self.write(frame(message))

    def write(self, data):
        """Reads meanwhile, so that neither side waits for the other to read. Whether the daemon has
        gone is found by reading: what it has told before comes first."""
        data = memoryview(data)
        with contextlib.suppress(OSError):
            while data:
                try:
                    data = data[self.socket.send(data):]
                except BlockingIOError:
                    readable, _, _ = select.select([self.socket], [self.socket], [])
                    if readable:
                        self.read_some()

    def read_some(self):
        data = self.socket.recv(1 << 18)
        if not data:
            raise ConnectionResetError('it has closed the connection')
        self.unread += data

    def pump(self, is_done, timeout_s=600):
        """Takes messages until it is done."""
        deadline = time.monotonic() + timeout_s
        try:
            while not is_done():
                message = unframe(self.unread)
                if message:
                    self.take(message)
                    continue
                if self.lost:
                    raise self.lost
                left = deadline - time.monotonic()
                if left <= 0 or not select.select([self.socket], [], [], left)[0]:
                    raise TimeoutError('the daemon does not answer in time')
                self.read_some()
        except (BlockingIOError, InterruptedError):
            self.pump(is_done, timeout_s)
        except TimeoutError:
            raise
        except (OSError, ValueError, IndexError, struct.error) as error:
            self.fail(Disconnected(f'the daemon has gone: {error}'))
            raise self.lost from error

    def take(self, message):
        root = message.struct_at('Message', 0, 0)
        if root.which == 'return':
            self.take_return(message, getattr(root, 'return'))
        elif root.which == 'call':
            call = root.call
            export = self.exports.get(getattr(call.target, 'importedCap', None))
            if export:
                entries = message.struct_at('Watcher.entries()', *call.params.content)
                export(call.questionId, entries)
        elif root.which == 'abort':
            self.fail(Disconnected(root.abort.reason))
        elif root.which not in ('finish', 'release', 'resolve', 'unimplemented'):
            raise ValueError(f'a message came that is not known: {root.which}')

    def take_return(self, message, told):
        answer = self.questions.pop(told.answerId, None)
        if answer is None or answer.is_done:  # it was cancelled, and finished with
            return
        if told.which == 'results':
            held = [Capability(self, cap.senderHosted if cap.which == 'senderHosted'
                               else cap.senderPromise)
                    if cap.which in ('senderHosted', 'senderPromise') else None
                    for cap in told.results.capTable]
            if answer.results == 'Payload':  # of the bootstrap: the capability itself
                answer.value = held[0]
            else:
                answer.value = message.struct_at(answer.results, *told.results.content)
                for field in STRUCTS[answer.results].fields:
                    if field.type == 'cap':
                        index = getattr(answer.value, field.name)
                        setattr(answer.value, field.name,
                                held[index] if answer.keeps and index is not None else None)
        else:
            answer.failure = Failure(told.exception.reason.removeprefix('remote exception: ')
                                     if told.which == 'exception' else 'the call was cancelled')
        answer.is_done = True
        self.finish(answer.number, False)

    def reply(self, question):
        self.send({'return': {'answerId': question, 'releaseParamCaps': False,
                              'results': {'content': ('Watcher.entries=', {})}}})


def frame(message):
    out = bytearray(8)
    write_struct(out, 0, 'Message', message)
    return struct.pack('<II', 0, len(out) // 8) + out


def unframe(unread):
    """Takes the first message out of the bytes; None while it is not complete."""
    if len(unread) < 8:
        return None
    count = struct.unpack_from('<I', unread)[0] + 1
    head = 8 * (count // 2 + 1)
    if count > 512:
        raise ValueError('a message has too many segments')
    if len(unread) < head:
        return None
    sizes = struct.unpack_from(f'<{count}I', unread, 4)
    if sum(sizes) > WORDS_MAX:
        raise ValueError('a message is too long')
    end = head + 8 * sum(sizes)
    if len(unread) < end:
        return None
    segments, at = [], head
    for size in sizes:
        segments.append(bytes(unread[at:at + 8 * size]))
        at += 8 * size
    del unread[:end]
    return Message(segments)


class Photo:
    """A photo that was sent."""

    def __init__(self, done, ticket):
        self.done, self.answer = done, ticket.call('Ticket.verdict')
        done.keeps = False

    def number(self, timeout_s=600):
        """Waits until the photo is on the disk; the number of the upload."""
        return self.done.wait(timeout_s).number

    def verdict(self, timeout_s=600):
        """Waits until the photo was judged: `outcome` and `snapshot`."""
        return self.answer.wait(timeout_s)


class Examination:
    """A photo that is asked about and not stored."""

    def __init__(self, sink):
        self.sink = sink

    def localize(self, camera='', near='', place=''):
        return self.sink.call('Examination.localize', camera=camera, near=near, place=place).wait()

    def candidates(self, camera='', count=0):
        return self.sink.call('Examination.candidates', camera=camera, count=count).wait()


class City:
    def __init__(self, address, token=''):
        self.address, self.token = address, token
        self.open()

    def open(self):
        self.connection = Connection(self.address)
        try:
            gate = self.connection.bootstrap().wait()
            told = gate.call('Gate.login', token=self.token).wait()
        except Exception:
            self.close()
            raise
        self.city, self.version = told.city, told.version

    def close(self):
        self.connection.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def call(self, method, **values):
        return self.city.call('City.' + method, **values)

    def status(self):
        return self.call('status').wait().status

    def pose(self, photo):
        return self.call('pose', photo=photo).wait()

    def neighbors(self, photo):
        return self.call('neighbors', photo=photo).wait()

    def reconstructions(self):
        return self.call('reconstructions').wait()

    def journal(self, first=1, count=0):
        return self.call('journal', **{'from': first, 'count': count}).wait()

    def points(self, reconstruction, count=0):
        """Chunks of points, as PointReader.next has them, of at most `count` points."""
        told = self.call('points', reconstruction=reconstruction).wait()
        ahead = [told.points.call('PointReader.next', count=count) for _ in range(4)]
        while chunk := ahead.pop(0).wait().points:
            ahead.append(told.points.call('PointReader.next', count=count))
            yield chunk

    def send(self, sink, data):
        """Sends the photo's bytes, without waiting for all of them to arrive."""
        on_way, data = [], memoryview(data)
        for start in range(0, len(data), CHUNK_BYTES):
            while len(on_way) * CHUNK_BYTES >= WINDOW_BYTES:
                first = on_way.pop(0)
                self.connection.pump(lambda: first.is_done)
            chunk = data[start:start + CHUNK_BYTES]
            on_way.append(sink.call('PhotoSink.write', chunk=chunk))

    def add(self, name, data, camera='', contributor='', contribution=0):
        """Sends a photo, as a part of an open contribution if one is named by its number. Waits
        for nothing but the room for its bytes."""
        upload = self.call('addPhoto', name=name, camera=camera, contributor=contributor,
                           contribution=contribution).capability('upload')
        self.send(upload, data)
        done = upload.call('Upload.done')
        return Photo(done, done.capability('ticket'))

    def verdict(self, number, timeout_s=600):
        """What becomes of the upload of this number, as Photo.verdict."""
        ticket = self.call('findUpload', number=number).capability('ticket')
        return ticket.call('Ticket.verdict').wait(timeout_s)

    def examine(self, data, name=''):
        sink = self.call('examine', name=name).capability('examination')
        self.send(sink, data)
        return Examination(sink)

    def changes(self, first=1, retry_s=1.0, timeout_s=None):
        """The entries of the journal from that number on, and then each new one. After a lost
        connection, or while the daemon is busy, it tries again, and no entry is left out or comes
        twice. Ends, unless `timeout_s` is None, when nothing has come for so long."""
        heard = time.monotonic()
        while True:
            try:
                for entry in self.follow(first, timeout_s):
                    first, heard = entry.number + 1, time.monotonic()
                    yield entry
                return
            except (Disconnected, ConnectionError, FileNotFoundError):
                pass
            except Failure as failure:
                if failure.retry_s is None:
                    raise
            if timeout_s is not None and time.monotonic() - heard > timeout_s:
                return
            time.sleep(retry_s)
            try:
                self.close()
                self.open()
            except (OSError, Disconnected):
                pass

    def follow(self, first, timeout_s):
        connection, told = self.connection, []
        export = len(connection.exports)
        connection.exports[export] = lambda question, page: told.append((question, page))
        call = self.city.call('City.follow', exports=[export], **{'from': first, 'watcher': 0})
        try:
            while True:
                try:
                    connection.pump(lambda: told or call.is_done,
                                    1e9 if timeout_s is None else timeout_s)
                except TimeoutError:
                    return
                if not told:
                    call.wait()
                question, page = told.pop(0)
                yield from page.entries
                connection.reply(question)
        finally:
            if not connection.lost:
                call.cancel()


def connect(address, token=''):
    """`address`: 'unix:PATH' or 'HOST:PORT'. An empty token: of the owner, or where there are
    none."""
    return City(address, token)


if __name__ == '__main__':
    import sys
    with connect(sys.argv[1], os.environ.get('VEDUTA_TOKEN', '')) as opened:
        print(vars(opened.status()))
