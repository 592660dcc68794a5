# SPDX-License-Identifier: Apache-2.0
"""Joint trajectories as messages of ROS: each NAME.json and its NAME.yaml are put into a message of the package
trajectory_msgs, serialised, read from the bytes and compared with the file, number by number. Times rise strictly, and
every point has as many numbers as there are joints. Ends with 0, or 1 and a sentence a fault; 77 = packages missing."""
import io
import json
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


def check(name):
    with open(name + ".json", encoding="utf-8") as file:
        data = json.load(file)
    with open(name + ".yaml", encoding="utf-8") as file:
        same = yaml.safe_load(file)
    if data != same:
        raise ValueError("JSON and YAML differ")
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


points = 0
for name in sys.argv[1:]:
    try:
        points += check(name)
    except (ValueError, KeyError, TypeError, genpy.MessageException, struct.error) as wrong:
        faults.append("%s: %s" % (name, wrong))
print("\n".join(faults) if faults else "%d points" % points)
sys.exit(1 if faults else 0)
