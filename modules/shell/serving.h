// SPDX-License-Identifier: Apache-2.0
// `robomosp serve`, `rpc`, `language-server` and `debug-adapter` (layer: application, shell only).
#pragma once

#include <string>
#include <vector>

#include "shell/program.h"

namespace robomosp::shell {

/// Options of `serve`.
struct ServeSettings {
  std::vector<std::string> listen, allow, grant, limits, origins;
  std::string script, certificate, key, token_file, folder, audit;
  bool needs_token = false, tls_everywhere = false, browser = false;
  /// The arguments of server.start.
  [[nodiscard]] Result<Map> arguments() const;
};

// Each returns the exit code.
int run_rpc(const Settings&, Voice&);
int run_language_server(const Settings&, Voice&);
int run_debug_adapter(const Settings&, Voice&);
/// Serves until it is interrupted, or a client stops the program.
int run_serve(const Settings&, const Voice&, const ServeSettings&);

}  // namespace robomosp::shell
