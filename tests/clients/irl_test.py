# SPDX-License-Identifier: Apache-2.0
"""`robomosp irl`: programs of robots alone, with a robot, and in a world that another program serves."""
import csv
import json
import os
import signal
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
sys.path[:0] = [os.path.join(ROOT, "sdk", "clients", "python"), HERE]
import robomosp  # noqa: E402
from fake_server import HELLO, FakeServer, make_certificate, short_folder  # noqa: E402
from serving import PROGRAM, Serving  # noqa: E402

HANOI = os.path.join(ROOT, "scripts", "programs", "hanoi.irl")
# As scripts/programs/hanoi.lua, without the program.
CELL = """
local thick, pegs = 0.03, {-0.25, 0, 0.25}
local arm = robot.get("puma560")
arm:add_tool{name = "rod", link = 6, position = {0, 0, 0.12}}
local cell = world.create{name = "bench"}
cell:add_robot{robot = arm, name = "puma560"}
cell:add_frame{name = "table", position = {0, 0, 0}}
for i = 1, 3 do
  solid.create{name = "disc" .. i, root = {kind = "cylinder", radius = 0.1 - 0.02 * i, height = thick}}
  cell:add_object{what = "disc" .. i, name = "disc" .. i, position = {0.6, pegs[1], thick * (i - 1)}}
end
"""
HERE_RUN = """
local towers = program.import{file = arg[1], name = "hanoi"}
local cell = world.get("bench")
cell:add_program{program = towers}
towers:bind{kind = "robot", frame = "table", tool = "rod"}
cell:run_task{}:save(arg[2])
"""
WAITS = """PROGRAM waits;
SIGNAL
  INPUT BOOL: free AT 1;
  OUTPUT BOOL: done AT 2;
BEGIN
  WRITELN('ready');
  WAIT FOR free;
  done := TRUE;
ENDPROGRAM;
"""
SIGNALS = 'local cell = world.create{name = "cell"}\ncell:add_signal{name = "free"}\ncell:add_signal{name = "done"}\n'
FOREVER = "PROGRAM forever;\nBEGIN\n  LOOP WAIT 0.1 SEC; ENDLOOP;\nENDPROGRAM;\n"


def irl(*words, text=None, seconds=120, **more):
    return subprocess.run([PROGRAM, "irl", *words], capture_output=True, text=True, timeout=seconds, input=text or "",
                          **more)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = short_folder()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def read(self, path):
        with open(path, encoding="utf-8") as file:
            return list(csv.reader(file))

    def fails(self, done, code, *words):
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)


class Alone(Folder):
    def test_says_asks_and_sets(self):
        path = self.write("twice.irl", "PROGRAM twice;\nVAR\n  INT: i, n := 2;\nBEGIN\n  READ(i);\n  WRITELN(i * n);\n"
                                       "  IF n > 5 THEN HALT; ENDIF;\nENDPROGRAM;\n")
        done = irl(path, text="21\n")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "42\n", ""))
        self.assertEqual(irl(path, "--set", "n=3", text="21\n").stdout, "63\n")
        done = irl(path, "--set", "N=3 + 3", text="1\n")
        self.assertEqual((done.returncode, done.stdout), (5, "6\n"))
        self.fails(irl(path), 1, "twice.irl:5:", "standard input has ended")
        self.assertIn("m = 3", irl(path, "--set", "m=3", text="1\n").stderr)
        self.fails(irl(path, "--set", "n"), 2, "--set NAME=VALUE")
        done = irl("--json", path, text="4\n")
        self.assertEqual(json.loads(done.stdout)["value"]["text"], "8\n")

    def test_inputs_and_trace(self):
        path = self.write("waits.irl", WAITS)
        self.fails(irl(path), 1, "waits.irl:7:", "the input free has no value", "--set free=VALUE")
        self.fails(irl(path, "--set", "free=FALSE"), 1, "waits.irl:7:", "never comes true")
        done = irl(path, "--set", "free=TRUE", "--trace")
        self.assertEqual((done.returncode, done.stdout), (0, "ready\n"))
        self.assertIn("waits.irl:8: done := TRUE", done.stderr)
        self.fails(irl(path, "--set", "free=maybe"), 2, "TRUE, FALSE or a number")

    def test_values_that_inputs_cannot_have(self):
        path = self.write("waits.irl", WAITS)
        self.fails(irl(path, "--set", "free=0.5"), 3, "the input free cannot be 0.5", "TRUE (1) or FALSE (0)")
        self.fails(irl(path, "--set", "free=1e300"), 3, "free")
        self.fails(irl(path, "--set", "free=0.5", "--robot", "puma560"), 1, "the input free cannot be 0.5")
        path = self.write("bits.irl", "PROGRAM bits;\nSIGNAL INPUT INT: l AT 1, 4;\nBEGIN\n  WRITELN(l);\nENDPROGRAM;\n")
        self.assertEqual(irl(path, "--set", "l=15").stdout, "15\n")
        self.fails(irl(path, "--set", "l=99"), 3, "the input l cannot be 99", "4 bits hold 0 to 15")

    def test_a_loop_without_an_end(self):
        path = self.write("loop.irl", "PROGRAM looping;\nBEGIN\n  LOOP ENDLOOP;\nENDPROGRAM;\n")
        self.fails(irl(path, "--most-instructions", "1000000"), 1, "loop.irl:3:", "more than 1000000 instructions")
        self.fails(irl(path, "--most-instructions", "-1"), 2, "--most-instructions")

    def test_posts_need_a_target(self):
        path = self.write("waits.irl", WAITS)
        for words in ([path], ["test"], [path, "--side-by-side", os.path.join(self.folder, "page.txt")]):
            done = subprocess.run([PROGRAM, "post", *words], capture_output=True, text=True, timeout=120)
            self.fails(done, 2, "needs a target", "Targets are ", "krl", "rapid")

    def test_files_of_its_folder_only(self):
        path = self.write("keeps.irl", "PROGRAM keeps;\nVAR\n  FILE: f;\n  STRING: s;\nBEGIN\n  OPEN(f, 'out.txt', 'W');\n"
                                       "  WRITELN(f, 'kept');\n  CLOSE(f);\nENDPROGRAM;\n")
        done = irl(path)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with open(os.path.join(self.folder, "out.txt"), encoding="utf-8") as file:
            self.assertEqual(file.read(), "kept\n")
        path = self.write("leaves.irl", "PROGRAM leaves;\nVAR\n  FILE: f;\nBEGIN\n  OPEN(f, '../out.txt', 'W');\n"
                                        "  WRITELN(f, 'x');\n  CLOSE(f);\nENDPROGRAM;\n")
        self.fails(irl(path), 1, "leaves.irl:", "next to the program")

    def test_wrong_input(self):
        self.fails(irl(os.path.join(self.folder, "none.irl")), 3, "there is no file")
        self.assertNotEqual(irl(self.folder).returncode, 0)
        self.fails(irl(self.write("empty.irl", "")), 1, "empty.irl:1:1: error:")
        with open(os.path.join(self.folder, "noise.irl"), "wb") as file:
            file.write(os.urandom(50_000))
        self.fails(irl(os.path.join(self.folder, "noise.irl")), 3, "noise.irl:", "zero byte")
        deep = self.write("deep.irl", "PROGRAM deep;\nPROCEDURE f();\nBEGIN\n  f();\nENDPROC;\nBEGIN\n  f();\nENDPROGRAM;\n")
        self.fails(irl(deep), 1, "deep.irl:4:", "calls are nested")
        self.assertEqual(irl(deep, "--check").returncode, 0)
        self.assertIn("ROUTINE", irl(deep, "--code").stdout)
        for words, said in ((("--tool", "x"), "--robot"), (("--world", "x"), "--connect"),
                            (("--check", "--code"), "Leave one"), (("--fast", "--real-time"), "Leave one")):
            self.fails(irl(deep, *words), 2, said)

    def test_an_endless_loop_ends_by_ctrl_c(self):
        path = self.write("loop.irl", "PROGRAM looping;\nBEGIN\n  WRITELN('begun');\n  LOOP ENDLOOP;\nENDPROGRAM;\n")
        process = subprocess.Popen([PROGRAM, "irl", path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(process.stdout.readline(), "begun\n")
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 130)
        self.assertIn("interrupted", said)

    def test_with_a_robot(self):
        path = self.write("go.irl", "PROGRAM go;\nBEGIN\n  MOVE PTP MAIN_JOINT(10.0, 20.0, 30.0, 0.0, 0.0, 0.0);\n"
                                    "  WRITELN('there');\nENDPROGRAM;\n")
        kept = os.path.join(self.folder, "go.csv")
        done = irl(path, "--robot", "puma560", "-o", kept)
        self.assertEqual((done.returncode, done.stdout), (0, "there\n"), done.stderr)
        rows = self.read(kept)
        self.assertAlmostEqual(float(rows[-1][rows[0].index(next(n for n in rows[0] if n.startswith("puma560.q2")))]),
                               0.349065850, places=8)
        self.fails(irl(path, "--robot", "nobody"), 3, "nobody")


class Connected(Folder):
    def serve(self, script, *options):
        server = Serving("--listen", "127.0.0.1:0", *options, self.write("scene.lua", script))
        self.addCleanup(server.__exit__)
        return server

    def test_hanoi_goes_as_within_the_world(self):
        here, there = (os.path.join(self.folder, name) for name in ("here.csv", "there.csv"))
        script = self.write("here.lua", CELL + HERE_RUN)
        done = subprocess.run([PROGRAM, "run", script, HANOI, here], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        server = self.serve(CELL)
        done = irl(HANOI, "--connect", server.address, "--fast", "--robot", "puma560", "--frame", "table", "--tool",
                   "rod", "-o", there)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("done: 7 discs carried", done.stdout)
        a, b = self.read(here), self.read(there)
        self.assertEqual(a[0], b[0])
        self.assertEqual(len(a), len(b))
        for one, other in zip(a[1:], b[1:]):
            for x, y in zip(one, other):
                self.assertAlmostEqual(float(x), float(y), delta=1e-9)
        with robomosp.connect(server.address) as r:
            cell = r.world.get("bench")
            self.assertEqual(cell.attachments(), [])
            for disc in cell.objects():
                i = int(disc["name"][-1])
                position = [float(x) for x in disc["placement"]["position"]]
                for x, wanted in zip(position, (0.6, 0.25, 0.03 * (i - 1))):
                    self.assertAlmostEqual(x, wanted, delta=1e-5)
            q = [float(x) for x in cell.robots()[0]["q"]]
            last = dict(zip(a[0], a[-1]))
            for j, x in enumerate(q):
                column = next(n for n in a[0] if n.split(" ")[0] == f"puma560.q{j + 1}")
                self.assertAlmostEqual(x, float(last[column]), delta=1e-12)

    def test_signals_of_others_count(self):
        server = self.serve(SIGNALS)
        path = self.write("waits.irl", WAITS)
        process = subprocess.Popen([PROGRAM, "irl", path, "--connect", server.address], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.assertEqual(process.stdout.readline(), "ready\n")
        with robomosp.connect(server.address) as r:
            r.world.set_signal(id="cell", signal="free", value=1)
            r.server.wait(signal="done", world="cell", timeout=20)
        _, said = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 0, said)

    def test_a_lost_connection_is_said(self):
        server = Serving("--listen", "127.0.0.1:0", self.write("scene.lua", SIGNALS))
        path = self.write("forever.irl", FOREVER)
        process = subprocess.Popen([PROGRAM, "irl", path, "--connect", server.address], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(1.5)
        server.__exit__()
        _, said = process.communicate(timeout=30)
        self.assertEqual(process.returncode, 1)
        self.assertRegex(said, r'forever\.irl:3:.*at t = [0-9.]+ s.*closed the connection')

    def test_where_nobody_is_or_another_age(self):
        path = self.write("forever.irl", FOREVER)
        self.fails(irl(path, "--connect", "127.0.0.1:1"), 1, "127.0.0.1:1 cannot be reached")
        with FakeServer(hello={**HELLO, "version": "0.0.9"}) as old:
            self.fails(irl(path, "--connect", old.address), 3, "0.0.9", "the same version")
        server = self.serve("")
        self.fails(irl(path, "--connect", server.address), 3, "no world")
        server = self.serve(SIGNALS + 'world.create{name = "other"}\n')
        self.fails(irl(path, "--connect", server.address), 3, "cell and other")
        self.fails(irl(path, "--connect", server.address, "--world", "third"), 3, '"third"')

    def test_tokens_and_tls(self):
        made = make_certificate(self.folder, "localhost")
        if not made:
            self.skipTest("there is no openssl")
        certificate, key = made
        tokens = os.path.join(self.folder, "tokens")
        granted = subprocess.run(
            [PROGRAM, "eval", f'return server.grant{{name = "runner", effects = {{"reads", "edits"}}, '
                              f'token_file = "{tokens}"}}'],
            capture_output=True, text=True, timeout=60)
        token = self.write("token", granted.stdout)
        os.chmod(token, 0o600)
        server = self.serve(SIGNALS, "--certificate", certificate, "--key", key, "--tls-everywhere", "--needs-token",
                            "--token-file", tokens)
        address = server.address.replace("127.0.0.1", "localhost")
        path = self.write("nop.irl", "PROGRAM nop;\nBEGIN\n  WRITELN('ran');\nENDPROGRAM;\n")
        done = irl(path, "--connect", address, "--certificate", certificate, "--token-file", token)
        self.assertEqual((done.returncode, done.stdout), (0, "ran\n"), done.stderr)
        self.fails(irl(path, "--connect", address, "--certificate", certificate), 3, "--token-file")
        self.assertNotEqual(irl(path, "--connect", address, "--token-file", token, "--no-tls").returncode, 0)
        os.chmod(token, 0o644)
        self.fails(irl(path, "--connect", address, "--token-file", token), 1, "can be read by others")


if __name__ == "__main__":
    unittest.main()
