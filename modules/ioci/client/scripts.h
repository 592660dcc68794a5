// SPDX-License-Identifier: Apache-2.0
// Scripts: the scripting language of a client's session. modules/lua registers it, so that ioci
// does not include that module (layer: application).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

/// Completions of an input: what starts at byte `start` may become one of `words`.
struct ScriptCompletion {
  std::size_t start = 0;
  std::vector<std::string> words;
};

/// The state of the scripting language of one session. It never throws. [the session's thread]
class Scripts {
 public:
  Scripts() = default;
  Scripts(const Scripts&) = delete;
  Scripts& operator=(const Scripts&) = delete;
  virtual ~Scripts() = default;
  /// Runs a file and returns its return values.
  virtual Result<List> run_file(const std::filesystem::path& file,
                                std::span<const std::string> arguments) = 0;
  /// Evaluates one input of a console. Returns the text of its results, "" if there are none.
  /// `shown`, if not null, gets the results that can be pictures or plots: handles, texts, and of
  /// tables the fields png and file.
  virtual Result<std::string> evaluate(std::string_view input, List* shown) = 0;
  /// True if the input is the beginning of an incomplete statement.
  [[nodiscard]] virtual bool is_incomplete(std::string_view input) const = 0;
  /// Candidates at byte `cursor` of an input. Runs no script.
  [[nodiscard]] virtual ScriptCompletion complete(std::string_view input,
                                                  std::size_t cursor) const = 0;
  /// Call stack of the last failure, one frame a line.
  [[nodiscard]] virtual std::string traceback() const = 0;
  /// Where scripts print to; empty = standard output, as at first.
  virtual void print_to(std::function<void(std::string_view)> print) = 0;
  /// Runs the calls of other threads to solvers that scripts provide.
  virtual void serve() = 0;
};

/// Registers the language when the program starts: `const ScriptLanguage kLua(&make);`.
class ScriptLanguage {
 public:
  /// Makes the state for a session and runs the scripts that are plugins of this path. `wake` is
  /// called, on any thread, when serve() has something to do.
  using Make = std::unique_ptr<Scripts> (*)(Application&, Session&,
                                            std::span<const std::filesystem::path> plugin_path,
                                            std::function<void()> wake);
  explicit ScriptLanguage(Make make);
  /// Null if the program has no scripting language.
  [[nodiscard]] static Make registered();
};

}  // namespace robomosp::ioci
