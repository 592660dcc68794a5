// SPDX-License-Identifier: Apache-2.0
// Which fields of links, drives, segments, steps and nodes files write as declared: all but those
// with a special form in bind.cpp and native_print.cpp (layer: application). Internal to
// modules/io.
#pragma once

#include <initializer_list>
#include <string_view>
#include <vector>

#include "model/fields.h"
#include "model/step_fields.h"

namespace robomosp::io {

using PlainFields = std::vector<const model::Field*>;

[[nodiscard]] const PlainFields& plain_link_fields();
[[nodiscard]] const PlainFields& plain_drive_fields();
[[nodiscard]] const PlainFields& plain_segment_fields();
[[nodiscard]] const PlainFields& plain_node_fields();
/// All fields that steps of a kind have, with their words there: `time` of a wait. Those for which
/// is_step_form() is true have other values than the declared ones.
[[nodiscard]] const PlainFields& file_step_fields(model::StepKind);
/// Those of them with the declared values.
[[nodiscard]] const PlainFields& plain_step_fields(model::StepKind);
/// `path straight`, `profile s_curve`.
[[nodiscard]] bool is_step_form(std::string_view field);

}  // namespace robomosp::io
