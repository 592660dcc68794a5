// SPDX-License-Identifier: Apache-2.0
// The recording that a command is about: its argument `id` (layer: application, ioci).
#pragma once

#include <cstdint>

#include "ioci/core/commands.h"
#include "recording/recording.h"

namespace robomosp::ioci {

[[nodiscard]] inline std::uint64_t number_of(const Map& args) {
  return args.find("id")->as_handle()->number;
}
[[nodiscard]] inline recording::RecordingPtr recording_of(CommandContext& ctx, const Map& args) {
  return ctx.recording(*args.find("id")->as_handle());
}

}  // namespace robomosp::ioci
