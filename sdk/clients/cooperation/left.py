# SPDX-License-Identifier: Apache-2.0
"""The left robot: takes the bar from its stand, holds it out, and lets the right one have it.

    python3 left.py [ADDRESS [SECONDS]]      for so long the other one may be away before the first signal
"""
import math
import sys

import robomosp

PI = math.pi
TOP = 0.42  # of the bar on its stand, where the tool holds it [m]
GRASP = {"position": [0, 0, 0.22], "rpy": [0, PI, 0]}  # the bar in the frame of the tool


def run(r, cell, name, steps):
    """Runs a task of this robot from where it stands; gives where its joints are then."""
    task = r.task.create(name=name, steps=steps)
    placed = cell.add_task(task=task, robot="left")
    recording = cell.run_task(task=placed)
    for note in recording.notes():
        if note.startswith("t = "):  # what was taken and let go, and when
            print(f"left: {name}, {note}", flush=True)
    last = [recording.values(f"left.q{j}")[-1] for j in range(1, 7)]
    cell.remove_member(placed)
    task.remove()
    return last


def main(address, patience=30.0):
    with robomosp.connect(address, client="left") as r:
        cell = r.world.get("cell")
        for signal in ("offered", "clear"):
            cell.set_signal(signal=signal, value=0)
        q = run(r, cell, "fetch", [
            {"step": "move", "target": [0.40, 0.30, TOP + 0.1, PI, 0, PI]},
            {"step": "move", "target": [0.40, 0.30, TOP, PI, 0, PI], "path": "straight"},
            {"step": "attach", "object": "bar"},
            {"step": "move", "target": [0.40, 0.30, TOP + 0.15, PI, 0, PI], "path": "straight"},
            {"step": "move", "target": [-0.10, 0, 0, PI, -PI / 2, 0], "frame": "middle"}])
        cell.attach(object="bar", robot="left", **GRASP)
        cell.set_robot_q(robot="left", q=q)
        cell.set_signal(signal="offered", value=1)
        r.server.wait(signal="taken", client="right", timeout=60, absent=patience)
        q = run(r, cell, "leave", [
            {"step": "move", "target": [-0.17, 0, 0, PI, -PI / 2, 0], "frame": "middle", "path": "straight"}])
        cell.set_robot_q(robot="left", q=q)
        cell.set_signal(signal="clear", value=1)
        r.server.wait(signal="taken", value=0, client="right", timeout=60)
        print("left: done", flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7007", *map(float, sys.argv[2:3]))
    except robomosp.Error as e:
        sys.exit(f"left: {e}")
