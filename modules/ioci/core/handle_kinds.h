// SPDX-License-Identifier: Apache-2.0
// Kinds of handles to objects other than records: recordings, jobs, runs and other registered ones
// (layer: application, ioci).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::ioci {

/// [application lock, or before other threads start]
class HandleKinds {
 public:
  /// The name of the object with a number; nullopt if it does not exist.
  using NameOf = std::function<std::optional<std::string>(std::uint64_t number)>;
  struct Entry {
    std::string kind;
    NameOf name_of;
  };

  /// Errors: the kind is a record kind or exists already.
  Result<void> add(std::string kind, NameOf name_of);
  /// nullptr if the kind is unknown.
  [[nodiscard]] const Entry* find(std::string_view kind) const;
  [[nodiscard]] const std::vector<Entry>& all() const { return entries_; }

 private:
  std::vector<Entry> entries_;
};

}  // namespace robomosp::ioci
