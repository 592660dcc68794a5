# SPDX-License-Identifier: Apache-2.0
"""A controller that speaks RTDE, version 2, for tests; written from the protocol's published description."""
import socket
import struct
import threading
import time

KINDS = {"DOUBLE": ("d", 1), "VECTOR6D": ("d", 6), "VECTOR3D": ("d", 3), "INT32": ("i", 1), "UINT32": ("I", 1),
         "UINT64": ("Q", 1), "BOOL": ("?", 1), "VECTOR6INT32": ("i", 6), "UINT8": ("B", 1)}


def package(kind, content):
    return struct.pack(">HB", len(content) + 3, ord(kind)) + content


class Controller:
    """state(k) gives the values of row k by variable, or None when there are no more; rows go out as fast as `rate`."""

    def __init__(self, variables, state, rate=None, version_ok=True, port=0, cut=None, garbage=None):
        self.variables, self.state, self.rate = variables, state, rate
        self.version_ok, self.cut, self.garbage = version_ok, cut, garbage
        self.row = 0
        self.sessions = 0
        self.requested = []
        self.paused = 0
        self.server = socket.create_server(("127.0.0.1", port))
        self.port = self.server.getsockname()[1]
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self._accept, daemon=True)
        self.thread.start()

    def _accept(self):
        self.server.settimeout(0.1)
        while not self.stop.is_set():
            try:
                connection, _ = self.server.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            self.sessions += 1
            connection.settimeout(10)
            try:
                self._talk(connection)
            except OSError:
                pass
            finally:
                connection.close()

    def _request(self, connection):
        def exactly(n):
            out = b""
            while len(out) < n:
                part = connection.recv(n - len(out))
                if not part:
                    raise ConnectionError
                out += part
            return out
        size, kind = struct.unpack(">HB", exactly(3))
        return chr(kind), exactly(size - 3)

    def _talk(self, connection):
        if self.garbage is not None:
            connection.sendall(self.garbage)
            time.sleep(0.2)
            return
        kind, content = self._request(connection)
        assert kind == "V" and struct.unpack(">H", content) == (2,), (kind, content)
        connection.sendall(package("V", struct.pack(">B", 1 if self.version_ok else 0)))
        if not self.version_ok:
            return
        kind, _ = self._request(connection)
        assert kind == "v"
        connection.sendall(package("v", struct.pack(">4I", 5, 11, 1, 108318)))
        kind, content = self._request(connection)
        assert kind == "O"
        self.frequency = struct.unpack(">d", content[:8])[0]
        self.requested = content[8:].decode().split(",")
        types = [self.variables.get(name, "NOT_FOUND") for name in self.requested]
        # A message may come at any time.
        text, source = b"a message between", b"fake"
        message = bytes([len(text)]) + text + bytes([len(source)]) + source + b"\3"
        connection.sendall(package("M", message) + package("O", bytes([7]) + ",".join(types).encode()))
        kind, _ = self._request(connection)
        assert kind == "S"
        connection.sendall(package("S", b"\1"))
        while not self.stop.is_set():
            values = self.state(self.row)
            if values is None:
                connection.setblocking(False)
                try:
                    if connection.recv(100) == package("P", b""):
                        self.paused += 1
                        return
                except BlockingIOError:
                    pass
                finally:
                    connection.setblocking(True)
                time.sleep(0.02)
                values = self.state(0)  # a controller never falls silent: the old state again
                connection.sendall(self._data(self.state(max(self.row - 1, 0)), types))
                continue
            raw = self._data(values, types)
            self.row += 1
            if self.cut is not None and self.row == self.cut:
                connection.sendall(raw[:len(raw) // 2])  # in the middle of a package
                return
            connection.sendall(raw)
            if self.rate:
                time.sleep(1 / self.rate)

    def _data(self, values, types):
        out = b"\7"
        for name, kind in zip(self.requested, types):
            form, count = KINDS[kind]
            v = values[name]
            out += struct.pack(f">{count}{form}", *(v if count > 1 else [v]))
        return package("U", out)

    def close(self):
        self.stop.set()
        self.server.close()
        self.thread.join(5)
