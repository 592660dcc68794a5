// SPDX-License-Identifier: Apache-2.0
// Playing a recording, and the controls that pages with a scene have in common.
'use strict';

/// Plays a recording: time, plots, and what the controls of the page do. `elements` gives an element
/// by its id; some may be missing.
class Player {
  /// show(frame): draws the scene at a frame that need not be whole.
  constructor(elements, header, data, show) {
    this.header = header;
    this.end = header.start + (header.frames - 1) * header.step;
    this.show = show;
    this.time = header.start;
    this.speed = 1;
    this.isPlaying = false;
    this.before = 0;
    this.isAsked = false;
    this.elements = elements;
    this.over = new AbortController();
    const length = this.end - header.start;
    this.decimals = Math.max(0, Math.min(6, Math.ceil(-Math.log10(length / 2000))));
    elements('time').max = String(header.frames - 1);
    this.panels = panelsOf(header.columns).map((panel) => new Panel(
      elements('plots'), panel, header, data, (share) => this.seek(header.start + share * length)));
    elements('plots').hidden = this.panels.length === 0;
    const on = (id, event, act) =>
      elements(id).addEventListener(event, act, {signal: this.over.signal});
    on('play', 'click', () => this.play(!this.isPlaying));
    on('time', 'input', (event) => this.seek(header.start + event.target.value * header.step));
    on('speed', 'change', (event) => { this.speed = Number(event.target.value); });
    this.speed = Number(elements('speed').value);
  }
  /// Ends; its plots go.
  remove() {
    this.over.abort();
    this.isPlaying = false;
    this.show = () => {};
    for (const panel of this.panels) panel.element.remove();
    this.panels = [];
  }
  draw() {
    const frame = (this.time - this.header.start) / this.header.step;
    this.show(frame);
    this.elements('time').value = String(frame);
    this.elements('now').textContent =
      this.time.toFixed(this.decimals) + ' / ' + this.end.toFixed(this.decimals) + ' s';
    for (const panel of this.panels) panel.draw(this.time);
  }
  step(now) {
    this.isAsked = false;
    if (this.over.signal.aborted) return;
    const {start} = this.header;
    if (this.isPlaying) {
      this.time += this.speed * (now - this.before) / 1000;
      this.before = now;
      if (this.time >= this.end) {
        const isLoop = this.elements('loop').checked;
        this.time = isLoop ? start + (this.time - start) % (this.end - start) : this.end;
        if (!isLoop) this.play(false);
      }
      this.ask();
    }
    this.draw();
  }
  ask() {
    if (!this.isAsked) requestAnimationFrame((now) => this.step(now));
    this.isAsked = true;
  }
  play(on) {
    if (on && this.time >= this.end) this.time = this.header.start;
    this.isPlaying = on;
    this.before = performance.now();
    this.elements('play').textContent = on ? '❚❚' : '▶';
    this.elements('play').setAttribute('aria-label', on ? 'pause' : 'play');
    this.ask();
  }
  seek(to) {
    this.time = Math.min(Math.max(to, this.header.start), this.end);
    this.ask();
  }
  resize() {
    for (const panel of this.panels) panel.resize();
    this.draw();
  }
  /// Whether the key was one of ours.
  key(key) {
    const moves = {ArrowLeft: -1, ArrowRight: 1, PageUp: -30, PageDown: 30};
    if (key === ' ') this.play(!this.isPlaying);
    else if (key === 'Home') this.seek(this.header.start);
    else if (key === 'End') this.seek(this.end);
    else if (key in moves) this.seek(this.time + moves[key] * this.header.step);
    else return false;
    return true;
  }
}

/// As many picture elements as the element has on this screen.
function fitCanvas(canvas) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
}

/// Writes the names of frames into an element that lies on the canvas.
function nameFrames(names, labels) {
  while (names.children.length > labels.length) names.lastChild.remove();
  labels.forEach(({text, x, y}, i) => {
    const name = names.children[i] || names.appendChild(document.createElement('span'));
    name.textContent = text;
    name.style.left = 100 * x + '%';
    name.style.top = 100 * y + '%';
  });
}

/// The controls of the view: they act on the camera and on what the renderer shows, and call `ask`.
function attachViewControls(elements, camera, renderer, ask) {
  elements('view').addEventListener('change', (event) => {
    if (event.target.value) camera().look(event.target.value);
    event.target.value = '';
    ask();
  });
  elements('lens').addEventListener('change', (event) => {
    camera().perspective = !event.target.checked;
    ask();
  });
  for (const name of ['path', 'edges', 'floor', 'axes'])
    elements(name).addEventListener('change', (event) => {
      if (renderer()) renderer().shows[name] = event.target.checked;
      ask();
    });
}
