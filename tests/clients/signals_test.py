# SPDX-License-Identifier: Apache-2.0
"""server.wait: what wakes a wait, what ends it, and what it costs."""
import os
import subprocess
import sys
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "sdk", "clients", "python"), HERE]
import robomosp  # noqa: E402
from fake_server import short_folder  # noqa: E402
from serving import PROGRAM, Serving  # noqa: E402


class Signals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = short_folder()
        cls.server = Serving("--listen", "unix:" + os.path.join(cls.folder.name, "s"), "--limit", "subscriptions=64")
        cls.count = 0

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()
        cls.folder.cleanup()

    def setUp(self):
        self.a = robomosp.connect(self.server.address, client="left")
        self.b = robomosp.connect(self.server.address, client="right")
        Signals.count += 1
        self.cell = self.a.world.create(name=f"cell {self.count}")
        self.cell.add_signal(name="free")
        self.cell.add_signal(name="pressure", kind="analogue", unit="Pa", initial=1e5)

    def tearDown(self):
        self.a.close()
        self.b.close()

    def wait(self, **options):
        return self.b.server.wait(world=self.cell.name, **options)

    def refused(self, sentence, code="cancelled", **options):
        with self.assertRaisesRegex(robomosp.Error, sentence) as raised:
            self.wait(**options)
        self.assertEqual(raised.exception.code, code)

    def soon(self, work):
        timer = threading.Timer(0.1, work)
        timer.start()
        self.addCleanup(timer.join)

    def test_a_value_that_is_there_already(self):
        self.assertEqual(self.wait(signal="free", value=0), 0)
        self.assertEqual(self.wait(signal="pressure", at_least=1e5), 1e5)
        self.assertEqual(self.wait(signal="pressure", at_most=1e5, timeout=0), 1e5)

    def test_the_edit_of_another_wakes_it(self):
        for value, options in ((1, {}), (2.5e5, {"at_least": 2e5}), (9e4, {"at_most": 1e5, "timeout": 20})):
            signal = "free" if value == 1 else "pressure"
            if options.get("at_most"):
                self.a.world.set_signal(self.cell, "pressure", 3e5)
            self.soon(lambda s=signal, v=value: self.a.world.set_signal(self.cell, s, v))
            self.assertEqual(self.wait(signal=signal, **options), value)
        self.soon(self.a.document.undo)  # and so does taking an edit back
        self.assertEqual(self.wait(signal="pressure", value=3e5), 3e5)

    def test_other_edits_do_not(self):
        self.soon(lambda: self.cell.add_signal(name="another"))
        self.refused("did not become 1 within 0.3 s; it is 0", signal="free", timeout=0.3)

    def test_other_requests_are_answered_meanwhile_and_it_can_be_cancelled(self):
        said = []
        waiting = threading.Thread(target=lambda: said.append(self.wait(signal="free", timeout=30)))
        waiting.start()
        time.sleep(0.1)
        self.assertGreaterEqual(len(self.b.world.list()), 1)
        self.cell.set_signal(signal="free", value=1)
        waiting.join(10)
        self.assertEqual(said, [1])
        with self.assertRaises(robomosp.Timeout):  # the client's own: rpc.cancel
            self.wait(signal="free", value=0, _timeout=0.1)
        for _ in range(40):  # each is taken off: there is room for 16 at a time
            with self.assertRaises(robomosp.Timeout):
                self.wait(signal="free", value=0, _timeout=0.001)

    def test_what_can_never_come_true_is_told(self):
        self.refused("no signal|there is no signal", "unknown_name", signal="fre")
        self.refused("one of value, at_least and at_most", "invalid_argument", signal="free", value=1, at_most=2)
        self.soon(lambda: self.cell.remove_signal("free"))
        self.refused("has no signal \"free\" any more", "unknown_name", signal="free")
        self.soon(lambda: self.a.world.remove(self.cell))
        self.refused("no longer exists", "stale_handle", signal="pressure", value=7)
        with self.assertRaisesRegex(robomosp.Error, "worlds have a signal|no world has"):
            self.b.server.wait(signal="nowhere")
        with self.assertRaisesRegex(robomosp.Error, "cannot be 2"):
            self.a.world.create(name=f"other {self.count}").add_signal(name="x")
            self.a.world.set_signal(f"other {self.count}", "x", 2)

    def test_a_partner_may_come_late_and_come_back_and_is_missed_then(self):
        began = time.monotonic()
        self.refused('no client "nobody" has been connected for 0.2 s', signal="free", client="nobody", absent=0.2)
        self.assertLess(time.monotonic() - began, 5)
        self.soon(self.a.reconnect)
        self.soon(lambda: (time.sleep(0.3), self.a.world.set_signal(f"cell {self.count}", "free", 1)))
        self.assertEqual(self.wait(signal="free", client="left", absent=5), 1)
        self.soon(self.a.close)
        self.refused('no client "left"', signal="free", value=0, client="left", absent=0.2)
        self.a.reconnect()

    def test_so_many_and_no_more_and_no_threads(self):
        def threads():
            with open(f"/proc/{self.server.process.pid}/status", encoding="ascii") as file:
                return int(next(line for line in file if line.startswith("Threads")).split()[1])

        with self.assertRaisesRegex(robomosp.Error, "16 requests job.wait and server.wait are already waiting"):
            for _ in range(17):
                id_, message = self.b._request("server.wait", {"world": self.cell.name, "signal": "free"})
                if _ < 16:
                    self.b._post(self.b._line(message))
                else:
                    time.sleep(0.2)
                    self.wait(signal="free")
        clients = [robomosp.connect(self.server.address) for _ in range(30)]
        self.assertEqual(self.b.world.signals(self.cell.name)[0].name, "free")
        before, done = threads(), []
        lock = threading.Lock()

        def wait(r):
            value = r.server.wait(world=self.cell.name, signal="free", timeout=60)
            with lock:
                done.append(value)

        waiting = [threading.Thread(target=wait, args=(r,)) for r in clients for _ in range(8)]
        for t in waiting:
            t.start()
        time.sleep(0.5)
        self.assertLessEqual(threads(), before + 4)  # 240 wait
        began = time.monotonic()
        self.a.world.set_signal(self.cell, "free", 1)
        for t in waiting:
            t.join(30)
        self.assertEqual(done, [1] * 240)
        print(f"240 waits were answered within {time.monotonic() - began:.3f} s")
        for r in clients:
            r.close()

    def test_a_client_holds_up_nobody_by_batches_jobs_and_scripts(self):
        for work in (lambda: self.b.batch([("server.wait", {"world": self.cell.name, "signal": "free"})]),
                     lambda: [self.b.server.wait.job(world=self.cell.name, signal="free").wait(20)],
                     lambda: [self.b.lua(f"return server.wait{{world = '{self.cell.name}', signal = 'free'}}")]):
            began = time.monotonic()
            try:
                outcome = work()[0]
            except robomosp.Error as e:
                outcome = e
            self.assertIn("would block others", str(outcome))
            self.assertLess(time.monotonic() - began, 15)
        self.assertEqual(self.b.batch([("server.wait", {"world": self.cell.name, "signal": "free", "value": 0})]), [0])

    def test_over_standard_input(self):
        with robomosp.start(PROGRAM) as r:
            cell = r.world.create(name="cell")
            cell.add_signal(name="free")
            with self.assertRaisesRegex(robomosp.Error, "did not become 1 within 0.1 s"):
                r.server.wait(signal="free", timeout=0.1)
            self.soon(lambda: r.world.set_signal("cell", "free", 1))
            self.assertEqual(r.server.wait(signal="free"), 1)

    def test_in_the_program_itself(self):
        done = subprocess.run([PROGRAM, "eval", """
            local cell = world.create{name = "cell"}
            cell:add_signal{name = "free"}
            print(pcall(server.wait, {signal = "free", timeout = 0.1}))
            print(pcall(ioci.transaction, "x", function() server.wait{signal = "free"} end))
            local job = start("server.wait", {signal = "free"})
            cell:set_signal("free", 1)
            print(job:wait(), server.wait{signal = "free"})"""], capture_output=True, text=True, timeout=60)
        self.assertRegex(done.stdout, "within 0.1 s; it is 0.*\nfalse\t.*cannot be part of a group of edits.*\n1.0\t1.0")


if __name__ == "__main__":
    unittest.main()
