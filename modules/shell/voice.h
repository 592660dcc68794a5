// SPDX-License-Identifier: Apache-2.0
// What the command line of `robomosp` says, and the voice that answers (layer: application, shell
// only).
#pragma once

#include <atomic>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"
#include "remote/json.h"

namespace robomosp::shell {

using remote::NameOf;

/// Options of every subcommand.
struct Settings {
  bool json = false, quiet = false, no_cache = false, no_plugins = false, trace = false,
       trust = false;
  std::string color = "auto";
  std::vector<std::string> plugin_path, library;
};

/// The line of a terminal that shows the progress of a command. Whatever else is printed erases it
/// first. [any thread]
class ProgressLine {
 public:
  void show(double fraction, std::string_view what);
  void erase();

 private:
  std::atomic<bool> is_shown_ = false;
};
[[nodiscard]] ProgressLine& progress_line();

/// Speaks to the user: results on standard output, everything else on standard error.
class Voice {
 public:
  explicit Voice(const Settings& s);
  /// From here on standard output carries answers only: whatever else is written to it, by
  /// scripts, by programs that they run and by libraries, goes to standard error. Returns the
  /// descriptor of the answers.
  int keep_output();
  [[nodiscard]] bool json() const { return settings_.json; }
  [[nodiscard]] bool quiet() const { return settings_.quiet; }

  /// Prints the error and returns its exit code.
  int fail(const Error& e, std::string_view trace = {}) const;
  void note(std::string_view text) const;
  void warn(std::string_view text) const;
  void line(std::string_view text) const;
  /// Prints a result: text for people, {"ok": true, "value": ...} for programs.
  void result(const Value& value, std::string_view text, const NameOf& name_of = {}) const;
  /// From here on results that are longer than the terminal are shown page by page.
  void page_results() { pages_ = true; }

 private:
  void show(std::string_view text) const;
  void to_stderr(const char* word, const char* color, std::string_view text) const;
  const Settings& settings_;
  std::FILE* out_ = stdout;
  bool color_ = false, pages_ = false;
};

}  // namespace robomosp::shell
