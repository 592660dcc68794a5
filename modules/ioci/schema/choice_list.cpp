// SPDX-License-Identifier: Apache-2.0
#include "ioci/schema/choice_list.h"

#include <algorithm>
#include <cctype>
#include <functional>

namespace robomosp::ioci {
namespace {

bool is_text_of(const Value& value, std::string_view text) {
  const std::string* own = value.as_string();
  return own ? *own == text : value.text() == text;
}

}  // namespace

bool begins_with(std::string_view text, std::string_view prefix) {
  return text.size() >= prefix.size() &&
         std::equal(prefix.begin(), prefix.end(), text.begin(), [](char a, char b) {
           return std::tolower(static_cast<unsigned char>(a)) ==
                  std::tolower(static_cast<unsigned char>(b));
         });
}

Choice* ChoiceList::add(std::string_view text, std::string_view doc) {
  if (!is_new(text)) return nullptr;
  out_.push_back({Value(std::string(text)), {}, std::string(doc), {}});
  return &out_.back();
}

Choice* ChoiceList::add_value(const Value& value, std::string_view doc) {
  const std::string* own = value.as_string();
  if (!(own ? is_new(*own) : is_new(value.text()))) return nullptr;
  out_.push_back({value, {}, std::string(doc), {}});
  return &out_.back();
}

bool ChoiceList::is_new(std::string_view text) {
  if (is_full() || !begins_with(text, prefix_)) return false;
  if (2 * (out_.size() + 1) > slots_.size()) grow();
  std::size_t at = slot_of(text);
  for (; slots_[at] != 0; at = (at + 1) & (slots_.size() - 1))
    if (is_text_of(out_[slots_[at] - 1].value, text)) return false;
  slots_[at] = static_cast<std::uint32_t>(out_.size() + 1);
  return true;
}

std::size_t ChoiceList::slot_of(std::string_view text) const {
  return std::hash<std::string_view>()(text) & (slots_.size() - 1);
}

void ChoiceList::grow() {
  constexpr std::size_t kFirstSlots = 64;  // a power of two
  slots_.assign(std::max(kFirstSlots, 4 * slots_.size()), 0);
  for (std::size_t i = 0; i < out_.size(); ++i) {
    const std::string* own = out_[i].value.as_string();
    std::size_t at = own ? slot_of(*own) : slot_of(out_[i].value.text());
    while (slots_[at] != 0) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = static_cast<std::uint32_t>(i + 1);
  }
}

}  // namespace robomosp::ioci
