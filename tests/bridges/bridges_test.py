# SPDX-License-Identifier: Apache-2.0
"""robomosp-mqtt and robomosp-rtde as child processes, between a server, a broker and controllers of the test's own.

Environment: ROBOMOSP_PROGRAM, ROBOMOSP_MQTT, ROBOMOSP_RTDE, ROBOMOSP_CLIENT (folder of robomosp.py); MOSQUITTO names the
broker, without one its tests are left out.
"""
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.environ["ROBOMOSP_CLIENT"])
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import robomosp  # noqa: E402
from mqtt_peer import Peer  # noqa: E402
from rtde_controller import Controller  # noqa: E402

MOSQUITTO = os.environ.get("MOSQUITTO") or shutil.which("mosquitto", path="/usr/sbin:/usr/local/sbin:" + os.environ["PATH"])

CELL = """
local arm = robot.create{name = "arm", convention = "dh", links = {
  {a = 0.5, lower = -3, upper = 3, mass = 1, com = {-0.25, 0, 0}},
  {a = 0.4, lower = -3, upper = 3, mass = 1, com = {-0.2, 0, 0}}}}
local cell = world.create{name = "cell", parameters = {speed = {value = 1}}}
cell:add_robot{robot = arm, name = "left"}
local links = {}
for i = 1, 6 do links[i] = {a = 0.2, mass = 1, com = {-0.1, 0, 0}} end
robot.create{name = "six", convention = "dh", links = links}
"""


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def until(check, seconds=15, what="it"):
    """Waits for a value that is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = check()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"{what} did not happen within {seconds} s")


class Child:
    """A program with its standard error in a file."""

    def __init__(self, folder, name, *command):
        self.log = os.path.join(folder, f"{name}-{time.monotonic_ns()}.log")
        self.file = open(self.log, "wb")
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.file, stdin=subprocess.DEVNULL)

    def said(self):
        with open(self.log, encoding="utf-8", errors="replace") as f:
            return f.read()

    def end(self, how=signal.SIGTERM):
        """What it printed; its exit code is in .code."""
        if self.process.poll() is None:
            self.process.send_signal(how)
        out = self.process.communicate(timeout=20)[0].decode()
        self.code = self.process.returncode
        self.file.close()
        return out


class BridgeTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="robomosp-bridges-")
        self.children = []
        self.socket = os.path.join(self.folder, "server")
        with open(os.path.join(self.folder, "cell.lua"), "w") as f:
            f.write(CELL)

    def tearDown(self):
        for child in self.children:
            if child.process.poll() is None:
                child.end(signal.SIGKILL)
            child.process.stdout.close()
            child.file.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def child(self, name, *command):
        child = Child(self.folder, name, *command)
        self.children.append(child)
        return child

    def serve(self):
        if os.path.exists(self.socket):
            os.unlink(self.socket)
        server = self.child("server", os.environ["ROBOMOSP_PROGRAM"], "serve", "--listen", "unix:" + self.socket,
                            os.path.join(self.folder, "cell.lua"))
        until(lambda: os.path.exists(self.socket), 30, "the server's start")
        return server

    def connect(self):
        return robomosp.connect("unix:" + self.socket)

    def config(self, **tables):
        tables.setdefault("robomosp", {})
        tables["robomosp"].setdefault("address", "unix:" + self.socket)
        tables["robomosp"].setdefault("batch_seconds", 0.05)
        name = os.path.join(self.folder, f"config-{time.monotonic_ns()}.json")
        with open(name, "w") as f:
            json.dump(tables, f)
        return name

    def refusal(self, program, text):
        name = os.path.join(self.folder, "bad.json")
        with open(name, "w") as f:
            f.write(text)
        done = subprocess.run([program, "--check", name], capture_output=True, timeout=20)
        self.assertEqual(done.returncode, 1, text)
        return done.stderr.decode()

    def recordings(self, r, title="measured"):
        return [row for row in r.recording.list() if row["title"] == title]

    def samples(self, r, title="measured"):
        return sum(row["samples"] for row in self.recordings(r, title))

    def values(self, r, handle, column):
        return [float(v) for v in r.recording.values(id=handle, columns=column)]


@unittest.skipUnless(MOSQUITTO and os.environ.get("ROBOMOSP_MQTT"), "there is no broker or no robomosp-mqtt")
class Mqtt(BridgeTest):
    def broker(self, port=None, *lines):
        port = port or free_port()
        name = os.path.join(self.folder, "mosquitto.conf")
        with open(name, "w") as f:
            f.write(f"listener {port} 127.0.0.1\n" + "\n".join(lines or ["allow_anonymous true"]) + "\n")
        os.chmod(self.folder, 0o755)
        child = self.child("broker", MOSQUITTO, "-c", name)

        def listens():
            if child.process.poll() is not None:
                raise AssertionError("the broker ended: " + child.said())
            try:
                socket.create_connection(("127.0.0.1", port), 1).close()
                return True
            except OSError:
                return False
        until(listens, 15, "the broker's start")
        return child, port

    def recording(self, **more):
        # The controller counts degrees the other way round, from another zero, on the second joint.
        return {"topic": "plant/+/joints", "title": "measured", "robot": "left", "world": "cell",
                "time": {"field": "/stamp/ms", "unit": "ms"},
                "columns": [{"column": "q", "field": "/position", "count": 2, "unit": "deg",
                             "sign": [1, -1], "offset": [0, 90]},
                            {"column": "tau1", "field": "/effort/shoulder", "unit": "N m"}], **more}

    def bridge(self, port, *options, **tables):
        tables.setdefault("broker", {})
        tables["broker"]["port"] = port
        bridge = self.child("bridge", os.environ["ROBOMOSP_MQTT"], *options, self.config(**tables))
        until(lambda: "Connected to the broker" in bridge.said(), 15, "the bridge's connection")
        return bridge

    @staticmethod
    def truth(t):
        """Joints [rad] and torque [N m] that the model has at the time t [s]."""
        return math.sin(t), 0.5 * math.cos(2 * t), 3 * math.sin(5 * t)

    @staticmethod
    def fault(t):
        """By which the controller is off, known to the test alone."""
        return 0.01 + 0.002 * math.sin(20 * t), -0.005, 0.1

    def message(self, t):
        q1, q2, tau = (a + b for a, b in zip(self.truth(t), self.fault(t)))
        return json.dumps({"stamp": {"ms": 5e6 + 1e3 * t},
                           "position": [math.degrees(q1), 90 - math.degrees(q2)],
                           "effort": {"shoulder": tau}})

    def test_ten_thousand_messages_become_rows_and_residuals(self):
        self.serve()
        _, port = self.broker()
        bridge = self.bridge(port, recordings=[self.recording()])
        r = self.connect()
        controller = Peer(port, "controller")
        count, step = 10000, 0.002
        began = time.monotonic()
        for k in range(count):
            controller.publish("plant/left/joints", self.message(k * step))
        until(lambda: self.samples(r) == count, 60, "the last row")
        print(f"{count} messages in {time.monotonic() - began:.2f} s", file=sys.stderr)
        measured = self.recordings(r)[0]["recording"]
        time_values = self.values(r, measured, "time")
        for k in (0, 1, 777, count - 1):
            self.assertAlmostEqual(time_values[k], k * step, delta=1e-9)
        # The model's recording has other times; its interpolation is off by less than h^2/8 times the second derivative.
        h = 0.005
        times = [h * k for k in range(int(count * step / h) + 2)]
        model = r.recording.create(title="model", robot="left", world="cell", columns=[
            {"name": "time", "unit": "s", "values": times},
            {"name": "q1", "unit": "rad", "values": [self.truth(t)[0] for t in times]},
            {"name": "q2", "unit": "rad", "values": [self.truth(t)[1] for t in times]},
            {"name": "tau1", "unit": "N m", "values": [self.truth(t)[2] for t in times]}])
        found = measured.residual(with_=model)
        self.assertEqual(found["rows"], count)
        bounds = [h * h / 8 * c for c in (1, 2, 75)]
        for j, (column, bound) in enumerate(zip(found["columns"], bounds)):
            faults = [self.fault(k * step)[j] for k in range(count)]
            mean = math.fsum(faults) / count
            rms = math.sqrt(math.fsum(f * f for f in faults) / count)
            self.assertEqual(column["name"], ["q_residual1", "q_residual2", "tau_residual1"][j])
            self.assertAlmostEqual(column["mean"], mean, delta=bound)
            self.assertAlmostEqual(column["rms"], rms, delta=bound)
            self.assertAlmostEqual(column["max"], max(map(abs, faults)), delta=bound)
            for k, v in enumerate(self.values(r, found["recording"], column["name"])):
                self.assertAlmostEqual(v, faults[k], delta=bound + 1e-9)
        controller.close()
        r.close()
        out = bridge.end()
        self.assertEqual(bridge.code, 0, bridge.said())
        self.assertIn("10000 rows recorded, 0 messages refused, 0 rows late, 0 dropped", out)

    def test_what_is_no_state_is_refused_and_nothing_else_changes(self):
        self.serve()
        _, port = self.broker()
        bridge = self.bridge(port, recordings=[self.recording()])
        r = self.connect()
        controller = Peer(port, "controller")
        bad = [b"", b"garbage", b"\xff\xfe\x00", b"[" * 60000, b"{" * 100, b'{"position":' * 5000, b"null", b"3", b"[]",
               b'{"stamp":{"ms":1},"position":[NaN,0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":[1e999,0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":["1",0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":[null,0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":[0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":[0,0,0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":0,"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":1},"position":[0,0]}',
               b'{"stamp":[1],"position":[0,0],"effort":{"shoulder":0}}',
               b'{"stamp":{"ms":"1"},"position":[0,0],"effort":{"shoulder":0}}',
               b'{"x":"' + b"a" * 70000 + b'"}']
        for payload in bad:
            controller.publish("plant/left/joints", payload)
        controller.publish("plant/left/other", b"not ours")
        for t in (1.0, 1.1, 1.05, 1.1, 1.2):  # the third and fourth come late
            controller.publish("plant/left/joints", self.message(t))
        until(lambda: self.samples(r) == 3, what="the third row")
        times = self.values(r, self.recordings(r)[0]["recording"], "time")
        for got, wanted in zip(times, (0, 0.1, 0.2)):
            self.assertAlmostEqual(got, wanted, delta=1e-9)
        controller.close()
        r.close()
        self.assertIn(f"3 rows recorded, {len(bad)} messages refused, 2 rows late, 0 dropped", bridge.end())
        self.assertIn("is not used: it is not JSON", bridge.said())
        self.assertNotIn("\\x00", bridge.said())

    def test_broker_and_server_may_go_and_come_again(self):
        server = self.serve()
        broker, port = self.broker()
        bridge = self.bridge(port, recordings=[self.recording()], robomosp={"queue": 500})
        r = self.connect()
        controller = Peer(port, "controller")
        for k in range(50):
            controller.publish("plant/left/joints", self.message(0.01 * k))
        until(lambda: self.samples(r) == 50, what="the rows of before")
        controller.close()
        broker.end(signal.SIGKILL)
        until(lambda: "was lost" in bridge.said() or "closed the connection" in bridge.said(), what="the loss")
        self.broker(port)
        until(lambda: bridge.said().count("Connected to the broker") == 2, what="the second connection")
        controller = Peer(port, "controller")
        for k in range(50, 80):
            controller.publish("plant/left/joints", self.message(0.01 * k))
        until(lambda: self.samples(r) == 80, what="the rows of after")
        self.assertEqual(len(self.recordings(r)), 1)
        r.close()
        # The server goes: what has come since waits, the oldest beyond the limit are dropped.
        server.end(signal.SIGKILL)
        for k in range(80, 880):
            controller.publish("plant/left/joints", self.message(0.01 * k))
        until(lambda: "dropped" in bridge.said(), what="the sentence about dropped rows")
        self.serve()
        r = self.connect()
        until(lambda: self.samples(r) == 500, what="the rows that waited")
        self.assertEqual(len(self.recordings(r)), 1)
        q1 = self.values(r, self.recordings(r)[0]["recording"], "q1")
        t = 0.01 * 380  # the newest 500 are there
        self.assertAlmostEqual(q1[0], self.truth(t)[0] + self.fault(t)[0], delta=1e-9)
        # The recording is removed by somebody, and the controller's clock begins anew: other recordings each time.
        r.recording.remove(id=self.recordings(r)[0]["recording"])
        controller.publish("plant/left/joints", self.message(9.0))
        until(lambda: self.samples(r) == 1, what="a row after the recording was removed")
        controller.publish("plant/left/joints", self.message(0.5))
        until(lambda: len(self.recordings(r)) == 2, what="a recording after the clock went back")
        controller.close()
        r.close()
        self.assertIn("300 dropped", bridge.end())

    def test_a_full_recording_is_followed_by_another_and_old_ones_go(self):
        self.serve()
        _, port = self.broker()
        bridge = self.bridge(port, recordings=[self.recording(rows=10, keep=2)])
        r = self.connect()
        controller = Peer(port, "controller")
        for k in range(45):
            controller.publish("plant/left/joints", self.message(0.01 * k))
        until(lambda: sorted(x["samples"] for x in self.recordings(r)) == [5, 10], what="the last two recordings")
        controller.close()
        r.close()
        self.assertIn("45 rows recorded", bridge.end())

    def test_the_world_is_published_and_is_set_only_when_allowed(self):
        self.serve()
        _, port = self.broker()
        tables = dict(publish=[{"topic": "robomosp/left", "world": "cell", "robot": "left", "rate": 50},
                               {"topic": "robomosp/changes", "changes": True}],
                      set=[{"topic": "plant/left/set", "world": "cell", "robot": "left", "field": "/q", "count": 2},
                           {"topic": "plant/speed", "world": "cell", "parameter": "speed"}],
                      broker={"status_topic": "robomosp/status"})
        bridge = self.bridge(port, **json.loads(json.dumps(tables)))
        r = self.connect()
        ear = Peer(port, "ear")
        ear.subscribe("robomosp/#")
        for _ in range(2):  # then it listens for changes, too
            ear.wait_for(lambda topic, body: topic == "robomosp/left")
            ear.heard.clear()
        r.world.set_robot_q(id="cell", robot="left", q=[0.25, -0.5])
        ear.wait_for(lambda topic, body: topic == "robomosp/left" and json.loads(body)["q"] == [0.25, -0.5])
        change = ear.wait_for(lambda topic, body: topic == "robomosp/changes")
        self.assertIn("set_robot_q", json.loads(change[1])["label"])
        ear.wait_for(lambda topic, body: topic == "robomosp/status" and json.loads(body)["online"])
        mouth = Peer(port, "mouth")
        mouth.publish("plant/left/set", json.dumps({"q": [1, 1]}))
        mouth.publish("plant/speed", json.dumps({"value": 7}))
        time.sleep(0.5)  # nothing is to come of it
        self.assertEqual([float(q) for q in r.world.robots(id="cell")[0]["q"]], [0.25, -0.5])
        bridge.end()
        self.assertIn("needs --allow-set", bridge.said())
        self.bridge(port, "--allow-set", **tables)
        mouth.publish("plant/left/set", json.dumps({"q": [1, 1, 1]}))
        mouth.publish("plant/left/set", json.dumps({"q": [0.5, 1]}))
        mouth.publish("plant/speed", json.dumps({"value": 7}))
        until(lambda: [float(q) for q in r.world.robots(id="cell")[0]["q"]] == [0.5, 1], what="the joints set")
        until(lambda: r.world.parameters(id="cell")["speed"]["value"] == 7,
              what="the parameter set")
        r.close()

    def test_a_broker_that_wants_a_password_gets_it(self):
        self.serve()
        passwords, secret = (os.path.join(self.folder, n) for n in ("passwords", "secret"))
        tool = shutil.which("mosquitto_passwd")
        if not tool:
            self.skipTest("there is no mosquitto_passwd")
        subprocess.run([tool, "-c", "-b", passwords, "ann", "rosebud"], check=True, capture_output=True)
        os.chmod(passwords, 0o644)
        with open(secret, "w") as f:
            f.write("rosebud\n")
        _, port = self.broker(None, "allow_anonymous false", f"password_file {passwords}")
        config = self.config(recordings=[self.recording()],
                             broker={"port": port, "username": "ann", "password_file": secret})
        done = subprocess.run([os.environ["ROBOMOSP_MQTT"], config], capture_output=True, timeout=20)
        self.assertEqual(done.returncode, 1)  # others may read the secret
        self.assertIn(b"chmod 600", done.stderr)
        os.chmod(secret, 0o600)
        self.bridge(port, recordings=[self.recording()], broker={"username": "ann", "password_file": secret})
        stranger = self.child("stranger", os.environ["ROBOMOSP_MQTT"],
                              self.config(recordings=[self.recording()], broker={"port": port}))
        until(lambda: "rejected the connection" in stranger.said(), what="the refusal")

    def test_a_broker_with_tls_is_trusted_by_its_certificate(self):
        self.serve()
        if not shutil.which("openssl"):
            self.skipTest("there is no openssl")
        key, certificate, other = (os.path.join(self.folder, n) for n in ("key.pem", "certificate.pem", "other.pem"))
        for made in (other, certificate):
            subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
                            "/CN=localhost", "-keyout", key, "-out", made], check=True, capture_output=True)
        os.chmod(key, 0o644)
        _, port = self.broker(None, "allow_anonymous true", f"certfile {certificate}", f"keyfile {key}")
        stranger = self.child("stranger", os.environ["ROBOMOSP_MQTT"], self.config(
            recordings=[self.recording()], broker={"host": "localhost", "port": port, "ca_file": other}))
        until(lambda: "cannot be reached" in stranger.said(), what="the refusal")
        self.assertNotIn("Connected to the broker", stranger.said())
        self.bridge(port, recordings=[self.recording()], broker={"host": "localhost", "ca_file": certificate})

    def test_faults_of_the_configuration_are_one_sentence(self):
        program = os.environ["ROBOMOSP_MQTT"]
        fine = {"recordings": [self.recording()]}
        for text, part in (("", "not JSON"), ("[]", "not a table in braces"), ("{}", "requests nothing"),
                           (json.dumps({**fine, "extra": 1}), "extra is unknown"),
                           (json.dumps({**fine, "broker": {"port": 0}}), "broker.port is"),
                           (json.dumps({**fine, "broker": {"port": "x"}}), "is no number"),
                           (json.dumps({**fine, "broker": {"key_file": "k"}}), "ca_file is missing"),
                           (json.dumps({**fine, "robomosp": {"queue": 0}}), "robomosp.queue is"),
                           (json.dumps({"recordings": [{"topic": "t"}]}), "recordings[1].title is missing"),
                           (json.dumps({"recordings": [self.recording(columns=[])]}), "columns is missing"),
                           (json.dumps({"recordings": [self.recording(columns=[{"column": "q", "field": "q"}])]}),
                            "not a JSON pointer"),
                           (json.dumps({"recordings": [self.recording(time={"field": "/t", "unit": "h"})]}), "not one of s, ms"),
                           (json.dumps({"recordings": [self.recording(
                               columns=[{"column": "q", "field": "/q", "count": 2, "sign": [1, 2]}])]}), "neither 1 nor -1"),
                           (json.dumps({"publish": [{"topic": "a/#", "changes": True}]}), "not a topic"),
                           (json.dumps({"set": [{"topic": "a", "world": "w"}]}), "needs one of robot")):
            said = self.refusal(program, text)
            self.assertIn(part, said)
            self.assertEqual(said.count("\n"), 1, said)


class Rtde(BridgeTest):
    VARIABLES = {"timestamp": "DOUBLE", "actual_q": "VECTOR6D", "actual_qd": "VECTOR6D", "actual_current": "VECTOR6D",
                 "target_q": "VECTOR6D", "robot_mode": "INT32"}

    @staticmethod
    def state(k, step=0.002):
        t = 100 + k * step
        target = [0.1 * (j + 1) * math.sin(3 * t) for j in range(6)]
        return {"timestamp": t, "actual_q": [v + 0.001 * (j + 1) for j, v in enumerate(target)],
                "actual_qd": [0.3 * (j + 1) * math.cos(3 * t) for j in range(6)],
                "actual_current": [0.5 + j for j in range(6)], "target_q": target, "robot_mode": -7}

    def bridge(self, controller, recording=None, **tables):
        tables.setdefault("controller", {}).update(host="127.0.0.1", port=controller.port, frequency=500)
        return self.child("rtde", os.environ["ROBOMOSP_RTDE"],
                          self.config(recording=recording or {"title": "measured", "robot": "six"}, **tables))

    def test_states_at_500_hz_become_rows(self):
        self.serve()
        count = 1000
        controller = Controller(self.VARIABLES, lambda k: self.state(k) if k < count else None, rate=500)
        self.addCleanup(controller.close)
        bridge = self.bridge(controller)
        r = self.connect()
        until(lambda: self.samples(r) == count, 30, "the last row")
        self.assertEqual(controller.requested, ["timestamp", "actual_q", "actual_qd", "actual_current", "target_q"])
        self.assertEqual(controller.frequency, 500)
        h = self.recordings(r)[0]["recording"]
        self.assertEqual([c["name"] for c in r.recording.columns(id=h)][:8],
                         ["time", "q1", "q2", "q3", "q4", "q5", "q6", "qd1"])
        for column, of in (("q3", lambda s: s["actual_q"][2]), ("qd6", lambda s: s["actual_qd"][5]),
                           ("current2", lambda s: s["actual_current"][1]), ("target_q4", lambda s: s["target_q"][3]),
                           ("time", lambda s: s["timestamp"] - 100)):
            for k, v in enumerate(self.values(r, h, column)):
                self.assertAlmostEqual(v, of(self.state(k)), delta=1e-12)
        # The joints are those of a robot that is there, so that the model has something to say of them.
        self.assertIn("tau1", r.recording.compute(id=r.recording.part(id=h), quantities="torque"))
        r.close()
        out = bridge.end()
        self.assertEqual(bridge.code, 0)
        self.assertIn("1000 rows recorded, 0 states refused", out)
        self.assertIn("version 5.11.1 (108318)", bridge.said())
        self.assertIn("Message of the controller: a message between", bridge.said())

    def test_a_connection_that_breaks_in_a_package_goes_on_where_it_was(self):
        self.serve()
        controller = Controller(self.VARIABLES, lambda k: self.state(k) if k < 60 else None, cut=30)
        self.addCleanup(controller.close)
        bridge = self.bridge(controller)
        r = self.connect()
        until(lambda: self.samples(r) == 59, what="all rows but the one that was cut")
        self.assertEqual(controller.sessions, 2)
        self.assertEqual(len(self.recordings(r)), 1)
        r.close()
        bridge.end()
        self.assertIn("was lost: it closed the connection", bridge.said())

    def test_numbers_that_are_none_and_clocks_that_begin_anew(self):
        def state(k):
            s = self.state(k if k < 20 else k - 20)
            if k >= 20:
                s["timestamp"] -= 50
            if k in (5, 6):
                s["actual_q"][k - 5] = math.nan if k == 5 else math.inf
            return s if k < 40 else None
        self.serve()
        controller = Controller(self.VARIABLES, state)
        self.addCleanup(controller.close)
        bridge = self.bridge(controller)
        r = self.connect()
        until(lambda: sorted(x["samples"] for x in self.recordings(r)) == [18, 20], what="two recordings")
        r.close()
        self.assertIn("38 rows recorded, 2 states refused", bridge.end())

    def test_other_columns_and_types(self):
        self.serve()
        controller = Controller(self.VARIABLES, lambda k: self.state(k) if k < 5 else None)
        self.addCleanup(controller.close)
        bridge = self.bridge(controller, {"title": "measured", "columns": [
            {"variable": "robot_mode", "column": "mode", "count": 1},
            {"variable": "actual_q", "column": "q", "unit": "rad"}]})
        r = self.connect()
        until(lambda: self.samples(r) == 5, what="the rows")
        self.assertEqual(self.values(r, self.recordings(r)[0]["recording"], "mode"), [-7] * 5)
        r.close()
        bridge.end()

    def test_controllers_that_answer_otherwise_are_said_in_a_sentence(self):
        self.serve()
        less = {k: v for k, v in self.VARIABLES.items() if k != "actual_current"}
        three = {**self.VARIABLES, "actual_q": "VECTOR3D"}
        odd = {**self.VARIABLES, "actual_q": "MATRIX"}
        for controller, part in ((Controller(self.VARIABLES, self.state, version_ok=False), "does not speak version 2"),
                                 (Controller(less, self.state), 'it has no variable "actual_current"'),
                                 (Controller(three, self.state), '"actual_q" has 3 entries, not 6'),
                                 (Controller(odd, self.state), 'the type of "actual_q" is unknown'),
                                 (Controller({}, self.state, garbage=b"HTTP/1.1 400 Bad Request\r\n\r\n"), "The controller at 127"),
                                 (Controller({}, self.state, garbage=b"\0\0\0\0\0"), "it does not speak RTDE")):
            bridge = self.bridge(controller)
            until(lambda: part in bridge.said(), what=part)
            bridge.end()
            self.assertEqual(bridge.code, 0)
            controller.close()
        with socket.socket() as silent:  # nobody listens there
            silent.bind(("127.0.0.1", 0))
            nobody = type("Nobody", (), {"port": silent.getsockname()[1]})
            bridge = self.bridge(nobody)
            until(lambda: "cannot be reached" in bridge.said(), what="the sentence")
            bridge.end()

    def test_faults_of_the_configuration_are_one_sentence(self):
        program = os.environ["ROBOMOSP_RTDE"]
        fine = {"controller": {"host": "h"}, "recording": {"title": "t"}}
        for text, part in (("{", "not JSON"), ("{}", "recording is missing"),
                           (json.dumps({"recording": {"title": "t"}}), "controller is missing"),
                           (json.dumps({**fine, "controller": {"host": "h", "frequency": 1000}}), "frequency is 1000"),
                           (json.dumps({**fine, "recording": {"title": "t", "world": "w"}}), "recording.robot is missing"),
                           (json.dumps({**fine, "mqtt": {}}), "mqtt is unknown")):
            said = self.refusal(program, text)
            self.assertIn(part, said)
            self.assertEqual(said.count("\n"), 1, said)


class Page(unittest.TestCase):
    def test_its_configurations_are_read(self):
        page = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../docs/user/remote/bridges.md")
        with open(page, encoding="utf-8") as f:
            parts = f.read().split("```json\n")[1:]
        self.assertEqual(len(parts), 2)
        for part in parts:
            text = part.split("```")[0]
            program = os.environ.get("ROBOMOSP_MQTT" if "broker" in text else "ROBOMOSP_RTDE")
            if not program:
                continue
            with tempfile.NamedTemporaryFile("w", suffix=".json") as f:
                f.write(text)
                f.flush()
                done = subprocess.run([program, "--check", f.name], capture_output=True, timeout=20)
            self.assertEqual(done.returncode, 0, done.stderr.decode())


if __name__ == "__main__":
    unittest.main(verbosity=2)
