// SPDX-License-Identifier: Apache-2.0
// A camera that goes round a target: drag turns, right or middle button, Shift or two fingers move,
// wheel or two fingers zoom, a double click goes back.
'use strict';

const kFieldOfView = 32 * Math.PI / 180;

/// Angles of the standard views: azimuth from +x towards +y, elevation above the floor [deg].
const kViews = {
  isometric: [-55, 24], front: [-90, 0], back: [90, 0], left: [180, 0], right: [0, 0],
  top: [-90, 89.9], bottom: [-90, -89.9]};

/// The target's distance from which a ball of `radius` just fits.
function fittingDistance(radius, aspect) {
  return radius / Math.sin(kFieldOfView / 2) / Math.min(1, aspect);
}

class OrbitCamera {
  /// wanted: how the header describes the first view; box: [low, high] of the scene [m].
  constructor(wanted, box) {
    this.wanted = wanted;
    this.box = box;
    this.radius = Math.max(1e-6, 0.5 * Math.hypot(...sub(box[1], box[0])));
    this.perspective = wanted.perspective;
    this.aspect = 4 / 3;
    this.reset();
  }
  reset() {
    this.target = [0, 1, 2].map((i) => 0.5 * (this.box[0][i] + this.box[1][i]));
    const eye = this.wanted.eye;
    if (!eye) {
      [this.azimuth, this.elevation] = kViews[this.wanted.view].map((d) => d * Math.PI / 180);
      this.scale = this.fittingScale() / (this.wanted.zoom || 1);
      return;
    }
    this.target = this.wanted.target.slice();
    const way = sub(eye, this.target);
    const distance = Math.hypot(...way);
    this.azimuth = Math.atan2(way[1], way[0]);
    this.elevation = Math.asin(way[2] / distance);
    this.scale = distance / fittingDistance(this.radius, 4 / 3) / (this.wanted.zoom || 1);
  }
  /// The scale at which all corners of the box are just in a picture of 4:3.
  fittingScale() {
    const back = this.back, right = unit(cross([0, 0, 1], back)), top = cross(back, right);
    const tangent = Math.tan(kFieldOfView / 2);
    let distance = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const p = sub([0, 1, 2].map((k) => this.box[(corner >> k) & 1][k]), this.target);
      const side = Math.max(Math.abs(dot(p, top)), Math.abs(dot(p, right)) * 3 / 4);
      distance = Math.max(distance, dot(p, back) + side / tangent);
    }
    return 1.03 * distance / fittingDistance(this.radius, 4 / 3);
  }
  /// What restore() takes.
  state() {
    const {wanted, perspective, target, azimuth, elevation, scale} = this;
    return {wanted, perspective, target, azimuth, elevation, scale};
  }
  restore(state) {
    Object.assign(this, state);
  }
  look(view) {
    this.wanted = {view, perspective: this.perspective, zoom: 1};
    this.reset();
  }
  get distance() {
    return this.scale * fittingDistance(this.radius, Math.min(this.aspect, 4 / 3));
  }
  turn(dx, dy) {
    this.azimuth -= dx;
    const most = 0.4995 * Math.PI;
    this.elevation = Math.min(Math.max(this.elevation + dy, -most), most);
  }
  zoom(factor) {
    this.scale = Math.min(Math.max(this.scale * factor, 0.01), 20);
  }
  /// By shares of the picture's height.
  pan(dx, dy) {
    const height = 2 * this.distance * Math.tan(kFieldOfView / 2);
    const back = this.back;
    const right = unit(cross([0, 0, 1], back));
    const top = cross(back, right);
    this.target = addScaled(addScaled(this.target, right, -dx * height), top, dy * height);
  }
  get back() {
    const c = Math.cos(this.elevation);
    return [c * Math.cos(this.azimuth), c * Math.sin(this.azimuth), Math.sin(this.elevation)];
  }
  get eye() {
    return addScaled(this.target, this.back, this.distance);
  }
  /// clip_T_world of a picture `aspect` times as wide as high.
  matrix(aspect) {
    this.aspect = aspect;
    const d = this.distance;
    const far = d + 40 * this.radius;
    const near = Math.max(1e-3 * d, d - 4 * this.radius);
    const lens = this.perspective ?
        perspective(kFieldOfView, aspect, near, far) :
        orthographic(2 * d * Math.tan(kFieldOfView / 2), aspect, d - far, far);
    return multiply(lens, lookAt(this.eye, this.target, [0, 0, 1]));
  }

  /// Lets mouse and fingers on an element move the camera; `changed` is called after each move.
  attach(element, changed) {
    const pointers = new Map();
    element.style.touchAction = 'none';
    element.addEventListener('contextmenu', (event) => event.preventDefault());
    element.addEventListener('pointerdown', (event) => {
      element.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    const release = (event) => pointers.delete(event.pointerId);
    element.addEventListener('pointerup', release);
    element.addEventListener('pointercancel', release);
    element.addEventListener('pointermove', (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const now = [event.clientX, event.clientY];
      const dx = (now[0] - before[0]) / element.clientHeight;
      const dy = (now[1] - before[1]) / element.clientHeight;
      if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const span = (at) => Math.max(1, Math.hypot(at[0] - other[0], at[1] - other[1]));
        this.zoom(span(before) / span(now));
        this.pan(dx / 2, dy / 2);
      } else if (event.shiftKey || (event.buttons & 6) !== 0) {
        this.pan(dx, dy);
      } else {
        this.turn(dx * Math.PI, dy * Math.PI);
      }
      pointers.set(event.pointerId, now);
      changed();
    });
    element.addEventListener('wheel', (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      this.zoom(Math.exp(Math.min(Math.max(event.deltaY * lines, -200), 200) * 0.0015));
      changed();
    }, {passive: false});
    element.addEventListener('dblclick', () => {
      this.reset();
      changed();
    });
  }
}
