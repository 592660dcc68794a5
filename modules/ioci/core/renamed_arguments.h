// SPDX-License-Identifier: Apache-2.0
// Words that arguments of commands once had: still read, with a message (layer: application, ioci
// only). docs/glossary.md lists them for users.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "kernel/value.h"

namespace robomosp::ioci {

struct OldWord {
  std::string_view command, was, is;
};
/// All of them, by command.
[[nodiscard]] std::span<const OldWord> old_words();

/// The arguments under the words of now, and a sentence about each that was renamed; nothing where
/// all words are those of now. An argument that is given under both words stays as it is, so that
/// the check of arguments refuses the old one.
struct RenamedArguments {
  Map args;
  std::string note;
};
[[nodiscard]] std::optional<RenamedArguments> with_new_words(std::string_view command,
                                                             const Map& given);

}  // namespace robomosp::ioci
