// SPDX-License-Identifier: Apache-2.0
// Tokens: who may connect to a server, and what they may do there; kept as hashes in a file that
// only its owner reads (layer: application, remote).
#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/effects.h"

namespace robomosp::remote {

/// What whoever has no say otherwise may do.
inline constexpr Effects kUsualEffects = Effect::reads | Effect::edits | Effect::simulates;
/// Effects that no token gets as a whole: commands that have them are granted by name.
inline constexpr Effects kByNameOnly = Effect::loads_code | Effect::stops | Effect::administers;

/// What a client may do.
struct Rights {
  std::string name{};  ///< of the token; "" = without one
  Effects effects = kUsualEffects;
  std::vector<std::string> commands{};  ///< granted by name, whatever their effects
  std::filesystem::path folder{};       ///< where files are read and written; empty = anywhere
  std::uint64_t rate = 0;               ///< requests per second; 0 = the server's limit
};

struct Token {
  Rights rights;
  std::string hash;          ///< of the secret, sha256()
  std::int64_t created = 0;  ///< [s since 1970]
  std::int64_t expires = 0;  ///< [s since 1970]; 0 = never
};

/// The file is read anew when another program changed it, so what is revoked there holds at the
/// next connection. [any thread]
class Tokens {
 public:
  /// `file` need not be there yet. ErrorCode::permission when others may read or write it.
  static Result<Tokens> open(std::filesystem::path file);
  /// $XDG_CONFIG_HOME/robomosp/tokens.json, or below ~/.config; empty without either.
  [[nodiscard]] static std::filesystem::path usual_file();
  Tokens(Tokens&& o) noexcept : file_(std::move(o.file_)) {}

  /// Adds a token and gives its secret, which is kept nowhere. ErrorCode::conflict when the name is
  /// taken by one that is still valid, invalid_argument for a name, effect or folder that cannot
  /// be. `seconds`: until it expires; 0 = never.
  Result<std::string> grant(Rights rights, std::int64_t seconds);
  /// ErrorCode::unknown_name when there is none.
  Result<void> revoke(std::string_view name);
  /// The token of a secret. ErrorCode::permission when there is none, or it has expired.
  [[nodiscard]] Result<Token> find(std::string_view secret) const;
  /// Those that are there, expired ones too.
  [[nodiscard]] Result<std::vector<Token>> list() const;
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  explicit Tokens(std::filesystem::path file) : file_(std::move(file)) {}
  [[nodiscard]] Result<std::vector<Token>> read() const;
  Result<void> write(const std::vector<Token>& tokens) const;
  std::filesystem::path file_;
};

}  // namespace robomosp::remote
