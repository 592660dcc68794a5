# SPDX-License-Identifier: Apache-2.0
"""`require "remote"`: scripts in Lua over another robomosp, over servers that lie, and TLS of Lua and C."""
import json
import os
import random
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "sdk", "clients", "python"), HERE]
from fake_server import HELLO, FakeServer, handle, make_certificate, short_folder  # noqa: E402
from serving import PROGRAM, Serving  # noqa: E402


def lua(code, *args, seconds=60):
    """What a script prints; its errors are in it."""
    with tempfile.NamedTemporaryFile("w", suffix=".lua", encoding="utf-8") as file:
        file.write('local remote = require "remote"\n' + code)
        file.flush()
        done = subprocess.run([PROGRAM, "run", file.name, *args], capture_output=True, text=True, timeout=seconds)
    return done.stdout + done.stderr


class OverAServer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = short_folder()
        cls.server = Serving("--listen", "unix:" + os.path.join(cls.folder.name, "s"))

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()
        cls.folder.cleanup()

    def run_lua(self, code):
        return lua("local r = remote.connect(arg[1])\n" + code, self.server.address)

    def test_the_students_scenario_feels_local(self):
        out = self.run_lua("""
            local arm = r.robot.get "pa10"
            local found = arm:solve_ik{target = {0.557, 0, 0.374, "180 deg", 0, "180 deg"}}
            print(found.status, #found.q)
            local p = arm:fk{q = found.q}.position
            assert(math.abs(p[1] - 0.557) < 1e-9 and math.abs(p[3] - 0.374) < 1e-9)
            local cell = r.world.create{name = "cell"}
            cell:add_robot{robot = arm}
            cell:set_robot_q{robot = "pa10", q = found.q}
            local q = arm:joint_values()
            for j = 1, 7 do assert(math.abs(q[j] - found.q[j]) < 1e-12) end
            print(arm, arm.kind, arm.name, arm == r.robot "pa10", arm ~= cell)
            print(r.robot.fk("pa10", q).position[1] == arm:fk(q).position[1])
            print(#robot.list())
            """)
        self.assertRegex(out, r"^solved\t7\nrobot:pa10#\d+\trobot\tpa10\ttrue\ttrue\ntrue\n0\n$")

    def test_values_keep_shape_unit_and_bits(self):
        out = self.run_lua("""
            local arm = r.robot.get "twolink"
            local rows = {}
            for i = 1, 2000 do rows[i] = {0.001 * i, 0.1 / i} end
            local p = r.robot.fk("twolink", rows).position
            local want = robot.get("twolink"):fk{q = rows}.position
            assert(#p == 2000 and p[1234][1] == want[1234][1] and p[7][2] == want[7][2])
            print(arm:fk{q = {0, 0}}.position:unit(), arm:gravity_torques{q = {0, 0}}:unit() ~= "")
            local job = r:start("robot.workspace", {id = arm, samples = 2000})
            print(job.kind, job:wait().voxels > 0)
            """)
        self.assertEqual(out, "m\ttrue\njob\ttrue\n")

    def test_errors_have_code_place_and_hint(self):
        out = self.run_lua("""
            local arm = r.robot.get "twolink"
            local ok, e = pcall(function() arm:fk{q = {1}} end)
            print(e.code, e.hint ~= "", e.at:match(":(%d+)$"))
            for _, f in ipairs{function() arm:fkk() end, function() r.robot.fkk() end, function() return r.robott end,
                               function() arm.name = "x" end, function() r.robot.fk(arm, {1, 2}, 3, 4, 5, 6, 7, 8, 9) end,
                               function() robot.fk(arm, {0, 0}) end, function() arm:fk{q = robot.get "twolink"} end} do
              print((tostring(select(2, pcall(f))):gsub("#%d+", "#")))
            end
            local gone = arm:duplicate{name = "gone"}
            gone:remove()
            print(select(2, pcall(gone.dof, gone)).code)
            r:close()
            print(select(2, pcall(arm.dof, arm)))
            """)
        self.assertIn("invalid_argument\ttrue\t5\n", out)
        for sentence in ('has no method "fkk"', 'no command "robot.fkk"', 'no commands "robott"', "cannot be assigned",
                         "more arguments", "is unknown to this program", "of this program is unknown to unix:", "stale_handle", "is closed"):
            self.assertIn(sentence, out)
        self.assertNotIn("remote.lua", out)

    def test_nothing_goes_out_within_a_group_of_edits(self):
        out = self.run_lua("""
            print(select(2, pcall(ioci.transaction, "both", function()
              material.create{name = "here", density = 1}
              r.material.create{name = "there", density = 1}
            end)))
            print(#material.list(), #r.material.list() == #r.material.list())
            print(pcall(r.material.get, "there"))
            """)
        self.assertIn("cannot be part of a group of edits", out)
        self.assertIn("0\ttrue\nfalse", out)

    def test_events_and_signals(self):
        out = self.run_lua("""
            local other = remote.connect{address = arg[1], client = "other"}
            local seen = {}
            local stop = other:on("change", function(event) seen[#seen + 1] = event.label end, {kinds = {"world"}})
            local cell = r.world.create{name = "signals"}
            cell:add_signal{name = "ready"}
            print(other:wait(5, function() return #seen >= 2 end), seen[1], seen[2]:match "^%S+")
            cell:set_signal("ready", 1)
            print(other.server.wait{signal = "ready", timeout = 5})
            print(pcall(other.server.wait, {signal = "ready", value = 0, timeout = 0.1}))
            stop()
            cell:set_signal("ready", 0)
            print(other:wait(0.2), #seen <= 3)
            """)
        self.assertIn("true\tworld.create\tworld.add_signal\n1.0\nfalse", out)
        self.assertIn("did not become 0 within 0.1 s; it is 1", out)
        self.assertTrue(out.endswith("0\ttrue\n"), out)

    def test_time_limits_and_interrupts_cancel_over_there(self):
        out = self.run_lua("""
            local arm = r.robot.get "pa10"
            r.timeout = 0.2
            print(select(2, pcall(function() arm:workspace{samples = 10000000, collisions = true} end)))
            r.timeout = 20
            print(arm:dof())
            """)
        self.assertRegex(out, "did not answer within 0.2 s; the call was cancelled.*\n7\n$")
        with tempfile.NamedTemporaryFile("w", suffix=".lua") as file:
            file.write("""local r = require("remote").connect(arg[1])
                local arm = r.robot.get "pa10"
                print("begins")
                arm:workspace{samples = 10000000, collisions = true}""")
            file.flush()
            process = subprocess.Popen([PROGRAM, "run", file.name, self.server.address], stdout=subprocess.PIPE,
                                       stderr=subprocess.STDOUT, text=True)
            self.assertEqual(process.stdout.readline(), "begins\n")
            time.sleep(0.3)
            began = time.monotonic()
            process.send_signal(2)
            said = process.communicate(timeout=30)[0]
            self.assertLess(time.monotonic() - began, 10)
            self.assertIn("interrupted", said)
        self.assertEqual(self.run_lua('print(r.robot.dof "pa10")'), "7\n")

    def test_scripts_over_there(self):
        out = self.run_lua('print(r:eval "print(6) return 1, {2, 3}")')
        self.assertEqual(out, "6\n1\t{2, 3}\n")
        self.assertEqual(self.run_lua('print(r:classic "PRobot twolink GetDOF")'), "2\n")

    def test_no_stranger_reaches_the_network(self):
        # Neither a client of the server, nor its scripts, nor a script in the sandbox may connect.
        out = self.run_lua("""
            print(pcall(r.connection.open, {address = arg[1]}))
            print(pcall(r.eval, r, "connection.open{address = '" .. arg[1] .. "'}"))
            print(pcall(r.eval, r, "require 'remote'"))
            """)
        self.assertEqual(out.count("false"), 3)
        self.assertEqual(out.count("permission"), 0)
        self.assertGreaterEqual(out.count("may not"), 2)
        with tempfile.NamedTemporaryFile("w", suffix=".lua") as file:
            file.write("print(pcall(connection.open, {address = '%s'}))" % self.server.address)
            file.flush()
            done = subprocess.run([PROGRAM, "run", "--sandbox", file.name], capture_output=True, text=True, timeout=60)
        self.assertIn("may not", done.stdout + done.stderr)


class Fakes(unittest.TestCase):
    """Servers that are none, lie, or go away: one sentence each."""

    def told(self, address, code="", seconds=60, options=""):
        out = lua("local ok, e = pcall(remote.connect, {address = arg[1]" + options + "})\n"
                  "if not ok then print(e) return end\nlocal r = e\n" + code, address, seconds=seconds)
        self.assertNotIn("remote.lua", out)
        return out

    def test_no_server_and_no_robomosp(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.assertIn("cannot be reached: Connection refused",
                          self.told("127.0.0.1:%d" % free.getsockname()[1]))
        self.assertIn("No such file", self.told("unix:/nowhere/at/all"))
        self.assertIn("is not an address", self.told("a:b:c"))
        for raw, sentence in ((b"HTTP/1.1 400 Bad Request\r\n\r\n", 'is not a ROBOMOSP server: it answered "HTTP/1.1 400'),
                              (b"220 mail\r\n", "220 mail"), (b"", "closed the connection without an answer"),
                              (b"[" * 100_000 + b"\n", "is not a ROBOMOSP server"), (b"null\n", "is not a ROBOMOSP server"),
                              (b'{"id":1,"result":{}}\n', "does not identify it as one"),
                              (b'{"id":1,"result":{"$array":{"shape":[9999999999],"base64":""}}}\n', "is not a ROBOMOSP"),
                              (b'{"id":1,"error":{"code":-32601,"message":"Method not found"}}\n', "Method not found")):
            with FakeServer(raw=raw) as server:
                out = self.told(server.address)
                self.assertIn(sentence, out)
                self.assertEqual(out.count("\n"), 1)
        with FakeServer(silent=True) as server:
            self.assertIn("did not answer within 0.3 s", self.told(server.address, options=", timeout = 0.3"))
        with FakeServer(hello={**HELLO, "protocol": 2}) as server:
            self.assertIn("speaks version 2 of the protocol, and this program version 1", self.told(server.address))

    def test_tokens(self):
        with FakeServer(token="rmp_right") as server:
            for options in ("", ', token = "rmp_wrong"'):
                self.assertIn("the token is not known. Ask for one.", self.told(server.address, options=options))
            self.assertEqual(self.told(server.address, "print(r:call('echo', {x = 1}).x)", options=', token = "rmp_right"'),
                             "1\n")

    def test_what_breaks_in_the_middle(self):
        with FakeServer() as server:
            def cut(message, say):
                say(b'{"jsonrpc":"2.0","id":%d,"resu' % message["id"])
                server.drop()
                return NotImplemented

            def closing(message, say):
                say({"jsonrpc": "2.0", "method": "server.closing", "params": {"reason": "It stops for the night."}})
                server.drop()
                return NotImplemented

            def endless(message, say):
                for _ in range(200):
                    say(b"x" * 100_000)
                return NotImplemented

            server.methods.update({"cut": cut, "closing": closing, "endless": endless, "odd": lambda m, say: {"$handle": 7}})
            out = self.told(server.address, """
                print(pcall(r.call, r, "cut")) print(pcall(r.call, r, "echo"))
                r:reconnect() print(r:call("echo", {x = {1, 2}}).x[2])
                print(pcall(r.call, r, "closing")) r:reconnect()
                print(pcall(r.call, r, "endless")) r:reconnect()
                print(pcall(r.call, r, "odd")) print(r:call("echo", {x = 5}).x)""", options=", longest_answer = 1000000")
            for sentence in ("during a reply", "2\n", "It stops for the night",
                             "longer than 1000000 bytes", "5\n"):
                self.assertIn(sentence, out)

    def test_handles_outlive_a_reconnect_to_the_same_program_only(self):
        with FakeServer() as server:
            server.methods["robot.get"] = lambda m, say: handle("robot", 5, "pa10")

            def restart(message, say):
                server.hello = {**HELLO, "instance": "two"}
                return True

            server.methods["restart"] = restart
            out = self.told(server.address, """
                local arm = r:call("robot.get")
                r:reconnect() print(r:call("echo", {a = arm}).a == arm)
                r:call("restart") r:reconnect() print(pcall(r.call, r, "echo", {a = arm}))
                print(r:call("robot.get") == arm)""")
            self.assertRegex(out, "^true\nfalse\t.*has ended.*\nfalse\n$")


class Mutations(unittest.TestCase):
    def test_answers_that_were_changed_are_one_sentence_each(self):
        moments = random.Random(int(os.environ.get("ROBOMOSP_FUZZ_SEED", "5")))
        rounds = int(os.environ.get("ROBOMOSP_FUZZ_ROUNDS", "300"))
        seeds = [json.dumps({"jsonrpc": "2.0", "id": 1, "result": HELLO}).encode() + b"\n",
                 b'{"jsonrpc":"2.0","id":1,"error":{"code":-32000,"message":"no","data":{"code":"io","where":"w"}}}\n',
                 b'{"method":"event","params":{"subscription":1}}\n{"method":"server.closing","params":{"reason":"x"}}\n',
                 b'{"id":1,"result":{"$array":{"shape":[2,1],"base64":"AAAAAAAA8D8AAAAAAAAAQA=="}}}\n']
        with FakeServer(raw=b"") as server:
            def changed():
                text = bytearray(moments.choice(seeds))
                for _ in range(moments.randrange(1, 6)):
                    at = moments.randrange(len(text))
                    text[at:at + moments.randrange(3)] = bytes(moments.choices(b'{}[]",:\\\x00\xff\n019e$u', k=moments.randrange(4)))
                    text = text or bytearray(b"{")
                return bytes(text)

            class Changing(type(server)):
                raw = property(lambda self: changed(), lambda self, value: None)
            server.__class__ = Changing
            out = lua("""for i = 1, tonumber(arg[2]) do
                local ok, e = pcall(remote.connect, {address = arg[1], timeout = 5})
                assert(not ok or e, "?")
                assert(ok or (e.code and #e.message > 0 and not e.message:find "\\n" and e.code ~= "internal"), tostring(e))
                if ok then e:close() end
              end
              print("all")""", server.address, str(rounds))
        self.assertEqual(out, "all\n")


class Tls(unittest.TestCase):
    def setUp(self):
        self.folder, self.other = short_folder(), short_folder()
        self.addCleanup(self.folder.cleanup)
        self.addCleanup(self.other.cleanup)
        self.files, self.others = make_certificate(self.folder.name), make_certificate(self.other.name)
        if self.files is None:
            self.skipTest("there is no program openssl")
        os.chmod(self.files[1], 0o600)
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(*self.files)
        self.context = context

    def test_lua(self):
        with FakeServer(context=self.context) as server:
            big = 'print(#r:call("echo", {x = ("x"):rep(3000000)}).x)'
            connect = "local ok, r = pcall(remote.connect, {address = arg[1], %s})\nif not ok then print(r) return end\n"
            self.assertEqual(lua(connect % f'certificate = "{self.files[0]}"' + big, server.address), "3000000\n")
            self.assertIn("is not trusted", lua(connect % f'certificate = "{self.others[0]}"', server.address))
            self.assertIn("is not trusted", lua(connect % "tls = true", server.address))
        with FakeServer(raw=b"hello\n") as server:
            self.assertIn("does not speak TLS", lua(connect % "tls = true", server.address))
        self.assertIn("cannot be read", lua(connect % 'certificate = "/no/such/file"', server.address))

    @unittest.skipUnless("ROBOMOSP_C_TLS_CLIENT_TEST" in os.environ, "the client in C with TLS is not named")
    def test_c(self):
        def c(*args, program="ROBOMOSP_C_TLS_CLIENT_TEST"):
            return subprocess.run([os.environ[program], "connect", *args], capture_output=True, text=True, timeout=100)

        with Tunnel(self.context) as server:  # a real server behind TLS
            done = c(server.address, "", self.files[0])
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("is not trusted", c(server.address, "", self.others[0]).stderr)
            self.assertIn("is not trusted", c(server.address, "", "").stderr)
            self.assertIn("without an answer", c(server.address, program="ROBOMOSP_C_CLIENT_TEST").stderr)
        with FakeServer(raw=b"hello\n") as server:
            self.assertIn("does not speak TLS", c(server.address, "", self.files[0]).stderr)
        self.assertIn("cannot be reached", c("127.0.0.1:1", "", "/no/such/file").stderr)


class Tunnel:
    """TLS in front of `robomosp serve`, byte by byte as they come."""

    def __init__(self, context):
        self.folder = short_folder()
        self.serving = Serving("--listen", "unix:" + os.path.join(self.folder.name, "s"))
        self.context = context
        self.socket = socket.socket()
        self.socket.bind(("127.0.0.1", 0))
        self.socket.listen()
        self.address = "127.0.0.1:%d" % self.socket.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, raw):
        try:
            near = self.context.wrap_socket(raw, server_side=True)
        except OSError:
            raw.close()
            return
        far = socket.socket(socket.AF_UNIX)
        far.connect(self.serving.address[5:])
        near.setblocking(False)
        far.setblocking(False)
        waiting = {near: b"", far: b""}  # to be sent there
        import select
        try:
            while True:
                select.select([near, far], [s for s in waiting if waiting[s]], [], 0.5)
                for here, there in ((near, far), (far, near)):
                    while True:
                        try:
                            piece = here.recv(1 << 16)
                        except (ssl.SSLWantReadError, BlockingIOError):
                            break
                        if not piece:
                            return
                        waiting[there] += piece
                for to in waiting:
                    try:
                        while waiting[to]:
                            waiting[to] = waiting[to][to.send(waiting[to]):]
                    except (ssl.SSLWantWriteError, ssl.SSLWantReadError, BlockingIOError):
                        pass
        except OSError:
            pass
        finally:
            near.close()
            far.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.serving.__exit__()
        self.folder.cleanup()


if __name__ == "__main__":
    unittest.main()
