// SPDX-License-Identifier: Apache-2.0
// The choices of one answer while they are collected (layer: application, ioci only).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/schema/choices.h"

namespace robomosp::ioci {

/// Compares as completion does, case-blind.
[[nodiscard]] bool begins_with(std::string_view text, std::string_view prefix);

/// The choices so far: those that begin with the prefix, each once, up to a limit. Names that are
/// not shown are compared where they are kept, and need no memory.
class ChoiceList {
 public:
  ChoiceList(std::string_view prefix, std::size_t most) : prefix_(prefix), most_(most) {}

  [[nodiscard]] bool is_full() const { return out_.size() >= most_; }
  [[nodiscard]] std::size_t room() const { return most_ - out_.size(); }
  [[nodiscard]] std::size_t size() const { return out_.size(); }
  [[nodiscard]] std::vector<Choice> take() { return std::move(out_); }
  [[nodiscard]] Choice& operator[](std::size_t i) { return out_[i]; }

  /// The new choice, valid until the next one; nullptr if the text is not shown.
  Choice* add(std::string_view text, std::string_view doc = {});
  Choice* add_value(const Value& value, std::string_view doc = {});

 private:
  [[nodiscard]] bool is_new(std::string_view text);
  [[nodiscard]] std::size_t slot_of(std::string_view text) const;
  void grow();

  std::string_view prefix_;
  std::size_t most_;
  std::vector<Choice> out_;
  std::vector<std::uint32_t> slots_;  ///< open addressing: number of a choice from 1, 0 = free
};

}  // namespace robomosp::ioci
