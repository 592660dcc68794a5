/* SPDX-License-Identifier: Apache-2.0
 * Files that a file names, for providers that read them themselves (layer: contract). A session may
 * have a folder that its files lie in; who opens files through these functions keeps to it,
 * whatever names a file holds. An extension of the host: rmp_host::extension(RMP_FILES). Importers
 * that open all files by these, or in a helper program of theirs (rmp_host::run, which keeps to
 * the folder by itself), have the tag "confined"; others are run in a separate process for
 * such a session. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#define RMP_FILES "robomosp.files/1"

/** Made by the host; may grow at the end. */
typedef struct rmp_files {
  uint32_t struct_size;
  /** The type of a path for the work that runs on this thread, links followed: 0 nothing, or
   *  nothing that it may know of; 1 a file; 2 a folder; 3 other. [any thread] */
  int32_t (*kind)(const char* path);
  /** Calls `take` once with the bytes of a file of at most `most` bytes. 0 = it was called; else
   *  `error` (a sentence, cut at error_size bytes) gives the reason. `take` may not throw. [any
   * thread]
   */
  int32_t (*read)(const char* path, uint64_t most, void* context,
                  void (*take)(void* context, const char* bytes, uint64_t size), char* error,
                  uint32_t error_size);
} rmp_files;
