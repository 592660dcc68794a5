// SPDX-License-Identifier: Apache-2.0
// The files that programs of a run open, write and close (layer: application, ioci only).
#pragma once

#include <memory>

#include <robomosp/sdk/result.h>

#include "kernel/schema.h"
#include "task/program_actor.h"

namespace robomosp::ioci {

/// The folder of the argument `files`, for who has this thread's permit; without the argument that
/// of a session that is confined to one. Null = there is none, and programs open no files.
[[nodiscard]] std::shared_ptr<const task::ProgramFolder> program_folder(const Map& args);
/// The argument files of what runs programs of worlds.
[[nodiscard]] ParamSpec files_field();

}  // namespace robomosp::ioci
