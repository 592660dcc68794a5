// SPDX-License-Identifier: GPL-3.0-or-later
// ShadowMap: a depth texture and the camera that fills it as a lamp sees the scene (layer: GUI,
// private to scene/).
#pragma once

#include <span>

#include <osg/Camera>
#include <osg/Texture2D>

#include "viewer/frame.h"

namespace robomosp::viewer {

/// What a shader needs to look up a shadow.
struct ShadowLookup {
  osg::Matrixd map_T_world;  ///< to texture coordinates and depth, 0..1
  osg::Vec2f texel;          ///< width of one texel in the texture and in the world [m]
};

class ShadowMap {
 public:
  /// `casters` is drawn with `mask`; the texture has `size` x `size` texels.
  ShadowMap(int size, osg::Node* casters, unsigned mask);

  /// Texels on a side; the map is drawn again with the next picture.
  void set_size(int size);
  /// Shifts what is aimed at from now on by a share of a texel, -0.5 .. 0.5: the mean of many maps
  /// shows no steps.
  void set_shift(double x, double y);
  /// Looks at the points that cast shadows [m] from the direction of the light (unit vector towards
  /// it); of them at what may shade `seen`, points around all that is in the picture.
  /// `in_steps`: the borders move in steps, so that the map stays the same while a view moves a
  /// little.
  ShadowLookup aim(const Vec3& towards_light, std::span<const Vec3> points,
                   std::span<const Vec3> seen = {}, bool in_steps = false);
  /// Looks from a place along `axis` (unit vector), or where that shines to all sides
  /// (`half_angle` < 0) towards the middle of the points; 75 degrees to either side at most.
  ShadowLookup aim_from(const Vec3& place, const Vec3& axis, double half_angle,
                        std::span<const Vec3> points);
  /// Which nodes cast shadows from the next draw on; 0 leaves the map as it is, undrawn.
  void set_mask(unsigned mask);

  [[nodiscard]] osg::Camera* camera() { return camera_.get(); }
  [[nodiscard]] osg::Texture2D* texture() { return depth_.get(); }

 private:
  ShadowLookup look(const osg::Matrixd& view, const osg::Matrixd& projection, double texel);
  osg::ref_ptr<osg::Texture2D> depth_ = new osg::Texture2D;
  osg::ref_ptr<osg::Camera> camera_ = new osg::Camera;
  int size_;
  double shift_x_ = 0, shift_y_ = 0;
};

}  // namespace robomosp::viewer
