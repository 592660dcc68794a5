// SPDX-License-Identifier: Apache-2.0
#include "lua/listed_commands.h"

#include <cctype>

namespace robomosp::lua {

const ioci::CommandSpec* ListedCommands::find(std::string_view name) const {
  const auto it = commands_.find(name);
  return it == commands_.end() ? nullptr : it->second.get();
}

std::vector<const ioci::CommandSpec*> ListedCommands::list() const {
  std::vector<const ioci::CommandSpec*> out;
  out.reserve(commands_.size());
  for (const auto& [name, spec] : commands_) out.push_back(spec.get());
  return out;
}

std::vector<const ioci::CommandSpec*> ListedCommands::methods_of(std::string_view kind) const {
  std::vector<const ioci::CommandSpec*> out;
  const std::string prefix = std::string(kind) + ".";
  for (auto it = commands_.lower_bound(prefix);
       it != commands_.end() && it->first.starts_with(prefix); ++it)
    if (!it->second->params.empty() && it->second->params.front().name == "id")
      out.push_back(it->second.get());
  return out;
}

bool ListedCommands::is_classic_noun(std::string_view word) const {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return nouns_.contains(lower);
}

}  // namespace robomosp::lua
