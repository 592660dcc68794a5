# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium, driven over its DevTools protocol, with the standard library only.

    with Browser() as browser:
        page = browser.open("http://127.0.0.1:7007/")
        page.wait("document.title === 'ROBOMOSP'")

WebSocket below is a client of its own: tests of the server's door send with it what no browser would.
"""
import base64
import hashlib
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import urllib.request
import zlib

_GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


def find_browser():
    """The program, or None."""
    for name in (os.environ.get("ROBOMOSP_BROWSER"), "chromium-headless-shell", "chromium", "chromium-browser",
                 "google-chrome"):
        found = name and shutil.which(name)
        if found:
            return found
    return None


class WebSocket:
    """A client's end over a connected socket (RFC 6455)."""

    def __init__(self, host, port, path="/socket", origin=None, host_field=None, timeout=20, extra=""):
        self.sock = socket.create_connection((host, port), timeout=timeout)
        self.buffer = b""
        key = base64.b64encode(os.urandom(16)).decode()
        self.sock.sendall((f"GET {path} HTTP/1.1\r\nHost: {host_field or f'{host}:{port}'}\r\nUpgrade: websocket\r\n"
                           f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n" +
                           (f"Origin: {origin}\r\n" if origin else "") + extra + "\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            piece = self.sock.recv(65536)
            if not piece:
                break
            self.buffer += piece
        head, _, rest = self.buffer.partition(b"\r\n\r\n")
        self.status = int(head.split()[1]) if head else 0
        self.head, self.buffer = head.decode("latin-1"), rest
        if self.status == 101:
            wanted = base64.b64encode(hashlib.sha1((key + _GUID).encode()).digest()).decode()
            assert f"Sec-WebSocket-Accept: {wanted}" in self.head, self.head

    def close(self):
        self.sock.close()

    def send_frame(self, kind, content, last=True, mask=True, reserved=0):
        first = (0x80 if last else 0) | reserved | kind
        size = len(content)
        length = bytes([size]) if size < 126 else b"\x7e" + struct.pack(">H", size) if size < 65536 \
            else b"\x7f" + struct.pack(">Q", size)
        key = os.urandom(4)
        if mask:
            length = bytes([length[0] | 0x80]) + length[1:] + key
            pad = (key * (size // 4 + 1))[:size]
            content = (int.from_bytes(content, "big") ^ int.from_bytes(pad, "big")).to_bytes(size, "big")
        self.sock.sendall(bytes([first]) + length + content)

    def send(self, text):
        self.send_frame(1, text.encode())

    def _bytes(self, count):
        while len(self.buffer) < count:
            piece = self.sock.recv(1 << 20)
            if not piece:
                raise ConnectionError("closed")
            self.buffer += piece
        out, self.buffer = self.buffer[:count], self.buffer[count:]
        return out

    def frame(self):
        """(kind, content) of the next frame."""
        first, second = self._bytes(2)
        size = second & 127
        if size >= 126:
            size = int.from_bytes(self._bytes(2 if size == 126 else 8), "big")
        return first & 15, self._bytes(size)

    def receive(self):
        """The next message; (code, reason) as a tuple when the other end closes."""
        text = b""
        while True:
            kind, content = self.frame()
            if kind == 8:
                return (int.from_bytes(content[:2], "big") if content else 1005, content[2:].decode())
            if kind in (0, 1):
                return (text + content).decode()


class Page:
    def __init__(self, url):
        host, port, path = re.match(r"ws://([^:/]+):(\d+)(/.*)", url).groups()
        self.socket = WebSocket(host, int(port), path, timeout=120)
        self.number = 0
        self.events = []
        self.ask("Runtime.enable")
        self.ask("Page.enable")
        self.ask("Log.enable")

    def ask(self, method, **params):
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.receive())
            if message.get("id") == self.number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            self.events.append(message)

    def close(self):
        self.ask("Page.close")
        self.socket.close()

    def go(self, url):
        self.ask("Page.navigate", url=url)

    def run(self, code):
        """The value of an expression; promises are awaited."""
        done = self.ask("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            details = done["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return done["result"].get("value")

    def wait(self, code, seconds=10.0):
        """Until an expression is true; what it is worth."""
        end = time.monotonic() + seconds
        while True:
            try:
                value = self.run(code)
            except RuntimeError as fault:  # between two pages
                value, last = None, fault
            else:
                last = value
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"not within {seconds} s: {code}; it is {last}")
            time.sleep(0.02)

    def picture(self, file=None, clip=None):
        params = {"format": "png"}
        if clip:
            params["clip"] = {**clip, "scale": 1}
        data = base64.b64decode(self.ask("Page.captureScreenshot", **params)["data"])
        if file:
            with open(file, "wb") as out:
                out.write(data)
        return data

    def faults(self):
        """What scripts threw and the console was told as an error."""
        self.run("1")
        out = []
        for e in self.events:
            if e.get("method") == "Runtime.exceptionThrown":
                out.append(e["params"]["exceptionDetails"].get("exception", {}).get("description", "exception"))
            elif e.get("method") == "Log.entryAdded" and e["params"]["entry"]["level"] == "error":
                out.append(e["params"]["entry"]["text"])
        return out

    def requests(self):
        return self.run("performance.getEntriesByType('resource').map((e) => e.name)")


class Browser:
    def __init__(self, size=(1100, 800), program=None):
        self.folder = tempfile.mkdtemp(prefix="robomosp-browser-")
        command = [program or find_browser(), "--headless", "--remote-debugging-port=0", "--no-first-run",
                   f"--user-data-dir={self.folder}", f"--window-size={size[0]},{size[1]}", "--use-gl=angle",
                   "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
                   "--disable-extensions", "--disable-background-networking", "--disable-sync", "--mute-audio",
                   "--hide-scrollbars", "--force-device-scale-factor=1"]
        # Where the system lets nobody else make a sandbox, there is none.
        for more in ([["--no-sandbox"]] if os.geteuid() == 0 else [[], ["--no-sandbox"]]):
            self.process = subprocess.Popen(command + more + ["about:blank"], stdout=subprocess.DEVNULL,
                                            stderr=subprocess.PIPE, text=True, start_new_session=True)
            for line in self.process.stderr:
                found = re.search(r"DevTools listening on ws://([^:/]+):(\d+)", line)
                if found:
                    self.host, self.port = found[1], int(found[2])
                    # What it says is read on, so that it never waits for that.
                    threading.Thread(target=self.process.stderr.read, daemon=True).start()
                    return
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)
        raise RuntimeError("the browser did not start")

    def open(self, url, dark=False):
        request = urllib.request.Request(f"http://{self.host}:{self.port}/json/new?about:blank", method="PUT")
        with urllib.request.urlopen(request, timeout=90) as answer:
            page = Page(json.load(answer)["webSocketDebuggerUrl"])
        if dark:
            page.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        page.go(url)
        return page

    def close(self):
        # Debian's program is a script, which passes no signal on: its whole session ends.
        for kind in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(self.process.pid, kind)
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                continue
            except ProcessLookupError:
                break
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def pixels(png):
    """(width, height, rows of RGB or RGBA bytes, bytes a pixel) of a PNG of 8 bits without interlace."""
    at, data = 8, b""
    while at < len(png):
        size, = struct.unpack(">I", png[at:at + 4])
        kind, content = png[at + 4:at + 8], png[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", content)
            assert depth == 8 and colour in (2, 6) and not interlace
            step = 3 if colour == 2 else 4
        elif kind == b"IDAT":
            data += content
        at += 12 + size
    raw, rows, before = zlib.decompress(data), [], bytearray(width * step)
    stride = width * step
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        if kind == 1:
            for i in range(step, stride):
                row[i] = (row[i] + row[i - step]) & 255
        elif kind == 2:
            row = bytearray((a + b) & 255 for a, b in zip(row, before))
        elif kind == 3:
            for i in range(stride):
                row[i] = (row[i] + ((row[i - step] if i >= step else 0) + before[i]) // 2) & 255
        elif kind == 4:
            for i in range(stride):
                a, b, c = (row[i - step] if i >= step else 0), before[i], (before[i - step] if i >= step else 0)
                p = a + b - c
                pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
                row[i] = (row[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255
        rows.append(row)
        before = row
    return width, height, rows, step
