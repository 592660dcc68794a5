# SPDX-License-Identifier: Apache-2.0
"""Programs in IRL that were posted to C: compiled without a warning, they drive a robot of a server that runs; and with
a recording library in place of the PA-10's they call what the program says."""
import math
import os
import shutil
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
CLIENTS = os.path.join(ROOT, "sdk", "clients")
sys.path.insert(0, HERE)
sys.path.insert(0, os.path.join(CLIENTS, "python"))
import robomosp  # noqa: E402
from fake_server import short_folder  # noqa: E402
from serving import Serving  # noqa: E402

CC = shutil.which("cc") or shutil.which("gcc")
STRICT = ["-std=c11", "-Wall", "-Wextra", "-Werror"]
POSTED = os.path.join(ROOT, "tests", "unit", "posts")

SCENE = """
local cell = world.create{name = "cell"}
cell:add_robot{robot = robot.get("puma560")}
"""
PROGRAM = """PROGRAM stack;
SIGNAL
  INPUT BOOL: ready AT 1;
  OUTPUT BOOL: gripper AT 3;
VAR
  JOINT: home := JOINT(MAIN_JOINT(11.459156, -30.0, -170.0, 5.729578, -40.0, 11.459156), ADD_JOINT(0.0));
  POSE: place := POSE(POSITION(%s), ORIQUAT(%s));
  POSITION: down := POSITION(0.0, 0.0, -40.0);
  INT: i;
PROCEDURE lower (IN INT: times);
BEGIN
  FOR i := 1 TO times
    MOVE_INC LIN down;
  ENDFOR;
ENDPROC;
BEGIN
  MOVE PTP home;
  WAIT FOR ready;
  MOVE LIN place SPEED := 500.0;
  lower(2);
  gripper := TRUE;
  IF i <> 2 THEN HALT; ENDIF;
ENDPROGRAM;
"""
ARC = """PROGRAM arc;
SIGNAL
  OUTPUT BOOL: mark AT 3;
BEGIN
  MOVE PTP JOINT(MAIN_JOINT(11.459156, -30.0, -170.0, 5.729578, -40.0, 11.459156), ADD_JOINT(0.0));
  mark := TRUE;
  MOVE CIRCLE %s, %s SPEED := 100.0;
  mark := FALSE;
  MOVE PTP JOINT(MAIN_JOINT(11.459156, -30.0, -170.0, 5.729578, -40.0, 11.459156), ADD_JOINT(0.5));
ENDPROGRAM;
"""
PA_HEADER = """#ifndef PA_H
#define PA_H
typedef struct ANGLE { double s1, s2, s3, e1, e2, w1, w2; } ANGLE;
typedef double MATRIX[3][4];
enum { ARM0 = 0 };
enum { S1 = 1, S2 = 2, S3 = 4, E1 = 8, E2 = 16, W1 = 32, W2 = 64 };
enum { WM_WAIT = 1, MM_XYZNOA = 3 };
int pa_ini_sys(void);
int pa_ter_sys(void);
int pa_opn_arm(int arm);
int pa_cls_arm(int arm);
int pa_sta_arm(int arm);
int pa_ext_arm(int arm);
int pa_stp_arm(int arm);
int pa_sus_arm(int arm);
int pa_rsm_arm(int arm);
int pa_exe_axs(int arm, int axes, const ANGLE *angle, int wait);
int pa_mov_mat(int arm, int mode, MATRIX m, const ANGLE *angle, int wait);
#endif
"""
PA_RECORDER = """#include <stdio.h>
#include "pa.h"
int pa_ini_sys(void) { return puts("ini"); }
int pa_ter_sys(void) { return puts("ter"); }
int pa_opn_arm(int arm) { return printf("opn %d\\n", arm); }
int pa_cls_arm(int arm) { return printf("cls %d\\n", arm); }
int pa_sta_arm(int arm) { return printf("sta %d\\n", arm); }
int pa_ext_arm(int arm) { return printf("ext %d\\n", arm); }
int pa_stp_arm(int arm) { return printf("stp %d\\n", arm); }
int pa_sus_arm(int arm) { return printf("sus %d\\n", arm); }
int pa_rsm_arm(int arm) { return printf("rsm %d\\n", arm); }
int pa_exe_axs(int arm, int axes, const ANGLE *a, int wait) {
  return printf("axs %d %d %d %.9f %.9f %.9f %.9f %.9f %.9f %.9f\\n", arm, axes, wait, a->s1, a->s2, a->s3, a->e1, a->e2,
                a->w1, a->w2);
}
int pa_mov_mat(int arm, int mode, MATRIX m, const ANGLE *angle, int wait) {
  (void)angle;
  return printf("mat %d %d %d %.6f %.6f %.6f %.6f\\n", arm, mode, wait, m[0][3], m[1][3], m[2][3], m[2][2]);
}
void rmp_user_output(int number, double value);
double rmp_user_input(int number);
void rmp_user_wait(double seconds);
void rmp_user_output(int number, double value) { printf("out %d %g\\n", number, value); }
double rmp_user_input(int number) { return number > 0; }
void rmp_user_wait(double seconds) { printf("wait %g\\n", seconds); }
"""


def run(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, timeout=120, **more)


@unittest.skipUnless(CC, "there is no compiler of C")
class PostedC(unittest.TestCase):
    def write(self, folder, posted):
        self.assertTrue(posted.correct)
        for each in posted.files:
            with open(os.path.join(folder, each["name"]), "w", encoding="utf-8") as file:
                file.write(each["text"])

    def compile(self, folder, out, *files):
        c = os.path.join(CLIENTS, "c")
        done = run(CC, *STRICT, "-I" + folder, "-I" + c, *files, "-lm", "-o", out)
        self.assertEqual(done.stdout + done.stderr, "")

    def test_drives_a_robot_of_a_world_that_is_served(self):
        with short_folder() as folder:
            scene = os.path.join(folder, "scene.lua")
            with open(scene, "w", encoding="utf-8") as file:
                file.write(SCENE)
            with Serving("--listen", "127.0.0.1:0", scene) as server, robomosp.connect(server.address) as r:
                arm = r.robot.get("puma560")
                start = arm.fk(q=[0.2, -0.5235987756, -2.967059728, 0.1, -0.6981317008, 0.2])
                mm = [1000 * float(x) for x in start.position]
                mm[2] -= 20  # within reach all the way down
                source = PROGRAM % (", ".join(f"{x:.6f}" for x in mm),
                                    ", ".join(f"{float(x):.9f}" for x in start.quaternion))
                program = r.program.create(name="stack", source=source)
                self.write(folder, r.program.post(id=program, target="c"))
                self.compile(folder, os.path.join(folder, "stack"), os.path.join(folder, "stack.c"),
                             os.path.join(folder, "rmp_motion.c"), os.path.join(folder, "rmp_robomosp.c"),
                             os.path.join(CLIENTS, "c", "robomosp_client.c"))
                done = run(os.path.join(folder, "stack"), server.address, "puma560", "--input", "1=1")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertIn("output 3 gripper 1", done.stdout)
                end = arm.fk(q=arm.joint_values())
                for i, wanted in enumerate((mm[0], mm[1], mm[2] - 80)):
                    self.assertAlmostEqual(1000 * float(end.position[i]), wanted, delta=1e-3)
                for a, b in zip(end.quaternion, start.quaternion):
                    self.assertAlmostEqual(float(a), float(b), delta=1e-6)
                # What is not known is said, and ends the program.
                done = run(os.path.join(folder, "stack"), server.address, "puma560")
                self.assertEqual((done.returncode, done.stderr),
                                 (1, "input 1 (ready) has no value: start with --input 1=VALUE\n"))

    def test_an_arc_takes_its_length_over_its_speed(self):
        # Half a circle of 60 mm at 100 mm/s: pi * 0.6 s. Its chords were rounded up to cycles, one by one.
        with short_folder() as folder:
            scene = os.path.join(folder, "scene.lua")
            with open(scene, "w", encoding="utf-8") as file:
                file.write(SCENE)
            with Serving("--listen", "127.0.0.1:0", scene) as server, robomosp.connect(server.address) as r:
                arm = r.robot.get("puma560")
                start = arm.fk(q=[0.2, -0.5235987756, -2.967059728, 0.1, -0.6981317008, 0.2])
                x, y, z = (1000 * float(v) for v in start.position)
                turned = ", ".join(f"{float(v):.9f}" for v in start.quaternion)
                # Begins where the robot is said to be, so that nothing but the arc takes time.
                source = ARC % tuple(f"POSE(POSITION({a:.6f}, {b:.6f}, {c:.6f}), ORIQUAT({turned}))"
                                     for a, b, c in ((x - 60, y - 60, z), (x, y - 120, z)))
                program = r.program.create(name="arc", source=source)
                self.write(folder, r.program.post(id=program, target="c"))
                self.compile(folder, os.path.join(folder, "arc"), os.path.join(folder, "arc.c"),
                             os.path.join(folder, "rmp_motion.c"), os.path.join(folder, "rmp_robomosp.c"),
                             os.path.join(CLIENTS, "c", "robomosp_client.c"))
                done = run(os.path.join(folder, "arc"), server.address, "puma560")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                times = [float(line.split()[0]) for line in done.stdout.splitlines() if " output 3 " in line]
                self.assertAlmostEqual(times[1] - times[0], math.pi * 0.6, delta=0.002)
                # The additional joint of the last target, where the program gives it.
                self.assertIn(" additional 1 0.5", done.stdout)

    def test_calls_the_library_of_the_pa10_as_the_program_says(self):
        with short_folder() as folder, robomosp.start(os.environ["ROBOMOSP_PROGRAM"]) as r:
            for name, text in (("pa.h", PA_HEADER), ("recorder.c", PA_RECORDER)):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            program = r.program.import_(file=os.path.join(POSTED, "hanoi.irl"))
            self.write(folder, r.program.post(id=program, target="pa10"))
            self.compile(folder, os.path.join(folder, "towers"), os.path.join(folder, "towers.c"),
                         os.path.join(folder, "rmp_motion.c"), os.path.join(folder, "rmp_pa10.c"),
                         os.path.join(folder, "recorder.c"))
            done = run(os.path.join(folder, "towers"))
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            lines = done.stdout.splitlines()
            self.assertEqual(lines[:3], ["ini", "opn 0", "sta 0"])
            self.assertEqual(lines[-4:], ["done in 7 transfers", "ext 0", "cls 0", "ter"])
            moves = [line.split() for line in lines if line.startswith("mat")]
            # 7 transfers of 6 motions; discs are taken from 75, 45 and 15 mm; the tool points down.
            self.assertEqual(len(moves), 42)
            self.assertEqual(sum(line.startswith("out 3") for line in lines), 14)
            self.assertEqual(moves[0], "mat 0 3 1 600.000000 -250.000000 260.000000 -1.000000".split())
            self.assertEqual(moves[1][5:7], ["-250.000000", "75.000000"][:2])
            self.assertEqual(sorted({m[6] for m in moves}), ["15.000000", "260.000000", "45.000000", "75.000000"])

    def test_numbers_in_messages_are_those_of_a_run(self):
        numbers = ["100000.0 * one", "0.0 * (-one)", "one / 3.0", "-2.5 * one", "1.0e15 * one", "1.25e20 * one", "0.00001 * one",
                   "0.000009 * one", "0.1 * one + 0.2 * one", "999999999999999.0", "1.0e300 * one", "one * 2.0 / 3.0e-20"]
        source = ("PROGRAM numbers;\nVAR\n  REAL: x, one := 1.0;\n  INT: i := 7;\nBEGIN\n" +
                  "".join(f"  x := {n};\n  WRITELN('x = ', x, ', ', i, ' ', x > 0.0);\n" for n in numbers) +
                  "ENDPROGRAM;\n")
        with short_folder() as folder, robomosp.start(os.environ["ROBOMOSP_PROGRAM"]) as r:
            for name, text in (("pa.h", PA_HEADER), ("recorder.c", PA_RECORDER), ("numbers.irl", source)):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            program = r.program.create(name="numbers", source=source)
            self.write(folder, r.program.post(id=program, target="pa10", form="structured"))
            self.compile(folder, os.path.join(folder, "numbers"), os.path.join(folder, "numbers.c"),
                         os.path.join(folder, "rmp_motion.c"), os.path.join(folder, "rmp_pa10.c"),
                         os.path.join(folder, "recorder.c"))
            done = run(os.path.join(folder, "numbers"))
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            written = [line for line in done.stdout.splitlines() if line.startswith("x = ")]
            interpreted = run(os.environ["ROBOMOSP_PROGRAM"], "irl", os.path.join(folder, "numbers.irl"))
            self.assertEqual(written, interpreted.stdout.splitlines())
            self.assertEqual(len(written), len(numbers))
            self.assertEqual(written[0], "x = 100000.0, 7 TRUE")


if __name__ == "__main__":
    unittest.main()
