# SPDX-License-Identifier: Apache-2.0
"""A reader of your target's programs: fill in read(), and run compare.py.

It shall know the controller's manual and not the post: what both get wrong in the same way is
found by nobody.
"""
import re  # noqa: F401  (readers of lines need it)

from compare import (PASS, Joints, Place, circle, halt, lin, message, output, pause,  # noqa: F401
                     ptp, wait, wait_for)
from compare import fixed_xyz, quaternion, rotation_vector, xyz, zyx, zyz  # noqa: F401


def read(files):
    """What a program does, in order.

    files: texts by name, all that were written: {"straight.acl": "begin STRAIGHT\\n..."}. They are
    of the flattened program, or of the structured one: then loops, choices and procedures are
    carried out here. `compare.py --flat` leaves structured ones out.
    Yields actions:
      ptp(target, speed, blend), lin(target, speed, blend), circle(via, end, speed, blend)
      output(number, value), message(text), pause(), halt()
      wait(seconds), wait_for(condition), wait_for(condition, seconds)
    A target is Place(x, y, z, rotation) in mm, with a rotation such as zyx(a, b, c) in degrees, or
    Joints(q1, q2, ...) in degrees and mm. Speeds are in mm/s, of ptp in percent; None = not told.
    blend is the distance in mm, of ptp the percent, at which it goes on into the next motion; 0 = it
    stops, PASS = as far as the controller likes, None = the controller cannot say it.
    A condition is Python's, of inputs by their numbers: "i[1] and not i[2]", "i[5] > 3".

    For the language of docs/plugin_author/post_templates.md it could begin so:

        points = {}
        for line in next(iter(files.values())).splitlines():
            words = re.findall(r"[A-Za-z_]\\w*|[-+]?\\d+\\.?\\d*", line)
            if words[0] == "line":
                yield lin(points[words[1]], speed)
            elif words[0] == "on":
                yield output(int(words[1]), 1)
    """
    raise NotImplementedError("reader.py does not read anything yet: fill in read().")
