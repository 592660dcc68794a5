# SPDX-License-Identifier: Apache-2.0
"""Runs programs of the Tern, as its manual would tell: for compare.py."""
import re

from compare import (Joints, Place, circle, halt, lin, message, output, pause, ptp, quaternion, wait,
                     wait_for)

MOST = 100000  # statements of a run


class Leave(Exception):
    pass


class Back(Exception):
    pass


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?", text)]


def blocks(lines):
    """Statements up to the brace that ends them, and that line: a block is a list of (head, body)."""
    out = []
    while lines:
        line = lines.pop(0).strip()
        if line.startswith("}"):
            return out, line
        if line.endswith("{"):
            body, end = blocks(lines)
            parts = [(line[:-1].strip(), body)]
            while end != "}":
                if not end.endswith("{"):
                    raise ValueError(f"{end!r} ends no block")
                head = end[1:-1].strip()
                body, end = blocks(lines)
                parts.append((head, body))
            out.append(parts)
        elif line:
            out.append(line)
    return out, ""


class Run:
    def __init__(self, text):
        self.points, self.variables, self.parts, self.count = {}, {}, {}, 0
        lines = [line for line in text.splitlines() if line.strip()]
        self.task = None
        while lines:
            line = lines.pop(0).strip()
            word, _, rest = line.rstrip(";").partition(" ")
            if word in ("place", "joints") and line.endswith(";"):
                name, _, values = rest.partition(" = ")
                n = numbers(values)
                if word == "place" and abs(sum(v * v for v in n[3:]) - 1) > 1e-6:
                    raise ValueError(f"the quaternion of {name} has not the length 1")
                self.points[name] = (Joints(*n) if word == "joints" else Place(
                    1000 * n[0], 1000 * n[1], 1000 * n[2], quaternion(*n[3:])))
            elif word in ("task", "part") and line.endswith("{"):
                body, end = blocks(lines)
                if end != "}":
                    raise ValueError(f"{line} has no end")
                if word == "task":
                    self.task = body
                else:
                    self.parts[rest.rstrip("{ ")] = body
            elif not line.startswith("//"):
                raise ValueError(f"{line!r} does not stand before a task")

    def python(self, text):
        """An expression as Python has it, with the values that variables have now."""
        text = re.sub(r"\bin\[", "i[", text)
        text = text.replace("&&", " and ").replace("||", " or ")
        text = re.sub(r"!(?!=)", " not ", text)
        text = re.sub(r"\bdiv\b", "//", text)
        text = re.sub(r"\bmod\b", "%", text)

        def value(match):
            word = match.group(0)
            if word in ("and", "or", "not") or match.string[match.start():].startswith("i["):
                return word
            if word in ("yes", "no"):
                return str(word == "yes")
            return repr(self.variables[word])
        return re.sub(r"[A-Za-z_]\w*", value, text)

    def value(self, text):
        return eval(self.python(text), {"__builtins__": {}})

    def statement(self, line):
        if not line.endswith(";") and not line.startswith("//"):
            raise ValueError(f"{line!r} has no ;")
        word, _, rest = line.rstrip(";").partition(" ")
        if word == "var" or rest.startswith("= ") and not word.startswith("out["):
            name, _, value = (rest if word == "var" else line.rstrip(";")).partition(" = ")
            if word != "var" and name not in self.variables:
                raise ValueError(f"{name} is not declared")
            self.variables[name] = self.value(value)
        elif re.fullmatch(r"out\[\d+\]", word):
            yield output(int(word[4:-1]), {"= on": 1, "= off": 0}[rest])
        elif word == "sleep":
            yield wait(float(re.fullmatch(r"(\S+) ms", rest).group(1)) / 1000)
        elif word == "await":
            condition, _, time = rest.partition(" for ")
            yield wait_for(self.python(condition),
                           float(re.fullmatch(r"(\S+) s", time).group(1)) if time else None)
        elif word == "say":
            yield message(re.fullmatch(r'"(.*)"', rest).group(1).replace('""', '"'))
        elif word == "do":
            try:
                yield from self.run(self.parts[rest])
            except Back:
                pass
        elif line in ("ask;", "stop;"):
            yield pause() if line == "ask;" else halt()
        elif line == "leave;":
            raise Leave
        elif line == "back;":
            raise Back
        elif word != "//":
            raise ValueError(f"{line!r} is no statement")

    def motion(self, line, blend):
        word, to, speed, unit = re.fullmatch(
            r"(\w+) (.+) at ([\d.]+)(%| m/s);", line).groups()
        if (unit == "%") != (word == "swing"):
            raise ValueError(f"{line!r} has the wrong unit")
        targets = [self.points[p] for p in to.split(", ")]
        if word == "swing":
            return ptp(*targets, float(speed), blend)
        return (lin if word == "drive" else circle)(*targets, 1000 * float(speed), blend)

    def run(self, body):
        for at, one in enumerate(body):
            self.count += 1
            if self.count > MOST:
                raise ValueError("it does not end")
            if not isinstance(one, str):
                yield from self.block(one)
            elif re.match(r"(swing|drive|bend) ", one):
                behind = body[at + 1] if at + 1 < len(body) and isinstance(body[at + 1], str) else ""
                blend = re.fullmatch(r"round ([\d.]+)(%| m);", behind)
                if blend and (blend.group(2) == "%") != one.startswith("swing"):
                    raise ValueError(f"{behind!r} has the wrong unit")
                yield self.motion(one, 0 if not blend else float(blend.group(1)) * (
                    1 if blend.group(2) == "%" else 1000))
            elif one.startswith("round "):
                if at == 0 or not re.match(r"(swing|drive|bend) ", str(body[at - 1])) or (
                        not re.fullmatch(r"round [\d.]+(%| m);", one)):
                    raise ValueError(f"{one!r} is of no motion")
            else:
                yield from self.statement(one)

    def block(self, parts):
        head, body = parts[0]
        word = head.split()[0]
        if word == "if":
            for head, body in parts:
                condition = re.fullmatch(r"(?:el)?if \((.*)\)", head)
                if head == "else" or self.value(condition.group(1)):
                    yield from self.run(body)
                    return
            return
        try:
            while head == "forever" or self.value(re.fullmatch(r"while \((.*)\)", head).group(1)):
                self.count += 1
                if self.count > MOST:
                    raise ValueError("it does not end")
                yield from self.run(body)
        except Leave:
            pass


def read(files):
    run = Run(next(iter(files.values())))
    if run.task is None:
        raise ValueError("there is no task")
    yield from run.run(run.task)
