// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/renamed_arguments.h"

#include <algorithm>
#include <array>

namespace robomosp::ioci {
namespace {

constexpr std::array kOldWords{
    OldWord{"robot.add_joint", "link", "joint"},
    OldWord{"robot.analytical_jacobian", "notation", "representation"},
    OldWord{"robot.set_joint", "link", "joint"},
};
static_assert(std::is_sorted(kOldWords.begin(), kOldWords.end(),
                             [](const OldWord& a, const OldWord& b) {
                               return a.command < b.command;
                             }));

}  // namespace

std::span<const OldWord> old_words() { return kOldWords; }

std::optional<RenamedArguments> with_new_words(std::string_view command, const Map& given) {
  std::optional<RenamedArguments> out;
  for (const OldWord& word : kOldWords) {
    if (word.command != command || !given.find(word.was) || given.find(word.is)) continue;
    if (!out) out.emplace(RenamedArguments{given, {}});
    Map renamed;
    for (const auto& [name, value] : out->args)
      renamed.set(name == word.was ? std::string(word.is) : name, value);
    out->args = std::move(renamed);
    out->note += (out->note.empty() ? "" : " ") + std::string(command) + " calls the argument \"" +
                 std::string(word.was) + "\" \"" + std::string(word.is) + "\" now.";
  }
  return out;
}

}  // namespace robomosp::ioci
