// SPDX-License-Identifier: Apache-2.0
// Elements skipped by a reader, counted by kind, so that nothing is lost silently (layer: plugin).
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "xml.h"

namespace robomosp::robot_files {

class LeftOut {
 public:
  using Words = std::span<const std::string_view>;
  void add(std::string what) { ++counts_[std::move(what)]; }
  /// Elements inside `e` that are not among the known ones: `<sensor> in <link>`.
  void elements(const Element& e, Words known);
  /// Attributes of `e` that are not among the known ones: `springdamper of <joint>`.
  void attributes(const Element& e, Words known);
  /// `Left out: <sensor> in <link> (3), <light> in <model>.`, or none.
  void tell(std::vector<std::string>& notes) const;

 private:
  std::map<std::string, std::size_t> counts_;
};

}  // namespace robomosp::robot_files
