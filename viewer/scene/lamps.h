// SPDX-License-Identifier: GPL-3.0-or-later
// Lamps as the shaders know them: the renderer's own, or the lights of a scene (layer: GUI, private
// to scene/).
#pragma once

#include <span>
#include <vector>

#include <osg/StateSet>
#include <osg/Vec3f>

#include "viewer/frame.h"

namespace robomosp::viewer {

/// As many as one draw is lit by.
inline constexpr std::size_t kMostLamps = 8;

struct Lamp {
  Vec3 place{};                   ///< [m]; of a parallel one the unit direction towards it
  bool is_parallel = true;        ///< as the sun
  Vec3 axis{0, 0, -1};            ///< where a spot shines
  double half_angle = -1;         ///< of a spot [rad]; < 0 = shines to all sides
  std::array<float, 3> colour{};  ///< linear, with the intensity
};

/// The renderer's own, from a unit direction.
[[nodiscard]] Lamp own_lamp(const Vec3& towards);
/// The usable lights of a scene that shine from a place or direction, the brightest first.
[[nodiscard]] std::vector<Lamp> lamps_of(const std::vector<render::Light>& lights);
/// Share of the studio's sky and floor that the lights of a scene leave, linear: its ambient lights
/// together, or without any half of it beside other lights.
[[nodiscard]] osg::Vec3f surroundings_of(const std::vector<render::Light>& lights);
/// The lamp moved sideways as seen from `middle` to a point of the unit disk, so that many such
/// lamps have soft shadows.
[[nodiscard]] Lamp moved(const Lamp& lamp, const Vec3& middle, const std::array<double, 2>& disk);

/// Lights everything below a state by these lamps, at most kMostLamps; only the first has a shadow
/// map. `surroundings` is the share of the studio's sky and floor, linear.
void set_lamps(osg::StateSet* state, std::span<const Lamp> lamps,
               const osg::Vec3f& surroundings = {1, 1, 1});

}  // namespace robomosp::viewer
