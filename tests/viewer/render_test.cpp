// SPDX-License-Identifier: GPL-3.0-or-later
// The renderer of robomosp.renderer/2: styles, sections, marks, backgrounds. Pixels are looked up
// by the projection that comes with the picture.
#include "viewer/plugin/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "viewer/scene/image.h"
#include "viewer/scene/linear.h"
#include "viewer/synthetic.h"

namespace robomosp::viewer {
namespace {

using render::Scene;
using View = Camera::View;

struct Rgba {
  int r, g, b, a;
  [[nodiscard]] int brightness() const { return (r + g + b) / 3; }
};

struct Shot {
  render::Image image;

  [[nodiscard]] std::array<double, 2> pixel(const Vec3& p) const {
    std::array<double, 4> clip{};
    const auto& m = image.clip_T_world;
    for (std::size_t i = 0; i < 4; ++i)
      clip[i] = m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2] + m[4 * i + 3];
    return {(clip[0] / clip[3] + 1) / 2 * image.width, (1 - clip[1] / clip[3]) / 2 * image.height};
  }
  [[nodiscard]] Rgba at(int x, int y) const {
    const auto* p =
        &image.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(x))];
    return {p[0], p[1], p[2], p[3]};
  }
  [[nodiscard]] Rgba at(const Vec3& p, int dx = 0, int dy = 0) const {
    const auto [x, y] = pixel(p);
    return at(static_cast<int>(x) + dx, static_cast<int>(y) + dy);
  }
  /// Dark pixels between two places of the world that lie upright in the picture.
  [[nodiscard]] int dark_between(const Vec3& low, const Vec3& high, int limit = 128) const {
    const auto a = pixel(low), b = pixel(high);
    int count = 0;
    for (int y = static_cast<int>(std::min(a[1], b[1])); y <= std::max(a[1], b[1]); ++y)
      for (int x = static_cast<int>(std::min(a[0], b[0])); x <= std::max(a[0], b[0]); ++x)
        count += at(x, y).brightness() < limit;
    return count;
  }
  /// Box of the pixels that are not clear: left, top, right, bottom.
  [[nodiscard]] std::array<int, 4> covered() const {
    std::array<int, 4> box{image.width, image.height, -1, -1};
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        if (at(x, y).a > 127)
          box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x),
                 std::max(box[3], y)};
    return box;
  }
};

Item item(std::uint64_t id, const std::shared_ptr<const Mesh>& mesh, const Vec3& place,
          const Colour& colour = {0.5F, 0.5F, 0.5F, 1}) {
  Item i;
  i.id = id;
  i.mesh = mesh;
  i.pose.p = place;
  i.appearance.colour = colour;
  return i;
}

/// Small drafts without anything but the items.
render::Options plain(View view, const Colour& background = {1, 1, 1, 1}) {
  render::Options o;
  o.width = 240;
  o.height = 180;
  o.quality = render::Quality::draft;
  o.look.camera.view = view;
  o.look.camera.perspective = false;
  o.look.background = Background::plain;
  o.look.background_colour = background;
  o.look.world_axes = false;
  return o;
}

class Render : public testing::Test {
 protected:
  static void SetUpTestSuite() { renderer_ = new OsgRenderer(); }
  static void TearDownTestSuite() {
    delete renderer_;
    renderer_ = nullptr;
  }
  static Shot shot(const Scene& scene, const render::Options& options) {
    NoProgress progress;
    auto image = renderer_->draw(scene, options, progress);
    if (!image.ok()) {
      ADD_FAILURE() << image.error().sentence();
      return {render::Image{
          options.width,
          options.height,
          std::vector<std::uint8_t>(static_cast<std::size_t>(4 * options.width * options.height)),
          {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}};
    }
    return {std::move(image).value()};
  }
  static OsgRenderer* renderer_;
};
OsgRenderer* Render::renderer_ = nullptr;

/// A tube along z, 0.1 m high, with radii 30 and 60 mm.
std::shared_ptr<const Mesh> tube() {
  return synthetic::lathe({{0.03, 0}, {0.06, 0}, {0.06, 0.1}, {0.03, 0.1}, {0.03, 0}});
}

TEST_F(Render, ASectionShowsTheCutFaceAndTheBackgroundThroughAHole) {
  Scene scene;
  scene.items = {item(1, tube(), {})};
  render::Options options = plain(View::top, {0.1F, 0.2F, 0.9F, 1});
  const Shot whole = shot(scene, options);
  Section section;
  section.point = {0, 0, 0.05};
  section.normal = {0, 0, 3};
  section.colour = {0.2F, 0.7F, 0.2F, 1};
  section.hatch = false;
  options.look.section = section;
  const Shot cut = shot(scene, options);
  for (const double a : {0.3, 1.7, 3.1, 4.6}) {
    const Vec3 wall{0.045 * std::cos(a), 0.045 * std::sin(a), 0.05};
    EXPECT_NEAR(cut.at(wall).g, 179, 3);  // 0.7 of 255
    EXPECT_NEAR(cut.at(wall).r, 51, 3);
    EXPECT_NEAR(whole.at(wall).r, whole.at(wall).g, 12) << "without the section it is grey";
    const Vec3 hole{0.015 * std::cos(a), 0.015 * std::sin(a), 0.05};
    EXPECT_NEAR(cut.at(hole).b, 230, 1);
    EXPECT_NEAR(cut.at(hole).r, 26, 1);
  }
  // Hatched, the face has lines in a darker green, and between them the same colour.
  options.look.section->hatch = true;
  const Shot hatched = shot(scene, options);
  int darkest = 255, brightest = 0;
  for (int dx = -12; dx <= 12; ++dx) {
    const int g = hatched.at({0.045, 0, 0.05}, 0, dx).g;
    darkest = std::min(darkest, g);
    brightest = std::max(brightest, g);
  }
  EXPECT_LT(darkest, 160);
  EXPECT_GT(brightest, 172);
}

TEST_F(Render, ASectionTakesAwayTheSideOfItsNormalOnly) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.1, 0.1, 0.1), {})};
  render::Options options = plain(View::front);
  options.look.background = Background::transparent;
  options.look.section = Section{{0.02, 0, 0}, {1, 0, 0}, {0.9F, 0.5F, 0.2F, 1}, true};
  const Shot s = shot(scene, options);
  EXPECT_EQ(s.at({0.01, -0.05, 0.0}).a, 255);
  EXPECT_EQ(s.at({0.03, -0.05, 0.0}).a, 0);
  options.look.section->normal = {-1, 0, 0};
  const Shot other = shot(scene, options);
  EXPECT_EQ(other.at({0.01, -0.05, 0.0}).a, 0);
  EXPECT_EQ(other.at({0.03, -0.05, 0.0}).a, 255);
}

TEST_F(Render, HiddenLinesAreLeftOutOrDashed) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.2, 0.02, 0.2), {0, -0.1, 0}),
                 item(2, synthetic::box(0.08, 0.02, 0.08), {0, 0.1, 0})};
  render::Options options = plain(View::front);
  options.look.style = Style::hidden_line;
  // Strip across the place where the hidden box's left edge would be.
  const Vec3 low{-0.055, -0.11, -0.03}, high{-0.025, -0.11, 0.03};
  const Shot drawn = shot(scene, options);
  EXPECT_EQ(drawn.dark_between(low, high, 250), 0);
  EXPECT_EQ(drawn.at({0, -0.11, 0}).brightness(), 255);  // white, not nearly
  EXPECT_GT(drawn.dark_between({-0.105, -0.11, -0.03}, {-0.095, -0.11, 0.03}), 20);
  options.look.hidden_edges = true;
  const Shot dashed = shot(scene, options);
  const int dashes = dashed.dark_between(low, high, 200);
  const int length = static_cast<int>(dashed.pixel(low)[1] - dashed.pixel(high)[1]);
  EXPECT_GT(dashes, length / 4);
  EXPECT_LT(dashes, 2 * length);  // gaps between them; a line has one or two pixels across
  int gaps = 0;
  for (int y = 0; y < length; ++y) {
    bool is_free = true;
    for (int dx = -2; dx <= 2; ++dx)
      is_free = is_free && dashed.at({-0.04, -0.11, 0.03}, dx, y).brightness() > 240;
    gaps += is_free;
  }
  EXPECT_GT(gaps, length / 6);
  // In the frame of all lines nothing hides the second box.
  options.look.style = Style::wireframe;
  options.look.hidden_edges = false;
  EXPECT_GT(shot(scene, options).dark_between(low, high), length / 2);
}

TEST_F(Render, ARoundBodyHasAContourInADrawing) {
  Scene scene;
  scene.items = {item(1, synthetic::sphere(0.1, 4000), {})};
  for (const bool perspective : {false, true}) {
    render::Options options = plain(View::front);
    options.look.style = Style::hidden_line;
    options.look.camera.perspective = perspective;
    const Shot s = shot(scene, options);
    const auto middle = s.pixel({0, 0, 0});
    // From the middle outwards there is exactly one dark place, at the rim.
    double rim = 0;
    for (int x = static_cast<int>(middle[0]); x < 239; ++x)
      if (s.at(x, static_cast<int>(middle[1])).brightness() < 200) rim = x;
    EXPECT_GT(rim, middle[0]);
    if (!perspective) {
      EXPECT_NEAR(rim, s.pixel({0.1, 0, 0})[0], 1.6);
    }
    EXPECT_EQ(s.at({0, -0.1, 0}).brightness(), 255);
    options.look.feature_edges = false;  // the contour stays
    EXPECT_LT(
        shot(scene, options).at(static_cast<int>(rim), static_cast<int>(middle[1])).brightness(),
        200);
  }
}

TEST_F(Render, FlatShadesEveryTriangleForItself) {
  Scene round, square;
  round.items = {item(1, synthetic::sphere(0.1, 200), {})};
  square.items = {item(2, synthetic::box(0.1, 0.1, 0.1), {})};
  for (const Scene* scene : {&round, &square}) {
    render::Options options = plain(View::isometric);
    options.look.feature_edges = false;
    const Shot smooth = shot(*scene, options);
    options.look.style = Style::flat;
    const Shot flat = shot(*scene, options);
    std::set<int> smooth_tones, flat_tones;
    double difference = 0;
    for (int y = 60; y < 120; ++y)
      for (int x = 90; x < 150; ++x) {
        smooth_tones.insert(smooth.at(x, y).g);
        flat_tones.insert(flat.at(x, y).g);
        difference += std::abs(smooth.at(x, y).g - flat.at(x, y).g) / 3600.0;
      }
    if (scene == &round) {
      EXPECT_GT(difference, 1.0);
    } else {
      EXPECT_LT(difference, 0.5);  // its normals are those of its triangles
    }
  }
}

TEST_F(Render, TheMarkOfMassIsAtItsPlaceWithAxesOfTheRightLength) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.4, 0.2, 0.2), {})};
  MassMark mark;
  mark.id = 5;
  mark.pose.p = {0.05, 0, 0.02};
  mark.gyration = {0.06, 0.09, 0.12};
  scene.marks = {mark};
  const Shot s = shot(scene, plain(View::front));
  // Quarters: light and dark meet at the middle, although the box hides it.
  const int d = 4;
  EXPECT_LT(s.at(mark.pose.p, d, -d).brightness(), 90);
  EXPECT_GT(s.at(mark.pose.p, -d, -d).brightness(), 150);
  EXPECT_LT(s.at(mark.pose.p, -d, d).brightness(), 90);
  EXPECT_GT(s.at(mark.pose.p, d, d).brightness(), 150);
  // The first axis is red-violet, the third amber; both end at the radius of gyration.
  const Rgba first = s.at({0.05 + 0.055, 0, 0.02}), third = s.at({0.05, 0, 0.02 + 0.115});
  EXPECT_GT(first.r, first.g + 60);
  EXPECT_GT(third.r, third.b + 60);
  const Rgba beyond = s.at({0.05 + 0.067, 0, 0.02});
  EXPECT_NEAR(beyond.r, beyond.b, 12);
}

TEST_F(Render, AnOrthographicViewKeepsProportions) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.4, 0.1, 0.05), {0.3, 0.2, 1})};
  render::Options options = plain(View::top);
  options.look.background = Background::transparent;
  const Shot top = shot(scene, options);
  auto box = top.covered();
  const double width = box[2] - box[0] + 1, height = box[3] - box[1] + 1;
  EXPECT_NEAR(width / height, 4.0, 0.15);
  EXPECT_NEAR((box[0] + box[2]) / 2.0, 119.5, 1.0);
  // The true isometric view: the three sides of a cube are equally long.
  scene.items = {item(1, synthetic::box(0.1, 0.1, 0.1), {})};
  options.look.camera.view = View::isometric;
  const Shot iso = shot(scene, options);
  const auto o = iso.pixel({0, 0, 0});
  std::array<double, 3> length{};
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 p{};
    p[i] = 0.1;
    const auto q = iso.pixel(p);
    length[i] = std::hypot(q[0] - o[0], q[1] - o[1]);
  }
  EXPECT_NEAR(length[0], length[1], 1e-6);
  EXPECT_NEAR(length[0], length[2], 1e-6);
}

TEST_F(Render, EveryNamedViewFillsThePicture) {
  Scene scene;
  scene.items = {item(1, synthetic::sphere(0.1, 2000), {2, 1, 3}),
                 item(2, synthetic::cylinder(0.05, 0.3), {2, 1, 3})};
  for (const View view :
       {View::isometric, View::front, View::back, View::left, View::right, View::top, View::bottom})
    for (const bool perspective : {true, false}) {
      render::Options options = plain(view);
      options.look.background = Background::transparent;
      options.look.camera.perspective = perspective;
      const auto box = shot(scene, options).covered();
      const double share = std::max((box[2] - box[0] + 1) / 240.0, (box[3] - box[1] + 1) / 180.0);
      EXPECT_GT(share, 0.85) << static_cast<int>(view) << perspective;
      EXPECT_LT(share, 0.93) << static_cast<int>(view) << perspective;
      // In the middle.
      EXPECT_NEAR(box[0] + box[2], 239, 4) << static_cast<int>(view) << perspective;
      EXPECT_NEAR(box[1] + box[3], 179, 4) << static_cast<int>(view) << perspective;
    }
}

TEST_F(Render, AFloorDoesNotMakeWhatStandsOnItSmall) {
  // The rows of x and y; depth depends on the floor, too.
  const auto projection_of = [](const Scene& scene) {
    const auto clip_T_world = shot(scene, plain(View::front)).image.clip_T_world;
    return std::vector<double>(clip_T_world.begin(), clip_T_world.begin() + 8);
  };
  const auto projection = [&](const std::vector<Item>& items) {
    Scene scene;
    scene.items = items;
    return projection_of(scene);
  };
  const Item body = item(1, synthetic::box(0.4, 0.4, 0.4), {0, 0, 0.2});
  const auto slab = [](double side, const Vec3& place) {
    return item(2, synthetic::box(side, side, 0.05), place);
  };
  const auto alone = projection({body});
  EXPECT_EQ(projection({body, slab(10, {1, 2, -0.025})}), alone);
  // A table top, a base of the same size, a wall, and a floor without anything on it count.
  EXPECT_NE(projection({body, slab(10, {0, 0, 0.8})}), alone);
  EXPECT_NE(projection({body, slab(0.6, {0, 0, -0.025})}), alone);
  EXPECT_NE(projection({body, item(3, synthetic::box(0.05, 10, 10), {1, 0, 5})}), alone);
  EXPECT_NE(projection({slab(10, {0, 0, -0.025})}), projection({slab(1, {0, 0, -0.025})}));
  // A frame far from all bodies does not count either.
  Scene far;
  far.items = {body};
  far.triads.push_back({5, {}, 0.1, "far", false});
  far.triads.back().pose.p = {100, 0, 0};
  EXPECT_EQ(projection_of(far), alone);
}

TEST_F(Render, ClearBodiesAreSeenInTheOrderOfTheirDepth) {
  const auto pane = synthetic::box(0.2, 0.004, 0.2);
  const Colour red{0.9F, 0.05F, 0.05F, 0.6F}, blue{0.05F, 0.05F, 0.9F, 0.6F};
  const auto draw = [&](bool red_first, bool red_in_front) {
    Scene scene;
    Item r = item(red_first ? 1 : 2, pane, {0, red_in_front ? -0.1 : 0.1, 0}, red);
    Item b = item(red_first ? 2 : 1, pane, {0, red_in_front ? 0.1 : -0.1, 0}, blue);
    scene.items = red_first ? std::vector{r, b} : std::vector{b, r};
    return shot(scene, plain(View::front)).at({0, 0, 0});
  };
  const Rgba a = draw(true, true), b = draw(false, true), c = draw(true, false);
  EXPECT_GT(a.r, a.b + 30);
  EXPECT_NEAR(a.r, b.r, 2);
  EXPECT_NEAR(a.b, b.b, 2);
  EXPECT_GT(c.b, c.r + 30);
}

TEST_F(Render, WhatStandsInAGlassIsSeenThroughItsFrontOnly) {
  // A clear ball in a clear box: the ball comes between the far and the near sides of the box.
  const Colour red{0.9F, 0.05F, 0.05F, 0.6F}, blue{0.05F, 0.05F, 0.9F, 0.5F};
  const auto draw = [&](std::uint64_t box_id, std::uint64_t ball_id) {
    Scene scene;
    scene.items = {item(box_id, synthetic::box(0.2, 0.2, 0.2), {}, blue),
                   item(ball_id, synthetic::sphere(0.06, 2000), {}, red)};
    return shot(scene, plain(View::front)).at({0, 0, 0});
  };
  const Rgba a = draw(1, 2), b = draw(2, 1);
  EXPECT_NEAR(a.r, b.r, 2);
  EXPECT_NEAR(a.b, b.b, 2);
  EXPECT_GT(a.r, 60);  // the ball shines through
}

TEST_F(Render, ABodyGlowsAndItsHighlightsAreTinted) {
  Scene scene;
  scene.items = {item(1, synthetic::sphere(0.1, 4000), {}, {0.02F, 0.02F, 0.02F, 1})};
  Appearance& look = scene.items[0].appearance;
  look.shininess = 0.8F;
  render::Options options = plain(View::front);
  options.quality = render::Quality::normal;
  const Shot dull = shot(scene, options);
  look.emission = {0.9F, 0.1F, 0.1F, 1};
  const Shot glowing = shot(scene, options);
  EXPECT_LT(dull.at({0, -0.1, -0.05}).r, 90);
  EXPECT_GT(glowing.at({0, -0.1, -0.05}).r, 180);
  EXPECT_LT(glowing.at({0, -0.1, -0.05}).g, 110);
  look.emission = {0, 0, 0, 1};
  look.specular = Colour{0.1F, 1.0F, 0.1F, 1};
  const Shot tinted = shot(scene, options);
  int brightest = 0;
  Rgba there{};
  for (int y = 40; y < 140; ++y)  // inside the ball
    for (int x = 70; x < 170; ++x)
      if (const Rgba p = dull.at(x, y); p.brightness() > brightest) {
        brightest = p.brightness();
        there = tinted.at(x, y);
      }
  EXPECT_GT(there.g, there.r + 20);
}

TEST_F(Render, BackgroundsAreWhatTheySay) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.1, 0.1, 0.1), {})};
  render::Options options = plain(View::front, {0.25F, 0.5F, 0.75F, 1});
  EXPECT_EQ(shot(scene, options).at(2, 2).r, 64);
  EXPECT_EQ(shot(scene, options).at(2, 2).b, 191);
  options.look.background = Background::transparent;
  const Shot clear = shot(scene, options);
  EXPECT_EQ(clear.at(2, 2).a, 0);
  EXPECT_EQ(clear.at({0, -0.05, 0}).a, 255);
  options.look.background = Background::studio;
  const Rgba wall = shot(scene, options).at(2, 2);
  EXPECT_EQ(wall.a, 255);
  EXPECT_LT(wall.brightness(), 250);
}

TEST_F(Render, APictureDoesNotDependOnTheOnesBefore) {
  Scene first, second;
  first.items = {item(1, tube(), {})};
  first.marks = {{7, {}, {0.1, 0.1, 0.1}, "m"}};
  second.items = {item(1, synthetic::box(0.1, 0.1, 0.1), {})};
  render::Options cut = plain(View::isometric), options = plain(View::isometric);
  cut.look.section = Section{};
  cut.look.style = Style::hidden_line;
  const Shot before = shot(second, options);
  shot(first, cut);
  EXPECT_EQ(shot(second, options).image.rgba, before.image.rgba);
}

TEST_F(Render, WrongOptionsAreToldInASentence) {
  NoProgress progress;
  render::Options options = plain(View::front);
  options.width = 10;
  auto failed = renderer_->draw({}, options, progress);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().sentence().find("16 to 8192"), std::string::npos);
  options = plain(View::front);
  options.look.section = Section{{}, {0, 0, 0}, {}, true};
  failed = renderer_->draw({}, options, progress);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().sentence().find("no direction"), std::string::npos);
  options = plain(View::custom);
  failed = renderer_->draw({}, options, progress);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().sentence().find("eye"), std::string::npos);
}

TEST_F(Render, ACancelledPictureStops) {
  struct Cancelled final : Progress {
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } progress;
  const auto failed = renderer_->draw({}, plain(View::front), progress);
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::cancelled);
}

TEST_F(Render, ThePngHasAnOpacityChannelOnlyWhenItNeedsOne) {
  Scene scene;
  scene.items = {item(1, synthetic::box(0.1, 0.1, 0.1), {})};
  render::Options options = plain(View::front);
  for (const bool clear : {false, true}) {
    if (clear) options.look.background = Background::transparent;
    const auto bytes = renderer_->png(shot(scene, options).image);
    ASSERT_TRUE(bytes.ok());
    ASSERT_GT(bytes->size(), 60U);
    EXPECT_EQ(bytes->substr(1, 3), "PNG");
    EXPECT_EQ((*bytes)[25], clear ? 6 : 2);  // colour type in the header
  }
}

TEST_F(Render, LegendsAreBarsOfTheirColoursInTheUpperRightCorner) {
  Scene scene;
  scene.items.push_back(item(1, synthetic::box(0.1, 0.1, 0.1), {}));
  scene.legends.push_back({"value [m]",
                           {{0.2F, 0.1F, 0.4F, 1}, {0.1F, 0.6F, 0.5F, 1}, {0.9F, 0.8F, 0.2F, 1}},
                           {{0, "0"}, {0.5, "1"}, {1, "2"}}});
  scene.legends.push_back({"other", {{0.7F, 0.1F, 0.7F, 1}}, {{0, "0"}, {1, "1000"}}});
  // Drawings go to the screen as they are, shaded pictures through linear light.
  for (const Style style : {Style::smooth, Style::hidden_line}) {
    render::Options o = plain(View::front);
    o.look.style = style;
    const Shot drawn = shot(scene, o);
    const int width = drawn.image.width, height = drawn.image.height;
    /// Left, upper, right and lower end of a colour [px].
    const auto box_of = [&](const Colour& wanted) {
      std::array<int, 4> box{9999, 9999, -1, -1};
      for (int y = 0; y < height / 2; ++y)
        for (int x = 0; x < width; ++x) {
          const Rgba p = drawn.at(x, y);
          const auto near = [](int is, float want) {
            return std::abs(is - static_cast<int>(255 * want)) < 4;
          };
          if (near(p.r, wanted.r) && near(p.g, wanted.g) && near(p.b, wanted.b))
            box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x),
                   std::max(box[3], y)};
        }
      return box;
    };
    std::vector<std::array<int, 4>> parts;
    for (const Colour& colour : scene.legends[0].colours) parts.push_back(box_of(colour));
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_GE(parts[c][2], 0) << c;
      EXPECT_EQ(parts[c][1], parts[0][1]) << c;  // in one row
      EXPECT_EQ(parts[c][3], parts[0][3]) << c;
      EXPECT_NEAR(parts[c][2] - parts[c][0], parts[0][2] - parts[0][0], 2) << c;
      if (c > 0) {
        EXPECT_NEAR(parts[c][0], parts[c - 1][2] + 1, 1) << c;
      }
    }
    EXPECT_GT(parts[2][2] - parts[0][0], 4 * (parts[0][3] - parts[0][1]));
    EXPECT_GT(parts[0][0], width / 3);
    EXPECT_GT(parts[2][2], 9 * width / 10);
    // The second one lies below the first and the values of that.
    const auto below = box_of(scene.legends[1].colours[0]);
    ASSERT_GE(below[2], 0);
    EXPECT_GT(below[1], parts[0][3] + 10);
    EXPECT_EQ(below[2], parts[2][2]);
  }
}

TEST_F(Render, FramesBehindABodyAreSeenWeaker) {
  Scene scene;
  scene.items.push_back(item(1, synthetic::box(0.2, 0.2, 0.2), {}));
  const render::Options o = plain(View::front);
  const Shot without = shot(scene, o);
  const auto difference = [&](bool is_on_top) {
    scene.triads = {{2, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {-0.04, 0, -0.04}}, 0.08, "", is_on_top}};
    const Shot with = shot(scene, o);
    double sum = 0;
    for (int y = 0; y < with.image.height; ++y)
      for (int x = 0; x < with.image.width; ++x) {
        const Rgba a = without.at(x, y), b = with.at(x, y);
        sum += std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
      }
    return sum;
  };
  const double full = difference(true), weak = difference(false);
  EXPECT_GT(full, 1000);
  EXPECT_GT(weak, 0.3 * full);
  EXPECT_LT(weak, 0.8 * full);
}

TEST_F(Render, ADarkStudioHasADarkFloorAndTheBodyOfTheLightOne) {
  Scene scene;
  scene.items.push_back(item(1, synthetic::box(0.2, 0.2, 0.2), {}));
  render::Options o = plain(View::isometric);
  o.look.background = Background::studio;
  const Shot light = shot(scene, o);
  o.look.background_colour = {0, 0, 0, 1};
  const Shot dark = shot(scene, o);
  const int x = light.image.width / 2, y = light.image.height / 2;
  EXPECT_GT(light.at(4, light.image.height - 4).r, 90);  // the floor
  EXPECT_LT(dark.at(4, light.image.height - 4).r, 70);
  EXPECT_LT(dark.at(4, 4).r, 70);  // the wall
  EXPECT_GT(dark.at(x, y).g, 0.7 * light.at(x, y).g);
}

TEST_F(Render, KindsArePatchesAtTheUpperRightEdge) {
  Scene scene;
  scene.items.push_back(item(1, synthetic::box(0.1, 0.1, 0.1), {}));
  scene.legends.push_back({"path",
                           {{0.1F, 0.6F, 0.2F, 1}, {0.9F, 0.1F, 0.1F, 1}},
                           {{0.25, "good"}, {0.75, "no reach"}}});
  render::Options o = plain(View::front);
  o.look.style = Style::hidden_line;
  const Shot drawn = shot(scene, o);
  const auto rows_of = [&](const Colour& wanted) {
    std::array<int, 4> box{9999, 9999, -1, -1};
    for (int y = 0; y < drawn.image.height; ++y)
      for (int x = 0; x < drawn.image.width; ++x) {
        const Rgba p = drawn.at(x, y);
        const auto near = [](int is, float want) {
          return std::abs(is - static_cast<int>(255 * want)) < 4;
        };
        if (near(p.r, wanted.r) && near(p.g, wanted.g) && near(p.b, wanted.b))
          box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x),
                 std::max(box[3], y)};
      }
    return box;
  };
  const auto first = rows_of(scene.legends[0].colours[0]),
             second = rows_of(scene.legends[0].colours[1]);
  ASSERT_GE(first[2], 0);
  ASSERT_GE(second[2], 0);
  EXPECT_GT(first[0], drawn.image.width / 2);
  EXPECT_LT(first[3], second[1]);  // the first above, with a gap
  EXPECT_LT(second[3], drawn.image.height / 2);
  for (const auto& box : {first, second}) {  // square
    EXPECT_NEAR(box[2] - box[0], box[3] - box[1], 1);
    EXPECT_GE(box[2] - box[0], 6);
  }
}

TEST_F(Render, TextsStayInThePictureAndApart) {
  // Two names at the right rim and one in the upper corner: dark letters keep off the border, and
  // two at one place take twice the rows of one.
  Scene scene;
  scene.items.push_back(item(1, synthetic::box(0.2, 0.15, 0.15), {}));
  render::Options o = plain(View::front);
  o.look.style = Style::hidden_line;
  o.look.feature_edges = false;
  bool is_in = true;
  const auto rows = [&](const std::vector<std::string>& texts) {
    scene.labels.clear();
    for (const std::string& t : texts) scene.labels.push_back({{0.1, 0, 0}, t});
    const Shot drawn = shot(scene, o);
    int count = 0;
    for (int y = 0; y < drawn.image.height; ++y) {
      bool is_dark = false;
      for (int x = 0; x < drawn.image.width; ++x) {
        const bool here = drawn.at(x, y).r < 110 && drawn.at(x, y).g < 110;
        is_dark = is_dark || (here && x > drawn.image.width / 2 && x < drawn.image.width - 30);
        is_in = is_in && !(here && (x < 2 || x + 2 >= drawn.image.width));
      }
      count += is_dark;
    }
    return count;
  };
  const int none = rows({}), one = rows({"a long name"}), two = rows({"a long name", "a long one"});
  EXPECT_TRUE(is_in);
  EXPECT_GE(one - none, 6);
  EXPECT_GE(two - one, 6);
}

}  // namespace
}  // namespace robomosp::viewer
