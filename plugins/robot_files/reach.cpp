// SPDX-License-Identifier: Apache-2.0
#include "reach.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "xml.h"

namespace robomosp::robot_files {
namespace {

namespace fs = std::filesystem;

constexpr int kHighest = 8;  ///< folders above in which a package is looked for
constexpr std::array kMarks{"package.xml", "manifest.xml", "model.config"};
constexpr std::array kFolders{"urdf", "urdfs", "robot",  "robots", "mjcf",   "xml",        "xmls",
                              "sdf",  "model", "models", "config", "scenes", "description"};

bool is_top(const fs::path& p) { return p == p.parent_path(); }

/// Below or at `root`, by their components.
bool is_below(const fs::path& file, const fs::path& root) {
  const auto [r, f] = std::mismatch(root.begin(), root.end(), file.begin(), file.end());
  return r == root.end();
}

fs::path package_of(const fs::path& folder) {
  std::error_code failed;
  fs::path at = folder;
  for (int k = 0; k < kHighest && !is_top(at); ++k, at = at.parent_path())
    for (const char* mark : kMarks)
      if (fs::is_regular_file(at / mark, failed)) return at;
  at = folder;
  for (int k = 0; k < kHighest && !is_top(at) && !is_top(at.parent_path());
       ++k, at = at.parent_path())
    if (std::find(kFolders.begin(), kFolders.end(), std::string_view(at.filename().string())) !=
        kFolders.end())
      return at.parent_path();
  return folder;
}

}  // namespace

Reach::Reach(const fs::path& folder) : is_bounded_(true) {
  std::error_code failed;
  const fs::path full = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, failed);
  package_ = failed ? folder : package_of(full);
  roots_.push_back(package_);
}

bool Reach::allows(const fs::path& file) const {
  if (!is_bounded_) return true;
  std::error_code failed;
  const fs::path full = fs::weakly_canonical(file, failed);
  return !failed && std::any_of(roots_.begin(), roots_.end(),
                                [&](const fs::path& root) { return is_below(full, root); });
}

void Reach::add(const fs::path& package) {
  std::error_code failed;
  const fs::path full = fs::weakly_canonical(package, failed);
  if (!failed && !is_top(full) && !is_top(full.parent_path())) roots_.push_back(full);
}

std::string Reach::told() const {
  if (refused_.empty()) return {};
  constexpr std::size_t kMostNamed = 5;
  std::string names;
  std::size_t count = 0;
  for (const std::string& name : refused_) {
    if (count++ == kMostNamed) break;
    names += (names.empty() ? "" : ", ") + in_quotes(name);
  }
  if (refused_.size() > kMostNamed)
    names += " and " + std::to_string(refused_.size() - kMostNamed) + " more";
  return (refused_.size() == 1 ? "A file was not opened, as it lies"
                               : "Files were not opened, as they lie") +
         std::string(" outside the package ") + in_quotes(package_.string()) +
         " of the robot's file: " + names +
         ". Give options = {outside = true} to have such files read.";
}

}  // namespace robomosp::robot_files
