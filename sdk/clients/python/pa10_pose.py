# SPDX-License-Identifier: Apache-2.0
"""The PA-10 solves a pose somewhere else, goes there, and a picture comes back.

pa10_pose.py [ADDRESS [TOKEN]]      without an address it starts a program of its own
"""
import sys

import robomosp

GOAL = [0.557, 0, 0.374, "180 deg", 0, "180 deg"]  # m; roll, pitch, yaw

address, token = (sys.argv[1:] + [None, None])[:2]
with robomosp.connect(address, token=token) if address else robomosp.start() as r:
    arm = r.robot.get("pa10")
    found = arm.solve_ik(target=GOAL)
    cell = r.world.create(name="student")
    cell.add_robot(robot=arm)
    cell.set_robot_q(robot="pa10", q=found.q)
    for number, value in enumerate(arm.joint_values(), 1):
        print(f"joint {number}: {value:8.4f} rad")
    try:
        picture = cell.picture(size=[400, 300], quality="draft")
    except robomosp.Error as e:
        print("no picture:", e)
    else:
        picture.save("pa10.png")
        print(f"pa10.png: {len(picture.png)} bytes")
