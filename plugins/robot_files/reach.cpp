// SPDX-License-Identifier: Apache-2.0
#include "reach.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "files.h"
#include "xml.h"

namespace robomosp::robot_files {
namespace {

namespace fs = std::filesystem;

constexpr int kHighestFolder = 8;  ///< folders above in which a package is looked for
constexpr std::array kMarks{"package.xml", "manifest.xml", "model.config"};
constexpr std::array kFolders{"urdf", "urdfs", "robot",  "robots", "mjcf",   "xml",        "xmls",
                              "sdf",  "model", "models", "config", "scenes", "description"};

bool is_top(const fs::path& p) { return p == p.parent_path(); }

/// Below or at `root`, by their components.
bool is_below(const fs::path& file, const fs::path& root) {
  const auto [r, f] = std::mismatch(root.begin(), root.end(), file.begin(), file.end());
  return r == root.end();
}

/// The folders that the package may be, by each of the signs; the nearest of each.
std::vector<fs::path> packages_of(const fs::path& folder) {
  std::vector<fs::path> out{folder};
  for (const char* mark : kMarks) {
    fs::path at = folder;
    for (int k = 0; k < kHighestFolder && !is_top(at); ++k, at = at.parent_path())
      if (files::is_file(at / mark)) {
        out.push_back(at);
        break;
      }
  }
  fs::path at = folder;
  for (int k = 0; k < kHighestFolder && !is_top(at) && !is_top(at.parent_path());
       ++k, at = at.parent_path())
    if (std::find(kFolders.begin(), kFolders.end(), std::string_view(at.filename().string())) !=
        kFolders.end()) {
      out.push_back(at.parent_path());
      break;
    }
  return out;
}

}  // namespace

Reach::Reach(const fs::path& folder) : is_bounded_(true) {
  std::error_code failed;
  const fs::path full = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, failed);
  roots_ = failed ? std::vector{folder} : packages_of(full);
  // They stand in each other.
  package_ = *std::min_element(roots_.begin(), roots_.end(), [](const auto& a, const auto& b) {
    return a.native().size() < b.native().size();
  });
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
  return (refused_.size() == 1 ? "A file was not opened, since it lies"
                               : "Files were not opened, since they lie") +
         std::string(" outside the package ") + in_quotes(package_.string()) +
         " of the robot's file: " + names + ". Give options = {outside = true} to read such files.";
}

}  // namespace robomosp::robot_files
