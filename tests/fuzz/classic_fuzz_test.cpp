// SPDX-License-Identifier: Apache-2.0
// Lines of the program of 2006 with other numbers and words: none ends the program, a refused one
// leaves the document as it was, and its error is a sentence of bearable length.
#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "support/classic_lines.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongestError = 8000;
constexpr std::chrono::milliseconds kPatience{200};

class ClassicFuzz : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-classic-fuzz-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    fs::current_path(folder_);
    records();
  }
  void TearDown() override {
    fs::current_path(fs::temp_directory_path());
    fs::remove_all(folder_);
  }
  void records() {
    // What stopped the line before must not stop these.
    session_.clear_interrupt();
    session_.show_progress = {};
    app().document.clear();
    const Value links =
        List{Map{{"a", 0.4}, {"lower", -3}, {"upper", 3}, {"mass", 2}},
             Map{{"a", 0.3}, {"lower", -2}, {"upper", 2}, {"mass", 1}},
             Map{{"joint", "prismatic"}, {"d", 0.2}, {"lower", -1}, {"upper", 2}, {"mass", 0.5}}};
    call("robot.create", {{"name", "arm"}, {"links", links}});
    call("robot.set_pose", {{"id", "arm"}, {"name", "here"}, {"q", List{0.5, 0.4, 0.1}}});
    call("solid.create",
         {{"name", "pin"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
    call("object.create", {{"name", "bolt"}, {"parts", List{Map{{"what", "pin"}}}}});
    call("world.create", {{"name", "cell"}});
    call("world.add_robot", {{"id", "cell"}, {"robot", "arm"}, {"q", "here"}});
    call("world.add_object", {{"id", "cell"}, {"what", "bolt"}, {"position", List{0.5, 1, 0}}});
    const auto pose = call("robot.fk", {{"id", "arm"}});
    const auto p = at(pose, "position").as_array()->data(), a = at(pose, "rpy").as_array()->data();
    const auto point = [&](double dz) { return List{p[0], p[1], p[2] + dz, a[0], a[1], a[2]}; };
    call("trajectory.create",
         {{"name", "stroke"},
          {"sample_time", 0.1},
          {"segments", List{Map{{"shape", "line"}, {"points", List{point(0), point(0.1)}}}}}});
    call("world.add_trajectory", {{"id", "cell"}, {"trajectory", "stroke"}});
  }
  fs::path folder_;
};

TEST_F(ClassicFuzz, AnyLineIsAnsweredOrRefusedInASentence) {
  std::mt19937 random(test::seed());
  const test::FuzzBudget budget(4000);
  std::size_t runs = 0, answered = 0;
  for (; budget.allows(runs) && !HasFailure(); ++runs) {
    if (runs % 100 == 0) records();
    const std::string line = test::changed_classic_line(random);
    const std::string before = app().document.content_digest();
    // Runs of years are asked for as well: they are stopped.
    const auto begin = std::chrono::steady_clock::now();
    session_.clear_interrupt();
    session_.show_progress = [&](double, std::string_view) {
      if (std::chrono::steady_clock::now() - begin > kPatience) session_.interrupt();
    };
    const auto r = app().dispatch_classic(session_, line);
    if (r.ok()) {
      ++answered;
      continue;
    }
    EXPECT_FALSE(r.error().message.empty()) << line;
    EXPECT_LE(r.error().sentence().size(), kLongestError) << line;
    EXPECT_NE(r.error().code, ErrorCode::internal) << line << ": " << r.error().sentence();
    EXPECT_EQ(app().document.content_digest(), before) << line << ": " << r.error().sentence();
  }
  std::cout << runs << " lines, " << answered << " answered\n";
  EXPECT_GT(answered, runs / 5);
  EXPECT_LT(answered, runs * 9 / 10);
}

}  // namespace
}  // namespace robomosp::ioci
