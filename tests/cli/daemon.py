# SPDX-License-Identifier: Apache-2.0
# A daemon of the tests, and how they talk with it.
import contextlib
import http.client
import json
import resource
import signal
import subprocess
import time
import urllib.parse

from city import VEDUTA

JPEG = {'Content-Type': 'image/jpeg'}


class Daemon:
    """`veduta serve` at a port of its own. Leaving it as a context ends it as an administrator
    does, and it must end well."""

    def __init__(self, db, *more, http='127.0.0.1:0', program=VEDUTA, limits={}):
        """`limits`: of the process, by their numbers of setrlimit."""
        def set_limits():
            for which, most in limits.items():
                resource.setrlimit(which, (most, most))

        self.process = subprocess.Popen([program, 'serve', db, '--http', http, '--json', *more],
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        preexec_fn=set_limits)
        line = self.process.stdout.readline()
        assert line, self.process.stderr.read().decode()
        self.started = json.loads(line)
        self.host = self.started['http'].removeprefix('http://')

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            code, err = self.stop()
            assert code == 0 or any(error), err

    def stop(self, how=signal.SIGTERM):
        """Exit code and standard error."""
        self.process.send_signal(how)
        _, err = self.process.communicate(timeout=60)
        return self.process.returncode, err.decode()

    def connect(self):
        return http.client.HTTPConnection(self.host, timeout=120)

    def ask(self, method, path, body=None, headers={}):
        """Code, headers and body of the answer."""
        with contextlib.closing(self.connect()) as connection:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    def get(self, path):
        code, _, body = self.ask('GET', path)
        assert code == 200, (path, code, body)
        return json.loads(body)

    def send(self, name, data, contributor='anna', camera='c', waits=True):
        """Code, headers and the JSON of the answer."""
        headers = JPEG if waits else {**JPEG, 'Prefer': 'respond-async'}
        query = urllib.parse.urlencode({'name': name, 'contributor': contributor,
                                        **({'camera': camera} if camera else {})})
        code, headers, body = self.ask('POST', '/v1/photos?' + query, data, headers)
        return code, headers, json.loads(body)

    def send_until_taken(self, name, data, contributor='anna'):
        """As a patient client does: it comes again when it is told to."""
        while True:
            code, headers, answer = self.send(name, data, contributor)
            if code not in (429, 503):
                return code, answer
            assert int(headers['Retry-After']) >= 1
            time.sleep(0.05)

    def wait_for_uploads(self):
        while self.get('/v1/uploads'):
            time.sleep(0.05)


def part(name):
    """A name as a part of a path."""
    return urllib.parse.quote(name, safe='')
