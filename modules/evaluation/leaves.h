// SPDX-License-Identifier: Apache-2.0
// The solids that a solid or object consists of, nested objects resolved (layer: application,
// evaluation). Internal to modules/evaluation. [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::evaluation {

/// A solid at a place within an object, nested objects resolved.
struct Leaf {
  SolidId solid;
  Pose placement;         ///< outermost_T_solid
  MaterialId material;    ///< resolved; may be none
  std::string name;       ///< "gripper.finger"; a solid's own name when it stands alone
  std::size_t group = 0;  ///< leaves of one group share an object whose overlaps count once
  /// The measured part its mass is in, by number.
  std::optional<std::size_t> measured = std::nullopt;
};

/// A solid or object in an object whose mass was measured.
struct MeasuredPart {
  AnyId what;
  Pose placement;  ///< outermost_T_part
  model::MeasuredMass measured;
};

/// The measured mass of a solid or object; null of other records.
[[nodiscard]] const std::optional<model::MeasuredMass>* measured_of(const model::Record& record);

/// All solids of a solid or object in order of listing. The outermost material given wins, and the
/// outermost measured mass below `id`; those go to `measured`.
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&, AnyId id,
                                                  std::vector<MeasuredPart>& measured);
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&, AnyId id);

/// The same of parts that are on a robot's body, in its frame: those of one group but for objects
/// with Overlap::sum.
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&,
                                                  std::span<const model::BodyPart>,
                                                  std::vector<MeasuredPart>& measured);

/// That a record that was named does not exist.
[[nodiscard]] Error stale(const document::Snapshot&, AnyId id);

}  // namespace robomosp::evaluation
