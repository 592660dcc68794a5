// SPDX-License-Identifier: Apache-2.0
// From the packed bytes of a replay to arrays. What is written where: scene/replay.h.
'use strict';

function bytesOfBase64(text) {
  const packed = atob(text.trim());
  const bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; ++i) bytes[i] = packed.charCodeAt(i);
  return bytes;
}

/// Reads whole numbers of seven bits a byte, the lowest first; products instead of shifts, since
/// shifts end at 32 bits.
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  whole() {
    let value = 0, scale = 1;
    for (;;) {
      if (this.at >= this.bytes.length) throw new Error('the data of this replay ends too early');
      const byte = this.bytes[this.at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
      scale *= 128;
    }
  }
  /// 0, 1, 2, 3, 4 stand for 0, -1, 1, -2, 2.
  signed() {
    const value = this.whole();
    return value % 2 === 1 ? -(value + 1) / 2 : value / 2;
  }
  /// `count` numbers as the differences of each from the one before, into out[first], out[first +
  /// stride] and so on, through `finish`.
  steps(count, out, first, stride, finish) {
    let value = 0;
    for (let i = 0; i < count; ++i) {
      value += this.signed();
      out[first + i * stride] = finish(value);
    }
  }
  /// The same for what moves evenly: differences of the differences.
  bends(count, out, first, stride, finish) {
    let value = 0, speed = 0;
    for (let i = 0; i < count; ++i) {
      speed += this.signed();
      value += speed;
      // The first number is a place and no speed.
      if (i === 0) speed = 0;
      out[first + i * stride] = finish(value);
    }
  }
}

/// A unit vector from its two coordinates on the unfolded octahedron, each -1..1 (Meyer et al., On
/// floating-point normal vectors, Computer Graphics Forum 29 (2010) 1405).
function normalOfOctahedron(u, v) {
  let x = u, y = v;
  const z = 1 - Math.abs(u) - Math.abs(v);
  if (z < 0) {
    x = (1 - Math.abs(v)) * (u < 0 ? -1 : 1);
    y = (1 - Math.abs(u)) * (v < 0 ? -1 : 1);
  }
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

function decodeMesh(reader, mesh) {
  const vertices = mesh.vertices;
  const positions = new Float32Array(3 * vertices);
  const normals = new Float32Array(3 * vertices);
  for (let axis = 0; axis < 3; ++axis)
    reader.steps(vertices, positions, axis, 3, (x) => mesh.low[axis] + x * mesh.step[axis]);
  const folded = new Float64Array(2 * vertices);
  for (let k = 0; k < 2; ++k) reader.steps(vertices, folded, k, 2, (x) => x / 511);
  for (let i = 0; i < vertices; ++i)
    normals.set(normalOfOctahedron(folded[2 * i], folded[2 * i + 1]), 3 * i);
  const triangles = new Uint32Array(3 * mesh.triangles);
  reader.steps(triangles.length, triangles, 0, 1, (x) => x);
  // Polylines become pairs of points.
  const sizes = [];
  let points = 0;
  for (let i = 0; i < mesh.polylines; ++i) {
    sizes.push(reader.whole());
    points += sizes[i];
  }
  const corners = new Float32Array(3 * points);
  for (let axis = 0; axis < 3; ++axis)
    reader.steps(points, corners, axis, 3, (x) => mesh.low[axis] + x * mesh.step[axis]);
  const edges = [];
  let first = 0;
  for (const size of sizes) {
    for (let i = first; i + 1 < first + size; ++i) edges.push(i, i + 1);
    first += size;
  }
  return {positions, normals, triangles, corners, edges: new Uint32Array(edges)};
}

/// header: the described content, bytes: the packed numbers, kept: meshes by key that need not be
/// there again.
function decodeReplay(header, bytes, kept = new Map()) {
  if (header.format !== 1) throw new Error('this replay has a format that the page does not know');
  const reader = new Reader(bytes);
  const meshes = header.meshes.map((mesh) => {
    if (!mesh.kept) return decodeMesh(reader, mesh);
    if (!kept.has(mesh.key)) throw new Error('a mesh of this scene is missing');
    return kept.get(mesh.key);
  });
  const tracks = [];
  for (let i = 0; i < header.tracks; ++i) {
    const track = new Float32Array(7 * header.frames);
    for (let k = 0; k < 7; ++k) {
      const step = k < 3 ? header.position_step : header.rotation_step;
      reader.bends(header.frames, track, k, 7, (x) => x * step);
    }
    tracks.push(track);
  }
  const lines = header.lines.map((line) => {
    const points = new Float32Array(3 * line.points);
    for (let k = 0; k < 3; ++k)
      reader.bends(line.points, points, k, 3, (x) => x * header.position_step);
    return points;
  });
  const times = new Float64Array(header.samples);
  reader.bends(header.samples, times, 0, 1, (x) => header.start + x * header.time_step);
  const columns = header.columns.map((column) => {
    const values = new Float64Array(header.samples);
    const step = (column.high - column.low) / 65534;
    reader.steps(header.samples, values, 0, 1, (x) => x === 65535 ? NaN : column.low + x * step);
    return values;
  });
  if (reader.at !== bytes.length) throw new Error('the data of this replay is too long');
  return {meshes, tracks, lines, times, columns};
}
