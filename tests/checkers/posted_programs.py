# SPDX-License-Identifier: Apache-2.0
"""Readers of posted programs, written from the rules of each language: AS, INFORM, Movemaster, PacScript, PDL2, CRCL.
A program is carried out as its controller would, with its variables, loops and routines, and each thing that it makes
the controller do is a line of text:

    kind;motion;speed;share;signals;truth;numbers

kind: joints, pose, step, output, wait, condition; motion: ptp, lin, circle; speed [mm/s] and share [%] are "-" where
the language says none. numbers: joints [degrees], x y z [mm] and the quaternion w x y z, the value, seconds, or the
TIMEOUT (-1 = none). truth: of a condition, for each of the inputs' values, the first input counting 1.

    posted_programs.py LANGUAGE [NAME=VALUE]... FILE...

"==== 0" stands before the lines of each file. A statement that a reader does not know is a fault with its line, behind
"==== 1"."""
import math
import re
import sys
import xml.etree.ElementTree

MOST_STEPS = 200000


class Fault(Exception):
    pass


# ---- places: (rows of the rotation, position) ----

IDENTITY = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, 0.0])


def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    rows = [[float(i == j) for j in range(3)] for i in range(3)]
    rows[a][a], rows[a][b], rows[b][a], rows[b][b] = c, -s, s, c
    return rows


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turns(*pairs):
    out = IDENTITY[0]
    for axis, degrees in pairs:
        out = times(out, turn(axis, degrees))
    return out


def apply(rows, v):
    return [sum(rows[i][k] * v[k] for k in range(3)) for i in range(3)]


def compose(a, b):
    return times(a[0], b[0]), [x + y for x, y in zip(apply(a[0], b[1]), a[1])]


def inverse(a):
    back = [[a[0][j][i] for j in range(3)] for i in range(3)]
    return back, [-x for x in apply(back, a[1])]


def zyz(n):
    return turns((2, n[3]), (1, n[4]), (2, n[5])), list(n[:3])


def fixed_xyz(n):
    return turns((2, n[5]), (1, n[4]), (0, n[3])), list(n[:3])


def quaternion(r):
    """Of the four the greatest part first, from the diagonal."""
    squares = [1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
               1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2]]
    k = squares.index(max(squares))
    d = math.sqrt(squares[k]) * 2
    a, b, c = (r[2][1] - r[1][2]) / d, (r[0][2] - r[2][0]) / d, (r[1][0] - r[0][1]) / d
    xy, xz, yz = (r[0][1] + r[1][0]) / d, (r[0][2] + r[2][0]) / d, (r[1][2] + r[2][1]) / d
    return [(d / 4, a, b, c), (a, d / 4, xy, xz), (b, xy, d / 4, yz), (c, xz, yz, d / 4)][k]


def is_place(v):
    return isinstance(v, tuple)


# ---- what a program does ----

class Record:
    def __init__(self):
        self.lines = []
        self.here = None  # the pose of the tip where the last motion ended, if the program says it
        self.tool = IDENTITY

    def add(self, kind, motion="-", speed=None, share=None, signals=(), truth="", numbers=()):
        self.lines.append(";".join((
            kind, motion, "-" if speed is None else repr(float(speed)), "-" if share is None else repr(float(share)),
            " ".join(str(s) for s in signals), truth, " ".join(repr(float(n)) for n in numbers))))

    def pose(self, motion, p, speed=None, share=None, until=None):
        signals, truth = until or ((), "")
        self.add("pose", motion, speed, share, signals, truth, list(p[1]) + list(quaternion(p[0])))
        self.here = None if until else p

    def joints(self, motion, q, share=None, until=None):
        signals, truth = until or ((), "")
        self.add("joints", motion, None, share, signals, truth, q)
        self.here = None

    def take(self, tool):
        """Another tool: its tip is elsewhere, and a step begins there."""
        if tool != self.tool:
            self.here = None
        self.tool = tool

    def by(self, motion, way, speed=None, share=None):
        """By so much in the axes of the base."""
        if self.here:
            self.pose(motion, (self.here[0], [a + b for a, b in zip(self.here[1], way)]), speed, share)
        else:
            self.add("step", motion, speed, share, numbers=list(way) + [1, 0, 0, 0])

    def output(self, number, value):
        self.add("output", signals=[number], numbers=[value])

    def bits(self, first, width, value):
        for k in range(width):
            self.output(first + k, (int(value) >> k) & 1)

    def wait(self, seconds):
        self.add("wait", numbers=[seconds])

    def condition(self, table, timeout=-1):
        self.add("condition", signals=table[0], truth=table[1], numbers=[timeout])


# ---- languages with variables and control flow ----

TOKEN = re.compile(r"""\s*(?:
    (?P<number>\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+)
  | (?P<text>'[^']*'|"[^"]*")
  | (?P<name>[.\#$]?[A-Za-z_][A-Za-z_0-9]*)
  | (?P<sign>:=|<>|<=|>=|==|[-+*/\\^=<>()\[\]{},:;@&?])
)""", re.VERBOSE)


def tokens(text):
    out, at = [], 0
    while at < len(text.rstrip()):
        m = TOKEN.match(text, at)
        if not m:
            raise Fault("what is %r" % text[at:at + 20])
        out.append((m.lastgroup, m.group(m.lastgroup)))
        at = m.end()
    return out


class Place:
    """Where a value is kept."""

    def __init__(self, kept, key, kind=None):
        self.kept, self.key, self.kind = kept, key, kind

    def get(self):
        if self.key not in self.kept:
            raise Fault("%s has no value yet" % (self.key,))
        return self.kept[self.key]


def number(v):
    if isinstance(v, bool) or not isinstance(v, (int, float)):
        raise Fault("%r is no number" % (v,))
    return v


def truth(v):
    if not isinstance(v, bool):
        raise Fault("%r is not true or false" % (v,))
    return v


def equal(a, b):
    if isinstance(a, bool) != isinstance(b, bool):
        raise Fault("%r and %r are not compared" % (a, b))
    return a == b


class Returned(Exception):
    pass


class Left(Exception):
    """Exit Do, Exit For."""


class Halted(Exception):
    pass


class Jump(Exception):
    """To a label of this block or of one around it."""


class Reader:
    """Expressions by precedence, blocks, variables; statements are those of the language."""
    binary = {}   # word: (precedence, function of two values)
    unary = {}    # word: (precedence of the operand, function)
    blocks = {}   # kind: (opens, [goes on], closes), of the statement's text
    labels = ""   # of a statement that is one, with its name

    def __init__(self, text, options):
        self.record = Record()
        self.options = options
        self.globals = {}
        self.kinds = {}
        self.locals = None
        self.routines = {}
        self.outputs = {}
        self.timers = {}
        self.elapsed = 0.0
        self.asked = None   # inputs that a condition asks for, in their order
        self.values = {}
        self.steps = 0
        self.line = 0
        self.toks, self.at = [], 0
        self.read(text)

    # ---- expressions ----
    def peek(self, k=0):
        return self.toks[self.at + k][1].upper() if self.at + k < len(self.toks) else ""

    def take(self, *words):
        if self.peek() not in words:
            return False
        self.at += 1
        return True

    def expect(self, word):
        if not self.take(word):
            raise Fault("%s is missing before %r" % (word, self.peek()))

    def value(self, text):
        kept = self.toks, self.at
        self.toks, self.at = tokens(text), 0
        try:
            v = self.expression()
            if self.at < len(self.toks):
                raise Fault("%r follows an expression" % self.peek())
            return v
        finally:
            self.toks, self.at = kept

    def arguments(self, close=")"):
        out = []
        while not self.take(close):
            out.append(self.expression())
            if self.peek() != close:
                self.expect(",")
        return out

    def expression(self, least=0):
        word = self.peek()
        kind = self.toks[self.at][0] if self.at < len(self.toks) else ""
        if word in self.unary and kind != "text":
            self.at += 1
            level, of = self.unary[word]
            left = of(self.expression(level))
        else:
            left = self.primary()
        while self.peek() in self.binary and self.binary[self.peek()][0] >= least:
            level, of = self.binary[self.peek()]
            self.at += 1
            left = of(left, self.expression(level + 1))
        return left

    def primary(self):
        if self.at >= len(self.toks):
            raise Fault("an expression ends early")
        kind, word = self.toks[self.at]
        self.at += 1
        if kind == "number":
            return float(word) if re.search("[.eE]", word) else int(word)
        if kind == "text":
            return word[1:-1]
        if word == "(":
            v = self.expression()
            self.expect(")")
            return v
        if kind != "name":
            raise Fault("%r begins an expression" % word)
        return self.named(word)

    # ---- inputs ----
    def ask(self, n):
        if self.asked is None:
            raise Fault("what the program does depends on input %d" % n)
        if n not in self.asked:
            self.asked.append(n)
        return self.values.get(n, False)

    def table(self, condition):
        """Inputs of a condition, and what it says for each of their values."""
        self.asked, self.values = [], {}
        condition()
        while True:  # those that are asked where others are true
            known = list(self.asked)
            said = ""
            for bits in range(1 << len(known)):
                self.values = {n: bool(bits >> k & 1) for k, n in enumerate(known)}
                said += "1" if truth(condition()) else "0"
            if len(self.asked) == len(known):
                break
        self.asked, self.values = None, {}
        return known, said

    def wait_until(self, condition):
        """A condition that is asked until it holds; the time after which it holds anyway is looked for."""
        self.elapsed = 0.0
        known, said = self.table(condition)
        self.asked = list(known)
        low, high = 0.0, 1e6

        def over(t):
            self.elapsed = t
            for bits in range(1 << len(known)):
                self.values = {n: bool(bits >> k & 1) for k, n in enumerate(known)}
                if not truth(condition()):
                    return False
            return True

        timeout = -1
        if over(high) and not over(low):
            while high - low > 1e-4:
                middle = (low + high) / 2
                low, high = (low, middle) if over(middle) else (middle, high)
            timeout = high
        self.asked, self.values, self.elapsed = None, {}, 0.0
        self.record.condition((known, said), timeout)

    # ---- variables ----
    def variable(self, name):
        key = name.lower()
        if self.locals is not None and key in self.locals:
            return self.locals[key]
        return Place(self.globals, key, self.kinds.get(key))

    def put(self, place, v):
        place.kept[place.key] = v

    def assign(self, target, text):
        """target: NAME or NAME[i, ...]; the value first."""
        v = self.value(text)
        self.put(self.place_of(target), v)

    def place_of(self, text):
        kept = self.toks, self.at
        self.toks, self.at = tokens(text), 0
        try:
            kind, word = self.toks[0]
            if kind != "name":
                raise Fault("a value is given to %r" % word)
            self.at = 1
            p = self.element(self.variable(word))
            if self.at < len(self.toks):
                raise Fault("a value is given to %r" % text)
            return p
        finally:
            self.toks, self.at = kept

    def element(self, place):
        if self.take("["):
            index = tuple(self.arguments("]"))
            if not all(isinstance(i, int) or float(i).is_integer() for i in index):
                raise Fault("an index is %s" % (index,))
            return Place(place.kept, (place.key,) + tuple(int(i) for i in index), place.kind)
        return place

    # ---- blocks ----
    def parse(self, lines, ends=()):
        """The statements until one of `ends`, which is taken too: (block, the match)."""
        block = []
        while lines:
            n, text = lines.pop(0)
            self.line = n
            for end in ends:
                m = re.fullmatch(end, text, re.I)
                if m:
                    return block, m
            for kind, (opens, middles, closes) in self.blocks.items():
                m = re.fullmatch(opens, text, re.I)
                if not m:
                    continue
                parts, head = [], m
                while True:
                    inner, end = self.parse(lines, list(middles) + [closes])
                    parts.append((head, inner))
                    if end is None:
                        self.line = n
                        raise Fault("%s has no end" % text)
                    head = end
                    if re.fullmatch(closes, end.group(0), re.I):
                        break
                block.append((n, kind, parts, head))
                break
            else:
                block.append((n, "line", text, None))
        return block, None

    def run(self, block):
        i = 0
        while i < len(block):
            n, kind, parts, end = block[i]
            i += 1
            self.line = n
            self.steps += 1
            if self.steps > MOST_STEPS:
                raise Fault("the program does not end")
            try:
                if kind != "line":
                    getattr(self, "run_" + kind)(parts, end)
                elif not self.label(parts):
                    self.statement(parts)
            except Jump as to:
                here = [k for k, b in enumerate(block) if b[1] == "line" and self.label(b[2]) == to.args[0].lower()]
                if not here:
                    raise
                i = here[0]

    def label(self, text):
        """Its name, where a statement is one."""
        m = re.fullmatch(self.labels, text)
        return m and m.group(1).lower()

    def run_if(self, parts, _):
        for head, inner in parts:
            if not head.groups() or head.group(1) is None or truth(self.value(head.group(1))):
                self.run(inner)
                return

    def turn_of_loop(self, inner):
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise Fault("a loop does not end")
        self.run(inner)

    def run_while(self, parts, _):
        head, inner = parts[0]
        try:
            while truth(self.value(head.group(1))):
                self.turn_of_loop(inner)
        except Left:
            pass

    def run_repeat(self, parts, end):
        inner = parts[0][1]
        condition = end.group(1) if end.groups() else None
        if condition and self.is_poll(inner):
            self.wait_until(lambda: self.value(condition))
            return
        try:
            while True:
                self.turn_of_loop(inner)
                if condition and truth(self.value(condition)):
                    return
        except Left:
            pass

    def is_poll(self, _):
        return False

    def run_for(self, parts, _):
        head, inner = parts[0]
        g = head.groupdict()
        place = self.place_of(g["name"])
        v, to = number(self.value(g["first"])), number(self.value(g["last"]))
        by = number(self.value(g["step"])) if g["step"] else 1
        if (g.get("down") or "").upper() == "DOWNTO":
            by = -by
        if by == 0:
            raise Fault("the step of a loop is 0")
        try:
            while v <= to if by > 0 else v >= to:
                self.put(place, v)
                self.turn_of_loop(inner)
                v = number(place.get()) + by
        except Left:
            pass

    def run_case(self, parts, _):
        (head, before), rest = parts[0], parts[1:]
        if before:
            raise Fault("a statement stands before the first case")
        v = self.value(head.group(1))
        for label, inner in rest:
            if not label.groups() or any(equal(v, self.value(t)) for t in split(label.group(1))):
                self.run(inner)
                return

    # ---- routines ----
    def enter(self, name, given):
        """given: places or values, by the parameters of the routine."""
        key = name.lower()
        if key not in self.routines:
            raise Fault("there is no routine %s" % name)
        r = self.routines[key]
        if len(given) != len(r["parameters"]):
            raise Fault("%s takes %d values and gets %d" % (name, len(r["parameters"]), len(given)))
        kept = self.locals, self.line, self.toks, self.at
        frame, own = {}, {}
        for (n, kind, by_value), a in zip(r["parameters"], given):
            if isinstance(a, Place) and not by_value:
                if kind != a.kind:
                    raise Fault("%s is of another type than the parameter %s" % (a.key, n))
                frame[n] = a
            else:
                frame[n] = Place(own, n, kind)
                self.put(frame[n], a.get() if isinstance(a, Place) else a)
        for n, kind in r["variables"]:
            frame[n] = Place(own, n, kind)
        self.locals = frame
        try:
            self.run(r["block"])
            v = None
        except Returned as back:
            v = back.args[0]
        result = frame[r["result"]].get() if v is None and r.get("result") else v
        self.locals, self.line, self.toks, self.at = kept
        return result

    def given(self):
        """What stands in the parentheses of a call: plain variables as their places."""
        out = []
        self.expect("(")
        while not self.take(")"):
            begin = self.at
            p = None
            if self.toks[self.at][0] == "name" and self.is_variable(self.toks[self.at][1]):
                self.at += 1
                p = self.element(self.variable(self.toks[begin][1]))
            if p is None or self.peek() not in (",", ")"):
                self.at = begin
                p = self.expression()
            out.append(p)
            if self.peek() != ")":
                self.expect(",")
        return out

    def go(self):
        try:
            self.run(self.main)
        except (Halted, Returned):
            pass


def split(text):
    """By the commas that stand in no parentheses."""
    out, depth, begin = [], 0, 0
    for i, c in enumerate(text):
        depth += c in "([{"
        depth -= c in ")]}"
        if c == "," and depth == 0:
            out.append(text[begin:i])
            begin = i + 1
    return out + [text[begin:]]


def sums(of_places):
    """+ of numbers, and of places where the language has it."""
    def add(a, b):
        if is_place(a) and is_place(b) and of_places:
            return compose(a, b)
        return number(a) + number(b)
    return add


def both(of):
    return lambda a, b: of(number(a), number(b))


COMPARISONS = {"<": both(lambda a, b: a < b), "<=": both(lambda a, b: a <= b), ">": both(lambda a, b: a > b),
               ">=": both(lambda a, b: a >= b), "<>": lambda a, b: not equal(a, b)}
LOGIC = {"AND": lambda a, b: truth(a) and truth(b), "OR": lambda a, b: truth(a) or truth(b),
         "XOR": lambda a, b: truth(a) != truth(b)}
DIVIDED = both(lambda a, b: a / b)
WHOLE = both(lambda a, b: int(math.trunc(a / b)))
REST = both(lambda a, b: math.fmod(a, b) if isinstance(a, float) or isinstance(b, float) else int(math.fmod(a, b)))
MINUS = both(lambda a, b: a - b)
TIMES = both(lambda a, b: a * b)
FUNCTIONS = {"SIN": lambda a: math.sin(math.radians(a)), "COS": lambda a: math.cos(math.radians(a)),
             "TAN": lambda a: math.tan(math.radians(a)), "SQRT": math.sqrt, "ABS": abs,
             "ATAN2": lambda a, b: math.degrees(math.atan2(a, b))}


class As(Reader):
    """Kawasaki AS: programs, transformations and joints in one file. Numbers are all real; a variable with a point is
    the program's own, the others are seen by all. SPEED, ACCURACY and their kin count for the next motion only."""
    binary = {"OR": (1, LOGIC["OR"]), "XOR": (1, LOGIC["XOR"]), "AND": (2, LOGIC["AND"]), "==": (4, equal),
              **{w: (4, f) for w, f in COMPARISONS.items()}, "+": (5, sums(True)), "-": (5, MINUS), "*": (6, TIMES),
              "/": (6, DIVIDED), "MOD": (6, REST)}
    unary = {"-": (7, lambda a: inverse(a) if is_place(a) else -number(a)), "NOT": (7, lambda a: not truth(a))}
    labels = r"(\d+)(?: ;.*)?"
    blocks = {"if": (r"IF (.+) THEN", [r"ELSE"], r"END"), "while": (r"WHILE (.+) DO", [], r"END"),
              "repeat": (r"DO", [], r"UNTIL (.+)"),
              "for": (r"FOR (?P<name>\S+) = (?P<first>.+?) TO (?P<last>.+?)(?: STEP (?P<step>.+))?", [], r"END"),
              "case": (r"CASE (.+) OF", [r"VALUE (.+):", r"ANY ?:"], r"END")}

    def read(self, text):
        self.next, self.via = None, None
        self.main = None
        lines, section = [], None
        for n, raw in enumerate(text.split("\n"), 1):
            l = raw.strip()
            self.line = n
            if not l or l.startswith(";"):
                continue
            m = re.fullmatch(r"\.PROGRAM (\w+)\((.*)\)", l)
            if m:
                section = m
            elif l in (".TRANS", ".JOINTS"):
                section = l
            elif l == ".END":
                if not isinstance(section, str):
                    block, _ = self.parse(lines)
                    names = [p.strip().lower() for p in section.group(2).split(",") if p.strip()]
                    self.routines[section.group(1).lower()] = {
                        "parameters": [(p, None, False) for p in names], "variables": [], "block": block}
                    self.main = self.main or block
                section, lines = None, []
            elif section == ".TRANS":
                name, *n6 = l.split()
                if len(n6) != 6:
                    raise Fault("a transformation of %d numbers" % len(n6))
                self.globals[name.lower()] = zyz([float(x) for x in n6])
            elif section == ".JOINTS":
                name, *q = l.split()
                self.globals[name.lower()] = [float(x) for x in q]
            elif section:
                lines.append((n, l))
            else:
                raise Fault("%r is in no program" % l)
        if section or not self.main:
            raise Fault("a program has no .END")
        self.locals = {}

    def variable(self, name):
        key = name.lower()
        if key.startswith("."):
            return self.locals.setdefault(key, Place({}, key))
        return Place(self.globals, key)

    def is_variable(self, word):
        return self.peek(1) != "(" and word.upper() not in ("TRUE", "FALSE", "HERE", "NULL", "NOT")

    def signal(self, n):
        """Inputs have numbers from 1001."""
        n = int(number(n))
        is_on = self.ask(abs(n) - 1000) if abs(n) > 1000 else self.state(abs(n))
        return is_on != (n < 0)

    def state(self, n):
        if n not in self.outputs:
            raise Fault("output %d is read, which was not set" % n)
        return bool(self.outputs[n])

    def named(self, word):
        w = word.upper()
        if w in ("TRUE", "FALSE"):
            return w == "TRUE"
        if w == "NULL":
            return IDENTITY
        if w == "HERE":
            if not self.record.here:
                raise Fault("where the robot is, is not known")
            return self.record.here
        if self.peek() != "(":
            return self.element(self.variable(word)).get()
        self.at += 1
        if w == "SHIFT":
            p = self.expression()
            self.expect("BY")
            way = [number(x) for x in self.arguments()]
            return p[0], [a + b for a, b in zip(p[1], way)]
        a = self.arguments()
        if w == "TRANS":
            return zyz([number(x) for x in a] + [0.0] * (6 - len(a)))
        if w in ("RX", "RY", "RZ"):
            return turn("XYZ".index(w[1]), number(a[0])), [0.0, 0.0, 0.0]
        if w in ("DX", "DY", "DZ"):
            return a[0][1]["XYZ".index(w[1])]
        if w == "SIG":
            return all([self.signal(n) for n in a])
        if w == "TIMER":
            return self.timers[int(a[0])] + self.elapsed
        if w == "INT":
            return math.trunc(number(a[0]))
        if w in FUNCTIONS:
            return FUNCTIONS[w](*[number(x) for x in a])
        raise Fault("there is no function %s" % word)

    def speed(self, is_ptp):
        """What the last SPEED says; without one the controller's own, which is none that the program means."""
        unit, v = self.next or ("", 0.0)
        self.next = None
        if not is_ptp:
            return {"speed": v if unit == "MM/S" else 0.0}
        return {"share": v if unit == "%" else 0.0}

    def statement(self, l):
        word, _, rest = l.partition(" ")
        rest = rest.strip()
        if word in ("CP", "BREAK", "RIGHTY", "LEFTY", "ABOVE", "BELOW", "UWRIST", "DWRIST", "ACCEL", "DECEL",
                    "ACCURACY", "PRINT", "PAUSE"):
            return
        if word == "SPEED":
            m = re.fullmatch(r"(.+?)(?: (MM/S))?(?:, (.+) DEG/S)?", rest)
            self.next = (m.group(2) or "%", number(self.value(m.group(1))))
        elif word == "TOOL":
            self.record.take(self.value(rest))
        elif word in ("JMOVE", "LMOVE"):
            motion = "ptp" if word == "JMOVE" else "lin"
            how = self.speed(word == "JMOVE")
            m = re.fullmatch(r"SHIFT\(HERE BY (.+)\)", rest)
            if m:
                self.record.by(motion, [number(self.value(t)) for t in split(m.group(1))], **how)
            else:
                v = self.value(rest)
                if is_place(v):
                    self.record.pose(motion, v, **how)
                else:
                    self.record.joints(motion, v, **how)
        elif word == "C1MOVE":
            self.via = self.value(rest), self.speed(False)
        elif word == "C2MOVE":
            if not self.via:
                raise Fault("C2MOVE without C1MOVE")
            self.record.pose("circle", self.via[0], **self.via[1])
            self.record.pose("circle", self.value(rest), **self.speed(False))
            self.via = None
        elif word == "XMOVE/LVL":
            to, _, n = rest.partition(" TILL ")
            self.record.pose("lin", self.value(to), until=self.table(lambda: self.signal(self.value(n))),
                             **self.speed(False))
        elif word == "SIGNAL":
            for t in split(rest):
                n = int(self.value(t))
                self.outputs[abs(n)] = n > 0
                self.record.output(abs(n), n > 0)
        elif word == "BITS":
            m = re.fullmatch(r"(\d+),(\d+) = (.+)", rest)
            self.record.bits(int(m.group(1)), int(m.group(2)), number(self.value(m.group(3))))
        elif word == "SWAIT":
            self.wait_until(lambda: self.signal(self.value(rest)))
        elif word == "WAIT":
            self.wait_until(lambda: self.value(rest))
        elif word == "TWAIT":
            self.record.wait(number(self.value(rest)))
        elif word == "GOTO":
            raise Jump(rest)
        elif word == "TIMER":
            n, _, v = rest.partition(" = ")
            self.timers[int(n)] = number(self.value(v))
        elif word == "CALL":
            name, _, _ = rest.partition("(")
            self.toks, self.at = tokens(rest[len(name):]), 0
            self.enter(name, self.given())
        elif word == "RETURN":
            raise Returned(None)
        elif word == "HALT":
            raise Halted()
        elif word == "POINT":
            name, _, v = rest.partition(" = ")
            p = self.value(v)
            if not is_place(p):
                raise Fault("POINT takes a transformation")
            self.put(self.place_of(name), p)
        else:
            m = re.fullmatch(r"(\S+?(?:\[.+?\])?) = (.+)", l)
            if not m:
                raise Fault("a statement that is not known: %s" % l)
            v = self.value(m.group(2))
            if is_place(v):
                raise Fault("a transformation is given without POINT")
            self.put(self.place_of(m.group(1)), v)


class Pdl2(Reader):
    """Comau PDL2: declared variables with types; a variable that stands alone in a call goes by reference; m/s, ms."""
    binary = {"=": (1, equal), **{w: (1, f) for w, f in COMPARISONS.items()}, "OR": (2, LOGIC["OR"]),
              "XOR": (2, LOGIC["XOR"]), "+": (2, sums(False)), "-": (2, MINUS), "AND": (3, LOGIC["AND"]),
              "*": (3, TIMES), "/": (3, DIVIDED), "DIV": (3, WHOLE), "MOD": (3, REST), ":": (4, compose)}
    unary = {"-": (5, lambda a: -number(a)), "NOT": (5, lambda a: not truth(a))}
    labels = r"(\w+)::"
    blocks = {"if": (r"IF (.+) THEN", [r"ELSIF (.+) THEN", r"ELSE"], r"ENDIF"),
              "while": (r"WHILE (.+) DO", [], r"ENDWHILE"), "repeat": (r"REPEAT", [], r"UNTIL (.+)"),
              "for": (r"FOR (?P<name>\S+) := (?P<first>.+?) (?P<down>TO|DOWNTO) (?P<last>.+?)"
                      r"(?: STEP (?P<step>.+?))? DO", [], r"ENDFOR"),
              "case": (r"SELECT (.+) OF", [r"CASE \((.+)\):", r"DEFAULT:"], r"ENDSELECT")}
    types = ("INTEGER", "REAL", "BOOLEAN", "STRING", "POSITION")
    settings = ("$ORNT_TYPE", "$TURN_CARE", "$SING_CARE", "$SPD_OPT", "$TERM_TYPE", "$FLY_TYPE", "$FLY_TRAJ",
                "$CNFG_CARE")

    def read(self, text):
        self.frame = IDENTITY
        lines = [(n, l.strip()) for n, l in enumerate(text.split("\n"), 1) if l.strip()]
        self.line, first = lines.pop(0)
        m = re.fullmatch(r"PROGRAM (\w+) PROG_ARM = \d+", first)
        if not m:
            raise Fault("a program begins with PROGRAM")
        self.program = m.group(1)
        for name, kind in self.declared(lines):
            self.kinds[name] = kind
        while lines and lines[0][1].startswith("ROUTINE "):
            self.line, head = lines.pop(0)
            m = re.fullmatch(r"ROUTINE (\w+)(?:\((.*)\))?(?: : (\w+))?", head)
            parameters = []
            for p in (m.group(2) or "").split(";"):
                if p.strip():
                    name, _, kind = p.strip().partition(" : ")
                    parameters.append((name.lower(), self.kind(kind), False))
            variables = self.declared(lines)
            self.routines[m.group(1).lower()] = {
                "parameters": parameters, "variables": variables, "is_function": m.group(3) is not None,
                "block": self.body(lines, m.group(1))}
        self.main = self.body(lines, self.program)
        if lines:
            self.line = lines[0][0]
            raise Fault("a statement stands behind the program")

    def kind(self, text):
        m = re.fullmatch(r"(?:ARRAY\[([\d, ]+)\] OF )?(\w+)(?:\[\d+\])?", text)
        if not m or m.group(2) not in self.types:
            raise Fault("a type that is not known: %s" % text)
        return (m.group(2), tuple(int(x) for x in m.group(1).split(",")) if m.group(1) else ())

    def declared(self, lines):
        out = []
        if lines and lines[0][1] == "VAR":
            lines.pop(0)
            while lines and lines[0][1] != "BEGIN" and not lines[0][1].startswith("ROUTINE "):
                self.line, l = lines.pop(0)
                name, _, kind = l.partition(" : ")
                out.append((name.lower(), self.kind(kind)))
        return out

    def body(self, lines, name):
        self.line, l = lines.pop(0)
        if l != "BEGIN":
            raise Fault("BEGIN is missing before %s" % l)
        block, end = self.parse(lines, [r"END " + name])
        if end is None:
            raise Fault("END %s is missing" % name)
        return block

    def variable(self, name):
        p = super().variable(name)
        if p.kind is None:
            raise Fault("%s is not declared" % name)
        return p

    def element(self, place):
        p = super().element(place)
        kind, size = place.kind
        index = p.key[1:] if isinstance(p.key, tuple) else ()
        if len(index) != len(size) or not all(1 <= i <= n for i, n in zip(index, size)):
            raise Fault("%s is outside its array" % (p.key,))
        return Place(p.kept, p.key, (kind, ()))

    def put(self, place, v):
        kind = place.kind[0]
        fits = {"INTEGER": isinstance(v, int) and not isinstance(v, bool),
                "REAL": isinstance(v, (int, float)) and not isinstance(v, bool), "BOOLEAN": isinstance(v, bool),
                "STRING": isinstance(v, str), "POSITION": is_place(v)}[kind]
        if not fits:
            raise Fault("%r is given to %s, which is of %s" % (v, place.key, kind))
        place.kept[place.key] = float(v) if kind == "REAL" else v

    def is_variable(self, word):
        return (self.locals is not None and word.lower() in self.locals) or word.lower() in self.kinds

    def named(self, word):
        w = word.upper()
        if w in ("TRUE", "FALSE", "ON", "OFF"):
            return w in ("TRUE", "ON")
        if w in ("$DIN", "$GIN", "$DOUT", "$TIMER"):
            self.expect("[")
            n = int(self.expression())
            self.expect("]")
            if w == "$TIMER":
                return self.timers[n] + self.elapsed * 1000
            if w == "$DOUT":
                return self.outputs[n]
            if w == "$GIN":
                raise Fault("a group of inputs is read")
            return self.ask(n)
        if self.is_variable(word):
            v = self.element(self.variable(word)).get()
            m = self.peek() in (".X", ".Y", ".Z") and self.peek()
            if m:
                self.at += 1
                return v[1]["XYZ".index(m[1])]
            return v
        if w.lower() in self.routines:
            if not self.routines[w.lower()]["is_function"]:
                raise Fault("%s has no value" % word)
            return self.enter(word, self.given() if self.peek() == "(" else [])
        self.expect("(")
        a = self.arguments()
        if w == "POS":
            if len(a) != 7 or not isinstance(a[6], str):
                raise Fault("POS takes six numbers and the configuration")
            return zyz([number(x) for x in a[:6]])
        if w == "VEC":
            return [number(x) for x in a]
        if w == "POS_INV":
            return inverse(a[0])
        if w == "TRUNC":
            return math.trunc(number(a[0]))
        if w == "ROUND":
            return int(math.floor(number(a[0]) + 0.5))
        if w in FUNCTIONS:
            return FUNCTIONS[w](*[number(x) for x in a])
        raise Fault("there is no function %s" % word)

    def is_poll(self, inner):
        return len(inner) == 1 and inner[0][1] == "line" and inner[0][2].startswith("DELAY ")

    def move(self, l):
        m = re.fullmatch(r"MOVE(FLY)?(?: (LINEAR|CIRCULAR|JOINT))?"
                         r" (?:TO (?P<to>.+?)(?: VIA (?P<via>.+?))?|RELATIVE (?P<by>VEC\(.+?\)) IN (?P<frame>\w+))"
                         r"( ADVANCE)?(?: TIL (?P<until>.+?))? WITH (?P<how>.+)", l)
        if not m:
            raise Fault("a motion that is not known: %s" % l)
        how = {}
        for part in split(m.group("how")):
            name, _, v = part.strip().partition(" = ")
            how[name] = number(self.value(v))
        for name in how:
            if name not in ("$LIN_SPD", "$ROT_SPD", "$PROG_SPD_OVR", "$PROG_ACC_OVR", "$PROG_DEC_OVR", "$FLY_DIST"):
                raise Fault("a setting that is not known: %s" % name)
        frame = self.frame
        motion = {"LINEAR": "lin", "CIRCULAR": "circle"}.get(m.group(2), "ptp")
        said = {"share": how.get("$PROG_SPD_OVR", 0.0)} if motion == "ptp" else \
               {"speed": how.get("$LIN_SPD", 0.0) * 1000}
        if m.group("by"):
            way = self.value(m.group("by"))
            self.record.by(motion, apply(frame[0], way) if m.group("frame") == "UFRAME" else way, **said)
            return
        to, until = m.group("to"), m.group("until")
        table = self.table(lambda: self.value(until)) if until else None
        if to.startswith("{"):
            self.record.joints(motion, [number(self.value(t)) for t in split(to[1:-1])], until=table, **said)
            return
        if (motion == "circle") != (m.group("via") is not None):
            raise Fault("VIA is of circles")
        if m.group("via"):
            self.record.pose("circle", compose(frame, self.value(m.group("via"))), **said)
        self.record.pose(motion, compose(frame, self.value(to)), until=table, **said)

    def statement(self, l):
        word = re.match(r"[$\w]*", l).group(0)
        rest = l[len(word):].strip()
        if word in ("MOVE", "MOVEFLY"):
            self.move(l)
        elif word == "DELAY":
            self.record.wait(number(self.value(rest)) / 1000)
        elif word == "WAIT":
            self.wait_until(lambda: self.value(rest[len("FOR "):]))
        elif word == "RETURN":
            raise Returned(self.value(rest) if rest else None)
        elif word == "GOTO":
            raise Jump(rest)
        elif word == "DEACTIVATE":
            raise Halted()
        elif word in ("WRITE", "PAUSE"):
            pass
        elif word == "$TOOL":
            self.record.take(self.value(rest[len(":= "):]))
        elif word == "$UFRAME":
            self.frame = self.value(rest[len(":= "):])
        elif word in self.settings:
            if (word, rest[3:]) not in [("$ORNT_TYPE", "RS_WORLD"), ("$SPD_OPT", "SPD_LIN")] and \
                    word in ("$ORNT_TYPE", "$SPD_OPT"):
                raise Fault("another meaning of speeds: %s" % l)
        elif word in ("$DOUT", "$GOUT", "$TIMER"):
            m = re.fullmatch(r"\[(\d+)\] := (.+)", rest)
            n, v = int(m.group(1)), self.value(m.group(2))
            if word == "$TIMER":
                self.timers[n] = number(v)
            else:
                self.outputs[n] = truth(v) if word == "$DOUT" else number(v)
                self.record.output(n, v)
        elif word.lower() in self.routines:
            self.toks, self.at = tokens(rest), 0
            self.enter(word, self.given() if rest else [])
        else:
            target, sign, v = l.partition(" := ")
            if not sign:
                raise Fault("a statement that is not known: %s" % l)
            m = re.fullmatch(r"(.+)\.([XYZ])", target)
            if m:
                p = self.place_of(m.group(1))
                r, at = p.get()
                at = list(at)
                at["XYZ".index(m.group(2))] = number(self.value(v))
                self.put(p, (r, at))
            else:
                self.assign(target, v)


class PacScript(Reader):
    """Denso PacScript: Dim names types, the first element of an array is 0, a function's name holds its value. Speeds
    are shares of the greatest, which the option max_speed [mm/s] says."""
    binary = {"OR": (1, LOGIC["OR"]), "XOR": (1, LOGIC["XOR"]), "AND": (2, LOGIC["AND"]), "=": (4, equal),
              **{w: (4, f) for w, f in COMPARISONS.items()}, "+": (5, sums(False)), "-": (5, MINUS), "MOD": (6, REST),
              "\\": (7, WHOLE), "*": (8, TIMES), "/": (8, DIVIDED)}
    unary = {"-": (9, lambda a: -number(a)), "NOT": (3, lambda a: not truth(a))}
    labels = r"(\*\w+):"
    blocks = {"if": (r"If (.+) Then", [r"ElseIf (.+) Then", r"Else"], r"End If"),
              "while": (r"Do While (.+)", [], r"Loop"), "repeat": (r"Do", [], r"Loop(?: Until (.+))?"),
              "for": (r"For (?P<name>\S+) = (?P<first>.+?) To (?P<last>.+?)(?: Step (?P<step>.+))?", [],
                      r"Next(?: \w+)?"),
              "case": (r"Select Case (.+)", [r"Case (?!Else)(.+)", r"Case Else"], r"End Select")}

    def read(self, text):
        if not all(l.endswith("\r") for l in text.split("\n")[:-1]):
            raise Fault("lines end with CR LF")
        self.work, self.numbers = IDENTITY, {"Tool": {"0": IDENTITY}, "Work": {"0": IDENTITY}}
        lines = [(n, l.strip()) for n, l in enumerate(text.split("\n"), 1)]
        lines = [(n, l) for n, l in lines if l and not l.startswith("'")]
        pending = []
        self.main = None
        while lines:
            self.line, l = lines.pop(0)
            m = re.fullmatch(r"Dim (\w+)(?:\(([\d, ]+)\))? As (\w+)", l)
            if m:
                pending.append((m.group(1).lower(), self.kind(m)))
                continue
            m = re.fullmatch(r"(Sub|Function) (\w+)(?:\((.*)\))?(?: As (\w+))?", l)
            if not m:
                raise Fault("a statement that is in no procedure: %s" % l)
            parameters = []
            for p in split(m.group(3) or ""):
                if p.strip():
                    q = re.fullmatch(r"(ByVal|ByRef) (\w+) As (\w+)", p.strip())
                    parameters.append((q.group(2).lower(), (q.group(3), ()), q.group(1) == "ByVal"))
            own = []
            while lines and lines[0][1].startswith("Dim "):
                self.line, l = lines.pop(0)
                d = re.fullmatch(r"Dim (\w+)(?:\(([\d, ]+)\))? As (\w+)", l)
                own.append((d.group(1).lower(), self.kind(d)))
            block, end = self.parse(lines, [r"End " + m.group(1)])
            if end is None:
                raise Fault("End %s is missing" % m.group(1))
            name = m.group(2).lower()
            if name == "main":
                self.kinds.update(pending)
                self.main = block
                continue
            result = name if m.group(1) == "Function" else None
            if result:
                own.append((name, (m.group(4), ())))
            self.routines[name] = {"parameters": parameters, "variables": own, "block": block, "result": result}
        if self.main is None:
            raise Fault("there is no Sub Main")

    def kind(self, m):
        if m.group(3) not in ("Long", "Double", "Boolean", "String", "Position"):
            raise Fault("a type that is not known: %s" % m.group(3))
        return m.group(3), tuple(int(x) for x in m.group(2).split(",")) if m.group(2) else ()

    def is_variable(self, word):
        return (self.locals is not None and word.lower() in self.locals) or word.lower() in self.kinds

    def variable(self, name):
        if not self.is_variable(name):
            raise Fault("%s is not declared" % name)
        return super().variable(name)

    def element(self, place):
        kind, size = place.kind
        if not size:
            return place
        self.expect("(")
        index = tuple(self.arguments())
        if len(index) != len(size) or not all(isinstance(i, int) and 0 <= i < n for i, n in zip(index, size)):
            raise Fault("%s%s is outside its array" % (place.key, index))
        return Place(place.kept, (place.key,) + index, (kind, ()))

    def put(self, place, v):
        kind = place.kind[0]
        fits = {"Long": isinstance(v, (int, float)) and not isinstance(v, bool),
                "Double": isinstance(v, (int, float)) and not isinstance(v, bool), "Boolean": isinstance(v, bool),
                "String": isinstance(v, str), "Position": is_place(v)}[kind]
        if not fits:
            raise Fault("%r is given to %s, which is %s" % (v, place.key, kind))
        place.kept[place.key] = round(v) if kind == "Long" else float(v) if kind == "Double" else v

    def named(self, word):
        w = word.upper()
        if w in ("TRUE", "FALSE", "ON", "OFF"):
            return w in ("TRUE", "ON")
        if w == "IO":
            self.expect("[")
            n = int(self.expression())
            self.expect("]")
            return self.outputs[n] if n in self.outputs else self.ask(n)
        if w.lower() in self.routines and self.peek() == "(":
            if not self.routines[w.lower()]["result"]:
                raise Fault("%s has no value" % word)
            return self.enter(word, self.given())
        if self.is_variable(word):
            return self.element(self.variable(word)).get()
        if w == "CURPOS":
            if not self.record.here:
                raise Fault("where the robot is, is not known")
            return self.record.here
        self.expect("(")
        a = self.arguments()
        if w == "P":
            return fixed_xyz([number(x) for x in a[:6]])
        if w == "J":
            return [number(x) for x in a]
        if w == "DEVH":
            return compose(a[0], a[1])
        if w in ("T2P", "P2T"):
            return a[0]
        if w == "TINV":
            return inverse(a[0])
        if w in ("POSX", "POSY", "POSZ"):
            return a[0][1]["XYZ".index(w[3])]
        if w == "SQR":
            return math.sqrt(number(a[0]))
        if w in FUNCTIONS:
            return FUNCTIONS[w](*[number(x) for x in a])
        raise Fault("there is no function %s" % word)

    def move(self, rest):
        parts = [p.strip() for p in split(rest)]
        kind = parts.pop(0)
        how, goals = {}, []
        for p in parts:
            m = re.fullmatch(r"(Speed|Accel|Decel) = (.+)", p)
            if m:
                how[m.group(1)] = number(self.value(m.group(2)))
            elif how:
                raise Fault("a target stands behind the options: %s" % p)
            else:
                goals.append(re.sub(r"^@\w+ ", "", p))
        if len(goals) != (2 if kind == "C" else 1) or kind not in "PLC":
            raise Fault("a motion %s of %d targets" % (kind, len(goals)))
        motion = {"P": "ptp", "L": "lin", "C": "circle"}[kind]
        share = how.get("Speed", 0.0)
        said = {"share": share} if kind == "P" else {"speed": share / 100 * float(self.options["max_speed"])}
        for text in goals:
            m = re.fullmatch(r"Dev\(CurPos, P\((.+)\)\)", text)
            if m:
                n = [number(self.value(t)) for t in split(m.group(1))]
                if any(n[3:]):
                    raise Fault("a step that turns")
                self.record.by(motion, apply(self.work[0], n[:3]), **said)
                continue
            v = self.value(text)
            if is_place(v):
                self.record.pose(motion, compose(self.work, v), **said)
            else:
                self.record.joints(motion, v, **said)

    def statement(self, l):
        word, _, rest = l.partition(" ")
        if word in ("TakeArm", "GiveArm", "PrintDbg"):
            return
        if word == "Move":
            self.move(rest)
        elif word == "Delay":
            self.record.wait(number(self.value(rest)) / 1000)
        elif word in ("Set", "Reset"):
            n = int(re.fullmatch(r"IO\[(\d+)\]", rest).group(1))
            self.outputs[n] = word == "Set"
            self.record.output(n, word == "Set")
        elif word == "Out":
            m = re.fullmatch(r"IO\[(\d+) To (\d+)\] = (.+)", rest)
            first, last = int(m.group(1)), int(m.group(2))
            self.record.bits(first, last - first + 1, number(self.value(m.group(3))))
        elif word == "Wait":
            parts = split(rest)
            known = self.table(lambda: self.value(parts[0]))
            self.record.condition(known, number(self.value(parts[1])) / 1000 if len(parts) > 1 else -1)
        elif word in ("Tool", "Work"):
            n, _, v = rest.partition(", ")
            self.numbers[word][n] = self.value(v)
        elif word == "ChangeTool":
            self.record.take(self.numbers["Tool"][rest])
        elif word == "ChangeWork":
            self.work = self.numbers["Work"][rest]
        elif word == "GoTo":
            raise Jump(rest)
        elif word == "Exit":
            if rest in ("Do", "For"):
                raise Left()
            raise Returned(None)
        elif word == "Halt":
            raise Halted()
        elif word == "Hold":
            pass
        elif word in ("LetX", "LetY", "LetZ"):
            name, _, v = rest.partition(" = ")
            p = self.place_of(name)
            rows, at = p.get()
            at = list(at)
            at["XYZ".index(word[3])] = number(self.value(v))
            self.put(p, (rows, at))
        elif word == "Call":
            name = rest.partition("(")[0]
            self.toks, self.at = tokens(rest[len(name):]), 0
            self.enter(name, self.given() if self.toks else [])
        else:
            m = re.fullmatch(r"(\w+(?:\(.+?\))?) = (.+)", l)
            if not m:
                raise Fault("a statement that is not known: %s" % l)
            self.assign(m.group(1), m.group(2))


# ---- straight programs ----

class Inform:
    """Yaskawa INFORM: positions by number, pulses or BASE (Rz Ry Rx); three MOVC make an arc from where the robot is.
    The option pulses says how many a degree each axis has."""

    def __init__(self, text, options):
        self.line = 0
        self.lines = text.split("\n")
        self.pulses = [float(x) for x in options.get("pulses", "").split(",") if x]
        self.record = Record()

    def target(self, name):
        if name not in self.places:
            raise Fault("%s is no position of the job" % name)
        return self.places[name]

    def go_to(self, motion, name, **how):
        kind, v = self.target(name)
        if kind == "PULSE":
            self.record.joints(motion, v, share=how.get("share"), until=how.get("until"))
        else:
            self.record.pose(motion, v, **how)

    def go(self):
        self.places, self.at = {}, None
        kind, section, arc, count = None, "", [], None
        for n, raw in enumerate(self.lines, 1):
            self.line = n
            if raw and not raw.endswith("\r"):
                raise Fault("lines end with CR LF")
            l = raw.strip()
            if not l:
                continue
            if l.startswith("//"):
                section = l.split()[0] if not l.startswith("///") else section
                if l.startswith("///NPOS"):
                    count = int(l.split()[1].split(",")[0])
                if l.startswith("///POSTYPE"):
                    kind = l.split()[1]
                continue
            m = re.fullmatch(r"(C\d{5})=(.+)", l)
            if m and section == "//POS":
                v = [float(x) for x in m.group(2).split(",")]
                if kind == "PULSE":
                    if len(v) != len(self.pulses):
                        raise Fault("%d axes, and pulses of %d" % (len(v), len(self.pulses)))
                    self.places[m.group(1)] = (kind, [a / b for a, b in zip(v, self.pulses)])
                else:
                    self.places[m.group(1)] = (kind, fixed_xyz(v))
                continue
            if section != "//INST":
                if l == "/JOB":
                    continue
                raise Fault("a line that is in no section: %s" % l)
            word, _, rest = l.partition(" ")
            if word != "MOVC" and arc:
                raise Fault("an arc has three MOVC")
            if word in ("NOP", "MSG", "PAUSE"):
                continue
            if word in ("END", "ABORT", "RET"):
                break
            if word in ("MOVJ", "MOVL", "MOVC"):
                name, *tags = rest.split()
                tags = dict(t.split("=") for t in tags if t != "UNTIL" and not t.startswith("IN#"))
                until = re.search(r" UNTIL IN#\((\d+)\)=(ON|OFF)", l)
                how = {"share": float(tags["VJ"])} if word == "MOVJ" else {"speed": float(tags["V"])}
                if until:
                    how["until"] = ([int(until.group(1))], "01" if until.group(2) == "ON" else "10")
                if word == "MOVC":
                    if not arc and name != self.at:
                        raise Fault("an arc that begins elsewhere than where the robot is")
                    arc.append(name)
                    if len(arc) > 1:
                        self.go_to("circle", name, **how)
                    if len(arc) == 3:
                        arc = []
                else:
                    self.go_to("ptp" if word == "MOVJ" else "lin", name, **how)
                self.at = None if until else name
            elif word == "DOUT":
                m = re.fullmatch(r"OT#\((\d+)\) (ON|OFF)", rest)
                self.record.output(int(m.group(1)), m.group(2) == "ON")
            elif word == "TIMER":
                self.record.wait(float(re.fullmatch(r"T=([\d.]+)", rest).group(1)))
            elif word == "WAIT":
                m = re.fullmatch(r"IN#\((\d+)\)=(ON|OFF)(?: T=([\d.]+))?", rest)
                self.record.condition(([int(m.group(1))], "01" if m.group(2) == "ON" else "10"),
                                      float(m.group(3)) if m.group(3) else -1)
            else:
                raise Fault("an instruction that is not known: %s" % l)
        else:
            raise Fault("END is missing")
        if count != len(self.places):
            raise Fault("NPOS says %s positions, and there are %d" % (count, len(self.places)))


class Movemaster:
    """Mitsubishi RV-M1: PD says a position by x, y, z, the pitch of the hand above the horizontal, and its roll; five
    axes, so that the hand is in the plane through the waist. Options: speed, the mm/s of SP 9; roll, what is added."""

    def __init__(self, text, options):
        self.line = 0
        self.lines = text.split("\n")
        self.speed, self.roll = float(options.get("speed", 1000)), float(options.get("roll", 0))
        self.record = Record()

    def pose(self, n):
        x, y, z, pitch, roll = n
        waist = math.degrees(math.atan2(y, x))
        # The hand's z goes out of the waist's plane at no pitch; roll turns about it.
        out = [math.cos(math.radians(waist)), math.sin(math.radians(waist)), 0.0]
        across = [-out[1], out[0], 0.0]
        c, s = math.cos(math.radians(pitch)), math.sin(math.radians(pitch))
        a = [c * out[0], c * out[1], s]
        cross = lambda u, v: [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        up = cross(a, across)
        r = math.radians(roll - self.roll)
        o = [math.cos(r) * p + math.sin(r) * q for p, q in zip(across, up)]
        return [list(row) for row in zip(cross(o, a), o, a)], [x, y, z]

    def go(self):
        places, lines = {}, {}
        for n, raw in enumerate(self.lines, 1):
            self.line = n
            l = raw.strip()
            if not l:
                continue
            m = re.fullmatch(r"PD (\d+),([-\d.,]+)", l)
            if m:
                v = [float(x) for x in m.group(2).split(",")]
                if len(v) != 5:
                    raise Fault("a position of %d numbers" % len(v))
                places[int(m.group(1))] = self.pose(v)
                continue
            m = re.fullmatch(r"(\d+) (.+)", l)
            if not m or int(m.group(1)) in lines:
                raise Fault("a command that is not known: %s" % l)
            lines[int(m.group(1))] = (n, m.group(2))
        level, asks = None, None
        for at in sorted(lines):
            self.line, command = lines[at]
            word, _, rest = command.partition(" ")
            v = [float(x) for x in rest.split(",")] if rest else []
            if word == "SP":
                level = v[0]
            elif word == "MO":
                self.record.pose("ptp", places[int(v[0])], share=level / 9 * 100)
            elif word == "MS":
                self.record.pose("lin", places[int(v[0])], speed=level / 9 * self.speed)
            elif word == "OB":
                self.record.output(abs(int(v[0])), rest.startswith("+"))
            elif word == "TI":
                self.record.wait(v[0] / 10)
            elif word == "ID":
                asks = at
            elif word == "TB" and asks == int(v[1]):
                # Back to where the inputs are read, while the bit is so.
                self.record.condition(([abs(int(v[0]))], "10" if rest.startswith("+") else "01"))
            elif word == "ED":
                return
            else:
                raise Fault("a command that is not known: %s" % command)
        raise Fault("ED is missing")


class Crcl:
    """NIST CRCL: commands in XML, one behind the other; a pose is a point and two axes of its frame."""

    def __init__(self, text, options):
        self.line = 0
        self.root = xml.etree.ElementTree.fromstring(text.encode())
        self.record = Record()

    def go(self):
        kind = "{http://www.w3.org/2001/XMLSchema-instance}type"
        speed = {"speed": 0.0}
        share = {"share": 0.0}
        number_before = 0
        for command in self.root:
            if command.tag == "Name":
                continue
            self.line = int(command.find("CommandID").text)  # of a command
            if self.line != number_before + 1:
                raise Fault("the commands are not numbered one by one")
            number_before = self.line
            what = command.get(kind)
            if command.tag in ("InitCanon", "EndCanon") or what in ("MessageType", "SetTransAccelType",
                                                                    "SetRotSpeedType", "SetEndPoseToleranceType"):
                continue
            if what == "SetLengthUnitsType" and command.find("UnitName").text == "millimeter":
                continue
            if what == "SetAngleUnitsType" and command.find("UnitName").text == "degree":
                continue
            if what == "SetTransSpeedType":
                s = command.find("TransSpeed")
                if s.get(kind) == "TransSpeedAbsoluteType":
                    speed, share = {"speed": float(s.find("Setting").text)}, {"share": 0.0}
                else:
                    speed, share = {"speed": 0.0}, {"share": 100 * float(s.find("Fraction").text)}
            elif what == "MoveToType":
                end = command.find("EndPosition")
                v = lambda name, words: [float(end.find(name).find(w).text) for w in words]
                x, z = v("XAxis", "IJK"), v("ZAxis", "IJK")
                if any(abs(sum(a * b for a, b in zip(u, w)) - want) > 1e-6
                       for u, w, want in ((x, x, 1), (z, z, 1), (x, z, 0))):
                    raise Fault("axes that are not of length 1 and at right angles")
                y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]]
                p = [list(row) for row in zip(x, y, z)], v("Point", "XYZ")
                if command.find("MoveStraight").text == "true":
                    self.record.pose("lin", p, **speed)
                else:
                    self.record.pose("ptp", p, **share)
            elif what == "ActuateJointsType":
                q = {int(j.find("JointNumber").text): float(j.find("JointPosition").text)
                     for j in command.iter("ActuateJoint")}
                self.record.joints("ptp", [q[k + 1] for k in range(len(q))])
            elif what == "SetRobotParametersType":
                s = command.find("ParameterSetting")
                m = re.fullmatch(r"output (\d+)", s.find("ParameterName").text)
                v = s.find("ParameterValue").text
                self.record.output(int(m.group(1)), {"true": 1, "false": 0}[v] if v in ("true", "false") else float(v))
            elif what == "DwellType":
                self.record.wait(float(command.find("DwellTime").text))
            else:
                raise Fault("a command that is not known: %s" % what)
        if self.root[-1].tag != "EndCanon":
            raise Fault("EndCanon is missing")


LANGUAGES = {"as": As, "pdl2": Pdl2, "pacscript": PacScript, "inform": Inform, "movemaster": Movemaster, "crcl": Crcl}


def carried_out(language, name, options):
    """0 and the lines, or 1 and where the fault is."""
    with open(name, encoding="utf-8", newline="") as f:
        text = f.read()
    reader = LANGUAGES[language].__new__(LANGUAGES[language])
    reader.line = 0
    try:
        reader.__init__(text, options)
        reader.go()
    except (Fault, KeyError, ValueError, AttributeError, IndexError, TypeError, ZeroDivisionError,
            xml.etree.ElementTree.ParseError) as fault:
        return 1, ["%s:%s: %s: %s" % (name, reader.line, type(fault).__name__, fault)]
    return 0, reader.record.lines


def main():
    if len(sys.argv) < 3 or sys.argv[1] not in LANGUAGES:
        print("usage: posted_programs.py %s [NAME=VALUE]... FILE..." % "|".join(LANGUAGES))
        return 2
    given = [a for a in sys.argv[2:] if re.match(r"\w+=", a)]
    for name in sys.argv[2 + len(given):]:
        code, lines = carried_out(sys.argv[1], name, dict(a.split("=", 1) for a in given))
        print("\n".join(["==== %d" % code] + lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
