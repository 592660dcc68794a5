# SPDX-License-Identifier: Apache-2.0
"""Reads straight programs of the Kestrel, as its manual would tell: for compare.py."""
import re

from compare import Joints, Place, circle, fixed_xyz, lin, message, output, ptp, wait, wait_for


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
    for number, line in enumerate(lines, 1):
        own, word, *rest = line.split(None, 2)
        if own != f"S{number:04}":
            raise ValueError(f"step {own} stands at {number}")
        words = rest[0].split() if rest else []
        speed = next((float(w[1:]) for w in words if w.startswith("V")), None)
        if word == "JMOV":
            yield ptp(points[words[0]], speed)
        elif word == "LMOV":
            yield lin(points[words[0]], speed)
        elif word == "CIRC":
            yield circle(points[words[0]], points[words[1]], speed)
        elif word == "OUT":
            yield output(int(words[0]), 1 if words[1] == "ON" else 0)
        elif word == "DELAY":
            yield wait(int(words[0]) / 1000)
        elif word == "HOLD":
            yield wait_for(rest[0])
        elif word == "SHOW":
            yield message(rest[0].strip('"'))
        elif word != "END":
            raise ValueError(f"{word} is no word of a straight program")
