// SPDX-License-Identifier: Apache-2.0
// Turns of the processor in a program that serves: threads that answer come before those that
// compute for long (layer: core).
#pragma once

namespace robomosp::turns {

/// This thread answers others: from Linux 6.12 on it takes the place of one that computes as soon
/// as it has something to do, instead of at the end of that one's turn. Its share of the time stays
/// what it was.
void answer();

/// The program serves from now on: threads that compute leave cores that are wanted to others.
void serve();

/// This thread computes. In a program that serves it does so from now on with a third of the weight
/// of others (nice 5) wherever a core is wanted by several; no core is left idle for it.
void compute();

}  // namespace robomosp::turns
