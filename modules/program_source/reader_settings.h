// SPDX-License-Identifier: Apache-2.0
// What a controller's record says to readers of its programs (layer: application, program_source).
// [any thread]
#pragma once

#include <string>
#include <string_view>

#include "kernel/registry.h"
#include "kernel/value.h"
#include "model/controller.h"

namespace robomosp::program_source {

/// Parameters of a reader from a controller's record: pulses of its axes, and options of the same
/// name.
[[nodiscard]] Map reader_settings(const ProviderInfo& reader, const model::Controller&);

struct ForeignFile {
  std::string name, text;
};
/// Tools and frames of a controller by number, as the file of its backup that a reader reads:
/// TOOL.CND for `inform`, SYSFRAME.VA for `tp`. Its text is empty for other readers, and without
/// numbered tools and frames.
[[nodiscard]] ForeignFile places_file(std::string_view reader, const model::Controller&);

}  // namespace robomosp::program_source
