# SPDX-License-Identifier: Apache-2.0
"""Joint trajectories as messages of ROS: each NAME.json and its NAME.yaml are put into a message of the package
trajectory_msgs, serialised, read from the bytes and compared with the file, number by number. Times rise strictly, and
every point has as many numbers as there are joints. A sequence (NAME_sequence) is the same in both forms, names
trajectories that are there, each once and in order, and its steps are of known kinds. A name @FILE is the names in that
file, one a line. Ends with 0, or 1 and a sentence a fault; 77 = packages missing."""
import io
import json
import os
import struct
import sys

try:
    import genpy
    import yaml
    from std_msgs.msg import Header
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
except ImportError as missing:
    print(missing)
    sys.exit(77)

KEYS = {"header", "joint_names", "points"}
POINT_KEYS = {"positions", "velocities", "accelerations", "effort", "time_from_start"}
faults = []


def moment(value):
    if set(value) != {"sec", "nanosec"} or not all(isinstance(v, int) for v in value.values()):
        raise ValueError("a time is not of sec and nanosec, whole: %r" % (value,))
    if not 0 <= value["nanosec"] < 10**9:
        raise ValueError("a time has %d nanoseconds" % value["nanosec"])
    return genpy.Duration(value["sec"], value["nanosec"])


def message(data):
    if set(data) != KEYS:
        raise ValueError("the fields are %s" % sorted(data))
    out = JointTrajectory()
    stamp = moment(data["header"]["stamp"])
    out.header = Header(0, genpy.Time(stamp.secs, stamp.nsecs), data["header"]["frame_id"])
    out.joint_names = list(data["joint_names"])
    for p in data["points"]:
        if set(p) != POINT_KEYS:
            raise ValueError("the fields of a point are %s" % sorted(p))
        out.points.append(JointTrajectoryPoint(
            list(p["positions"]), list(p["velocities"]), list(p["accelerations"]), list(p["effort"]),
            moment(p["time_from_start"])))
    return out


def numbers_are(data, joints):
    last = None
    for i, p in enumerate(data["points"]):
        if len(p["positions"]) != joints:
            raise ValueError("point %d has %d positions" % (i, len(p["positions"])))
        for field in ("positions", "velocities", "accelerations", "effort"):
            if p[field] and len(p[field]) != joints:
                raise ValueError("point %d has %d %s" % (i, len(p[field]), field))
            if not all(isinstance(v, float) and v == v and abs(v) < 1e9 for v in p[field]):
                raise ValueError("point %d has %s that are no numbers" % (i, field))
        now = (p["time_from_start"]["sec"], p["time_from_start"]["nanosec"])
        if not 0 <= now[1] < 10**9 or (last is not None and now <= last):
            raise ValueError("the time of point %d does not rise" % i)
        last = now


STEPS = {
    "trajectory": ({"trajectory"}, str), "set": ({"set", "number", "width", "value"}, str), "wait": ({"wait"}, float),
    "wait_for": ({"wait_for", "timeout"}, (list, bool)), "text": ({"text", "ends_line"}, str), "pause": ({"pause"}, str),
    "halt": ({"halt"}, bool)}
OPERATORS = {"input": 0, "output": 0, "not": 1, "negate": 1, "and": 2, "or": 2, "xor": 2, "=": 2, "<>": 2, "<": 2,
             "<=": 2, ">": 2, ">=": 2, "+": 2, "-": 2, "*": 2}


def condition(value):
    if not isinstance(value, list):
        if not isinstance(value, (bool, int, float)):
            raise ValueError("%r is no value of a condition" % (value,))
        return
    word, rest = value[0], value[1:]
    if OPERATORS[word] == 0:
        if not isinstance(rest[0], str) or not all(isinstance(n, int) for n in rest[1:]) or not 2 <= len(rest) <= 3:
            raise ValueError("%r is no signal" % (value,))
        return
    if len(rest) != OPERATORS[word]:
        raise ValueError("%s has %d operands" % (word, len(rest)))
    for each in rest:
        condition(each)


def sequence(name, data):
    if set(data) != {"sequence", "steps"} or data["sequence"] != 1:
        raise ValueError("the fields of the sequence are %s" % sorted(data))
    base, count = name[:-len("_sequence")], 0
    for step in data["steps"]:
        kinds = [k for k in STEPS if k in step]
        if len(kinds) != 1 or not set(step) <= STEPS[kinds[0]][0] or not isinstance(step[kinds[0]], STEPS[kinds[0]][1]):
            raise ValueError("%r is no step" % (step,))
        if "trajectory" in step:
            count += 1
            if step["trajectory"] != "%s_%d" % (os.path.basename(base), count) or not os.path.exists(
                    "%s_%d.json" % (base, count)):
                raise ValueError("%r is not the next trajectory" % step["trajectory"])
        if "wait_for" in step:
            condition(step["wait_for"])
        if "set" in step and not isinstance(step["value"], (bool, int, float)):
            raise ValueError("%r is no value of an output" % (step["value"],))
    if os.path.exists("%s_%d.json" % (base, count + 1)):
        raise ValueError("a trajectory is not in the sequence")
    return 0


def check(name):
    with open(name + ".json", encoding="utf-8") as file:
        data = json.load(file)
    with open(name + ".yaml", encoding="utf-8") as file:
        same = yaml.safe_load(file)
    if data != same:
        raise ValueError("JSON and YAML differ")
    if "sequence" in data:
        return sequence(name, data)
    numbers_are(data, len(data["joint_names"]))
    sent = message(data)
    wire = io.BytesIO()
    sent.serialize(wire)
    got = JointTrajectory()
    got.deserialize(wire.getvalue())
    again = io.BytesIO()
    got.serialize(again)
    if wire.getvalue() != again.getvalue():
        raise ValueError("the bytes differ")
    if list(got.joint_names) != data["joint_names"] or got.header.frame_id != data["header"]["frame_id"]:
        raise ValueError("names differ")
    if len(got.points) != len(data["points"]):
        raise ValueError("the number of points differs")
    for i, (a, b) in enumerate(zip(got.points, data["points"])):
        if struct.pack("<%dd" % len(a.positions), *a.positions) != struct.pack("<%dd" % len(a.positions), *b["positions"]):
            raise ValueError("positions of point %d differ" % i)
        for field in ("velocities", "accelerations", "effort"):
            if list(getattr(a, field)) != b[field]:
                raise ValueError("%s of point %d differ" % (field, i))
        if (a.time_from_start.secs, a.time_from_start.nsecs) != (
                b["time_from_start"]["sec"], b["time_from_start"]["nanosec"]):
            raise ValueError("the time of point %d differs" % i)
    return len(got.points)


names = []
for argument in sys.argv[1:]:
    if argument.startswith("@"):
        with open(argument[1:], encoding="utf-8") as listed:
            names += listed.read().split("\n")[:-1]
    else:
        names.append(argument)
points = 0
for name in names:
    try:
        points += check(name)
    except (ValueError, KeyError, TypeError, IndexError, genpy.MessageException, struct.error) as wrong:
        faults.append("%s: %s" % (name, wrong))
print("\n".join(faults) if faults else "%d points" % points)
sys.exit(1 if faults else 0)
