// SPDX-License-Identifier: Apache-2.0
// Names made unique by a number: pin, pin_2, pin_3 (layer: core).
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace robomosp {

/// The names of a list. Names are only added, so the next free name of a stem is found at once,
/// however many names share it.
class FreshNames {
 public:
  FreshNames() = default;
  FreshNames(std::set<std::string> taken) : taken_(std::move(taken)) {}

  [[nodiscard]] bool is_taken(const std::string& name) const { return taken_.contains(name); }
  /// Adds a name; false if it exists.
  bool take(std::string name) { return taken_.insert(std::move(name)).second; }
  /// Adds `wanted`, or if it is taken the first free one of wanted_2, wanted_3, ...
  std::string fresh(const std::string& wanted) {
    if (taken_.insert(wanted).second) return wanted;
    std::size_t& number = numbers_.try_emplace(wanted, 1).first->second;
    std::string name;
    do name = wanted + "_" + std::to_string(++number);
    while (!taken_.insert(name).second);
    return name;
  }

 private:
  std::set<std::string> taken_;
  std::map<std::string, std::size_t> numbers_;  ///< the last number used, by stem
};

}  // namespace robomosp
