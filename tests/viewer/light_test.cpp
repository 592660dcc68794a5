// SPDX-License-Identifier: GPL-3.0-or-later
// Lights of a scene, by what they do to the floor and to a cube that hovers over it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "viewer/picture_support.h"
#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

using render::Light;

/// A light at a place that looks straight down.
Light lamp(Light::Kind kind, const Vec3& place) {
  Light l;
  l.kind = kind;
  l.pose.p = place;
  l.colour = {1, 1, 1, 1};
  return l;
}

/// The cube from above, over a floor without lines.
Frame floor_frame(std::vector<Light> lights) {
  Frame frame = cube_frame();
  frame.grid = frame.world_axes = false;
  frame.camera.view = Camera::View::top;
  frame.camera.zoom = 0.25;
  frame.lights = std::move(lights);
  return frame;
}

struct Taken {
  Image image;
  OrbitCamera camera;
  [[nodiscard]] Rgb at(const Vec3& place) const { return around(image, *camera.project(place)); }
};

Taken taken(const Frame& frame, Quality quality = Quality::fast) {
  auto r = renderer_for(frame, quality);
  Image image = finished(r);
  return {std::move(image), r.scene().camera()};
}

TEST(Lights, AMovedLightMovesTheShadow) {
  // The light is as far beside the cube as the cube is below it: the shadow of its middle, 20 cm
  // up under a light 1 m up, falls 0.2 / 0.8 as far to the other side.
  for (const Quality quality : {Quality::fast, Quality::quality})
    for (const double side : {-1.0, 1.0}) {
      const Taken t = taken(floor_frame({lamp(Light::Kind::point, {0.8 * side, 0, 1})}), quality);
      const Rgb shadow = t.at({-0.2 * side, 0, 0}), opposite = t.at({0.3 * side, 0, 0});
      EXPECT_LT(shadow.brightness(), opposite.brightness() - 40) << side;
      EXPECT_GT(shadow.brightness(), 20);  // the surroundings still light it
    }
}

TEST(Lights, AFloorIsAsBrightAsTheCosineOfTheLight) {
  // Without tone curve or dither: linear light of the floor is its share of direct light above the
  // surroundings', which the picture of a light without any reach shows.
  const auto linear = [](double srgb) { return std::pow((srgb / 255 + 0.055) / 1.055, 2.4); };
  const auto floor = [&](const Vec3& towards, double intensity) {
    Light l = lamp(Light::Kind::sun, {});
    const Vec3 z = (1 / norm(towards)) * towards,
               x = (1 / std::hypot(z[0], z[2])) * Vec3{z[2], 0, -z[0]}, y = cross(z, x);
    l.pose.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
    l.intensity = intensity;
    return linear(taken(floor_frame({l})).at({0.35, 0.35, 0}).g);
  };
  const double dark = floor({0, 0, 1}, 1e-6), square = floor({0, 0, 1}, 1) - dark;
  EXPECT_GT(square, 0.05);
  EXPECT_NEAR((floor({0, -1, 1}, 1) - dark) / square, std::sqrt(0.5), 0.03);
  EXPECT_NEAR((floor({0, 0, 1}, 0.5) - dark) / square, 0.5, 0.03);
}

TEST(Lights, TwoLightsAddUpAndEachHasItsShadow) {
  for (const Quality quality : {Quality::fast, Quality::quality}) {
    const Light left = lamp(Light::Kind::point, {-0.8, 0, 1}),
                right = lamp(Light::Kind::point, {0.8, 0, 1});
    const Taken one = taken(floor_frame({left}), quality);
    const Taken both = taken(floor_frame({left, right}), quality);
    const Vec3 free{0, 0.45, 0}, behind{0.2, 0, 0}, before{-0.2, 0, 0};
    EXPECT_GT(both.at(free).brightness(), one.at(free).brightness() + 15);
    // Each shadow is lit by the other light.
    EXPECT_GT(both.at(behind).brightness(), one.at(behind).brightness() + 15);
    EXPECT_NEAR(both.at(behind).brightness(), both.at(before).brightness(), 6);
    EXPECT_LT(both.at(behind).brightness(), both.at(free).brightness() - 15);
  }
}

/// Share of the places in rows where brightness goes up and down four times from pixel to pixel, by
/// more than dither does: what stippled shadows do everywhere, edges hardly ever.
double stippled(const Image& image, int channel) {
  int count = 0, all = 0;
  for (int y = 0; y < image.height; ++y) {
    const auto bend = [&](int x) {
      return 2 * image.at(x, y, channel) - image.at(x - 1, y, channel) -
             image.at(x + 1, y, channel);
    };
    for (int x = 1; x + 3 < image.width; ++x, ++all) {
      const int a = bend(x), b = bend(x + 1), c = bend(x + 2);
      if (a * b < 0 && b * c < 0 && std::min({std::abs(a), std::abs(b), std::abs(c)}) > 4) ++count;
    }
  }
  return static_cast<double>(count) / all;
}

TEST(Lights, ShadowsAreSmoothFromAnyAngleOnPartsAndInHalls) {
  for (const double size : {0.005, 1.0, 100.0})
    for (const double degrees : {8.0, 35.0, 60.0, 90.0}) {
      Light sun = lamp(Light::Kind::sun, {});
      const double a = degrees * std::acos(-1.0) / 180;
      sun.pose.R = {std::sin(a), 0, std::cos(a), 0, 1, 0, -std::cos(a), 0, std::sin(a)};
      Frame frame;
      frame.grid = frame.world_axes = frame.feature_edges = false;
      frame.lights = {sun};
      frame.camera.zoom = 0.8;
      const auto add = [&](const std::shared_ptr<const Mesh>& mesh, const Vec3& place) {
        Item i;
        i.id = frame.items.size() + 1;
        i.mesh = mesh;
        i.pose.p = size * place;
        i.appearance = {{0.7F, 0.7F, 0.7F, 1}, 0, 0};
        frame.items.push_back(std::move(i));
      };
      add(synthetic::box(0.6 * size, 0.4 * size, 0.02 * size), {0, 0, 0.3});
      add(synthetic::cylinder(0.05 * size, 0.3 * size), {0, 0, 0});
      add(synthetic::sphere(0.08 * size, 4000), {0.1, 0.05, 0.42});
      auto r = renderer_for(frame, Quality::quality);
      r.set_passes(8);
      const Image image = finished(r);
      // Noise by the pixel, as it was once, gives 0.005 to 0.011.
      EXPECT_LT(stippled(image, 1), 0.004) << size << " m, " << degrees << " degrees";
    }
}

/// Share of the places of `a` with a step of brightness of more than `least` between neighbouring 4
/// x 4 pixels where `b` has none.
double steps(const Image& a, const Image& b, double least) {
  const auto mean = [](const Image& i, int x, int y) {
    double sum = 0;
    for (int k = 0; k < 16; ++k) sum += i.at(x + k % 4, y + k / 4, 1);
    return sum / 16;
  };
  int count = 0, all = 0;
  for (int y = 0; y + 8 <= a.height; y += 4)
    for (int x = 0; x + 8 <= a.width; x += 4)
      for (const int along : {0, 4}) {
        const auto step = [&](const Image& i) {
          return std::abs(mean(i, x + along, y + 4 - along) - mean(i, x, y));
        };
        ++all;
        if (step(b) < 1 && step(a) > least) ++count;
      }
  return static_cast<double>(count) / all;
}

TEST(Lights, TheSkyCastsNoPatchesOnTheFloorOfAPictureOfFewPasses) {
  // A beam over the floor, lit by the surroundings alone; 256 directions of the sky are the truth.
  Light sun = lamp(Light::Kind::sun, {});
  sun.intensity = 1e-6;
  Frame frame = floor_frame({sun});
  frame.feature_edges = false;
  frame.items[0].mesh = synthetic::box(0.8, 0.1, 0.1);
  frame.items[0].pose.p = {0, 0, 0.3};
  auto r = renderer_for(frame, Quality::quality);
  r.set_passes(128);
  const Image truth = finished(r);
  r.set_passes(8);
  const Image few = finished(r);
  // Shadows with hard edges give 0.0086, softened ones 0.0020.
  EXPECT_LT(steps(few, truth, 3), 0.004);
}

TEST(Lights, AColouredLightTints) {
  Light red = lamp(Light::Kind::point, {0.3, 0.3, 1});
  red.colour = {1, 0.1F, 0.1F, 1};
  Frame frame = floor_frame({red});
  frame.items[0].appearance.colour = {0.7F, 0.7F, 0.7F, 1};
  const Taken t = taken(frame);
  EXPECT_GT(t.at({0, 0, 0.3}).r, t.at({0, 0, 0.3}).b + 40);
  EXPECT_GT(t.at({0.35, 0.2, 0}).r, t.at({0.35, 0.2, 0}).b + 40);
  frame.lights[0].colour = {0.1F, 0.1F, 1, 1};
  const Taken blue = taken(frame);
  EXPECT_GT(blue.at({0, 0, 0.3}).b, blue.at({0, 0, 0.3}).r + 40);
}

TEST(Lights, ASpotLightsWithinItsAngle) {
  Light spot = lamp(Light::Kind::spot, {0, 0, 1});
  spot.angle = 0.5;  // 0.55 m on the floor
  const Taken t = taken(floor_frame({spot}));
  EXPECT_GT(t.at({0.3, 0.1, 0}).brightness(), t.at({0.62, 0.1, 0}).brightness() + 40);
  // Turned over it shines upwards and lights nothing.
  spot.pose.R = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  const Taken up = taken(floor_frame({spot}));
  EXPECT_NEAR(up.at({0.3, 0.1, 0}).brightness(), t.at({0.62, 0.1, 0}).brightness(), 6);
}

TEST(Lights, AmbientLightIsThatOfTheSurroundings) {
  const Vec3 under_cube{-0.2, 0, 0};
  const Light above = lamp(Light::Kind::point, {0.8, 0, 1});
  const auto with = [&](double intensity, Colour colour) {
    Light ambient = lamp(Light::Kind::ambient, {});
    ambient.intensity = intensity;
    ambient.colour = colour;
    return floor_frame({above, ambient});
  };
  for (const Quality quality : {Quality::fast, Quality::quality}) {
    const Rgb none = taken(with(0, {1, 1, 1, 1}), quality).at(under_cube);
    const Rgb half = taken(with(0.5, {1, 1, 1, 1}), quality).at(under_cube);
    const Rgb full = taken(with(1, {1, 1, 1, 1}), quality).at(under_cube);
    EXPECT_LT(none.brightness(), 12);
    EXPECT_GT(full.brightness(), half.brightness() + 15);
    // Beside lights, the studio gives half of its light.
    const Rgb usual = taken(floor_frame({above}), quality).at(under_cube);
    EXPECT_NEAR(usual.brightness(), half.brightness(), 2);
    const Rgb red = taken(with(1, {1, 0.1F, 0.1F, 1}), quality).at(under_cube);
    EXPECT_GT(red.r, red.b + 40);
  }
  // Alone it leaves the renderer's own lamp; what is lit by it is darker without surroundings.
  Light ambient = lamp(Light::Kind::ambient, {});
  EXPECT_EQ(taken(floor_frame({ambient})).image.rgb, taken(floor_frame({})).image.rgb);
  ambient.intensity = 0;
  const Taken dark = taken(floor_frame({ambient}));
  EXPECT_GT(dark.at({0.4, 0, 0}).brightness(), 60);
  EXPECT_LT(dark.at({0.4, 0, 0}).brightness(), taken(floor_frame({})).at({0.4, 0, 0}).brightness());
}

TEST(Lights, AnyIntensityGivesAPicture) {
  for (const Light::Kind kind : {Light::Kind::ambient, Light::Kind::point, Light::Kind::sun})
    for (const double intensity : {1e3, 1e38, 1e300}) {
      Light light = lamp(kind, {0, 0, 1});
      light.intensity = intensity;
      for (const Quality quality : {Quality::fast, Quality::quality})
        EXPECT_GT(taken(floor_frame({light}), quality).at({0.4, 0.2, 0}).brightness(), 200)
            << static_cast<int>(kind) << ", " << intensity;
    }
}

TEST(Lights, WithoutAnyTheRenderersOwnStays) {
  Frame frame = floor_frame({});
  auto r = renderer_for(frame);
  const Image before = finished(r);
  frame.lights = {lamp(Light::Kind::point, {1, 1, 1})};
  r.scene().sync(frame);
  EXPECT_NE(finished(r).rgb, before.rgb);
  Light none = lamp(Light::Kind::point, {1, 1, 1});
  none.intensity = std::numeric_limits<double>::quiet_NaN();
  frame.lights = {none};
  r.scene().sync(frame);
  EXPECT_EQ(finished(r).rgb, before.rgb);
}

TEST(Lights, AxesKeepTheirColoursUnderAnyLight) {
  Light blue = lamp(Light::Kind::point, {0.3, 0.3, 1});
  blue.colour = {0, 0, 1, 1};
  Frame frame = floor_frame({blue});
  // The axis is wider than the place that is looked at, and reaches far beyond the cube, which the
  // picture is fitted to.
  frame.camera.zoom = 0.5;
  frame.triads.push_back({1, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {-0.2, 0.25, 0.1}}, 0.8, "b", false});
  const Taken t = taken(frame);
  const Rgb x_axis = t.at({0.35, 0.25, 0.1}), floor = t.at({0.2, 0.45, 0});
  EXPECT_GT(x_axis.r, x_axis.b + 40);
  EXPECT_GT(floor.b, floor.r + 30);
}

}  // namespace
}  // namespace robomosp::viewer
