// SPDX-License-Identifier: Apache-2.0
#include "model/step_fields.h"

#include <algorithm>
#include <array>
#include <vector>

#include "kernel/check.h"
#include "kernel/condition.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "model/data.h"
#include "model/field_types.h"
#include "model/records.h"

namespace robomosp::model {
namespace {

struct StepWord {
  std::string_view field;
  std::string_view kinds;  ///< of steps, separated by blanks; "" = the others
  std::string_view word;
};
constexpr StepWord kStepFieldWords[] = {
    {"link", "move", "tool"},        {"duration", "wait", "time"}, {"expression", "set", "value"},
    {"expression", "", "condition"}, {"is_straight", "", "path"},
};

using StepFields = std::array<std::vector<const Field*>, kStepWords.size()>;

StepFields make_step_fields() {
  StepFields out;
  for (const Field& f : type_of<TaskStep>().fields) {
    if (f.name == "kind" || f.name == "parent") continue;
    const ParamSpec p = field_param("task", "steps." + std::string(f.name), f);
    const Condition& when = notes_of(p).when;
    for (std::size_t i = 0; i < out.size(); ++i)
      if (when.is_always() || step_condition(static_cast<StepKind>(i), when.text()))
        out[i].push_back(&f);
  }
  return out;
}

}  // namespace

bool is_step_kind_among(StepKind kind, std::string_view kinds) {
  if (kinds.empty()) return true;
  for (const std::string_view word : text::split(kinds, ' '))
    if (word == to_string(kind)) return true;
  return false;
}

std::string_view step_word(std::string_view field, StepKind kind) {
  for (const StepWord& w : kStepFieldWords)
    if (w.field == field && is_step_kind_among(kind, w.kinds)) return w.word;
  return field;
}

std::optional<std::string> step_condition(StepKind kind, std::string_view condition) {
  std::string out;
  for (std::string_view rest = condition; !rest.empty();) {
    const std::size_t end = std::min(rest.find(" or "), rest.size());
    std::string_view all = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 4, rest.size()));
    std::string part;
    bool holds = true;
    while (!all.empty()) {
      const std::size_t stop = std::min(all.find(" and "), all.size());
      const std::string_view test = all.substr(0, stop);
      all.remove_prefix(std::min(stop + 5, all.size()));
      const auto parsed = Condition::parse(test);
      RMP_CHECK(parsed.ok() && parsed->tests().size() == 1, std::string(test).c_str());
      const Condition::Test& t = parsed->tests()[0];
      if (t.field == "kind") {
        holds = holds && parsed->holds(Map{{"kind", std::string(to_string(kind))}});
        continue;
      }
      part += (part.empty() ? "" : " and ") + std::string(step_word(t.field, kind)) +
              std::string(test.substr(t.field.size()));
    }
    if (!holds) continue;
    if (part.empty()) return "";  // always
    out += (out.empty() ? "" : " or ") + part;
  }
  return out.empty() ? std::nullopt : std::optional(out);
}

std::vector<const Field*> foreign_step_fields(const TaskStep& s) {
  const Type& type = type_of<TaskStep>();
  const auto own = step_fields(s.kind);
  std::vector<const Field*> out;
  for (const Field& f : type.fields) {
    if (f.name == "kind" || f.name == "parent" ||
        std::find(own.begin(), own.end(), &f) != own.end())
      continue;
    if (!equal(Content{f.type, f.in(&s)}, Content{f.type, f.in(type.standard.get())}))
      out.push_back(&f);
  }
  return out;
}

std::vector<std::string> step_kinds_with(const Field& field) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < kStepWords.size(); ++i) {
    const auto own = step_fields(static_cast<StepKind>(i));
    if (std::find(own.begin(), own.end(), &field) != own.end()) out.emplace_back(kStepWords[i]);
  }
  return out;
}

std::span<const Field* const> step_fields(StepKind kind) {
  static const StepFields all = make_step_fields();
  return all[static_cast<std::size_t>(kind)];
}

}  // namespace robomosp::model
