# SPDX-License-Identifier: Apache-2.0
"""The Python client: against `robomosp rpc`, `robomosp serve` where it is there, and servers that lie."""
import array
import asyncio
import contextlib
import io
import math
import os
import pydoc
import signal
import ssl
import subprocess
import sys
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "sdk", "clients", "python"), HERE]
import robomosp  # noqa: E402
from fake_server import HELLO, FakeServer, Refusal, handle, make_certificate, packed, short_folder  # noqa: E402

PROGRAM = os.environ.get("ROBOMOSP_PROGRAM", "robomosp")
GOAL = [0.557, 0, 0.374, math.pi, 0, math.pi]


class OnAProgram:
    """What holds for a child process and for a server alike. r is the connection."""

    def test_a_student_solves_a_pose_moves_there_and_looks(self):
        arm = self.r.robot.get("pa10")
        self.assertEqual((arm.kind, arm.name), ("robot", "pa10"))
        found = arm.solve_ik(target=GOAL)
        self.assertEqual(found.status, "solved")
        position = arm.fk(q=found.q).position
        for have, want in zip(position, GOAL):
            self.assertAlmostEqual(have, want, delta=1e-9)
        cell = self.r.world.create(name="cell")
        cell.add_robot(robot=arm)
        cell.set_robot_q(robot="pa10", q=found.q)
        for have, want in zip(arm.joint_values(), found.q):
            self.assertAlmostEqual(have, want, delta=1e-12)
        try:
            picture = cell.picture(size=[64, 48], quality="draft")
        except robomosp.Error as e:
            if "no renderer" not in str(e):
                raise
            self.skipTest("no renderer is installed")
        self.assertEqual(picture._repr_png_()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual((picture.width, picture.height), (64, 48))
        self.assertEqual(self.r.picture(arm, q=found.q, size=[64, 48], quality="draft").width, 64)

    def test_errors_say_what_where_and_what_to_do(self):
        with self.assertRaises(robomosp.Error) as raised:
            self.r.robot.get("pa10").fk(q=[1, 2])
        self.assertEqual(raised.exception.code, "invalid_argument")
        self.assertIn("q", raised.exception.where)
        self.assertTrue(raised.exception.hint)
        self.assertEqual(raised.exception.number, -32602)
        with self.assertRaisesRegex(robomosp.Error, "robot.fk"):
            self.r.robot.fkk(id="pa10")
        arm = self.r.robot.get("twolink").duplicate(name="gone")
        arm.remove()
        with self.assertRaises(robomosp.Error) as raised:
            arm.dof()
        self.assertEqual(raised.exception.code, "stale_handle")

    def test_errors_carry_their_faults(self):
        cube = {"name": "cube", "root": {"kind": "box", "x": 0.1, "y": 0.1, "z": 0.1}}
        with self.assertRaises(robomosp.Error) as raised:
            self.r.call("solid.create", {**cube, "chord": "2 kg", "nonsense": 1})
        faults = {f["code"]: f for f in raised.exception.faults}
        self.assertEqual(set(faults), {"argument.unknown", "argument.wrong_unit"})
        self.assertEqual(faults["argument.wrong_unit"]["subject"]["argument"], "chord")
        mended = faults["argument.wrong_unit"]["remedies"][0]
        self.assertTrue(mended["is_tried"] and mended["repeats"])
        self.r.call(mended["command"], {**cube, **mended["args"]})
        self.assertEqual(robomosp.Error("of this client").faults, [])

    def test_faults_of_programs_come_with_lines_and_remedies(self):
        p = self.r.program.create(
            name="weld", source="PROGRAM weld;\nVAR\n  INT: count;\nBEGIN\n  coumt := 1;\n  other := 2;\nENDPROGRAM;\n")
        with self.assertRaises(robomosp.Error) as raised:
            p.run_alone()
        self.assertEqual([(f["code"], f["subject"]["line"]) for f in raised.exception.faults],
                         [("program.syntax", 5), ("program.syntax", 6)])
        found = self.r.fault.list(record=p)["faults"]
        self.assertEqual([f["subject"]["line"] for f in found], [5, 6])
        mended = found[0]["remedies"][0]
        self.assertTrue(mended["is_tried"])
        self.r.call(mended["command"], dict(mended["args"]))
        self.assertEqual([f["subject"]["line"] for f in self.r.fault.list(record=p)["faults"]], [6])

    def test_arguments_come_by_place_by_name_and_both(self):
        arm = self.r.robot("pa10")
        q = [0.1] * 7
        want = arm.fk(q=q).position
        for have in (self.r.robot.fk(arm, q), self.r.robot.fk("pa10", q), arm.fk(q), self.r.robot.fk(arm, q=q),
                     self.r.robot.fk("pa10", q=q), arm.fk(q, all=True), self.r.call("robot.fk", {"id": "pa10", "q": q})):
            self.assertEqual(list(have.position), list(want))
        with self.assertRaisesRegex(robomosp.Error, "twice"):
            self.r.robot.fk("pa10", id="pa10")
        self.assertEqual(len(self.r.apropos("inverse kinematics")) > 1, True)  # a topic that is a command

    def test_long_arrays_go_as_bytes_both_ways(self):
        arm = self.r.robot.get("twolink")
        rows = [[0.001 * i, 0.002 * i] for i in range(2000)]
        want = arm.fk(q=[0.5, 1.0]).position
        have = arm.fk(q=rows).position
        self.assertEqual(len(have), 2000)
        self.assertEqual(list(have[500]), list(want))
        flat = array.array("d", [0.25] * 100)
        self.assertEqual(self.r.lua("return 1"), 1)
        self.assertEqual(self.r._sendable(flat)["$array"]["shape"], [100])
        with self.assertRaisesRegex(robomosp.Error, "MiB"):
            arm.fk(q=[[0.5, 0.5]] * 600_000)
        self.assertEqual(arm.dof(), 2)

    @unittest.skipIf(robomosp._numpy is None, "NumPy is not installed")
    def test_numpy_arrays_go_both_ways(self):
        import numpy as np
        arm = self.r.robot.get("twolink")
        rows = np.linspace(0, 1, 400).reshape(200, 2)
        have = arm.fk(q=rows).position
        self.assertEqual(have.shape, (200, 3))
        self.assertTrue(np.allclose(have[7], arm.fk(q=rows[7]).position, atol=1e-15))
        self.assertEqual(arm.fk(q=np.float32([0, 0])).pose.shape, (4, 4))
        self.assertTrue(arm.fk(q=rows[::2, ::-1]).position.flags.writeable)

    def test_numbers_that_json_lacks(self):
        with self.assertRaises(robomosp.Error):
            self.r.robot.fk(id="twolink", q=[math.nan, 0])
        with self.assertRaises(robomosp.Error):
            self.r.material.create(name="heavy", density=math.inf)
        for bad in ({1, 2}, object(), {3: 4}, "\ud800", 1j):
            with self.assertRaises(robomosp.Error) as raised:
                self.r.material.create(name="odd", density=bad)
            self.assertEqual(raised.exception.code, "invalid_argument")
        deep = []
        for _ in range(5000):
            deep = [deep]
        with self.assertRaises(robomosp.Error):
            self.r.material.create(name="odd", density=deep)

    def test_jobs_report_progress_and_end(self):
        arm = self.r.robot.get("twolink")
        seen = []
        job = arm.workspace.job(samples=2000)
        self.assertIsInstance(job, robomosp.Job)
        result = job.wait(60, on_progress=seen.append)
        self.assertIsNotNone(result)
        self.assertTrue(seen)
        states = [s.state for s in arm.workspace.job(samples=2000).updates()]
        self.assertNotIn(states[-1], ("waiting", "running"))
        long = self.r.robot.get("pa10").workspace.job(samples=10_000_000, collisions=True)
        long.cancel()
        with self.assertRaises(robomosp.Cancelled):
            long.wait(60)

    def test_a_call_that_takes_too_long_is_cancelled(self):
        arm = self.r.robot.get("pa10")
        began = time.monotonic()
        with self.assertRaises(robomosp.Timeout) as raised:
            arm.workspace(samples=10_000_000, collisions=True, _timeout=0.2)
        self.assertIsInstance(raised.exception, TimeoutError)
        self.assertEqual(arm.dof(), 7)  # what ran has ended
        self.assertLess(time.monotonic() - began, 30)
        with self.assertRaisesRegex(robomosp.Error, "not a time"):
            arm.dof(_timeout="soon")

    @unittest.skipIf(threading.current_thread() is not threading.main_thread(), "signals come to the main thread")
    def test_an_interrupt_cancels_the_call_and_the_connection_lives(self):
        arm = self.r.robot.get("pa10")
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            arm.workspace(samples=10_000_000, collisions=True)
        self.assertEqual(arm.dof(), 7)

    def test_events_come_to_iterators_and_callbacks(self):
        with self.r.events("change", kinds=["material"]) as events:
            self.r.material.create(name="brass_1", density=8500)
            event = events.get(timeout=10)
            self.assertEqual(event.label.split()[0], "material.create")
            self.assertEqual(event.added[0].name, "brass_1")
            self.assertIsNone(events.get(timeout=0.05))
        self.assertEqual(list(events), [])
        came = threading.Event()
        calling = self.r.on_event(lambda e: came.set() if self.r.version() else None, "change")
        self.r.material.create(name="brass_2", density=8500)
        self.assertTrue(came.wait(10))
        calling.close()

    def test_batches_scripts_and_classic_lines(self):
        out = self.r.batch([("robot.get", {"name": "twolink"}), ("robot.dof", {"id": "twolink"}), ("robot.dof", {"id": "no"})])
        self.assertEqual(out[1], 2)
        self.assertIsInstance(out[2], robomosp.Error)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            self.assertEqual(self.r.lua("print('hello') return 6 * 7"), 42)
        self.assertEqual(said.getvalue(), "hello\n")
        self.assertEqual(self.r.classic("PRobot puma560 Link 2 GetMaxAngle"), 225)
        self.assertEqual(self.r.batch([]), [])

    def test_commands_describe_themselves(self):
        self.assertIn("fk", dir(self.r.robot))
        self.assertIn("robot", dir(self.r))
        self.assertIn("import_", dir(self.r))
        arm = self.r.robot.get("pa10")
        self.assertIn("solve_ik", dir(arm))
        self.assertNotIn("get", dir(arm))
        text = pydoc.plain(pydoc.render_doc(self.r.robot.fk))
        self.assertIn("pose of the tool", text)
        self.assertIn("q:", text)
        import inspect
        self.assertIn("id", inspect.signature(self.r.robot.fk).parameters)
        self.assertNotIn("id", inspect.signature(arm.fk).parameters)
        with self.assertRaises(AttributeError):
            self.r.robot._repr_html_

    def test_no_command_is_hidden_by_a_name_of_the_client(self):
        names = self.r._all_names()
        self.assertGreater(len(names), 300)
        below = {n.split(".")[1] for n in names if "." in n}
        tops = {n.split(".")[0] for n in names}
        public = lambda thing: {n for n in dir(thing) if not n.startswith("_")}  # noqa: E731
        own = public(robomosp.Connection) | public(robomosp.AsyncConnection) | set(vars(self.r))
        self.assertEqual(tops & own, set())
        self.assertEqual(below & public(robomosp.Handle), set())
        self.assertEqual(below & public(robomosp.Topic), set())
        of_jobs = {n.split(".")[1] for n in names if n.startswith("job.")}
        self.assertEqual(of_jobs & {"latest", "updates", "result"}, set())

    def test_notebooks_show_tables_and_plots(self):
        arm = self.r.robot.get("pa10")
        self.assertIn("pa10", arm._repr_html_())
        self.assertIn("<table>", arm._repr_html_())
        self.assertIn("<th>", arm.joints()._repr_html_())
        self.assertIn("position", arm.fk(q="ready")._repr_html_())
        self.assertIn("&lt;b&gt;", robomosp.Result({"<b>": "<i>"})._repr_html_())
        stroke = self.r.trajectory.create(name="stroke", segments=[
            {"shape": "line", "points": [[0.5, 0, 0.3, 0, 0, 0], [0.5, "200 mm", 0.3, 0, 0, 0]]}])
        self.assertIn("<svg", self.r.plot(stroke)._repr_svg_())
        self.assertIn("<svg", self.r.plot(stroke.record(), columns=["x", "y"])._repr_svg_())

    def test_handles_of_another_connection_are_refused(self):
        arm = self.r.robot.get("pa10")
        with FakeServer() as other, robomosp.connect(other.address) as o:
            with self.assertRaisesRegex(robomosp.Error, "another connection"):
                o.echo(arm)

    def test_threads_share_a_connection(self):
        arm = self.r.robot.get("pa10")
        bad = []

        def work(k):
            for i in range(20):
                q = [0.01 * (k + i)] * 7
                if list(arm.fk(q=q).position) != list(self.r.robot.fk("pa10", q).position):
                    bad.append(q)

        threads = [threading.Thread(target=work, args=(k,)) for k in range(6)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(bad, [])

    def test_asyncio_does_the_same(self):
        async def scenario():
            async with self.aopen() as r:
                arm = await r.robot.get("pa10")
                found = await arm.solve_ik(target=GOAL)
                self.assertEqual(found.status, "solved")
                two = await asyncio.gather(arm.fk(q=found.q), r.robot.fk("pa10", q=found.q))
                self.assertEqual(list(two[0].position), list(two[1].position))
                with self.assertRaises(robomosp.Error):
                    await arm.fk(q=[1])
                job = await arm.workspace.job(samples=2000)
                self.assertIsNotNone(await job.wait(60))
                with self.assertRaises(robomosp.Timeout):
                    await arm.workspace(samples=10_000_000, collisions=True, _timeout=0.2)
                task = asyncio.ensure_future(arm.workspace(samples=10_000_000, collisions=True))
                await asyncio.sleep(0.2)
                task.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await task
                self.assertEqual(await arm.dof(), 7)
                async with await r.events("change") as events:
                    await r.material.create(name="brass_3", density=8500)
                    event = await events.get(timeout=10)
                    self.assertIn("material", event.label)
                await r.load_commands()
                self.assertIn("fk", dir(r.robot))
                self.assertIn("pose of the tool", r.robot.fk.__doc__)
                self.assertEqual((await r.batch([("robot.dof", {"id": "pa10"})])), [7])
        asyncio.run(scenario())


class Rpc(OnAProgram, unittest.TestCase):
    def setUp(self):
        self.r = robomosp.start(PROGRAM)
        self.aopen = lambda: robomosp.astart(PROGRAM)

    def tearDown(self):
        self.r.close()

    def test_the_child_ends_with_the_connection_and_another_begins(self):
        arm = self.r.robot.get("pa10")
        child = self.r._transport.process
        self.r.close()
        self.assertIsNotNone(child.poll())
        with self.assertRaisesRegex(robomosp.ConnectionLost, "closed"):
            self.r.robot.list()
        self.r.reconnect()
        with self.assertRaises(robomosp.Error) as raised:
            arm.dof()
        self.assertEqual(raised.exception.code, "stale_handle")
        self.assertEqual(self.r.robot("pa10").dof(), 7)

    def test_a_child_that_dies_is_told(self):
        self.r._transport.process.kill()
        with self.assertRaisesRegex(robomosp.ConnectionLost, "ended with status -9"):
            for _ in range(100):
                self.r.version()
                time.sleep(0.02)
        self.assertFalse(self.r.is_open)

    def test_a_connection_that_nobody_holds_ends(self):
        child = self.r._transport.process
        self.r = robomosp.start(PROGRAM)
        child.wait(10)


class Served(OnAProgram, unittest.TestCase):
    """The same over TCP, when the program serves."""

    @classmethod
    def setUpClass(cls):
        text = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True).stdout
        if "serve" not in text:
            raise unittest.SkipTest("the program does not serve yet")

    def setUp(self):
        self.folder = short_folder()
        self.path = os.path.join(self.folder.name, "s")
        self.server = subprocess.Popen([PROGRAM, "serve", "--listen", "unix:" + self.path, "--allow",
                                        "reads,edits,simulates,files_read", "--grant", "lua.eval"], stdin=subprocess.DEVNULL,
                                       stdout=subprocess.DEVNULL)
        end = time.monotonic() + 20
        while True:
            try:
                self.r = robomosp.connect("unix:" + self.path)
                break
            except robomosp.ConnectionLost:
                if time.monotonic() > end or self.server.poll() is not None:
                    self.server.kill()
                    raise
                time.sleep(0.05)
        self.aopen = lambda: robomosp.aconnect("unix:" + self.path)

    def tearDown(self):
        self.r.close()
        self.server.terminate()
        self.server.wait(20)
        self.folder.cleanup()

    @unittest.skipUnless("ROBOMOSP_C_CLIENT_TEST" in os.environ, "the client in C is not named")
    def test_the_client_in_c_does_its_work_here(self):
        done = subprocess.run([os.environ["ROBOMOSP_C_CLIENT_TEST"], "connect", "unix:" + self.path],
                              capture_output=True, text=True, timeout=100)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_two_connections_share_the_world(self):
        with robomosp.connect("unix:" + self.path) as other:
            with other.events("change") as events:
                self.r.material.create(name="shared", density=1000)
                self.assertIn("material.create", events.get(timeout=10).label)
            self.assertEqual(other.material.get("shared").name, "shared")


class Fakes(unittest.TestCase):
    """Servers that are none, lie, or go away."""

    def lost(self, raw, sentence, kind=robomosp.ConnectionLost, **options):
        with FakeServer(raw=raw, **options) as server:
            with self.assertRaisesRegex(kind, sentence) as raised:
                robomosp.connect(server.address, timeout=5)
            self.assertIsNone(raised.exception.__cause__)
            self.assertTrue(raised.exception.__suppress_context__ or raised.exception.__context__ is None)
            with self.assertRaisesRegex(kind, sentence):
                asyncio.run(self.aconnect(server.address))

    async def aconnect(self, address, **options):
        async with robomosp.aconnect(address, timeout=5, **options) as r:
            return await r.echo(x=1)

    def test_what_is_no_robomosp_is_said_in_a_sentence(self):
        not_ours = robomosp.ProtocolError
        self.lost(b"HTTP/1.1 400 Bad Request\r\n\r\n", "not a ROBOMOSP server.*HTTP/1.1", not_ours)
        self.lost(b"SSH-2.0-OpenSSH_9.2\r\n", "not a ROBOMOSP server.*SSH", not_ours)
        self.lost(b"220 mail ready", "not a ROBOMOSP server.*220 mail", not_ours)
        self.lost(b"\xff\xfe\x00\n", "not a ROBOMOSP server", not_ours)
        self.lost(b"\x15\x03\x01\x00\x02\x02\x16\n", "speaks TLS", not_ours)
        self.lost(b"17\n", "no answer", not_ours)
        self.lost(b'{"jsonrpc":"2.0","id":1}\n', "no answer", not_ours)
        self.lost(b'{"jsonrpc":"2.0","id":1,"result":{}}\n', "not a ROBOMOSP server", not_ours)
        self.lost(b'{"jsonrpc":"2.0","id":1,"error":{"code":-32601,"message":"Method not found"}}\n',
                  "not a ROBOMOSP server: Method not found", not_ours)
        self.lost(b"", "without an answer")

    def test_hostile_answers_are_one_sentence(self):
        bad = robomosp.ProtocolError
        for raw in (b"[" * 100_000 + b"]" * 100_000 + b"\n", b'{"id":1,"result":' + b"9" * 100_000 + b"}\n",
                    b'{"id":1,"result":NaN}\n', b'{"id":1,"result":{"$handle":7}}\n', b"null\n",
                    b'{"id":1,"result":{"$array":{"shape":[9999999999],"base64":""}}}\n',
                    b'{"id":1,"result":{"$array":{"shape":[1],"base64":"?"}}}\n', b'{"id":1,"error":7}\n',
                    b'"\\ud800"\n'):
            self.lost(raw, ".", bad)

    def test_silence_ends_with_the_time(self):
        with FakeServer(silent=True) as server:
            with self.assertRaisesRegex(robomosp.Timeout, "did not answer within 0.2 s"):
                robomosp.connect(server.address, timeout=0.2)

    def test_versions_must_agree(self):
        with FakeServer(hello={**HELLO, "protocol": 2}) as server:
            with self.assertRaisesRegex(robomosp.ProtocolError, "version 2 .* version 1"):
                robomosp.connect(server.address)

    def test_tokens_are_asked_for(self):
        with FakeServer(token="rmp_right") as server:
            for wrong in (None, "rmp_wrong"):
                with self.assertRaisesRegex(robomosp.Error, "token") as raised:
                    robomosp.connect(server.address, token=wrong)
                self.assertEqual(raised.exception.code, "permission")
            with robomosp.connect(server.address, token="rmp_right") as r:
                self.assertEqual(r.hello.session, 7)
            self.assertEqual(asyncio.run(self.aconnect(server.address, token="rmp_right")), {"x": 1})

    def test_a_line_that_is_cut_and_a_server_that_goes_are_told(self):
        with FakeServer() as server:
            def cut(message, say):
                say(b'{"jsonrpc":"2.0","id":%d,"resu' % message["id"])
                server.drop()
                return NotImplemented

            server.methods["cut"] = cut
            with robomosp.connect(server.address) as r:
                with self.assertRaisesRegex(robomosp.ConnectionLost, "in the middle of an answer"):
                    r.cut()
                with self.assertRaisesRegex(robomosp.ConnectionLost, "in the middle"):
                    r.echo()
                r.reconnect()
                self.assertEqual(r.echo(x=[1, 2]), {"x": [1, 2]})

            def closing(message, say):
                say({"jsonrpc": "2.0", "method": "server.closing", "params": {"reason": "It stops for the night."}})
                server.drop()
                return NotImplemented

            server.methods["closing"] = closing
            with robomosp.connect(server.address) as r:
                with self.assertRaisesRegex(robomosp.ConnectionLost, "It stops for the night"):
                    r.closing()

    def test_handles_outlive_a_reconnect_to_the_same_program_only(self):
        with FakeServer() as server:
            server.methods["robot.get"] = lambda m, say: handle("robot", 5, "pa10")
            with robomosp.connect(server.address) as r:
                arm = r.robot.get("pa10")
                r.reconnect()
                self.assertEqual(r.echo(a=arm).a, arm)
                server.hello = {**HELLO, "instance": "two"}
                r.reconnect()
                with self.assertRaisesRegex(robomosp.Error, "has ended"):
                    r.echo(a=arm)
                self.assertNotEqual(r.robot.get("pa10"), arm)

    def test_nobody_there_is_a_sentence(self):
        with FakeServer() as server:
            address = server.address
        with self.assertRaisesRegex(robomosp.ConnectionLost, "cannot be reached: Connection refused"):
            robomosp.connect(address)
        with self.assertRaisesRegex(robomosp.ConnectionLost, "No such file"):
            robomosp.connect("unix:/nowhere/at/all")
        with self.assertRaisesRegex(robomosp.ConnectionLost, "cannot be reached"):
            asyncio.run(self.aconnect(address))
        for bad in ("", "a:b:c", "host:0", "host:99999", "unix:", None, "[::1", "1:2:3"):
            with self.assertRaises(robomosp.Error):
                robomosp.connect(bad)
        with self.assertRaisesRegex(robomosp.Error, "no program"):
            robomosp.start("/no/such/program")
        with self.assertRaisesRegex(robomosp.Error, "not a ROBOMOSP server|is not"):
            robomosp.start(["/bin/cat"], timeout=5)
        with self.assertRaises(robomosp.ConnectionLost):
            robomosp.start(["/bin/true"], timeout=5)

    def test_pushed_events_and_a_subscription_that_is_slow(self):
        with FakeServer() as server:
            def event(n):
                return {"jsonrpc": "2.0", "method": "event",
                        "params": {"subscription": 3, "topic": "message", "text": str(n)}}

            def subscribe(message, say):
                say(event(1))  # before the answer
                return 3

            def burst(message, say):
                for n in range(2, 12):
                    say(event(n))

            server.methods["server.subscribe"] = subscribe
            server.methods["server.unsubscribe"] = lambda m, say: None
            server.methods["burst"] = burst
            with robomosp.connect(server.address) as r:
                events = r.events("message", rate=10)
                self.assertEqual(server.asked[-1]["params"], {"rate": 10, "topics": ["message"]})
                most, robomosp._MOST_EVENTS = robomosp._MOST_EVENTS, 4
                try:
                    r.burst()
                finally:
                    robomosp._MOST_EVENTS = most
                first = events.get(timeout=5)
                self.assertEqual((first.text, first.left_out), ("8", 7))
                self.assertEqual([e.text for e in events.take()], ["9", "10", "11"])
                threading.Timer(0.1, r.close).start()
                self.assertEqual(list(events), [])

            async def scenario():
                async with robomosp.aconnect(server.address) as r:
                    events = await r.events("message")
                    await r.burst()
                    out = []
                    async for e in events:
                        out.append(e.text)
                        if e.text == "11":
                            break
                    self.assertEqual(out, [str(n) for n in range(1, 12)])
                    await events.close()
            asyncio.run(scenario())

    def test_bytes_infinite_numbers_and_files(self):
        with FakeServer() as server:
            store = {}

            def read(message, say):
                p = message["params"]
                part = store[p["file"]][p["offset"]:p["offset"] + p["length"]]
                import base64
                return {"base64": base64.b64encode(part).decode(), "size": len(store[p["file"]]),
                        "is_end": p["offset"] + len(part) >= len(store[p["file"]])}

            def write(message, say):
                import base64
                p = message["params"]
                store[p["file"]] = (store.get(p["file"], b"") if p["append"] else b"") + base64.b64decode(p["base64"])

            server.methods["file.read"], server.methods["file.write"] = read, write
            server.methods["limits"] = lambda m, say: {"upper": "inf", "name": "inf", "q": packed([1, math.inf])}
            server.methods["ioci.describe"] = lambda m, say: [{"name": "echo", "returns": {}}, {"name": "limits", "params": [], "returns": {
                "type": "map", "fields": [{"name": "upper", "type": "real"}, {"name": "name", "type": "string"}]}}]
            with robomosp.connect(server.address, numpy=False) as r:
                data = os.urandom((1 << 20) + 77)
                r.write_file("a", data)
                self.assertEqual(store["a"], data)
                self.assertEqual(r.read_file("a"), data)
                r.write_file("empty", b"")
                self.assertEqual(r.read_file("empty"), b"")
                self.assertEqual(r.call("limits"), {"upper": math.inf, "name": "inf", "q": [1, math.inf]})
                self.assertEqual(r.echo(x=-math.inf).x, "-inf")

    def test_tls_is_checked(self):
        with short_folder() as folder, short_folder() as other:
            files, others = make_certificate(folder), make_certificate(other)
            if files is None:
                self.skipTest("there is no program openssl")
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*files)
            with FakeServer(context=context) as server:
                with robomosp.connect(server.address, tls=files[0]) as r:
                    text = "x" * 3_000_000
                    self.assertEqual(r.echo(text=text).text, text)
                self.assertEqual(asyncio.run(self.aconnect(server.address, tls=files[0])), {"x": 1})
                with self.assertRaisesRegex(robomosp.ConnectionLost, "is not trusted"):
                    robomosp.connect(server.address, tls=others[0])
                with self.assertRaisesRegex(robomosp.ConnectionLost, "is not trusted"):
                    robomosp.connect(server.address, tls=True)
                with self.assertRaisesRegex(robomosp.ConnectionLost, "is not trusted"):
                    asyncio.run(self.aconnect(server.address, tls=True))
            with FakeServer(raw=b"hello\n") as server:
                with self.assertRaisesRegex(robomosp.ProtocolError, "does not speak TLS"):
                    robomosp.connect(server.address, tls=files[0])
            with self.assertRaisesRegex(robomosp.Error, "certificates"):
                robomosp.connect("127.0.0.1:1", tls="/no/such/file")

    def test_unix_sockets(self):
        with short_folder() as folder:
            with FakeServer(path=os.path.join(folder, "s")) as server:
                with robomosp.connect(server.address) as r:
                    self.assertEqual(r.echo(x=1).x, 1)
                self.assertEqual(asyncio.run(self.aconnect(server.address)), {"x": 1})

    def test_an_answer_to_an_unreadable_request_reaches_the_one_that_waits(self):
        with FakeServer() as server:
            def refuse(message, say):
                say({"jsonrpc": "2.0", "id": None, "error": {"code": -32700, "message": "the line is no JSON"}})
                return NotImplemented

            server.methods["odd"] = refuse
            with robomosp.connect(server.address) as r:
                with self.assertRaisesRegex(robomosp.Error, "no JSON"):
                    r.odd()
                self.assertEqual(r.echo(x=1).x, 1)


if __name__ == "__main__":
    unittest.main()
