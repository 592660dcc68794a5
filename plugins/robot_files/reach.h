// SPDX-License-Identifier: Apache-2.0
// Which files a robot's file may have opened: those of its package (layer: plugin).
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace robomosp::robot_files {

/// A robot's file from somewhere else must not have any file of the machine opened by naming it. It
/// may name what lies in its package: the nearest folder above it with a package.xml, manifest.xml
/// or model.config, or with the folders that robots are kept in, such as urdf/ and mjcf/, the
/// widest of these; without them its own folder. Packages that it names (package://, model://) are
/// found beside it or above it, and may be read as well. Links of the file system count as where
/// they lead.
class Reach {
 public:
  /// Anything may be opened.
  Reach() = default;
  /// `folder`: of the robot's file.
  explicit Reach(const std::filesystem::path& folder);

  [[nodiscard]] bool allows(const std::filesystem::path& file) const;
  /// A package that was found by its name.
  void add(const std::filesystem::path& package);
  /// Remembers what was asked for and not allowed.
  void refuse(std::string name) { refused_.insert(std::move(name)); }
  [[nodiscard]] bool has_refused(const std::string& name) const { return refused_.contains(name); }

  [[nodiscard]] const std::filesystem::path& package() const { return package_; }
  /// A sentence about what was refused; "" when nothing was.
  [[nodiscard]] std::string told() const;

 private:
  bool is_bounded_ = false;
  std::filesystem::path package_;
  std::vector<std::filesystem::path> roots_;
  std::set<std::string> refused_;
};

}  // namespace robomosp::robot_files
