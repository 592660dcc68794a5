// SPDX-License-Identifier: Apache-2.0
// Records as the items that exporters write (layer: application, exchange; internal).
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

#include "exchange/providers.h"
#include "model/records.h"

namespace robomosp::exchange {

/// Export items of records, and what keeps their content alive.
class ExportItems {
 public:
  /// `chord` [m] instead of that of the solids; 0 = theirs.
  ExportItems(const Exchange& with, bool wants_exact, double chord)
      : with_(with), wants_exact_(wants_exact), chord_(chord) {}

  /// A solid, or an object with all its parts, at a pose in `parent` (-1 = at the top).
  [[nodiscard]] Result<void> add(AnyId id, const std::string& name, const Pose& pose,
                                 std::int32_t parent);

  /// A robot at the joint values; generated bodies are meshes.
  [[nodiscard]] Result<void> add_robot(RobotId id, const std::string& name,
                                       const Pose& world_T_mounting, std::vector<double> q);

  /// Replaces all solids by what the plane (top_T_plane) cuts out of them.
  [[nodiscard]] Result<void> cut(const Pose& plane);

  std::vector<ExportItem> items;
  std::vector<ExportRobot> robots;
  std::vector<std::string> notes;
  bool wants_bodies = true;  ///< of robots

  /// Pairs of the only robot; of several they are left out.
  void set_pairs(std::vector<ExportPair> pairs);

  /// An item without content, for others to be in; returns its index. `number` is that of the link
  /// with this body, -1 = the base.
  std::int32_t group(const std::string& name, const Pose& pose, std::int32_t parent,
                     ItemOfRobot link = {}, std::int32_t number = -1);

 private:
  void push(ExportItem item, SolidId solid);
  const Mesh* keep(std::shared_ptr<const Mesh> mesh);

  Result<void> add_solid(SolidId id, const std::string& name, const Pose& pose, std::int32_t parent,
                         MaterialId material);

  /// Boxes, cylinders and spheres that are the whole solid.
  static std::optional<ExportPrimitive> primitive_of(const model::Solid& s);

  /// `plain`: without its attached tools as further tools.
  static ExportMechanism mechanism_of(const model::Robot& robot, const model::Robot& plain);

  const Exchange& with_;
  bool wants_exact_;
  double chord_;
  std::vector<SolidId> solids_;  ///< of each item; number 0 = none
  std::deque<std::shared_ptr<const Mesh>> meshes_;
  std::deque<std::shared_ptr<const RobotModel>> models_;
  std::deque<ExportMechanism> mechanisms_;
  std::deque<MassProperties> masses_;
  std::deque<ExportPrimitive> primitives_;
  std::deque<std::shared_ptr<const CsgGeometry>> geometries_;
  std::deque<std::shared_ptr<const CsgProfile>> profiles_;
};

}  // namespace robomosp::exchange
