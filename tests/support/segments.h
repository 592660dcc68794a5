// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories made by a plugin's providers, for conformance tests.
#pragma once

#include <robomosp/sdk/conformance/segment_suite.h>

#include "kernel/plugin_loader.h"
#include "model/placement.h"
#include "motion/segment.h"

namespace robomosp::conformance {

/// A registry with the shipped plugins of those names, which stays to the end of the program.
inline const Registry& registry_with(const std::vector<std::string>& plugins) {
  struct Loaded {
    Registry registry;
    PluginLoader loader{registry};
  };
  static std::vector<std::unique_ptr<Loaded>> kept;
  Loaded& loaded = *kept.emplace_back(std::make_unique<Loaded>());
  for (const std::string& name : plugins)
    loaded.loader.load(std::string(ROBOMOSP_PLUGIN_DIR) + "/" + name + ".so");
  return loaded.registry;
}

inline model::TrajectorySegment record_of(const std::string& shape,
                                          const std::vector<Pose>& points) {
  model::TrajectorySegment record;
  record.shape.name = shape;
  for (const Pose& p : points) record.points.push_back(model::placement(p));
  return record;
}

/// A case of the suite made from a record that `fill` completes.
inline SegmentCase record_case(const Registry& registry, const std::string& shape,
                               const std::string& name, const std::vector<Pose>& points,
                               const std::function<void(model::TrajectorySegment&)>& fill) {
  SegmentCase c{"", shape, name, points, {}};
  c.make = [&registry, fill](const SegmentCase& with) {
    model::TrajectorySegment record = record_of(with.provider, with.points);
    fill(record);
    return motion::make_segment(registry, record, "it");
  };
  return c;
}

inline PathSample sample_at(const Segment& s, double t) {
  PathSample out[1];
  EXPECT_TRUE(s.sample({&t, 1}, out).ok());
  return out[0];
}

}  // namespace robomosp::conformance
