# SPDX-License-Identifier: Apache-2.0
"""The pages docs/user/remote/student.md and cooperation.md: each block of Python, C and Lua is run against a server as
the page starts it, and says what the page shows. A block whose first line is "# elsewhere" is left out."""
import os
import re
import shutil
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
CLIENTS = os.path.join(ROOT, "sdk", "clients")
sys.path.insert(0, HERE)
from fake_server import short_folder  # noqa: E402
from serving import PROGRAM, Serving  # noqa: E402


def blocks(page):
    """(language, text) of each block."""
    with open(os.path.join(ROOT, "docs", "user", "remote", page), encoding="utf-8") as file:
        return re.findall(r"^```(\w*)\n(.*?)^```$", file.read(), re.S | re.M)


def run(command, folder, **environment):
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=60,
                          env={**os.environ, "PYTHONPATH": os.path.join(CLIENTS, "python"), **environment})
    return done.stdout + done.stderr


class Tutorial(unittest.TestCase):
    def follow(self, page):
        with short_folder() as folder, Serving("--listen", "127.0.0.1:0") as server:
            answer, count = None, 0
            for language, text in blocks(page):
                text = text.replace("127.0.0.1:7007", server.address)
                if language == "text" and answer is not None:
                    self.assertEqual(answer.strip(), text.strip())
                answer = None
                if text.startswith(("# elsewhere", "-- not run")):
                    continue
                name = os.path.join(folder, {"python": "block.py", "c": "pose.c", "lua": "block.lua"}.get(language, "none"))
                with open(name, "w", encoding="utf-8") as file:
                    file.write(text)
                if language == "python":
                    answer = run([sys.executable, "-B", name], folder)
                elif language == "lua":
                    answer = run([PROGRAM, "run", name], folder)
                elif language == "c":
                    compiler = shutil.which("cc")
                    if not compiler:
                        continue
                    c = os.path.join(CLIENTS, "c")
                    said = run([compiler, "-std=c99", "-I" + c, name, os.path.join(c, "robomosp_client.c"), "-o",
                                os.path.join(folder, "pose")], folder)
                    self.assertEqual(said, "")
                    answer = run([os.path.join(folder, "pose")], folder)
                count += answer is not None
            return count

    def test_the_student(self):
        self.assertEqual(self.follow("student.md"), 3)

    def test_cooperation(self):
        self.assertEqual(self.follow("cooperation.md"), 1)

    def test_the_two_programs(self):
        wanted = next(text for language, text in blocks("cooperation.md") if language == "text")
        with short_folder() as folder:
            scene = os.path.join(CLIENTS, "cooperation")
            with Serving("--listen", "unix:" + os.path.join(folder, "s"), os.path.join(scene, "cell.lua")) as server:
                environment = {**os.environ, "PYTHONPATH": os.path.join(CLIENTS, "python")}
                both = [subprocess.Popen([sys.executable, "-B", os.path.join(scene, name), server.address], env=environment,
                                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                        for name in ("right.py", "left.py")]
                said = "".join(p.communicate(timeout=60)[0] for p in both)
        self.assertEqual(sorted(said.splitlines()), sorted(wanted.splitlines()))

    @unittest.skipUnless(shutil.which("systemd-analyze"), "there is no program systemd-analyze")
    def test_the_unit_of_systemd(self):
        with open(os.path.join(ROOT, "scripts", "robomosp.service"), encoding="utf-8") as file:
            text = file.read()
        with short_folder() as folder:
            name = os.path.join(folder, "robomosp.service")
            with open(name, "w", encoding="utf-8") as file:
                file.write(text.replace("/usr/local/bin/robomosp", shutil.which("true")))
            done = subprocess.run(["systemd-analyze", "verify", name], capture_output=True, text=True, timeout=60)
        # It looks at other units of the machine, too.
        self.assertNotIn("robomosp.service", done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
