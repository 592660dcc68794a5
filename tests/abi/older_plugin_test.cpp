// SPDX-License-Identifier: Apache-2.0
// A plugin that was built against shorter structs and the interface numbers before runs as it is.
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/plugin_loader.h"

namespace robomosp {
namespace {

class OlderPlugin : public testing::Test {
 protected:
  OlderPlugin() : loader_(registry_, &messages_) {
    report_ = loader_.load(std::string(ABI_PLUGIN_DIR) + "/abi_older.so");
  }
  template <class Interface>
  std::shared_ptr<Interface> create(const char* name) {
    auto made = registry_.create<Interface>(name);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return made.ok() ? *made : nullptr;
  }
  Registry registry_;
  Messages messages_;
  PluginLoader loader_;
  PluginReport report_;
  NoProgress none_;
};

TEST_F(OlderPlugin, LoadsWithAllItsProvidersUnderTheNumbersOfToday) {
  ASSERT_TRUE(report_.loaded) << (report_.refusal ? report_.refusal->sentence() : "");
  EXPECT_TRUE(report_.remarks.empty()) << report_.remarks.front();
  EXPECT_EQ(report_.providers.size(), 7U);
  EXPECT_TRUE(registry_.find(CurveFactory::kInterfaceId, "older_parabola").ok());
  EXPECT_FALSE(registry_.find("robomosp.curve/1", "older_parabola").ok());
}

TEST_F(OlderPlugin, ItsShorterParameterRowsAreReadRowByRow) {
  const auto info = registry_.find(IkSolver::kInterfaceId, "one_joint");
  ASSERT_TRUE(info.ok());
  ASSERT_EQ(info->schema.size(), 2U);
  EXPECT_EQ(info->schema[0].name, "offset");
  EXPECT_NEAR(info->schema[0].default_value->number(), std::acos(-1.0) / 2, 1e-15);
  EXPECT_EQ(info->schema[0].label, "");
  EXPECT_EQ(info->schema[1].name, "word");
  EXPECT_EQ(info->schema[1].choices, (std::vector<std::string>{"one", "two"}));
}

TEST_F(OlderPlugin, ItsSolverSolvesBatchesThatHaveGrownSince) {
  const auto ik = create<IkSolver>("one_joint");
  ASSERT_NE(ik, nullptr);
  ASSERT_EQ(messages_.recent().size(), 1U);
  EXPECT_EQ(messages_.recent()[0].text, "an older solver was made");
  RobotModel model;
  model.name = "pointer";
  model.joints.resize(1);
  model.joints[0].placement.p[0] = 0.25;
  model.tips.resize(1);
  model.number_coordinates();
  const auto info = registry_.find(IkSolver::kInterfaceId, "one_joint");
  ASSERT_TRUE(ik->prepare(model, *make_params(*check(info->schema, {{"offset", 0.5}}))).ok());
  std::vector<Pose> targets(3);
  for (std::size_t i = 0; i < 3; ++i)
    targets[i].p = {std::cos(0.3 * static_cast<double>(i)), std::sin(0.3 * static_cast<double>(i)),
                    0};
  IkBatch batch;
  batch.targets = targets;
  std::vector<IkResult> results(3);
  ASSERT_TRUE(ik->solve(batch, results, none_).ok());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(results[i].status, IkStatus::solved);
    ASSERT_EQ(results[i].q.size(), 1U);
    EXPECT_NEAR(results[i].q[0], 0.3 * static_cast<double>(i) + 0.75, 1e-15);
    EXPECT_EQ(results[i].detail, "older");
  }
  batch.objective = IkObjective::centre;  // which it has never heard of
  EXPECT_EQ(ik->solve(batch, results, none_).error().sentence(),
            "provider \"one_joint\" does not declare support for objectives. If it does, write "
            "tags = {\"objectives\"}; else choose another provider.");
}

TEST_F(OlderPlugin, ItsCurveLawAndOrientationAreSampled) {
  const auto curves = create<CurveFactory>("older_parabola");
  const auto laws = create<MotionLawFactory>("older_cubic");
  const auto turns = create<OrientationFactory>("older_turning");
  ASSERT_TRUE(curves && laws && turns);
  const Pose points[2] = {};
  const auto params = make_params({});
  auto curve = curves->make(points, *params);
  ASSERT_TRUE(curve.ok()) << curve.error().sentence();
  const double u[] = {0.25, 0.5};
  CurveSample c[2];
  ASSERT_TRUE((*curve)->evaluate(u, c).ok());
  EXPECT_DOUBLE_EQ(c[1].p[1], 0.25);
  EXPECT_DOUBLE_EQ(c[0].d1[1], 0.5);
  EXPECT_EQ((*curve)->knots(), (std::vector<double>{0, 1}));
  EXPECT_EQ(curves->make({points, 1}, *params).error().message, "a parabola has two points");

  LawTask way;
  way.length = 1.5, way.turn = 0.5;
  auto law = laws->make(way, *params);
  ASSERT_TRUE(law.ok()) << law.error().sentence();
  EXPECT_DOUBLE_EQ((*law)->duration(), 2);
  const double t = 1;
  LawSample l;
  ASSERT_TRUE((*law)->sample({&t, 1}, {&l, 1}).ok());
  EXPECT_DOUBLE_EQ(l.share, 0.5);
  EXPECT_DOUBLE_EQ(l.rate, 0.75);

  OrientationTask task;
  const double shares[] = {0, 1};
  task.points = points, task.shares = shares, task.curve = curve->get();
  auto turning = turns->make(task, *params);
  ASSERT_TRUE(turning.ok()) << turning.error().sentence();
  OrientationSample o[2];
  ASSERT_TRUE((*turning)->evaluate(u, c, o).ok());
  EXPECT_DOUBLE_EQ(o[1].R[3], std::sin(0.5));
}

TEST_F(OlderPlugin, ItsRendererSeesTheWholeScene) {
  const auto renderer = create<render::Renderer>("older_counter");
  ASSERT_NE(renderer, nullptr);
  render::Scene scene;
  scene.items.resize(1);
  scene.items[0].pose.p[2] = 0.25;
  scene.lines.resize(2);
  scene.lines[1].width = 4;
  scene.triads.resize(3);
  scene.triads[2].length = 0.5;
  scene.marks.resize(4);
  scene.marks[3].gyration[1] = 2;
  scene.labels.resize(5);
  scene.labels[4].place[0] = 3;
  scene.legends.resize(6);
  scene.legends[5].ticks = {{0.75, "high"}};
  scene.lights.resize(7);
  scene.lights[6].angle = 0.125;
  render::Options options;
  options.width = 320;
  options.quality = render::Quality::high;
  options.look.camera.zoom = 8;
  options.look.section = render::Section{{16, 0, 0}, {1, 0, 0}, {}, true};
  const auto image = renderer->draw(scene, options, none_);
  ASSERT_TRUE(image.ok()) << image.error().sentence();
  EXPECT_EQ(std::vector<std::uint8_t>(image->rgba.begin(), image->rgba.begin() + 7),
            (std::vector<std::uint8_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(image->width, 320);
  const double seen[] = {4.25, 2.5, 3.75, 8.125, 17};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(image->clip_T_world[i], seen[i]) << i;
  EXPECT_EQ(*renderer->png(*image), "\x89PNG\r\n\x1a\n320");
  options.look.caption = "fail";
  EXPECT_EQ(renderer->draw(scene, options, none_).error().message, "it draws no failures");
}

TEST_F(OlderPlugin, ItsSegmentsAreSampled) {
  const auto runs = create<SegmentFactory>("older_run");
  const auto drives = create<JointSegmentFactory>("older_drive");
  ASSERT_TRUE(runs && drives);
  const auto params = make_params({});
  auto run = runs->make({}, *params);
  ASSERT_TRUE(run.ok()) << run.error().sentence();
  const double t[] = {1, 3};
  PathSample s[2];
  ASSERT_TRUE((*run)->sample(t, s).ok());
  EXPECT_DOUBLE_EQ(s[0].pose.p[0], 0.5);
  EXPECT_DOUBLE_EQ(s[1].velocity[0], 0);

  const double speed[] = {2, 4}, q[] = {0, 0, 1, 1};
  JointLimits limits;
  limits.velocity = speed;
  auto drive = drives->make(2, q, limits, {}, *params);
  ASSERT_TRUE(drive.ok()) << drive.error().sentence();
  double at[4], rate[4];
  ASSERT_TRUE((*drive)->sample({t, 2}, {at, rate, {}, {}}).ok());
  EXPECT_DOUBLE_EQ(at[1], 2);
  EXPECT_DOUBLE_EQ(rate[2], 1);
  JointEnds ends;
  ends.start_velocity = speed;
  EXPECT_EQ(drives->make(2, q, limits, ends, *params).error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace robomosp
