// SPDX-License-Identifier: Apache-2.0
// Which kinds of steps have a field of TaskStep, and what they call it in commands and files, from
// the conditions in field_types.cpp (layer: data processing, model). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/fields.h"
#include "model/task.h"

namespace robomosp::model {

/// The name of a field in steps of a kind: "tool" for the link of a move.
[[nodiscard]] std::string_view step_word(std::string_view field, StepKind);
/// Whether a word of a kind is among words separated by blanks; "" = all kinds.
[[nodiscard]] bool is_step_kind_among(StepKind, std::string_view kinds);
/// A condition over the fields of TaskStep as one over those of a kind of step: parts that the kind
/// decides are left out. "" = it always holds, nullopt = it never does. Brackets are not read.
[[nodiscard]] std::optional<std::string> step_condition(StepKind, std::string_view condition);
/// The fields that steps of a kind have, in order of declaration, without `kind` and `parent`.
[[nodiscard]] std::span<const Field* const> step_fields(StepKind);
/// The fields with a value that steps of its kind do not have, in order of declaration.
[[nodiscard]] std::vector<const Field*> foreign_step_fields(const TaskStep&);
/// The kinds of steps that have a field, as words.
[[nodiscard]] std::vector<std::string> step_kinds_with(const Field&);

}  // namespace robomosp::model
