# SPDX-License-Identifier: Apache-2.0
# A client of the tus protocol for the tests, and a line between it and the daemon that breaks.
import base64
import contextlib
import http.client
import select
import socket
import threading

PART = 'application/offset+octet-stream'
VERSION = {'Tus-Resumable': '1.0.0'}


def metadata(**pairs):
    """Upload-Metadata of texts, or of bytes."""
    def encoded(value):
        value = value.encode() if isinstance(value, str) else value
        return base64.b64encode(value).decode()

    return ','.join(f'{key} {encoded(value)}' for key, value in pairs.items())


def begin(daemon, length, headers={}, body=None, **pairs):
    """Code, headers and body of the answer to a new upload."""
    return daemon.ask('POST', '/v1/tus', body,
                      {**VERSION, 'Upload-Length': str(length),
                       'Upload-Metadata': metadata(**pairs), **headers})


def must_begin(daemon, length, headers={}, body=None, **pairs):
    """The path of the upload."""
    code, answered, told = begin(daemon, length, headers, body, **pairs)
    assert code == 201, (code, told)
    return answered['Location']


def send(daemon, path, offset, data, headers={}):
    return daemon.ask('PATCH', path, data, {**VERSION, 'Content-Type': PART,
                                            'Upload-Offset': str(offset), **headers})


def offset_of(daemon, path, headers={}):
    """The offset that HEAD tells; the code where it tells none."""
    code, answered, _ = daemon.ask('HEAD', path, headers={**VERSION, **headers})
    return int(answered['Upload-Offset']) if code == 200 else -code


class BreakingLine:
    """Listens at a port of its own, and carries at most so many bytes of each connection's requests
    to the daemon before it cuts the connection off."""

    def __init__(self, daemon, bytes_max):
        host, port = daemon.host.split(':')
        self.to, self.bytes_max, self.cuts = (host, int(port)), bytes_max, 0
        self.listening = socket.create_server(('127.0.0.1', 0))
        self.host = f'127.0.0.1:{self.listening.getsockname()[1]}'
        threading.Thread(target=self.accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.listening.close()

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self.carry, args=(self.listening.accept()[0],),
                                 daemon=True).start()

    def carry(self, client):
        left = self.bytes_max
        with contextlib.suppress(OSError), client, \
                socket.create_connection(self.to, timeout=60) as daemon:
            while True:
                for ready in select.select([client, daemon], [], [])[0]:
                    data = ready.recv(4096)
                    if not data:
                        return
                    if ready is client:
                        daemon.sendall(data[:left])
                        left -= len(data)
                        if left < 0:
                            self.cuts += 1
                            return
                    else:
                        client.sendall(data)

    def ask(self, method, path, body=None, headers={}):
        with contextlib.closing(http.client.HTTPConnection(self.host, timeout=60)) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()


def send_stubbornly(daemon, path, data):
    """Goes on from where the daemon is, until all has come. How often the line broke."""
    breaks = 0
    while True:
        with contextlib.suppress(OSError, http.client.HTTPException):
            offset = offset_of(daemon, path)
            if offset == len(data):
                return breaks
            assert 0 <= offset < len(data), offset
            if send(daemon, path, offset, data[offset:])[0] == 204:
                continue
        breaks += 1
