# SPDX-License-Identifier: Apache-2.0
"""What expressions of IRL are, by the rules of docs/user/irl/language.md and exact arithmetic: whole numbers and
fractions of any size, rounded to 64 bits at the end. Writes a line for each expression:

    variables <tab> expression with variables <tab> the same with their values <tab> what it is

where what it is begins with I (INT), R (REAL, in hexadecimal; a tolerance may follow), B (BOOL), S (text), ! (a fault
of the run, or of the compiler where all is known) or ? (refused by the compiler)."""
import itertools
import math
from fractions import Fraction

LEAST, MOST = -2**31, 2**31 - 1


class Fault(Exception):
    pass


class Refused(Exception):
    pass


def whole(v):
    if not LEAST <= v <= MOST:
        raise Fault
    return ("INT", v)


def real(v):
    """The 64-bit number nearest to a fraction."""
    try:
        return ("REAL", float(v))
    except OverflowError:
        raise Fault from None


BINDING = {"OR": 1, "EXOR": 1, "AND": 2, "=": 4, "<>": 4, "<": 4, "<=": 4, ">": 4, ">=": 4, "+": 5, "-": 5,
           "*": 6, "/": 6, "DIV": 6, "MOD": 6}
RELATIONS = {"=": lambda c: c == 0, "<>": lambda c: c != 0, "<": lambda c: c < 0, "<=": lambda c: c <= 0,
             ">": lambda c: c > 0, ">=": lambda c: c >= 0}
NUMBERS = ("INT", "REAL")
TEXTS = ("CHAR", "STRING")


def type_of_operation(op, a, b):
    if op in ("AND", "OR", "EXOR"):
        if (a, b) != ("BOOL", "BOOL"):
            raise Refused
        return "BOOL"
    if op in ("DIV", "MOD"):
        if (a, b) != ("INT", "INT"):
            raise Refused
        return "INT"
    if op in ("+", "-", "*", "/"):
        if a not in NUMBERS or b not in NUMBERS:
            raise Refused
        return "REAL" if op == "/" or "REAL" in (a, b) else "INT"
    if (a in NUMBERS and b in NUMBERS) or (a in TEXTS and b in TEXTS):
        return "BOOL"
    if (a, b) == ("BOOL", "BOOL") and op in ("=", "<>"):
        return "BOOL"
    raise Refused


def operation(op, a, b):
    kind = type_of_operation(op, a[0], b[0])
    x, y = a[1], b[1]
    if op == "EXOR":
        return ("BOOL", x != y)
    if op == "AND":
        return ("BOOL", x and y)
    if op == "OR":
        return ("BOOL", x or y)
    if op in RELATIONS:
        if a[0] in TEXTS:
            x, y = x.encode(), y.encode()
        return ("BOOL", RELATIONS[op]((x > y) - (x < y)))
    if op in ("/", "DIV", "MOD") and y == 0:
        raise Fault
    x, y = Fraction(x), Fraction(y)
    if op == "DIV":
        return whole(math.trunc(x / y))
    if op == "MOD":
        return whole(int(x - math.trunc(x / y) * y))
    v = {"+": lambda: x + y, "-": lambda: x - y, "*": lambda: x * y, "/": lambda: x / y}[op]()
    return whole(int(v)) if kind == "INT" else real(v)


# ---- trees of written expressions, by the grammar ----

def parse(tokens):
    """Operators and operands as they are written, to a tree: or < and < not < comparison < sum < product < sign."""
    at = 0

    def peek():
        return tokens[at] if at < len(tokens) else None

    def take():
        nonlocal at
        at += 1
        return tokens[at - 1]

    def left(next_level, level):
        tree = next_level()
        while peek() in BINDING and BINDING[peek()] == level:
            op = take()
            tree = (op, tree, next_level())
        return tree

    def factor():
        if peek() == "-" or peek() == "+":
            op = take()
            return (op, factor())
        if isinstance(peek(), tuple):
            return take()
        raise Refused

    def term():
        return left(factor, 6)

    def total():
        return left(term, 5)

    def relation():
        tree = total()
        if peek() in RELATIONS:
            op = take()
            tree = (op, tree, total())
        return tree

    def negated():
        if peek() == "NOT":
            take()
            return ("NOT", negated())
        return relation()

    def both():
        return left(negated, 2)

    tree = left(both, 1)
    if at != len(tokens):
        raise Refused
    return tree


def kind_of(tree):
    if len(tree) == 2 and tree[0] in ("INT", "REAL", "BOOL", "CHAR", "STRING"):
        return tree[0]
    if len(tree) == 2:
        kind = kind_of(tree[1])
        if kind not in (("BOOL",) if tree[0] == "NOT" else NUMBERS):
            raise Refused
        return kind
    return type_of_operation(tree[0], kind_of(tree[1]), kind_of(tree[2]))


def value_of(tree):
    if len(tree) == 2 and tree[0] in ("INT", "REAL", "BOOL", "CHAR", "STRING"):
        return tree
    if len(tree) == 2:
        kind, v = value_of(tree[1])
        if tree[0] == "NOT":
            return ("BOOL", not v)
        return (kind, v) if tree[0] == "+" else whole(-v) if kind == "INT" else ("REAL", -v)
    op = tree[0]
    a = value_of(tree[1])
    # The right side is looked at where it counts.
    if (op, a[1]) in (("AND", False), ("OR", True)) and a[0] == "BOOL":
        return a
    return operation(op, a, value_of(tree[2]))


def has_fault(tree):
    if len(tree) == 2 and tree[0] in VALUES:
        return False
    try:
        value_of(tree)
    except Fault:
        return True
    return any(has_fault(part) for part in tree[1:])


# ---- what is written ----

def literal(value):
    kind, v = value
    if kind == "INT":
        return str(v) if v >= 0 else "(%d)" % v
    if kind == "REAL":
        s = repr(v)
        if "e" in s and "." not in s:
            s = s.replace("e", ".0e")
        return s if not s.startswith("-") else "(%s)" % s
    if kind == "BOOL":
        return "TRUE" if v else "FALSE"
    return "'" + v.replace("'", "''") + "'"


def shown(value):
    kind, v = value
    if kind == "INT":
        return "I%d" % v
    if kind == "REAL":
        return "R" + v.hex()
    if kind == "BOOL":
        return "B" + ("TRUE" if v else "FALSE")
    return "S" + v


refused = set()


def row(tokens):
    """A line for tokens whose operands are values. Of what is refused alike, one line."""
    variables, with_names, with_values = [], [], []
    for t in tokens:
        if isinstance(t, tuple):
            name = "v%d" % len(variables)
            variables.append("%s: %s := %s;" % (t[0], name, literal(t)))
            with_names.append(name)
            with_values.append(literal(t))
        else:
            with_names.append(t)
            with_values.append(t)
    try:
        tree = parse(tokens)
        kind_of(tree)
        try:
            what = shown(value_of(tree))
        except Fault:
            what = "!"
        # Where all is known every part is computed before the program runs.
        if what != "!" and has_fault(tree):
            what += "\x1f!"
    except Refused:
        what = "?"
        alike = tuple(t[0] if isinstance(t, tuple) else t for t in tokens)
        if len(tokens) > 3:
            alike = tuple(t for t in tokens if not isinstance(t, tuple)) + (len(tokens) % 2,)
        if alike in refused:
            return
        refused.add(alike)
    print("\t".join((" ".join(variables), " ".join(with_names), " ".join(with_values), what)))


VALUES = {
    "INT": [0, 1, -1, 7, -7, 46340, 46341, MOST, LEAST, LEAST + 1],
    "REAL": [0.0, 0.1, -2.75, 7.0, 5e-324, 1e300, 1.7976931348623157e308, 2147483648.0],
    "BOOL": [False, True],
    "CHAR": ["a", "b", "Z", "'"],
    "STRING": ["", "a", "ab", "b", "a'c"],
}
FEW = {"INT": [0, 3, -2], "REAL": [0.5, -4.0], "BOOL": [False, True], "CHAR": ["a"], "STRING": ["ab", "a"]}
UNARY = ("-", "+", "NOT")


def operators():
    for op in BINDING:
        for s, t in itertools.product(VALUES, VALUES):
            for x, y in itertools.product(VALUES[s], VALUES[t]):
                # One character between quotes is a CHAR as well as a STRING.
                row([(s, x), op, (t, y)])
    for op in UNARY:
        for t in VALUES:
            for x in VALUES[t]:
                row([op, (t, x)])
                row([op, op, (t, x)])


def precedence():
    count = 0
    for first, second in itertools.product(BINDING, BINDING):
        for kinds in itertools.product(("INT", "REAL", "BOOL"), repeat=3):
            values = [(k, FEW[k][(count + i) % len(FEW[k])]) for i, k in enumerate(kinds)]
            count += 1
            row([values[0], first, values[1], second, values[2]])
            if count % 3 == 0:
                sign = UNARY[count % 9 // 3]
                row([sign, values[0], first, values[1], second, values[2]])
                row([values[0], first, sign, values[1], second, values[2]])
                row([values[0], first, values[1], second, sign, values[2]])


def chains():
    """Four and five operands with a fixed choice of operators."""
    state = 1
    for _ in range(1200):
        tokens = []
        for i in range(4 + state % 2):
            state = (state * 1103515245 + 12345) % 2**31
            kind = ("INT", "INT", "REAL", "BOOL")[state // 7 % 4]
            if i:
                tokens.append(list(BINDING)[state // 64 % len(BINDING)])
            if state // 1024 % 5 == 0:
                tokens.append(UNARY[state // 8192 % 3])
            tokens.append((kind, FEW[kind][state // 65536 % len(FEW[kind])]))
        row(tokens)


def assignments():
    """Conversions: the second field is the type that takes the value of v0, marked by an arrow."""
    for s, t in itertools.product(VALUES, VALUES):
        for x in VALUES[s] + ([-1, 255, 256] if s == "INT" else []):
            known = None
            if s == t or (s, t) == ("CHAR", "STRING"):
                what = shown((t, x))
            elif (s, t) == ("INT", "REAL"):
                what = shown(("REAL", float(x)))
            elif (s, t) == ("CHAR", "INT"):
                what = "I%d" % ord(x)
            elif (s, t) == ("INT", "CHAR"):
                if 0 <= x <= 255 and not 32 <= x < 127:
                    continue
                what = "S" + chr(x) if 0 <= x <= 255 else "!"
            elif (s, t) == ("STRING", "CHAR"):
                # A text that is known and has one character is one.
                what, known = "?", "S" + x if len(x) == 1 else "?"
            else:
                what = "?"
            if (s, t) == ("CHAR", "INT"):
                # What stands between quotes is a text; only as a CHAR is it a number.
                known = "?"
            print("%s: v0 := %s;\t-> %s v0\t-> %s %s\t%s" % (
                s, literal((s, x)), t, t, literal((s, x)), what if known is None else what + "\x1f" + known))


def functions():
    rows = []

    def one(text, x, make, tolerance=1e-12):
        try:
            kind, v = make(x)
            what = shown((kind, v)) + ((" %g" % tolerance) if kind == "REAL" else "")
        except Fault:
            what = "!"
        rows.append((text, x, what))

    def guarded(f):
        def g(x):
            try:
                v = f(x)
            except (ValueError, OverflowError, ZeroDivisionError):
                raise Fault from None
            if math.isinf(v) or math.isnan(v):
                raise Fault
            return ("REAL", v)
        return g

    def sine(x):
        x = math.fmod(x, 360.0)
        exact = {0: 0.0, 90: 1.0, 180: 0.0, 270: -1.0, -90: -1.0, -180: 0.0, -270: 1.0}
        return exact.get(x, math.sin(math.radians(x)))

    def cosine(x):
        x = abs(math.fmod(x, 360.0))
        exact = {0: 1.0, 90: 0.0, 180: -1.0, 270: 0.0}
        return exact.get(x, math.cos(math.radians(x)))

    angles = [0.0, 30.0, 45.0, 60.0, 89.5, 90.0, 120.0, 180.0, 270.0, 359.0, 360.0, 450.0, -30.0, -90.0, -180.0, -450.0,
              3600.0]
    parts = [0.0, 0.5, -0.5, 1.0, -1.0, 0.25, 1.0000001, -2.0]
    others = [0.0, 0.5, -0.5, 1.5, -1.5, 2.5, -2.5, 2.4999, 1e9, 2147483647.4, 2147483647.5, -2147483648.4, -2147483648.5,
              1e20, 710.0, -745.0]
    for x in angles:
        one("SIN", x, guarded(sine))
        one("COS", x, guarded(cosine))
        # Where the cosine is 0 there is no value.
        one("TAN", x, guarded(lambda v: sine(v) / cosine(v)))
    for x in parts:
        one("ASIN", x, guarded(lambda v: math.degrees(math.asin(v))))
        one("ACOS", x, guarded(lambda v: math.degrees(math.acos(v))))
    for x in parts + others:
        one("ATAN", x, guarded(lambda v: math.degrees(math.atan(v))))
        one("SQRT", x, guarded(math.sqrt))
        one("EXP", x, guarded(math.exp))
        one("LN", x, guarded(math.log))
        one("ABS", x, guarded(abs), 0)
        one("TRUNC", x, lambda v: whole(math.trunc(v)))
        # Halves go away from zero.
        one("ROUND", x, lambda v: whole(int(math.copysign(math.floor(abs(Fraction(v)) + Fraction(1, 2)), v))))
    for name, x, what in rows:
        print("REAL: v0 := %s;\t%s(v0)\t%s(%s)\t%s" % (literal(("REAL", x)), name, name, literal(("REAL", x)), what))
    for x, y in itertools.product((0.0, 1.0, -1.0, 2.5), repeat=2):
        # Of 0 and 0 there is no angle.
        what = "!" if x == y == 0 else "R%s 1e-12" % math.degrees(math.atan2(x, y)).hex()
        print("REAL: v0 := %s; REAL: v1 := %s;\tATAN2(v0, v1)\tATAN2(%s, %s)\t%s" % (
            literal(("REAL", x)), literal(("REAL", y)), literal(("REAL", x)), literal(("REAL", y)), what))


operators()
precedence()
chains()
assignments()
functions()
