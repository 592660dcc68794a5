# SPDX-License-Identifier: Apache-2.0
"""`robomosp connect`: the console of a program that serves, by pipes and on a terminal."""
import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "sdk", "clients", "python"), HERE]
from fake_server import FakeServer, make_certificate, short_folder  # noqa: E402
from serving import PROGRAM, Serving  # noqa: E402


def connect(address, lines, *options, first=(), code=0):
    """What `robomosp connect` says to lines from a pipe."""
    done = subprocess.run([PROGRAM, *first, "connect", address, *options], input=lines, capture_output=True, text=True,
                          timeout=60)
    if code is not None and done.returncode != code:
        raise AssertionError(f"exit code {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout, done.stderr


class Terminal:
    """`robomosp connect` on a terminal."""

    def __init__(self, *args):
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            os.environ["TERM"] = "xterm"
            os.execv(PROGRAM, [PROGRAM, *args])
        self.said = ""

    def until(self, words, seconds=20):
        end = time.monotonic() + seconds
        while words not in self.said:
            if time.monotonic() > end or not select.select([self.fd], [], [], max(0, end - time.monotonic()))[0]:
                raise AssertionError(f"{words!r} did not come: {self.said!r}")
            try:
                self.said += os.read(self.fd, 65536).decode(errors="replace")
            except OSError:
                raise AssertionError(f"it ended: {self.said!r}") from None
        before, self.said = self.said.split(words, 1)
        return before

    def type(self, text):
        os.write(self.fd, text.encode())

    def end(self):
        """Its exit code, when it has left."""
        while True:
            try:
                if not os.read(self.fd, 65536):
                    break
            except OSError:
                break
        status = os.waitpid(self.pid, 0)[1]
        os.close(self.fd)
        return os.waitstatus_to_exitcode(status)


class Console(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = short_folder()
        cls.server = Serving("--listen", "unix:" + os.path.join(cls.folder.name, "s"))

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()
        cls.folder.cleanup()

    def test_the_students_scenario_as_at_the_programs_own_console(self):
        out, err = connect(self.server.address, """
            arm = robot.get("pa10")
            found = arm:solve_ik{target = {0.557, 0, 0.374, "180 deg", 0, "180 deg"}}
            found.status
            cell = world.create{name = "cell"}
            cell:add_robot{robot = arm}
            cell:set_robot_q{robot = "pa10",
                             q = found.q}
            #arm:joint_values()
            world.list()[1]
            start("material.list"):wait()
            print(arm.name)
            """)
        self.assertEqual(err, "")
        self.assertIn("solved\n", out)
        self.assertIn("world:cell#", out)
        self.assertTrue(out.endswith("pa10\n"), out)
        # It is in the world of the server, for everybody.
        self.assertIn("cell", connect(self.server.address, "world.list()[1].name\n")[0])

    def test_errors_are_sentences_and_end_a_pipe(self):
        out, err = connect(self.server.address, 'robot.get("pa11")\nprint("not this")\n', code=3)
        self.assertEqual(out, "")
        self.assertRegex(err, r"^error: .*pa11.*\n$")
        self.assertIn("solve_ik", connect(self.server.address, 'robot.solve_ikk("x")\n', code=None)[1])
        _, err = connect(self.server.address, "ioci.transaction('a', function() end)\n", code=None)
        self.assertIn("cannot be made over a connection", err)
        _, err = connect(self.server.address, "plugin.list()\nplugin.load('x')\n", code=None)
        self.assertIn("may not", err)

    def test_notes_of_its_own_commands_are_shown_as_at_the_programs_own_console(self):
        lines = """
            puma = robot.get("puma560")
            #puma:fk{q={0,90,0,0,0,0}}.position
            #puma:fk{q={0,90,0,0,0,0}}.position
            #puma:fk{q={0,0,200,0,0,0}}.position
            """

        def notes(err):
            return [line for line in err.splitlines() if line.startswith("note: ") and "Not saved" not in line]

        local = subprocess.run([PROGRAM], input=lines, capture_output=True, text=True, timeout=60)
        _, err = connect(self.server.address, lines)
        self.assertEqual(notes(err), notes(local.stderr))
        self.assertEqual(len(notes(err)), 2, err)  # once each
        self.assertIn("90 is taken as 90 rad", err)
        # Of others' commands, with --quiet and for programs there are none.
        _, err = connect(self.server.address, "1\n")
        self.assertEqual(err, "")
        for option in ("-q", "--json"):
            _, err = connect(self.server.address, lines, first=[option])
            self.assertEqual(notes(err), [], option)

    def test_json_for_programs(self):
        out, _ = connect(self.server.address, "1 + 1\nrobot.get('pa10')\nprint('x')\n", first=["--json"])
        first, second, third = map(json.loads, out.splitlines())
        self.assertEqual(first, {"ok": True, "value": 2})
        self.assertEqual(second["value"]["$handle"]["name"], "pa10")
        self.assertEqual(third, {"ok": True})
        out, _ = connect(self.server.address, "robot.get('pa11')\n", first=["--json"], code=3)
        self.assertEqual(json.loads(out)["ok"], False)

    def test_who_is_no_server_is_told_in_a_sentence(self):
        for address, words in (("unix:/no/such/socket", "/no/such/socket"), ("127.0.0.1:1", "127.0.0.1:1"),
                               ("nonsense", "nonsense")):
            _, err = connect(address, "1\n", code=None)
            self.assertRegex(err, r"^error: .*\n$")
            self.assertIn(words, err)
        with FakeServer(raw=b"HTTP/1.1 400 Bad Request\r\n\r\n") as fake:
            _, err = connect(fake.address, "1\n", code=None)
            self.assertRegex(err, r"^error: .*\n$")

    def test_tokens(self):
        tokens = os.path.join(self.folder.name, "tokens")
        socket = os.path.join(self.folder.name, "t")
        secret = subprocess.run(
            [PROGRAM, "eval", f'return server.grant{{name = "reader", effects = {{"reads"}}, token_file = "{tokens}"}}'],
            check=True, capture_output=True, text=True).stdout.strip()
        file = os.path.join(self.folder.name, "token")
        with open(file, "w") as out:
            out.write(secret + "\n")
        with Serving("--listen", "unix:" + socket, "--needs-token", "--token-file", tokens) as server:
            _, err = connect(server.address, "1\n", code=3)
            self.assertIn("requires a token", err)
            self.assertIn("--token-file", err)
            os.chmod(file, 0o644)
            _, err = connect(server.address, "1\n", "--token-file", file, code=1)
            self.assertIn("can be read by others", err)
            os.chmod(file, 0o600)
            self.assertEqual(connect(server.address, "#material.list()\n", "--token-file", file)[0], "0\n")
            _, err = connect(server.address, "material.create{name = 'x', density = 1}\n", "--token-file", file, code=3)
            self.assertIn("may not", err)
            with open(file, "w") as out:
                out.write("rmp_wrong\n")
            _, err = connect(server.address, "1\n", "--token-file", file, code=3)
            self.assertRegex(err, r"^error: .*\n$")
        _, err = connect(self.server.address, "1\n", "--token-file", "/no/such/file", code=1)
        self.assertIn("/no/such/file", err)

    def test_tls(self):
        with short_folder() as folder, short_folder() as other:
            files, others = make_certificate(folder), make_certificate(other)
            with Serving("--listen", "127.0.0.1:0", "--certificate", files[0], "--key", files[1],
                         "--tls-everywhere") as server:
                self.assertEqual(connect(server.address, "1 + 1\n", "--certificate", files[0])[0], "2\n")
                _, err = connect(server.address, "1\n", "--certificate", others[0], code=None)
                self.assertIn("is not trusted", err)
                _, err = connect(server.address, "1\n", "--tls", code=None)
                self.assertIn("is not trusted", err)
        _, err = connect(self.server.address, "1\n", "--tls", "--no-tls", code=2)
        self.assertRegex(err, r"^error: .*\n$")

    def test_a_terminal_that_outlives_the_server(self):
        socket = os.path.join(self.folder.name, "u")
        # Not `with`: it is killed within.
        server = Serving("--listen", "unix:" + socket)
        t = Terminal("connect", server.address)
        try:
            t.until("the server keeps running.")
            t.until("> ")
            t.type("x = 41\r")
            t.until("> ")
            t.type("arm = robot.get('pa10')\r")
            t.until("> ")
            t.type("#arm:dh_t\t()\r")
            t.until("able()")
            t.until("> ")
            t.type("robot.fk{id = 'pa\t")
            t.until("10'")
            t.type("\x03")
            t.until("> ")
            t.type("while true do end\r")
            time.sleep(0.5)
            os.write(t.fd, b"\x03")
            t.until("error:")
            t.until("> ")
            # Numbers, so that what is typed is not taken for what is answered.
            server.process.send_signal(signal.SIGKILL)
            server.process.wait()
            os.unlink(socket)
            t.type("material.list()\r")
            t.until("error:", 30)
            t.until("> ")
            server.__exit__()
            server = Serving("--listen", "unix:" + socket)
            t.type("#material.list() + x * 100\r")
            t.until("Another program answers there now", 30)
            t.until("4100")
            t.type("quit\r")
            self.assertEqual(t.end(), 0)
            self.assertIsNone(server.process.poll())
        finally:
            server.__exit__()


if __name__ == "__main__":
    unittest.main()
