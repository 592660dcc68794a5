// SPDX-License-Identifier: Apache-2.0
// The program on which the examples of commands run, and a folder of their own for their files.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"

namespace robomosp::test {

inline std::unique_ptr<ioci::Application>& examples_holder() {
  static std::unique_ptr<ioci::Application> one = [] {
    auto made = ioci::Application::create(
        {.plugin_path = {ROBOMOSP_PLUGIN_DIR},
         .library = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}});
    if (!made.ok()) {
      ADD_FAILURE() << made.error().sentence();
      std::abort();
    }
    return std::move(*made);
  }();
  return one;
}

inline ioci::Application& examples_app() { return *examples_holder(); }

/// Whether this build lacks what the command draws with.
inline bool cannot_draw(const ioci::CommandSpec& spec) {
  return (spec.name.ends_with(".render") || spec.name == "recording.video") &&
         examples_app().registry.list("robomosp.renderer/2").empty();
}

/// Makes a folder the current one for a scope, and removes it then.
class ExamplesFolder {
 public:
  explicit ExamplesFolder(const std::string& name)
      : before_(std::filesystem::current_path()),
        folder_(std::filesystem::temp_directory_path() /
                ("robomosp-" + name + "-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    std::filesystem::current_path(folder_);
    ::setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);  // what examples choose for good
  }
  ~ExamplesFolder() {
    std::filesystem::current_path(before_);
    std::error_code ec;
    std::filesystem::remove_all(folder_, ec);
  }
  ExamplesFolder(const ExamplesFolder&) = delete;
  ExamplesFolder& operator=(const ExamplesFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path before_, folder_;
};

}  // namespace robomosp::test
