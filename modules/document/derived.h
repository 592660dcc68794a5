// SPDX-License-Identifier: Apache-2.0
// Derived: everything computed from records (meshes, moments, masses, robot models), looked up by
// fingerprint of its inputs; never edited, never saved (layer: application).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "document/document.h"
#include "kernel/registry.h"

namespace robomosp::document {

/// Mass of a solid or object in its own frame. Where an object's policy is Overlap::once, all that
/// is inside it, also in nested objects, is counted once, for the part listed first; parts
/// without material come last, so that they take no mass from others.
struct BodyMass {
  MassProperties mass;  ///< zero mass when no part has a material
  double volume = 0;    ///< counted once where parts overlap (Overlap::once) [m^3]
  double area = 0;      ///< sum of the parts' surface areas [m^2]
  double overlap = 0;   ///< volume that was counted once though parts share it [m^3]
  bool exact = true;
  std::vector<std::string> notes;  ///< such as: solid "cover" has no material, so it has no mass
};

/// A mesh at a place with its look.
struct Drawable {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose placement;  ///< parent_T_mesh: parent = record's frame, or link frame for robots
  Colour colour;   ///< sRGB
  double shininess = 0.3, metalness = 0;
};

/// What to draw for a robot: [0] = base, in the base frame (mounting frame times Robot::base), then
/// one list a link, in the link's frame; an invisible link has an empty list. `generated` tells
/// that no part is designed and the bodies are a skin made from the rows.
struct RobotBodies {
  std::vector<std::vector<Drawable>> bodies;
  bool generated = false;
};

/// How often derived values were found or made.
struct CacheStats {
  std::uint64_t hits = 0, misses = 0;
  std::size_t entries = 0, bytes = 0;
};

/// Computes on demand through providers and remembers. Failures are remembered too (except
/// cancellation). Inputs that do not matter for a value are not part of its key: a colour edit
/// meshes nothing. [any thread]
class Derived {
 public:
  explicit Derived(const Registry& registry, std::size_t budget_bytes = std::size_t{1} << 30);
  ~Derived();

  Result<std::shared_ptr<const Mesh>> mesh(const Snapshot&, SolidId, Progress&);
  Result<Moments> moments(const Snapshot&, SolidId, Progress&);
  Result<BodyMass> mass(const Snapshot&, AnyId solid_or_object, Progress&);
  /// Axis-aligned box {min, max} that holds a solid or object, in its frame [m]; turned parts count
  /// with the box of their own box.
  Result<std::array<Vec3, 2>> bounds(const Snapshot&, AnyId solid_or_object, Progress&);
  Result<std::vector<Drawable>> drawables(const Snapshot&, AnyId solid_or_object, Progress&);

  /// The mechanism with masses by its mass_source (parts of one link add up); gravity is given in
  /// the mounting frame.
  Result<std::shared_ptr<const RobotModel>> robot_model(const Snapshot&, RobotId, Vec3 gravity,
                                                        Progress&);
  Result<RobotBodies> robot_bodies(const Snapshot&, RobotId, Progress&);

  [[nodiscard]] CacheStats stats() const;
  void clear();
  void set_enabled(bool);  ///< off = everything is computed anew (results must be equal)

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::document
