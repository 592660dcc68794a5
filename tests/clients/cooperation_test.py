# SPDX-License-Identifier: Apache-2.0
"""Two programs, each with a robot, pass a bar in one world; and one of them is killed.

ROBOMOSP_KILLS is how often one is killed (3 unless given), ROBOMOSP_KILL_SEED where the moments begin.
"""
import math
import os
import random
import subprocess
import sys
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
SDK = os.path.join(HERE, "..", "..", "sdk", "clients")
sys.path[:0] = [os.path.join(SDK, "python"), HERE]
import robomosp  # noqa: E402
from fake_server import short_folder  # noqa: E402
from serving import PROGRAM, end, listening  # noqa: E402

KILLS = int(os.environ.get("ROBOMOSP_KILLS", "3"))
SEED = int(os.environ.get("ROBOMOSP_KILL_SEED", "7"))
PI = math.pi


class Cell:
    """A server with the world of the two robots, and a watcher of who holds the bar."""

    def __init__(self, folder):
        self.address = "unix:" + os.path.join(folder, "s")
        self.process, _ = listening(
            [PROGRAM, "serve", "--listen", self.address, os.path.join(SDK, "cooperation", "cell.lua")])
        self.r = robomosp.connect(self.address, client="watcher")
        self.held = [()]  # who held the bar, one after the other
        self.revisions = 0
        self.events = self.r.on_event(self._look, "change", kinds=["world"])

    def _look(self, event):
        # Several commits may be one event; each edit sends one, and what is read is a state in between.
        holders = self.holders()
        self.revisions += event.get("commits", 1)
        if holders != self.held[-1]:
            self.held.append(holders)

    def holders(self):
        return tuple(a.robot for a in self.r.world.attachments("cell") if a.object == "bar")

    def bar(self):
        """Where the bar is placed in the world when nobody holds it."""
        return next(o for o in self.r.world.describe("cell").objects if o.name == "bar").placement

    def robot(self, name):
        environment = {**os.environ, "PYTHONPATH": sys.path[0]}
        return subprocess.Popen([sys.executable, "-B", os.path.join(SDK, "cooperation", name + ".py"), self.address, "3"],
                                env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.r.close()
        end(self.process)


def said(process, seconds=60):
    """What it printed until its end."""
    timer = threading.Timer(seconds, process.kill)
    timer.start()
    try:
        return process.communicate()[0]
    finally:
        timer.cancel()


def tool_pose(r, robot, q):
    """(rotation, position) of the tool in the frame of the robot."""
    pose = [list(row) for row in r.robot.fk("irb140", q=list(q)).pose]
    return [row[:3] for row in pose[:3]], [row[3] for row in pose[:3]]


class Cooperation(unittest.TestCase):
    def test_two_programs_pass_a_bar(self):
        with short_folder() as folder, Cell(folder) as cell:
            right, left = cell.robot("right"), cell.robot("left")
            left_said, right_said = said(left), said(right)
            self.assertEqual((left.returncode, right.returncode), (0, 0), left_said + right_said)
            self.assertIn("left takes bar", left_said)
            self.assertIn("bar is released", right_said)
            # It stands on the other stand, its other end up: 0.2 m of stand and 0.24 m of bar.
            placement = cell.bar()
            for have, want in zip(placement.position, (1.10, 0.30, 0.44)):
                self.assertAlmostEqual(have, want, delta=1e-12)
            # One after the other, and never both.
            end = time.monotonic() + 5
            while cell.held[-1] != () and time.monotonic() < end:
                time.sleep(0.02)
            self.assertEqual(cell.held, [(), ("left",), ("right",), ()])
            self.assertEqual(list(cell.r.world.tasks("cell")), [])
            self.assert_recordings(cell.r)

    def assert_recordings(self, r):
        """In each row of each run one hand at most holds the bar, and it never jumps from run to run."""
        ends = None
        runs = [h for h in (one.recording for one in r.recording.list()) if "bar.x" in [c.name for c in r.recording.columns(h)]]
        self.assertGreaterEqual(len(runs), 3)  # fetch, take and put; leave has nothing in its hand
        for h in runs:
            value = lambda name: list(r.recording.values(h, name))  # noqa: E731, B023
            bar = list(zip(value("bar.x"), value("bar.y"), value("bar.z")))
            hands = {}
            for name, base, sign in (("left", 0.0, 1), ("right", 1.5, -1)):
                q = list(zip(*(value(f"{name}.q{j}") for j in range(1, 7))))
                tools = r.robot.fk("irb140", q=q).position
                hands[name] = [(base + sign * p[0], sign * p[1], p[2]) for p in tools]
            # Held: the distance from tool to bar is that of the grasp. The two grasps are 0.22 m and 0.02 m.
            for i, at in enumerate(bar):
                moves = i > 0 and math.dist(at, bar[i - 1]) > 1e-9
                # Let go between two rows: who had it in the row before has moved it, and it rests then.
                rests = moves and i + 1 < len(bar) and math.dist(at, bar[i + 1]) < 1e-9
                rows = (i - 1, i) if rests else (i,)
                by_left = any(abs(math.dist(bar[k], hands["left"][k]) - 0.22) < 1e-6 for k in rows)
                by_right = any(abs(math.dist(bar[k], hands["right"][k]) - 0.02) < 1e-6 for k in rows)
                if moves:
                    self.assertTrue(by_left or by_right, f"the bar moves by itself in row {i}")
                if moves and by_left and by_right:
                    self.fail(f"both hands move the bar in row {i}")
            if ends is not None:
                self.assertLess(math.dist(ends, bar[0]), 1e-6)
            ends = bar[-1]

    def test_who_is_left_over_is_told(self):
        moments = random.Random(SEED)
        for n in range(KILLS):
            with self.subTest(n=n), short_folder() as folder, Cell(folder) as cell:
                left, right = cell.robot("left"), cell.robot("right")
                victim, other, name = (left, right, "left") if n % 2 == 0 else (right, left, "right")
                time.sleep(0.1 + moments.random() * 0.5)
                victim.kill()
                said(victim)
                began = time.monotonic()
                sentence = said(other)
                if other.returncode != 0:
                    # It had to wait for the one that is gone: the first wait is patient for 3 s, the others for 5.
                    self.assertIn(f'no client "{name}" has been connected', sentence)
                    self.assertEqual(sentence.strip().count("Traceback"), 0)
                    self.assertLess(time.monotonic() - began, 30)
                # The world is whole: one hand at most, and the same program can begin anew.
                self.assertLessEqual(len(cell.holders()), 1)
                self.assertEqual(cell.r.server.wait(signal="offered", at_least=0, timeout=0) in (0, 1), True)


if __name__ == "__main__":
    unittest.main()
