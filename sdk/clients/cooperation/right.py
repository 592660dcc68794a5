# SPDX-License-Identifier: Apache-2.0
"""The right robot: takes the bar out of the hand of the left one and puts it on its own stand.

    python3 right.py [ADDRESS [SECONDS]]      for so long the other one may be away before the first signal
"""
import math
import sys

import robomosp

PI = math.pi
TOP = 0.42  # where the tool puts the bar down [m]
GRASP = {"position": [0, 0, -0.02]}  # the bar in the frame of the tool
ON_STAND = {"position": [1.10, 0.30, 0.44], "rpy": [0, PI, 0]}  # its other end up


def run(r, cell, name, steps):
    """Runs a task of this robot from where it stands; gives where its joints are then."""
    task = r.task.create(name=name, steps=steps)
    placed = cell.add_task(task=task, robot="right")
    recording = cell.run_task(task=placed)
    for note in recording.notes():
        if note.startswith("t = "):  # what was taken and let go, and when
            print(f"right: {name}, {note}", flush=True)
    last = [recording.values(f"right.q{j}")[-1] for j in range(1, 7)]
    cell.remove_member(placed)
    task.remove()
    return last


def main(address, patience=30.0):
    with robomosp.connect(address, client="right") as r:
        cell = r.world.get("cell")
        cell.set_signal(signal="taken", value=0)
        q = run(r, cell, "approach", [
            {"step": "move", "target": [0.17, 0, 0, PI, PI / 2, 0], "frame": "middle", "speed": 0.5}])
        cell.set_robot_q(robot="right", q=q)
        r.server.wait(signal="offered", client="left", timeout=60, absent=patience)
        q = run(r, cell, "take", [
            {"step": "move", "target": [0.10, 0, 0, PI, PI / 2, 0], "frame": "middle", "path": "straight"}])
        cell.set_robot_q(robot="right", q=q)
        cell.attach(object="bar", robot="right", **GRASP)  # it changes hands
        cell.set_signal(signal="taken", value=1)
        r.server.wait(signal="clear", client="left", timeout=60)
        q = run(r, cell, "put", [
            {"step": "move", "target": [1.10, 0.30, TOP + 0.15, PI, 0, PI]},
            {"step": "move", "target": [1.10, 0.30, TOP, PI, 0, PI], "path": "straight"},
            {"step": "detach", "object": "bar"},
            {"step": "move", "target": [1.10, 0.30, TOP + 0.15, PI, 0, PI], "path": "straight"}])
        cell.place(member="bar", **ON_STAND)
        cell.detach(object="bar")
        cell.set_robot_q(robot="right", q=q)
        cell.set_signal(signal="taken", value=0)
        print("right: done", flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1:7007", *map(float, sys.argv[2:3]))
    except robomosp.Error as e:
        sys.exit(f"right: {e}")
