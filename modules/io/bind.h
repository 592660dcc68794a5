// SPDX-License-Identifier: Apache-2.0
// Converts the fields of a native file to a record with references that are still paths (layer:
// application). Internal to modules/io.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "io/syntax.h"
#include "model/kind.h"
#include "model/records.h"

namespace robomosp::io {

/// A path written in a file, and where its id is stored after loading.
struct Reference {
  std::string path;
  std::uint32_t offset = 0;
  std::vector<Kind> kinds;  ///< allowed kinds
  std::string owner;        ///< for messages: `part "plate"`
  std::function<void(model::Body&, AnyId)> set;
};

/// A geometry file named by an imported node.
struct GeometryReference {
  std::string path;
  std::string source;  ///< CsgGeometry::source
  std::uint32_t offset = 0;
  std::size_t node = 0;  ///< of the solid
};

struct Bound {
  model::Record record;
  std::vector<Reference> references;
  std::vector<GeometryReference> geometries;
  /// Offsets of the record's elements: ("node", 3) -> offset. See document::Subject.
  std::map<std::pair<std::string_view, std::size_t>, std::uint32_t> places;
  /// The values written before expressions, 0 if there are none, by the offset of the expression.
  /// Until bind_expressions() the record has model::marked_nan() of the offset there.
  std::map<std::uint32_t, double> last_values{};
};

[[nodiscard]] Result<Bound> bind(const Syntax&);

}  // namespace robomosp::io
