# SPDX-License-Identifier: Apache-2.0
"""ROBOMOSP from Python: a client of `robomosp serve` and of `robomosp rpc`.

One file, Python 3.9 or later, nothing but the standard library; NumPy is used when it is there.

    import robomosp

    with robomosp.start() as r:                        # a program of its own, as a child process
        arm = r.robot.get("pa10")
        found = arm.solve_ik(target=[0.557, 0, 0.374, "180 deg", 0, "180 deg"])
        print(found.q)

    with robomosp.connect("127.0.0.1:7007", token="rmp_...") as r:    # one that serves
        r.robot.list()

    async with robomosp.aconnect("127.0.0.1:7007") as r:              # the same on asyncio
        arm = await r.robot.get("pa10")

Every command of the program is a method: r.robot.fk(id="pa10", q=[0] * 7), or a method of a handle:
arm.fk(q=[0] * 7). Numbers are in SI units; where the reference names a unit, texts such as "30 deg"
are taken too. help(r.robot.fk) shows what a command does, dir(r.robot) which there are. Names that are
words of Python end with an underscore: r.import_(file="part.step"), from_=....

    r.world.plan_path(..., _timeout=10)      at most 10 s; robomosp.Timeout after that
    job = r.world.plan_path.job(...)         long work beside others; job.wait(), job.cancel()
    for event in r.events("change"): ...     what happens, of all who work on the same world
    r.picture(arm), r.plot(recording)        pictures without a file; notebooks show them

Errors are robomosp.Error with code, where and hint. A connection may be used by several threads.
"""
from __future__ import annotations

import array as _array
import asyncio
import atexit
import base64
import binascii
import collections
import collections.abc
import html
import inspect
import itertools
import json
import keyword
import os
import queue
import re
import shutil
import socket
import ssl
import subprocess
import sys
import threading
import time
import weakref

try:
    import numpy as _numpy
except ImportError:
    _numpy = None

__all__ = ["connect", "start", "aconnect", "astart", "Connection", "AsyncConnection", "Handle", "Job",
           "AsyncJob", "Subscription", "AsyncSubscription", "Result", "Table", "Picture", "Plot",
           "Error", "Cancelled", "Timeout", "ConnectionLost", "ProtocolError", "PROTOCOL"]
__version__ = "0.1.0"

PROTOCOL = 1  #: the version of the protocol that this file speaks
DEFAULT_PORT = 7007
_LONGEST_LINE = 8 << 20      # of a request, where the server does not say otherwise [bytes]
_LONGEST_ANSWER = 256 << 20  # after which a server is not believed [bytes]
_MOST_EVENTS = 100_000       # that wait in a subscription
_CHUNK = 1 << 20             # of a file [bytes]
_DEFAULT = object()


# --- errors ---


class Error(Exception):
    """What ROBOMOSP, or this client, refused or could not do.

    str(e) is the whole sentence. e.code is a word such as "invalid_argument", "not_found" or
    "unreachable"; e.where the place, outermost first; e.hint what to do; e.faults the causes one by
    one; e.data the whole member "data" of the response.
    """

    def __init__(self, message, code="internal", where="", hint="", number=None, data=None):
        super().__init__(message)
        self.message = message
        self.code = code
        self.where = where
        self.hint = hint
        self.number = number  #: of JSON-RPC, such as -32602; None where the client itself refused
        self.data = data or {}

    @property
    def faults(self):
        """What is wrong, one table for each cause: code, class, text, subject, extent, witness,
        remedies. Empty where the server sends none, and for errors of this client."""
        given = self.data.get("faults")
        return [f for f in given if isinstance(f, dict)] if isinstance(given, list) else []


class Cancelled(Error):
    """The request or job was cancelled."""


class Timeout(Error, TimeoutError):
    """No answer came within the time; the request was cancelled."""


class ConnectionLost(Error, ConnectionError):
    """The connection has ended, or there was none."""


class ProtocolError(ConnectionLost):
    """The other end does not speak as ROBOMOSP does; the connection is closed."""


def _usage(message, hint=""):
    return Error(message + (" " + hint if hint else ""), "invalid_argument", hint=hint)


def _error_of(fault):
    """The exception of the member "error" of an answer."""
    data = fault.get("data")
    data = data if isinstance(data, dict) else {}
    text = lambda x: x if isinstance(x, str) else ""  # noqa: E731
    number = fault.get("code")
    code = text(data.get("code")) or {-32700: "syntax", -32600: "usage", -32601: "unknown_name",
                                      -32602: "invalid_argument"}.get(number, "internal")
    message = text(fault.get("message")) or "the server gave an error without words"
    kind = Cancelled if code == "cancelled" else Error
    return kind(message, code, text(data.get("where")), text(data.get("hint")), number, data)


def _shown(raw, most=60):
    """Bytes that a stranger sent, as a short text on one line."""
    text = raw[:most].decode("utf-8", "replace")
    text = "".join(c if c.isprintable() else "." for c in text)
    return '"' + text + ("..." if len(raw) > most else "") + '"'


# --- values ---


class Result(dict):
    """A table of an answer: result["q"] or result.q. Notebooks show it as a table.

    Names that dictionaries use themselves (items, keys, values, get, ...) need brackets.
    """

    def __getattr__(self, name):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(
                f'there is no "{name}" here; there are {", ".join(map(str, self)) or "no fields"}') from None

    def __dir__(self):
        return sorted(set(super().__dir__()) | {k for k in self if isinstance(k, str)})

    def _repr_html_(self):
        return _html_table(None, [(str(k), v) for k, v in self.items()])


class Table(list):
    """A list of tables of an answer. Notebooks show it as a table with a column for each field."""

    def _repr_html_(self):
        columns = list(dict.fromkeys(key for row in self for key in row))
        return _html_table(columns, [[row.get(c, "") for c in columns] for row in self])


def _html_table(columns, rows, most=200):
    cell = lambda v: "<td>" + html.escape(_short(v)) + "</td>"  # noqa: E731
    head = "<tr>" + "".join(f"<th>{html.escape(str(c))}</th>" for c in columns) + "</tr>" if columns else ""
    body = "".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in rows[:most])
    rest = f"<p>{len(rows) - most} more rows</p>" if len(rows) > most else ""
    return f"<table>{head}{body}</table>{rest}"


def _short(value, most=200):
    """A value as one line of at most `most` characters."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Handle):
        return value.name or str(value)
    if _numpy is not None and isinstance(value, _numpy.ndarray):
        value = value.tolist() if value.size <= 64 else str(value)
    if isinstance(value, dict):
        text = ", ".join(f"{k} = {_short(v, 60)}" for k, v in itertools.islice(value.items(), 20))
    elif isinstance(value, (list, tuple)):
        text = "[" + ", ".join(_short(v, 60) for v in value[:40]) + ("" if len(value) <= 40 else ", ...") + "]"
    else:
        text = str(value)
    return text if len(text) <= most else text[:most - 3] + "..."


class Picture(Result):
    """A picture of the program: .png holds the bytes of a PNG file. Notebooks show it.

    It is the table of the answer as well: picture["width"], with the bytes under "png".
    """

    def __init__(self, png, about=None):
        super().__init__(about or {})
        self["png"] = png
        self.setdefault("width", None)
        self.setdefault("height", None)
        self.setdefault("left_out", [])  # sentences about what could not be drawn

    def save(self, file):
        """Writes the picture to a file on this machine."""
        with open(file, "wb") as out:
            out.write(self.png)

    def _repr_png_(self):
        return self.png

    _repr_html_ = None  # notebooks show the picture and not the table

    def __repr__(self):
        size = f"{self.width} x {self.height} px, " if self.width else ""
        return f"<picture, {size}{len(self.png)} bytes>"


class Plot:
    """A plot as SVG: .svg is its text. Notebooks show it."""

    def __init__(self, svg):
        self.svg = svg

    def save(self, file):
        """Writes the plot to a file (*.svg) on this machine."""
        with open(file, "w", encoding="utf-8") as out:
            out.write(self.svg)

    def _repr_svg_(self):
        return self.svg

    def __repr__(self):
        return f"<plot, SVG of {len(self.svg)} characters>"


def _packed(shape, raw):
    return {"$array": {"shape": shape, "base64": base64.b64encode(raw).decode("ascii")}}


def _doubles(numbers):
    out = _array.array("d", numbers)
    if sys.byteorder != "little":
        out.byteswap()
    return out.tobytes()


_FEW = 64  # numbers that are sent as digits


def _are_reals(values):
    kinds = set(map(type, values))
    return float in kinds and kinds <= {float, int}


def _packed_list(values):
    """A long list of numbers, or of rows of numbers, as bytes; None when it is none."""
    if len(values) >= _FEW and type(values[0]) in (float, int):
        try:
            return _packed([len(values)], _doubles(values)) if _are_reals(values) else None
        except OverflowError:
            return None
    if len(values) >= 8 and type(values[0]) in (list, tuple):
        width = len(values[0])
        if width == 0 or len(values) * width < _FEW:
            return None
        if all(type(row) in (list, tuple) and len(row) == width for row in values):
            flat = list(itertools.chain.from_iterable(values))
            try:
                return _packed([len(values), width], _doubles(flat)) if _are_reals(flat) else None
            except OverflowError:
                return None
    return None


_NUMBER_WORDS = {"inf": float("inf"), "-inf": float("-inf"), "nan": float("nan")}


def _with_numbers(value, returns):
    """Texts "inf", "-inf" and "nan" as numbers, where the command gives numbers."""
    def one(v, type_):
        return _NUMBER_WORDS.get(v, v) if isinstance(v, str) and type_ == "real" else v

    types = {f.get("name"): f.get("type") for f in returns.get("fields", [])}

    def fields(table):
        for key, v in table.items():
            if isinstance(v, str):
                table[key] = one(v, types.get(key))

    if isinstance(value, dict):
        fields(value)
    elif isinstance(value, list):
        for row in value:
            if isinstance(row, dict):
                fields(row)
    else:
        return one(value, returns.get("type"))
    return value


def _has_number_words(value):
    if isinstance(value, str):
        return value in _NUMBER_WORDS
    if isinstance(value, dict):
        return any(isinstance(v, str) and v in _NUMBER_WORDS for v in value.values())
    if isinstance(value, list):
        return any(isinstance(row, dict) and _has_number_words(row) for row in value)
    return False


# --- what stands for things of the program ---


class Handle:
    """A record, recording or run of the program that the connection leads to.

    Its methods are the commands of its kind: arm.fk(q="ready"). kind, number and name say what it is.
    """

    __slots__ = ("_owner", "_generation", "kind", "number", "name", "__weakref__")

    def __init__(self, owner, kind, number, name=""):
        self._owner = owner
        self._generation = owner._generation
        self.kind = kind
        self.number = number
        self.name = name

    def __getattr__(self, name):
        return Command(self._owner, self.kind + "." + _attribute(self, name), self)

    def __dir__(self):
        return sorted(set(super().__dir__()) | set(self._owner._names_below(self.kind, True)))

    def __eq__(self, other):
        return (isinstance(other, Handle) and self._owner is other._owner and
                (self._generation, self.kind, self.number) ==
                (other._generation, other.kind, other.number))

    def __hash__(self):
        return hash((id(self._owner), self._generation, self.kind, self.number))

    def __str__(self):
        return f"{self.kind}:{self.name}#{self.number}" if self.name else f"{self.kind}#{self.number}"

    __repr__ = __str__

    def _repr_html_(self):
        about = self._owner._described(self)
        title = f"<b>{html.escape(str(self))}</b>"
        return title + (about._repr_html_() if about is not None else "")


def _attribute(of, name):
    """The name of a command, without the underscore that keeps it apart from words of Python."""
    if name.startswith("_") or name == "getdoc":  # what notebooks and debuggers ask for
        raise AttributeError(f"{type(of).__name__} has no attribute {name}")
    return _plain_name(name)


def _plain_name(name):
    return name[:-1] if name.endswith("_") and keyword.iskeyword(name[:-1]) else name


def _python_name(name):
    return name + "_" if keyword.iskeyword(name) else name


class Command:
    """A command of the program, to be called. help(command) shows what it does."""

    __slots__ = ("_owner", "_name", "_bound")

    def __init__(self, owner, name, bound=None):
        self._owner = owner
        self._name = name
        self._bound = bound

    def __call__(self, *args, **kwargs):
        return self._owner._invoke(self._name, self._bound, args, kwargs)

    def job(self, *args, **kwargs):
        """Starts the command as a job: long work that goes on beside others."""
        return self._owner._invoke(self._name, self._bound, args, kwargs, as_job=True)

    @property
    def __name__(self):
        return self._name.rpartition(".")[2]

    @property
    def __doc__(self):
        spec = self._owner._spec_now(self._name)
        return _doc_of(spec, self._bound is not None) if spec else None

    @property
    def __signature__(self):
        spec = self._owner._spec_now(self._name)
        if not spec:
            raise AttributeError("__signature__")
        return _signature_of(spec, self._bound is not None)

    def __repr__(self):
        spec = self._owner._spec_now(self._name)
        return self._name + (str(_signature_of(spec, self._bound is not None)) if spec else "(...)")


def _signature_of(spec, is_bound):
    out = []
    for p in spec.get("params", [])[1 if is_bound else 0:]:
        name = _python_name(p["name"])
        if not name.isidentifier():
            continue
        default = inspect.Parameter.empty if p.get("required") else p.get("default")
        out.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default))
    return inspect.Signature(out)


def _doc_of(spec, is_bound):
    lines = [spec.get("summary", ""), ""]
    if spec.get("details"):
        lines += [spec["details"], ""]
    params = spec.get("params", [])[1 if is_bound else 0:]
    if params:
        lines.append("Arguments:")
    for p in params:
        about = p.get("type", "") + (f" [{p['unit']}]" if p.get("unit") else "")
        if p.get("required"):
            about += ", needed"
        elif p.get("default") is not None:
            about += f" = {json.dumps(p['default'], default=str)}"
        if p.get("choices"):
            about += ", one of " + ", ".join(p["choices"])
        lines.append(f"    {_python_name(p['name'])}: {about}. {p.get('doc', '')}")
    returns = spec.get("returns", {})
    unit = f" [{returns['unit']}]" if returns.get("unit") else ""
    lines += ["", f"Returns: {returns.get('type') or 'nothing'}{unit}. {returns.get('doc', '')}".rstrip()]
    for f in returns.get("fields", []):
        unit = f" [{f['unit']}]" if f.get("unit") else ""
        lines.append(f"    {f['name']}: {f.get('type', '')}{unit}. {f.get('doc', '')}")
    lines += ["", "Effects: " + ", ".join(list(spec.get("effects", [])) or ["reads"]) + "."]
    if spec.get("example"):
        lines += ["", "In Lua:"] + ["    " + line for line in spec["example"].splitlines()]
    return "\n".join(lines)


class Topic:
    """The commands whose names begin alike: r.robot. r.robot("pa10") is r.robot.get("pa10")."""

    __slots__ = ("_owner", "_name")

    def __init__(self, owner, name):
        self._owner = owner
        self._name = name

    def __getattr__(self, name):
        return Command(self._owner, self._name + "." + _attribute(self, name))

    def __call__(self, *args, **kwargs):
        return self._owner._invoke_topic(self._name, args, kwargs)

    def __dir__(self):
        return sorted(set(super().__dir__()) | set(self._owner._names_below(self._name, False)))

    @property
    def __doc__(self):
        spec = self._owner._spec_now(self._name)
        if spec:
            return _doc_of(spec, False)
        names = self._owner._names_below(self._name, False)
        return f"Commands: {', '.join(names)}." if names else None

    def __repr__(self):
        return f"<commands {self._name}.* of {self._owner.address}>"


# --- addresses ---


class _Address:
    """host and port, or path."""

    def __init__(self, text):
        self.path = self.host = self.port = None
        self.text = text
        if not isinstance(text, str) or not text.strip():
            raise _usage('an address is a text.', 'Give "127.0.0.1:7007", "unix:/path" or "host:port".')
        text = text.strip()
        if text.startswith("unix:"):
            self.path = text[5:]
            if not self.path:
                raise _usage("the address names no socket.", 'Give "unix:/path/to/socket".')
            return
        match = re.fullmatch(r"\[([^\[\]]+)\](?::(\d+))?|([^:\[\]]+)(?::(\d+))?", text)
        if not match:
            raise _usage(f'"{text}" is not an address.', 'Give "host:port", "[::1]:7007" or "unix:/path".')
        self.host = match[1] or match[3]
        self.port = int(match[2] or match[4] or DEFAULT_PORT)
        if not 0 < self.port < 65536:
            raise _usage(f'"{text}" has no port.', "Ports are 1 to 65535.")

    @property
    def is_local(self):
        return self.path is not None or self.host in ("localhost", "::1") or self.host.startswith("127.")

    def refused(self, why):
        return ConnectionLost(f"{self.text} cannot be reached: {why}.", "io",
                              hint="Is `robomosp serve` running there?")


def _why(error):
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).strip().rstrip(".")


def _tls_context(tls, address):
    """(context or None, certificates that are trusted by themselves)."""
    if tls is None:
        tls = not address.is_local
    if tls is False:
        return None, None
    if address.path:
        raise _usage("a Unix socket has no TLS.", "Leave tls out.")
    if isinstance(tls, ssl.SSLContext):
        return tls, None
    if tls is True:
        context = ssl.create_default_context()
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        return context, None
    # A file: that very certificate is trusted whatever its name, and what it signed by name.
    try:
        with open(tls, encoding="ascii") as file:
            text = file.read()
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        context.load_verify_locations(cadata=text)
        marks = re.findall(r"-----BEGIN CERTIFICATE-----.+?-----END CERTIFICATE-----", text, re.S)
        return context, [ssl.PEM_cert_to_DER_cert(m) for m in marks]
    except (OSError, ValueError) as e:
        raise _usage(f"{tls} cannot be read as certificates: {_why(e)}.",
                     "Give a PEM file, True or an ssl.SSLContext.") from None


def _tls_failure(address, e):
    why = getattr(e, "verify_message", "") or _why(e)
    if isinstance(e, ssl.SSLCertVerificationError):
        hint = 'Give the server\'s certificate: tls="server.pem".'
        return ConnectionLost(f"{address.text} is not trusted: {why}. {hint}", "permission", hint=hint)
    hint = "Connect with tls=False if it serves without TLS."
    return ProtocolError(f"{address.text} does not speak TLS: {why}. {hint}", "unsupported", hint=hint)


# --- transports of the blocking connection ---


class _Socket:
    """Bytes over TCP or a Unix socket."""

    def __init__(self, sock):
        self._sock = sock
        sock.settimeout(None)

    def read(self):
        try:
            return self._sock.recv(1 << 16)
        except OSError:
            return b""

    def end_reading(self):
        """Called by the thread that reads, when it reads no more."""

    def write(self, data):
        self._sock.sendall(data)

    def close(self):
        try:
            self._sock.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._sock.close()


class _TlsSocket(_Socket):
    """The same with TLS. One lock, held for no wait: a session is not for two threads at once."""

    def __init__(self, sock):
        self._sock = sock
        sock.setblocking(False)
        self._lock = threading.Lock()
        self._closed = False

    def _wait(self, for_write):
        import selectors
        with selectors.DefaultSelector() as selector:
            selector.register(self._sock, selectors.EVENT_WRITE if for_write else selectors.EVENT_READ)
            selector.select(0.5)

    def read(self):
        while not self._closed:
            for_write = False
            try:
                with self._lock:
                    return self._sock.recv(1 << 16)
            except ssl.SSLWantReadError:
                pass
            except ssl.SSLWantWriteError:
                for_write = True
            except OSError:
                return b""
            try:
                self._wait(for_write)
            except (OSError, ValueError):
                return b""
        return b""

    def write(self, data):
        view = memoryview(data)
        while len(view):
            for_write = True
            try:
                with self._lock:
                    view = view[self._sock.send(view[:1 << 14]):]
                continue
            except ssl.SSLWantReadError:
                for_write = False
            except ssl.SSLWantWriteError:
                pass
            if self._closed:
                raise ConnectionError("closed")
            self._wait(for_write)

    def close(self):
        self._closed = True
        super().close()


class _Child:
    """Bytes to and from a child process."""

    def __init__(self, command):
        # In a session of its own: Ctrl-C here cancels a request and does not end the program.
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0,
                                        start_new_session=os.name == "posix")
        self._close_lock = threading.Lock()

    def read(self):
        try:
            return self.process.stdout.read(1 << 16)
        except (OSError, ValueError):
            return b""

    def write(self, data):
        view = memoryview(data)
        while len(view):
            view = view[self.process.stdin.write(view):]

    def end_reading(self):
        """Called by the thread that reads, when it reads no more."""
        self.process.stdout.close()

    def close(self):
        with self._close_lock:
            if self.process.returncode is not None and self.process.stdin.closed:
                return
            try:
                self.process.stdin.close()
            except OSError:
                pass
            for end in (lambda: None, self.process.terminate, self.process.kill):
                end()
                try:
                    self.process.wait(3)
                    break
                except subprocess.TimeoutExpired:
                    continue


def _program(program):
    """The command that starts `robomosp rpc`."""
    if isinstance(program, (list, tuple)):
        return [os.fspath(p) for p in program]
    if program is None:
        # Beside this file, when it is where ROBOMOSP installs it; else by the search path.
        beside = os.path.join(os.path.dirname(os.path.abspath(__file__)), *[os.pardir] * 4, "bin", "robomosp")
        program = os.environ.get("ROBOMOSP_PROGRAM") or (
            os.path.normpath(beside) if os.access(beside, os.X_OK) else "robomosp")
    found = shutil.which(os.fspath(program))
    if not found:
        raise Error(f'There is no program "{program}". Install ROBOMOSP, or give start(program="...").',
                    "not_found", hint='Install ROBOMOSP, or give start(program="...").')
    return [found, "rpc"]


class _Lines:
    """Cuts what comes into lines, up to a greatest length."""

    def __init__(self):
        self._parts = []
        self.size = 0  #: bytes of the line that is not complete

    def feed(self, chunk):
        *whole, rest = chunk.split(b"\n")
        for piece in whole:
            self._parts.append(piece)
            line = b"".join(self._parts)
            self._parts, self.size = [], 0
            yield line
        if rest:
            self._parts.append(rest)
            self.size += len(rest)
        if self.size > _LONGEST_ANSWER:
            raise ProtocolError(f"the answer is longer than {_LONGEST_ANSWER >> 20} MiB", "unsupported")

    def start(self):
        return b"".join(self._parts)[:200]


# --- what both connections share ---


class _Base:
    """Messages, values and what is known of the commands. The parts that wait are elsewhere."""

    def _begin(self, address, numpy, token, client):
        self.address = address
        self.hello = {}  #: what the server said of itself; empty for a child process
        self.timeout = None  #: of calls that give none [s]; None waits for as long as it takes
        self._client = str(client)[:64]
        self._token = token
        if numpy is True and _numpy is None:
            raise _usage("NumPy is not installed.", "Leave numpy out.")
        self._numpy = _numpy if numpy is not False else None
        self._generation = 0
        self._ids = itertools.count(1)
        self._pending = {}
        self._jobs = collections.OrderedDict()  # number: the last that was said of it
        self._subscriptions = {}
        self._interrupted = []  # subscriptions of a connection that was lost
        self._is_reconnecting = False
        self._early = collections.OrderedDict()  # events of subscriptions that are not known yet
        self._specs = {}
        self._has_table = False
        self._lost = None  # why there is no connection
        self._closing = ""  # the reason that the server gave
        self._is_served = False
        self._has_spoken = False
        self._longest = _LONGEST_LINE

    # messages

    def _line(self, message):
        try:
            text = json.dumps(message, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
            line = text.encode("utf-8") + b"\n"
        except UnicodeEncodeError:
            raise _usage("a text holds half a character, which is no Unicode.") from None
        except (ValueError, RecursionError, TypeError) as e:
            raise _usage(f"the arguments cannot be sent: {_why(e)}.") from None
        if len(line) - 1 > self._longest:
            raise _usage(f"the request takes {len(line) / (1 << 20):.1f} MiB, and the server reads "
                         f"{self._longest / (1 << 20):g} at once.", "Send it in parts.")
        return line

    def _request(self, method, params, flags=None):
        message = {"jsonrpc": "2.0", "id": next(self._ids), "method": method}
        if params:
            message["params"] = self._sendable(params)
        message["arrays"] = "base64"
        if flags:
            message.update(flags)
        return message["id"], message

    def _cancel_line(self, request):
        return self._line({"jsonrpc": "2.0", "method": "rpc.cancel", "params": {"request": request}})

    def _hello_message(self):
        params = {"protocol": PROTOCOL, "client": self._client}
        if self._token is not None:
            params["token"] = str(self._token)
        id_, message = self._request("server.hello", params)
        del message["arrays"]
        return id_, message

    def _take_hello(self, result):
        if not isinstance(result, dict) or result.get("program") != "robomosp":
            raise ProtocolError(f"{self.address} is not a ROBOMOSP server.", "unsupported")
        if result.get("protocol") != PROTOCOL:
            raise ProtocolError(f"{self.address} speaks version {_short(result.get('protocol'))} of the "
                                f"protocol, and this client version {PROTOCOL}.", "unsupported")
        # Handles keep their meaning for as long as the program over there runs.
        before, after = self.hello.get("instance"), result.get("instance")
        if self.hello and (after is None or before != after):
            self._forget()
        self.hello = result
        limits = result.get("limits")
        line = limits.get("line") if isinstance(limits, dict) else None
        self._longest = line if isinstance(line, int) and line > 0 else _LONGEST_LINE
        self._is_served = True

    def _forget(self):
        self._generation += 1
        self._specs, self._has_table = {}, False
        self._jobs.clear()

    def _hello_failed(self, e):
        """What is raised when the first request got an error."""
        if isinstance(e, ConnectionLost):
            return e
        if e.number == -32601 or e.code == "unknown_name":
            return ProtocolError(f"{self.address} is not a ROBOMOSP server: {e}", "unsupported")
        kind = ProtocolError if e.code == "unsupported" else Error
        return kind(f"{self.address}: {e}", e.code, e.where, e.hint, e.number, e.data)

    def _hello_late(self, seconds):
        return Timeout(f"{self.address} did not answer within {seconds:g} s. Is it a ROBOMOSP server?",
                       "io", hint="Is it a ROBOMOSP server?")

    def _parse(self, line):
        """The message of a line; ProtocolError when it is none."""
        try:
            return json.loads(line.decode("utf-8"), object_hook=self._object, parse_constant=_no_constant)
        except RecursionError:
            why = "is nested too deeply"
        except (ValueError, UnicodeDecodeError):  # what json raises, huge numbers too
            why = "is not JSON: " + _shown(line)
            if not self._has_spoken and line[:2] == b"\x15\x03":
                raise ProtocolError(f"{self.address} speaks TLS. Connect with tls=True, or with the server's "
                                    "certificate.", "unsupported") from None
        except _Malformed as e:
            why = str(e)
        if not self._has_spoken and "JSON" in why:
            raise ProtocolError(f"{self.address} is not a ROBOMOSP server: it answered {_shown(line)}.",
                                "unsupported") from None
        raise ProtocolError(f"{self.address} sent an answer that {why}.", "unsupported") from None

    def _take(self, line):
        """Hands what a line holds to whom it belongs."""
        line = line.strip()
        if not line:
            return
        message = self._parse(line)
        self._has_spoken = True
        for one in message if isinstance(message, list) else [message]:
            if not isinstance(one, dict):
                raise ProtocolError(f"{self.address} sent what is no answer: {_shown(line)}.", "unsupported")
            if "method" in one and "id" in one:
                raise ProtocolError(f"{self.address} is not a ROBOMOSP server: it sends requests itself.",
                                    "unsupported")
            if "method" in one:
                self._take_notification(one)
            else:
                self._take_answer(one, line)

    def _take_answer(self, one, line):
        id_ = one.get("id")
        fault = one.get("error")
        if "error" in one and not isinstance(fault, dict) or "error" not in one and "result" not in one:
            raise ProtocolError(f"{self.address} sent what is no answer: {_shown(line)}.", "unsupported")
        outcome = (None, _error_of(fault)) if isinstance(fault, dict) else (one["result"], None)
        if id_ is None and fault:  # it could not read which request it was
            if len(self._pending) != 1:
                raise ProtocolError(f"{self.address}: {outcome[1]}", "unsupported")
            id_ = next(iter(self._pending))
        slot = self._pending.pop(id_, None) if isinstance(id_, (int, str)) else None
        if slot is not None:  # else nobody waits for it any more
            self._settle(slot, outcome)

    def _take_notification(self, one):
        method, params = one.get("method"), one.get("params")
        if not isinstance(params, dict):
            return
        if method == "job.progress":
            job = params.get("id")
            if isinstance(job, Handle):
                self._jobs[job.number] = params
                self._jobs.move_to_end(job.number)
                while len(self._jobs) > 10_000:
                    self._jobs.popitem(last=False)
                self._wake()
        elif method == "event":
            number = params.get("subscription")
            target = self._subscriptions.get(number)
            if target is not None:
                target._add(params)
            elif isinstance(number, int):
                waiting = self._early.setdefault(number, collections.deque(maxlen=1000))
                waiting.append(params)
                while len(self._early) > 100:
                    self._early.popitem(last=False)
            self._wake()
        elif method == "server.closing":
            reason = params.get("reason")
            self._closing = reason.strip() if isinstance(reason, str) else ""

    def _end_of_input(self, lines, status=None):
        """Why the connection is over."""
        if self._closing:
            return ConnectionLost(f"{self.address} closed the connection: {self._closing}", "io",
                                  hint=self._closing)
        if lines.size:
            if not self._has_spoken:
                return ProtocolError(f"{self.address} is not a ROBOMOSP server: it answered "
                                     f"{_shown(lines.start())}.", "unsupported")
            return ConnectionLost(f"{self.address} closed the connection in the middle of an answer, of which "
                                  f"{lines.size} bytes came.", "io")
        if status is not None:
            return ConnectionLost(f"The program {self.address} has ended with status {status}.", "io")
        if not self._has_spoken:
            return ConnectionLost(f"{self.address} closed the connection without an answer. "
                                  "Is it a ROBOMOSP server?", "io")
        return ConnectionLost(f"{self.address} closed the connection.", "io")

    # values

    def _sendable(self, v, depth=0):
        if v is None or isinstance(v, (bool, int, str)):
            return v
        if isinstance(v, float):
            return float(v) if v - v == 0 else "nan" if v != v else "inf" if v > 0 else "-inf"
        if depth > 60:
            raise _usage("the arguments are nested too deeply.")
        if isinstance(v, Handle):
            if v._owner is not self:
                raise _usage(f"{v} is of another connection.", "Get it by name through this one.")
            if v._generation != self._generation:
                raise Error(f"{v} is of a program that has ended. Get it again by name.", "stale_handle",
                            hint="Get it again by name.")
            out = {"kind": v.kind, "number": v.number}
            if v.name:
                out["name"] = v.name
            return {"$handle": out}
        if isinstance(v, dict):
            for key in v:
                if not isinstance(key, str):
                    raise _usage(f"the key {key!r} of a table is not a text.")
            return {key: self._sendable(x, depth + 1) for key, x in v.items()}
        if isinstance(v, (list, tuple)):
            if len(v) >= 8:
                packed = _packed_list(v)
                if packed:
                    return packed
            return [self._sendable(x, depth + 1) for x in v]
        if isinstance(v, _array.array):
            if v.typecode == "u":
                return v.tounicode()
            return _packed([len(v)], _doubles(v)) if len(v) >= _FEW else self._sendable(v.tolist(), depth)
        if hasattr(v, "__array__") and hasattr(v, "dtype"):  # of NumPy, or like it
            return self._sendable_array(v, depth)
        if isinstance(v, os.PathLike):
            return os.fspath(v)
        if hasattr(v, "__index__"):
            return int(v)
        if hasattr(v, "__float__") and not isinstance(v, complex):
            return self._sendable(float(v), depth)
        if isinstance(v, (range, collections.abc.Iterator, collections.abc.KeysView, collections.abc.ValuesView)):
            return self._sendable(list(v), depth)
        raise _usage(f"a {type(v).__name__} cannot be sent.", "Give numbers, texts, lists, tables or handles.")

    def _sendable_array(self, v, depth):
        kind = v.dtype.kind
        if getattr(v, "ndim", 0) == 0:
            return self._sendable(v.item(), depth)
        if kind not in "fiu" or v.ndim > 2 or v.size < _FEW:
            if kind not in "fiubUO":
                raise _usage(f"an array of {v.dtype} cannot be sent.", "Give one of real numbers.")
            if v.ndim > 2:
                return [self._sendable_array(x, depth + 1) for x in v]
            return [self._sendable(x, depth + 1) for x in v.tolist()]
        return _packed(list(v.shape), v.astype("<f8").tobytes())

    def _object(self, table):
        """Called by json for each object of an answer."""
        if len(table) == 1:
            if "$handle" in table:
                return self._handle(table["$handle"])
            if "$array" in table:
                return self._array(table["$array"])
        return Result(table)

    def _handle(self, h):
        kind, number = (h.get("kind"), h.get("number")) if isinstance(h, dict) else (None, None)
        if not isinstance(kind, str) or not isinstance(number, int):
            raise _Malformed("holds a handle that is none")
        name = h.get("name")
        made = self._job_type if kind == "job" else Handle
        return made(self, kind, number, name if isinstance(name, str) else "")

    def _array(self, a):
        shape, text = (a.get("shape"), a.get("base64")) if isinstance(a, dict) else (None, None)
        if (not isinstance(shape, list) or len(shape) not in (1, 2) or not isinstance(text, str) or
                not all(type(n) is int and n >= 0 for n in shape)):
            raise _Malformed("holds an array that is none")
        try:
            raw = base64.b64decode(text, validate=True)
        except (ValueError, binascii.Error):
            raise _Malformed("holds an array that is not base64") from None
        count = shape[0] * (shape[1] if len(shape) == 2 else 1)
        if len(raw) != 8 * count:
            raise _Malformed("holds an array of another shape than it says")
        if self._numpy is not None:
            return self._numpy.frombuffer(raw, "<f8").astype(float).reshape(shape)
        numbers = _array.array("d", raw)
        if sys.byteorder != "little":
            numbers.byteswap()
        numbers = numbers.tolist()
        if len(shape) == 1:
            return numbers
        return [numbers[i * shape[1]:(i + 1) * shape[1]] for i in range(shape[0])]

    # commands

    def __getattr__(self, name):
        return Topic(self, _attribute(self, name))

    def __dir__(self):
        topics = {_python_name(n.partition(".")[0]) for n in self._all_names()}
        return sorted(set(super().__dir__()) | topics)

    def _all_names(self):
        self._load_table_now()
        return list(self._specs) if self._has_table else []

    def _names_below(self, topic, only_methods):
        names = []
        for full in self._all_names():
            spec = self._specs[full]
            if spec and full.startswith(topic + "."):
                params = spec.get("params") or [{}]
                if not only_methods or params[0].get("name") == "id":
                    names.append(_python_name(full[len(topic) + 1:]))
        return names

    def _keep_specs(self, specs, whole):
        for spec in specs if isinstance(specs, list) else []:
            if isinstance(spec, dict) and isinstance(spec.get("name"), str):
                self._specs[spec["name"]] = spec
        self._has_table = self._has_table or whole

    def _arguments(self, name, bound, args, kwargs, spec):
        """The params of a call; `spec` is needed where there are both kinds of arguments."""
        given = {_plain_name(k): v for k, v in kwargs.items()}
        places = ([bound] if bound is not None else []) + list(args)
        if not given:
            return places
        if bound is not None and not args:
            return {"id": bound, **given}
        if places:
            names = [p["name"] for p in (spec or {}).get("params", [])]
            if len(places) > len(names):
                raise _usage(f"{name} takes {len(names)} arguments.")
            for key, value in zip(names, places):
                if key in given:
                    raise _usage(f"{name}: {key} is given twice.")
                given[key] = value
        return given

    def _finished(self, name, result, spec):
        """What a caller gets."""
        if spec is not None:
            result = _with_numbers(result, spec.get("returns") or {})
        if isinstance(result, list):
            return _tables(result)
        if isinstance(result, dict):
            if name.endswith(".picture") and isinstance(result.get("png"), str):
                return Picture(self._bytes_of(result["png"]), result)
            for key, value in result.items():
                if isinstance(value, list):
                    result[key] = _tables(value)
        return result

    def _bytes_of(self, text):
        try:
            return base64.b64decode(text, validate=True)
        except (ValueError, TypeError):
            raise ProtocolError(f"{self.address} sent bytes that are not base64.", "unsupported") from None

    def _file_part(self, part, name):
        if not isinstance(part, dict) or not isinstance(part.get("base64"), str):
            raise ProtocolError(f"{self.address} sent no bytes of {name}.", "unsupported")
        return self._bytes_of(part["base64"])

    def _late(self, method, seconds):
        return Timeout(f"{method} was not answered within {seconds:g} s; it was cancelled.", "cancelled",
                       where=method, hint="Give it more time (_timeout), or start it as a job.")

    def _keep_subscription(self, subscription):
        self._subscriptions[subscription._number] = subscription
        for event in self._early.pop(subscription._number, ()):
            subscription._add(event)

    def _take_up(self, subscription, number):
        """A subscription goes on under another number."""
        subscription._number = number.get("subscription") if isinstance(number, dict) else number
        self._keep_subscription(subscription)

    def _interrupt_subscriptions(self, is_own_wish):
        """The connection is over; they wait for the next one, unless it was meant."""
        self._interrupted += self._subscriptions.values()
        self._subscriptions.clear()
        self._early.clear()
        if is_own_wish and not self._is_reconnecting:
            for subscription in self._interrupted:
                subscription.is_open = False
            self._interrupted = []

    def _lost_subscriptions(self):
        """Those of the connection before that nobody closed."""
        lost, self._interrupted = self._interrupted, []
        return [s for s in lost if s.is_open]

    def _event_options(self, topics, options):
        out = {_plain_name(k): v for k, v in options.items()}
        if topics:
            out["topics"] = list(topics)
        return out

    def __repr__(self):
        return f"<ROBOMOSP at {self.address}{'' if self._lost is None else ', closed'}>"


class _Malformed(Exception):
    pass


def _no_constant(word):
    raise ValueError(word)


def _tables(values):
    return Table(values) if values and all(isinstance(v, dict) for v in values) else values


def _check_seconds(seconds):
    if seconds is not None and not (isinstance(seconds, (int, float)) and seconds >= 0):
        raise _usage(f"{seconds!r} is not a time.", "Give seconds.")
    return seconds


# --- the blocking connection ---


class _Slot:
    """Where a thread waits for its answer."""

    __slots__ = ("done", "outcome")

    def __init__(self):
        self.done = threading.Event()
        self.outcome = None


class Job(Handle):
    """Long work. job.wait() gives what its command returns; job.cancel() stops it."""

    __slots__ = ()

    @property
    def latest(self):
        """What was said last of it: state, fraction, what; None before anything was."""
        return self._owner._jobs.get(self.number)

    def progress(self):
        """Asks for state, fraction (0 to 1) and what it does now."""
        return self._owner.call("job.progress", {"id": self})

    def cancel(self):
        """Stops it; the document is as before."""
        return self._owner.call("job.cancel", {"id": self})

    def wait(self, timeout=None, on_progress=None):
        """Waits for its end and gives what its command returns, or raises its error.

        timeout [s]: Timeout after that; the job goes on. on_progress(status) is called with what is
        said meanwhile. Ctrl-C ends the wait and not the job.
        """
        return self._owner._wait_job(self, timeout, on_progress)

    result = wait

    def updates(self):
        """What is said of it until its end: for status in job.updates()."""
        seen = None
        while True:
            with self._owner._changed:
                while self.latest is seen:
                    if self._owner._lost is not None:
                        raise self._owner._again_lost()
                    self._owner._changed.wait()
                seen = self.latest
            yield seen
            if seen.get("state") not in ("waiting", "running"):
                return


class Subscription:
    """What happens, event by event: for event in subscription. Close it, or use it in `with`."""

    def __init__(self, owner, number, is_pushed, params):
        self._owner = owner
        self._number = number
        self._is_pushed = is_pushed
        self._params = params  # to subscribe again after a reconnect
        self._events = collections.deque()
        self._left_out = 0
        self.is_open = True

    def _add(self, event):
        if len(self._events) >= _MOST_EVENTS:
            self._events.popleft()
            self._left_out += 1
        self._events.append(event)

    def _pop(self):
        event = self._events.popleft()
        if self._left_out:
            event["left_out"] = event.get("left_out", 0) + self._left_out
            self._left_out = 0
        return event

    def get(self, timeout=None):
        """The next event; None when none came within `timeout` [s] or after close()."""
        end = None if _check_seconds(timeout) is None else time.monotonic() + timeout
        while self.is_open:
            if self._events:
                return self._pop()
            left = None if end is None else end - time.monotonic()
            if left is not None and left < 0:
                return None
            if self._is_pushed:
                with self._owner._changed:
                    if not self._events and self.is_open:
                        if self._owner._lost is not None:
                            raise self._owner._again_lost()
                        self._owner._changed.wait(left if left is None else max(left, 0))
            else:
                self._fetch()
                if not self._events:
                    if left is not None and left <= 0:
                        return None
                    time.sleep(0.05 if left is None else min(0.05, left))
        return None

    def _fetch(self):
        for event in self._owner.call("event.take", {"subscription": self._number}) or []:
            self._add(event)

    def take(self):
        """All events that wait, without waiting."""
        if not self._is_pushed and self.is_open:
            self._fetch()
        out = []
        while self._events:
            out.append(self._pop())
        return Table(out)

    def close(self):
        """Ends the subscription; whoever waits in it goes on."""
        if not self.is_open:
            return
        self.is_open = False
        self._owner._subscriptions.pop(self._number, None)
        self._owner._wake()
        try:
            self._owner.call("server.unsubscribe" if self._is_pushed else "event.unsubscribe",
                             {"subscription": self._number}, timeout=5)
        except Error:
            pass

    def __iter__(self):
        return self

    def __next__(self):
        event = self.get()
        if event is None:
            raise StopIteration
        return event

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _read_all(transport, owner, is_current):
    """The thread that reads, for as long as somebody holds the connection."""
    lines, why = _Lines(), None
    while True:
        chunk = transport.read()
        connection = owner()
        if connection is None:
            transport.close()
            transport.end_reading()
            return
        try:
            if not chunk:
                status = transport.process.poll() if isinstance(transport, _Child) else None
                if isinstance(transport, _Child) and status is None:
                    try:
                        status = transport.process.wait(1)
                    except subprocess.TimeoutExpired:
                        pass
                why = connection._end_of_input(lines, status)
            else:
                for line in lines.feed(chunk):
                    connection._take(line)
        except ProtocolError as e:
            why = e
        except Exception as e:  # a fault of this file: said, and no thread dies silently
            why = ProtocolError(f"{connection.address}: an answer could not be read: {e!r}", "internal")
        if why is not None:
            connection._over(why, is_current)
            transport.close()
            transport.end_reading()
            return
        del connection


def _write_all(transport, lines):
    """The thread that writes: an interrupt of the main thread never cuts a line."""
    while True:
        line = lines.get()
        if line is None:
            return
        try:
            transport.write(line)
        except (OSError, ValueError):
            transport.close()  # the reader finds out why
            return


class Connection(_Base):
    """A program of ROBOMOSP, by connect() or start(). Every command is a method: r.robot.fk(...).

    r.call("robot.fk", {...}) calls by name. r.timeout [s] is for all calls that give none themselves.
    """

    _job_type = Job

    def __init__(self, address, opener, numpy, token, client, timeout):
        self._begin(address, numpy, token, client)
        self._opener = opener
        self._connect_timeout = _check_seconds(timeout)
        self._lock = threading.Lock()
        self._changed = threading.Condition()
        self._lost = ConnectionLost(f"{address} is not connected.", "io")
        self._open()

    # the way to the program

    def _open(self):
        transport = self._opener(self._connect_timeout)
        self._transport = transport
        self._outgoing = queue.SimpleQueue()
        self._lost, self._closing, self._has_spoken, self._is_served = None, "", False, False
        current = object()
        self._current = current
        name = f"robomosp {self.address}"
        threading.Thread(target=_read_all, args=(transport, weakref.ref(self), current), name=name,
                         daemon=True).start()
        threading.Thread(target=_write_all, args=(transport, self._outgoing), name=name, daemon=True).start()
        self._finalizer = weakref.finalize(self, _shut, transport, self._outgoing)
        if isinstance(transport, _Child):
            self._longest = _LONGEST_LINE
            try:
                about = self.call("version", timeout=self._connect_timeout)
            except Error as e:
                self.close()
                raise (self._hello_late(self._connect_timeout) if isinstance(e, Timeout)
                       else self._hello_failed(e)) from None
            except BaseException:
                self.close()
                raise
            if not isinstance(about, dict) or "version" not in about:
                self.close()
                raise ProtocolError(f"{self.address} is not ROBOMOSP.", "unsupported")
            return
        id_, message = self._hello_message()
        try:
            result, fault = self._exchange({id_: message}, "server.hello", self._connect_timeout)[0]
            if fault is not None:
                raise fault
            self._take_hello(result)
        except Timeout:
            self.close()
            raise self._hello_late(self._connect_timeout) from None
        except Error as e:
            self.close()
            raise self._hello_failed(e) from None
        except BaseException:
            self.close()
            raise

    def reconnect(self, wait=0):
        """Connects again, after the connection was lost or to begin anew.

        wait [s]: tries for so long while nobody answers there. Handles keep their meaning when the
        program over there is still the same; those of a program that has ended are refused.
        Subscriptions go on, without what happened meanwhile; jobs' notices end.
        """
        self._is_reconnecting = True  # so that subscriptions stay
        try:
            self._reconnect(time.monotonic() + (_check_seconds(wait) or 0))
        finally:
            self._is_reconnecting = False
        self._wake()
        return self

    def _reconnect(self, end):
        self.close()
        if isinstance(self._transport, _Child):
            self._forget()
            self.hello = {}
        while True:
            try:
                self._open()
                break
            except ConnectionLost as e:
                if e.code != "io" or time.monotonic() >= end:
                    raise
                time.sleep(0.1)
        lost = self._lost_subscriptions()
        while lost:
            try:
                number = self.call("server.subscribe" if lost[0]._is_pushed else "event.subscribe",
                                   lost[0]._params, timeout=self._connect_timeout)
            except Error:
                self._interrupted += lost  # of the next attempt
                raise
            self._take_up(lost.pop(0), number)

    def close(self):
        """Ends the connection; a child process ends with it."""
        self._over(ConnectionLost(f"The connection to {self.address} is closed.", "io",
                                  hint="Call reconnect()."), self._current, True)
        self._finalizer()

    @property
    def is_open(self):
        """Whether there is a connection."""
        return self._lost is None

    def _over(self, why, current, is_own_wish=False):
        if current is not self._current:
            return  # of a connection before
        with self._lock:
            if self._lost is None:
                self._lost = why
            waiting = list(self._pending.values())
            self._pending.clear()
        for slot in waiting:
            self._settle(slot, (None, self._again_lost()))
        self._interrupt_subscriptions(is_own_wish)
        self._wake()

    def _again_lost(self):
        lost = self._lost
        return type(lost)(lost.message, lost.code, lost.where, lost.hint)

    def _settle(self, slot, outcome):
        slot.outcome = outcome
        slot.done.set()

    def _wake(self):
        with self._changed:
            self._changed.notify_all()

    def _post(self, line):
        self._outgoing.put(line)

    def _begin_exchange(self, messages, is_batch=False):
        line = self._line(list(messages.values()) if is_batch else next(iter(messages.values())))
        slots = {id_: _Slot() for id_ in messages}
        with self._lock:
            if self._lost is not None:
                raise self._again_lost()
            self._pending.update(slots)
        self._post(line)
        return slots

    def _exchange(self, messages, method, timeout, is_batch=False):
        """[(result, error), ...] of requests by id, in their order."""
        end = None if timeout is None else time.monotonic() + timeout
        slots = self._begin_exchange(messages, is_batch)
        try:
            for slot in slots.values():
                if not slot.done.wait(None if end is None else max(0, end - time.monotonic())):
                    raise self._late(method, timeout)
        except BaseException as e:
            # Ctrl-C too: what runs over there ends, and the connection is good for the next call.
            for id_, slot in slots.items():
                if not slot.done.is_set():
                    self._post(self._cancel_line(id_))
            if isinstance(e, KeyboardInterrupt):
                for slot in slots.values():
                    slot.done.wait(5)
            raise
        finally:
            with self._lock:
                for id_ in slots:
                    self._pending.pop(id_, None)
        return [slot.outcome for slot in slots.values()]

    # calls

    def call(self, method, params=None, timeout=_DEFAULT):
        """Calls a command by its name: r.call("robot.fk", {"id": "pa10", "q": [0] * 7})."""
        return self._call(method, params, self.timeout if timeout is _DEFAULT else timeout)

    def _call(self, method, params, timeout, flags=None):
        id_, message = self._request(method, params, flags)
        result, fault = self._exchange({id_: message}, method, _check_seconds(timeout))[0]
        if fault is not None:
            raise fault
        spec = self._spec_now(method) if _has_number_words(result) else None
        return self._finished(method, result, spec)

    def _invoke(self, name, bound, args, kwargs, as_job=False):
        timeout = kwargs.pop("_timeout", self.timeout)
        spec = self._spec_now(name, True) if args and kwargs else None
        flags = {"job": True, "progress": True} if as_job else None
        return self._call(name, self._arguments(name, bound, args, kwargs, spec), timeout, flags)

    def _invoke_topic(self, name, args, kwargs):
        if self._spec_now(name, True) is None:
            name += ".get"
        return self._invoke(name, None, args, kwargs)

    def batch(self, calls, timeout=_DEFAULT):
        """Several calls in one message: r.batch([("robot.dof", {"id": "pa10"}), ...]).

        Returns a list of results; where one failed, its Error stands in the list.
        """
        messages, methods = {}, []
        for method, *params in calls:
            id_, message = self._request(method, params[0] if params else None)
            messages[id_] = message
            methods.append(method)
        if not messages:
            return []
        seconds = self.timeout if timeout is _DEFAULT else timeout
        outcomes = self._exchange(messages, "the batch", _check_seconds(seconds), True)
        return [fault if fault is not None else self._finished(
            method, result, self._spec_now(method) if _has_number_words(result) else None)
            for method, (result, fault) in zip(methods, outcomes)]

    def lua(self, code, timeout=_DEFAULT):
        """Runs a script over there; prints what it prints and returns what it returns."""
        out = self.call("lua.eval", {"code": code}, timeout)
        if out.get("output"):
            print(out["output"], end="")
        return out.get("values", out.get("value"))

    def classic(self, line, timeout=_DEFAULT):
        """A line of the program of 2006: r.classic("PRobot puma560 GetDOF")."""
        return self.call("ioci.classic", {"line": line}, timeout)

    # jobs and events

    def _wait_job(self, job, timeout, on_progress):
        end = None if _check_seconds(timeout) is None else time.monotonic() + timeout
        id_, message = self._request("job.wait", {"id": job})
        slot = self._begin_exchange({id_: message})[id_]
        seen = None
        try:
            while not slot.done.is_set():
                left = None if end is None else end - time.monotonic()
                if left is not None and left <= 0:
                    raise Timeout(f"{job} did not end within {timeout:g} s; it goes on.", "cancelled",
                                  where="job.wait")
                if on_progress is None:
                    slot.done.wait(left)
                    continue
                slot.done.wait(0.05 if left is None else min(left, 0.05))
                status = job.latest
                if status is not None and status is not seen:
                    seen = status
                    on_progress(status)
        finally:
            with self._lock:
                self._pending.pop(id_, None)
        if on_progress is not None and job.latest not in (None, seen):
            on_progress(job.latest)
        result, fault = slot.outcome
        if fault is not None:
            raise fault
        return self._finished(job.name, result, self._spec_now(job.name) if _has_number_words(result) else None)

    def events(self, *topics, **options):
        """A subscription to what happens: topics "change", "message", "job", "run", "recording"; all without any.

        Options are those of event.subscribe (kinds, records, own, rate [1/s], ...); on servers also rows:
        True, or names of columns whose new rows events of "run" bring.
        """
        return self._subscribe(topics, options)

    def _subscribe(self, topics, options):
        if len(topics) == 1 and isinstance(topics[0], (list, tuple)):
            topics = topics[0]
        params = self._event_options(topics, options)
        is_pushed = self._is_served
        method = "server.subscribe" if is_pushed else "event.subscribe"
        number = self.call(method, params)
        if isinstance(number, dict):
            number = number.get("subscription")
        subscription = Subscription(self, number, is_pushed, params)
        self._keep_subscription(subscription)
        return subscription

    def on_event(self, callback, *topics, **options):
        """Calls callback(event) for what happens, on a thread of its own; returns the subscription."""
        subscription = self._subscribe(topics, options)

        def run():
            while subscription.is_open:
                try:
                    for event in subscription:
                        try:
                            callback(event)
                        except Exception:  # the next event comes all the same
                            sys.excepthook(*sys.exc_info())
                except ConnectionLost:  # which whoever calls is told; after reconnect() it goes on
                    with self._changed:
                        self._changed.wait_for(lambda: self._lost is None or not subscription.is_open)
                except Error:
                    return

        threading.Thread(target=run, name="robomosp events", daemon=True).start()
        return subscription

    # pictures and files

    def picture(self, what, **options):
        """A picture of a world, robot, object, solid or material; options as of view.picture."""
        return self._invoke("view.picture", None, (), {"what": what, **options})

    def plot(self, what, **options):
        """A plot of a recording or trajectory; options as of its plot. as_="png" makes a Picture."""
        kind = what.kind if isinstance(what, Handle) else "recording"
        form = options.pop("as_", "svg")
        made = self._invoke(kind + ".plot", None, (), {"id": what, "as": form, **options})
        return Plot(made) if form == "svg" else Picture(self._bytes_of(made)) if form == "png" else made

    def read_file(self, name):
        """The bytes of a file over there, where this connection may read files."""
        out = []
        offset = 0
        while True:
            part = self.call("file.read", {"file": name, "offset": offset, "length": _CHUNK})
            out.append(self._file_part(part, name))
            offset += len(out[-1])
            if part.get("is_end") or not out[-1]:
                return b"".join(out)

    def write_file(self, name, data):
        """Writes bytes to a file over there, where this connection may write files."""
        data = bytes(data)
        for offset in range(0, max(len(data), 1), _CHUNK):
            text = base64.b64encode(data[offset:offset + _CHUNK]).decode("ascii")
            self.call("file.write", {"file": name, "base64": text, "append": offset > 0})

    # what is known of the commands

    def refresh(self):
        """Forgets what is known of the commands, after plugins have added some."""
        self._specs, self._has_table = {}, False

    def _spec_now(self, name, needed=False):
        if name not in self._specs and not self._has_table:
            try:
                id_, message = self._request("ioci.describe", {"command": name})
                result, fault = self._exchange({id_: message}, "ioci.describe", self.timeout or 10)[0]
                if fault is not None and isinstance(fault, ConnectionLost):
                    raise fault
                self._keep_specs(result, False)
                self._specs.setdefault(name, None)
            except Error:
                if needed:
                    raise
                return None
        return self._specs.get(name)

    def _load_table_now(self):
        if self._has_table or self._lost is not None:
            return
        try:
            id_, message = self._request("ioci.describe", None)
            self._keep_specs(self._exchange({id_: message}, "ioci.describe", 10)[0][0], True)
        except Error:
            pass

    def _described(self, handle):
        try:
            about = self._call(handle.kind + (".progress" if handle.kind == "job" else ".describe"),
                               {"id": handle}, 5)
        except Error:
            return None
        return about if isinstance(about, Result) else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _shut(transport, outgoing):
    outgoing.put(None)
    transport.close()


def _connect_socket(address, timeout):
    try:
        if address.path:
            if not hasattr(socket, "AF_UNIX"):
                raise _usage("this system has no Unix sockets.", "Connect by TCP.")
            sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            try:
                sock.settimeout(timeout)
                sock.connect(address.path)
            except BaseException:
                sock.close()
                raise
            return sock
        sock = socket.create_connection((address.host, address.port), timeout)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return sock
    except (OSError, UnicodeError, ValueError) as e:
        late = isinstance(e, (socket.timeout, TimeoutError))
        raise address.refused(f"no answer within {timeout:g} s" if late else _why(e)) from None


def _open_socket(address, tls, timeout):
    context, own = _tls_context(tls, address)
    if context is None:
        return _Socket(_connect_socket(address, timeout))

    def shake(by_name):
        sock = _connect_socket(address, timeout)
        try:
            context.check_hostname = by_name
            return context.wrap_socket(sock, server_hostname=address.host)
        except (OSError, ValueError) as e:
            sock.close()
            if isinstance(e, (socket.timeout, TimeoutError)):
                raise address.refused(f"no answer within {timeout:g} s") from None
            raise _tls_failure(address, e) from None

    if own is None:
        sock = _connect_socket(address, timeout)
        try:
            return _TlsSocket(context.wrap_socket(sock, server_hostname=address.host))
        except (OSError, ValueError) as e:
            sock.close()
            raise _tls_failure(address, e) from None
    made = shake(False)
    if made.getpeercert(True) not in own:  # signed by one of them: then its name counts
        made.close()
        made = shake(True)
    return _TlsSocket(made)


def connect(address=f"127.0.0.1:{DEFAULT_PORT}", token=None, tls=None, timeout=10.0, numpy=None,
            client="robomosp.py " + __version__):
    """Connects to a program that serves (`robomosp serve`).

    address: "127.0.0.1:7007", "host:port", "[::1]:7007" or "unix:/path".
    token: the secret of `server.grant`, where the server wants one.
    tls: None is on for other machines and off for this one; True or False; the server's certificate
        or that of its authority as a PEM file; or an ssl.SSLContext.
    timeout: of the connection and its first answer [s].
    numpy: arrays of answers as NumPy arrays; None = when it is installed.
    """
    at = _Address(address)
    return Connection(at.text, lambda seconds: _open_socket(at, tls, seconds), numpy, token, client, timeout)


def start(program=None, args=(), timeout=30.0, numpy=None):
    """Starts a program of its own (`robomosp rpc`) as a child process, which ends with the connection.

    program: the path of robomosp, or the whole command as a list; else ROBOMOSP_PROGRAM, or the search
        path. args: more arguments. timeout: until it answers [s].
    """
    command = _program(program) + [str(a) for a in args]

    def opener(_):
        try:
            child = _Child(command)
        except OSError as e:
            raise Error(f"{command[0]} cannot be started: {_why(e)}.", "io") from None
        atexit.register(_end_child, weakref.ref(child))
        return child

    return Connection(command[0], opener, numpy, None, "", timeout)


def _end_child(child):
    child = child()
    if child is not None:
        child.close()


# --- the same on asyncio ---


class AsyncJob(Handle):
    """Long work. await job.wait() gives what its command returns; await job.cancel() stops it."""

    __slots__ = ()

    latest = Job.latest

    def progress(self):
        """Asks for state, fraction (0 to 1) and what it does now."""
        return self._owner.call("job.progress", {"id": self})

    def cancel(self):
        """Stops it; the document is as before."""
        return self._owner.call("job.cancel", {"id": self})

    async def wait(self, timeout=None):
        """Waits for its end and gives what its command returns, or raises its error."""
        try:
            return await self._owner._call("job.wait", {"id": self}, timeout, is_wait=True)
        except Timeout:
            raise Timeout(f"{self} did not end within {timeout:g} s; it goes on.", "cancelled",
                          where="job.wait") from None

    result = wait

    async def updates(self):
        """What is said of it until its end: async for status in job.updates()."""
        seen = None
        while True:
            status = self.latest
            if status is not None and status is not seen:
                seen = status
                yield status
                if status.get("state") not in ("waiting", "running"):
                    return
            if self.latest is seen:
                await self._owner._next_change()


class AsyncSubscription:
    """What happens, event by event: async for event in subscription."""

    _add, _pop = Subscription._add, Subscription._pop

    def __init__(self, owner, number, is_pushed, params):
        Subscription.__init__(self, owner, number, is_pushed, params)

    async def get(self, timeout=None):
        """The next event; None when none came within `timeout` [s] or after close()."""
        end = None if _check_seconds(timeout) is None else time.monotonic() + timeout
        while self.is_open:
            if self._events:
                return self._pop()
            if self._owner._lost is not None:
                raise self._owner._again_lost()
            left = None if end is None else end - time.monotonic()
            if left is not None and left < 0:
                return None
            if self._is_pushed:
                await self._owner._next_change(left)
                continue
            for event in await self._owner.call("event.take", {"subscription": self._number}) or []:
                self._add(event)
            if not self._events:
                await asyncio.sleep(0.05 if left is None else max(0, min(0.05, left)))
        return None

    async def close(self):
        """Ends the subscription."""
        if not self.is_open:
            return
        self.is_open = False
        self._owner._subscriptions.pop(self._number, None)
        self._owner._wake()
        try:
            await self._owner.call("server.unsubscribe" if self._is_pushed else "event.unsubscribe",
                                   {"subscription": self._number}, timeout=5)
        except Error:
            pass

    def __aiter__(self):
        return self

    async def __anext__(self):
        event = await self.get()
        if event is None:
            raise StopAsyncIteration
        return event

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.close()


class AsyncConnection(_Base):
    """A program of ROBOMOSP on asyncio, by aconnect() or astart(): await r.robot.fk(...).

    Belongs to one loop. A call that is cancelled (task.cancel(), asyncio.wait_for) is cancelled over
    there, too. dir() and help() know the commands after `await r.load_commands()`.
    """

    _job_type = AsyncJob

    def __init__(self, address, opener, numpy, token, client, timeout):
        self._begin(address, numpy, token, client)
        self._opener = opener
        self._connect_timeout = _check_seconds(timeout)
        self._waiters = set()
        self._reader_task = self._writer = self._process = None

    async def _open(self):
        reader, self._writer, self._process = await self._opener(self._connect_timeout)
        self._lost, self._closing, self._has_spoken, self._is_served = None, "", False, False
        self._reader_task = asyncio.ensure_future(self._read_all(reader))
        try:
            if self._process is not None:
                self._longest = _LONGEST_LINE
                about = await self.call("version", timeout=self._connect_timeout)
                if not isinstance(about, dict) or "version" not in about:
                    raise ProtocolError(f"{self.address} is not ROBOMOSP.", "unsupported")
            else:
                id_, message = self._hello_message()
                result, fault = (await self._exchange({id_: message}, "server.hello", self._connect_timeout))[0]
                if fault is not None:
                    raise fault
                self._take_hello(result)
        except Timeout:
            await self.close()
            raise self._hello_late(self._connect_timeout) from None
        except Error as e:
            await self.close()
            raise self._hello_failed(e) from None
        except BaseException:
            await self.close()
            raise
        return self

    async def _read_all(self, reader):
        lines, why = _Lines(), None
        while why is None:
            try:
                chunk = await reader.read(1 << 16)
            except OSError:
                chunk = b""
            try:
                if not chunk:
                    status = None
                    if self._process is not None:
                        try:
                            status = await asyncio.wait_for(self._process.wait(), 1)
                        except asyncio.TimeoutError:
                            pass
                    why = self._end_of_input(lines, status)
                for line in lines.feed(chunk) if chunk else ():
                    self._take(line)
            except ProtocolError as e:
                why = e
        self._over(why)
        self._writer.close()

    async def reconnect(self, wait=0):
        """Connects again; see Connection.reconnect."""
        self._is_reconnecting = True
        try:
            await self._reconnect(time.monotonic() + (_check_seconds(wait) or 0))
        finally:
            self._is_reconnecting = False
        return self

    async def _reconnect(self, end):
        await self.close()
        if self._process is not None:
            self._forget()
            self.hello = {}
        while True:
            try:
                await self._open()
                break
            except ConnectionLost as e:
                if e.code != "io" or time.monotonic() >= end:
                    raise
                await asyncio.sleep(0.1)
        lost = self._lost_subscriptions()
        while lost:
            try:
                number = await self.call("server.subscribe" if lost[0]._is_pushed else "event.subscribe",
                                         lost[0]._params, timeout=self._connect_timeout)
            except Error:
                self._interrupted += lost
                raise
            self._take_up(lost.pop(0), number)

    async def close(self):
        """Ends the connection; a child process ends with it."""
        self._over(ConnectionLost(f"The connection to {self.address} is closed.", "io", hint="Call reconnect()."), True)
        task, self._reader_task = self._reader_task, None
        if task is not None and task is not asyncio.current_task():
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        if self._writer is not None:
            self._writer.close()
            try:
                await asyncio.wait_for(self._writer.wait_closed(), 1)
            except (asyncio.TimeoutError, OSError):
                pass
        if self._process is not None and self._process.returncode is None:
            for end in (lambda: None, self._process.terminate, self._process.kill):
                try:
                    end()
                    await asyncio.wait_for(self._process.wait(), 3)
                    break
                except (asyncio.TimeoutError, ProcessLookupError):
                    continue

    @property
    def is_open(self):
        """Whether there is a connection."""
        return self._lost is None

    _again_lost = Connection._again_lost
    refresh = Connection.refresh

    def _over(self, why, is_own_wish=False):
        if self._lost is None:
            self._lost = why
        waiting = list(self._pending.values())
        self._pending.clear()
        for slot in waiting:
            self._settle(slot, (None, self._again_lost()))
        self._interrupt_subscriptions(is_own_wish)
        self._wake()

    def _settle(self, slot, outcome):
        if not slot.done():
            slot.set_result(outcome)

    def _wake(self):
        waiters, self._waiters = self._waiters, set()
        for w in waiters:
            if not w.done():
                w.set_result(None)

    async def _next_change(self, timeout=None):
        if self._lost is not None:
            raise self._again_lost()
        waiter = asyncio.get_running_loop().create_future()
        self._waiters.add(waiter)
        try:
            await asyncio.wait([waiter], timeout=timeout)
        finally:
            self._waiters.discard(waiter)

    async def _exchange(self, messages, method, timeout, is_batch=False, is_wait=False):
        line = self._line(list(messages.values()) if is_batch else next(iter(messages.values())))
        if self._lost is not None:
            raise self._again_lost()
        loop = asyncio.get_running_loop()
        slots = {id_: loop.create_future() for id_ in messages}
        self._pending.update(slots)
        try:
            self._writer.write(line)
            done, late = await asyncio.wait(list(slots.values()), timeout=timeout)
            if late:
                raise self._late(method, timeout)
        except BaseException:
            if not is_wait and self._lost is None:
                for id_, slot in slots.items():
                    if not slot.done():
                        self._writer.write(self._cancel_line(id_))
            raise
        finally:
            for id_ in slots:
                self._pending.pop(id_, None)
        return [slot.result() for slot in slots.values()]

    async def call(self, method, params=None, timeout=_DEFAULT):
        """Calls a command by its name."""
        return await self._call(method, params, self.timeout if timeout is _DEFAULT else timeout)

    async def _call(self, method, params, timeout, flags=None, is_wait=False):
        id_, message = self._request(method, params, flags)
        result, fault = (await self._exchange({id_: message}, method, _check_seconds(timeout), False, is_wait))[0]
        if fault is not None:
            raise fault
        spec = await self._spec(method) if _has_number_words(result) else None
        return self._finished(method, result, spec)

    async def _invoke(self, name, bound, args, kwargs, as_job=False):
        timeout = kwargs.pop("_timeout", self.timeout)
        spec = await self._spec(name) if args and kwargs else None
        flags = {"job": True, "progress": True} if as_job else None
        return await self._call(name, self._arguments(name, bound, args, kwargs, spec), timeout, flags)

    async def _invoke_topic(self, name, args, kwargs):
        if await self._spec(name) is None:
            name += ".get"
        return await self._invoke(name, None, args, kwargs)

    async def batch(self, calls, timeout=_DEFAULT):
        """Several calls in one message; see Connection.batch."""
        messages, methods = {}, []
        for method, *params in calls:
            id_, message = self._request(method, params[0] if params else None)
            messages[id_] = message
            methods.append(method)
        if not messages:
            return []
        seconds = self.timeout if timeout is _DEFAULT else timeout
        outcomes = await self._exchange(messages, "the batch", _check_seconds(seconds), True)
        return [fault if fault is not None else self._finished(method, result, None)
                for method, (result, fault) in zip(methods, outcomes)]

    async def lua(self, code, timeout=_DEFAULT):
        """Runs a script over there; prints what it prints and returns what it returns."""
        out = await self.call("lua.eval", {"code": code}, timeout)
        if out.get("output"):
            print(out["output"], end="")
        return out.get("values", out.get("value"))

    async def classic(self, line, timeout=_DEFAULT):
        """A line of the program of 2006."""
        return await self.call("ioci.classic", {"line": line}, timeout)

    async def events(self, *topics, **options):
        """A subscription to what happens: async for event in await r.events("change")."""
        is_pushed = self._is_served
        params = self._event_options(topics, options)
        number = await self.call("server.subscribe" if is_pushed else "event.subscribe", params)
        if isinstance(number, dict):
            number = number.get("subscription")
        subscription = AsyncSubscription(self, number, is_pushed, params)
        self._keep_subscription(subscription)
        return subscription

    async def picture(self, what, **options):
        """A picture; see Connection.picture."""
        return await self._invoke("view.picture", None, (), {"what": what, **options})

    async def plot(self, what, **options):
        """A plot; see Connection.plot."""
        kind = what.kind if isinstance(what, Handle) else "recording"
        form = options.pop("as_", "svg")
        made = await self._invoke(kind + ".plot", None, (), {"id": what, "as": form, **options})
        return Plot(made) if form == "svg" else Picture(self._bytes_of(made)) if form == "png" else made

    async def read_file(self, name):
        """The bytes of a file over there, where this connection may read files."""
        out, offset = [], 0
        while True:
            part = await self.call("file.read", {"file": name, "offset": offset, "length": _CHUNK})
            out.append(self._file_part(part, name))
            offset += len(out[-1])
            if part.get("is_end") or not out[-1]:
                return b"".join(out)

    async def write_file(self, name, data):
        """Writes bytes to a file over there, where this connection may write files."""
        data = bytes(data)
        for offset in range(0, max(len(data), 1), _CHUNK):
            text = base64.b64encode(data[offset:offset + _CHUNK]).decode("ascii")
            await self.call("file.write", {"file": name, "base64": text, "append": offset > 0})

    async def load_commands(self):
        """Asks for what all commands are, so that dir() and help() show it."""
        id_, message = self._request("ioci.describe", None)
        result, fault = (await self._exchange({id_: message}, "ioci.describe", self.timeout))[0]
        if fault is not None:
            raise fault
        self._keep_specs(result, True)

    async def _spec(self, name):
        if name not in self._specs and not self._has_table:
            id_, message = self._request("ioci.describe", {"command": name})
            result, fault = (await self._exchange({id_: message}, "ioci.describe", self.timeout))[0]
            if isinstance(fault, ConnectionLost):
                raise fault
            self._keep_specs(result, False)
            self._specs.setdefault(name, None)
        return self._specs.get(name)

    def _spec_now(self, name, needed=False):
        return self._specs.get(name)

    def _load_table_now(self):
        pass

    def _described(self, handle):
        return None

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        await self.close()


class _Opening:
    """What aconnect() gives: await it, or use it in `async with`."""

    def __init__(self, connection):
        self._connection = connection

    def __await__(self):
        return self._connection._open().__await__()

    async def __aenter__(self):
        return await self._connection._open()

    async def __aexit__(self, *_):
        await self._connection.close()


def aconnect(address=f"127.0.0.1:{DEFAULT_PORT}", token=None, tls=None, timeout=10.0, numpy=None,
             client="robomosp.py " + __version__):
    """Connects to a program that serves, on asyncio; arguments as of connect()."""
    at = _Address(address)

    async def opener(seconds):
        context, own = _tls_context(tls, at)

        async def once(by_name):
            if context is None:
                made = (asyncio.open_unix_connection(at.path) if at.path
                        else asyncio.open_connection(at.host, at.port))
            else:
                if own is not None:
                    context.check_hostname = by_name
                made = asyncio.open_connection(at.host, at.port, ssl=context, server_hostname=at.host)
            try:
                return await asyncio.wait_for(made, seconds)
            except asyncio.TimeoutError:
                raise at.refused(f"no answer within {seconds:g} s") from None
            except ssl.SSLError as e:
                raise _tls_failure(at, e) from None
            except (OSError, UnicodeError, ValueError, AttributeError, NotImplementedError) as e:
                raise at.refused(_why(e)) from None

        reader, writer = await once(own is None)
        if own is not None and writer.get_extra_info("ssl_object").getpeercert(True) not in own:
            writer.close()
            reader, writer = await once(True)
        return reader, writer, None

    return _Opening(AsyncConnection(at.text, opener, numpy, token, client, timeout))


def astart(program=None, args=(), timeout=30.0, numpy=None):
    """Starts a program of its own (`robomosp rpc`), on asyncio; arguments as of start()."""
    command = _program(program) + [str(a) for a in args]

    async def opener(_):
        try:
            process = await asyncio.create_subprocess_exec(
                *command, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                start_new_session=os.name == "posix")
        except OSError as e:
            raise Error(f"{command[0]} cannot be started: {_why(e)}.", "io") from None
        return process.stdout, process.stdin, process

    return _Opening(AsyncConnection(command[0], opener, numpy, None, "", timeout))
