/* SPDX-License-Identifier: Apache-2.0
 * Threads of the program for its providers, which start none by the number of cores (layer:
 * contract). An extension of the host: rmp_host::extension(RMP_THREADS); Host::spread() in C++. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#define RMP_THREADS "robomosp.threads/1"

/** Made by the host; may grow at the end. */
typedef struct rmp_threads {
  uint32_t struct_size;
  uint32_t cores; /**< at least 1; more parts than these at once are of no use */
  /** Calls part(context, 0) ... part(context, parts - 1), at most `threads` of them at once, and
   *  returns when all are done. The calling thread works too, and does all of it when the cores are
   *  taken by others. No part may wait for another one, nor throw. [any thread] */
  void (*spread)(size_t parts, size_t threads, void (*part)(void* context, size_t i),
                 void* context);
} rmp_threads;
