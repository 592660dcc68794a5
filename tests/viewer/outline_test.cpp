// SPDX-License-Identifier: GPL-3.0-or-later
// Outlines of the selection and labels over the picture.
#include <cmath>

#include <gtest/gtest.h>

#include "viewer/picture_support.h"

namespace robomosp::viewer {
namespace {

constexpr Colour kBlue{0.1F, 0.4F, 1.0F, 1};

bool is_blue(const Image& image, int x, int y) {
  return image.at(x, y, 2) > image.at(x, y, 0) + 60 && image.at(x, y, 2) > 120;
}

/// Pixels of the colour of outlines.
int count_blue(const Image& image) {
  int n = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) n += is_blue(image, x, y) ? 1 : 0;
  return n;
}

Frame grey_cube() {
  Frame frame = cube_frame();
  frame.items[0].appearance.colour = {0.5F, 0.5F, 0.5F, 1};
  frame.camera.view = Camera::View::front;
  frame.world_axes = false;
  return frame;
}

TEST(Outline, SelectionIsALineAroundTheItemAndLeavesItsColour) {
  auto r = renderer_for(grey_cube());
  r.scene().set_accent(kBlue);
  const auto middle = *r.scene().camera().project({0, -0.1, 0.2});
  const auto edge = *r.scene().camera().project({0.1, -0.1, 0.2});
  const Image plain = finished(r);
  EXPECT_EQ(count_blue(plain), 0);
  r.scene().select({7});
  const Image chosen = finished(r);
  EXPECT_NEAR(around(chosen, middle).r, around(plain, middle).r, 0.5);
  EXPECT_NEAR(around(chosen, middle).b, around(plain, middle).b, 0.5);
  bool is_beside = false;
  for (int dx = 0; dx < 5; ++dx)
    is_beside =
        is_beside || is_blue(chosen, static_cast<int>(edge[0]) + dx, static_cast<int>(edge[1]));
  EXPECT_TRUE(is_beside);
  r.scene().select({});
  EXPECT_EQ(count_blue(finished(r)), 0);
}

TEST(Outline, SeveralItemsHaveOneLineAroundAllOfThem) {
  Frame frame = grey_cube();
  Item second = frame.items[0];
  second.id = 8;
  second.pose.p[0] += 0.1;  // half of it in the first
  frame.items.push_back(second);
  auto r = renderer_for(frame);
  r.scene().set_accent(kBlue);
  r.scene().select({7, 8});
  const Image both = finished(r);
  const auto seam = *r.scene().camera().project({0.0, -0.1, 0.2});
  EXPECT_FALSE(is_blue(both, static_cast<int>(seam[0]), static_cast<int>(seam[1])));
  EXPECT_GT(count_blue(both), 100);
}

TEST(Outline, BehindAnotherBodyItIsWeaker) {
  Frame frame = grey_cube();
  frame.items.push_back({9,
                         "wall",
                         synthetic::box(1, 0.02, 1),
                         {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, -0.4, 0.5}},
                         {{0.5F, 0.5F, 0.5F, 1}, 0.2F, 0},
                         false});
  frame.camera.view = Camera::View::front;
  frame.camera.perspective = false;
  auto r = renderer_for(frame);
  r.scene().set_accent(kBlue);
  r.scene().select({7});
  const Image image = finished(r);
  // The strongest blue anywhere: mixed with the grey of the wall.
  int strongest = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      strongest = std::max(strongest, image.at(x, y, 2) - image.at(x, y, 0));
  EXPECT_GT(strongest, 25);
  EXPECT_LT(strongest, 190);
}

TEST(Outline, GlassAndDrawingsHaveItToo) {
  for (const Style style : {Style::smooth, Style::wireframe, Style::hidden_line}) {
    Frame frame = grey_cube();
    frame.style = style;
    frame.items[0].appearance.colour.a = style == Style::smooth ? 0.3F : 1.0F;
    auto r = renderer_for(frame);
    r.scene().set_accent(kBlue);
    r.scene().select({7});
    EXPECT_GT(count_blue(finished(r)), 100) << static_cast<int>(style);
  }
}

TEST(Labels, AreWhiteOnDarkPlatesThatDoNotCoverEachOther) {
  Frame frame = grey_cube();
  for (int i = 0; i < 4; ++i) frame.labels.push_back({{0, -0.1, 0.2}, "same place"});
  auto r = renderer_for(frame);
  const Image image = finished(r);
  EXPECT_EQ(r.scene().label_counts(), (std::array<std::size_t, 2>{4, 0}));
  int dark = 0, white = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const int sum = image.at(x, y, 0) + image.at(x, y, 1) + image.at(x, y, 2);
      dark += sum < 150 ? 1 : 0;
      white += sum > 600 ? 1 : 0;
    }
  EXPECT_GT(dark, 2000);
  EXPECT_GT(white, 60);
}

TEST(Labels, WithoutRoomTheyAreLeftOutAndCounted) {
  Frame frame = grey_cube();
  for (int i = 0; i < 2000; ++i)
    frame.labels.push_back({{0.001 * (i % 50), -0.1, 0.2}, "label " + std::to_string(i)});
  auto r = renderer_for(frame);
  (void)finished(r);
  const auto [shown, left_out] = r.scene().label_counts();
  EXPECT_GT(shown, 5U);
  EXPECT_LT(shown, 60U);
  EXPECT_EQ(shown + left_out, 2000U);
}

}  // namespace
}  // namespace robomosp::viewer
