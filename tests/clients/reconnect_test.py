# SPDX-License-Identifier: Apache-2.0
"""Clients and servers that are killed at any moment: who is left goes on.

ROBOMOSP_KILLS is how often (5 unless given), ROBOMOSP_KILL_SEED where the moments begin.
"""
import os
import random
import signal
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "sdk", "clients", "python"), HERE]
import robomosp  # noqa: E402
from fake_server import short_folder  # noqa: E402
from serving import PROGRAM, end, listening  # noqa: E402

KILLS = int(os.environ.get("ROBOMOSP_KILLS", "5"))
SEED = int(os.environ.get("ROBOMOSP_KILL_SEED", "14"))


class Server:
    """`robomosp serve` on a Unix socket."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "s")
        self.environment = {**os.environ, "XDG_STATE_HOME": folder}  # unsaved work of those that are killed
        self.address = "unix:" + self.path
        self.start()

    def start(self):
        self.process, _ = listening([PROGRAM, "serve", "--listen", self.address], env=self.environment)

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        end(self.process)


class Killed(unittest.TestCase):
    def test_a_client_outlives_its_server(self):
        moments = random.Random(SEED)
        with short_folder() as folder, Server(folder) as server:
            seen = []
            r = robomosp.connect(server.address)
            pulled = r.events("change")
            pushed = r.on_event(seen.append, "change")
            for n in range(KILLS):
                cell = r.world.create(name=f"cell {n}")
                end = time.monotonic() + 0.02 + moments.random() * 0.1
                with self.assertRaises(robomosp.ConnectionLost) as raised:
                    while True:  # something is always under way
                        if time.monotonic() > end:
                            server.process.kill()
                        r.world.signals(cell)
                self.assertNotIn("\n", str(raised.exception))
                server.kill()
                if n % 2 == 0:
                    with self.assertRaisesRegex(robomosp.ConnectionLost, "cannot be reached"):
                        r.reconnect()
                server.start()
                r.reconnect(wait=10)
                with self.assertRaisesRegex(robomosp.Error, "has ended"):  # it counts anew
                    cell.signals()
                pulled.take()
                del seen[:]
                r.material.create(name=f"steel {n}", density=7800)
                self.assertEqual(pulled.get(timeout=5).label, "material.create")
                end = time.monotonic() + 5
                while not seen and time.monotonic() < end:
                    time.sleep(0.01)
                self.assertEqual([e.label for e in seen], ["material.create"])
            r.close()
            self.assertFalse(pulled.is_open or pushed.is_open)

    def test_a_server_outlives_its_clients(self):
        moments = random.Random(SEED + 1)
        script = ("import sys, robomosp\n"
                  "r = robomosp.connect(sys.argv[1], client='victim')\n"
                  "cell = r.world.create(name='of ' + sys.argv[2])\n"
                  "cell.add_signal(name='busy')\n"
                  "events = r.events('change')\n"
                  "print('ready', flush=True)\n"
                  "n = 0\n"
                  "while True:\n"
                  "    n += 1\n"
                  "    cell.set_signal(signal='busy', value=n % 2)\n"
                  "    r.batch([('world.signals', {'id': cell})] * 50)\n")
        environment = {**os.environ, "PYTHONPATH": sys.path[0]}
        with short_folder() as folder, Server(folder) as server, robomosp.connect(server.address) as r:
            for n in range(KILLS):
                victim = subprocess.Popen([sys.executable, "-B", "-c", script, server.address, str(n)],
                                          env=environment, stdout=subprocess.PIPE, text=True)
                try:
                    self.assertEqual(victim.stdout.readline(), "ready\n")
                    time.sleep(moments.random() * 0.1)
                finally:
                    os.kill(victim.pid, signal.SIGKILL)
                    victim.wait()
                    victim.stdout.close()
                # What it did stays, who counts on it is told, and everybody else is answered.
                with self.assertRaisesRegex(robomosp.Error, "no client \"victim\""):
                    r.server.wait(world=f"of {n}", signal="busy", value=7, client="victim", absent=0, timeout=10)
                self.assertEqual(len(r.world.list()), n + 1)

    def test_a_script_in_lua_outlives_its_server(self):
        with short_folder() as folder, Server(folder) as server:
            script = os.path.join(folder, "client.lua")
            with open(script, "w", encoding="utf-8") as out:
                out.write("""
                    local remote = require "remote"
                    local r = remote.connect(arg[1])
                    local cell, labels = r.world.create{name = "cell"}, {}
                    r:on("change", function(event) labels[#labels + 1] = event.label end)
                    print("ready")
                    local ok, why = pcall(function() while true do cell:signals() end end)
                    print(why)
                    r:reconnect(20)
                    print(select(2, pcall(function() return cell:signals() end)))
                    r.material.create{name = "steel", density = 7800}
                    r:wait(5, function() return #labels > 0 end)
                    print(labels[1])
                    """)
            process = subprocess.Popen([PROGRAM, "run", script, server.address], stdout=subprocess.PIPE,
                                       stderr=subprocess.STDOUT, text=True)
            self.assertEqual(process.stdout.readline(), "ready\n")
            time.sleep(random.Random(SEED + 2).random() * 0.1)
            server.kill()
            self.assertRegex(process.stdout.readline(), "closed the connection.*\\.\n")
            server.start()
            self.assertIn("belongs to a program that has ended", process.stdout.readline())
            self.assertEqual(process.stdout.readline(), "material.create\n")
            self.assertEqual(process.wait(20), 0)
            process.stdout.close()


if __name__ == "__main__":
    unittest.main()
