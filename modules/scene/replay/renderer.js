// SPDX-License-Identifier: Apache-2.0
// Draws the scene of a replay at a time with WebGL 2.
'use strict';

/// Towards the lamp of a scene without lights: behind the right shoulder of the first view.
const kLight = unit([-0.25, -0.55, 0.9]);
/// Lights that count, and the share of the sky where a scene has its own.
const kMostLights = 8, kSurroundings = 0.5;
/// Intensities beyond this are white on everything, and far beyond it no number of a shader.
const kBrightest = 1e6;

/// The lamps that the lights of a header stand for, the brightest first: `at` is a place, w = 1, or
/// the direction towards the lamp, w = 0; `axis` is where a spot shines, w the cosine of half its
/// opening, -2 = to all sides.
function lampsOf(lights) {
  const placed = (lights || []).filter(({kind}) => kind !== 'ambient');
  if (!placed.length)
    return [{at: [...kLight, 0], axis: [0, 0, -1, -2], colour: [1, 1, 1]}];
  const lamps = placed.map(({kind, pose, colour, intensity, angle}) => {
    const m = matrixOfPose(pose);
    return {
      at: kind === 'sun' ? [m[8], m[9], m[10], 0] : [m[12], m[13], m[14], 1],
      axis: [-m[8], -m[9], -m[10], kind === 'spot' ? Math.cos(angle) : -2],
      colour: colour.map((c) => Math.min(intensity, kBrightest) * Math.pow(c, 2.2))};
  });
  const brightness = (lamp) => Math.max(...lamp.colour);
  return lamps.sort((a, b) => brightness(b) - brightness(a)).slice(0, kMostLights);
}

/// The share of the sky that the lights of a header leave: its ambient lights together.
function surroundingsOf(lights) {
  const ambient = (lights || []).filter(({kind}) => kind === 'ambient');
  const share = lights && lights.length ? kSurroundings : 1;
  if (!ambient.length) return [share, share, share];
  return [0, 1, 2].map((i) => ambient.reduce(
    (sum, {colour, intensity}) =>
      sum + Math.min(intensity, kBrightest) * Math.pow(colour[i], 2.2), 0));
}

// The lamps in the shaders, and what of lamp i comes to a place: direction towards it, share.
const kLamps = `
uniform float u_count;
uniform vec3 u_surroundings;
uniform vec4 u_at[8], u_axis[8];
uniform vec3 u_lamp[8];
vec4 lamp_from(int i, vec3 p) {
  vec3 l = normalize(u_at[i].xyz - p * u_at[i].w);
  float edge = u_axis[i].w;
  float share = edge < -1.5 ? 1.0 : smoothstep(edge, mix(edge, 1.0, 0.2), -dot(l, u_axis[i].xyz));
  return vec4(l, share);
}`;

const kSurfaceVertex = `#version 300 es
in vec3 a_position;
in vec3 a_normal;
uniform mat4 u_clip_T_world, u_world_T_item;
out vec3 v_normal, v_place;
void main() {
  vec4 place = u_world_T_item * vec4(a_position, 1.0);
  v_place = place.xyz;
  v_normal = mat3(u_world_T_item) * a_normal;
  gl_Position = u_clip_T_world * place;
}`;

const kSurfaceFragment = `#version 300 es
precision highp float;
in vec3 v_normal, v_place;
uniform vec3 u_eye, u_emission;
uniform vec4 u_colour;
uniform float u_shininess, u_metalness;
out vec4 colour;
${kLamps}
vec3 linear(vec3 c) { return pow(c, vec3(2.2)); }
void main() {
  vec3 n = normalize(v_normal);
  vec3 to_eye = normalize(u_eye - v_place);
  if (!gl_FrontFacing) n = -n;
  vec3 base = linear(u_colour.rgb);
  float power = exp2(2.0 + 7.0 * u_shininess);
  vec3 key = vec3(0.0), glints = vec3(0.0);
  for (int i = 0; i < 8; ++i) {
    if (float(i) >= u_count) break;
    vec4 from = lamp_from(i, v_place);
    key += u_lamp[i] * (from.w * max(dot(n, from.xyz), 0.0));
    vec3 middle = normalize(from.xyz + to_eye);
    glints += u_lamp[i] * (from.w * pow(max(dot(n, middle), 0.0), power));
  }
  // Sky from above, light from the floor below, and a weak lamp beside the eye.
  vec3 around = mix(vec3(0.30, 0.29, 0.28), vec3(0.52, 0.55, 0.60), 0.5 + 0.5 * n.z) *
    u_surroundings;
  float fill = max(dot(n, to_eye), 0.0);
  vec3 diffuse = base * (around + 0.75 * key + 0.14 * fill) * (1.0 - 0.45 * u_metalness);
  vec3 glint = glints * (0.15 + 0.9 * u_shininess);
  float rim = pow(1.0 - max(dot(n, to_eye), 0.0), 4.0);
  vec3 mirror = mix(vec3(0.5), base * 1.4, u_metalness);
  vec3 sky = mix(vec3(0.25), vec3(0.9), smoothstep(-0.3, 0.6, reflect(-to_eye, n).z)) *
    u_surroundings;
  vec3 light = diffuse + mirror * glint + 0.45 * u_metalness * base * sky +
               0.10 * rim * sky * (0.3 + u_shininess) + linear(u_emission);
  light = light / (1.0 + 0.18 * light);
  colour = vec4(pow(light, vec3(1.0 / 2.2)), u_colour.a);
}`;

const kPlainFragment = `#version 300 es
precision highp float;
uniform vec4 u_colour;
out vec4 colour;
void main() { colour = u_colour; }`;

const kFloorFragment = `#version 300 es
precision highp float;
in vec3 v_normal, v_place;
uniform vec3 u_middle;
uniform float u_cell, u_radius, u_own;  // u_own: cosine of the page's own lamp
out vec4 colour;
${kLamps}
float lines(float cell) {
  vec2 at = v_place.xy / cell;
  vec2 width = fwidth(at);
  vec2 off = abs(fract(at - 0.5) - 0.5) / max(width, vec2(1e-6));
  return (1.0 - min(min(off.x, off.y), 1.0)) * clamp(1.5 - 3.0 * max(width.x, width.y), 0.0, 1.0);
}
void main() {
  float fade = 1.0 - smoothstep(0.4, 1.0, length(v_place.xy - u_middle.xy) / u_radius);
  float line = max(0.22 * lines(u_cell), 0.40 * lines(5.0 * u_cell));
  vec3 floor_colour = mix(vec3(0.80, 0.82, 0.845), vec3(0.50, 0.54, 0.60), line);
  // Its colour is the one under the page's own lamp.
  vec3 light = 0.45 * u_surroundings;
  for (int i = 0; i < 8; ++i) {
    if (float(i) >= u_count) break;
    vec4 from = lamp_from(i, v_place);
    light += u_lamp[i] * (0.75 * from.w * max(from.z, 0.0));
  }
  light /= 0.45 + 0.75 * u_own;
  colour = vec4(floor_colour * pow(min(light, 1.6), vec3(1.0 / 2.2)), fade);
}`;

// A line of even width: each piece a rectangle of the screen.
const kRibbonVertex = `#version 300 es
in vec3 a_from, a_to;
uniform mat4 u_clip_T_world, u_world_T_item;
uniform vec2 u_viewport;
uniform float u_width, u_towards;
void main() {
  vec4 from = u_clip_T_world * u_world_T_item * vec4(a_from, 1.0);
  vec4 to = u_clip_T_world * u_world_T_item * vec4(a_to, 1.0);
  vec2 way = (to.xy / max(to.w, 1e-6) - from.xy / max(from.w, 1e-6)) * u_viewport;
  float size = length(way);
  vec2 along = size > 1e-4 ? way / size : vec2(1.0, 0.0);
  vec2 corner = vec2(float(gl_VertexID & 1) * 2.0 - 1.0, float(gl_VertexID >> 1) * 2.0 - 1.0);
  vec4 at = corner.x < 0.0 ? from : to;
  vec2 shift = (along * corner.x * 0.35 + vec2(-along.y, along.x) * corner.y) * u_width;
  at.xy += shift / u_viewport * at.w;
  at.z -= u_towards * at.w;
  gl_Position = at;
}`;

const kBackVertex = `#version 300 es
out float v_height;
void main() {
  vec2 at = vec2(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0);
  v_height = 0.5 + 0.5 * at.y;
  gl_Position = vec4(at, 0.0, 1.0);
}`;
const kBackFragment = `#version 300 es
precision highp float;
in float v_height;
out vec4 colour;
void main() {
  colour = vec4(mix(vec3(0.83, 0.845, 0.865), vec3(0.955, 0.965, 0.98), v_height), 1.0);
}`;

/// Box [low, high] of everything over the whole motion [m].
function boxOfReplay(header, data) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const see = (p) => {
    for (let i = 0; i < 3; ++i) {
      low[i] = Math.min(low[i], p[i]);
      high[i] = Math.max(high[i], p[i]);
    }
  };
  for (const item of header.items) {
    const mesh = header.meshes[item.mesh];
    const poses = [];
    const count = item.pose ? 1 : Math.min(header.frames, 40);
    for (let i = 0; i < count; ++i)
      poses.push(item.pose || poseAt(data.tracks[item.track], header.frames,
        i * (header.frames - 1) / Math.max(1, count - 1)));
    for (const pose of poses) {
      const m = matrixOfPose(pose);
      for (let corner = 0; corner < 8; ++corner)
        see(project(m, [0, 1, 2].map((k) => {
          // A step of 1 stands for an extent of nothing.
          const extent = mesh.step[k] === 1 ? 0 : 65535 * mesh.step[k];
          return mesh.low[k] + ((corner >> k) & 1) * extent;
        })));
    }
  }
  for (const points of data.lines)
    for (let i = 0; i < points.length; i += 3) see(points.subarray(i, i + 3));
  return low[0] <= high[0] ? [low, high] : [[-0.5, -0.5, 0], [0.5, 0.5, 1]];
}

/// 1, 2 or 5 times a power of ten, near x.
function roundLength(x) {
  const power = Math.pow(10, Math.floor(Math.log10(x)));
  const rest = x / power;
  return (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10) * power;
}

class Renderer {
  /// Throws where there is no WebGL 2.
  constructor(canvas, header, data, box) {
    this.canvas = canvas;
    this.shows = {path: true, edges: true, floor: true, axes: true};
    this.gl = canvas.getContext('webgl2', {antialias: true, stencil: true, alpha: false});
    if (!this.gl) throw new Error('This browser has no WebGL 2, so it shows the plots only.');
    this.prepare();
    this.show(header, data, box);
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => {
      this.prepare();
      this.show(this.header, this.data, this.box);
    });
  }

  /// What does not depend on the scene.
  prepare() {
    const gl = this.gl;
    this.uploaded = new Map();
    this.own = [];
    this.surface = this.program(kSurfaceVertex, kSurfaceFragment);
    this.plain = this.program(kSurfaceVertex, kPlainFragment);
    this.floor = this.program(kSurfaceVertex, kFloorFragment);
    this.ribbon = this.program(kRibbonVertex, kPlainFragment);
    this.back = this.program(kBackVertex, kBackFragment);
    this.nothing = gl.createVertexArray();
    this.axes = [0, 1, 2].map((k) => {
      const points = new Float32Array(6);
      points[3 + k] = 1;
      return this.uploadLine(points);
    });
  }

  /// Shows a scene, in the place of the one before. Meshes that were there stay as they are.
  show(header, data, box) {
    this.header = header;
    this.data = data;
    this.box = box;
    this.lamps = lampsOf(header.lights);
    this.surroundings = surroundingsOf(header.lights);
    for (const thing of this.own) this.free(thing);
    const before = this.uploaded;
    this.uploaded = new Map();
    for (const mesh of data.meshes)
      if (!this.uploaded.has(mesh)) this.uploaded.set(mesh, before.get(mesh) || this.upload(mesh));
    for (const [mesh, thing] of before) if (!this.uploaded.has(mesh)) this.free(thing);
    this.meshes = data.meshes.map((mesh) => this.uploaded.get(mesh));
    this.lines = this.data.lines.map((points) => this.uploadLine(points));
    // The way of every tool, from its track.
    this.traces = this.header.triads.filter((triad) => triad.track !== undefined).map((triad) => {
      const track = this.data.tracks[triad.track];
      const points = new Float32Array(3 * this.header.frames);
      for (let i = 0; i < this.header.frames; ++i)
        points.set(track.subarray(7 * i, 7 * i + 3), 3 * i);
      return this.uploadLine(points);
    });
    const [low, high] = this.box;
    const size = Math.hypot(...sub(high, low));
    this.floorHeight = low[2] - 1e-4 * size;
    this.floorRadius = 3 * size;
    this.floorMiddle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0];
    const [x, y] = this.floorMiddle, r = this.floorRadius, z = this.floorHeight;
    this.floorMesh = this.upload({
      positions: new Float32Array([x - r, y - r, z, x + r, y - r, z, x + r, y + r, z, x - r, y + r, z]),
      normals: new Float32Array([0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1]),
      triangles: new Uint32Array([0, 1, 2, 0, 2, 3]),
      corners: new Float32Array(0), edges: new Uint32Array(0)});
    this.cell = roundLength(size / 20);
    this.own = [...this.lines, ...this.traces, this.floorMesh];
  }

  /// Gives back what upload() or uploadLine() took.
  free({arrays, buffers}) {
    for (const array of arrays) this.gl.deleteVertexArray(array);
    for (const buffer of buffers) this.gl.deleteBuffer(buffer);
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ['a_position', 'a_normal', 'a_from', 'a_to'].forEach(
      (name, i) => gl.bindAttribLocation(program, i % 2, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const told = gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s)).join(' ');
      throw new Error('The shaders of this page do not compile here: ' + told);
    }
    const places = {};
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; ++i) {
      const {name} = gl.getActiveUniform(program, i);
      places[name.replace('[0]', '')] = gl.getUniformLocation(program, name);
    }
    return {program, places};
  }

  buffer(target, values) {
    const gl = this.gl;
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, values, gl.STATIC_DRAW);
    return buffer;
  }

  /// Attribute `place` is three floats of the bound array buffer.
  attribute(place, stride, offset, divisor) {
    const gl = this.gl;
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, stride, offset);
    gl.vertexAttribDivisor(place, divisor);
  }

  upload(mesh) {
    const gl = this.gl;
    const faces = gl.createVertexArray();
    gl.bindVertexArray(faces);
    const buffers = [this.buffer(gl.ARRAY_BUFFER, mesh.positions)];
    this.attribute(0, 0, 0, 0);
    buffers.push(this.buffer(gl.ARRAY_BUFFER, mesh.normals));
    this.attribute(1, 0, 0, 0);
    buffers.push(this.buffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles));
    const edges = gl.createVertexArray();
    gl.bindVertexArray(edges);
    buffers.push(this.buffer(gl.ARRAY_BUFFER, mesh.corners));
    this.attribute(0, 0, 0, 0);
    buffers.push(this.buffer(gl.ELEMENT_ARRAY_BUFFER, mesh.edges));
    gl.bindVertexArray(null);
    return {
      faces, edges, triangles: mesh.triangles.length, pairs: mesh.edges.length,
      arrays: [faces, edges], buffers};
  }

  uploadLine(points) {
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffer = this.buffer(gl.ARRAY_BUFFER, points);
    this.attribute(0, 12, 0, 1);
    this.attribute(1, 12, 12, 1);
    gl.bindVertexArray(null);
    return {
      array, buffer, pieces: Math.max(0, points.length / 3 - 1), arrays: [array],
      buffers: [buffer]};
  }

  use({program, places}, numbers) {
    const gl = this.gl;
    gl.useProgram(program);
    for (const [name, value] of Object.entries(numbers)) {
      const place = places[name];
      if (place === undefined) continue;
      if (typeof value === 'number') gl.uniform1f(place, value);
      else if (value.length === 2) gl.uniform2fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else if (value.length === 4) gl.uniform4fv(place, value);
      else gl.uniformMatrix4fv(place, false, value);
    }
  }

  /// The lamps, for a program that is lit by them.
  light(program) {
    const gl = this.gl;
    this.use(program, {u_count: this.lamps.length, u_surroundings: this.surroundings});
    gl.uniform4fv(program.places.u_at, this.lamps.flatMap((lamp) => lamp.at));
    gl.uniform4fv(program.places.u_axis, this.lamps.flatMap((lamp) => lamp.axis));
    gl.uniform3fv(program.places.u_lamp, this.lamps.flatMap((lamp) => lamp.colour));
  }

  triangles(mesh) {
    this.gl.bindVertexArray(mesh.faces);
    this.gl.drawElements(this.gl.TRIANGLES, mesh.triangles, this.gl.UNSIGNED_INT, 0);
  }

  /// Pieces first .. last of a line.
  drawLine(line, first, last, world_T_item, colour, width) {
    const gl = this.gl;
    if (last <= first) return;
    this.use(this.ribbon, {
      u_clip_T_world: this.clip, u_world_T_item: world_T_item, u_colour: colour,
      u_viewport: [this.canvas.width, this.canvas.height],
      u_width: width * this.canvas.height / 800 + 0.5, u_towards: 2e-4});
    gl.bindVertexArray(line.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, line.buffer);
    this.attribute(0, 12, 12 * first, 1);
    this.attribute(1, 12, 12 * first + 12, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, last - first);
  }

  /// world_T_item of something with a pose or a track.
  place(thing, frame) {
    return matrixOfPose(
      thing.pose || poseAt(this.data.tracks[thing.track], this.header.frames, frame));
  }

  /// Names of frames and where they are: {text, x, y} in shares of the canvas from its upper left.
  labels(frame) {
    if (!this.shows.axes) return [];
    return this.header.triads.filter(({label}) => label).map((triad) => {
      const at = project(this.clip, this.place(triad, frame).slice(12, 15));
      return {text: triad.label, x: 0.5 + 0.5 * at[0], y: 0.5 - 0.5 * at[1]};
    }).filter(({x, y}) => x >= 0 && x <= 1 && y >= 0 && y <= 1);
  }

  draw(camera, frame) {
    const gl = this.gl;
    const {width, height} = this.canvas;
    const still = matrixOfPose([0, 0, 0, 1, 0, 0, 0]);
    this.clip = camera.matrix(width / height);
    gl.viewport(0, 0, width, height);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    this.use(this.back, {});
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);

    this.light(this.surface);
    const all = this.header.items.map(
      (item) => ({item, mesh: this.meshes[item.mesh], place: this.place(item, frame)}));
    if (this.shows.floor && camera.eye[2] > this.floorHeight) this.drawFloor(all, still);

    const solid = all.filter(({item}) => item.colour[3] >= 1);
    const eye = camera.eye;
    const far = (one) => Math.hypot(...sub(project(one.place, [0, 0, 0]), eye));
    const clear = all.filter(({item}) => item.colour[3] < 1).sort((a, b) => far(b) - far(a));
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    for (const one of solid) this.drawSurface(one, eye);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.enable(gl.BLEND);
    if (this.shows.edges) for (const one of solid) this.drawEdges(one);
    this.drawPaths(frame, still);
    gl.depthMask(false);
    for (const one of clear) this.drawSurface(one, eye);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /// The floor, and on it the shadows: everything flattened along each light, every pixel once.
  drawFloor(all, still) {
    const gl = this.gl;
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    this.light(this.floor);
    this.use(this.floor, {
      u_own: kLight[2],
      u_clip_T_world: this.clip, u_world_T_item: still, u_middle: this.floorMiddle,
      u_cell: this.cell, u_radius: this.floorRadius});
    this.triangles(this.floorMesh);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    const casting = this.lamps.filter(
      ({at}) => at[2] > (at[3] ? this.floorHeight : 0.05) + 1e-6);
    for (const {at} of casting) {
      gl.clear(gl.STENCIL_BUFFER_BIT);
      const flat = flatten(at, this.floorHeight);
      for (const {item, mesh, place} of all) {
        this.use(this.plain, {
          u_clip_T_world: this.clip, u_world_T_item: multiply(flat, place),
          u_colour: [0.12, 0.15, 0.20, 0.22 * item.colour[3] / Math.sqrt(casting.length)]});
        this.triangles(mesh);
      }
    }
    gl.disable(gl.STENCIL_TEST);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  drawSurface({item, mesh, place}, eye) {
    this.use(this.surface, {
      u_clip_T_world: this.clip, u_world_T_item: place, u_eye: eye,
      u_colour: item.colour, u_emission: item.emission, u_shininess: item.shininess,
      u_metalness: item.metalness});
    this.triangles(mesh);
  }

  drawEdges({mesh, place}) {
    const gl = this.gl;
    if (mesh.pairs === 0) return;
    this.use(this.plain, {
      u_clip_T_world: this.clip, u_world_T_item: place, u_colour: [0.07, 0.09, 0.12, 0.55]});
    gl.bindVertexArray(mesh.edges);
    gl.drawElements(gl.LINES, mesh.pairs, gl.UNSIGNED_INT, 0);
  }

  drawPaths(frame, still) {
    if (this.shows.path) {
      this.header.lines.forEach((line, i) =>
        this.drawLine(this.lines[i], 0, this.lines[i].pieces, still, line.colour, line.width));
      for (const trace of this.traces) {
        const now = Math.min(Math.floor(frame), trace.pieces);
        this.drawLine(trace, now, trace.pieces, still, [0.55, 0.12, 0.55, 0.3], 2);
        this.drawLine(trace, 0, now, still, [0.60, 0.08, 0.55, 1], 3);
      }
    }
    if (!this.shows.axes) return;
    for (const triad of this.header.triads) {
      const m = this.place(triad, frame);
      for (let i = 0; i < 12; ++i) m[i] *= i % 4 === 3 ? 1 : triad.length;
      this.axes.forEach((axis, k) => {
        const colour = [0.1, 0.1, 0.1, 1];
        colour[k] = k === 1 ? 0.6 : 0.85;
        this.drawLine(axis, 0, 1, m, colour, 4);
      });
    }
  }
}
