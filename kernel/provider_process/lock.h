// SPDX-License-Identifier: Apache-2.0
// Gives up, for good, what the process of a plugin does not need (layer: core).
#pragma once

#include <cstdint>

/// Of the calling process, which must have one thread: it ends with the program `parent`, has so
/// much address space [bytes], and leaves no core. `is_confined`: no network, no other programs or
/// processes, no other process's memory; what it may open is decided before (Landlock). Null = it
/// holds; else what could not be done.
[[nodiscard]] const char* lock_provider_process(int parent, std::uint64_t memory, bool is_confined);
