// SPDX-License-Identifier: Apache-2.0
// The page of a replay: reads its data, and joins scene, time and plots.
'use strict';

function startReplay() {
  const byId = (id) => document.getElementById(id);
  const header = JSON.parse(byId('header').textContent);
  const data = decodeReplay(header, bytesOfBase64(byId('bytes').textContent));
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
  const player = new Player(byId, header, data, (frame) => {
    if (!renderer) return;
    renderer.draw(camera, frame);
    nameFrames(byId('names'), renderer.labels(frame));
  });
  const {start} = header, {end} = player;
  const ask = () => player.ask();
  function resize() {
    fitCanvas(canvas);
    player.resize();
  }
  attachViewControls(byId, () => camera, () => renderer, ask);
  byId('lens').checked = !camera.perspective;
  window.addEventListener('keydown', (event) => {
    if (event.target.tagName !== 'SELECT' && player.key(event.key)) event.preventDefault();
  });
  canvas.addEventListener('webglcontextrestored', ask);
  camera.attach(canvas, ask);
  window.addEventListener('resize', resize);
  // `page.html#t=12.5` opens at that time, standing.
  const asked = /[#&]t=([0-9.]+)/.exec(location.hash);
  const was = document.body.dataset.reload ? stateBefore() : null;
  if (was) {
    player.time = Math.min(Math.max(was.time, start), end);
    player.speed = was.speed;
    byId('speed').value = String(was.speed);
    camera.restore(was.camera);
    byId('lens').checked = !camera.perspective;
  } else if (asked) player.time = Math.min(Math.max(Number(asked[1]), start), end);
  resize();
  if (was ? was.isPlaying : !asked) player.play(true);
  if (document.body.dataset.reload)
    followFile(Number(document.body.dataset.reload), canvas, () => {
      const {time, isPlaying, speed} = player;
      return {time, isPlaying, speed, camera: camera.state()};
    });
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
