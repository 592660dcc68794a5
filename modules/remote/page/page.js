// SPDX-License-Identifier: Apache-2.0
// The page of the server: the world as it is, drawn by the scripts of replays and followed by
// events; recordings with their plots; messages; a console for who may.
'use strict';

const kMostLines = 500;  // of messages and output that stay
const kSoon = 200;       // ms until lists are asked for again, after something happened
const kGrow = 1000;  // ms, least time between two looks at a recording that grows
const kStates = 30;      // of a run that plays, a second
const kAgain = [500, 1000, 2000, 5000];  // ms until a lost connection is tried again

const byId = (id) => document.getElementById(id);

function say(log, text, kind = '') {
  const line = document.createElement('p');
  line.textContent = text;
  line.className = kind;
  const isAtEnd = log.scrollTop + log.clientHeight >= log.scrollHeight - 4;
  log.append(line);
  while (log.children.length > kMostLines) log.firstChild.remove();
  if (isAtEnd) log.scrollTop = log.scrollHeight;
}

/// A value as the console shows it.
function valueText(v) {
  if (typeof v === 'string') return v;
  return JSON.stringify(v, (_, x) => x instanceof Handle ? String(x) :
    x instanceof Matrix ? x.toRows() : ArrayBuffer.isView(x) ? Array.from(x) : x);
}

/// What is drawn: the scene as it is now, or a recording's.
class Stage {
  constructor() {
    this.canvas = byId('scene');
    this.header = null;
    this.data = null;
    this.renderer = null;
    this.camera = null;
    this.isTouched = false;  // by the user: then the view stays where it is
    this.isAsked = false;
    this.draw = () => {};
    const ask = () => this.ask();
    for (const event of ['pointerdown', 'wheel', 'keydown'])
      this.canvas.addEventListener(event, () => { this.isTouched = true; });
    this.canvas.addEventListener('dblclick', () => { this.isTouched = false; });
    this.canvas.addEventListener('webglcontextrestored', ask);
    this.canvas.addEventListener('keydown', (event) => {
      if (this.camera && this.key(event)) {
        event.preventDefault();
        event.stopPropagation();
        ask();
      }
    });
    attachViewControls(byId, () => this.camera, () => this.renderer, ask);
    new ResizeObserver(() => {
      fitCanvas(this.canvas);
      ask();
    }).observe(this.canvas);
  }
  key({key, shiftKey}) {
    const ways = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
    const way = ways[key];
    if (way && shiftKey) this.camera.pan(0.05 * way[0], 0.05 * way[1]);
    else if (way) this.camera.turn(0.1 * way[0], 0.1 * way[1]);
    else if (key === '+' || key === '=') this.camera.zoom(0.9);
    else if (key === '-') this.camera.zoom(1 / 0.9);
    else if (key === 'Home') this.camera.reset();
    else return false;
    return true;
  }
  ask() {
    if (!this.isAsked) requestAnimationFrame(() => {
      this.isAsked = false;
      this.draw();
    });
    this.isAsked = true;
  }
  /// A scene in the place of the one before; `isNew`: looked at from where it wants to be.
  show(header, data, isNew) {
    const box = boxOfReplay(header, data);
    this.header = header;
    this.data = data;
    if (!this.camera) {
      this.camera = new OrbitCamera(header.camera, box);
      this.camera.attach(this.canvas, () => this.ask());
    } else if (isNew || !this.isTouched) {
      Object.assign(this.camera, {box, radius: Math.max(1e-6, 0.5 * Math.hypot(...sub(box[1], box[0])))});
      this.camera.reset();
    }
    if (isNew) this.isTouched = false;
    byId('lens').checked = !this.camera.perspective;
    if (this.renderer) this.renderer.show(header, data, box);
    else {
      fitCanvas(this.canvas);
      this.renderer = new Renderer(this.canvas, header, data, box);
    }
    this.ask();
  }
  drawAt(frame) {
    if (!this.renderer) return;
    this.renderer.draw(this.camera, frame);
    nameFrames(byId('names'), this.renderer.labels(frame));
    if (!document.body.dataset.first) document.body.dataset.first = performance.now().toFixed(0);
  }
}

class Page {
  constructor() {
    this.stage = new Stage();
    this.r = null;
    this.token = null;
    this.world = null;
    this.player = null;
    this.worlds = new Map();
    this.recordings = new Map();
    this.run = null;         // a live run that is shown
    this.shape = null;       // of the scene that is shown
    this.meshes = new Map(); // by key: those of that scene
    this.isFollowing = false;
    this.isBehind = false;
    this.soon = null;
    this.tries = 0;
    this.history = [];
    this.at = 0;
    byId('world').addEventListener('change', (event) => this.choose(event.target.value));
    byId('shown').addEventListener('change', (event) => this.play(event.target.value));
    byId('enter').addEventListener('click', () => this.askForToken());
    byId('login').addEventListener('submit', (event) => {
      event.preventDefault();
      this.connect(byId('token').value.trim());
    });
    byId('prompt').addEventListener('submit', (event) => {
      event.preventDefault();
      this.evaluate(byId('code').value);
    });
    byId('code').addEventListener('keydown', (event) => this.recall(event));
    window.addEventListener('keydown', (event) => {
      if (!this.player || /^(SELECT|INPUT|BUTTON)$/.test(event.target.tagName)) return;
      if (this.player.key(event.key)) event.preventDefault();
    });
    // A token behind # goes to no server and no log; it is taken out of the address.
    const given = /[#&]token=([\w.-]+)/.exec(location.hash);
    if (given) history.replaceState(null, '', location.pathname);
    this.connect(given ? given[1] : null);
  }

  told(sentence) {
    byId('fault').textContent = sentence;
    byId('fault').hidden = !sentence;
  }
  askForToken(sentence = '') {
    byId('login').hidden = false;
    byId('token').value = '';
    byId('token').focus();
    if (sentence) this.told(sentence);
  }

  /// The connection that is there stays until the new one stands.
  async connect(token) {
    const before = this.r;
    if (!before) byId('status').textContent = 'connecting';
    try {
      const r = await connect(undefined, {token: token || null, client: 'browser', timeout: 120});
      this.r = r;
      this.token = token || null;
      if (before) before.close().catch(() => {});
      r.onClose = (why) => { if (this.r === r) this.lost(why); };
      await this.begin();
    } catch (fault) {
      // Nothing changes by trying again what was answered.
      if (!(fault instanceof ConnectionLost)) this.askForToken(fault.message.replace(/^wss?:\S+: /, ''));
      else if (!this.r) this.lost(fault);
      if (!this.r) this.enable(null);
    }
  }
  lost(why) {
    this.r = null;
    this.enable(null);
    this.told(`${why.message} Trying again.`);
    setTimeout(() => {
      if (!this.r) this.connect(this.token);
    }, kAgain[Math.min(this.tries++, kAgain.length - 1)]);
  }
  /// What the connection may do shows.
  enable(hello) {
    const effects = hello ? hello.effects : [];
    byId('console').hidden = !(hello && hello.scripts);
    byId('status').textContent = !hello ? 'not connected' :
      (hello.token ? `token ${hello.token}, ` : '') +
      (effects.includes('edits') ? 'may edit' : 'read only');
    byId('enter').textContent = hello && hello.token ? 'Other token' : 'Token';
  }

  async begin() {
    const {r} = this;
    this.tries = 0;
    this.enable(r.hello);
    byId('login').hidden = true;
    this.told('');
    // Handles are those of a connection.
    this.shape = this.run = null;
    this.worlds = new Map();
    await r.onEvent((event) => this.happened(event), [], {rate: kStates});
    await this.look();
  }
  happened(event) {
    if (event.topic === 'message') {
      if (event.left_out) say(byId('messages'), `${event.left_out} messages were left out.`);
      say(byId('messages'), event.text, event.severity === 'error' ? 'error' : '');
    } else if (event.topic === 'change') {
      this.run = null;
      this.follow();
    } else if (event.topic === 'run') {
      this.run = event.id;
      this.follow();
      return;  // states come often, and no list changes with them
    } else if (event.topic === 'recording' && ['appended', 'replaced'].includes(event.kind)) {
      if (this.player && this.player.number === String(event.id.number)) this.growSoon();
      if (event.kind === 'appended') return;
    }
    if (event.topic !== 'message') this.lookSoon();
  }

  // lists

  lookSoon() {
    if (!this.soon) this.soon = setTimeout(() => {
      this.soon = null;
      if (this.r) this.look().catch((fault) => this.failed(fault));
    }, kSoon);
  }
  failed(fault) {
    if (!(fault instanceof ConnectionLost)) this.told(fault.message);
  }
  async look() {
    const [worlds, recordings] = await this.r.batch([['world.list'], ['recording.list']]);
    for (const answer of [worlds, recordings]) if (answer instanceof Error) throw answer;
    this.worlds = new Map(worlds.map((w) => [String(w.number), w]));
    this.recordings = new Map(recordings.map((entry) => [String(entry.recording.number), entry]));
    this.list(byId('world'), worlds.map((w) => [String(w.number), w.name]),
      worlds.length ? null : 'none');
    this.list(byId('shown'), recordings.map(
      ({recording, title, stale}) => [String(recording.number), title + (stale ? ' (stale)' : '')]), 'now');
    const wanted = this.world && this.worlds.has(this.world) ? this.world :
      worlds.length ? String(worlds[worlds.length - 1].number) : null;
    if (wanted !== this.world || !worlds.length) this.choose(wanted);
    else if (!this.shape) this.follow();
    byId('world').value = this.world || '';
    if (this.player && !this.recordings.has(this.player.number)) this.play('');
    byId('shown').value = this.player ? this.player.number : '';
  }
  list(select, entries, first) {
    const all = first === null ? entries : [['', first], ...entries];
    const options = [...select.options];
    if (all.length === options.length &&
        all.every(([value, text], i) => options[i].value === value && options[i].text === text)) return;
    select.replaceChildren(...all.map(([value, text]) => new Option(text, value)));
  }

  // the world as it is

  choose(number) {
    this.world = number || null;
    this.shape = null;
    this.run = null;
    this.play('');
    byId('hint').hidden = number !== null;
    byId('hint').textContent = 'No world is open.';
    this.follow();
  }
  /// Fetches what changed; once at a time, and again when something happened meanwhile.
  async follow() {
    this.isBehind = true;
    if (this.isFollowing) return;
    this.isFollowing = true;
    try {
      while (this.isBehind && this.r && !this.player && this.world && this.worlds.has(this.world)) {
        this.isBehind = false;
        const {r, run, world, shape} = this;
        const params = {what: this.worlds.get(world), meshes: [...this.meshes.keys()]};
        if (shape) params.known = shape;
        if (run) params.run = run;
        const [answer] = await r.batch([['view.scene', params]]);
        if (answer instanceof Error) {
          if (!run || answer instanceof ConnectionLost) throw answer;
          if (this.run === run) this.run = null;  // of another world, or over
          this.isBehind = true;
          continue;
        }
        if (this.world === world && this.r === r && !this.player) this.take(answer, !shape);
      }
    } catch (fault) {
      this.failed(fault);
    }
    this.isFollowing = false;
  }
  take(answer, isNew) {
    const {stage} = this;
    const place = (header) => {
      [...header.items, ...header.triads].forEach((thing, i) => {
        thing.pose = Array.from(answer.poses.row(i));
      });
    };
    if (answer.header === undefined) {
      place(stage.header);
      stage.ask();
    } else {
      const header = JSON.parse(answer.header);
      const data = decodeReplay(header, fromBase64(answer.bytes), this.meshes);
      this.meshes = new Map(header.meshes.map((mesh, i) => [mesh.key, data.meshes[i]]));
      place(header);
      this.shape = answer.shape;
      stage.draw = () => stage.drawAt(0);
      stage.show(header, data, isNew);
      byId('hint').hidden = header.items.length > 0;
      byId('hint').textContent = 'This world is empty.';
      for (const sentence of answer.left_out) say(byId('messages'), sentence, 'error');
    }
    // How often something new came; with `first` of Stage for who looks why it is slow, and for tests.
    document.body.dataset.updates = String(Number(document.body.dataset.updates || 0) + 1);
  }

  // recordings

  /// Shows the rows that came since, once at a time.
  growSoon() {
    this.hasGrown = true;
    if (this.growing) return;
    this.growing = setTimeout(async () => {
      this.hasGrown = false;
      if (this.player) await this.play(this.player.number, this.player);
      this.growing = null;
      if (this.hasGrown) this.growSoon();
    }, kGrow);
  }
  /// `before`: the player of the same recording, which goes on where it is; at its end it stays there.
  async play(number, before = null) {
    if (this.player && !before) {
      this.player.remove();
      this.player = null;
      this.shape = null;
    }
    if (!before) byId('player').hidden = byId('plots').hidden = true;
    if (!number) return void this.follow();
    try {
      const {recording} = this.recordings.get(number);
      if (!before) byId('status').textContent = 'loading';
      const answer = await this.r.call('recording.replay_data', {id: recording});
      this.enable(this.r.hello);
      if (byId('shown').value !== number || (before && this.player !== before)) return;
      const header = JSON.parse(answer.header);
      const data = decodeReplay(header, fromBase64(answer.bytes));
      byId('player').hidden = false;
      if (before) {
        before.wasPlaying = before.isPlaying;
        before.remove();
      }
      const {stage} = this;
      const player = new Player(byId, header, data, (frame) => stage.drawAt(frame));
      player.number = number;
      this.player = player;
      stage.draw = () => player.draw();
      stage.show(header, data, !before);
      if (before) player.time = before.time >= before.end ? player.end : Math.min(before.time, player.end);
      player.resize();
      this.resizes = this.resizes || window.addEventListener('resize', () => {
        if (this.player) this.player.resize();
      }) || true;
      if (!before || before.wasPlaying) player.play(true);
    } catch (fault) {
      this.enable(this.r && this.r.hello);
      if (before) return this.failed(fault);  // what is shown stays
      byId('shown').value = '';
      this.failed(fault);
      this.follow();
    }
  }

  // the console

  recall(event) {
    const step = {ArrowUp: -1, ArrowDown: 1}[event.key];
    if (!step) return;
    event.preventDefault();
    this.at = Math.min(Math.max(this.at + step, 0), this.history.length);
    byId('code').value = this.history[this.at] || '';
  }
  async evaluate(code) {
    if (!code.trim() || !this.r) return;
    const output = byId('output');
    byId('code').value = '';
    this.history.push(code);
    this.at = this.history.length;
    say(output, '> ' + code, 'asked');
    try {
      const done = await this.r.lua(code);
      if (done.output) say(output, done.output.replace(/\n$/, ''));
      const values = done.values || ('value' in done ? [done.value] : []);
      if (values.length) say(output, values.map(valueText).join('\t'));
    } catch (fault) {
      say(output, fault.message, 'error');
    }
    this.lookSoon();
  }
}

try {
  new Page();
} catch (fault) {
  byId('fault').textContent = 'This page cannot be shown: ' + fault.message;
  byId('fault').hidden = false;
}
