// SPDX-License-Identifier: Apache-2.0
// node replay_check.js page.html poses.txt: runs the scripts of a replay without a browser and
// compares what they decode with the poses of forward kinematics that the test has written: a line
// for each track and frame, `track frame x y z qw qx qy qz`. Ends with 0 when all is well.
'use strict';
const fs = require('fs');
const vm = require('vm');

const page = fs.readFileSync(process.argv[2], 'utf8');
const inside = (start, end) => {
  const from = page.lastIndexOf(start) + start.length;
  return page.slice(from, page.indexOf(end, from));
};
// A page without elements: the scripts tell so in the element of faults, and their functions stay.
const told = {};
const context = vm.createContext({document: {getElementById: () => told}, atob, console});
vm.runInContext(inside('<script>\n', '</script>'), context);
const run = (text) => vm.runInContext(text, context);
context.header = JSON.parse(inside('id="header">', '</script>'));
context.base64 = inside('id="bytes">', '</script>');
run('var data = decodeReplay(header, bytesOfBase64(base64))');
const {header, data} = context;

let faults = 0;
function expect(what, is) {
  if (is) return;
  ++faults;
  console.error('not so: ' + what);
}
const near = (a, b, tolerance) => Math.abs(a - b) <= tolerance;

for (const line of fs.readFileSync(process.argv[3], 'utf8').trim().split('\n')) {
  const [track, frame, ...pose] = line.split(' ').map(Number);
  const got = context.data.tracks[track].subarray(7 * frame, 7 * frame + 7);
  const cosine = [3, 4, 5, 6].reduce((sum, k) => sum + got[k] * pose[k], 0);
  // Half a step, and the rounding of single precision.
  for (let k = 0; k < 7; ++k) {
    const step = k < 3 ? header.position_step : header.rotation_step;
    const wanted = k < 3 ? pose[k] : Math.sign(cosine) * pose[k];
    expect(`${line}: number ${k} is ${got[k]}`, near(got[k], wanted, 0.5 * step + 3e-7));
  }
}
expect('as many meshes, tracks and columns as the header tells',
  data.meshes.length === header.meshes.length && data.tracks.length === header.tracks &&
  data.columns.length === header.columns.length);
expect('normals are of unit length', data.meshes.every(({normals}) => {
  for (let i = 0; i < normals.length; i += 3)
    if (!near(Math.hypot(normals[i], normals[i + 1], normals[i + 2]), 1, 1e-6)) return false;
  return true;
}));
expect('triangles name vertices that there are', data.meshes.every(
  ({triangles, positions}) => triangles.every((v) => v < positions.length / 3)));
expect('the last time is the end', near(
  data.times[data.times.length - 1], header.start + (header.frames - 1) * header.step, 1e-6));

// Halfway between two turns about z, the turn is half.
context.track = new Float32Array([0, 0, 0, 1, 0, 0, 0, 2, 4, 6, -Math.SQRT1_2, 0, 0, -Math.SQRT1_2]);
const middle = run('poseAt(track, 2, 0.5)');
expect('poses in between', near(middle[0], 1, 1e-6) && near(middle[1], 2, 1e-6) &&
  near(middle[3], Math.cos(Math.PI / 8), 1e-6) && near(middle[6], Math.sin(Math.PI / 8), 1e-6));
expect('poses after the end stand still', run('poseAt(track, 2, 9)')[2] === 6);
expect('a turn about z maps x to y', (() => {
  const p = run('project(matrixOfPose([1, 0, 0, Math.SQRT1_2, 0, 0, Math.SQRT1_2]), [1, 0, 0])');
  return near(p[0], 1, 1e-12) && near(p[1], 1, 1e-12) && near(p[2], 0, 1e-12);
})());
expect('shadows lie on the floor along the light', (() => {
  const p = run('project(flatten([1, 0, 2], -1), [0, 3, 1])');
  return near(p[0], -1, 1e-12) && near(p[1], 3, 1e-12) && near(p[2], -1, 1e-12);
})());
expect('shadows of a lamp at a place lie where its rays meet the floor', (() => {
  // From (0, 0, 3) over (1, 0, 1) down to z = -1: twice as far again.
  const p = run('project(flatten([0, 0, 3, 1], -1), [1, 0, 1])');
  return near(p[0], 2, 1e-12) && near(p[1], 0, 1e-12) && near(p[2], -1, 1e-12);
})());
expect('a spot that looks down shines along -z, within its angle', (() => {
  const [lamp] = run(`lampsOf([{kind: 'spot', pose: [1, 2, 3, 1, 0, 0, 0], colour: [1, 0, 0],
    intensity: 2, angle: Math.PI / 3}])`);
  return JSON.stringify(lamp.at) === '[1,2,3,1]' && near(lamp.axis[2], -1, 1e-12) &&
    near(lamp.axis[3], 0.5, 1e-12) && JSON.stringify(lamp.colour) === '[2,0,0]';
})());
expect('a scene without lights has one lamp', run('lampsOf([]).length') === 1);
expect('ambient light is the light of the sky, and no lamp', (() => {
  const ambient = "{kind: 'ambient', pose: [0, 0, 0, 1, 0, 0, 0], colour: [1, 0, 1], intensity: 0.3}";
  return run(`lampsOf([${ambient}]).length`) === 1 &&
    JSON.stringify(run(`surroundingsOf([${ambient}, ${ambient}])`)) === '[0.6,0,0.6]' &&
    JSON.stringify(run('surroundingsOf([])')) === '[1,1,1]';
})());
expect('the whole box is in the first picture', run(`(() => {
  const box = boxOfReplay(header, data);
  const m = new OrbitCamera(header.camera, box).matrix(4 / 3);
  for (let corner = 0; corner < 8; ++corner) {
    const p = project(m, [0, 1, 2].map((k) => box[(corner >> k) & 1][k]));
    if (p.some((x) => Math.abs(x) > 1)) return false;
  }
  return true;
})()`));
expect('ticks are round', JSON.stringify(run('ticksOf(-0.31, 0.42, 4)')) === '[-0.2,0,0.2,0.4]');
expect('values between samples', run('valueAt([0, 1, 3], [0, 10, 30], 2)') === 20);
expect('columns of a kind share a panel', JSON.stringify(run(
  `panelsOf([{name: 'q1', unit: 'rad'}, {name: 'tau1', unit: 'N m'}, {name: 'q2', unit: 'rad'}])
     .map((p) => p.columns)`)) === '[[0,2],[1]]');
expect('data that ends too early is told', (() => {
  try {
    run('decodeReplay(header, bytesOfBase64(base64).subarray(0, 1000))');
  } catch (fault) {
    return fault.message.includes('too early');
  }
  return false;
})());
process.exit(faults === 0 ? 0 : 1);
