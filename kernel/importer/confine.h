// SPDX-License-Identifier: Apache-2.0
// `robomosp-importer confine ...`: starts a program that can open what the words before it allow
// and nothing else, by Landlock (kernel/confined_process.h) (layer: core).
#pragma once

/// Words: `own FOLDER`, `read FOLDER` and `code FOLDER` in any number, then `run PROGRAM WORDS...`.
/// Returns only when that could not be done, with what the process is to end with.
int run_confined(int count, char** words);
