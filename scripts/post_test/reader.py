# SPDX-License-Identifier: Apache-2.0
"""A reader of your target's programs: fill in read(), and run compare.py.

It shall know the controller's manual and not the post: what both get wrong in the same way is
found by nobody.
"""
import re  # noqa: F401  (readers of lines need it)

from compare import Joints, Place, circle, lin, message, output, ptp, wait, wait_for  # noqa: F401
from compare import fixed_xyz, quaternion, rotation_vector, xyz, zyx, zyz  # noqa: F401


def read(files):
    """What a program does, in order.

    files: texts by name, as {"straight.acl": "begin STRAIGHT\\n..."}.
    Yields actions:
      ptp(target, speed), lin(target, speed), circle(via, end, speed)
      output(number, value), wait(seconds), wait_for(condition), message(text)
    A target is Place(x, y, z, rotation) in mm, with a rotation such as zyx(a, b, c) in degrees, or
    Joints(q1, q2, ...) in degrees and mm. Speeds are in mm/s, of ptp in percent; None = not told.

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
