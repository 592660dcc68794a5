// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "viewer/picture_support.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/offscreen.h"
#include "viewer/synthetic.h"

namespace robomosp::viewer {
namespace {

using synthetic::box;

std::size_t colours(const Image& image) {
  std::set<std::tuple<int, int, int>> found;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      found.insert({image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)});
  return found.size();
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(a.rgb.size());
}

TEST(Picture, ARobotCellIsDrawnWithoutADisplay) {
  ASSERT_EQ(std::string(std::getenv("DISPLAY") ? std::getenv("DISPLAY") : ""), "");
  const auto image = render_image(synthetic::robot_cell(), kWidth, kHeight, Quality::quality);
  ASSERT_TRUE(image.ok()) << image.error().sentence();
  EXPECT_EQ(image->width, kWidth);
  EXPECT_EQ(image->rgb.size(), 3U * kWidth * kHeight);
  EXPECT_GT(colours(*image), 2000U);
  // Clear picture: neither burnt out nor drowned.
  std::size_t white = 0, black = 0;
  for (const std::uint8_t v : image->rgb) white += v >= 253, black += v <= 8;
  EXPECT_LT(white, image->rgb.size() / 50);
  EXPECT_LT(black, image->rgb.size() / 50);
}

TEST(Picture, AnItemIsWhereTheCameraSaysAndHasItsColour) {
  for (const bool perspective : {true, false}) {
    for (const auto view : {Camera::View::isometric, Camera::View::front, Camera::View::top}) {
      Frame frame = cube_frame();
      frame.camera.view = view;
      frame.camera.perspective = perspective;
      auto r = renderer_for(frame);
      const Image image = finished(r);
      const OrbitCamera& c = r.scene().camera();
      const Rgb inside = around(image, *c.project({0, 0, 0.2}));
      EXPECT_GT(inside.r, inside.g + 60);
      EXPECT_GT(inside.r, inside.b + 60);
      // Just outside the cube, away from axes and shadow, everything is grey.
      const Vec3 beside = Vec3{0, 0, 0.2} + 0.25 * c.right() + 0.06 * c.up();
      const Rgb outside = around(image, *c.project(beside));
      EXPECT_NEAR(outside.r, outside.b, 25);
    }
  }
}

TEST(Picture, TheFloorUnderAnItemIsInItsShadow) {
  for (const Quality quality : {Quality::fast, Quality::quality}) {
    Frame frame = cube_frame();
    frame.grid = frame.world_axes = false;
    frame.camera.view = Camera::View::top;
    frame.camera.zoom = 0.25;
    auto r = renderer_for(frame, quality);
    const Image image = finished(r);
    const OrbitCamera& c = r.scene().camera();
    // The lamp is at (-0.20, -0.80, 1.02): 10 to 30 cm above the floor the shadow is shifted by
    // about h * 0.8 / 1.02 towards +y, to y = 0.08 - 0.1 .. 0.24 + 0.1.
    const Rgb shadow = around(image, *c.project({0.03, 0.22, 0}));
    const Rgb light = around(image, *c.project({0.03, -0.35, 0}));
    EXPECT_LT(shadow.brightness(), light.brightness() - 25);
    EXPECT_GT(shadow.brightness(), 40);
  }
}

TEST(Picture, AmbientLightIsWeakerWhereTheSkyIsHidden) {
  Frame frame = cube_frame();
  frame.grid = frame.world_axes = false;
  frame.items[0].pose.p[2] = 0.1;  // standing on the floor
  frame.camera.view = Camera::View::top;
  frame.camera.zoom = 0.22;
  auto r = renderer_for(frame, Quality::quality);
  const Image image = finished(r);
  const OrbitCamera& c = r.scene().camera();
  // In front of the cube the lamp reaches everything; close to it half of the sky is hidden.
  const Rgb near = around(image, *c.project({0.0, -0.125, 0}));
  const Rgb far = around(image, *c.project({0.0, -0.40, 0}));
  EXPECT_LT(near.brightness(), far.brightness() - 6);
}

TEST(Picture, GlassShowsWhatIsBehindIt) {
  Frame frame = cube_frame();
  frame.camera.view = Camera::View::front;
  frame.items.push_back({8,
                         "pane",
                         box(0.5, 0.01, 0.5),
                         {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, -0.3, 0.25}},
                         {{0.2F, 0.3F, 0.9F, 0.3F}, 0.2F, 0},
                         false});
  auto r = renderer_for(frame);
  const auto pixel = *r.scene().camera().project({0, -0.1, 0.2});
  const Rgb through = around(finished(r), pixel);
  frame.items.pop_back();
  r.scene().sync(frame);
  const Rgb bare = around(finished(r), pixel);
  EXPECT_GT(through.r, through.g + 30);  // still the red cube
  EXPECT_GT(through.b, bare.b + 20);     // tinted by the pane
}

TEST(Picture, TwoRendersOfOneFrameAreEqual) {
  for (const Quality quality : {Quality::fast, Quality::quality}) {
    const Frame frame = synthetic::robot_cell();
    const auto a = render_image(frame, kWidth, kHeight, quality);
    const auto b = render_image(frame, kWidth, kHeight, quality);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->rgb, b->rgb);
  }
}

TEST(Picture, APoseChangesThePictureButBuildsNoGeometry) {
  Frame frame = synthetic::robot_cell();
  auto r = renderer_for(frame);
  const Image before = finished(r);
  const std::size_t builds = r.scene().geometry_builds();
  EXPECT_EQ(builds, frame.items.size() + frame.lines.size());

  const Frame bent = synthetic::robot_cell(1.0);
  for (std::size_t i = 0; i < frame.items.size(); ++i) frame.items[i].pose = bent.items[i].pose;
  r.scene().sync(frame);
  const Image after = finished(r);
  EXPECT_GT(mean_difference(before, after), 0.5);
  EXPECT_EQ(r.scene().geometry_builds(), builds);

  // Diffing arrives at the same picture as starting afresh.
  auto fresh = renderer_for(frame);
  fresh.scene().camera() = r.scene().camera();
  EXPECT_LT(mean_difference(after, finished(fresh)), 0.01);
}

TEST(Picture, AnItemThatLeavesTheFrameLeavesThePicture) {
  Frame frame = cube_frame();
  auto r = renderer_for(frame);
  const auto pixel = *r.scene().camera().project({0, 0, 0.2});
  frame.items.clear();
  r.scene().sync(frame);
  const Rgb there = around(finished(r), pixel);
  EXPECT_NEAR(there.r, there.g, 20);
  EXPECT_FALSE(r.scene().pick(pixel[0], pixel[1]));
}

TEST(Picture, PickingTellsTheNearestItemAndThePlace) {
  Frame frame = cube_frame();
  frame.items.push_back(
      {9, "behind", box(0.2, 0.2, 0.2), {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 1, 0.2}}, {}, false});
  frame.camera.view = Camera::View::front;
  auto r = renderer_for(frame);
  const auto pixel = *r.scene().camera().project({0.02, -0.1, 0.23});
  const auto hit = r.scene().pick(pixel[0], pixel[1]);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->id, 7U);
  EXPECT_EQ(hit->name, "cube");
  EXPECT_NEAR(norm(hit->point - Vec3{0.02, -0.1, 0.23}), 0, 1e-6);
  EXPECT_FALSE(r.scene().pick(3, 3));
}

TEST(Picture, PlaybackMovesItemsToTheirPoseAtThatTime) {
  Frame frame = cube_frame();
  Playback playback{{0, 2}, {7}, {frame.items[0].pose, frame.items[0].pose}};
  playback.poses[1].p = {0.4, 0, 0.2};
  frame.camera.view = Camera::View::front;
  auto r = renderer_for(frame);
  r.scene().set_playback(std::make_shared<const Playback>(playback));
  r.scene().set_time(1.5);  // three quarters of the way
  const auto there = *r.scene().camera().project({0.3, -0.1, 0.2});
  const auto hit = r.scene().pick(there[0], there[1]);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->id, 7U);
  const Rgb colour = around(finished(r), there);
  EXPECT_GT(colour.r, colour.g + 60);
}

TEST(Picture, ALineIsSeenAndShinesThroughWhatHidesIt) {
  Frame frame = cube_frame();
  frame.items[0].appearance.colour = {0.3F, 0.3F, 0.3F, 1};
  frame.camera.view = Camera::View::front;
  Line line;
  line.id = 70;
  line.width = 8;
  line.points = {{-0.4, 0, 0.2}, {-0.2, 0, 0.2}, {0.4, 0, 0.2}};
  frame.lines.push_back(line);
  auto r = renderer_for(frame);
  const Image image = finished(r);
  const OrbitCamera& c = r.scene().camera();
  const auto beside = *c.project({-0.25, 0, 0.2}), inside = *c.project({0.0, 0, 0.2});
  const auto at = [&](const std::array<double, 2>& p, int channel) {
    return image.at(static_cast<int>(p[0]), static_cast<int>(p[1]), channel);
  };
  EXPECT_GT(at(beside, 0), at(beside, 2) + 100);
  EXPECT_GT(at(inside, 0), at(inside, 2) + 10);
  EXPECT_LT(at(inside, 0), at(beside, 0) - 40);
}

TEST(Picture, AFrameWithNothingInItIsAFloor) {
  const auto image = render_image(Frame{}, kWidth, kHeight, Quality::fast);
  ASSERT_TRUE(image.ok());
  EXPECT_GT(colours(*image), 50U);
}

TEST(Picture, UnusableNumbersDoNotStopTheRest) {
  Frame frame = cube_frame();
  frame.items.push_back({50, "nowhere", box(0.1, 0.1, 0.1), {}, {}, false});
  frame.items.back().pose.p[1] = NAN;
  frame.items.push_back({51, "meshless", nullptr, {}, {}, true});
  Line line;
  line.id = 52;
  line.points = {{0, 0, 0}, {NAN, 0, 0}, {0.1, 0, 0}};
  frame.lines.push_back(line);
  frame.triads.push_back({53, {}, NAN, "broken"});
  frame.camera.zoom = NAN;
  EXPECT_TRUE(render_image(frame, kWidth, kHeight, Quality::fast).ok());
}

TEST(Png, IsWrittenCompleteOrNotAtAll) {
  const auto folder = std::filesystem::temp_directory_path() / "robomosp_picture_test";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "cube.png").string();
  ASSERT_TRUE(render_png(cube_frame(), 64, 48, Quality::fast, path).ok());
  std::ifstream file(path, std::ios::binary);
  std::array<char, 24> head{};
  file.read(head.data(), head.size());
  EXPECT_EQ(std::string(head.data() + 1, 3), "PNG");
  // Width and height, big-endian, in the first chunk.
  EXPECT_EQ(static_cast<int>(head[19]), 64);
  EXPECT_EQ(static_cast<int>(head[23]), 48);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  std::filesystem::remove_all(folder);
}

TEST(Png, AMissingFolderIsToldInASentence) {
  const auto failed = render_png(cube_frame(), 64, 48, Quality::fast, "/no/such/folder/a.png");
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::not_found);
  EXPECT_EQ(failed.error().sentence(),
            "cannot write the picture \"/no/such/folder/a.png\": there is no folder "
            "\"/no/such/folder\". Create the folder or choose another one.");
}

TEST(Png, AnImpossibleSizeIsToldInASentence) {
  const auto failed = render_image(cube_frame(), 0, 100000, Quality::fast);
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().sentence(),
            "a picture of 0 x 100000 pixels cannot be drawn. Give a width and a height from 16 to "
            "8192 pixels.");
}

}  // namespace
}  // namespace robomosp::viewer
