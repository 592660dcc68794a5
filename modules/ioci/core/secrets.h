// SPDX-License-Identifier: Apache-2.0
// Which arguments are secrets, that logs, events and recorded macros must not show (layer:
// application).
#pragma once

#include <string_view>

#include "kernel/value.h"

namespace robomosp::ioci {

/// The rule of secrets: an argument, or an entry of a map within one at any depth, is a secret when
/// one of the words of its name is token, password, passphrase, secret or credential, in any case,
/// and the last one is not file. So `token` and `api_token` are, `token_file` is not. What holds a
/// secret must be named so. [any thread]
[[nodiscard]] bool is_secret(std::string_view argument);
/// Written in place of a secret.
inline constexpr std::string_view kRedacted = "(secret)";
/// Whether there are secrets among arguments, at any depth.
[[nodiscard]] bool has_secrets(const Map& args);
/// The arguments with kRedacted in place of secrets.
[[nodiscard]] Map without_secrets(const Map& args);

}  // namespace robomosp::ioci
