# SPDX-License-Identifier: Apache-2.0
"""Runs programs of the Kestrel, as its manual would tell: for compare.py."""
import re

from compare import (Joints, Place, circle, fixed_xyz, halt, lin, message, output, pause, ptp, wait,
                     wait_for)

MOST = 100000  # steps of a run


def number(words, letter):
    """That of the word that begins with this letter; None = there is none."""
    return next((float(w[1:]) for w in words if w.startswith(letter)), None)


def read(files):
    steps = next(text for name, text in files.items() if name.endswith(".KSL"))
    head = dict(re.findall(r"^%(\w+) (\S+)\s*$", steps, re.M))
    lines = [line for line in steps.splitlines() if line.startswith("S")]
    if int(head["STEPS"]) != len(lines):
        raise ValueError(f"{len(lines)} steps, and the header says {head['STEPS']}")
    if int(head["CHECK"], 16) != sum(map(ord, "".join(lines))) % 65536:
        raise ValueError("the checksum is wrong")
    points = {}
    for name, text in files.items():
        for line in text.splitlines() if name.endswith(".KPT") else []:
            word, kind, *numbers = line.split()
            if kind == "J":
                points[word] = Joints(*numbers)
            else:
                x, y, z, w, p, r = map(float, numbers[:6])
                points[word] = Place(x, y, z, fixed_xyz(w, p, r))
    routines = {}
    for at, line in enumerate(lines):
        if not line.startswith(f"S{at + 1:04} "):
            raise ValueError(f"step {line[:5]} stands at {at + 1}")
        if line[6:].startswith("SUB "):
            routines[line[10:]] = at + 1
    registers, calls, at = {}, [], 0

    def python(text):
        """An expression as Python has it, with the values that registers have now."""
        text = re.sub(r"\bIN\((\d+)\)", r"i[\1]", text).replace("<>", "!=")
        text = re.sub(r"(?<![<>!=])=(?!=)", "==", text)
        text = re.sub(r"\b(AND|OR|NOT)\b", lambda m: m.group(0).lower(), text)
        return re.sub(r"\bR(\d+)\b", lambda m: repr(registers[m.group(1)]), text)

    for _ in range(MOST):
        _, word, *rest = lines[at].split(None, 2)
        rest = rest[0] if rest else ""
        words = rest.split()
        at += 1
        speed, blend = number(words, "V"), number(words, "R") or 0
        if word == "JMOV":
            yield ptp(points[words[0]], speed, blend)
        elif word == "LMOV":
            yield lin(points[words[0]], speed, blend)
        elif word == "CIRC":
            yield circle(points[words[0]], points[words[1]], speed, blend)
        elif word == "OUT":
            yield output(int(words[0]), {"ON": 1, "OFF": 0}[words[1]])
        elif word == "DELAY":
            yield wait(int(rest) / 1000)
        elif word == "HOLD":
            yield wait_for(python(rest))
        elif word == "SHOW":
            yield message(re.fullmatch(r'"(.*)"', rest).group(1))
        elif word == "PAUSE":
            yield pause()
        elif word == "STOP":
            yield halt()
        elif word == "SET":
            name, value = re.fullmatch(r"R(\d+) = (.*)", rest).groups()
            registers[name] = eval(python(value), {"__builtins__": {}})
        elif word == "JUMP":
            at = int(re.fullmatch(r"S(\d{4})", rest).group(1)) - 1
        elif word == "IFNOT":
            condition, to = re.fullmatch(r"(.*) JUMP S(\d{4})", rest).groups()
            if not eval(python(condition), {"__builtins__": {}}):
                at = int(to) - 1
        elif word == "CALL":
            calls.append(at)
            at = routines[rest]
        elif word == "RETURN":
            at = calls.pop()
        elif word == "END":
            return
        else:
            raise ValueError(f"{word} is no word of the Kestrel")
    raise ValueError("it does not end")
