// SPDX-License-Identifier: Apache-2.0
#include "kernel/interface_file.h"

#include <map>

#include "kernel/check.h"

namespace robomosp {
namespace {

/// Filled before main(), and only read from then on.
struct Table {
  std::map<std::string, InterfaceEntry, std::less<>> entries;
  std::vector<std::string> files;
};
Table& table() {
  static Table one;
  return one;
}

}  // namespace

InterfaceFile::InterfaceFile(const char* file, const std::vector<InterfaceEntry>& entries) {
  table().files.emplace_back(file);
  for (const InterfaceEntry& entry : entries)
    RMP_CHECK(table().entries.emplace(entry.id, entry).second,
              ("interface " + entry.id + " is registered twice").c_str());
}

const InterfaceEntry* InterfaceFile::find(std::string_view id) {
  const auto it = table().entries.find(id);
  return it == table().entries.end() ? nullptr : &it->second;
}

std::vector<const InterfaceEntry*> InterfaceFile::all() {
  std::vector<const InterfaceEntry*> out;
  for (const auto& [id, entry] : table().entries) out.push_back(&entry);
  return out;
}

const std::vector<std::string>& InterfaceFile::files() { return table().files; }

}  // namespace robomosp
