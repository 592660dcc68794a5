// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/shadow_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <osg/PolygonOffset>

#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"

namespace robomosp::viewer {
namespace {

constexpr double kStepsOfBorder = 8;  ///< in half the width of a map, at least

/// A unit vector across another.
Vec3 side_of(const Vec3& z) {
  const Vec3 x = cross(std::abs(z[2]) < 0.95 ? Vec3{0, 0, 1} : Vec3{0, 1, 0}, z);
  return (1 / norm(x)) * x;
}

}  // namespace

ShadowMap::ShadowMap(int size, osg::Node* casters, unsigned mask) : size_(size) {
  depth_->setTextureSize(size, size);
  depth_->setInternalFormat(GL_DEPTH_COMPONENT32F);  // software OpenGL reads it fastest
  depth_->setSourceFormat(GL_DEPTH_COMPONENT);  // without these two OSG cannot set up the buffer
  depth_->setSourceType(GL_FLOAT);
  depth_->setShadowComparison(true);
  depth_->setShadowCompareFunc(osg::Texture::LEQUAL);
  depth_->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
  depth_->setFilter(osg::Texture::MAG_FILTER, osg::Texture::LINEAR);
  depth_->setWrap(osg::Texture::WRAP_S, osg::Texture::CLAMP_TO_EDGE);
  depth_->setWrap(osg::Texture::WRAP_T, osg::Texture::CLAMP_TO_EDGE);
  camera_->setRenderOrder(osg::Camera::PRE_RENDER);
  camera_->setReferenceFrame(osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
  camera_->setRenderTargetImplementation(osg::Camera::FRAME_BUFFER_OBJECT);
  camera_->attach(osg::Camera::DEPTH_BUFFER, depth_.get());
  // Depth alone: otherwise OSG adds a buffer of colours of the same size.
  camera_->setImplicitBufferAttachmentMask(0, 0);
  camera_->setDrawBuffer(GL_NONE);
  camera_->setReadBuffer(GL_NONE);
  camera_->setClearMask(GL_DEPTH_BUFFER_BIT);
  camera_->setViewport(0, 0, size, size);
  camera_->setComputeNearFarMode(osg::Camera::DO_NOT_COMPUTE_NEAR_FAR);
  camera_->setCullingMode(osg::CullSettings::NO_CULLING);
  camera_->addChild(casters);
  set_mask(mask);
  osg::StateSet* s = camera_->getOrCreateStateSet();
  const auto forced = osg::StateAttribute::ON | osg::StateAttribute::OVERRIDE;
  s->setAttributeAndModes(program_of(caster_shader(), "caster"), forced);
  s->setAttributeAndModes(new osg::PolygonOffset(1.6F, 4.0F), forced);
  s->setMode(GL_BLEND, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
}

void ShadowMap::set_mask(unsigned mask) {
  camera_->setCullMask(mask);
  camera_->setNodeMask(mask == 0 ? 0 : ~0U);
}

void ShadowMap::set_size(int size) {
  if (size == size_) return;
  size_ = size;
  depth_->setTextureSize(size, size);
  depth_->dirtyTextureObject();
  camera_->setViewport(0, 0, size, size);
  camera_->dirtyAttachmentMap();
}

void ShadowMap::set_shift(double x, double y) {
  shift_x_ = x;
  shift_y_ = y;
}

ShadowLookup ShadowMap::aim(const Vec3& towards_light, std::span<const Vec3> points,
                            std::span<const Vec3> seen, bool in_steps) {
  const Vec3& z = towards_light;
  const Vec3 x = side_of(z), y = cross(z, x);
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  for (const Vec3& p : points) {
    const Vec3 q{dot(p, x), dot(p, y), dot(p, z)};
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], q[i]);
      high[i] = std::max(high[i], q[i]);
    }
  }
  if (points.empty()) low = {0, 0, 0}, high = {1, 1, 1};
  // A place and what shades it lie one behind the other, so no more than the picture shows is
  // needed to the sides.
  if (!seen.empty()) {
    Vec3 first{kInf, kInf, kInf}, last{-kInf, -kInf, -kInf};
    const std::array<Vec3, 2> axes{x, y};
    for (const Vec3& p : seen)
      for (std::size_t i = 0; i < 2; ++i) {
        first[i] = std::min(first[i], dot(p, axes[i]));
        last[i] = std::max(last[i], dot(p, axes[i]));
      }
    for (std::size_t i = 0; i < 2; ++i) {
      double from = std::max(low[i], first[i]), to = std::min(high[i], last[i]);
      if (!(from < to)) continue;
      if (in_steps) {
        const double step = std::exp2(std::floor(std::log2(to - from))) / kStepsOfBorder;
        from = std::max(low[i], step * std::floor(from / step));
        to = std::min(high[i], step * std::ceil(to / step));
      }
      low[i] = from, high[i] = to;
    }
  }
  const Vec3 size = high - low;
  const double border = 0.02 * std::max({size[0], size[1], size[2], 1e-6});
  const osg::Matrixd view = matrix_of(Matrix4{x[0], x[1], x[2], 0, y[0], y[1], y[2], 0,  //
                                              z[0], z[1], z[2], 0, 0, 0, 0, 1});
  const double dx = shift_x_ * (size[0] + 2 * border) / size_,
               dy = shift_y_ * (size[1] + 2 * border) / size_;
  const osg::Matrixd projection =
      osg::Matrixd::ortho(low[0] - border + dx, high[0] + border + dx, low[1] - border + dy,
                          high[1] + border + dy, -high[2] - border, -low[2] + border);
  return look(view, projection, (std::max(size[0], size[1]) + 2 * border) / size_);
}

ShadowLookup ShadowMap::aim_from(const Vec3& place, const Vec3& axis, double half_angle,
                                 std::span<const Vec3> points) {
  constexpr double kWidest = 1.3;  // [rad]
  Vec3 forward = axis, middle{};
  for (const Vec3& p : points)
    middle = middle + (1.0 / static_cast<double>(points.size())) * (p - place);
  if (half_angle < 0 && norm(middle) > 1e-9) forward = (1 / norm(middle)) * middle;
  double widest = 0, near = std::numeric_limits<double>::infinity(), far = 1e-6;
  for (const Vec3& p : points) {
    const Vec3 way = p - place;
    const double depth = dot(way, forward);
    widest = std::max(widest, std::atan2(norm(way - depth * forward), depth));
    near = std::min(near, depth);
    far = std::max(far, depth);
  }
  far *= 1.02;
  near = std::clamp(0.98 * near, 0.02 * far, 0.9 * far);
  const double half = std::clamp(
      half_angle < 0 ? 1.02 * widest : std::min(half_angle, 1.02 * widest), 1e-3, kWidest);
  const Vec3 z = -1.0 * forward, x = side_of(z), y = cross(z, x);
  const osg::Matrixd view =
      matrix_of(Matrix4{x[0], x[1], x[2], -dot(x, place), y[0], y[1], y[2], -dot(y, place),  //
                        z[0], z[1], z[2], -dot(z, place), 0, 0, 0, 1});
  const double edge = std::tan(half);
  const double wide = edge * near, dx = shift_x_ * 2 * wide / size_,
               dy = shift_y_ * 2 * wide / size_;
  const osg::Matrixd projection =
      osg::Matrixd::frustum(dx - wide, dx + wide, dy - wide, dy + wide, near, far);
  return look(view, projection, edge * (near + far) / size_);
}

/// `texel`: width of one in the scene [m].
ShadowLookup ShadowMap::look(const osg::Matrixd& view, const osg::Matrixd& projection,
                             double texel) {
  camera_->setViewMatrix(view);
  set_uniform(camera_->getOrCreateStateSet(), "world_T_view",
              osg::Matrixf(osg::Matrixd::inverse(view)));
  camera_->setProjectionMatrix(projection);
  return {view * projection * osg::Matrixd::translate(1, 1, 1) * osg::Matrixd::scale(0.5, 0.5, 0.5),
          osg::Vec2f(1.0F / static_cast<float>(size_), static_cast<float>(texel))};
}

}  // namespace robomosp::viewer
