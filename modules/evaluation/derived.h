// SPDX-License-Identifier: Apache-2.0
// Derived: everything computed from records (meshes, moments, masses, robot models), looked up by
// fingerprint of its inputs; never edited, never saved (layer: application).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "document/document.h"
#include "evaluation/shapes.h"
#include "kernel/file_cache.h"
#include "kernel/registry.h"
#include "spatial/surface_cuts.h"
#include "spatial/surface_moments.h"

namespace robomosp::evaluation {

/// Mass of a solid or object in its own frame. A measured mass, of the whole or of a part, replaces
/// the computed one. With the policy Overlap::once, overlaps within an object, also in nested
/// objects, are counted once, for the part listed first; parts without material come last, so that
/// they take no mass from others.
struct BodyMass {
  MassProperties mass;  ///< zero mass when no part has a material
  double volume = 0;    ///< counted once where parts overlap (Overlap::once) [m^3]
  double area = 0;      ///< sum of the parts' surface areas [m^2]
  double overlap = 0;   ///< volume that was counted once though parts share it [m^3]
  bool exact = true;
  double relative_error = 0;  ///< bound for mass and volume, when not exact
  /// The computed mass, if `mass` is a measured one.
  std::optional<MassProperties> computed = std::nullopt;
  std::string measured_source;     ///< how and by whom it was measured; "" = not measured
  std::vector<std::string> notes;  ///< such as: solid "cover" has no material, so it has no mass
};

/// Contribution of one solid of an object to its mass, in the object's frame.
struct PartMass {
  std::string name;  ///< "gripper.finger"; the solid's name if it is not part of an object
  SolidId solid;
  MaterialId material;  ///< may be none
  double density = 0;   ///< [kg/m^3]
  double volume = 0;    ///< counted: without what an earlier part claimed (Overlap::once) [m^3]
  MassProperties mass;  ///< of the counted volume
};

/// A placed mesh with its appearance.
struct Drawable {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose placement;  ///< parent_T_mesh: parent = record's frame, or link frame for robots
  Colour colour;   ///< sRGB
  double shininess = 0.3, metalness = 0;
  std::optional<Colour> ambient = std::nullopt;   ///< colour in the shade; none = the colour
  std::optional<Colour> specular = std::nullopt;  ///< colour of highlights; none = by metalness
  Colour emission{0, 0, 0, 1};                    ///< emitted light
  /// The solid could not be built: this is one of the operands of the failed operation.
  bool is_operand = false;
  std::string failure = {};  ///< of an operand: error message of the operation
};

/// An imported mesh in a solid that does not bound a clean solid.
struct MeshState {
  std::string node;   ///< name of the node that holds it
  Error why;          ///< the error of operations on it
  bool alone = true;  ///< it is the whole solid, which is drawn, collides and weighs as it is
  std::string note;   ///< source of its mass; "" unless it is alone
  spatial::SurfaceMoments surface;        ///< faults in the solid's frame
  std::vector<spatial::SurfaceCut> cuts;  ///< places in the solid's frame; the first ones
};

/// Bodies to draw for a robot: [0] = base, in the base frame (mounting frame times Robot::base),
/// then one list per link, in the link's frame; an invisible link has an empty list. The bodies of
/// attached tools follow those of their link, whether it is visible or not. `is_generated` marks
/// lists made from the rows (robotics::generated_bodies); `generated` is true if all are, since no
/// part is designed.
struct RobotBodies {
  std::vector<std::vector<Drawable>> bodies;
  std::vector<bool> is_generated;
  std::vector<std::size_t> tools_from;  ///< index in each list where the attached tools begin
  bool generated = false;
};

/// Numbers of derived values found and computed.
struct CacheStats {
  std::uint64_t hits = 0, misses = 0;
  std::size_t entries = 0, bytes = 0;
};

/// Computes values on demand by providers and caches them. Solids are built by the default CSG
/// engine, those with an imported mesh by one with the tag "mesh", which also replaces the default
/// engine if its result failed its check, with a note that the result is an approximation. Failures
/// are cached too (except cancellation). A value requested by several threads at once is computed
/// by the first; the others wait, each until it is cancelled. Inputs that do not affect a value are
/// not part of its key: editing a colour meshes nothing. [any thread]
class Derived {
 public:
  explicit Derived(const Registry& registry, std::size_t budget_bytes = std::size_t{1} << 30);
  ~Derived();

  /// Keeps the engines' results for solids in files between runs; null = not. Call it before any
  /// request.
  void keep_in(std::shared_ptr<FileCache>);
  [[nodiscard]] const std::shared_ptr<FileCache>& files() const;

  Result<std::shared_ptr<const Mesh>> mesh(const document::Snapshot&, SolidId, Progress&);
  /// `chord`: greatest distance from the exact surface [m]; 0 = the solid's own.
  Result<std::shared_ptr<const Mesh>> mesh(const document::Snapshot&, SolidId, double chord,
                                           Progress&);
  /// Why its mesh is an approximation by a substitute engine; "" = it is not.
  Result<std::string> stand_in(const document::Snapshot&, SolidId, double chord, Progress&);
  Result<Moments> moments(const document::Snapshot&, SolidId, Progress&);
  Result<BodyMass> mass(const document::Snapshot&, AnyId solid_or_object, Progress&);
  /// Mass of the parts of a robot's link or base, in its frame, with overlaps counted once as in an
  /// object; only parts that are objects with Overlap::sum are counted separately.
  Result<BodyMass> mass(const document::Snapshot&, std::span<const model::BodyPart>, Progress&);
  /// The solids that make up the computed mass, in order of listing; they add up to it.
  Result<std::vector<PartMass>> part_masses(const document::Snapshot&, AnyId solid_or_object,
                                            Progress&);
  /// Faces, edges and corners of a solid in its frame, in the engine's order.
  Result<std::shared_ptr<const std::vector<CsgFeature>>> features(const document::Snapshot&,
                                                                  SolidId, Progress&);
  /// The edges of a solid as curves, with places within `chord` [m] of them.
  Result<std::shared_ptr<const std::vector<CsgEdge>>> edges(const document::Snapshot&, SolidId,
                                                            double chord, Progress&);
  /// Axis-aligned box {min, max} around a solid or object, in its frame [m]; for rotated parts, the
  /// box around their rotated box.
  Result<std::array<Vec3, 2>> bounds(const document::Snapshot&, AnyId solid_or_object, Progress&);
  /// For a solid that cannot be built, the operands of the failed operation; an error only if there
  /// is nothing to draw.
  Result<std::vector<Drawable>> drawables(const document::Snapshot&, AnyId solid_or_object,
                                          Progress&);

  /// The section of the solid in the plane z = 0 of `plane` (solid_T_plane); curves other than
  /// lines and arcs are within `chord` [m].
  Result<std::shared_ptr<const CsgProfile>> section(const document::Snapshot&, SolidId,
                                                    const Pose& plane, double chord, Progress&);
  /// The solid as an `imported` node holds it, in its frame, with its digest.
  Result<std::shared_ptr<const CsgGeometry>> geometry(const document::Snapshot&, SolidId,
                                                      Progress&);

  /// The imported meshes in a solid that are not clean solids; `places` also fills `surface` and
  /// `cuts`. An error only for a missing solid or on cancellation.
  Result<std::vector<MeshState>> mesh_states(const document::Snapshot&, SolidId, bool places,
                                             Progress&);

  /// Builds and meshes all solids of these solids and objects that are not cached yet, several at
  /// once; failures are reported when the value is requested. Fails only if cancelled.
  Result<void> prepare(const document::Snapshot&, std::span<const AnyId> solids_and_objects,
                       Progress&);

  /// The mechanism with masses by its mass_source (parts of one link add up); gravity is expressed
  /// in the mounting frame.
  Result<std::shared_ptr<const RobotModel>> robot_model(const document::Snapshot&, RobotId,
                                                        Vec3 gravity, Progress&);
  /// The immobile parts of a robot as one body in the mounting frame: its base (the designed parts
  /// where these count, else the published mass), links fixed to it and payloads there; empty =
  /// none of them has a known mass.
  Result<std::optional<MassProperties>> standing_mass(const document::Snapshot&, RobotId,
                                                      Progress&);
  Result<RobotBodies> robot_bodies(const document::Snapshot&, RobotId, Progress&);

  /// The shapes of a solid or object for collision and contact, in its frame.
  Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes(const document::Snapshot&,
                                                                AnyId solid_or_object, Progress&);
  /// The same for a robot: [0] = base, in the base frame, then one list per link, in the link's
  /// frame; generated ones as robotics::generated_bodies selects, followed by the attached tools.
  Result<std::vector<std::vector<ShapePiece>>> robot_shapes(const document::Snapshot&, RobotId,
                                                            Progress&);

  [[nodiscard]] CacheStats stats() const;
  void clear();
  void set_enabled(bool);  ///< off = everything is recomputed (results must be equal)

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::evaluation
