// SPDX-License-Identifier: Apache-2.0
// The parts of an OPC package (ECMA-376 part 2), which is a ZIP, read sequentially in pieces, so
// that a part of any size needs little memory (layer: plugin).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

struct zip;

namespace robomosp::cad_exchange {

class Package {
 public:
  /// Opens the file and lists its parts.
  static Result<Package> open(const std::string& path);

  /// The name of a part as spelled in the package, or "". `name` may begin with a slash, and case
  /// and %-escapes do not matter, as for all names of parts.
  [[nodiscard]] std::string find(std::string_view name) const;
  /// All names as spelled in the package, in its order.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Passes a part on in pieces of up to 64 KiB, the last one empty; the first error of `take` ends
  /// it. Verifies the checksum at the end.
  Result<void> read(const std::string& name,
                    const std::function<Result<void>(std::string_view)>& take) const;
  /// A whole part of at most `most` bytes.
  [[nodiscard]] Result<std::string> text(const std::string& name, std::size_t most) const;

 private:
  struct Close {
    void operator()(zip* archive) const;
  };
  struct Place {
    std::uint64_t index = 0;
    std::string name;
  };
  std::unique_ptr<zip, Close> zip_;
  std::map<std::string, Place, std::less<>> parts_;  ///< by the name in lower case
  std::vector<std::string> names_;
};

}  // namespace robomosp::cad_exchange
