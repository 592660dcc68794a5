// SPDX-License-Identifier: Apache-2.0
// Vectors are arrays of three, quaternions (w, x, y, z), matrices 4x4 in columns as WebGL takes them.
'use strict';

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const addScaled = (a, b, s) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => {
  const length = Math.hypot(a[0], a[1], a[2]) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
};

/// The matrix of a pose [x, y, z, qw, qx, qy, qz].
function matrixOfPose(pose) {
  const [px, py, pz, w, x, y, z] = pose;
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
    px, py, pz, 1];
}

/// a b, each 4x4 in columns.
function multiply(a, b) {
  const out = new Array(16);
  for (let column = 0; column < 4; ++column)
    for (let row = 0; row < 4; ++row) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  return out;
}

/// m applied to a point, with the division by w.
function project(m, p) {
  const at = (row) => m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row];
  const w = at(3);
  return [at(0) / w, at(1) / w, at(2) / w];
}

/// clip_T_eye of a lens that is `fov` [rad] high.
function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2);
  return [
    f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
    2 * far * near / (near - far), 0];
}

/// clip_T_eye without perspective, `height` [m] of the view.
function orthographic(height, aspect, near, far) {
  return [
    2 / (height * aspect), 0, 0, 0, 0, 2 / height, 0, 0, 0, 0, 2 / (near - far), 0, 0, 0,
    (far + near) / (near - far), 1];
}

/// eye_T_world of an eye that looks at a target, `up` is up.
function lookAt(eye, target, up) {
  const back = unit(sub(eye, target));
  const right = unit(cross(up, back));
  const top = cross(back, right);
  return [
    right[0], top[0], back[0], 0, right[1], top[1], back[1], 0, right[2], top[2], back[2], 0,
    -dot(right, eye), -dot(top, eye), -dot(back, eye), 1];
}

/// Flattens everything onto the plane z = height along the light: from a place, w = 1, or along a
/// direction towards it, w = 0 or left out.
function flatten(light, height) {
  if (light[3]) {
    const [lx, ly, lz] = light, above = lz - height;
    return [
      above, 0, 0, 0, 0, above, 0, 0, -lx, -ly, -height, -1,
      lx * height, ly * height, lz * height, lz];
  }
  const x = light[0] / light[2], y = light[1] / light[2];
  return [
    1, 0, 0, 0, 0, 1, 0, 0, -x, -y, 0, 0, x * height, y * height, height, 1];
}

/// The pose of a track of `frames` poses at a frame that need not be whole: positions linear,
/// rotations along the shortest way.
function poseAt(track, frames, frame) {
  const at = Math.min(Math.max(frame, 0), frames - 1);
  const i = Math.floor(at), j = Math.min(i + 1, frames - 1), u = at - i;
  const pose = new Array(7);
  let cosine = 0;
  for (let k = 3; k < 7; ++k) cosine += track[7 * i + k] * track[7 * j + k];
  const sign = cosine < 0 ? -1 : 1;
  let squares = 0;
  for (let k = 0; k < 7; ++k) {
    pose[k] = (1 - u) * track[7 * i + k] + u * (k < 3 ? 1 : sign) * track[7 * j + k];
    if (k >= 3) squares += pose[k] * pose[k];
  }
  const length = Math.sqrt(squares) || 1;
  for (let k = 3; k < 7; ++k) pose[k] /= length;
  return pose;
}
