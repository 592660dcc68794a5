// SPDX-License-Identifier: Apache-2.0
// Expressions behind numbers in native files, `radius 10 mm = "bore/2"` (layer: application).
// Internal to modules/io.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "io/bind.h"
#include "io/syntax.h"
#include "model/records.h"

namespace robomosp::io {

/// Reads a field `parameter wall 7 mm = "bore/4 + 2 mm" "description"`.
[[nodiscard]] Result<model::Parameter> read_parameter(const Syntax&, std::uint32_t field);

/// Notes which numbers of the record are expressions and evaluates what the record alone can; of
/// those that use a world the file must give the last value. `fields` of kind parameter are read.
Result<void> bind_expressions(const Syntax&, Bound&);

/// How a parameter is written: `parameter wall 7 mm = "bore/4 + 2 mm" "description"`.
[[nodiscard]] std::string print_parameter(const model::Parameter&);

/// Texts of a record's expressions by the number they belong to.
class ExpressionTexts {
 public:
  explicit ExpressionTexts(const model::Body&);
  [[nodiscard]] bool empty() const { return texts_.empty(); }
  /// ` = "bore/2"`, or nothing.
  [[nodiscard]] std::string behind(const double& number) const;
  [[nodiscard]] bool has(const double& number) const { return texts_.contains(&number); }
  [[nodiscard]] bool has(const model::Placement&) const;

 private:
  std::map<const double*, std::string_view> texts_;
};

}  // namespace robomosp::io
