# SPDX-License-Identifier: Apache-2.0
"""A server for tests of clients: the protocol's messages over sockets, and whatever else a test makes it say."""
import base64
import json
import os
import socket
import struct
import subprocess
import tempfile
import threading

HELLO = {"program": "robomosp", "version": "0.1.0", "protocol": 1, "session": 7, "instance": "one",
         "effects": ["reads"], "folder": None,
         "limits": {"line": 8 << 20, "depth": 64, "batch": 10000, "answer": 64 << 20, "rate": 0}}


def handle(kind, number, name):
    return {"$handle": {"kind": kind, "number": number, "name": name}}


def packed(numbers, *shape):
    return {"$array": {"shape": list(shape) or [len(numbers)],
                       "base64": base64.b64encode(struct.pack(f"<{len(numbers)}d", *numbers)).decode()}}


class Refusal(Exception):
    """Answered as an error of JSON-RPC."""

    def __init__(self, number, message, data=None):
        super().__init__(message)
        self.fault = {"code": number, "message": message, **({"data": data} if data else {})}


class FakeServer:
    """Answers each connection on a thread. `raw`: bytes that are said instead, then it closes."""

    def __init__(self, raw=None, hello=HELLO, path=None, context=None, silent=False, token=None):
        self.raw, self.hello, self.silent, self.token = raw, hello, silent, token
        self.asked = []  # messages that came
        self.methods = {"server.hello": self._hello, "echo": lambda m, say: m.get("params"),
                        "ioci.describe": self._describe}
        self._context = context
        self._socket = socket.socket(socket.AF_UNIX if path else socket.AF_INET)
        if path:
            self._socket.bind(path)
            self.address = "unix:" + path
        else:
            self._socket.bind(("127.0.0.1", 0))
            self.address = "127.0.0.1:%d" % self._socket.getsockname()[1]
        self._socket.listen()
        self._open = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _hello(self, message, say):
        if self.token and message.get("params", {}).get("token") != self.token:
            raise Refusal(-32000, "the token is not known. Ask for one.",
                          {"code": "permission", "where": "server.hello", "hint": "Ask for one."})
        return self.hello

    def _describe(self, message, say):
        asked = message.get("params", {}).get("command")
        return [{"name": name, "params": [], "returns": {}} for name in self.methods if asked in (None, name)]

    def _accept(self):
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            self._open.append(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        try:
            if self._context:
                connection = self._context.wrap_socket(connection, server_side=True)
                self._open.append(connection)
            file = connection.makefile("rwb")

            def say(message):
                text = message if isinstance(message, bytes) else json.dumps(message).encode() + b"\n"
                file.write(text)
                file.flush()

            if self.raw is not None:
                file.readline()
                say(self.raw)
                connection.shutdown(socket.SHUT_RDWR)
                connection.close()
                return
            for line in file:
                if self.silent:
                    continue
                message = json.loads(line)
                batch = message if isinstance(message, list) else [message]
                answers = [a for a in (self._answer(one, say) for one in batch) if a is not None]
                if answers:
                    say(answers if isinstance(message, list) else answers[0])
        except (OSError, ValueError):
            connection.close()

    def _answer(self, message, say):
        self.asked.append(message)
        method = self.methods.get(message["method"])
        answer = {"jsonrpc": "2.0", "id": message.get("id")}
        try:
            if method is None:
                raise Refusal(-32601, "there is no command \"%s\"." % message["method"])
            result = method(message, say)
            if result is NotImplemented or "id" not in message:
                return None
            return {**answer, "result": result}
        except Refusal as e:
            return {**answer, "error": e.fault}

    def drop(self):
        """Closes the connections that are open."""
        dropped, self._open = self._open, []  # those that come meanwhile stay
        for connection in dropped:
            try:
                connection.shutdown(socket.SHUT_RDWR)
                connection.close()
            except OSError:
                pass

    def close(self):
        try:
            self._socket.shutdown(socket.SHUT_RDWR)  # wakes who accepts
        except OSError:
            pass
        self._socket.close()
        self.drop()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def make_certificate(folder, name="other-name"):
    """Files of a certificate and its key; None without the program openssl."""
    key, cert = os.path.join(folder, "key.pem"), os.path.join(folder, "cert.pem")
    try:
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                        "-nodes", "-days", "2", "-subj", "/CN=" + name, "-keyout", key, "-out", cert],
                       check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return cert, key


def short_folder():
    """A folder whose name is short enough for sockets."""
    return tempfile.TemporaryDirectory(prefix="rmp")
