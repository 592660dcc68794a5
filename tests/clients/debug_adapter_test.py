#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A strict client of `robomosp debug-adapter`: sequence numbers, required fields and the order of
events are checked against the Debug Adapter Protocol, over the programs that come along, with wrong
requests and with the bytes of broken clients.
ROBOMOSP_FUZZ_SECONDS makes the last longer, ROBOMOSP_TEST_SEED repeats it."""

import json
import os
import random
import re
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
FUZZ_SECONDS = float(os.environ.get("ROBOMOSP_FUZZ_SECONDS", "8"))
SAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../scripts/programs")
PATIENCE = 120


# ---- the protocol: fields with their types; "?" may be left out ----

SOURCE = {"?name": str, "?path": str, "?sourceReference": int, "?origin": str}
BREAKPOINT = {"verified": bool, "?id": int, "?message": str, "?line": int, "?column": int,
              "?source": SOURCE}
VARIABLE = {"name": str, "value": str, "variablesReference": int, "?type": str,
            "?evaluateName": str, "?indexedVariables": int, "?namedVariables": int,
            "?presentationHint": dict}
VALUE = {"value": str, "?type": str, "?variablesReference": int, "?indexedVariables": int,
         "?namedVariables": int}
BODIES = {
    "initialize": dict,
    "setBreakpoints": {"breakpoints": [BREAKPOINT]},
    "setFunctionBreakpoints": {"breakpoints": [BREAKPOINT]},
    "setExceptionBreakpoints": {"?breakpoints": [BREAKPOINT]},
    "breakpointLocations": {"breakpoints": [{"line": int, "?column": int}]},
    "continue": {"?allThreadsContinued": bool},
    "threads": {"threads": [{"id": int, "name": str}]},
    "stackTrace": {"stackFrames": [{"id": int, "name": str, "line": int, "column": int,
                                    "?source": SOURCE}], "?totalFrames": int},
    "scopes": {"scopes": [{"name": str, "variablesReference": int, "expensive": bool,
                           "?presentationHint": str}]},
    "variables": {"variables": [VARIABLE]},
    "setVariable": VALUE,
    "setExpression": VALUE,
    "evaluate": {"result": str, "variablesReference": int, "?type": str, "?indexedVariables": int,
                 "?namedVariables": int},
    "completions": {"targets": [{"label": str, "?type": str, "?detail": str, "?start": int,
                                 "?length": int}]},
    "exceptionInfo": {"exceptionId": str, "breakMode": str, "?description": str, "?details": dict},
    "gotoTargets": {"targets": [{"id": int, "label": str, "line": int}]},
    "loadedSources": {"sources": [SOURCE]},
    "source": {"content": str},
}
EVENTS = {
    "initialized": {}, "terminated": {},
    "exited": {"exitCode": int},
    "stopped": {"reason": str, "threadId": int, "allThreadsStopped": bool, "?description": str,
                "?text": str, "?hitBreakpointIds": [int]},
    "continued": {"threadId": int, "allThreadsContinued": bool},
    "thread": {"reason": str, "threadId": int},
    "output": {"category": str, "output": str},
    "breakpoint": {"reason": str, "breakpoint": BREAKPOINT},
    "process": {"name": str, "isLocalProcess": bool, "startMethod": str},
}
REASONS = {"step", "breakpoint", "exception", "pause", "entry", "goto", "function breakpoint"}


def misfit(value, shape, where):
    """What is wrong with a value; None = nothing."""
    if isinstance(shape, list):
        if not isinstance(value, list):
            return "%s is no list: %r" % (where, value)
        return next((m for i, v in enumerate(value)
                     for m in [misfit(v, shape[0], "%s[%d]" % (where, i))] if m), None)
    if isinstance(shape, dict):
        if not isinstance(value, dict):
            return "%s is no object: %r" % (where, value)
        for name, inner in shape.items():
            plain = name.lstrip("?")
            if plain not in value:
                if not name.startswith("?"):
                    return "%s has no %s: %r" % (where, plain, value)
                continue
            wrong = misfit(value[plain], inner, where + "." + plain)
            if wrong:
                return wrong
        extra = set(value) - {n.lstrip("?") for n in shape}
        return "%s has %r" % (where, extra) if extra else None
    if not isinstance(value, shape) or (shape is int and isinstance(value, bool)):
        return "%s is no %s: %r" % (where, shape.__name__, value)
    return None


class Editor:
    def __init__(self, **initialize):
        self.process = start("debug-adapter")
        self.said = self.heard = 0
        self.requests, self.answers = {}, {}
        self.events, self.faults = [], []
        self.is_running = self.is_ended = self.has_exited = False
        self.changed = threading.Condition()
        threading.Thread(target=self.read, daemon=True).start()
        threading.Thread(target=self.process.stderr.read, daemon=True).start()
        arguments = {"adapterID": "robomosp", "linesStartAt1": True, "columnsStartAt1": True,
                     "supportsVariableType": True, "supportsVariablePaging": True}
        arguments.update(initialize)
        self.can = self.ask("initialize", **arguments)

    # ---- what comes ----

    def read(self):
        for message in messages(self.process.stdout, self.faults):
            with self.changed:
                self.look(message)
                self.changed.notify_all()
        with self.changed:
            self.answers["end"] = True
            self.changed.notify_all()

    def look(self, m):
        fault = self.faults.append
        self.heard += 1
        if m.get("seq") != self.heard:
            fault("seq is %r behind %d" % (m.get("seq"), self.heard - 1))
        if m.get("type") == "event":
            wrong = misfit(m.get("body", {}), EVENTS.get(m.get("event"), {"no such event": int}),
                           "event " + str(m.get("event")))
            if wrong:
                fault(wrong)
            name = m["event"]
            if name == "stopped":
                if m["body"]["reason"] not in REASONS:
                    fault("a reason that is none: %r" % m)
                if not self.is_running:
                    fault("stopped while nothing runs: %r" % m)
                self.is_running = False
            if name == "continued":
                self.is_running = True
            if self.is_ended and name not in ("output", "thread"):
                fault("behind terminated: %r" % m)
            if name == "exited":
                self.has_exited = True
            if name == "terminated":
                self.is_ended, self.is_running = True, False
            self.events.append(m)
        elif m.get("type") == "response":
            command = self.requests.pop(m.get("request_seq"), None)
            if command is None:
                fault("an answer to nothing: %r" % m)
            elif m.get("command") != command:
                fault("an answer to %s: %r" % (command, m))
            if not isinstance(m.get("success"), bool):
                fault("no success: %r" % m)
            elif m["success"]:
                shape = BODIES.get(command)
                if shape is None and m.get("body") not in (None, {}):
                    fault("%s has a body: %r" % (command, m))
                if shape is not None:
                    wrong = misfit(m.get("body"), shape, command)
                    if wrong:
                        fault(wrong)
                if command in ("continue", "next", "stepIn", "stepOut", "stepBack",
                               "reverseContinue", "goto", "configurationDone", "restart"):
                    self.is_running = True
                if command == "restart":
                    self.is_ended = False
            else:
                text = m.get("body", {}).get("error", {}).get("variables", {}).get("sentence", "")
                if not m.get("message") or not text.rstrip().endswith((".", "?")):
                    fault("an error without a sentence: %r" % m)
            self.answers[m["request_seq"]] = m
        else:
            fault("neither event nor response: %r" % m)

    # ---- what goes ----

    def begin(self, command, **arguments):
        with self.changed:
            self.said += 1
            number = self.said
            self.requests[number] = command
        self.send({"seq": number, "type": "request", "command": command, "arguments": arguments})
        return number

    def send(self, message):
        self.process.stdin.write(frame(message))
        self.process.stdin.flush()

    def end(self, number, seconds=PATIENCE):
        with self.changed:
            if not self.changed.wait_for(lambda: number in self.answers or "end" in self.answers,
                                         seconds):
                raise AssertionError("no answer to %r" % number)
            if number not in self.answers:
                raise AssertionError("the adapter has ended")
            return self.answers.pop(number)

    def ask(self, command, **arguments):
        m = self.end(self.begin(command, **arguments))
        if not m["success"]:
            raise AssertionError("%s: %s" % (command, self.sentence(m)))
        return m.get("body", {})

    def refused(self, command, **arguments):
        m = self.end(self.begin(command, **arguments))
        if m["success"]:
            raise AssertionError("%s is answered: %r" % (command, m))
        return self.sentence(m)

    @staticmethod
    def sentence(m):
        return m["body"]["error"]["variables"]["sentence"]

    def event(self, name, seconds=PATIENCE):
        """The next one of this name; those before it are dropped."""
        with self.changed:
            found = []

            def is_there():
                for i, e in enumerate(self.events):
                    if e["event"] == name:
                        found.append(i)
                        return True
                return "end" in self.answers
            if not self.changed.wait_for(is_there, seconds) or not found:
                raise AssertionError("no event %s; %r" % (name, self.events[-3:]))
            self.told = getattr(self, "told", []) + self.events[:found[0]]
            body = self.events[found[0]].get("body", {})
            del self.events[:found[0] + 1]
            return body

    def output(self, category):
        with self.changed:
            return "".join(e["body"]["output"] for e in getattr(self, "told", []) + self.events
                           if e["event"] == "output" and e["body"]["category"] == category)

    # ---- what editors do ----

    def launch(self, breakpoints=None, then=None, **arguments):
        number = self.begin("launch", **arguments)
        m = self.end(number)
        if not m["success"]:
            raise AssertionError(self.sentence(m))
        self.event("initialized")
        self.configure(breakpoints or {}, then)

    def configure(self, breakpoints, then=None):
        self.set = {}
        for path, lines in breakpoints.items():
            self.set[path] = self.ask("setBreakpoints", source={"path": path},
                                      breakpoints=lines)["breakpoints"]
        self.ask("setExceptionBreakpoints", filters=["fault"])
        if then:
            then(self)
        self.ask("configurationDone")

    def stopped(self, reason=None):
        body = self.event("stopped")
        if reason and body["reason"] != reason:
            raise AssertionError(body)
        return body

    def frames(self, thread):
        return self.ask("stackTrace", threadId=thread)["stackFrames"]

    def scope(self, thread, name, depth=0):
        frame = self.frames(thread)[depth]["id"]
        return next(s["variablesReference"] for s in self.ask("scopes", frameId=frame)["scopes"]
                    if s["name"] == name)

    def values(self, reference, **how):
        return {v["name"]: v for v in self.ask("variables", variablesReference=reference,
                                               **how)["variables"]}

    def close(self):
        self.ask("disconnect")
        code = self.process.wait(PATIENCE)
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            pipe.close()
        return code


class Debugging(unittest.TestCase):
    def setUp(self):
        self.editors = []
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        for e in self.editors:
            end(e.process)
        self.folder.cleanup()

    def editor(self, **initialize):
        self.editors.append(Editor(**initialize))
        return self.editors[-1]

    def done(self, e, code=None):
        """It ends, with this exit code of the programs, and nothing was wrong on the way."""
        if code is not None:
            self.assertEqual(e.event("exited")["exitCode"], code)
            e.event("terminated")
        self.assertEqual(e.close(), 0)
        self.assertEqual(e.faults, [])

    def write(self, name, text):
        path = os.path.join(self.folder.name, name)
        with open(path, "w", encoding="utf-8") as f:
            f.write(text)
        return path

    def line(self, path, mark):
        with open(path, encoding="utf-8") as f:
            return next(i for i, text in enumerate(f.read().split("\n"), 1) if mark in text)


def sample(name):
    return os.path.realpath(os.path.join(SAMPLES, name))


COUNT = """PROGRAM count;
TYPE
  RECORD
    INT: number;
    POSITION: place;
  ENDRECORD: PART;
VAR
  INT: i, sum;
  STRING: word := 'a{b}';
  ARRAY [1..300] OF INT: many;
  ARRAY [0..1] OF PART: parts;
  LIST OF INT: rest;
  POSE: home;
PROCEDURE add (IN INT: n);
VAR INT: twice;
BEGIN
  twice := 2 * n;
  sum := sum + n;
ENDPROC;
BEGIN
  home := POSE(POSITION(1.0, 2.0, 3.0), ORIZYX(0.0, 0.0, 90.0));
  many[7] := 70;
  FOR i := 1 TO 5
    add(i);
    WAIT 0.1 SEC;
  ENDFOR;

  WRITELN('sum ', sum);
ENDPROGRAM;
"""


class Programs(Debugging):
    def test_hanoi(self):
        """Breakpoint with a condition in the recursion, depth of the stack, a variable that is
        changed, and back."""
        e = self.editor()
        source = sample("hanoi.irl")
        carry = self.line(source, "    carry(source, goal)")
        last = self.line(source, "ENDPROGRAM")
        e.launch({source: [{"line": carry, "condition": "n = 1"}, {"line": last + 100},
                           {"line": carry + 1, "condition": "n = ("}]},
                 program=sample("hanoi.lua"), args=["ur5"], stopOnEntry=True)
        good, beyond, wrong = e.set[source]
        self.assertTrue(good["verified"])
        self.assertEqual((good["line"], good["source"]["path"]), (carry, source))
        self.assertEqual((beyond["verified"], wrong["verified"]), (False, False))
        self.assertIn("there is no statement in line", beyond["message"])
        self.assertIn("the condition of a breakpoint", wrong["message"])
        self.assertIn("done: 7 discs carried", e.output("stdout"))  # the script runs it, too
        thread = e.stopped("entry")["threadId"]
        self.assertEqual(e.ask("threads")["threads"], [{"id": thread, "name": "hanoi"}])
        top = e.frames(thread)[0]
        self.assertEqual(top["line"], self.line(source, "  pegs[1].discs := DISCS;"))
        self.assertEqual(top["source"]["path"], source)
        e.ask("continue", threadId=thread)
        at = e.stopped("breakpoint")
        self.assertEqual(at["hitBreakpointIds"], [good["id"]])
        frames = e.frames(thread)
        self.assertEqual([f["name"].lower() for f in frames], ["solve"] * 3 + ["hanoi"])
        self.assertEqual([f["line"] for f in frames][:1], [carry])
        part = e.ask("stackTrace", threadId=thread, startFrame=1, levels=2)
        self.assertEqual((part["stackFrames"], part["totalFrames"]), (frames[1:3], 4))
        local = e.values(e.scope(thread, "Locals"))
        self.assertEqual({n.lower(): v["value"] for n, v in local.items()},
                         {"n": "1", "source": "1", "goal": "3", "other": "2"})
        outer = e.values(e.scope(thread, "Locals", 2))
        self.assertEqual(outer["n"]["value"], "3")
        program = e.scope(thread, "Program")
        pegs = e.values(program)["pegs"]
        self.assertEqual(pegs["indexedVariables"], 3)
        first = e.values(pegs["variablesReference"])["[1]"]
        self.assertEqual(first["evaluateName"], "pegs[1]")
        fields = e.values(first["variablesReference"])
        self.assertEqual(fields["discs"]["value"], "3")
        foot = e.values(fields["foot"]["variablesReference"])
        self.assertEqual(float(foot["Y"]["value"]), -250)
        # What is shown by a path can be asked for by it.
        for v in (first, fields["discs"], foot["Y"]):
            got = e.ask("evaluate", expression=v["evaluateName"], frameId=frames[0]["id"],
                        context="watch")
            self.assertEqual(got["result"], v["value"])
        world = e.values(e.scope(thread, "World"))
        self.assertEqual(world["time"]["type"], "s")
        # Six joints, and the maker's six axes.
        self.assertEqual(len(e.values(world["ur5"]["variablesReference"])), 12)
        # A variable is changed: the program counts on from there.
        e.ask("setVariable", variablesReference=program, name="carried", value="100")
        self.assertEqual(e.ask("evaluate", expression="carried + 1", context="repl",
                               frameId=frames[0]["id"])["result"], "101")
        # Three statements on, and back the same way.
        e.ask("stepIn", threadId=thread)
        e.stopped("step")
        inside = e.frames(thread)
        self.assertEqual((inside[0]["name"].lower(), len(inside)), ("carry", 5))
        self.assertEqual(inside[0]["line"], self.line(source, "MOVE PTP above(source, TRAVEL)"))
        e.ask("stepBack", threadId=thread)
        back = e.stopped("step")
        self.assertIn("recording", back["description"])
        again = e.frames(thread)
        self.assertEqual((len(again), again[0]["line"]), (4, carry))
        self.assertIn("shows the past", e.refused("setVariable", name="carried", value="1",
                                                  variablesReference=e.scope(thread, "Program")))
        e.ask("reverseContinue", threadId=thread)
        self.assertEqual(e.stopped()["reason"], "entry")
        e.ask("continue", threadId=thread)  # over what is recorded to the breakpoint
        e.stopped("breakpoint")
        self.assertEqual(len(e.frames(thread)), 4)
        e.ask("stepIn", threadId=thread)
        e.stopped("step")
        self.assertEqual(len(e.frames(thread)), 5)
        e.ask("stepOut", threadId=thread)
        e.stopped("step")
        self.assertEqual(len(e.frames(thread)), 4)
        e.ask("setBreakpoints", source={"path": source}, breakpoints=[])
        # Where was it at this line? In what is recorded.
        targets = e.ask("gotoTargets", source={"path": source},
                        line=self.line(source, "close_gripper(TRUE)") - 1)["targets"]
        self.assertEqual(len(targets), 1)
        e.ask("goto", threadId=thread, targetId=targets[0]["id"])
        e.stopped("goto")
        self.assertEqual(e.frames(thread)[0]["line"], targets[0]["line"])
        e.ask("continue", threadId=thread)
        self.assertEqual(e.event("exited")["exitCode"], 0)
        e.event("terminated")
        self.assertIn("done: 107 discs carried", e.output("stdout"))
        self.assertIn("takes disc3", e.output("console"))
        self.done(e)

    def test_processes_are_threads(self):
        e = self.editor()
        source = sample("two_robots.irl")
        path = self.line(source, "taken := taken + 1")
        e.launch({source: [{"line": path, "hitCondition": "2"}]},
                 program=sample("two_robots.lua"), stopOnEntry=True)
        main = e.stopped("entry")["threadId"]
        self.assertEqual([t["name"] for t in e.ask("threads")["threads"]], ["two_robots"])
        e.ask("continue", threadId=main)
        take = e.stopped("breakpoint")["threadId"]
        names = {t["name"].lower(): t["id"] for t in e.ask("threads")["threads"]}
        self.assertEqual(names["two_robots: take"], take)
        bring = names["two_robots: bring"]
        self.assertEqual(len({main, take, bring}), 3)
        started = [x["body"]["threadId"] for x in e.told + e.events if x["event"] == "thread"]
        self.assertLessEqual({take, bring}, set(started))
        # Each has its own frames and variables; a step is of one of them.
        self.assertEqual(e.values(e.scope(take, "Locals"))["i"]["value"], "2")
        before = e.frames(bring)[0]
        self.assertEqual(before["name"].lower(), "bring")
        e.ask("next", threadId=bring)
        at = e.stopped("step")
        self.assertEqual(at["threadId"], bring)
        self.assertNotEqual(e.frames(bring)[0]["line"], before["line"])
        e.ask("setBreakpoints", source={"path": source}, breakpoints=[])
        e.ask("continue", threadId=bring)
        self.done(e, 0)

    def test_programs_that_come_along_run_to_their_end(self):
        for name in ("pick_and_place", "palletising", "arc_weld"):
            with self.subTest(name):
                e = self.editor()
                path = sample(name + ".irl")
                first = []

                def then(editor):
                    first.extend(editor.ask("breakpointLocations", source={"path": path}, line=1,
                                            endLine=200)["breakpoints"])
                e.launch(then=then, program=sample(name + ".lua"), stopOnEntry=True)
                thread = e.stopped("entry")["threadId"]
                self.assertIn(e.frames(thread)[0]["line"], [b["line"] for b in first])
                for _ in range(5):
                    e.ask("next", threadId=thread)
                    e.stopped("step")
                    self.assertIn(e.frames(thread)[0]["line"], [b["line"] for b in first])
                e.ask("continue", threadId=thread)
                self.done(e, 0)

    def test_variables_are_trees_in_pages(self):
        e = self.editor()
        path = self.write("count.irl", COUNT)
        e.launch({path: [{"line": self.line(path, "sum := sum + n"), "hitCondition": "3"}]},
                 program=path)
        thread = e.stopped("breakpoint")["threadId"]
        self.assertEqual(e.values(e.scope(thread, "Locals"))["twice"]["value"], "6")
        all = e.values(e.scope(thread, "Program"))
        many = all["many"]
        self.assertEqual(many["indexedVariables"], 300)
        page = e.values(many["variablesReference"], filter="indexed", start=5, count=3)
        self.assertEqual({n: v["value"] for n, v in page.items()},
                         {"[6]": "0", "[7]": "70", "[8]": "0"})
        self.assertEqual(e.values(many["variablesReference"], filter="named"), {})
        self.assertEqual(len(e.values(many["variablesReference"])), 300)
        parts = e.values(all["parts"]["variablesReference"])
        self.assertEqual(list(parts), ["[0]", "[1]"])
        self.assertEqual(parts["[0]"]["namedVariables"], 2)
        pose = e.values(all["home"]["variablesReference"])
        self.assertEqual(len(pose), 2)
        self.assertEqual(all["rest"]["variablesReference"], 0)
        frame = e.frames(thread)[0]["id"]
        ask = lambda text, **more: e.ask("evaluate", expression=text, frameId=frame, **more)
        self.assertEqual(ask("n * 2 + many[7]", context="hover")["result"], "76")
        self.assertEqual(ask("sum := 1000", context="repl")["result"], "1000")
        self.assertEqual(ask("parts[1].place.X := 2.5;", context="repl")["result"], "2.5")
        self.assertEqual(e.ask("setExpression", expression="many[7]", value="7",
                               frameId=frame)["value"], "7")
        place = e.values(e.values(parts["[1]"]["variablesReference"])["place"]
                         ["variablesReference"])
        self.assertEqual(place["X"]["value"], "2.5")
        for wrong, why in (("nothing", "nothing that has a value is named NOTHING"),
                           ("many[301]", "outside 1..300"), ("n +", "is not a value"),
                           ("add(1)", "a debugger cannot call functions")):
            self.assertIn(why, e.refused("evaluate", expression=wrong, frameId=frame))
        self.assertIn("are allowed only in the console", e.refused("evaluate", expression="sum := 1",
                                                            frameId=frame, context="hover"))
        self.assertIn("is INT", e.refused("setExpression", expression="sum", value="'x'",
                                          frameId=frame))
        labels = lambda text, **more: [t["label"] for t in e.ask(
            "completions", text=text, column=len(text) + 1, frameId=frame, **more)["targets"]]
        self.assertEqual(labels("tw"), ["twice"])
        self.assertEqual(labels("1 + parts[0].pl"), ["place"])
        self.assertIn("sum", labels(""))
        e.ask("setBreakpoints", source={"path": path}, breakpoints=[])
        e.ask("continue", threadId=thread)
        self.assertEqual(e.event("exited")["exitCode"], 0)
        self.assertIn("sum 1012", e.output("stdout"))
        self.done(e)

    def test_log_points_hits_and_functions(self):
        e = self.editor()
        path = self.write("count.irl", COUNT)
        line = self.line(path, "sum := sum + n")

        def then(editor):
            got = editor.ask("setFunctionBreakpoints", breakpoints=[
                {"name": "ADD", "hitCondition": "%4"}, {"name": "nobody"}])["breakpoints"]
            self.assertEqual([b["verified"] for b in got], [True, False])
            self.assertEqual(got[0]["line"], self.line(path, "twice := 2"))
            self.assertIn("no routine nobody", got[1]["message"])
            self.function = got[0]["id"]
        e.launch({path: [{"line": line, "logMessage": "n is {n}, {word} { and so on"},
                         {"line": line, "logMessage": "n is {n}, {nothing}"},
                         {"line": line, "hitCondition": "<= 1"}, {"line": line, "hitCondition": "x"},
                         {"line": self.line(path, "ENDFOR") + 1}]}, then, program=path)
        self.assertEqual([b["verified"] for b in e.set[path]], [True, False, True, False, True])
        self.assertIn("nothing", e.set[path][1]["message"])
        self.assertIn("does not define which hits", e.set[path][3]["message"])
        self.assertEqual(e.set[path][4]["line"], self.line(path, "WRITELN"))  # moved to code
        at = e.stopped("breakpoint")
        self.assertEqual(at["hitBreakpointIds"], [e.set[path][2]["id"]])
        thread = at["threadId"]
        e.ask("continue", threadId=thread)
        at = e.stopped("function breakpoint")
        self.assertEqual(at["hitBreakpointIds"], [self.function])
        self.assertEqual(e.values(e.scope(thread, "Locals"))["n"]["value"], "4")
        e.ask("continue", threadId=thread)
        e.stopped("breakpoint")
        e.ask("continue", threadId=thread)
        self.assertEqual(e.event("exited")["exitCode"], 0)
        logged = re.findall(r"count, line %d: (.*)" % line, e.output("console"))
        self.assertEqual([l.split(",")[0] for l in logged], ["n is %d" % n for n in range(1, 6)])
        self.assertIn("a{b}", logged[0])
        self.done(e)

    def test_a_fault_is_looked_at(self):
        text = COUNT.replace("many[7] := 70;", "i := 400; many[i] := 70;")
        for breaks in (True, False):
            e = self.editor()
            path = self.write("count.irl", text)
            e.launch(then=lambda x: x.ask("setExceptionBreakpoints",
                                          filters=["fault"] if breaks else []), program=path)
            if breaks:
                at = e.stopped("exception")
                self.assertIn("400", at["text"])
                info = e.ask("exceptionInfo", threadId=at["threadId"])
                self.assertEqual((info["exceptionId"], info["breakMode"]), ("fault", "unhandled"))
                top = e.frames(at["threadId"])[0]
                self.assertEqual(top["line"], self.line(path, "many[i]"))
                self.assertEqual(e.ask("evaluate", expression="i", frameId=top["id"])["result"],
                                 "400")
                e.ask("continue", threadId=at["threadId"])
            self.done(e, 1)

    def test_pause_speed_terminate(self):
        e = self.editor()
        path = self.write("long.irl", "PROGRAM long;\nVAR INT: i;\nBEGIN\n  WHILE TRUE\n    "
                                      "WAIT 0.5 SEC;\n    i := i + 1;\n  ENDWHILE;\nENDPROGRAM;\n")
        begin = time.time()
        e.launch({path: [{"line": 6, "hitCondition": "2"}]}, program=path, speed="real")
        thread = e.stopped("breakpoint")["threadId"]
        self.assertGreater(time.time() - begin, 0.9)  # the clock's second
        e.ask("continue", threadId=thread)
        self.assertIn("run", e.refused("stackTrace", threadId=thread))
        self.assertEqual(len(e.ask("threads")["threads"]), 1)
        e.ask("pause", threadId=thread)
        e.stopped("pause")
        self.assertIn(e.frames(thread)[0]["line"], (5, 6))
        self.assertIn("are not running", e.refused("pause", threadId=thread))
        e.ask("continue", threadId=thread)
        e.ask("terminate")
        self.done(e, 130)

    def test_a_program_that_computes_without_end_is_paused(self):
        e = self.editor()
        path = self.write("whirl.irl", "PROGRAM whirl;\nVAR INT: i;\nBEGIN\n  WHILE TRUE\n"
                                      "    i := (i + 1) MOD 7;\n  ENDWHILE;\nENDPROGRAM;\n")
        e.launch({path: [{"line": 4, "condition": "i = 9"}]}, program=path)
        time.sleep(0.1)
        e.ask("pause", threadId=1)
        thread = e.stopped("pause")["threadId"]
        self.assertIn(e.frames(thread)[0]["line"], (4, 5))
        e.ask("setBreakpoints", source={"path": path}, breakpoints=[])
        e.ask("continue", threadId=thread)
        # Nobody pauses it: it is a fault.
        self.assertIn("loops endlessly", e.stopped("exception")["text"])
        self.done(e)

    def test_restart_takes_what_was_edited(self):
        e = self.editor()
        path = self.write("count.irl", COUNT)
        e.launch({path: [{"line": self.line(path, "WRITELN")}]}, program=path, stopAtEnd=True)
        thread = e.stopped("breakpoint")["threadId"]
        self.write("count.irl", COUNT.replace("1 TO 5", "1 TO 6").replace("BEGIN\n  home",
                                                                          "BEGIN\n\n  home"))
        e.ask("restart")
        e.stopped("breakpoint")  # moved to where the code is now
        self.assertEqual(e.frames(thread)[0]["line"], self.line(path, "WRITELN"))
        self.assertEqual(e.frames(thread)[0]["source"]["path"], path)
        e.ask("continue", threadId=thread)
        self.assertIn("ended", e.stopped("pause")["description"])
        self.assertEqual(e.ask("evaluate", expression="sum")["result"], "21")
        e.ask("reverseContinue", threadId=thread)
        e.stopped("breakpoint")
        e.ask("setBreakpoints", source={"path": path}, breakpoints=[])
        e.ask("continue", threadId=thread)
        self.done(e, 0)

    def test_sources_without_a_file_are_asked_for(self):
        e = self.editor(linesStartAt1=False, columnsStartAt1=False)
        script = self.write("made.lua", "local w = world.create{name = 'w'}\n"
                            "local p = program.create{name = 'p', source = [[\n%s]]}\n"
                            "w:add_program{program = p}\nprint('made', ...)\nreturn w\n" % COUNT)
        e.launch(program=script, args=["x"], stopOnEntry=True)
        self.assertIn("made\tx", e.output("stdout"))
        thread = e.stopped("entry")["threadId"]
        source = e.frames(thread)[0]["source"]
        self.assertNotIn("path", source)
        number = source["sourceReference"]
        content = e.ask("source", sourceReference=number, source=source)["content"]
        self.assertEqual(content.strip(), COUNT.strip())
        self.assertEqual(e.ask("loadedSources")["sources"], [source])
        row = content.split("\n").index("  sum := sum + n;")
        got = e.ask("setBreakpoints", source=source, breakpoints=[{"line": row}])["breakpoints"]
        self.assertEqual((got[0]["verified"], got[0]["line"], got[0]["column"]), (True, row, 2))
        e.ask("continue", threadId=thread)
        e.stopped("breakpoint")
        self.assertEqual(e.frames(thread)[0]["line"], row)
        # A file with its text turns up.
        copy = self.write("p.irl", content)
        e.ask("setBreakpoints", source={"path": copy}, breakpoints=[])
        self.assertEqual(e.frames(thread)[0]["source"], {"name": "p.irl", "path": copy})
        e.ask("terminate")
        self.done(e, 130)

    def test_without_debugging(self):
        e = self.editor()
        path = self.write("count.irl", COUNT)
        e.launch({path: [{"line": 23}]}, program=path, noDebug=True, stopOnEntry=True)
        self.assertFalse(e.set[path][0]["verified"])
        self.done(e, 0)


class Extension(Debugging):
    def test_the_attributes_of_the_extension_are_read(self):
        """The extension for VS Code declares what launch and attach read: a value of a wrong type
        is refused by name."""
        with open(os.path.join(SAMPLES, "../../sdk/editors/vscode/package.json"),
                  encoding="utf-8") as f:
            debugger = json.load(f)["contributes"]["debuggers"][0]
        self.assertEqual([debugger["runtime"]] + debugger["runtimeArgs"],
                         ["robomosp", "debug-adapter"])
        good = {"launch": {"program": "/nowhere.irl"}, "attach": {"address": "127.0.0.1:9"}}
        for request, arguments in good.items():
            properties = debugger["configurationAttributes"][request]["properties"]
            for name, about in properties.items():
                base = {"port": 9} if name in ("host", "port") else arguments
                e = self.editor()
                self.assertIn(name, e.refused(request, **{**base, name: {"x": 1}}))
                self.assertTrue(about["description"])
                self.done(e)


class Requests(Debugging):
    def test_what_is_wrong_is_said(self):
        e = self.editor()
        self.assertIn("may be sent only once", e.refused("initialize"))
        self.assertIn("launch or attach must come first", e.refused("threads"))
        self.assertIn("no request", e.refused("nonsense"))
        self.assertIn("is not supported", e.refused("readMemory"))
        self.assertIn("launch needs program", e.refused("launch"))
        self.assertIn("program is a text", e.refused("launch", program=3))
        self.assertIn("nowhere.irl", e.refused("launch", program="/nowhere.irl"))
        self.assertIn("speed must be", e.refused("launch", program="x.irl", speed=-1))
        self.assertIn("args must be a list", e.refused("launch", program="x.lua", args=[1]))
        self.assertIn("attach needs address", e.refused("attach"))
        self.assertIn("127.0.0.1:9", e.refused("attach", port=9))
        wrong = self.write("wrong.irl", "PROGRAM wrong;\nBEGIN\n  i := ;\nENDPROGRAM;\n")
        self.assertIn("wrong.irl", e.refused("launch", program=wrong))
        script = self.write("wrong.lua", "error('no luck')")
        self.assertIn("no luck", e.refused("launch", program=script))
        script = self.write("none.lua", "return 1")
        self.assertIn("no loaded world has a program", e.refused("launch", program=script))
        path = self.write("count.irl", COUNT)
        # Before it is there, breakpoints wait.
        early = e.ask("setBreakpoints", source={"path": path}, breakpoints=[
            {"line": self.line(path, "sum := sum + n")}])["breakpoints"][0]
        self.assertFalse(early["verified"])
        self.assertEqual(e.end(e.begin("launch", program=path))["success"], True)
        now = e.event("breakpoint")["breakpoint"]
        self.assertEqual((now["id"], now["verified"]), (early["id"], True))
        e.event("initialized")
        self.assertIn("already", e.refused("launch", program=path))
        self.assertIn("have not started", e.refused("continue", threadId=1))
        e.ask("configurationDone")
        thread = e.stopped("breakpoint")["threadId"]
        self.assertIn("may be sent only once", e.refused("configurationDone"))
        self.assertIn("there is no thread 99", e.refused("stackTrace", threadId=99))
        self.assertIn("no threadId", e.refused("next"))
        self.assertIn("there is no frame 4711", e.refused("scopes", frameId=4711))
        self.assertIn("there is no frame", e.refused("evaluate", expression="i", frameId=-1))
        self.assertIn("no variablesReference", e.refused("variables", variablesReference=777))
        self.assertIn("no expression", e.refused("evaluate"))
        self.assertIn("No program has a fault", e.refused("exceptionInfo", threadId=thread))
        self.assertIn("no source", e.refused("setBreakpoints"))
        self.assertIn("breakpoints must be a list", e.refused("setBreakpoints", source={"path": path},
                                                         breakpoints=7))
        self.assertIn("whole number", e.refused("setBreakpoints", source={"path": path},
                                                breakpoints=[{"line": "3"}]))
        self.assertIn("at most", e.refused("setBreakpoints", source={"path": path},
                                           breakpoints=[{"line": 1}] * 100001))
        got = e.ask("setBreakpoints", source={"path": "/other/file.irl"}, breakpoints=[
            {"line": 1}, {"line": 0}, {"line": -5}, {"line": 2 ** 40}])["breakpoints"]
        self.assertEqual([b["verified"] for b in got], [False] * 4)
        self.assertIn("no program of the run has a file".lower(), got[0]["message"].lower())
        self.assertIn("no such target", e.refused("goto", threadId=thread, targetId=1).lower())
        self.assertIn("reached this line", e.refused("gotoTargets", source={"path": path}, line=1))
        self.assertIn("no source 12", e.refused("source", sourceReference=12))
        self.assertEqual(e.ask("setExceptionBreakpoints", filters=["all"])["breakpoints"][0][
            "verified"], False)
        e.ask("cancel", requestId=12345)
        # No requests, or none that can be answered.
        for message in (b"{nonsense", b"[]", b"7", b"[" * 100000, b"\xff\xfe",
                        {"type": "request", "command": "threads"},
                        {"seq": 1, "type": "response"}, {"seq": "x", "type": "request"}):
            e.send(message)
        e.ask("threads")
        self.assertEqual(e.output("important").count("is ignored"), 8)
        frame = e.frames(thread)[0]["id"]
        e.ask("next", threadId=thread)
        e.stopped("step")
        self.assertIn("there is no frame", e.refused("scopes", frameId=frame))  # of another stop
        e.ask("terminate")
        self.assertIn("have ended", e.refused("next", threadId=thread))
        self.done(e, 130)

    def test_a_launch_that_takes_long_is_cancelled(self):
        e = self.editor()
        script = self.write("long.lua", "while true do end")
        number = e.begin("launch", program=script)
        time.sleep(0.3)
        e.ask("cancel", requestId=number)
        m = e.end(number, 20)
        self.assertEqual((m["success"], m["message"]), (False, "cancelled"))
        number = e.begin("launch", program=script)
        time.sleep(0.3)
        begin = time.time()
        waits = e.begin("threads")
        e.ask("cancel", requestId=waits)
        self.assertEqual(e.close(), 0)
        self.assertLess(time.time() - begin, 20)
        self.assertEqual(e.end(waits)["message"], "cancelled")
        self.assertEqual(e.faults, [])

    def test_the_end_of_input_ends_it(self):
        script = self.write("long.lua", "while true do end")
        hello = frame({"seq": 1, "type": "request", "command": "initialize", "arguments": {}})
        for data, code in ((b"", 1), (hello, 1), (hello + frame(
                {"seq": 2, "type": "request", "command": "disconnect"}), 0),
                (hello + frame({"seq": 2, "type": "request", "command": "launch",
                                "arguments": {"program": script}}), 1),
                (b"Content-Length: 99999999999\r\n\r\n", 1), (b"X: 1\r\n\r\n", 1),
                (b"x" * 100000, 1)):
            process = start("debug-adapter")
            process.communicate(data, timeout=60)
            self.assertEqual(process.returncode, code, data[:80])

    def test_it_does_not_grow(self):
        e = self.editor()
        path = self.write("count.irl", COUNT.replace("1 TO 5", "1 TO 100000"))
        e.launch({path: [{"line": self.line(path, "sum := sum + n")}]}, program=path)
        thread = e.stopped("breakpoint")["threadId"]

        def round_trip(n):
            for _ in range(n):
                e.values(e.scope(thread, "Program"))
                e.ask("evaluate", expression="sum", context="hover")
                e.ask("setBreakpoints", source={"path": path}, breakpoints=[
                    {"line": self.line(path, "sum := sum + n")}])
        round_trip(50)
        before = self.memory(e)
        round_trip(400)
        self.assertLess(self.memory(e) - before, 4 << 20)
        e.ask("terminate")
        self.done(e, 130)

    @staticmethod
    def memory(e):
        with open("/proc/%d/statm" % e.process.pid) as f:
            return int(f.read().split()[1]) * 4096


class Attached(Debugging):
    def serve(self, script):
        process = subprocess.Popen([PROGRAM, "serve", script, "--listen", "127.0.0.1:0"],
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        for line in process.stdout:
            if line.startswith("Listening on "):
                return line.split()[-1]
        self.fail("it does not serve")

    def script(self, rest):
        return self.write("cell.lua", "local w = world.create{name = 'w'}\n"
                          "local p = program.create{name = 'count', source = [[\n%s]]}\n"
                          "w:add_program{program = p}\n%s\n" % (COUNT, rest))

    def test_a_run_of_a_program_that_serves(self):
        address = self.serve(self.script("shown = w:start_run('tasks')"))
        e = self.editor()
        path = self.write("count.irl", COUNT)
        line = self.line(path, "sum := sum + n")
        e.ask("attach", address=address)
        e.event("initialized")
        e.configure({path: [{"line": line}]})
        self.assertTrue(e.set[path][0]["verified"])
        thread = e.stopped("pause")["threadId"]  # as it was left
        e.ask("continue", threadId=thread)
        self.assertEqual(e.stopped("breakpoint")["hitBreakpointIds"], [e.set[path][0]["id"]])
        self.assertEqual(e.values(e.scope(thread, "Locals"))["n"]["value"], "2")
        self.assertEqual(e.ask("evaluate", expression="sum := 50", context="repl",
                               frameId=e.frames(thread)[0]["id"])["result"], "50")
        self.done(e)
        # The run is still there, without the breakpoints.
        again = self.editor()
        host, port = address.rsplit(":", 1)
        again.ask("attach", host=host, port=int(port), run="w: tasks")
        again.event("initialized")
        again.ask("configurationDone")
        again.stopped()
        again.ask("continue", threadId=1)
        self.assertEqual(again.event("exited")["exitCode"], 0)
        self.assertIn("sum 64", again.output("stdout"))
        self.done(again)

    def test_a_world_of_a_program_that_serves(self):
        address = self.serve(self.script(""))
        e = self.editor()
        self.assertIn("no live run", e.refused("attach", address=address))
        self.assertIn("nowhere", e.refused("attach", address=address, world="nowhere"))
        e.ask("attach", address=address, world="w", stopOnEntry=True)
        e.event("initialized")
        e.configure({})
        thread = e.stopped("entry")["threadId"]
        self.assertIn("sourceReference", e.frames(thread)[0]["source"])
        e.ask("continue", threadId=thread)
        self.done(e, 0)


class BrokenClients(Debugging):
    def test_no_bytes_crash_it_or_make_it_hang(self):
        seeds = random.Random(SEED)
        print("seed %d (set ROBOMOSP_TEST_SEED to repeat)" % SEED)
        path = self.write("count.irl", COUNT)
        source = {"path": path}

        def request(command, **arguments):
            return {"seq": 1, "type": "request", "command": command, "arguments": arguments}
        begin = [frame(request("initialize", linesStartAt1=True)),
                 frame(request("launch", program=path, stopOnEntry=True)),
                 frame(request("configurationDone"))]
        good = [frame(r) for r in (
            request("setBreakpoints", source=source, breakpoints=[
                {"line": 17, "condition": "n = 2", "logMessage": "{n}", "hitCondition": ">1"}]),
            request("setFunctionBreakpoints", breakpoints=[{"name": "add"}]),
            request("setExceptionBreakpoints", filters=["fault"]),
            request("threads"), request("stackTrace", threadId=1, startFrame=0, levels=20),
            request("scopes", frameId=1), request("variables", variablesReference=2),
            request("variables", variablesReference=3, start=1, count=10),
            request("setVariable", variablesReference=2, name="sum", value="3"),
            request("evaluate", expression="parts[0].place.X + many[3]", frameId=1),
            request("evaluate", expression="sum := 4", frameId=1, context="repl"),
            request("completions", text="parts[0].pl", column=12, frameId=1),
            request("gotoTargets", source=source, line=23), request("goto", threadId=1, targetId=1),
            request("next", threadId=1), request("stepIn", threadId=1),
            request("stepOut", threadId=1), request("stepBack", threadId=1),
            request("continue", threadId=1), request("reverseContinue", threadId=1),
            request("pause", threadId=1), request("loadedSources"), request("source"),
            request("breakpointLocations", source=source, line=1, endLine=99),
            request("exceptionInfo", threadId=1), request("cancel", requestId=1),
            request("restart"), request("terminate"), *[]) ]
        pieces = [b"-1", b"0", b"4294967296", b"99999999999999999999", b"1e999", b"null", b"[]",
                  b"{}", b'"', b"\\ud800", b"\xff", b"true", b"Content-Length: 5\r\n\r\n",
                  b"Content-Length: 99999999999999999999\r\n\r\n", b"\r\n\r\n", b"\0", b"'", b"((("]
        deadline = time.time() + FUZZ_SECONDS
        runs = messages = 0
        most = 0
        while time.time() < deadline:
            runs += 1
            process = start("debug-adapter")
            data = bytearray(b"".join(begin) if runs % 8 else b"")
            for _ in range(60):
                one = bytearray(seeds.choice(good))
                kind = seeds.randrange(6)
                at = seeds.randrange(len(one))
                if kind == 0 and runs % 3 == 0:
                    one[at:at + seeds.randrange(8)] = seeds.choice(pieces)
                elif kind == 1 and runs % 5 == 0:
                    del one[at:]
                elif kind in (2, 3):
                    # The length stays right, so that what is within is read.
                    body = one[one.index(b"\r\n\r\n") + 4:]
                    spot = seeds.randrange(len(body))
                    body[spot:spot + seeds.randrange(12)] = seeds.choice(pieces)
                    one = bytearray(frame(bytes(body)))
                elif kind == 4:
                    # A value of another kind.
                    m = json.loads(one[one.index(b"\r\n\r\n") + 4:])
                    names = list(m["arguments"]) or ["x"]
                    m["arguments"][seeds.choice(names)] = seeds.choice(
                        [None, -1, 2 ** 63, 1.5, "", "\0", [], {}, [[]], True, "x" * 20000,
                         {"path": path}, {"sourceReference": 1}, [{"line": 1}] * 50])
                    one = bytearray(frame(m))
                data += one
                messages += 1
            if seeds.randrange(2):
                data += frame(request("disconnect"))
            try:
                out, _ = process.communicate(bytes(data), timeout=60)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                self.fail("it hangs at %r" % bytes(data[-400:]))
            self.assertIn(process.returncode, (0, 1), bytes(data))
            # Whatever came in, what goes out are messages with numbers in turn.
            seq = 0
            while out:
                head, _, rest = out.partition(b"\r\n\r\n")
                length = int(head.split(b":")[1])
                m = json.loads(rest[:length].decode("utf-8"))
                seq += 1
                self.assertEqual(m["seq"], seq)
                most = max(most, length)
                out = rest[length:]
        print("%d broken clients, %d messages, longest answer %d bytes" % (runs, messages, most))
        self.assertGreater(runs, 1)


if __name__ == "__main__":
    unittest.main()
