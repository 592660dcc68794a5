// SPDX-License-Identifier: Apache-2.0
// A solver written in Lua that is kept with a record: its text travels with the record's file
// (layer: data processing).
#pragma once

#include <cstddef>
#include <string>

namespace robomosp::model {

/// Loading one never runs it: it is text until the user trusts it (ioci/core/kept_solvers.h).
struct KeptSolver {
  std::string interface;  ///< "robomosp.ik/1"
  std::string name;       ///< of the provider, as records choose it
  std::string provides;   ///< name that the text gives it, when it is another; "" = `name`
  std::string text;       ///< Lua; of at most kMostKeptText bytes
  bool operator==(const KeptSolver&) const = default;
};
/// What a record keeps at the most of one.
inline constexpr std::size_t kMostKeptText = std::size_t{1} << 20;

}  // namespace robomosp::model
