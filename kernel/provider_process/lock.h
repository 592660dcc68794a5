// SPDX-License-Identifier: Apache-2.0
// Drops, permanently, privileges that the process of a plugin does not need (layer: core).
#pragma once

#include <cstdint>

/// Locks the calling process, which must have one thread: it ends with the program `parent`, has at
/// most this address space [bytes], and writes no core dump. `is_confined`: no network, no other
/// programs or processes, no access to other processes' memory; which files it may open is set
/// before (Landlock). Returns null on success, else the step that failed.
[[nodiscard]] const char* lock_provider_process(int parent, std::uint64_t memory, bool is_confined);
