# SPDX-License-Identifier: Apache-2.0
"""The page of `robomosp serve --browser` in a real headless browser. ROBOMOSP_PICTURES=FOLDER keeps what it shows."""
import http.server
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "sdk", "clients", "python")]
import robomosp  # noqa: E402
from devtools import Browser, WebSocket, find_browser, pixels  # noqa: E402

PROGRAM = os.environ.get("ROBOMOSP_PROGRAM", "robomosp")
CELL = """
cell = world.load("worlds/pa10_circle.wld")
run = cell:inverse_dynamics{robot = "pa10", trajectory = "circle"}
"""


class Server:
    def __init__(self, folder, port=0, script=CELL, more=()):
        self.tokens = os.path.join(folder, "tokens")
        file = os.path.join(folder, "cell.lua")
        with open(file, "w") as out:
            out.write(script)
        self.process = subprocess.Popen(
            [PROGRAM, "serve", "--listen", f"127.0.0.1:{port}", "--browser", "--token-file", self.tokens, "--allow",
             "reads,edits,simulates,files_read", *more, file], stdout=subprocess.PIPE, text=True)
        said = self.process.stdout.readline()
        self.port = int(re.search(r"127\.0\.0\.1:(\d+)", said)[1])
        self.url = re.search(r"http://\S+", self.process.stdout.readline())[0]

    def grant(self, name, effects):
        words = ", ".join(f'"{e}"' for e in effects)
        return subprocess.run([PROGRAM, "eval", f'return server.grant{{name = "{name}", effects = {{{words}}}, '
                               f'token_file = "{self.tokens}"}}'], check=True, capture_output=True,
                              text=True).stdout.strip()

    def connect(self):
        return robomosp.connect(f"127.0.0.1:{self.port}", numpy=False)

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.process.stdout.close()


def scene_box(page):
    return page.run("(() => { const b = document.getElementById('scene').getBoundingClientRect();"
                    "return {x: b.x, y: b.y, width: b.width, height: b.height}; })()")


def difference(a, b):
    """The share of the picture elements that differ visibly."""
    width, height, rows, step = pixels(a)
    _, _, others, _ = pixels(b)
    count = 0
    for row, other in zip(rows, others):
        if row != other:
            count += sum(abs(x - y) > 12 for x, y in zip(row[::step], other[::step]))
    return count / (width * height)


def shown(page):
    """The scene, when it stands still."""
    page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return page.picture(clip=scene_box(page))


def keep(page, name):
    folder = os.environ.get("ROBOMOSP_PICTURES")
    if folder:
        page.picture(os.path.join(folder, name + ".png"))


def text(page, name):
    return page.run(f"document.getElementById('{name}').textContent")


def is_hidden(page, name):
    return page.run(f"document.getElementById('{name}').hidden")


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="robomosp-page-")
        cls.server = Server(cls.folder)
        # Small, as the processor draws it.
        cls.browser = Browser((1100, 1000) if os.environ.get("ROBOMOSP_PICTURES") else (720, 560))

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.server.stop()
        shutil.rmtree(cls.folder, ignore_errors=True)

    def setUp(self):
        self.begin = time.monotonic()
        self.addCleanup(lambda: print(f"{self._testMethodName}: {time.monotonic() - self.begin:.1f} s"))

    def open(self, more="", **options):
        page = self.browser.open(self.server.url + more, **options)
        self.addCleanup(page.close)
        page.wait("document.body.dataset.first")
        return page

    def test_1_the_world_appears_and_moves_when_somebody_else_moves_it(self):
        page = self.open()
        first = int(page.run("document.body.dataset.first"))
        print(f"\nfirst picture after {first} ms")
        self.assertLess(first, 5000)  # 1000 on a machine of its own
        keep(page, "browser_world")
        before = shown(page)
        width, height, rows, step = pixels(before)
        colours = {bytes(row[i:i + 3]) for row in rows[::4] for i in range(0, len(row), 4 * step)}
        self.assertGreater(len(colours), 300)
        self.assertIn("read only", text(page, "status"))
        self.assertTrue(is_hidden(page, "console"))
        self.assertTrue(is_hidden(page, "fault"), text(page, "fault"))
        # By itself nothing is fetched anew.
        updates = page.run("document.body.dataset.updates")
        with self.server.connect() as r:
            cell = r.world.list()[0]
            q = [x + 0.5 for x in r.robot.joint_values("pa10")]
            begin = time.monotonic()
            cell.set_robot_q(robot="pa10", q=q)
            page.wait(f"document.body.dataset.updates !== '{updates}'")
            print(f"{1000 * (time.monotonic() - begin):.0f} ms from the edit to the page, the look at it included")
            moved = shown(page)
            self.assertGreater(difference(before, moved), 0.01)
            r.document.undo()
            page.wait(f"Number(document.body.dataset.updates) >= {int(updates) + 2}")
            self.assertLess(difference(before, shown(page)), 0.001)
            # What is said appears; a new world can be chosen.
            r.world.create(name="another")
            page.wait("[...document.getElementById('world').options].some((o) => o.text === 'another')")
            page.run("(() => { const w = document.getElementById('world'); w.selectedIndex = [...w.options].findIndex("
                     "(o) => o.text === 'another'); w.dispatchEvent(new Event('change')); })()")
            page.wait("!document.getElementById('hint').hidden")
            self.assertIn("empty", text(page, "hint"))
            r.document.undo()
            page.wait("document.getElementById('world').selectedOptions[0].text === 'pa10_circle'")
            page.wait("document.getElementById('hint').hidden")
        self.assertEqual(page.requests(), [])
        self.assertEqual(page.faults(), [])

    def test_2_recordings_play_with_their_plots(self):
        page = self.open()
        page.run("(() => { const s = document.getElementById('shown'); s.selectedIndex = 1;"
                 "s.dispatchEvent(new Event('change')); })()")
        page.wait("!document.getElementById('player').hidden && document.querySelectorAll('figure').length === 2")
        page.wait("Number(document.getElementById('time').value) > 0")
        page.run("document.activeElement.blur()")
        for key, code in ((" ", 32), ("End", 35)):
            page.ask("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code)
        page.wait("document.getElementById('play').getAttribute('aria-label') === 'play'")
        page.wait("/^62.83 /.test(document.getElementById('now').textContent)")
        page.run("(() => { const t = document.getElementById('time'); t.value = t.max / 3;"
                 "t.dispatchEvent(new Event('input')); })()")
        page.wait("/^20.9/.test(document.getElementById('now').textContent)")
        # Both plots are seen whole on a screen of 1080 lines.
        page.ask("Emulation.setDeviceMetricsOverride", width=1100, height=1000, deviceScaleFactor=1, mobile=False)
        page.wait("(() => { const p = document.getElementById('plots');"
                  " return p.scrollHeight <= p.clientHeight + 1; })()")
        page.ask("Emulation.clearDeviceMetricsOverride")
        keep(page, "browser_recording")
        page.run("(() => { const s = document.getElementById('shown'); s.value = '';"
                 "s.dispatchEvent(new Event('change')); })()")
        page.wait("document.getElementById('player').hidden && document.querySelectorAll('figure').length === 0")
        self.assertEqual(page.faults(), [])

    def test_2b_recordings_come_grow_and_go_without_being_asked_for(self):
        page = self.open()
        titles = "[...document.getElementById('shown').options].map((o) => o.text)"
        with self.server.connect() as r:
            def rows(first, last):
                return [{"name": "time", "unit": "s", "values": [0.1 * i for i in range(first, last)]},
                        {"name": "q", "unit": "rad", "values": [[0.01 * i] * 7 for i in range(first, last)]}]
            cell = r.world.list()[0]
            begin = time.monotonic()
            made = r.recording.create(title="measured", world=cell, robot="pa10", columns=rows(0, 11))
            page.wait(f"{titles}.includes('measured')")
            page.run("document.getElementById('loop').checked = false")
            self.assertLess(time.monotonic() - begin, 2.5)  # 0.4 s, unless the machine is busy
            page.run("(() => { const s = document.getElementById('shown');"
                     f"s.selectedIndex = {titles}.indexOf('measured'); s.dispatchEvent(new Event('change')); }})()")
            page.wait("/ 1[.]0+ s$/.test(document.getElementById('now').textContent)")
            page.wait("document.getElementById('play').getAttribute('aria-label') === 'play'")  # at its end
            for first in range(11, 51, 10):
                made.append(columns=rows(first, first + 10))
            # It grows, stands at its end, and the view stays.
            page.wait("/^5[.]0+ [/] 5[.]0+ s$/.test(document.getElementById('now').textContent)")
            self.assertGreater(page.run("document.querySelectorAll('figure').length"), 0)
            keep(page, "browser_growing")
            made.remove()
            page.wait(f"!{titles}.includes('measured')")
            page.wait("document.getElementById('player').hidden")
        self.assertEqual(page.faults(), [])

    def test_3_a_token_opens_the_console_and_a_wrong_one_is_a_sentence(self):
        page = self.open()
        page.run("document.getElementById('enter').click()")
        self.assertEqual(page.run("document.activeElement.id"), "token")
        page.ask("Input.insertText", text="rmp_wrong")
        page.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", windowsVirtualKeyCode=13, text="\r")
        page.wait("!document.getElementById('fault').hidden")
        self.assertIn("token", text(page, "fault"))
        self.assertIn("read only", text(page, "status"))  # as before
        self.assertTrue(is_hidden(page, "console"))
        token = self.server.grant("student", ["reads", "edits", "simulates"])
        page.run("document.getElementById('token').focus()")
        page.ask("Input.insertText", text=token)
        page.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", windowsVirtualKeyCode=13, text="\r")
        page.wait("!document.getElementById('console').hidden && document.getElementById('login').hidden")
        self.assertIn("student, may edit", text(page, "status"))
        self.assertTrue(is_hidden(page, "fault"))
        page.wait("document.getElementById('world').value !== ''")
        before = shown(page)

        def type_in(code, seen):
            page.run("document.getElementById('code').focus()")
            page.ask("Input.insertText", text=code)
            page.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", windowsVirtualKeyCode=13, text="\r")
            page.wait(f"document.getElementById('output').textContent.includes({seen!r})")
        type_in("print(6 * 7)", "42")
        type_in("world.list()[1]:set_robot_q{robot = 'pa10', q = {0.8, 0.5, 0, 1, 0, 0.5, 0}} return 'moved'", "moved")
        type_in("<img src=x>", "unexpected symbol")
        self.assertEqual(page.run("document.images.length"), 0)
        type_in("os.execute('true')", "os.execute")
        self.assertGreater(difference(before, shown(page)), 0.01)
        page.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowUp", windowsVirtualKeyCode=38)
        self.assertEqual(page.run("document.getElementById('code').value"), "os.execute('true')")
        self.assertEqual(page.faults(), [])
        # In the address it works, too, and is taken out of it.
        dark = self.open("#token=" + token, dark=True)
        dark.wait("!document.getElementById('console').hidden")
        self.assertEqual(dark.run("location.href"), self.server.url)
        ground = dark.run("getComputedStyle(document.body).backgroundColor")
        self.assertLess(max(int(x) for x in re.findall(r"\d+", ground)[:3]), 80)
        dark.run("document.getElementById('code').focus()")
        dark.ask("Input.insertText", text="robot.get('pa10'):joint_values()")
        dark.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", windowsVirtualKeyCode=13, text="\r")
        dark.wait("document.getElementById('output').children.length > 1")
        keep(dark, "browser_console")

    def test_4_keys_turn_the_view(self):
        page = self.open()
        before = shown(page)
        page.run("document.getElementById('scene').focus()")
        for _ in range(3):
            page.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft", windowsVirtualKeyCode=37)
        turned = shown(page)
        self.assertGreater(difference(before, turned), 0.02)
        page.ask("Input.dispatchKeyEvent", type="keyDown", key="Home", windowsVirtualKeyCode=36)
        self.assertLess(difference(before, shown(page)), 0.001)
        # Everything that acts can be reached by the Tab key, and has a name.
        nameless = page.run(
            "[...document.querySelectorAll('button, input, select')].filter((e) => !e.labels?.length &&"
            "!e.getAttribute('aria-label') && !e.textContent.trim()).map((e) => e.id)")
        self.assertEqual(nameless, [])

    def test_5_pages_from_elsewhere_are_refused(self):
        class Quiet(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.end_headers()
                self.wfile.write(b"<title>elsewhere</title>")

            def log_message(self, *_):
                pass
        elsewhere = http.server.HTTPServer(("127.0.0.1", 0), Quiet)
        threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
        self.addCleanup(elsewhere.server_close)
        self.addCleanup(elsewhere.shutdown)
        page = self.browser.open(f"http://127.0.0.1:{elsewhere.server_port}/")
        self.addCleanup(page.close)
        page.wait("document.title === 'elsewhere'")
        address = f"127.0.0.1:{self.server.port}"
        outcome = page.run(f"new Promise((done) => {{ const s = new WebSocket('ws://{address}/socket');"
                           "s.onopen = () => done('open'); s.onerror = () => done('refused'); })")
        self.assertEqual(outcome, "refused")
        for code in (f"fetch('http://{address}/')", f"fetch('http://{address}/', {{method: 'POST', body: '{{}}'}})",
                     f"import('http://{address}/robomosp.js')"):
            self.assertEqual(page.run(f"{code}.then(() => 'there', () => 'refused')"), "refused", code)
        frame = page.run(f"new Promise((done) => {{ const f = document.createElement('iframe'); f.src = 'http://{address}/';"
                         "f.onload = () => { try { done(f.contentDocument ? 'own' : 'not shown'); } catch (e) "
                         "{ done('not shown'); } }; document.body.append(f); })")
        self.assertEqual(frame, "not shown")
        for origin in ("http://evil.example", "null", f"http://localhost:{self.server.port}"):
            socket = WebSocket("127.0.0.1", self.server.port, origin=origin)
            self.assertEqual(socket.status, 403, origin)
            socket.close()

    def test_7_a_page_of_ones_own_uses_the_client(self):
        client = os.path.join(HERE, "..", "..", "sdk", "clients", "javascript", "robomosp.js")
        with open(client, "rb") as file:
            texts = {"/robomosp.js": ("text/javascript", file.read())}

        class Own(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                kind, content = texts.get(self.path, ("text/html", b"<title>own</title><img>"))
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, *_):
                pass
        own = http.server.HTTPServer(("127.0.0.1", 0), Own)
        threading.Thread(target=own.serve_forever, daemon=True).start()
        self.addCleanup(own.server_close)
        self.addCleanup(own.shutdown)
        folder = os.path.join(self.folder, "ones_own")
        os.makedirs(folder)
        origin = f"http://127.0.0.1:{own.server_port}"
        server = Server(folder, script="", more=["--origin", origin])
        self.addCleanup(server.stop)
        token = server.grant("student", ["reads", "edits", "simulates", "files_read"])
        page = self.browser.open(origin + "/")
        self.addCleanup(page.close)
        page.wait("document.title === 'own'")
        said = page.run(f"""(async () => {{
            const {{connect}} = await import('/robomosp.js');
            const r = await connect('ws://127.0.0.1:{server.port}/socket', {{token: '{token}'}});
            const arm = await r.robot.get('pa10');
            const found = await arm.solve_ik({{target: [0.557, 0, 0.374, '180 deg', 0, '180 deg']}});
            const cell = await r.world.create({{name: 'student'}});
            await cell.add_robot({{robot: arm}});
            await cell.set_robot_q({{robot: 'pa10', q: found.q}});
            const at = (await arm.fk({{q: await arm.joint_values()}})).position;
            let picture = 'no renderer';
            try {{
              document.images[0].src = (await cell.picture({{size: [64, 48], quality: 'draft'}})).url;
              await document.images[0].decode();
              picture = document.images[0].naturalWidth;
            }} catch (fault) {{
              if (!/no renderer/.test(fault.message)) throw fault;
            }}
            await r.close();
            return [...at, picture];
        }})()""")
        for have, want in zip(said, (0.557, 0, 0.374)):
            self.assertAlmostEqual(have, want, delta=1e-9)
        self.assertIn(said[3], (64, "no renderer"))

    def test_6_a_lost_server_is_told_and_found_again(self):
        folder = os.path.join(self.folder, "own")
        os.makedirs(folder)
        script = "solid.create{name = 'b', root = {kind = 'box', x = 1, y = 1, z = 1}}\n" \
                 "world.create{name = 'w'}:add_object{name = 'b', what = 'b'}\n"
        server = Server(folder, script=script)
        self.addCleanup(server.stop)
        page = self.browser.open(server.url)
        self.addCleanup(page.close)
        page.wait("document.body.dataset.first")
        # A run that plays is followed, and what it shows when it stands still.
        with server.connect() as r:
            r.material.create(name="steel", density=7800)
            r.solid.set(id="b", path="material", value="steel")
            before = shown(page)
            run = r.world.list()[0].start_run(of="physics", **{"with": {"duration": 5}})
            run.play(speed=0.5)
            page.wait("Number(document.body.dataset.updates) >= 8")
            run.pause()
            self.assertGreater(difference(before, shown(page)), 0.01)
            run.remove()
        server.stop()
        page.wait("!document.getElementById('fault').hidden")
        self.assertIn("The server ends.", text(page, "fault"))
        again = Server(folder, port=server.port, script=script)
        self.addCleanup(again.stop)
        page.wait("document.getElementById('fault').hidden && document.getElementById('status').textContent === 'read only'")
        page.wait("document.getElementById('world').selectedOptions[0].text === 'w'")
        self.assertEqual(page.faults(), [])


def too_late(*_):
    raise TimeoutError("the test took too long")


if __name__ == "__main__":
    signal.signal(signal.SIGALRM, too_late)
    signal.alarm(240)
    if not find_browser():
        print("no Chromium is installed (packages.txt)")
        sys.exit(77)
    unittest.main()
