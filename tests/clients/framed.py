# SPDX-License-Identifier: Apache-2.0
"""Messages behind heads with Content-Length, as language servers and debug adapters speak."""
import json
import subprocess

from serving import PROGRAM


def start(command):
    return subprocess.Popen([PROGRAM, command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def end(process):
    """Whatever it does, and closes its pipes."""
    if process.poll() is None:
        process.kill()
        process.wait()
    for pipe in (process.stdin, process.stdout, process.stderr):
        if pipe:
            pipe.close()


def frame(message):
    body = message if isinstance(message, bytes) else json.dumps(message).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def messages(stream, faults):
    """What comes until the end; what is wrong with a head goes to `faults`."""
    while True:
        length, head = None, b""
        while True:
            line = stream.readline()
            if not line:
                return
            head += line
            if not line.endswith(b"\r\n"):
                faults.append("a line of a head ends without CR LF: %r" % line)
            if line in (b"\r\n", b"\n"):
                break
            name, value = line.split(b":", 1)
            if name == b"Content-Length":
                length = int(value)
        if length is None:
            faults.append("a head without Content-Length: %r" % head)
            return
        yield json.loads(stream.read(length).decode("utf-8"))
