// SPDX-License-Identifier: Apache-2.0
// `robomosp-importer confine ...`: starts a program that can open only what the preceding arguments
// allow, by Landlock (kernel/confined_process.h) (layer: core).
#pragma once

/// Arguments: any number of `own FOLDER`, `read FOLDER` and `code FOLDER`, then `run PROGRAM
/// ARGUMENTS...`. Returns only on failure, with the exit code.
int run_confined(int count, char** words);
