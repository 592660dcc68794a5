# SPDX-License-Identifier: Apache-2.0
"""A small MQTT 3.1.1 client for tests, written from the OASIS standard: CONNECT, PUBLISH and SUBSCRIBE at QoS 0."""
import socket
import struct
import threading
import time


def _text(s):
    raw = s.encode()
    return struct.pack(">H", len(raw)) + raw


def _packet(kind, body):
    length, out = len(body), bytearray([kind])
    while True:
        byte, length = length % 128, length // 128
        out.append(byte | (0x80 if length else 0))
        if not length:
            return bytes(out) + body


class Peer:
    def __init__(self, port, name, username=None, password=None):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=10)
        flags, payload = 2, _text(name)
        if username is not None:
            flags |= 0x80
            payload += _text(username)
        if password is not None:
            flags |= 0x40
            payload += _text(password)
        self.socket.sendall(_packet(0x10, _text("MQTT") + bytes([4, flags]) + struct.pack(">H", 60) + payload))
        kind, body = self._read()
        if kind != 0x20 or body[1] != 0:
            raise ConnectionError(f"refused: {body!r}")
        self.heard = []
        self.lock = threading.Lock()

    def _exactly(self, n):
        out = b""
        while len(out) < n:
            part = self.socket.recv(n - len(out))
            if not part:
                raise ConnectionError("the broker closed")
            out += part
        return out

    def _read(self):
        kind = self._exactly(1)[0]
        length, shift = 0, 0
        while True:
            byte = self._exactly(1)[0]
            length |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                return kind, self._exactly(length)

    def publish(self, topic, payload):
        payload = payload if isinstance(payload, bytes) else payload.encode()
        self.socket.sendall(_packet(0x30, _text(topic) + payload))

    def subscribe(self, topic):
        self.socket.sendall(_packet(0x82, struct.pack(">H", 1) + _text(topic) + b"\0"))
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        self.socket.settimeout(None)
        try:
            while True:
                kind, body = self._read()
                if kind & 0xF0 != 0x30:
                    continue
                n = struct.unpack(">H", body[:2])[0]
                with self.lock:
                    self.heard.append((body[2:2 + n].decode(), body[2 + n:]))
        except OSError:
            pass

    def wait_for(self, wanted, seconds=10):
        """The first message for which wanted(topic, payload) holds."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            with self.lock:
                for message in self.heard:
                    if wanted(*message):
                        return message
            time.sleep(0.02)
        raise AssertionError(f"no such message within {seconds} s; there were {self.heard[-3:]}")

    def close(self):
        self.socket.close()
