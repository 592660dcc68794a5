// SPDX-License-Identifier: Apache-2.0
#include "kernel/component.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

using Log = std::vector<std::string>;

class Logged final : public Component {
 public:
  enum class Start { ok, fails, throws };
  Logged(std::string id, Log& log, Start how) : id_(std::move(id)), log_(log), how_(how) {}
  Result<void> start() override {
    if (how_ == Start::fails) return error(ErrorCode::io, "the port is taken");
    if (how_ == Start::throws) throw std::runtime_error("boom");
    log_.push_back("+" + id_);
    return {};
  }
  void stop() noexcept override { log_.push_back("-" + id_); }

 private:
  std::string id_;
  Log& log_;
  Start how_;
};

void add(Components& all, Log& log, std::string id, Layer layer, std::vector<std::string> needs,
         Logged::Start how = Logged::Start::ok) {
  ASSERT_TRUE(all.add({id, layer, std::move(needs)}, std::make_unique<Logged>(id, log, how)).ok());
}

TEST(Components, StartInsideOutAndStopInReverse) {
  Log log;
  Components all;
  add(all, log, "lua", Layer::application, {"ioci", "core"});
  add(all, log, "ioci", Layer::application, {"geometry"});
  add(all, log, "geometry", Layer::data_processing, {"core"});
  add(all, log, "core", Layer::core, {});
  ASSERT_TRUE(all.start_all().ok());
  EXPECT_EQ(log, (Log{"+core", "+geometry", "+ioci", "+lua"}));
  EXPECT_EQ(all.list().front().id, "core");
  all.stop_all();
  EXPECT_EQ(log,
            (Log{"+core", "+geometry", "+ioci", "+lua", "-lua", "-ioci", "-geometry", "-core"}));
}

TEST(Components, DestructionStopsWhatRuns) {
  Log log;
  {
    Components all;
    add(all, log, "a", Layer::core, {});
    ASSERT_TRUE(all.start_all().ok());
    add(all, log, "late", Layer::gui, {"a"});
    ASSERT_TRUE(all.start_all().ok());  // only what was added since
  }
  EXPECT_EQ(log, (Log{"+a", "+late", "-late", "-a"}));
}

TEST(Components, ACycleIsToldByItsPath) {
  Log log;
  Components all;
  add(all, log, "x", Layer::core, {"a"});
  add(all, log, "a", Layer::core, {"b"});
  add(all, log, "b", Layer::core, {"c"});
  add(all, log, "c", Layer::core, {"a"});
  EXPECT_EQ(all.start_all().error().sentence(),
            "components require each other in a cycle (a > b > c > a). Remove one of these "
            "requirements.");
  EXPECT_TRUE(log.empty());
}

TEST(Components, AnOuterLayerIsRefusedByName) {
  Log log;
  Components all;
  add(all, log, "viewer", Layer::gui, {});
  add(all, log, "geometry", Layer::data_processing, {"viewer"});
  EXPECT_EQ(
      all.start_all().error().sentence(),
      "component \"geometry\" of layer data_processing requires \"viewer\" of the outer layer gui. "
      "A component may require its own layer and inner ones.");
  EXPECT_TRUE(log.empty());
}

TEST(Components, AMissingIdIsToldWithANearOne) {
  Log log;
  Components all;
  add(all, log, "geometry", Layer::core, {});
  add(all, log, "robot", Layer::core, {"geometri"});
  EXPECT_EQ(all.start_all().error().sentence(),
            "component \"robot\" requires \"geometri\", which does not exist. Did you mean "
            "\"geometry\"?");
  EXPECT_TRUE(log.empty());
}

TEST(Components, ASecondComponentOfTheSameIdIsRefused) {
  Log log;
  Components all;
  add(all, log, "a", Layer::core, {});
  EXPECT_EQ(all.add({"a", Layer::core, {}}, std::make_unique<Component>()).error().code,
            ErrorCode::conflict);
  EXPECT_FALSE(all.add({"b", Layer::core, {}}, nullptr).ok());
}

TEST(Components, AFailedStartStopsTheStarted) {
  for (const auto how : {Logged::Start::fails, Logged::Start::throws}) {
    Log log;
    Components all;
    add(all, log, "a", Layer::core, {});
    add(all, log, "b", Layer::core, {"a"});
    add(all, log, "net", Layer::core, {"b"}, how);
    add(all, log, "d", Layer::core, {"net"});
    EXPECT_EQ(all.start_all().error().sentence(),
              how == Logged::Start::fails ? "component \"net\": the port is taken."
                                          : "component \"net\": its start threw: boom.");
    EXPECT_EQ(log, (Log{"+a", "+b", "-b", "-a"}));
  }
}

TEST(Components, ALongChainDoesNotUseTheCallStack) {
  Log log;
  Components all;
  constexpr int kCount = 3000;
  for (int i = 0; i < kCount; ++i)
    add(all, log, std::to_string(i), Layer::core,
        i + 1 < kCount ? std::vector<std::string>{std::to_string(i + 1)}
                       : std::vector<std::string>{});
  ASSERT_TRUE(all.start_all().ok());
  EXPECT_EQ(log.front(), "+" + std::to_string(kCount - 1));
}

}  // namespace
}  // namespace robomosp
