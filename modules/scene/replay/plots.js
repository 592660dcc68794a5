// SPDX-License-Identifier: Apache-2.0
// Plots of columns over time with a cursor; one panel for the columns of a kind.
'use strict';

const kCurveColours = [
  '#1f5fbf', '#d1495b', '#2e933c', '#e08e1b', '#7b4fa6', '#13838f', '#8a5a2b', '#5b6770'];

/// Even round numbers that span low..high: about `count` of them.
function ticksOf(low, high, count) {
  const raw = (high - low) / Math.max(1, count);
  if (!(raw > 0)) return [low];
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = power * [1, 2, 5, 10].find((k) => k * power >= raw * (1 - 1e-9));
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i <= Math.floor(high / step + 1e-9); ++i)
    ticks.push(i * step);
  return ticks;
}

/// A number for people: four digits that count; less than a millionth of `scale` is nothing.
function shortNumber(x, scale = 0) {
  if (!Number.isFinite(x)) return '–';
  const size = Math.abs(x);
  if (size < 1e-6 * scale) return '0';
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return x.toExponential(2).replace('-', '−');
  return String(Number(x.toPrecision(4))).replace('-', '−');
}

/// Columns whose names differ in their last number only are of a kind: q1, q2; not tau1 and q1.
function panelsOf(columns) {
  const panels = new Map();
  columns.forEach((column, i) => {
    const stem = column.name.replace(/\d+$/, '');
    const key = stem + '|' + column.unit;
    if (!panels.has(key)) panels.set(key, {stem, unit: column.unit, columns: []});
    panels.get(key).columns.push(i);
  });
  return [...panels.values()];
}

/// Index of the last time that is not after `time`; times increase.
function indexAt(times, time) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/// The value of a column at a time, linear between its samples.
function valueAt(times, values, time) {
  const i = indexAt(times, time), j = Math.min(i + 1, times.length - 1);
  if (j === i || time <= times[i]) return values[i];
  const u = (time - times[i]) / (times[j] - times[i]);
  return (1 - u) * values[i] + u * values[j];
}

class Panel {
  constructor(parent, panel, header, data, seek) {
    this.panel = panel;
    this.header = header;
    this.data = data;
    this.element = document.createElement('figure');
    const caption = document.createElement('figcaption');
    const title = document.createElement('b');
    title.textContent = panel.stem + (panel.unit ? ' [' + panel.unit + ']' : '');
    caption.append(title);
    this.readings = panel.columns.map((index, i) => {
      const reading = document.createElement('span');
      reading.style.color = kCurveColours[i % kCurveColours.length];
      reading.title = header.columns[index].doc;
      caption.append(reading);
      return reading;
    });
    this.canvas = document.createElement('canvas');
    this.element.append(caption, this.canvas);
    parent.append(this.element);
    const move = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (this.width - this.left - this.right);
      seek(Math.min(Math.max(share, 0), 1));
    };
    this.canvas.addEventListener('pointerdown', (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      move(event);
    });
    this.canvas.addEventListener('pointermove', (event) => {
      if (event.buttons & 1) move(event);
    });
    this.left = 58;
    this.right = 12;
  }

  /// The lowest and the highest value shown.
  range() {
    const columns = this.panel.columns.map((i) => this.header.columns[i]);
    let low = Math.min(...columns.map((c) => c.low));
    let high = Math.max(...columns.map((c) => c.high));
    if (!(high > low)) {
      const half = 0.5 * Math.max(Math.abs(high), 1e-9);
      [low, high] = [low - half, high + half];
    }
    const margin = 0.06 * (high - low);
    return [low - margin, high + margin];
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.max(1, Math.round(this.width * ratio));
    this.canvas.height = Math.max(1, Math.round(this.height * ratio));
    // What stays is drawn once.
    this.still = document.createElement('canvas');
    this.still.width = this.canvas.width;
    this.still.height = this.canvas.height;
    const context = this.still.getContext('2d');
    context.scale(ratio, ratio);
    this.drawStill(context);
  }

  /// A colour of the page's style, or the one that goes with a light page.
  colour(name, usual) {
    return getComputedStyle(this.element).getPropertyValue(name).trim() || usual;
  }

  drawStill(context) {
    const {times} = this.data;
    const [start, end] = [times[0], times[times.length - 1]];
    const [low, high] = this.range();
    const top = 6, bottom = 20;
    this.x = (t) => this.left + (t - start) / (end - start) * (this.width - this.left - this.right);
    this.y = (v) => top + (high - v) / (high - low) * (this.height - top - bottom);
    context.font = '11px system-ui, sans-serif';
    context.lineWidth = 1;
    context.fillStyle = this.colour('--faint', '#5b6770');
    context.strokeStyle = this.colour('--grid', '#e3e7ec');
    context.beginPath();
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    for (const v of ticksOf(low, high, this.height / 40)) {
      context.moveTo(this.left, this.y(v));
      context.lineTo(this.width - this.right, this.y(v));
      context.fillText(shortNumber(v, high - low), this.left - 6, this.y(v));
    }
    context.textAlign = 'center';
    context.textBaseline = 'top';
    for (const t of ticksOf(start, end, this.width / 90)) {
      context.moveTo(this.x(t), top);
      context.lineTo(this.x(t), this.height - bottom);
      context.fillText(shortNumber(t) + ' s', this.x(t), this.height - bottom + 5);
    }
    context.stroke();
    context.save();
    context.beginPath();
    context.rect(this.left, top, this.width - this.left - this.right, this.height - top - bottom);
    context.clip();
    this.panel.columns.forEach((index, i) => {
      const column = this.header.columns[index];
      context.strokeStyle = kCurveColours[i % kCurveColours.length];
      context.lineWidth = 1;
      context.setLineDash([5, 4]);
      for (const limit of [column.lower, column.upper])
        if (limit !== undefined && limit > low && limit < high) {
          context.beginPath();
          context.moveTo(this.left, this.y(limit));
          context.lineTo(this.width, this.y(limit));
          context.stroke();
        }
      context.setLineDash([]);
      context.lineWidth = 1.5;
      context.lineJoin = 'round';
      context.beginPath();
      const values = this.data.columns[index];
      let isDown = false;
      for (let k = 0; k < values.length; ++k) {
        if (Number.isNaN(values[k])) {
          isDown = false;
          continue;
        }
        if (isDown) context.lineTo(this.x(times[k]), this.y(values[k]));
        else context.moveTo(this.x(times[k]), this.y(values[k]));
        isDown = true;
      }
      context.stroke();
    });
    context.restore();
  }

  draw(time) {
    const ratio = window.devicePixelRatio || 1;
    const context = this.canvas.getContext('2d');
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.still, 0, 0);
    context.scale(ratio, ratio);
    context.strokeStyle = this.colour('--text', '#20262e');
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(this.x(time), 6);
    context.lineTo(this.x(time), this.height - 20);
    context.stroke();
    const [low, high] = this.range();
    const scale = Math.max(Math.abs(low), Math.abs(high));
    this.panel.columns.forEach((index, i) => {
      const value = valueAt(this.data.times, this.data.columns[index], time);
      this.readings[i].textContent =
          this.header.columns[index].name + ' ' + shortNumber(value, scale);
      if (Number.isNaN(value)) return;
      context.fillStyle = kCurveColours[i % kCurveColours.length];
      context.beginPath();
      context.arc(this.x(time), this.y(value), 3, 0, 2 * Math.PI);
      context.fill();
    });
  }
}
