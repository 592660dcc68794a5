// SPDX-License-Identifier: Apache-2.0
// The PA-10 solves a pose somewhere else, goes there, and a picture comes back.
//
//   node pa10_pose.js [ADDRESS [TOKEN]]      without an address it starts a program of its own
import {connect, start} from './robomosp.js';

const goal = [0.557, 0, 0.374, '180 deg', 0, '180 deg'];  // m; roll, pitch, yaw

const [address, token] = process.argv.slice(2);
const r = address ? await connect(address, {token}) : await start();
const arm = await r.robot.get('pa10');
const found = await arm.solve_ik({target: goal});
const cell = await r.world.create({name: 'student'});
await cell.add_robot({robot: arm});
await cell.set_robot_q({robot: 'pa10', q: found.q});
(await arm.joint_values()).forEach((value, i) =>
  console.log(`joint ${i + 1}: ${value.toFixed(4).padStart(8)} rad`));
try {
  const picture = await cell.picture({size: [400, 300], quality: 'draft'});
  await picture.save('pa10.png');
  console.log(`pa10.png: ${picture.png.length} bytes`);
} catch (fault) {
  console.log('no picture:', fault.message);
}
await r.close();
