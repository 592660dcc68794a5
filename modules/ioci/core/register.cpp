// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/application.h"
#include "ioci/core/command.h"

namespace robomosp::ioci {
namespace {

std::vector<std::pair<std::string, CommandFile::Make>>& files() {
  static std::vector<std::pair<std::string, CommandFile::Make>> all;
  return all;
}

}  // namespace

CommandFile::CommandFile(const char* file, Make make) { files().emplace_back(file, make); }

const std::vector<std::pair<std::string, CommandFile::Make>>& CommandFile::all() { return files(); }

void register_commands(CommandTable& table) {
  for (const auto& [file, make] : CommandFile::all()) table.add(make());
}

}  // namespace robomosp::ioci
