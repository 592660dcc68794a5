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
  std::string name;       ///< "gripper.finger"; a solid's name if it is not part of an object
  std::size_t group = 0;  ///< leaves of one group share an object that counts overlaps once
  /// Index of the measured part that includes its mass.
  std::optional<std::size_t> measured = std::nullopt;
};

/// A solid or object with a measured mass, within an object.
struct MeasuredPart {
  AnyId what;
  Pose placement;  ///< outermost_T_part
  model::MeasuredMass measured;
};

/// The measured mass of a solid or object; empty for other records.
[[nodiscard]] const std::optional<model::MeasuredMass>* measured_of(const model::Record& record);

/// All solids of a solid or object in order of listing. The outermost material wins, and the
/// outermost measured mass below `id`; measured parts are added to `measured`.
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&, AnyId id,
                                                  std::vector<MeasuredPart>& measured);
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&, AnyId id);

/// The same for the parts on a robot's body, in its frame: they form one group, except objects with
/// Overlap::sum.
[[nodiscard]] Result<std::vector<Leaf>> leaves_of(const document::Snapshot&,
                                                  std::span<const model::BodyPart>,
                                                  std::vector<MeasuredPart>& measured);

/// The error that a named record does not exist.
[[nodiscard]] Error stale(const document::Snapshot&, AnyId id);

}  // namespace robomosp::evaluation
