// SPDX-License-Identifier: Apache-2.0
// Secrets of tokens: random ones, their hashes, and comparing these; hashes of a page and of
// handshakes (layer: application, remote).
// [any thread]
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::remote {

/// "rmp_" and 43 letters, digits, - and _: 256 random bits. ErrorCode::io when the system gives
/// none.
[[nodiscard]] Result<std::string> random_secret();
/// SHA-256 (FIPS 180-4) as 64 hexadecimal digits. A secret of 256 random bits cannot be guessed
/// from it, so it needs no salt and no slow hash.
[[nodiscard]] std::string sha256(std::string_view text);
/// The digests' bytes: SHA-256, and SHA-1, which the handshake of WebSocket asks for and which
/// keeps no secret.
[[nodiscard]] std::string sha256_bytes(std::string_view text);
[[nodiscard]] std::string sha1_bytes(std::string_view text);
/// In a time that does not depend on where they differ.
[[nodiscard]] bool equal_in_constant_time(std::string_view a, std::string_view b);

}  // namespace robomosp::remote
