// SPDX-License-Identifier: Apache-2.0
// Scripts: the scripting language of a client's session. modules/lua registers it, so that ioci
// does not include that module (layer: application).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

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
