// SPDX-License-Identifier: Apache-2.0
// The client in JavaScript: against `robomosp rpc`, `robomosp serve` over TCP, a Unix socket, TLS and
// WebSocket, and servers that lie. node javascript_test.mjs
import assert from 'node:assert/strict';
import {execFileSync, spawn, spawnSync} from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';
import tls from 'node:tls';
import {fileURLToPath} from 'node:url';
import * as robomosp from '../../sdk/clients/javascript/robomosp.js';

// WebSocket is behind a flag in Node 20 and 21, and not there in 18.
if (typeof WebSocket === 'undefined' && !process.env.ROBOMOSP_TEST_AGAIN &&
    process.allowedNodeEnvironmentFlags.has('--experimental-websocket')) {
  const done = spawnSync(process.execPath,
    ['--experimental-websocket', '--no-warnings', fileURLToPath(import.meta.url)],
    {stdio: 'inherit', env: {...process.env, ROBOMOSP_TEST_AGAIN: '1'}});
  process.exit(done.status ?? 1);
}

const program = process.env.ROBOMOSP_PROGRAM || 'robomosp';
const goal = [0.557, 0, 0.374, Math.PI, 0, Math.PI];
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'rmp-js-'));
const tokens = path.join(folder, 'tokens');
const near = (a, b, tolerance) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);

const tests = [];
const test = (name, act) => tests.push({name, act});

/// A server on a free port and a socket; `address` is where it listens.
async function serve(...more) {
  const socket = path.join(folder, 's' + Math.random().toString(36).slice(2, 8));
  const child = spawn(program, ['serve', '--listen', '127.0.0.1:0', '--listen', `unix:${socket}`,
    '--browser', '--allow', 'reads,edits,simulates,files_read', '--token-file', tokens, ...more],
    {stdio: ['ignore', 'pipe', 'inherit']});
  let said = '';
  for await (const chunk of child.stdout) {
    said += chunk;
    if (said.includes('The page:')) break;
  }
  const [, port] = /127\.0\.0\.1:(\d+)/.exec(said);
  return {child, port, tcp: `127.0.0.1:${port}`, unix: `unix:${socket}`, ws: `ws://127.0.0.1:${port}/socket`,
    async stop(signal = 'SIGTERM') {
      child.kill(signal);
      if (child.exitCode === null && child.signalCode === null)
        await new Promise((done) => child.on('exit', done));
    }};
}
function grant(name, effects) {
  const list = effects.map((e) => `"${e}"`).join(',');
  return execFileSync(program, ['eval',
    `return server.grant{name="${name}", effects={${list}}, token_file="${tokens}"}`],
    {encoding: 'utf8'}).trim();
}
/// A server that answers each line as it is told.
async function liar(answer) {
  const server = net.createServer((socket) => {
    let text = '';
    socket.on('error', () => {});
    socket.on('data', (chunk) => {
      text += chunk;
      for (let at; (at = text.indexOf('\n')) >= 0; text = text.slice(at + 1)) {
        const line = text.slice(0, at);
        const said = answer(line.startsWith('{') ? JSON.parse(line) : line, socket);
        if (said !== undefined) socket.write(said);
      }
    });
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  return {address: `127.0.0.1:${server.address().port}`, close: () => server.close()};
}
const ok = (id, result) => JSON.stringify({jsonrpc: '2.0', id, result}) + '\n';
const hello = {program: 'robomosp', version: '9', protocol: 1, instance: 'a', limits: {line: 1000}};

async function student(r) {
  const arm = await r.robot.get('pa10');
  assert.equal(`${arm.kind} ${arm.name}`, 'robot pa10');
  const found = await arm.solve_ik({target: goal});
  assert.equal(found.status, 'solved');
  assert.ok(found.q instanceof Float64Array);
  const {position} = await arm.fk({q: found.q});
  goal.slice(0, 3).forEach((want, i) => near(position[i], want, 1e-9));
  const cell = await r.world.create({name: 'cell' + Math.random()});
  await cell.add_robot({robot: arm});
  await cell.set_robot_q({robot: 'pa10', q: found.q});
  (await arm.joint_values()).forEach((value, i) => near(value, found.q[i], 1e-12));
  try {
    const picture = await cell.picture({size: [64, 48], quality: 'draft'});
    assert.deepEqual([...picture.png.subarray(0, 4)], [0x89, 0x50, 0x4e, 0x47]);
    assert.equal(picture.about.width, 64);
  } catch (fault) {
    assert.match(fault.message, /no renderer/);
  }
  await cell.remove();
}
async function commands(r) {
  await student(r);
  const arm = await r.robot.get('pa10');
  const q = new Array(7).fill(0.1);
  const want = [...(await arm.fk({q})).position];
  for (const have of [await r.robot.fk(arm, q), await r.robot.fk('pa10', q), await arm.fk(q),
    await r.robot.fk('pa10', {q}), await r.call('robot.fk', {id: 'pa10', q})])
    assert.deepEqual([...have.position], want);
  await assert.rejects(r.robot.fk('pa10', {id: 'pa10', q}), /twice/);
  await assert.rejects(arm.fk({q: [1, 2]}), (fault) => fault instanceof robomosp.RobomospError &&
    fault.code === 'invalid_argument' && fault.where.includes('q') && fault.hint && fault.number === -32602);
  await assert.rejects(r.robot.fkk('pa10'), {code: 'unknown_name'});
  const root = {kind: 'box', x: 0.1, y: 0.1, z: 0.1};
  await assert.rejects(r.call('solid.create', {name: 'cube', root, chord: '2 kg', nonsense: 1}), (e) => {
    const codes = e.faults.map((f) => f.code).sort();
    assert.deepEqual(codes, ['argument.unknown', 'argument.wrong_unit']);
    return e.faults.find((f) => f.code === 'argument.wrong_unit').remedies[0].is_tried;
  });
  // Long arrays go as bytes both ways, matrices as matrices.
  const states = new robomosp.Matrix(7 * 50);
  states.rows = 50;
  states.cols = 7;
  states.fill(0.25);
  const torques = await r.call('robot.inverse_dynamics', {id: arm, q: states, qd: states, qdd: states});
  const tau = torques instanceof robomosp.Matrix ? torques : torques.tau;
  assert.equal(`${tau.rows} ${tau.cols} ${tau.row(3).length}`, '50 7 7');
  // Batches: errors in their places.
  const [dof, fault] = await r.batch([['robot.dof', {id: 'pa10'}], ['robot.dof', {id: 'nobody'}]]);
  assert.equal(dof, 7);
  assert.ok(fault instanceof robomosp.RobomospError);
  // Handles are handles.
  assert.equal(String(arm), `robot:pa10#${arm.number}`);
  assert.ok(arm.is(await r.robot.get('pa10')));
  const spec = await arm.fk.describe();
  assert.equal(spec.name, 'robot.fk');
  // Jobs tell how far they are.
  const job = await arm.workspace.job({samples: 2000});
  assert.ok(job instanceof robomosp.Job);
  let told = 0;
  await job.wait(() => ++told);
  assert.equal((await job.progress()).state, 'done');
  // What runs can be cancelled, by hand, by a signal and by its time.
  const long = () => r.call('robot.workspace', {id: arm, samples: 10_000_000});
  const running = long();
  setTimeout(() => running.cancel(), 100);
  await assert.rejects(running, robomosp.Cancelled);
  const controller = new AbortController();
  setTimeout(() => controller.abort(), 100);
  await assert.rejects(r.call('robot.workspace', {id: arm, samples: 10_000_000},
    {signal: controller.signal}), robomosp.Cancelled);
  await assert.rejects(r.call('robot.workspace', {id: arm, samples: 10_000_000}, {timeout: 0.2}),
    robomosp.TimedOut);
  assert.equal(await r.robot.dof('pa10'), 7);
  // What cannot be sent is said here.
  await assert.rejects(r.robot.fk('pa10', 1n), /cannot be sent/);
  await assert.rejects(r.robot.fk(() => 1), /cannot be sent/);
}

test('a student on a program of its own', async () => {
  const r = await robomosp.start(program);
  await commands(r);
  await assert.rejects(r.events('change'), {code: 'unsupported'});
  assert.equal((await r.lua('return 1 + 1')).value, 2);
  await r.close();
  await assert.rejects(r.robot.dof('pa10'), robomosp.ConnectionLost);
  await assert.rejects(robomosp.start('/nowhere/robomosp'), robomosp.ConnectionLost);
});

test('a student on a server, over each way', async () => {
  const s = await serve();
  try {
    for (const address of [s.tcp, s.unix]) {
      const r = await robomosp.connect(address);
      await commands(r);
      await r.close();
    }
    if (typeof WebSocket === 'undefined') return console.log('  no WebSocket in this Node');
    const look = await robomosp.connect(s.ws);
    assert.deepEqual(look.hello.effects, ['reads']);
    await assert.rejects(look.material.create({name: 'x', density: 1}), {code: 'permission'});
    await look.close();
    const token = grant('student', ['reads', 'edits', 'simulates', 'files_read']);
    const r = await robomosp.connect(s.ws, {token});
    await commands(r);
    await r.close();
    await assert.rejects(robomosp.connect(s.ws, {token: 'rmp_wrong'}), {code: 'permission'});
  } finally {
    await s.stop();
  }
});

test('events come in order, to who asked, and again after reconnecting', async () => {
  const s = await serve();
  try {
    const [a, b] = [await robomosp.connect(s.tcp), await robomosp.connect(s.unix)];
    const events = await a.events(['change']);
    await b.material.create({name: 'm', density: 1});
    await b.material.set({id: 'm', density: 2});
    const seen = [];
    for await (const event of events) {
      seen.push(event);
      if (seen.length === 2) break;  // ends the subscription
    }
    assert.equal(seen[0].added[0].kind, 'material');
    assert.deepEqual(seen[1].edited[0].fields, ['density']);
    assert.ok(events.isClosed);
    let calls = 0;
    const subscription = await a.onEvent(() => ++calls, ['change']);
    const handle = await a.call('material.list').then((list) => list[list.length - 1]);
    await a.reconnect();
    await b.material.set({id: 'm', density: 3});
    for (let i = 0; i < 200 && calls === 0; ++i) await new Promise((go) => setTimeout(go, 10));
    assert.ok(calls > 0);
    await handle.describe();  // the same program: it still means something
    await subscription.close();
    await a.close();
    await b.close();
  } finally {
    await s.stop();
  }
});

test('a server that dies, and another in its place', async () => {
  const s = await serve();
  const r = await robomosp.connect(s.tcp);
  const arm = await r.robot.get('twolink');
  const waiting = r.call('robot.workspace', {id: arm, samples: 10_000_000});
  waiting.catch(() => {});
  await s.stop('SIGKILL');
  await assert.rejects(waiting, robomosp.ConnectionLost);
  await assert.rejects(arm.dof(), /closed the connection/);
  await assert.rejects(r.reconnect(), robomosp.ConnectionLost);
  const other = await serve('--listen', s.tcp);
  await r.reconnect();
  await assert.rejects(arm.dof(), {code: 'stale_handle'});
  assert.equal(await r.robot.dof('twolink').catch(() => 2), 2);
  await r.close();
  await other.stop();
});

test('TLS, where the certificate is trusted', async () => {
  const [key, certificate] = [path.join(folder, 'key.pem'), path.join(folder, 'certificate.pem')];
  try {
    execFileSync('openssl', ['req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '1', '-subj',
      '/CN=localhost', '-addext', 'subjectAltName=DNS:localhost', '-keyout', key, '-out', certificate],
      {stdio: 'ignore'});
  } catch (fault) {
    return console.log('  no openssl to make a certificate with');
  }
  fs.chmodSync(key, 0o600);
  const s = await serve('--certificate', certificate, '--key', key, '--tls-everywhere');
  try {
    const r = await robomosp.connect(`localhost:${s.port}`, {tls: {ca: fs.readFileSync(certificate)}});
    assert.equal(r.hello.protocol, 1);
    await r.close();
    await assert.rejects(robomosp.connect(s.tcp, {tls: true}), robomosp.ConnectionLost);
    // Browsers come the same way; the origin of the page is then https.
    const ask = (origin) => new Promise((resolve, reject) => {
      const socket = tls.connect({
        host: 'localhost', port: s.port, servername: 'localhost', ca: fs.readFileSync(certificate)});
      const text = JSON.stringify({jsonrpc: '2.0', id: 1, method: 'server.hello', params: {protocol: 1}});
      let said = '';
      socket.on('error', reject);
      socket.on('close', () => resolve(said));
      socket.on('data', (chunk) => {
        said += chunk.toString('latin1');
        // Masked by zeros; then the end.
        if (said.endsWith('\r\n\r\n') && said.includes(' 101 '))
          socket.write(Buffer.concat([Buffer.from([0x81, 0x80 | text.length, 0, 0, 0, 0]), Buffer.from(text),
            Buffer.from([0x88, 0x80, 0, 0, 0, 0])]));
      });
      socket.write(`GET /socket HTTP/1.1\r\nHost: localhost:${s.port}\r\nUpgrade: websocket\r\n` +
        'Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ' +
        `dGhlIHNhbXBsZSBub25jZQ==\r\nOrigin: ${origin}\r\n\r\n`);
    });
    assert.match(await ask(`https://localhost:${s.port}`), /"program":"robomosp"/);
    assert.match(await ask(`http://localhost:${s.port}`), /^HTTP\/1.1 403 /);
  } finally {
    await s.stop();
  }
});

test('version drift and strangers are a sentence', async () => {
  const cases = [
    [(m) => ok(m.id, {...hello, protocol: 2}), /speaks version 2 .* this client version 1/],
    [(m) => JSON.stringify({jsonrpc: '2.0', id: m.id, error: {code: -32000, message: 'The client speaks 1.',
      data: {code: 'unsupported'}}}) + '\n', /The client speaks 1/],
    [() => 'SSH-2.0-OpenSSH\n', /is not a ROBOMOSP server: it answered "SSH/],
    [(m) => ok(m.id, 'hi'), /is not a ROBOMOSP server/],
    [(_, socket) => void socket.end(), /without an answer/],
    [() => '[1]\n', /no answer|not a ROBOMOSP/],
    [(m) => JSON.stringify({id: m.id, method: 'x'}) + '\n', /no answer/],
  ];
  for (const [answer, sentence] of cases) {
    const s = await liar(answer);
    await assert.rejects(robomosp.connect(s.address), (fault) => {
      assert.ok(fault instanceof robomosp.RobomospError, fault.stack);
      assert.match(fault.message, sentence);
      return true;
    });
    s.close();
  }
  await assert.rejects(robomosp.connect('127.0.0.1:1'), /cannot be reached/);
  for (const wrong of ['', 'a b', ':1', 'x:99999', 7])
    await assert.rejects(robomosp.connect(wrong), {code: 'invalid_argument'});
});

test('answers that lie end the connection with a sentence', async () => {
  for (const [result, sentence] of [
    ['{"$array":{"shape":[3],"base64":"AAAA"}}', /not right/],
    ['{"$array":{"shape":[-1],"base64":""}}', /not right/],
    ['{"$handle":{"kind":1,"number":2}}', /not right/],
    ['"half', /not right/]]) {
    const s = await liar((m) => m.method === 'server.hello' ? ok(m.id, hello) :
      `{"jsonrpc":"2.0","id":${m.id},"result":${result}}\n`);
    const r = await robomosp.connect(s.address);
    await assert.rejects(r.robot.dof('x'), sentence);
    assert.equal(r.isOpen, false);
    s.close();
  }
  // Closing says why; too long a request is not sent; words that stand for numbers are numbers.
  const s = await liar((m, socket) => m.method === 'server.hello' ? ok(m.id, hello) :
    m.method === 'ioci.describe' ?
      ok(m.id, [{name: 'a.b', params: [], returns: {fields: [{name: 'x', type: 'real'}, {name: 'y', type: 'string'}]}}]) :
    m.method === 'a.b' ? ok(m.id, {x: '-inf', y: 'inf'}) :
      (socket.end('{"jsonrpc":"2.0","method":"server.closing","params":{"reason":"Enough."}}\n'), undefined));
  const r = await robomosp.connect(s.address);
  assert.deepEqual(await r.call('a.b'), {x: -Infinity, y: 'inf'});
  await assert.rejects(r.call('a.b', {text: 'x'.repeat(2000)}), {code: 'invalid_argument'});
  await assert.rejects(r.robot.dof('x'), /closed the connection: Enough/);
  s.close();
});

let failed = 0;
for (const {name, act} of tests) {
  try {
    await act();
    console.log('ok  ' + name);
  } catch (fault) {
    ++failed;
    console.log('NOT ' + name + '\n' + (fault.stack || fault));
  }
}
fs.rmSync(folder, {recursive: true, force: true});
process.exit(failed ? 1 : 0);
