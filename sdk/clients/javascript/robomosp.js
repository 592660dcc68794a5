// SPDX-License-Identifier: Apache-2.0
// The client of ROBOMOSP for JavaScript: one module without dependencies, for browsers and Node 18
// or later. What goes over the wire: docs/user/remote/protocol.md.
//
//   import {connect} from './robomosp.js';
//   const r = await connect('127.0.0.1:7007');              // in Node; connect() in a page of the server
//   const arm = await r.robot.get('pa10');
//   const {q} = await arm.solve_ik({target: [0.557, 0, 0.374, '180 deg', 0, '180 deg']});
//   await r.close();
//
// A method is called with its arguments by name, in one object, or by place: arm.fk({q: 'ready'}),
// r.robot.fk(arm, 'ready'). Vectors come as Float64Array, matrices as Matrix.
'use strict';

export const PROTOCOL = 1;  // the version that this file speaks
export const DEFAULT_PORT = 7007;
const kLongestLine = 8 * 1024 * 1024;      // of a request, where the server does not say otherwise
const kLongestAnswer = 256 * 1024 * 1024;  // after which a server is not believed
const kMostEvents = 100_000;               // that wait in a subscription
const kFew = 8;                            // a typed array of fewer numbers goes as digits
const kDeepest = 60;

// --- errors ---

/// What ROBOMOSP, or this client, refused or could not do. `message` is the whole sentence, `code` a
/// word such as 'invalid_argument' or 'unreachable', `where` the place, `hint` what to do.
export class RobomospError extends Error {
  constructor(message, code = 'internal', {where = '', hint = '', number, data = {}} = {}) {
    super(message);
    this.name = new.target.name;
    Object.assign(this, {code, where, hint, number, data});
  }
  /// What is wrong, one table for each cause: code, class, text, subject, extent, witness,
  /// remedies. Empty where the server sends none, and for errors of this client.
  get faults() {
    const given = this.data?.faults;
    return Array.isArray(given) ? given.filter((f) => f && typeof f === 'object') : [];
  }
}
/// The request or job was cancelled.
export class Cancelled extends RobomospError {}
/// No answer came within the time; the request was cancelled.
export class TimedOut extends RobomospError {}
/// The connection has ended, or there was none.
export class ConnectionLost extends RobomospError {}
/// The other end does not speak as ROBOMOSP does; the connection is closed.
export class ProtocolError extends ConnectionLost {}

function wrongUse(message, hint = '') {
  return new RobomospError(message + (hint ? ' ' + hint : ''), 'invalid_argument', {hint});
}
function errorOf(fault) {
  const text = (x) => typeof x === 'string' ? x : '';
  const data = fault.data && typeof fault.data === 'object' ? fault.data : {};
  const byNumber = {
    '-32700': 'syntax', '-32600': 'usage', '-32601': 'unknown_name', '-32602': 'invalid_argument'};
  const code = text(data.code) || byNumber[fault.code] || 'internal';
  const message = text(fault.message) || 'the server gave an error without words';
  return new (code === 'cancelled' ? Cancelled : RobomospError)(
    message, code, {where: text(data.where), hint: text(data.hint), number: fault.code, data});
}
/// What a stranger sent, as a short text on one line.
function shown(text, most = 60) {
  const clean = text.slice(0, most).replace(/[^\x20-\x7e]/g, '.');
  return '"' + clean + (text.length > most ? '...' : '') + '"';
}

// --- values ---

/// Numbers in rows: of `rows` times `cols`, row after row.
export class Matrix extends Float64Array {
  static get [Symbol.species]() { return Float64Array; }
  row(i) { return new Float64Array(this.buffer, this.byteOffset + 8 * i * this.cols, this.cols); }
  toRows() { return Array.from({length: this.rows}, (_, i) => Array.from(this.row(i))); }
}
function matrixOf(numbers, rows, cols) {
  const out = new Matrix(numbers.buffer);
  out.rows = rows;
  out.cols = cols;
  return out;
}

const isLittleEndian = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;

/// Bytes as base64 (RFC 4648), and back; null when the text is none.
export function toBase64(bytes) {
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000)
    text += String.fromCharCode.apply(null, bytes.subarray(i, i + 0x8000));
  return btoa(text);
}
export function fromBase64(text) {
  let packed;
  try {
    packed = atob(text);
  } catch (fault) {
    return null;
  }
  const bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; ++i) bytes[i] = packed.charCodeAt(i);
  return bytes;
}
function swapped(bytes) {
  if (isLittleEndian) return bytes;
  const out = bytes.slice();
  for (let i = 0; i < out.length; i += 8) out.subarray(i, i + 8).reverse();
  return out;
}
function packed(numbers, shape) {
  const doubles = Float64Array.from(numbers);
  return {$array: {shape, base64: toBase64(swapped(new Uint8Array(doubles.buffer)))}};
}

/// A picture: `png` holds the bytes of a PNG file.
export class Picture {
  constructor(png, about) {
    this.png = png;
    this.about = about;
  }
  /// For the attribute src of an image.
  get url() { return 'data:image/png;base64,' + toBase64(this.png); }
  /// In Node: writes a file.
  async save(file) {
    await (await import('node:fs/promises')).writeFile(file, this.png);
  }
}

/// A record, recording or run of the program that the connection leads to. Its methods are the
/// commands of its kind: arm.fk({q: 'ready'}). kind, number and name say what it is.
export class Handle {
  constructor(owner, kind, number, name) {
    Object.defineProperty(this, '_', {value: {owner, generation: owner._generation}});
    Object.assign(this, {kind, number, name});
    return new Proxy(this, {
      get: (target, key) => key in target || !isCommandWord(key) ?
          target[key] : command(owner, kind + '.' + key, target)});
  }
  toString() {
    return this.kind + (this.name ? ':' + this.name : '') + '#' + this.number;
  }
  is(other) {
    return other instanceof Handle && other._.owner === this._.owner &&
      other._.generation === this._.generation && other.kind === this.kind &&
      other.number === this.number;
  }
}

/// Long work: `await job.wait((p) => ...)` gives its result.
export class Job extends Handle {
  /// What was last told of it: {state, fraction, what}.
  get latest() { return this._.owner._jobs.get(this.number) || null; }
  progress() { return this._.owner.call('job.progress', {id: this}); }
  cancel() { return this._.owner.call('job.cancel', {id: this}); }
  async wait(onProgress, options) {
    const {owner} = this._;
    if (onProgress) owner._watchers.set(this.number, onProgress);
    try {
      return await owner.call('job.wait', {id: this}, options);
    } finally {
      owner._watchers.delete(this.number);
    }
  }
}

function isCommandWord(key) {
  // What JavaScript itself asks objects for is no command.
  return typeof key === 'string' && /^[a-z][a-z0-9_]*$/.test(key) && key !== 'then' &&
    key !== 'constructor';
}
function isPlain(v) {
  if (v === null || typeof v !== 'object') return false;
  const kind = Object.getPrototypeOf(v);
  return kind === Object.prototype || kind === null;
}

/// The function of a command: command(args...), command.job(args...).
function command(owner, name, bound = null) {
  const run = (...args) => owner._invoke(name, bound, args, false);
  run.job = (...args) => owner._invoke(name, bound, args, true);
  run.describe = () => owner._spec(name);
  return run;
}

// --- connections ---

/// What happens, in order: `for await (const event of subscription)`. More than 100,000 that wait are
/// left out, the oldest first; `leftOut` counts them.
export class Subscription {
  constructor(owner, wanted) {
    Object.assign(this, {owner, wanted, number: null, waiting: [], leftOut: 0, isClosed: false});
    this.wake = null;
    this.call = null;
  }
  _add(event) {
    if (this.call) return void this.call(event);
    this.waiting.push(event);
    if (this.waiting.length > kMostEvents) {
      this.waiting.shift();
      ++this.leftOut;
    }
    this._ring();
  }
  _ring() {
    const wake = this.wake;
    this.wake = null;
    if (wake) wake();
  }
  async close() {
    if (this.isClosed) return;
    this.isClosed = true;
    this.owner._subscriptions.delete(this);
    this._ring();
    if (this.owner.isOpen && this.number !== null)
      await this.owner.call('server.unsubscribe', {subscription: this.number});
  }
  async* [Symbol.asyncIterator]() {
    try {
      for (;;) {
        if (this.waiting.length) yield this.waiting.shift();
        else if (this.isClosed) return;
        else if (this.owner._lost) throw this.owner._lost;
        else await new Promise((wake) => { this.wake = wake; });
      }
    } finally {
      await this.close().catch(() => {});
    }
  }
}

export class Connection {
  constructor(address, open, {token, client, timeout}) {
    Object.assign(this, {
      address, hello: null, timeout, _open: open, _token: token, _client: client, _generation: 0,
      _next: 1, _pending: new Map(), _subscriptions: new Set(), _early: new Map(), _jobs: new Map(),
      _watchers: new Map(), _specs: new Map(), _lost: null, _closing: '', _hasSpoken: false,
      _longest: kLongestLine, _transport: null, onClose: null});
    // Names that are not here are topics: r.robot.fk(...).
    const self = new Proxy(this, {
      get: (target, key) => key in target || !isCommandWord(key) ? target[key] :
        new Proxy((...args) => self._invoke(key, null, args, false), {
          get: (of, word) => isCommandWord(word) ? command(self, key + '.' + word) : of[word]})});
    return self;
  }
  get isOpen() { return this._lost === null && this._transport !== null; }

  async _start() {
    this._lost = null;
    this._closing = '';
    this._hasSpoken = false;
    let transport = null;
    const mine = () => this._transport === transport;
    transport = await this._open({
      line: (text) => mine() && this._take(text),
      end: (why) => mine() && this._over(why)});
    this._transport = transport;
    const params = {protocol: PROTOCOL, client: this._client};
    if (this._token) params.token = String(this._token);
    let hello;
    try {
      hello = await this._ask('server.hello', params, {timeout: this.timeout || 10, arrays: false});
    } catch (fault) {
      const hasNoHello = transport.isChild && fault.number === -32601;
      if (!hasNoHello) this._shut();
      if (fault instanceof TimedOut)
        throw new TimedOut(`${this.address} did not answer within ${this.timeout || 10} s. Is it a ` +
          'ROBOMOSP server?', 'io', {hint: 'Is it a ROBOMOSP server?'});
      if (fault instanceof ConnectionLost) throw fault;
      if (hasNoHello) {
        hello = {program: 'robomosp', protocol: PROTOCOL, instance: 'own', limits: {}};
      } else if (fault.number === -32601 || fault.code === 'unknown_name') {
        throw new ProtocolError(
          `${this.address} is not a ROBOMOSP server: ${fault.message}`, 'unsupported');
      } else {
        throw new (fault.code === 'unsupported' ? ProtocolError : RobomospError)(
          `${this.address}: ${fault.message}`, fault.code, fault);
      }
    }
    if (!hello || hello.program !== 'robomosp')
      throw this._fail(`${this.address} is not a ROBOMOSP server.`);
    if (hello.protocol !== PROTOCOL)
      throw this._fail(`${this.address} speaks version ${hello.protocol} of the protocol, and this ` +
        `client version ${PROTOCOL}.`);
    // Handles keep their meaning for as long as the program over there runs.
    if (this.hello && (!hello.instance || hello.instance !== this.hello.instance)) {
      ++this._generation;
      this._specs.clear();
      this._jobs.clear();
    }
    this.hello = hello;
    this._longest = hello.limits && hello.limits.line > 0 ? hello.limits.line : kLongestLine;
    for (const subscription of this._subscriptions) {
      subscription.number = null;
      await this._subscribe(subscription);
    }
  }
  /// Connects again, and subscribes to what was subscribed to.
  async reconnect() {
    this._shut();
    this._over(new ConnectionLost(`${this.address}: connecting again.`, 'io'));
    await this._start();
  }
  async close() {
    if (this.isOpen && !this._transport.isChild)
      await this._ask('server.bye', {}, {timeout: 1}).catch(() => {});
    this._shut();
    this._over(new ConnectionLost(`The connection to ${this.address} was closed.`, 'io'));
  }
  _shut() {
    const transport = this._transport;
    this._transport = null;
    if (transport) transport.close();
  }
  /// Ends everything that waits.
  _over(why) {
    this._shut();
    if (this._lost) return;
    this._lost = why instanceof RobomospError ? why :
      this._closing ? new ConnectionLost(
        `${this.address} closed the connection: ${this._closing}`, 'io', {hint: this._closing}) :
      !this._hasSpoken ? new ConnectionLost(
        `${this.address} closed the connection without an answer${why ? ` (${why})` : ''}. Is it a ` +
        'ROBOMOSP server?', 'io') :
      new ConnectionLost(`${this.address} closed the connection${why ? `: ${why}` : '.'}`, 'io');
    const pending = [...this._pending.values()];
    this._pending.clear();
    for (const slot of pending) slot.reject(this._lost);
    for (const subscription of this._subscriptions) subscription._ring();
    if (this.onClose) this.onClose(this._lost);
  }
  _fail(sentence) {
    const fault = new ProtocolError(sentence, 'unsupported');
    this._over(fault);
    return fault;
  }

  // what comes

  _take(line) {
    if (!line.trim()) return;
    let message;
    try {
      message = JSON.parse(line, (_, v) => this._read(v));
    } catch (fault) {
      return void this._fail(this._hasSpoken ?
        `${this.address} sent an answer that is not right: ${fault.message}.` :
        `${this.address} is not a ROBOMOSP server: it answered ${shown(line)}.`);
    }
    this._hasSpoken = true;
    for (const one of Array.isArray(message) ? message : [message]) {
      if (one === null || typeof one !== 'object' || ('method' in one && 'id' in one))
        return void this._fail(`${this.address} sent what is no answer: ${shown(line)}.`);
      if ('method' in one) this._notice(one.method, one.params);
      else if (!this._answer(one))
        return void this._fail(`${this.address} sent what is no answer: ${shown(line)}.`);
    }
  }
  _answer(one) {
    const isFault = one.error !== undefined && one.error !== null;
    if (isFault ? typeof one.error !== 'object' : !('result' in one)) return false;
    let {id} = one;
    // It could not read which request it was.
    if (id === null && isFault && this._pending.size === 1) [id] = this._pending.keys();
    const slot = this._pending.get(id);
    if (!slot) return id !== null || !isFault;  // nobody waits for it any more
    this._pending.delete(id);
    if (isFault) slot.reject(errorOf(one.error));
    else slot.resolve(one.result);
    return true;
  }
  _notice(method, params) {
    if (params === null || typeof params !== 'object') return;
    if (method === 'server.closing') {
      this._closing = typeof params.reason === 'string' ? params.reason.trim() : '';
    } else if (method === 'job.progress' && params.id instanceof Job) {
      this._jobs.set(params.id.number, params);
      if (this._jobs.size > 10_000) this._jobs.delete(this._jobs.keys().next().value);
      const watcher = this._watchers.get(params.id.number);
      if (watcher) watcher(params);
    } else if (method === 'event') {
      for (const subscription of this._subscriptions)
        if (subscription.number === params.subscription) return subscription._add(params);
      // It came before the answer that names its subscription.
      const early = this._early.get(params.subscription) || [];
      if (early.length < 1000 && this._early.size < 100) early.push(params);
      this._early.set(params.subscription, early);
    }
  }
  _read(v) {
    if (v === null || typeof v !== 'object') return v;
    if (v.$handle && Object.keys(v).length === 1) {
      const {kind, number, name} = v.$handle;
      if (typeof kind !== 'string' || !Number.isSafeInteger(number))
        throw new Error('it holds a handle that is none');
      return new (kind === 'job' ? Job : Handle)(
        this, kind, number, typeof name === 'string' ? name : '');
    }
    if (!v.$array || Object.keys(v).length !== 1) return v;
    const {shape, base64} = v.$array;
    const bytes = typeof base64 === 'string' ? fromBase64(base64) : null;
    if (!bytes || !Array.isArray(shape) || shape.length < 1 || shape.length > 2 ||
        !shape.every((n) => Number.isSafeInteger(n) && n >= 0) ||
        bytes.length !== 8 * shape.reduce((a, b) => a * b, 1))
      throw new Error('it holds an array that is none');
    const numbers = new Float64Array(swapped(bytes).buffer);
    return shape.length === 1 ? numbers : matrixOf(numbers, ...shape);
  }

  // what goes

  _sendable(v, depth = 0) {
    if (v === null || typeof v === 'boolean' || typeof v === 'string') return v;
    if (typeof v === 'number')
      return Number.isFinite(v) ? v : Number.isNaN(v) ? 'nan' : v > 0 ? 'inf' : '-inf';
    if (depth > kDeepest) throw wrongUse('The arguments are nested too deeply.');
    if (v instanceof Handle) {
      if (v._.owner !== this)
        throw wrongUse(`${v} is of another connection.`, 'Get it by name through this one.');
      if (v._.generation !== this._generation)
        throw new RobomospError(`${v} is of a program that has ended. Get it again by name.`,
          'stale_handle', {hint: 'Get it again by name.'});
      return {$handle: {kind: v.kind, number: v.number, ...(v.name ? {name: v.name} : {})}};
    }
    if (v instanceof Matrix) return packed(v, [v.rows, v.cols]);
    if (ArrayBuffer.isView(v) && !(v instanceof DataView) && typeof v[0] !== 'bigint')
      return v.length < kFew ? Array.from(v, (x) => this._sendable(x)) : packed(v, [v.length]);
    if (Array.isArray(v)) {
      if (v.length >= 64 && v.every((x) => typeof x === 'number') &&
          v.some((x) => !Number.isInteger(x)))
        return packed(v, [v.length]);
      return v.map((x) => this._sendable(x === undefined ? null : x, depth + 1));
    }
    if (isPlain(v)) {
      const out = {};
      for (const [key, x] of Object.entries(v))
        if (x !== undefined) out[key] = this._sendable(x, depth + 1);
      return out;
    }
    throw wrongUse(`A value of the type ${typeof v} cannot be sent.`,
      'Give numbers, texts, lists, tables or handles.');
  }
  /// The promise of an answer, with cancel(). Options: timeout [s], signal, job, progress.
  _ask(method, params, {timeout = this.timeout, signal, job, progress, arrays = true} = {}) {
    const id = this._next++;
    let cancel = () => {};
    const promise = new Promise((resolve, reject) => {
      if (!this.isOpen)
        throw this._lost || new ConnectionLost(`There is no connection to ${this.address}.`, 'io');
      const message = {jsonrpc: '2.0', id, method};
      if (params && Object.keys(params).length) message.params = this._sendable(params);
      if (arrays) message.arrays = 'base64';
      if (job) message.job = true;
      if (progress) message.progress = true;
      const text = JSON.stringify(message);
      if (text.length > this._longest)
        throw wrongUse(`The request takes ${(text.length / 1048576).toFixed(1)} MiB, and the server ` +
          `reads ${this._longest / 1048576} at once.`, 'Send it in parts.');
      let timer = null;
      const end = (act) => (value) => {
        clearTimeout(timer);
        if (signal) signal.removeEventListener('abort', cancel);
        act(value);
      };
      const slot = {resolve: end(resolve), reject: end(reject)};
      cancel = () => {
        if (this._pending.has(id) && this.isOpen)
          this._transport.send(JSON.stringify(
            {jsonrpc: '2.0', method: 'rpc.cancel', params: {request: id}}));
      };
      if (timeout)
        timer = setTimeout(() => {
          cancel();
          this._pending.delete(id);
          slot.reject(new TimedOut(`${method} was not answered within ${timeout} s; it was cancelled.`,
            'cancelled', {where: method, hint: 'Give it more time, or start it as a job.'}));
        }, 1000 * timeout);
      this._pending.set(id, slot);
      this._transport.send(text);
      if (signal && signal.aborted) cancel();
      else if (signal) signal.addEventListener('abort', cancel);
    });
    promise.cancel = () => cancel();
    return promise;
  }
  /// A command or method by its name, with its arguments in an object or array. Options: timeout [s]
  /// (0 = none), signal (an AbortSignal), job (true: its handle is the answer at once). The promise
  /// has cancel().
  call(method, params = {}, options = {}) {
    const asked = this._ask(method, params, {...options, progress: options.job});
    const promise = asked.then((result) => this._finished(method, result, options.job));
    promise.cancel = asked.cancel;
    return promise;
  }
  _invoke(name, bound, args, job) {
    const named = args.length > 0 && isPlain(args[args.length - 1]) ? args[args.length - 1] : null;
    const places = [...(bound ? [bound] : []), ...(named ? args.slice(0, -1) : args)];
    if (!named) return this.call(name, places, {job});
    if (places.length === 0) return this.call(name, named, {job});
    if (places.length === 1 && bound) return this.call(name, {id: bound, ...named}, {job});
    let cancel = () => {};
    const promise = this._spec(name).then((spec) => {
      const names = spec ? spec.params.map((p) => p.name) : [];
      if (places.length > names.length)
        throw wrongUse(`${name} takes ${names.length} arguments.`);
      const given = {...named};
      places.forEach((value, i) => {
        if (names[i] in given) throw wrongUse(`${name}: ${names[i]} is given twice.`);
        given[names[i]] = value;
      });
      const asked = this.call(name, given, {job});
      cancel = asked.cancel;
      return asked;
    });
    promise.cancel = () => cancel();
    return promise;
  }
  /// What the program's table says of a command: {name, summary, params, returns, ...}; null when it
  /// has none of that name.
  async _spec(name) {
    if (!this._specs.has(name)) {
      const found = await this._ask('ioci.describe', {command: name}).catch((fault) => {
        if (fault instanceof ConnectionLost) throw fault;
        return [];
      });
      this._specs.set(name, Array.isArray(found) && found.length ? found[0] : null);
    }
    return this._specs.get(name);
  }
  async _finished(name, result, job) {
    if (job) return result;
    if (name.endsWith('.picture') && result && typeof result.png === 'string') {
      const png = fromBase64(result.png);
      if (!png) throw new ProtocolError(`${this.address} sent a picture that is none.`, 'unsupported');
      const {png: _, ...about} = result;
      return new Picture(png, about);
    }
    // JSON knows no infinite numbers; the table says which texts are some.
    const words = {inf: Infinity, '-inf': -Infinity, nan: NaN};
    const isWord = (v) => typeof v === 'string' && v in words;
    const tables = isPlain(result) ? [result] : Array.isArray(result) ? result.filter(isPlain) : [];
    if (isWord(result) || tables.some((table) => Object.values(table).some(isWord))) {
      const {returns = {}} = await this._spec(name) || {};
      if (isWord(result) && returns.type === 'real') return words[result];
      for (const table of tables)
        for (const field of returns.fields || [])
          if (field.type === 'real' && isWord(table[field.name]))
            table[field.name] = words[table[field.name]];
    }
    return result;
  }

  // what is more than one command

  /// What happens from now on: topics 'change', 'message', 'job', 'run', 'recording'; options of server.subscribe.
  async events(topics = [], options = {}) {
    if (this._transport && this._transport.isChild)
      throw new RobomospError('A program of its own sends no events; a server does.', 'unsupported');
    const wanted = {...options};
    if (topics.length) wanted.topics = typeof topics === 'string' ? [topics] : topics;
    const subscription = new Subscription(this, wanted);
    await this._subscribe(subscription);
    this._subscriptions.add(subscription);
    return subscription;
  }
  async _subscribe(subscription) {
    subscription.number = await this._ask('server.subscribe', subscription.wanted);
    const early = this._early.get(subscription.number) || [];
    this._early.delete(subscription.number);
    for (const event of early) subscription._add(event);
  }
  /// Calls a function with each event; close() of what it gives ends that.
  async onEvent(callback, topics = [], options = {}) {
    const subscription = await this.events(topics, options);
    subscription.call = callback;
    for (const event of subscription.waiting.splice(0)) callback(event);
    return subscription;
  }
  /// Many calls [[method, params], ...] in one message: a list of results, errors in their places.
  async batch(calls) {
    const slots = calls.map(([method, params = {}]) => {
      const id = this._next++;
      const message = {jsonrpc: '2.0', id, method, arrays: 'base64'};
      if (Object.keys(params).length) message.params = this._sendable(params);
      const answer = new Promise((resolve) => this._pending.set(id, {resolve, reject: resolve}));
      return {method, message, answer};
    });
    if (slots.length === 0) return [];
    if (!this.isOpen) throw this._lost;
    this._transport.send(JSON.stringify(slots.map((s) => s.message)));
    return Promise.all(slots.map(async ({method, answer}) => {
      const result = await answer;
      return result instanceof Error ? result : this._finished(method, result);
    }));
  }
  /// Runs a script over there: {value or values, output}.
  lua(code, options) { return this.call('lua.eval', {code}, options); }
  /// A line of the program of 2006.
  classic(line) { return this.call('ioci.classic', {line}); }
  /// The bytes of a file over there.
  async readFile(file) {
    const parts = [];
    for (let offset = 0;;) {
      const part = await this.call('file.read', {file, offset, length: 1 << 20});
      const bytes = fromBase64(part.base64);
      if (!bytes) throw new ProtocolError(`${this.address} sent no bytes of ${file}.`, 'unsupported');
      parts.push(bytes);
      offset += bytes.length;
      if (part.is_end || bytes.length === 0) break;
    }
    const whole = new Uint8Array(parts.reduce((sum, p) => sum + p.length, 0));
    let at = 0;
    for (const part of parts) {
      whole.set(part, at);
      at += part.length;
    }
    return whole;
  }
  async writeFile(file, bytes) {
    for (let at = 0; at === 0 || at < bytes.length; at += 1 << 20)
      await this.call('file.write', {
        file, base64: toBase64(bytes.subarray(at, at + (1 << 20))), append: at > 0});
  }
}

// --- ways to the program: each opens with {line(text), end(why)} and gives {send(text), close()} ---

function webSocket(url) {
  return ({line, end}) => new Promise((resolve, reject) => {
    if (typeof WebSocket === 'undefined')
      return reject(wrongUse('There is no WebSocket here.', 'Give an address: 127.0.0.1:7007.'));
    let socket;
    try {
      socket = new WebSocket(url);
    } catch (fault) {
      return reject(wrongUse(`${url} is no address: ${fault.message}.`));
    }
    let isOpen = false;
    socket.onopen = () => {
      isOpen = true;
      resolve({send: (text) => socket.send(text), close: () => socket.close()});
    };
    socket.onmessage = ({data}) => line(typeof data === 'string' ? data : '\u0000');
    socket.onclose = ({reason}) => {
      if (isOpen) return end(reason);
      reject(new ConnectionLost(
        `${url} cannot be reached. Does \`robomosp serve --browser\` run there, and may pages of this ` +
        'origin connect?', 'io', {hint: 'Start it with --browser, and --origin for other pages.'}));
    };
  });
}

/// Cuts bytes into lines. [Node]
function lineReader(line, fail) {
  const decoder = new TextDecoder('utf-8');
  let parts = [], size = 0;
  return (chunk) => {
    let begin = 0;
    for (let at; (at = chunk.indexOf(10, begin)) >= 0; begin = at + 1) {
      parts.push(chunk.subarray(begin, at));
      const whole = parts.length === 1 ? parts[0] : Buffer.concat(parts);
      parts = [];
      size = 0;
      line(decoder.decode(whole));
    }
    if (begin < chunk.length) parts.push(chunk.subarray(begin));
    size += chunk.length - begin;
    if (size > kLongestAnswer) fail('it sends a line without end');
  };
}
function parseAddress(text) {
  if (typeof text !== 'string' || !text.trim())
    throw wrongUse('An address is a text.', 'Give "127.0.0.1:7007", "unix:/path" or "host:port".');
  if (text.startsWith('unix:') && text.length > 5) return {path: text.slice(5), isLocal: true};
  const match = /^(?:\[([^[\]]+)\]|([^:[\]/\s]+))(?::(\d+))?$/.exec(text.trim());
  const port = match ? Number(match[3] || DEFAULT_PORT) : 0;
  if (!match || port < 1 || port > 65535)
    throw wrongUse(`"${text}" is not an address.`,
      'Give "host:port", "[::1]:7007", "unix:/path" or "ws://host:port/socket".');
  const host = match[1] || match[2];
  return {host, port, isLocal: host === 'localhost' || host === '::1' || host.startsWith('127.')};
}
function nodeSocket(address, text, tls) {
  const wantsTls = tls === undefined ? !address.isLocal : tls;
  return async ({line, end}) => {
    const where = address.path ? {path: address.path} : {host: address.host, port: address.port};
    const module = await import(wantsTls ? 'node:tls' : 'node:net');
    return new Promise((resolve, reject) => {
      const socket = module.connect({
        ...where, minVersion: 'TLSv1.2', ...(typeof tls === 'object' ? tls : {}),
        ...(wantsTls && address.host && !/^[\d.]+$|:/.test(address.host) ?
          {servername: address.host} : {})});
      let isOpen = false, why = '';
      socket.once(wantsTls ? 'secureConnect' : 'connect', () => {
        isOpen = true;
        socket.setNoDelay(true);
        resolve({send: (words) => socket.write(words + '\n'), close: () => socket.destroy()});
      });
      socket.on('data', lineReader(line, (reason) => {
        why = reason;
        socket.destroy();
      }));
      socket.on('error', (fault) => { why = fault.message; });
      socket.on('close', () => isOpen ? end(why) : reject(new ConnectionLost(
        `${text} cannot be reached: ${why}. Is \`robomosp serve\` running there?`, 'io',
        {hint: 'Is `robomosp serve` running there?'})));
    });
  };
}
function nodeChild(program, args) {
  return async ({line, end}) => {
    const {spawn} = await import('node:child_process');
    return new Promise((resolve, reject) => {
      const child = spawn(program, args, {stdio: ['pipe', 'pipe', 'inherit']});
      child.on('error', (fault) => reject(new ConnectionLost(
        `The program ${program} does not start: ${fault.message}.`, 'io',
        {hint: 'Set the variable ROBOMOSP_PROGRAM.'})));
      child.stdin.on('error', () => {});
      child.stdout.on('data', lineReader(line, () => child.kill()));
      child.on('close', (status) => end(`it has ended with status ${status}`));
      child.on('spawn', () => resolve({
        isChild: true, send: (text) => child.stdin.write(text + '\n'),
        close: () => child.stdin.end()}));
    });
  };
}

/// Connects to `robomosp serve`. address: '127.0.0.1:7007', 'host:port', 'unix:/path' in Node;
/// 'ws://host:port/socket' or 'wss://...' anywhere; left out in a page of the server: that server.
/// token; client: how it calls itself; timeout [s] of all calls, 0 = none; tls in Node: true, false
/// or options of node:tls, such as {ca}; on when left out for other machines.
export async function connect(address, {token, client = 'robomosp.js', timeout = 0, tls} = {}) {
  const isPage = typeof location !== 'undefined' && typeof process === 'undefined';
  let way;
  if (address === undefined && isPage)
    address = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/socket`;
  else if (address === undefined) address = `127.0.0.1:${DEFAULT_PORT}`;
  if (typeof address === 'string' && /^wss?:\/\//.test(address)) way = webSocket(address);
  else if (isPage)
    throw wrongUse(`A page cannot connect to ${address}.`, 'Give "ws://host:port/socket".');
  else way = nodeSocket(parseAddress(address), address, tls);
  const connection = new Connection(address, way, {token, client, timeout});
  await connection._start();
  return connection;
}

/// In Node: starts a program of its own, which ends with the connection.
export async function start(program = process.env.ROBOMOSP_PROGRAM || 'robomosp', {timeout = 0} = {}) {
  const connection = new Connection(
    program, nodeChild(program, ['rpc']), {client: 'robomosp.js', timeout});
  await connection._start();
  return connection;
}
