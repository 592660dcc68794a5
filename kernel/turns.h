// SPDX-License-Identifier: Apache-2.0
// Scheduling of a server's threads: threads that serve requests precede those that run long
// computations (layer: core).
#pragma once

namespace robomosp::turns {

/// This thread serves requests: from Linux 6.12 on, it preempts a computing thread as soon as it
/// has work, instead of at the end of that thread's time slice. Its share of processor time is
/// unchanged.
void answer();

/// The program is a server from now on: computing threads yield contended cores.
void serve();

/// This thread computes. In a server it has a third of the weight of others (nice 5) from then on
/// if a core is contended; no core is left idle for it.
void compute();

}  // namespace robomosp::turns
