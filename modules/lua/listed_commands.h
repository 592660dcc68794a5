// SPDX-License-Identifier: Apache-2.0
// A table of commands that came as a list, of a program elsewhere (layer: application, lua).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/command.h"
#include "lua/command_host.h"

namespace robomosp::lua {

/// What the commands are; how they are called is the derived class's matter. [the state's thread]
class ListedCommands : public CommandHost {
 public:
  [[nodiscard]] std::uint64_t revision() const final { return revision_; }
  [[nodiscard]] const ioci::CommandSpec* find(std::string_view name) const final;
  [[nodiscard]] std::vector<const ioci::CommandSpec*> list() const final;
  [[nodiscard]] std::vector<const ioci::CommandSpec*> methods_of(std::string_view kind) const final;
  [[nodiscard]] bool is_classic_noun(std::string_view word) const final;

 protected:
  // What any answer may change:
  mutable std::map<std::string, std::unique_ptr<ioci::CommandSpec>, std::less<>> commands_;
  mutable std::uint64_t revision_ = 1;
  std::set<std::string, std::less<>> nouns_;  ///< of lines of 2006, lower case
};

}  // namespace robomosp::lua
