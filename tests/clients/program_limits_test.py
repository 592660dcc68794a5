#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How much editors and debuggers may send: breakpoints by the hundred thousand, messages of 10 MB,
changes of a whole file at once, nesting, numbers of all sizes, requests in any order, bytes of broken
clients; over the debug adapter, the language server and `robomosp rpc`. The processor's time grows with
what is sent, memory stays below a bound that is measured, every request has one answer, and what is
refused is refused in words.
ROBOMOSP_FUZZ_SECONDS makes the random ones longer, ROBOMOSP_TEST_SEED repeats them."""

import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from framed import end, frame, messages, start  # noqa: E402
from serving import PROGRAM  # noqa: E402

SEED = int(os.environ.get("ROBOMOSP_TEST_SEED", "1"))
FUZZ_SECONDS = float(os.environ.get("ROBOMOSP_FUZZ_SECONDS", "2"))
PATIENCE = 120
MEGABYTE = 1 << 20
# What one of these programs may take at most [bytes]; it takes 60 MB when it has started.
MOST_MEMORY = 1500 * MEGABYTE
LONG = "x" * (10 * MEGABYTE)
DEEP = b'{"seq":1,"type":"request","jsonrpc":"2.0","id":1,"command":"a","method":"a","arguments":' + \
    b"[" * 100000 + b"]" * 100000 + b"}"


def processor(process):
    """Seconds that a process has computed, with all its threads."""
    return time.clock_gettime((~process.pid << 3) | 2)


class Peer:
    """A program that answers; `lines` = one message a line, else behind heads."""

    def __init__(self, command, lines=False):
        self.lines = lines
        self.process = subprocess.Popen([PROGRAM, "-q", command], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) \
            if lines else start(command)
        if not lines:
            threading.Thread(target=self.process.stderr.read, daemon=True).start()
        self.number = 0
        self.answers, self.told, self.faults = {}, [], []
        self.changed = threading.Condition()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        stream = (json.loads(line) for line in self.process.stdout) if self.lines else \
            messages(self.process.stdout, self.faults)
        for m in stream:
            with self.changed:
                key = m.get("request_seq", m.get("id"))
                if m.get("type") == "event" or "method" in m or key is None:
                    self.told.append(m)
                elif key in self.answers:
                    self.faults.append("a second answer: %r" % key)
                else:
                    self.answers[key] = m
                self.changed.notify_all()
        with self.changed:
            self.answers["end"] = {}
            self.changed.notify_all()

    def send(self, message):
        if self.lines:
            message = (message if isinstance(message, bytes) else json.dumps(message).encode()) + b"\n"
        else:
            message = frame(message)
        self.process.stdin.write(message)
        self.process.stdin.flush()

    def begin(self, name, arguments):
        self.number += 1
        self.send({"seq": self.number, "type": "request", "command": name, "arguments": arguments}
                  if self.is_debugger else
                  {"jsonrpc": "2.0", "id": self.number, "method": name, "params": arguments})
        return self.number

    def end(self, number, seconds=PATIENCE):
        with self.changed:
            if not self.changed.wait_for(
                    lambda: number in self.answers or "end" in self.answers, seconds):
                raise AssertionError("no answer to %r" % number)
            if number not in self.answers:
                raise AssertionError("it has ended")
            return self.answers[number]

    def ask(self, name, arguments=None):
        return self.end(self.begin(name, arguments or {}))

    def wait(self, is_there, seconds=PATIENCE):
        with self.changed:
            found, looked = [], [0]

            def look():
                found.extend(m for m in self.told[looked[0]:] if is_there(m))
                looked[0] = len(self.told)
                return found or "end" in self.answers
            if not self.changed.wait_for(look, seconds) or not found:
                raise AssertionError("nothing of it was told; %r" % self.told[-3:])
            return found[-1]

    def close(self):
        """Its exit code, and the bytes that it has held at most."""
        self.process.stdin.close()
        end = time.time() + PATIENCE
        while True:
            pid, status, usage = os.wait4(self.process.pid, os.WNOHANG)
            if pid:
                break
            if time.time() > end:
                raise AssertionError("it does not end")
            time.sleep(0.005)
        self.process.returncode = os.waitstatus_to_exitcode(status)
        return self.process.returncode, usage.ru_maxrss << 10


class Adapter(Peer):
    is_debugger = True

    def __init__(self):
        super().__init__("debug-adapter")
        self.ask("initialize")

    def body(self, command, **arguments):
        m = self.ask(command, arguments)
        if not m["success"]:
            raise AssertionError("%s: %s" % (command, self.sentence(m)))
        return m.get("body", {})

    def refused(self, command, **arguments):
        m = self.ask(command, arguments)
        if m["success"]:
            raise AssertionError("%s is answered: %r" % (command, m))
        return self.sentence(m)

    @staticmethod
    def sentence(m):
        return m["body"]["error"]["variables"]["sentence"]

    def event(self, name):
        return self.wait(lambda m: m.get("event") == name)["body"]


class Server(Peer):
    is_debugger = False

    def __init__(self):
        super().__init__("language-server")
        self.ask("initialize", {"capabilities": {}})
        self.versions = {}

    def tell(self, method, params):
        self.send({"jsonrpc": "2.0", "method": method, "params": params})

    def open(self, uri, text):
        self.versions[uri] = 1
        self.tell("textDocument/didOpen", {"textDocument": {"uri": uri, "version": 1, "text": text}})

    def change(self, uri, changes):
        self.versions[uri] += 1
        self.tell("textDocument/didChange", {"textDocument": {
            "uri": uri, "version": self.versions[uri]}, "contentChanges": changes})

    def diagnostics(self, uri):
        return self.wait(lambda m: m.get("method") == "textDocument/publishDiagnostics" and
                         m["params"]["uri"] == uri and
                         m["params"].get("version") == self.versions[uri])["params"]["diagnostics"]

    def tokens(self, uri):
        return self.ask("textDocument/semanticTokens/full",
                        {"textDocument": {"uri": uri}})["result"]["data"]


class Commands(Peer):
    is_debugger = False

    def __init__(self):
        super().__init__("rpc", lines=True)

    def result(self, command, **arguments):
        m = self.ask(command, arguments)
        if "error" in m:
            raise AssertionError("%s: %r" % (command, m["error"]))
        return m["result"]


class Limits(unittest.TestCase):
    def setUp(self):
        self.peers = []
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        for p in self.peers:
            end(p.process)
        self.folder.cleanup()

    def peer(self, kind):
        self.peers.append(kind())
        return self.peers[-1]

    def done(self, peer, code, most=MOST_MEMORY):
        """It ends with this code, and has held at most so many bytes."""
        ended, held = peer.close()
        self.assertEqual(ended, code)
        self.assertLess(held, most)
        self.assertEqual(peer.faults, [])
        return held

    def write(self, name, text):
        path = os.path.join(self.folder.name, name)
        with open(path, "w", encoding="utf-8") as f:
            f.write(text)
        return path

    def spent(self, peer, work):
        """Seconds of its processor, and what `work` gives."""
        before = processor(peer.process)
        out = work()
        return processor(peer.process) - before, out

    def grows(self, name, spent):
        """(how many, seconds): ten times as many take about ten times as long."""
        print("%s: %s" % (name, ", ".join("%d in %.3f s" % one for one in spent)))
        (few, short), (many, long) = spent[-2:]
        self.assertLess(long, 2.5 * many / few * short + 0.3, name)


def lines_of(n):
    return "PROGRAM long;\nVAR\n  INT: i;\nBEGIN\n" + "".join(
        "  i := %d;\n" % k for k in range(n)) + "  WRITELN('end ', i);\nENDPROGRAM;\n"


class Breakpoints(Limits):
    def test_ten_thousand_and_a_hundred_thousand_in_one_source(self):
        setting, running, changing = [], [], []
        for n in (10, 1000, 10000, 100000):
            e = self.peer(Adapter)
            path = self.write("long.irl", lines_of(n))
            source = {"path": path}
            e.body("launch", program=path)
            # None of these holds, so that it comes to its end over all of them.
            wanted = [{"line": 5 + k, "condition": "i = -1"} for k in range(n)]
            took, body = self.spent(e, lambda: e.body("setBreakpoints", source=source,
                                                      breakpoints=wanted))
            setting.append((n, took))
            self.assertEqual([b["line"] for b in body["breakpoints"]], [b["line"] for b in wanted])
            self.assertTrue(all(b["verified"] for b in body["breakpoints"]))
            # All of them anew, but the last: that one stops.
            wanted[-1] = {"line": 4 + n}
            took, body = self.spent(e, lambda: e.body("setBreakpoints", source=source,
                                                      breakpoints=wanted))
            changing.append((n, took))

            def run():
                e.body("configurationDone")
                return e.event("stopped")
            took, stop = self.spent(e, run)
            running.append((n, took))
            self.assertEqual(stop["hitBreakpointIds"], [body["breakpoints"][-1]["id"]])
            e.body("disconnect")
            self.done(e, 0)
        self.grows("breakpoints set", setting)
        self.grows("breakpoints set anew", changing)
        self.grows("a program run over them", running)

    def test_too_many_are_refused_in_a_sentence(self):
        e = self.peer(Adapter)
        self.assertIn("at most 100000 breakpoints", e.refused(
            "setBreakpoints", source={"path": "/a.irl"}, breakpoints=[{"line": 1}] * 100001))
        # Whatever it has, others' sources count too.
        e.body("setBreakpoints", source={"path": "/a.irl"}, breakpoints=[{"line": 1}] * 60000)
        self.assertIn("other sources have 60000", e.refused(
            "setBreakpoints", source={"path": "/b.irl"}, breakpoints=[{"line": 1}] * 60000))
        e.body("setBreakpoints", source={"path": "/a.irl"}, breakpoints=[])
        e.body("setBreakpoints", source={"path": "/b.irl"}, breakpoints=[{"line": 1}] * 60000)
        self.assertIn("at most 100000 function", e.refused(
            "setFunctionBreakpoints", breakpoints=[{"name": "q"}] * 100001))
        e.body("disconnect")
        self.done(e, 0)

    def test_breakpoints_over_json_rpc(self):
        spent = []
        for n in (10, 1000, 10000):
            c = self.peer(Commands)
            c.result("world.create", name="w")
            c.result("program.create", name="long", source=lines_of(n))
            c.result("world.add_program", id="w", program="long")
            run = c.result("world.start_run", id="w", of="tasks", entry="wait")

            def work():
                numbers = [c.begin("run.set_breakpoint", {"id": run, "line": 5 + k,
                                                          "condition": "i = -1"})
                           for k in range(n)]
                made = [c.end(number)["result"]["number"] for number in numbers]
                self.assertEqual(len(c.result("run.breakpoints", id=run)), n)
                c.result("run.continue", id=run)
                for one in made:
                    c.begin("run.clear_breakpoint", {"id": run, "number": one})
                self.assertEqual(c.result("run.breakpoints", id=run), [])
            took, _ = self.spent(c, work)
            spent.append((n, took))
            self.done(c, 0)
        self.grows("breakpoints over JSON-RPC", spent)

    def test_back_over_what_is_recorded(self):
        spent = []
        for n in (10, 100, 1000):
            e = self.peer(Adapter)
            path = self.write("back.irl", "PROGRAM back;\nVAR\n  INT: i;\nBEGIN\n  i := 1;\n"
                              "  FOR i := 1 TO %d\n    WAIT 0.01 SEC;\n    WAIT 0.02 SEC;\n  ENDFOR;\n"
                              "ENDPROGRAM;\n" % n)
            e.body("launch", program=path, stopAtEnd=True)
            e.body("setBreakpoints", source={"path": path}, breakpoints=[
                {"line": 8, "condition": "i = %d" % -k} for k in range(n)])
            e.body("configurationDone")
            e.event("stopped")
            took, _ = self.spent(e, lambda: e.body("reverseContinue", threadId=1))
            spent.append((n * n, took))
            e.body("disconnect")
            self.done(e, 0)
        self.grows("conditions looked at on the way back", spent)


class LongMessages(Limits):
    def test_of_a_debugger(self):
        e = self.peer(Adapter)
        path = self.write("long.irl", lines_of(10))
        self.assertIn("initialize may be sent only once", e.refused("initialize", adapterID=LONG))
        self.assertIn("no request", e.refused(LONG))
        e.refused("launch", program=LONG)
        e.refused("launch", program=path, robot=LONG)
        e.refused("launch", program=path, args=[1] * 1000000)
        e.body("launch", program=path, stopOnEntry=True)
        b = e.body("setBreakpoints", source={"path": path}, breakpoints=[
            {"line": 5, "condition": LONG}, {"line": 5, "condition": "(" * 5000},
            {"line": 5, "hitCondition": LONG}, {"line": 5, "hitCondition": "99999999999999999999"},
            {"line": 5, "logMessage": "{i}" * 1000000}])["breakpoints"]
        self.assertEqual([one["verified"] for one in b], [False, False, False, False, True])
        self.assertIn("10000 characters", b[0]["message"])
        self.assertIn("100 levels", b[1]["message"])
        e.body("setBreakpoints", source={"path": path, "name": LONG}, breakpoints=[])
        e.body("setFunctionBreakpoints", breakpoints=[{"name": LONG}])
        e.body("configurationDone")
        e.event("stopped")
        frame_id = e.body("stackTrace", threadId=1)["stackFrames"][0]["id"]
        self.assertIn("10000 characters", e.refused("evaluate", expression=LONG, frameId=frame_id))
        e.refused("evaluate", expression="i := " + LONG, context="repl", frameId=frame_id)
        self.assertEqual(e.body("completions", text=LONG, column=10 * MEGABYTE,
                                frameId=frame_id)["targets"], [])
        e.refused("setExpression", expression=LONG, value=LONG, frameId=frame_id)
        for one in (2 ** 31, 2 ** 32, 2 ** 63, 2 ** 64, 10 ** 30, -2 ** 63, 1e300, -1, 0.5):
            for name in ("stackTrace", "scopes", "variables", "next", "goto", "source"):
                self.assertFalse(e.ask(name, {
                    "threadId": one, "frameId": one, "variablesReference": one, "targetId": one,
                    "sourceReference": one, "startFrame": one, "levels": one})["success"], (name, one))
        for message in (DEEP, b"[" + b"1," * 5000000 + b"1]", b'"' + LONG.encode() + b'"',
                        b'{"seq":1,"type":"request","command":"' + LONG.encode()):
            e.send(message)
        e.body("threads")
        self.assertGreaterEqual(sum("is ignored" in m["body"].get("output", "") for m in e.told), 4)
        e.body("disconnect")
        self.done(e, 0)

    def test_of_an_editor(self):
        s = self.peer(Server)
        uri = "file:///nowhere/long.irl"
        self.assertEqual(s.ask(LONG)["error"]["code"], -32601)
        self.assertLess(len(json.dumps(s.answers[s.number])), 1000)
        s.open(uri, "PROGRAM p;\nBEGIN\n  " + LONG + ";\nENDPROGRAM;\n")
        self.assertGreaterEqual(len(s.diagnostics(uri)), 1)
        for one in (2 ** 31, 2 ** 32, 2 ** 63, 2 ** 64, 10 ** 30):
            where = {"textDocument": {"uri": uri}, "position": {"line": one, "character": one}}
            for method in ("completion", "hover", "definition", "references", "signatureHelp"):
                s.ask("textDocument/" + method, dict(where))
            s.ask("textDocument/rename", dict(where, newName=LONG))
            s.ask("textDocument/rangeFormatting", dict(where, range={
                "start": where["position"], "end": where["position"]}))
        for one in (-1, 1.5, None, "1", [], {}, True):
            where = {"textDocument": {"uri": uri}, "position": {"line": one, "character": one}}
            self.assertEqual(s.ask("textDocument/hover", where)["error"]["code"], -32602)
        for message in (DEEP, b"[" + b"1," * 5000000 + b"1]", b'"' + LONG.encode() + b'"',
                        b'{"jsonrpc":"2.0","id":1,"method":"' + LONG.encode()):
            s.send(message)
        s.ask("shutdown")
        self.assertEqual(sum("error" in m for m in s.told), 4)
        self.done(s, 0)

    def test_of_a_client_of_commands(self):
        c = self.peer(Commands)
        c.result("world.create", name="w")
        c.result("program.create", name="p", source=lines_of(10))
        c.result("world.add_program", id="w", program="p")
        run = c.result("world.start_run", id="w", of="tasks", entry="stop")
        c.send(b'{"jsonrpc":"2.0","id":99,"method":"' + LONG.encode() + b'"}')
        c.wait(lambda m: "error" in m)  # the line is too long
        half = LONG[:4 * MEGABYTE]
        for name, arguments in (
                ("run.set_breakpoint", {"line": 5, "condition": half}),
                ("run.set_breakpoint", {"line": 5, "condition": "(" * 100000}),
                ("run.set_breakpoint", {"line": 5, "hits": half}),
                ("run.set_breakpoint", {"line": 2 ** 62}), ("run.set_breakpoint", {"line": -1}),
                ("run.set_breakpoint", {"line": 5, "ignore": -2 ** 63}),
                ("run.set_breakpoint", {"routine": half}), ("run.set_breakpoint", {"line": [[5]]}),
                ("run.set_breakpoint", {"line": 5, "source": half}),
                ("run.set_breakpoint", {"line": 5, "program": half}),
                ("run.clear_breakpoint", {"number": 2 ** 63}), ("run.clear_breakpoint", {"number": -1}),
                ("run.evaluate", {"expression": half}), ("run.evaluate", {"expression": "(" * 9999}),
                ("run.evaluate", {"expression": "-" * 9999}), ("run.evaluate", {"expression": "i" * 9999}),
                ("run.evaluate", {"expression": "i", "frame": 2 ** 62}),
                ("run.evaluate", {"expression": "i", "process": -1}),
                ("run.evaluate", {"expression": "i", "process": 2 ** 40}),
                ("run.set_variable", {"variable": half, "value": "1"}),
                ("run.set_variable", {"variable": "i", "value": half}),
                ("run.variables", {"frame": -2 ** 63}), ("run.variables", {"most": -1}),
                ("run.variables", {"of": "i" + "[1]" * 3000}), ("run.stack", {"process": 2 ** 62}),
                ("run.notes", {"from": -1, "most": 2 ** 62}), ("run.program_text", {"source": half}),
                ("run.input", {"text": half, "program": "p"}), ("run.input", {"text": "x", "program": half}),
                ("run.step_recorded", {"to": half}), ("run.step_over", {"process": 2 ** 63}),
                ("run.recorded_at", {"line": -2 ** 63}), ("run.seek", {"time": "x"})):
            m = c.ask(name, dict(arguments, id=run))
            if "error" in m:
                self.assertTrue(m["error"]["message"], name)
                self.assertLess(len(m["error"]["message"]), 20000, name)
        self.assertEqual(c.result("run.place", id=run)["reason"], "entry")
        self.done(c, 0)

    def test_many_that_wait_take_bounded_memory(self):
        # Objects of one member take about twenty times the bytes of their text.
        body = b"[" + b",".join([b'{"a":1}'] * 900000) + b"]"
        for kind, name in ((Adapter, "command"), (Server, "method")):
            p = self.peer(kind)
            for k in range(8):
                p.send(b'{"seq":%d,"id":%d,"jsonrpc":"2.0","type":"request","%s":"nothing","params":' %
                       (100 + k, 100 + k, name.encode()) + body + b"}")
            for k in range(8):
                p.end(100 + k)
            if kind is Adapter:
                p.body("disconnect")
            else:
                p.ask("shutdown")
            print("%s: %d MB" % (kind.__name__, self.done(p, 0, 1000 * MEGABYTE) // MEGABYTE))


class Changes(Limits):
    URI = "file:///nowhere/changed.irl"

    def test_of_all_lines_at_once(self):
        # What an editor sends for a name that is replaced everywhere: a change a line, in one message.
        for name, order, sizes in (("from the end", -1, (100, 10000, 100000)),
                                   ("from the start", 1, (100, 1000, 10000))):
            spent = []
            for n in sizes:
                s = self.peer(Server)
                s.open(self.URI, lines_of(n))
                s.diagnostics(self.URI)
                changes = [{"range": {"start": {"line": 4 + k, "character": 2},
                                      "end": {"line": 4 + k, "character": 3}}, "text": "other"}
                           for k in range(n)][::order]

                def work():
                    s.change(self.URI, changes)
                    return s.diagnostics(self.URI)
                took, faults = self.spent(s, work)
                spent.append((n, took))
                self.assertIn("other", faults[0]["message"])
                self.assertEqual(faults[0]["range"], {"start": {"line": 4, "character": 2},
                                                      "end": {"line": 4, "character": 7}})
                self.assertLess(len(faults), 1000)
                s.ask("shutdown")
                self.done(s, 0)
            self.grows("changes " + name, spent)

    def test_at_random_are_those_of_the_text(self):
        seeds = random.Random(SEED)
        print("seed %d (set ROBOMOSP_TEST_SEED to repeat)" % SEED)
        pieces = ["\n", "\r\n", "\r", "{ \U0001f916 }", "'ä'", "x", " y ", "12", "\n\n", "a\r", "\nb", ""]
        s = self.peer(Server)

        def lines(text):
            out, start_of = [], 0
            i = 0
            while i < len(text):
                if text[i] == "\n" or (text[i] == "\r" and text[i + 1:i + 2] != "\n"):
                    out.append(text[start_of:i + 1])
                    start_of = i + 1
                i += 1
            return out + [text[start_of:]]

        def units(text):
            return len(text.encode("utf-16-le")) // 2

        def change(text):
            all_lines = lines(text)
            places = []
            for _ in range(2):
                l = seeds.randrange(len(all_lines))
                body = all_lines[l].rstrip("\r\n")
                places.append((l, seeds.randrange(len(body) + 1)))
            places.sort()
            at = [sum(map(len, all_lines[:l])) + c for l, c in places]
            with_ = "".join(seeds.choice(pieces) for _ in range(seeds.randrange(4)))
            position = [{"line": l, "character": units(all_lines[l][:c]) if c <= len(
                all_lines[l].rstrip("\r\n")) else 9999} for l, c in places]
            return text[:at[0]] + with_ + text[at[1]:], {
                "range": {"start": position[0], "end": position[1]}, "text": with_}
        for k in range(60):
            text = "".join(seeds.choice(pieces) for _ in range(seeds.randrange(60)))
            uri, plain = "file:///a/c%d.irl" % k, "file:///b/c%d.irl" % k
            s.open(uri, text)
            changes = []
            for _ in range(seeds.randrange(1, 20)):
                text, one = change(text)
                changes.append(one)
            s.change(uri, changes)
            s.open(plain, text)
            self.assertEqual(s.tokens(uri), s.tokens(plain), text)
            for u in (uri, plain):
                s.tell("textDocument/didClose", {"textDocument": {"uri": u}})
        s.ask("shutdown")
        self.done(s, 0)

    def test_of_one_long_line(self):
        spent = []
        for n in (100, 1000, 10000):
            s = self.peer(Server)
            body = "i := j + 1; " * n
            s.open(self.URI, "PROGRAM p;\nVAR INT: i, j;\nBEGIN " + body + "\nENDPROGRAM;\n")
            took, tokens = self.spent(s, lambda: s.tokens(self.URI))
            spent.append((n, took))
            self.assertGreater(len(tokens), 5 * n)
            s.ask("shutdown")
            self.done(s, 0)
        self.grows("words of one line", spent)

    def test_too_many_changes_of_one_long_line_are_refused(self):
        s = self.peer(Server)
        s.open(self.URI, "{ " + LONG + " }\n")
        begin = time.time()
        s.change(self.URI, [{"range": {"start": {"line": 0, "character": 5},
                                       "end": {"line": 0, "character": 5}}, "text": "x"}] * 20000)
        s.wait(lambda m: m.get("method") == "window/showMessage" and
               "Open it again" in m["params"]["message"])
        self.assertLess(time.time() - begin, 60)
        s.ask("shutdown")
        self.done(s, 0)

    def test_documents_beside_others_are_looked_at_once(self):
        spent = []
        for n in (10, 100, 900):
            s = self.peer(Server)

            def work():
                for k in range(n):
                    s.open("file:///many/p%d.irl" % k, "PROGRAM p%d;\nBEGIN\n  x%d := 1;\nENDPROGRAM;\n" % (k, k))
                for k in range(n):
                    s.diagnostics("file:///many/p%d.irl" % k)
            took, _ = self.spent(s, work)
            # A letter that is typed in one of them: the others are left alone.
            told = len(s.told)
            s.change("file:///many/p0.irl", [{"text": "PROGRAM p0;\nBEGIN\nENDPROGRAM;\n"}])
            self.assertEqual(s.diagnostics("file:///many/p0.irl"), [])
            time.sleep(0.3)
            self.assertEqual(len(s.told), told + 1)
            spent.append((n * n, took))
            s.ask("shutdown")
            self.done(s, 0)
        self.grows("documents of one folder, each beside each", spent)

    def test_errors_of_a_source(self):
        spent = []
        for n in (1000, 10000, 100000):
            s = self.peer(Server)

            def work():
                s.open(self.URI, "PROGRAM p;\nBEGIN\n" + "".join(
                    "  unknown%d := 1;\n" % k for k in range(n)) + "ENDPROGRAM;\n")
                return s.diagnostics(self.URI)
            took, faults = self.spent(s, work)
            spent.append((n, took))
            self.assertLess(len(faults), 1000)
            for f in faults:
                self.assertGreater(f["range"]["end"]["character"], f["range"]["start"]["character"])
                self.assertTrue(f["message"].endswith("."), f["message"])
            s.ask("shutdown")
            self.done(s, 0)
        self.grows("errors", spent)


class Notes(Limits):
    def live(self, c, body):
        c.result("world.create", name="w")
        c.result("program.create", name="says", source="PROGRAM says;\nVAR\n  INT: i;\n  STRING: s;\nBEGIN\n" +
                 body + "ENDPROGRAM;\n")
        c.result("world.add_program", id="w", program="says")
        run = c.result("world.start_run", id="w", of="tasks")
        c.result("run.finish", id=run)
        return run

    def test_what_a_program_says_costs_what_it_says(self):
        spent = []
        for n in (100, 1000, 10000):
            c = self.peer(Commands)
            took, run = self.spent(c, lambda: self.live(
                c, "  FOR i := 1 TO %d\n    WRITELN('line ', i);\n    WAIT 0.01 SEC;\n  ENDFOR;\n" % n))
            notes = c.result("run.notes", **{"id": run, "from": 1, "most": 10000})
            self.assertEqual(len(notes), n)
            for k in (1, n // 2, n):
                self.assertTrue(notes[k - 1].endswith("line %d" % k), notes[k - 1])
            spent.append((n, took))
            self.done(c, 0)
        self.grows("lines that a program says", spent)

    def test_more_than_64_mb_are_left_out_with_a_word(self):
        c = self.peer(Commands)
        run = self.live(c, "  s := 'abcdefgh';\n  FOR i := 1 TO 13\n    s := CONCAT(s, s);\n  ENDFOR;\n"
                        "  FOR i := 1 TO 3000\n    WRITELN(s);\n  ENDFOR;\n")
        count = c.result("run.place", id=run)["notes"]
        self.assertGreater(count, 900)
        self.assertLess(count, 1100)
        last = c.result("run.notes", **{"id": run, "from": count, "most": 1})[0]
        self.assertIn("left out", last)
        self.done(c, 0, 600 * MEGABYTE)


class Order(Limits):
    def test_requests_of_a_debugger_in_any_order_have_one_answer_each(self):
        seeds = random.Random(SEED)
        print("seed %d (set ROBOMOSP_TEST_SEED to repeat)" % SEED)
        path = self.write("long.irl", lines_of(20))
        source = {"path": path}
        requests = [
            ("initialize", {}), ("launch", {"program": path}), ("launch", {"program": path, "stopOnEntry": True}),
            ("attach", {"port": 9}), ("configurationDone", {}), ("restart", {}), ("terminate", {}),
            ("setBreakpoints", {"source": source, "breakpoints": [{"line": 7}, {"line": 9}]}),
            ("setBreakpoints", {"source": source, "lines": [6]}),
            ("setFunctionBreakpoints", {"breakpoints": [{"name": "long"}]}),
            ("setExceptionBreakpoints", {"filters": []}),
            ("breakpointLocations", {"source": source, "line": 1, "endLine": 50}), ("threads", {}),
            ("stackTrace", {"threadId": 1}), ("scopes", {"frameId": 1}),
            ("variables", {"variablesReference": 1}), ("evaluate", {"expression": "i"}),
            ("setVariable", {"variablesReference": 1, "name": "i", "value": "3"}),
            ("setExpression", {"expression": "i", "value": "4"}), ("completions", {"text": "i", "column": 2}),
            ("continue", {"threadId": 1}), ("next", {"threadId": 1}), ("stepIn", {"threadId": 1}),
            ("stepOut", {"threadId": 1}), ("stepBack", {"threadId": 1}), ("reverseContinue", {"threadId": 1}),
            ("gotoTargets", {"source": source, "line": 7}), ("goto", {"threadId": 1, "targetId": 1}),
            ("pause", {"threadId": 1}), ("loadedSources", {}), ("source", {"sourceReference": 1}),
            ("exceptionInfo", {"threadId": 1}), ("cancel", {"requestId": 3}), ("modules", {}), ("nothing", {})]
        deadline = time.time() + FUZZ_SECONDS
        runs = 0
        while time.time() < deadline or runs < 2:
            runs += 1
            data, asked = b"", 0
            order = ([("initialize", {})] if seeds.randrange(4) else []) + [
                seeds.choice(requests) for _ in range(seeds.randrange(1, 80))]
            for name, arguments in order:
                asked += 1
                data += frame({"seq": asked, "type": "request", "command": name, "arguments": arguments})
            asked += 1
            data += frame({"seq": asked, "type": "request", "command": "disconnect", "arguments": {}})
            process = start("debug-adapter")
            try:
                out, _ = process.communicate(data, timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                self.fail("it hangs: %r" % order)
            self.assertEqual(process.returncode, 0, order)
            answered = []
            while out:
                head, _, rest = out.partition(b"\r\n\r\n")
                length = int(head.split(b":")[1])
                m = json.loads(rest[:length].decode("utf-8"))
                out = rest[length:]
                if m["type"] == "response":
                    answered.append(m["request_seq"])
                    if not m["success"]:
                        self.assertTrue(Adapter.sentence(m).rstrip().endswith((".", "?")), m)
            self.assertEqual(sorted(answered), list(range(1, asked + 1)), order)
        print("%d debuggers" % runs)

    def test_documents_of_all_kinds_that_are_damaged(self):
        """Programs with their cells, lists of data and modules, while they are typed."""
        seeds = random.Random(SEED)
        print("seed %d (set ROBOMOSP_TEST_SEED to repeat)" % SEED)
        texts = {
            "p.irl": "PROGRAM p;\nSYSTEM_SPECIFICATION 'cell.ssi';\nDATALIST 'p.dls';\nIMPORT grip FROM tools;\n"
                     "VAR\n  INT: n;\n  POSE: place;\nBEGIN\n  TEACH place, n;\n  grip;\n  MOVE LIN place;\n"
                     "ENDPROGRAM;\n",
            "cell.ssi": "PROGRAM cell;\nTYPE\n  RECORD REAL: X, Y, Z; ENDRECORD: PLACE;\nVAR\n  INT: many;\n"
                        "ENDPROGRAM;\n",
            "p.dls": "place := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 0.0));\nn := 5;\n",
            "tools.irl": "MODULE tools;\nEXPORT grip;\nPROCEDURE grip;\nBEGIN\n  WAIT 0.5 SEC;\nENDPROC;\nENDMODULE;\n"}
        words = ["PROGRAM ", "MODULE ", "IMPORT ", "'cell.ssi'", "'p.dls'", "RECORD ", "{", "'", ";", ":=", "(",
                 "\r", "\U0001f916", "\0", "IMPORT grip FROM p;", "DATALIST 'cell.ssi';", "ENDPROGRAM;"]
        s = self.peer(Server)
        uris = {name: "file:///cell/" + name for name in texts}
        now = dict(texts)
        for name, text in texts.items():
            s.open(uris[name], text)
        deadline = time.time() + FUZZ_SECONDS
        rounds = 0
        while time.time() < deadline or rounds < 20:
            rounds += 1
            name = seeds.choice(list(texts))
            text = texts[name] if seeds.randrange(3) == 0 else now[name]
            at = seeds.randrange(len(text) + 1)
            text = text[:at] + seeds.choice(words + ["", ""]) + text[at + seeds.randrange(12):]
            now[name] = text
            s.change(uris[name], [{"text": text}])
            if seeds.randrange(3) == 0:
                other = seeds.choice(list(texts))
                where = {"textDocument": {"uri": uris[other]},
                         "position": {"line": seeds.randrange(14), "character": seeds.randrange(30)}}
                method = seeds.choice(["completion", "hover", "definition", "references", "documentSymbol",
                                       "foldingRange", "formatting", "signatureHelp"])
                m = s.ask("textDocument/" + method, where)
                if "error" in m:
                    self.assertTrue(m["error"]["message"])
        for name in texts:
            for f in s.diagnostics(uris[name]):
                self.assertLessEqual(f["range"]["start"]["line"], now[name].count("\n") + now[name].count("\r"))
                self.assertTrue(f["message"].strip(), f)
        print("%d changes" % rounds)
        s.ask("shutdown")
        self.done(s, 0)


if __name__ == "__main__":
    unittest.main()
