// SPDX-License-Identifier: Apache-2.0
// The page of a replay: reads its data, plays, and joins scene, time and plots.
'use strict';

function startReplay() {
  const byId = (id) => document.getElementById(id);
  const header = JSON.parse(byId('header').textContent);
  const data = decodeReplay(header, bytesOfBase64(byId('bytes').textContent));
  const end = header.start + (header.frames - 1) * header.step;
  const canvas = byId('scene');
  const box = boxOfReplay(header, data);
  const camera = new OrbitCamera(header.camera, box);
  let renderer = null;
  try {
    renderer = new Renderer(canvas, header, data, box);
  } catch (fault) {
    byId('fault').textContent = fault.message;
    byId('fault').hidden = false;
  }

  let time = header.start, isPlaying = false, speed = 1, before = 0, isAsked = false;
  const slider = byId('time');
  slider.max = String(header.frames - 1);
  const decimals = Math.max(0, Math.min(6, Math.ceil(-Math.log10((end - header.start) / 2000))));

  const panels = panelsOf(header.columns).map((panel) => new Panel(
    byId('plots'), panel, header, data,
    (share) => seek(header.start + share * (end - header.start))));
  byId('plots').hidden = panels.length === 0;

  function draw() {
    if (renderer) {
      const frame = (time - header.start) / header.step;
      renderer.draw(camera, frame);
      nameFrames(renderer.labels(frame));
    }
    slider.value = String((time - header.start) / header.step);
    byId('now').textContent = time.toFixed(decimals) + ' / ' + end.toFixed(decimals) + ' s';
    for (const panel of panels) panel.draw(time);
  }
  function nameFrames(labels) {
    const names = byId('names');
    while (names.children.length > labels.length) names.lastChild.remove();
    labels.forEach(({text, x, y}, i) => {
      const name = names.children[i] || names.appendChild(document.createElement('span'));
      name.textContent = text;
      name.style.left = 100 * x + '%';
      name.style.top = 100 * y + '%';
    });
  }
  function step(now) {
    isAsked = false;
    if (isPlaying) {
      time += speed * (now - before) / 1000;
      before = now;
      if (time >= end) {
        const isLoop = byId('loop').checked;
        time = isLoop ? header.start + (time - header.start) % (end - header.start) : end;
        if (!isLoop) play(false);
      }
      ask();
    }
    draw();
  }
  function ask() {
    if (!isAsked) requestAnimationFrame(step);
    isAsked = true;
  }
  function play(on) {
    if (on && time >= end) time = header.start;
    isPlaying = on;
    before = performance.now();
    byId('play').textContent = on ? '❚❚' : '▶';
    byId('play').setAttribute('aria-label', on ? 'pause' : 'play');
    ask();
  }
  function seek(to) {
    time = Math.min(Math.max(to, header.start), end);
    ask();
  }
  function resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    for (const panel of panels) panel.resize();
    draw();
  }

  byId('play').addEventListener('click', () => play(!isPlaying));
  slider.addEventListener('input', () => seek(header.start + slider.value * header.step));
  byId('speed').addEventListener('change', (event) => {
    speed = Number(event.target.value);
  });
  byId('view').addEventListener('change', (event) => {
    if (event.target.value) camera.look(event.target.value);
    event.target.value = '';
    ask();
  });
  byId('lens').addEventListener('change', (event) => {
    camera.perspective = !event.target.checked;
    ask();
  });
  byId('lens').checked = !camera.perspective;
  for (const name of ['path', 'edges', 'floor', 'axes'])
    byId(name).addEventListener('change', (event) => {
      if (renderer) renderer.shows[name] = event.target.checked;
      ask();
    });
  window.addEventListener('keydown', (event) => {
    if (event.target.tagName === 'SELECT') return;
    const moves = {ArrowLeft: -1, ArrowRight: 1, PageUp: -30, PageDown: 30};
    if (event.key === ' ') play(!isPlaying);
    else if (event.key === 'Home') seek(header.start);
    else if (event.key === 'End') seek(end);
    else if (event.key in moves) seek(time + moves[event.key] * header.step);
    else return;
    event.preventDefault();
  });
  canvas.addEventListener('webglcontextrestored', ask);
  camera.attach(canvas, ask);
  window.addEventListener('resize', resize);
  // `page.html#t=12.5` opens at that time, standing.
  const asked = /[#&]t=([0-9.]+)/.exec(location.hash);
  const was = document.body.dataset.reload ? stateBefore() : null;
  if (was) {
    time = Math.min(Math.max(was.time, header.start), end);
    speed = was.speed;
    byId('speed').value = String(speed);
    camera.restore(was.camera);
    byId('lens').checked = !camera.perspective;
  } else if (asked) time = Math.min(Math.max(Number(asked[1]), header.start), end);
  resize();
  if (was ? was.isPlaying : !asked) play(true);
  if (document.body.dataset.reload) followFile(Number(document.body.dataset.reload), canvas, () => (
    {time, isPlaying, speed, camera: camera.state()}));
}

// A page that follows edits is written again whenever something changed. It cannot look whether it
// was, since it loads nothing, so it opens itself anew; where it stood is kept in the window's name.
function followFile(period, canvas, state) {
  let isHeld = false;
  canvas.addEventListener('pointerdown', () => { isHeld = true; });
  window.addEventListener('pointerup', () => { isHeld = false; });
  setInterval(() => {
    if (isHeld || document.hidden) return;
    window.name = JSON.stringify({page: location.pathname, ...state()});
    location.reload();
  }, period);
}
function stateBefore() {
  try {
    const was = JSON.parse(window.name);
    return was.page === location.pathname ? was : null;
  } catch (fault) {
    return null;  // the window's name is of somebody else
  }
}

try {
  startReplay();
} catch (fault) {
  const told = document.getElementById('fault');
  told.textContent = 'This replay cannot be shown: ' + fault.message;
  told.hidden = false;
}
