# SPDX-License-Identifier: Apache-2.0
"""Compares what reader.py reads from posted files with what the interpreter did.

python3 compare.py [--flat] [--structured] [PROGRAM...]
ends with 0 where all are equal, with 1 where one is not. Without a form both are compared.

Positions are equal within 0.01 mm, rotations within 0.01 degrees, joints within 0.01 degrees or
mm, speeds and distances of transitions within 0.5 %, times within 0.5 ms; conditions are equal where they hold
for the same values of the inputs. `robomosp post test TARGET --reader FOLDER` wrote this folder.
"""
import itertools
import json
import math
import pathlib
import random
import sys

NEAR_MM, NEAR_DEGREES = 0.01, 0.01


# ---- rotations, as matrices row by row; angles in degrees ----
def times(a, b):
    return [sum(a[3 * i + k] * b[3 * k + j] for k in range(3)) for i in range(3) for j in range(3)]


def about(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    if axis == "x":
        return [1, 0, 0, 0, c, -s, 0, s, c]
    if axis == "y":
        return [c, 0, s, 0, 1, 0, -s, 0, c]
    return [c, -s, 0, s, c, 0, 0, 0, 1]


def in_turn(axes, angles):
    m = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    for axis, angle in zip(axes, angles):
        m = times(m, about(axis, angle))
    return m


def zyx(a, b, c):
    """About z, then the new y, then the new x."""
    return in_turn("zyx", (a, b, c))


def xyz(a, b, c):
    """About x, then the new y, then the new z."""
    return in_turn("xyz", (a, b, c))


def zyz(a, b, c):
    """About z, then the new y, then the new z."""
    return in_turn("zyz", (a, b, c))


def fixed_xyz(w, p, r):
    """About the fixed x, then the fixed y, then the fixed z."""
    return in_turn("zyx", (r, p, w))


def quaternion(w, x, y, z):
    """Scalar first; of any length but 0."""
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]


def rotation_vector(x, y, z):
    """Axis times angle [rad]."""
    a = math.sqrt(x * x + y * y + z * z)
    s = 0.5 if a < 1e-12 else math.sin(a / 2) / a
    return quaternion(math.cos(a / 2), x * s, y * s, z * s)


# ---- what a reader yields ----
class Place:
    """x, y, z [mm] and a rotation; without one only the position is compared."""

    def __init__(self, x, y, z, rotation=None):
        self.mm, self.rotation = [float(v) for v in (x, y, z)], rotation


class Joints:
    """Joints [degrees or mm]."""

    def __init__(self, *q):
        self.q = [float(v) for v in q]


PASS = "pass"  # a transition whose distance is the controller's own


def ptp(target, speed=None, blend=0, until=None):
    """speed [%], None = the file does not tell; blend [%], 0 = it stops, None = it cannot tell."""
    return {"do": "ptp", "targets": [target], "speed": speed, "blend": blend, "until": until}


def lin(target, speed=None, blend=0, until=None):
    """speed [mm/s], None = the file does not tell; blend [mm], 0 = it stops, None = it cannot
    tell; until: a condition."""
    return {"do": "lin", "targets": [target], "speed": speed, "blend": blend, "until": until}


def circle(via, end, speed=None, blend=0):
    return {"do": "circle", "targets": [via, end], "speed": speed, "blend": blend, "until": None}


def output(number, value):
    return {"do": "output", "number": number, "value": value}


def wait(seconds):
    return {"do": "wait", "seconds": seconds}


def wait_for(condition, seconds=None):
    """The condition as Python has it, of inputs by their numbers: "i[1] and not i[2]"; or a function
    of i. seconds: when it ends without it; None = never."""
    return {"do": "wait_for", "condition": condition, "seconds": seconds}


def message(text):
    return {"do": "message", "text": text}


def pause(text=None):
    return {"do": "pause", "text": text}


def halt():
    return {"do": "halt"}


# ---- conditions ----
class Unknown(Exception):
    pass


class Signals:
    """Values of inputs by their numbers, as i[1]."""

    def __init__(self, values):
        self.values = values

    def __getitem__(self, number):
        if number not in self.values:
            raise Unknown(f"input {number} is asked, and is not in the condition that is meant")
        return self.values[number]


def cut(a, b):
    """a / b towards zero."""
    return int(a / b) if b else 0


OPERATORS = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b,
    "/": lambda a, b: a / b if b else 0, "div": cut, "mod": lambda a, b: a - b * cut(a, b),
    "=": lambda a, b: a == b, "<>": lambda a, b: a != b, "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b,
    "and": lambda a, b: bool(a and b), "or": lambda a, b: bool(a or b),
    "exor": lambda a, b: bool(a) != bool(b)}


def value_of(tree, values):
    word = tree[0]
    if word == "value":
        return tree[1]
    if word in ("input", "output"):
        return values[tree[1]]
    if word == "not":
        return not value_of(tree[1], values)
    if word == "negative":
        return -value_of(tree[1], values)
    return OPERATORS[word](value_of(tree[1], values), value_of(tree[2], values))


def leaves(tree, word):
    if tree[0] == word:
        yield tree
    elif tree[0] not in ("value", "input", "output"):
        for part in tree[1:]:
            yield from leaves(part, word)


def different(text, tree, read):
    """What is not equal of a condition; "" = nothing."""
    if read is None:
        return f"the condition was not read, and {text} is meant"
    near = {v[1] + d for v in leaves(tree, "value") for d in (-1, -0.5, 0, 0.5, 1)}
    tried = {}
    for _, number, bits in leaves(tree, "input"):
        if bits == 1:
            tried[number] = [0, 1]
        elif bits == 0:
            tried[number] = sorted({0.0, 1.0} | near)
        else:
            most = 2 ** bits - 1
            tried[number] = sorted({int(v) for v in near | {0, 1, most} if 0 <= v <= most})
    ways = list(itertools.islice(itertools.product(*tried.values()), 100000))
    if len(ways) > 4096:
        ways = random.Random(1).sample(ways, 4096)
    for way in ways:
        values = dict(zip(tried, way))
        meant = bool(value_of(tree, values))
        i = Signals(values)
        try:
            got = read(i) if callable(read) else eval(str(read), {"__builtins__": {}}, {"i": i})
        except Unknown as e:
            return f"{e}: {text}"
        except Exception as e:
            return f"the condition {read!r} cannot be computed: {type(e).__name__}: {e}"
        if bool(got) != meant:
            where = ", ".join(f"input {n} = {v}" for n, v in values.items())
            return f"the condition {read!r} instead of {text}: they differ at {where}"
    return ""


# ---- the robot, for places that are written as joints ----
class Robot:
    """Forward kinematics of robot.model, joint by joint."""

    def __init__(self, file):
        self.joints, self.tip = [], None
        for line in file.read_text().splitlines():
            words = line.split('"') if '"' in line else [line]
            first = words[0].split()
            if first[:1] == ["joint"]:
                kind, parent = words[2].split()[:2]
                self.joints.append({"kind": kind, "parent": int(parent), "T": None})
            elif first[:1] == ["placement"]:
                self.joints[-1]["T"] = [float(v) for v in first[1:13]]
            elif first[:1] == ["tip"]:
                numbers = words[2].split()
                self.tip = (int(numbers[0]), [float(v) for v in numbers[1:13]])
            elif first[:1] == ["base"]:
                pass  # places are in the robot's own base
        self.usable = self.tip is not None and all(
            j["T"] and j["kind"] in ("revolute", "prismatic") for j in self.joints)

    @staticmethod
    def chain(a, b):
        """Poses as x y z [m] and a matrix behind each other."""
        p, r = a[:3], a[3:]
        moved = [p[i] + sum(r[3 * i + k] * b[k] for k in range(3)) for i in range(3)]
        return moved + times(r, b[3:])

    def place(self, q):
        frames = []
        for j, v in zip(self.joints, q):
            base = frames[j["parent"]] if j["parent"] >= 0 else [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
            moved = ([0, 0, 0] + about("z", v) if j["kind"] == "revolute"
                     else [0, 0, v / 1000, 1, 0, 0, 0, 1, 0, 0, 0, 1])
            frames.append(self.chain(self.chain(base, j["T"]), moved))
        end = self.chain(frames[self.tip[0]], self.tip[1])
        return Place(*[1000 * v for v in end[:3]], end[3:])


def angle_between(a, b):
    """Degrees; by the distance of the matrices, as the trace does not resolve small ones."""
    d = math.sqrt(sum((x - y) ** 2 for x, y in zip(a, b)) / 8)
    return math.degrees(2 * math.asin(min(1, d)))


def difference(meant, read, robot):
    """What is not equal; "" = nothing."""
    if not isinstance(read, dict) or "do" not in read:
        return f"reader.py yields what is no action: {read!r:.60}"
    if meant["do"] != read["do"]:
        return f"{read['do']} was read, and {meant['do']} is meant"
    if meant["do"] in ("ptp", "lin", "circle", "path"):
        if len(meant["targets"]) != len(read["targets"]):
            return f"{len(read['targets'])} targets instead of {len(meant['targets'])}"
        for want, got in zip(meant["targets"], read["targets"]):
            if isinstance(got, Joints) and "joints" in want:
                far = max([abs(a - b) for a, b in zip(want["joints"], got.q)] or [0])
                if len(got.q) < len(want["joints"]) or not far <= NEAR_DEGREES:
                    return f"joints {got.q} instead of {want['joints']}"
                more, got_more = want.get("additional", []), got.q[len(want["joints"]):]
                if got_more and (len(got_more) != len(more) or not max(
                        abs(a - b) for a, b in zip(more, got_more)) <= NEAR_DEGREES):
                    return f"additional joints {got_more} instead of {more}"
                continue
            if isinstance(got, Joints):
                if not robot or not robot.usable:
                    return "joints were read for a place, and there is no robot.model to tell where"
                got = robot.place(got.q)
            if "position" not in want:
                return "a place was read, and joints are meant"
            far = math.dist(got.mm, want["position"])
            if not far <= NEAR_MM:
                return f"{far:.4f} mm from {want['position']}: {got.mm}"
            if got.rotation:
                turned = angle_between(got.rotation, quaternion(*want["quaternion"]))
                if not turned <= NEAR_DEGREES:
                    return f"turned by {turned:.4f} degrees"
        if read["speed"] is not None and abs(read["speed"] - meant["speed"]) > 0.005 * meant["speed"]:
            return f"speed {read['speed']} instead of {meant['speed']}"
        if bool(meant.get("until")) != bool(read.get("until")):
            return f"until {read.get('until')} instead of {meant.get('until')}"
        if meant.get("until"):
            return different(meant["until"], meant["until_tree"], read["until"])
        return transition(meant, read.get("blend", 0))
    elif meant["do"] == "output":
        if read["number"] != meant["number"] or abs(read["value"] - meant["value"]) > 1e-6:
            return (f"output {read['number']} := {read['value']} instead of "
                    f"{meant['number']} := {meant['value']}")
    elif meant["do"] == "wait":
        if not abs(read["seconds"] - meant["seconds"]) <= 5e-4:
            return f"{read['seconds']} s instead of {meant['seconds']} s"
    elif meant["do"] == "wait_for":
        ends, end = meant.get("seconds"), read.get("seconds")
        if (ends is None) != (end is None) or (ends is not None and not abs(end - ends) <= 5e-4):
            told = ["no time" if t is None else f"{t} s" for t in (end, ends)]
            return f"it ends after {told[0]} instead of {told[1]}"
        return different(meant["condition"], meant["tree"], read["condition"])
    elif meant["do"] == "message":
        if read["text"] is None or read["text"].strip() != meant["text"].strip():
            return f"the text {read['text']!r} instead of {meant['text']!r}"
    elif meant["do"] == "pause":
        if read["text"] is not None and read["text"].strip() != meant["text"].strip():
            return f"the text {read['text']!r} instead of {meant['text']!r}"
    return ""


def transition(meant, read):
    """What is not equal of how a motion goes on into the next; "" = nothing."""
    if read is None:
        return ""
    blend = meant["blend"]
    if blend > 0:
        if read == PASS or not abs(read - blend) <= 0.005 * blend:
            return f"transition {read} instead of {blend}"
    elif not meant["passes"] and read != 0:  # C_PASS without a distance is a stop in a run, too
        return f"transition {read} instead of a stop"
    return ""


def place_of(e):
    """Where reader.py stood when it was thrown."""
    line = 0
    trace = e.__traceback__
    while trace:
        if trace.tb_frame.f_code.co_filename.endswith("reader.py"):
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"line {line}" if line else "called from compare.py"


def compared(meant, files, reader, robot):
    """What is not equal of a program that was posted; "" = nothing."""
    got = []
    try:
        for action in reader.read(files) or []:
            got.append(action)
            if len(got) > len(meant):
                break  # it may go on for ever
    except NotImplementedError:
        raise
    except Exception as e:
        return (f"reader.py stopped: {type(e).__name__}: {e} ({place_of(e)}, "
                f"behind {len(got)} actions)")
    for i, (a, b) in enumerate(zip(meant, got)):
        try:
            d = difference(a, b, robot)
        except Exception as e:
            d = f"reader.py yields what is no action: {type(e).__name__}: {e}"
        if d:
            return f"action {i + 1} (line {a['line']} of the IRL, {a['do']}): {d}"
    if len(got) > len(meant):
        return f"more actions were read than the {len(meant)} that are meant"
    return f"{len(got)} actions were read, and {len(meant)} are meant" if len(got) < len(meant) else ""


def files_of(folder):
    """Texts by name."""
    return {str(f.relative_to(folder)): f.read_text(encoding="utf-8", errors="replace")
            for f in sorted(folder.rglob("*")) if f.is_file()}


def main(arguments):
    here = pathlib.Path(__file__).resolve().parent
    sys.path.insert(0, str(here))
    sys.modules.setdefault("compare", sys.modules[__name__])
    try:
        import reader
    except Exception as e:  # whatever its author wrote
        print(f"reader.py cannot be used: {type(e).__name__}: {e}", file=sys.stderr)
        return 1

    forms = [f for f in ("flat", "structured") if "--" + f in arguments] or ["flat", "structured"]
    names = [a for a in arguments if not a.startswith("--")]
    model = here / "robot.model"
    robot = Robot(model) if model.exists() else None
    wrong = count = 0
    for trace in sorted((here / "programs").glob("*.trace.json")):
        name = trace.name[:-len(".trace.json")]
        if names and name not in names:
            continue
        meant = json.loads(trace.read_text())
        for form in forms:
            folder = here / "programs" / name / form
            if not folder.is_dir():
                continue
            try:
                said = compared(meant, files_of(folder), reader, robot)
            except NotImplementedError as e:
                print(e, file=sys.stderr)
                return 1
            print(f"{name}, {form}: {said or f'{len(meant)} actions are equal'}")
            wrong += bool(said)
            count += 1
    if not count:
        print("There is no program to compare.", file=sys.stderr)
        return 1
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
