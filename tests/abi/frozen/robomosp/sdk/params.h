// SPDX-License-Identifier: Apache-2.0
// Params: read-only view of the values given for a provider's parameters (layer: contract, std
// only).
#pragma once

#include <span>
#include <string_view>

#include <robomosp/sdk/types.h>

namespace robomosp {

/// The values of a provider's parameter table, checked against it and completed with its defaults
/// by the host: every parameter of the table can be read. Reading a name or type that the table
/// does not declare returns the empty value of the type. Implemented by the host. [any thread]
class Params {
 public:
  virtual ~Params() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  [[nodiscard]] virtual bool has(
      std::string_view name) const = 0;  ///< given by the user or defaulted
  [[nodiscard]] virtual double real(std::string_view name) const = 0;  ///< SI, radians
  [[nodiscard]] virtual long long integer(std::string_view name) const = 0;
  [[nodiscard]] virtual bool boolean(std::string_view name) const = 0;
  [[nodiscard]] virtual std::string_view text(
      std::string_view name) const = 0;  ///< string, enum, path
  [[nodiscard]] virtual std::span<const double> reals(std::string_view name) const = 0;  ///< real[]
  [[nodiscard]] virtual Pose pose(std::string_view name) const = 0;
};

}  // namespace robomosp
