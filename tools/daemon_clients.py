# SPDX-License-Identifier: Apache-2.0
# The clients of tools/kill_daemon.py: they send photos to a daemon that is killed again and again,
# read and follow, and note whatever breaks a promise that docs/serving.md makes.
import base64
import collections
import contextlib
import hashlib
import http.client
import json
import os
import random
import sys
import threading
import time
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'cli', 'rpc'))
import veduta_rpc  # noqa: E402

TUS = {'Tus-Resumable': '1.0.0'}
ANSWER_S = 300  # a daemon that lives answers sooner, also on a busy machine
WAIT_S = 900    # for the last photo to be judged, too
SENDERS = ('waits', 'waits', 'waits', 'leaves', 'leaves', 'parts', 'parts', 'parts')


class Door:
    """Where the daemon listens that lives now, and what its clients have found to be wrong."""

    def __init__(self):
        self.host, self.is_killed = None, True
        self.opened = threading.Condition()
        self.is_quiet = False            # who sends waits, so that the dense pass begins
        self.ends = threading.Event()    # who reads and follows is to stop
        self.faults, self.counts = [], collections.Counter()

    def open(self, host):
        with self.opened:
            self.host, self.is_killed = host, False
            self.opened.notify_all()

    def close(self):
        """Before the daemon is killed: what breaks from now on is no fault."""
        with self.opened:
            self.is_killed = True

    def be_quiet(self, is_quiet):
        with self.opened:
            self.is_quiet = is_quiet
            self.opened.notify_all()

    def address(self):
        """Waits for a daemon; None where none is to come any more."""
        with self.opened:
            while self.is_killed and not self.ends.is_set():
                self.opened.wait(0.1)
            return None if self.is_killed else self.host

    def rest(self, seconds):
        time.sleep(seconds)
        with self.opened:
            while self.is_quiet:
                self.opened.wait(0.1)

    def fault(self, text):
        print('FAILED: ' + text, flush=True)
        self.faults.append(text)

    def broke(self, host, what, error):
        """A connection broke; that is a fault where nobody has killed the daemon."""
        with self.opened:
            if not self.is_killed and self.host == host:
                self.fault(f'{what} broke, and the daemon was not killed: {error!r}')
        self.counts['broken by a kill'] += 1

    def ask(self, method, path, body=None, headers={}):
        """Code, headers and body. The code is None where no answer came, since the daemon was
        killed; then what was asked for may have been done."""
        host = self.address()
        if host is None:
            return None, {}, b''
        try:
            with contextlib.closing(http.client.HTTPConnection(host, timeout=ANSWER_S)) as line:
                line.request(method, path, body, headers)
                answer = line.getresponse()
                told = answer.status, answer.headers, answer.read()
        except (OSError, http.client.HTTPException) as error:
            self.broke(host, f'{method} {path}', error)
            return None, {}, b''
        return told

    def ask_until_answered(self, method, path, body=None, headers={}):
        """As a patient client does: comes again where no answer came, or where it is told to. Code,
        headers, body, and whether it may have been done before."""
        was_asked = False
        while not self.ends.is_set():
            code, answered, told = self.ask(method, path, body, headers)
            if code not in (None, 429, 503):
                return code, answered, told, was_asked
            was_asked = was_asked or code is None
            time.sleep(0.05)
        return None, {}, b'', was_asked

    def get(self, path):
        code, _, body, _ = self.ask_until_answered('GET', path)
        if code is None:
            return None
        if code != 200:
            self.fault(f'GET {path} is answered by {code}: {body[:200]}')
            return None
        return json.loads(body)


class Promises:
    """What was sent, and what was answered to that."""

    def __init__(self, door):
        self.door, self.lock = door, threading.Lock()
        self.sent = set()       # SHA-256
        self.accepted = {}      # code of the answer, by SHA-256
        self.in_parts = []      # what came whole by tus: path, number in line, contributor, name
        self.contributions = {}  # of those who send in parts: number, by contributor

    def send(self, contributor, name, data, waits):
        digest = hashlib.sha256(data).hexdigest()
        with self.lock:
            was_sent = digest in self.sent
            self.sent.add(digest)
        query = urllib.parse.urlencode({'name': name, 'camera': 'c', 'contributor': contributor})
        headers = {'Content-Type': 'image/jpeg'}
        if not waits:
            headers['Prefer'] = 'respond-async'
        code, _, body, was_asked = self.door.ask_until_answered('POST', '/v1/photos?' + query, data,
                                                                headers)
        self.door.counts[f'photo {code}'] += 1
        if code not in (201, 202, 409) or code == 409 and not (was_sent or was_asked):
            self.door.fault(f'{contributor}/{name} is answered by {code}: {body[:200]}')
        else:
            with self.lock:
                self.accepted.setdefault(digest, code)

    def send_in_parts(self, contributor, name, data, rng):
        digest = hashlib.sha256(data).hexdigest()
        with self.lock:
            self.sent.add(digest)
        pairs = {'filename': name, 'camera': 'c', 'contributor': contributor,
                 'contribution': str(self.contributions[contributor])}
        metadata = ','.join(f'{key} {base64.b64encode(value.encode()).decode()}'
                            for key, value in pairs.items())
        code, headers, body, _ = self.door.ask_until_answered('POST', '/v1/tus', b'', {
            **TUS, 'Upload-Length': str(len(data)), 'Upload-Metadata': metadata})
        if code != 201:
            return self.door.fault(f'tus: {name} is answered by {code}: {body[:200]}')
        if self.send_parts(headers['Location'], name, data, rng):
            told = self.door.get(headers['Location'])
            if told['upload'] is None or told['offset'] != len(data):
                self.door.fault(f'tus: {name} has come whole and is {told}')
            with self.lock:
                self.accepted[digest] = 'parts'
                self.in_parts.append((headers['Location'], told['upload'], contributor, name))

    def send_parts(self, path, name, data, rng):
        """Sends from where the daemon says that it is. No offset that was told may be more than one
        that is told later."""
        told = sent = 0
        while True:
            code, headers, _, _ = self.door.ask_until_answered('HEAD', path, headers=TUS)
            offset = int(headers['Upload-Offset']) if code == 200 else -1
            if not told <= offset <= sent:
                self.door.fault(f'tus: {name} was at {told}, {sent} bytes were sent, and HEAD is '
                                f'answered by {code}, {offset}')
                return False
            if offset == len(data):
                return True
            part = data[offset:offset + rng.randrange(1_000, 15_000)]
            told, sent = offset, max(sent, offset + len(part))
            code, headers, body = self.door.ask('PATCH', path, part, {
                **TUS, 'Content-Type': 'application/offset+octet-stream',
                'Upload-Offset': str(offset)})
            self.door.counts[f'part {code}'] += 1
            if code == 204:
                told = int(headers['Upload-Offset'])
            if code not in (None, 204, 429, 503) or code == 204 and told != offset + len(part):
                self.door.fault(f'tus: a part of {name} is answered by {code}, {told}: {body}')
                return False
            self.door.rest(rng.uniform(0, 0.5))

    def open_contribution(self, contributor):
        code, _, body, _ = self.door.ask_until_answered(
            'POST', '/v1/contributions', json.dumps({'contributor': contributor}),
            {'Content-Type': 'application/json'})
        if code != 201:
            self.door.fault(f'a contribution is answered by {code}: {body}')
        self.contributions[contributor] = json.loads(body)['contribution']

    def read(self, rng):
        """Asks after a photo that was accepted, for its pose and for its neighbours."""
        with self.lock:
            accepted = list(self.accepted.items())
        if not accepted:
            return
        digest, code = rng.choice(accepted)
        if code not in (201, 409):  # it may wait; what waits no more is stored
            waiting = self.door.get('/v1/uploads')
            if waiting is None or any(one['photo'] == digest for one in waiting):
                return
        photo = self.door.get('/v1/photos/' + digest)
        if photo is None:
            return self.door.fault(f'{digest} was answered by {code} and is not there')
        path = f'/v1/photos/{photo["contributor"]}%2F{urllib.parse.quote(photo["image"])}'
        for what, codes in (('pose', (200, 404)), ('neighbors', (200,))):
            code, _, body, _ = self.door.ask_until_answered('GET', f'{path}/{what}')
            self.door.counts[f'{what} {code}'] += 1
            if code not in (None, *codes):
                self.door.fault(f'{path}/{what} is answered by {code}: {body[:200]}')


class Follower:
    """Hears the journal; each entry has to come once, in its order, whatever is killed."""

    def __init__(self, door, what):
        self.door, self.what, self.heard = door, what, []

    def hear(self, number, entry):
        if number != len(self.heard) + 1:
            self.door.fault(f'{self.what}: entry {number} came after {len(self.heard)}')
        self.heard.append(entry)

    def follow_events(self):
        """Over HTTP, as server-sent events."""
        while not self.door.ends.is_set():
            host = self.door.address()
            if host is None:
                return
            headers = {'Last-Event-ID': str(len(self.heard))} if self.heard else {}
            with contextlib.suppress(OSError, http.client.HTTPException), contextlib.closing(
                    http.client.HTTPConnection(host, timeout=2)) as line:
                line.request('GET', '/v1/events?from=1', headers=headers)
                answer = line.getresponse()
                if answer.status != 200 and answer.status != 503:
                    self.door.fault(f'events are answered by {answer.status}')
                self.read_events(answer)
            self.door.counts['events followed anew'] += 1
            time.sleep(0.05)

    def read_events(self, answer):
        event = {}
        while text := answer.readline():
            key, _, value = text.decode().rstrip('\n').partition(': ')
            if key and value:
                event[key] = value
            elif 'id' in event:  # an empty line: it has come whole
                entry = json.loads(event['data'])
                self.hear(int(event['id']), (entry['sequence'], entry['action'], entry['detail']))
                event = {}

    def follow_calls(self, address):
        """By RPC, with the client that a daemon's users have."""
        while not self.door.ends.is_set():
            with contextlib.suppress(OSError, veduta_rpc.Failure):
                with veduta_rpc.connect(address) as city:
                    for entry in city.changes(len(self.heard) + 1, retry_s=0.05, timeout_s=3):
                        self.hear(entry.number, (entry.number, entry.action, entry.detail))
            time.sleep(0.05)


class Load:
    """All clients of one database, each a thread."""

    def __init__(self, door, address, photos, seed):
        """`address`: at which the daemons answer by RPC. `photos`: bytes by name."""
        self.door, self.photos, self.seed = door, photos, seed
        self.promises = Promises(door)
        self.events = Follower(self.door, 'events')
        self.calls = Follower(self.door, 'RPC')
        names = list(photos)
        random.Random(seed).shuffle(names)
        shares = {i: names[i::len(SENDERS)] for i in range(len(SENDERS))}
        # Every other photo of those who send whole ones is sent by another one of them as well.
        whole = [i for i, kind in enumerate(SENDERS) if kind != 'parts']
        for i in whole:
            shares[whole[(i + 1) % len(whole)]] += names[i::2 * len(SENDERS)]
        self.senders = [threading.Thread(target=self.send, args=(i, share))
                        for i, share in shares.items()]
        self.others = [threading.Thread(target=self.read, args=(i,)) for i in range(2)]
        self.others += [
            threading.Thread(target=self.events.follow_events),
            threading.Thread(target=self.calls.follow_calls, args=(address,))]

    def start(self):
        for thread in self.senders + self.others:
            thread.start()

    def is_sending(self):
        return any(thread.is_alive() for thread in self.senders) and not self.door.faults

    def send(self, number, names):
        rng, who, kind = random.Random(f'{self.seed} {number}'), f'who{number}', SENDERS[number]
        if kind == 'parts':
            self.promises.open_contribution(who)
        for name in names:
            if self.door.faults:
                return
            self.door.rest(rng.uniform(0, 4))
            if kind == 'parts':
                self.promises.send_in_parts(who, name, self.photos[name], rng)
            else:
                self.promises.send(who, name, self.photos[name], kind == 'waits')

    def read(self, number):
        rng = random.Random(f'{self.seed} reader {number}')
        while not self.door.ends.is_set() and not self.door.faults:
            self.promises.read(rng)
            time.sleep(rng.uniform(0, 0.5))

    def wait_for_the_last(self):
        """Until all are judged, and who follows has heard of it."""
        deadline = time.monotonic() + WAIT_S
        for thread in self.senders:
            thread.join(max(0, deadline - time.monotonic()))
        while time.monotonic() < deadline and not self.door.faults:
            heard = min(len(self.events.heard), len(self.calls.heard))
            if self.door.get('/v1/uploads') == [] == self.door.get(f'/v1/journal?from={heard + 1}'):
                return
            time.sleep(0.3)
        if not self.door.faults:
            self.door.fault('not all is judged and told after some minutes')

    def check_answers(self):
        """What the last daemon says of what was sent."""
        ids = set()
        for digest, code in self.promises.accepted.items():
            photo = self.door.get('/v1/photos/' + digest)
            if photo is None:
                self.door.fault(f'{digest} was answered by {code} and is not there')
            else:
                ids.add(photo['id'])
        stored = {photo['id'] for photo in self.door.get('/v1/photos?count=1000') or []}
        if stored != ids or len(ids) != len(self.promises.sent):
            self.door.fault(f'{len(self.promises.sent)} photos were sent, {len(ids)} are found by '
                            f'their hashes, and {len(stored)} are stored')
        for path, upload, _, name in self.promises.in_parts:
            told = self.door.get(path) or {}
            if (told.get('upload'), told.get('offset')) != (upload, len(self.photos[name])):
                self.door.fault(f'tus: {name} was whole as upload {upload}, and is {told}')
        for who, number in self.promises.contributions.items():
            listed = self.door.get(f'/v1/contributions/{number}/photos?count=1000') or []
            in_line = sorted((one['upload'], one['image']) for one in listed)
            whole = sorted((upload, name) for _, upload, sender, name in self.promises.in_parts
                           if sender == who)
            if in_line != whole:
                self.door.fault(f'tus: {who} has sent {whole}, and in line were {listed}')

    def end(self):
        for thread in self.senders + self.others:
            thread.join()
