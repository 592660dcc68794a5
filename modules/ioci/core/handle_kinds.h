// SPDX-License-Identifier: Apache-2.0
// Kinds of handles that are no records: recordings, jobs, runs and what else registers (layer:
// application, ioci).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::ioci {

/// [application lock, or before other threads are there]
class HandleKinds {
 public:
  /// What the thing of a number is called; nullopt when there is none (any more).
  using NameOf = std::function<std::optional<std::string>(std::uint64_t number)>;
  struct Entry {
    std::string kind;
    NameOf name_of;
  };

  /// Errors: the kind is one of records or is there already.
  Result<void> add(std::string kind, NameOf name_of);
  /// nullptr when there is none of that kind.
  [[nodiscard]] const Entry* find(std::string_view kind) const;
  [[nodiscard]] const std::vector<Entry>& all() const { return entries_; }

 private:
  std::vector<Entry> entries_;
};

}  // namespace robomosp::ioci
