# SPDX-License-Identifier: Apache-2.0
"""Reads straight programs of the Tern, as its manual would tell: for compare.py."""
import re

from compare import Joints, Place, circle, lin, message, output, ptp, quaternion, wait, wait_for


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?", text)]


def read(files):
    points = {}
    for line in next(iter(files.values())).splitlines():
        line = line.strip().rstrip(";")
        word, _, rest = line.partition(" ")
        if word == "place":
            name, _, values = rest.partition(" = ")
            x, y, z, a, b, c, d = numbers(values)
            points[name] = Place(1000 * x, 1000 * y, 1000 * z, quaternion(a, b, c, d))
        elif word == "joints":
            name, _, values = rest.partition(" = ")
            points[name] = Joints(*numbers(values))
        elif word == "swing":
            to, speed = rest.split(" at ")
            yield ptp(points[to], float(speed.rstrip("%")))
        elif word == "drive":
            to, speed = rest.split(" at ")
            yield lin(points[to], 1000 * float(speed.split()[0]))
        elif word == "bend":
            to, speed = rest.split(" at ")
            via, end = to.split(", ")
            yield circle(points[via], points[end], 1000 * float(speed.split()[0]))
        elif word.startswith("out["):
            yield output(int(word[4:-1]), 1 if rest == "= on" else 0)
        elif word == "sleep":
            yield wait(float(rest.split()[0]) / 1000)
        elif word == "await":
            yield wait_for(rest)
        elif word == "say":
            yield message(rest.strip('"'))
        elif word not in ("task", "}", "round", "", "//"):
            raise ValueError(f"{word} is no word of a straight program")
