// SPDX-License-Identifier: Apache-2.0
#include "left_out.h"

#include <tinyxml2.h>

#include <algorithm>

namespace robomosp::robot_files {
namespace {

constexpr std::size_t kMostKinds = 24;

bool is_among(std::string_view word, LeftOut::Words known) {
  return std::find(known.begin(), known.end(), word) != known.end();
}
/// A word of the file, short and printable.
std::string shown(std::string_view word) {
  std::string out(word.substr(0, 40));
  for (char& c : out)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return out;
}

}  // namespace

void LeftOut::elements(const Element& e, Words known) {
  for (const Element* c = e.FirstChildElement(); c; c = c->NextSiblingElement())
    if (!is_among(c->Name(), known)) add("<" + shown(c->Name()) + "> in <" + shown(e.Name()) + ">");
}

void LeftOut::attributes(const Element& e, Words known) {
  for (const auto* a = e.FirstAttribute(); a; a = a->Next())
    if (!is_among(a->Name(), known)) add(shown(a->Name()) + " of <" + shown(e.Name()) + ">");
}

void LeftOut::tell(std::vector<std::string>& notes) const {
  std::string all;
  std::size_t told = 0;
  for (const auto& [what, n] : counts_) {
    if (told == kMostKinds) break;
    all += (told++ ? ", " : "") + what + (n > 1 ? " (" + std::to_string(n) + ")" : "");
  }
  if (told < counts_.size())
    all += " and " + std::to_string(counts_.size() - told) + " further kinds";
  if (told > 0) notes.push_back("Left out: " + all + ".");
}

}  // namespace robomosp::robot_files
