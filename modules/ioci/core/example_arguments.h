// SPDX-License-Identifier: Apache-2.0
// The arguments that the example of a command gives it, as data for forms (layer: application, ioci
// only).
#pragma once

#include <string_view>

namespace robomosp::ioci {

/// A table for kernel/literal.h; empty = the example gives none. They are recorded from the
/// examples: ROBOMOSP_UPDATE_DOCS=1 schema_forms_test writes them anew.
[[nodiscard]] std::string_view example_arguments(std::string_view command);

}  // namespace robomosp::ioci
