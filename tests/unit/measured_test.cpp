// SPDX-License-Identifier: Apache-2.0
// Rows that are appended by commands, and what was measured minus what a model says.
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lua/lua_state.h"
#include "recording/recording.h"
#include "recording/residual.h"
#include "sim/measured_motion.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using recording::Recording;
using recording::RecordingPtr;

RecordingPtr table(std::vector<double> time, std::vector<double> x) {
  auto r = std::make_shared<Recording>();
  r->columns = {{"time", "s", "", std::move(time)}, {"x", "m", "", std::move(x)}};
  return r;
}

TEST(Residuals, AreMeasuredMinusModelWithTheModelInterpolated) {
  const auto measured = table({-1, 0.5, 1.5, 9}, {0, 1, 5, 0});
  const auto model = table({0, 1, 2}, {10, 20, 40});
  const auto r = recording::residual(*measured, *model, {});
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  EXPECT_EQ(r->columns[0].values, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(r->columns[1].name, "x_residual");
  EXPECT_EQ(r->columns[1].values, (std::vector<double>{1 - 15, 5 - 30}));
  const auto shifted = recording::residual(*measured, *model, {}, 0.5);
  ASSERT_TRUE(shifted.ok());
  EXPECT_EQ(shifted->columns[1].values, (std::vector<double>{1 - 20, 5 - 40}));
  const auto s = recording::residual_statistics(*r).front();
  EXPECT_DOUBLE_EQ(s.mean, -19.5);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt((14.0 * 14 + 25 * 25) / 2));
  EXPECT_DOUBLE_EQ(s.deviation, 5.5);
  EXPECT_EQ(s.greatest, 25);
  EXPECT_EQ(s.at, 1.5);
  EXPECT_EQ(recording::residual_name("left.tau12"), "left.tau_residual12");
  // What cannot be compared.
  EXPECT_FALSE(recording::residual(*measured, *table({20, 30}, {0, 0}), {}).ok());
  auto other = *model;
  other.columns[1].unit = "rad";
  EXPECT_FALSE(recording::residual(*measured, other, {}).ok());
  other.columns[1].name = "y";
  EXPECT_FALSE(recording::residual(*measured, other, {}).ok());
}

TEST(Residuals, FindTheShiftOfAClock) {
  std::mt19937 random(test::seed());
  std::uniform_real_distribution<double> any(-0.3, 0.3), noise(-1e-3, 1e-3);
  std::vector<double> t, x;
  const auto f = [](double at) { return std::sin(2 * at) + 0.3 * std::cos(7 * at); };
  for (int i = 0; i <= 4000; ++i) t.push_back(0.002 * i), x.push_back(f(t.back()));
  const auto model = table(t, x);
  for (int round = 0; round < 5; ++round) {
    const double shift = any(random);
    std::vector<double> u, y;
    for (int i = 0; i < 3000; ++i) {
      u.push_back(0.5 + 0.00201 * i);
      y.push_back(f(u.back() + shift) + noise(random));
    }
    NoProgress progress;
    const auto found = recording::best_shift(*table(u, y), *model, {}, 0.4, progress);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    EXPECT_NEAR(*found, shift, 2e-4);
  }
  NoProgress progress;
  EXPECT_FALSE(recording::best_shift(*table({100, 101}, {0, 0}), *model, {}, 1, progress).ok());
}

TEST(Residuals, ParabolasFitWhatIsAParabolaAndAverageNoise) {
  std::vector<double> t, x;
  double at = 0;
  for (int i = 0; i < 500; ++i) {
    at += 0.001 * (1 + i % 3);  // unevenly
    t.push_back(at);
    x.push_back(1 - 2 * at + 3 * at * at);
  }
  x[250] = NAN;
  const auto fit = sim::fit_parabolas(t, x, 0.05);
  ASSERT_TRUE(fit.ok());
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(fit->value[i], 1 - 2 * t[i] + 3 * t[i] * t[i], 1e-12);
    EXPECT_NEAR(fit->rate[i], -2 + 6 * t[i], 1e-9);
    EXPECT_NEAR(fit->second[i], 6, 1e-6);
  }
  EXPECT_FALSE(sim::fit_parabolas(std::vector<double>(), {}, 1).value().value.size());
  std::vector<double> many(3000);
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = 1e-3 * static_cast<double>(i);
  EXPECT_FALSE(sim::fit_parabolas(many, many, 2).ok());  // a window of more than 1000 samples
}

class Measured : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    for (const auto& [number, r] : app().recordings.list()) app().recordings.remove(number);
    lua::LuaOptions options;
    options.print = [](std::string_view) {};
    state_ = std::make_unique<lua::LuaState>(app(), session_, options);
    run(R"(
      arm = robot.create{name = "arm", convention = "dh", links = {
        {a = 0.5, lower = -3, upper = 3, mass = 1, com = {-0.25, 0, 0}},
        {a = 0.4, lower = -3, upper = 3, mass = 1, com = {-0.2, 0, 0}}}}
      function measured(rows, more)
        local t, q, qd, qdd = {}, {}, {}, {}
        for i = 1, rows do
          local at = 0.005 * (i - 1)
          t[i] = at
          q[i] = {math.sin(3 * at), 0.5 * math.cos(2 * at)}
          qd[i] = {3 * math.cos(3 * at), -math.sin(2 * at)}
          qdd[i] = {-9 * math.sin(3 * at), -2 * math.cos(2 * at)}
        end
        local columns = {{name = "time", unit = "s", values = t}, {name = "q", unit = "rad", values = q}}
        for _, c in ipairs((more or function() return {} end)(t, q, qd, qdd)) do columns[#columns + 1] = c end
        return recording.create{title = "measured", robot = "arm", columns = columns}
      end
      function row(t, x, y)
        return {{name = "time", unit = "s", values = {t}}, {name = "q", unit = "rad", values = {{x, y}}}}
      end)");
  }
  void TearDown() override { state_.reset(); }
  void run(const std::string& code) {
    const auto r = state_->run_string(code, "test.lua");
    EXPECT_TRUE(r.ok()) << code << "\n" << (r.ok() ? "" : r.error().sentence());
  }
  std::string eval(const std::string& code) {
    const auto r = state_->eval(code);
    return r.ok() ? *r : "error: " + r.error().sentence();
  }
  void refused(const std::string& code, const std::string& part) {
    const std::string said = eval(code);
    EXPECT_NE(said.find("error: "), std::string::npos) << code << " gave " << said;
    EXPECT_NE(said.find(part), std::string::npos) << code << " gave " << said;
  }
  ioci::Session session_{"test"};
  std::unique_ptr<lua::LuaState> state_;
};

TEST_F(Measured, RowsAreCheckedAndBroughtToSi) {
  run("m = measured(5)");
  run("m:append{columns = {{name = 'q', unit = 'deg', values = {{180, 90}}}, "
      "{name = 'time', unit = 'ms', values = {50}}}}");
  EXPECT_EQ(eval("return #m:values('time')"), "6");
  EXPECT_EQ(eval("return m:values('q2')[6] == math.pi / 2"), "true");
  refused("m:append{columns = row(0.05, 0, 0)}", "the time does not increase");
  refused("m:append{columns = {{name = 'time', unit = 's', values = {1}}}}",
          "no values of column \"q1\"");
  refused(
      "m:append{columns = {{name = 'time', unit = 's', values = {1}}, "
      "{name = 'q', unit = 'm', values = {{1, 2}}}}}",
      "is in \"rad\" and the rows are in \"m\"");
  refused(
      "m:append{columns = {{name = 'time', unit = 's', values = {1}}, "
      "{name = 'q', unit = 'rad', values = {{1, 2, 3}}}}}",
      "q3");
  refused("m:append{columns = {}}", "no rows");
  EXPECT_EQ(eval("return #m:values('time')"), "6");
  // Undo is of the document, which knows no recordings.
  EXPECT_EQ(eval("m:is_stale().why_not"), "it was made of given values");
}

TEST_F(Measured, ARecordingThatWasMadeIsNotMadeAgainWithoutTheRows) {
  run("r = arm:simulate{q = {0.1, 0.2}, duration = 0.1}");
  run("local columns = {} for _, c in ipairs(r:columns()) do "
      "columns[#columns + 1] = {name = c.name, unit = c.unit, values = {c.name == 'time' and 5 or "
      "0}} end "
      "r:append{columns = columns}");
  EXPECT_EQ(eval("r:is_stale().why_not"), "rows were appended to it");
  refused("r:refresh{always = true}", "rows were appended");
}

TEST_F(Measured, ItsRobotHasToFit) {
  const char* const three =
      "recording.create{robot = 'arm', columns = {{name = 'time', unit = 's', values = {0, 1}}, "
      "{name = 'q', unit = '%s', values = {%s, %s}}}}";
  char text[400];
  std::snprintf(text, sizeof text, three, "rad", "{1, 2, 3}", "{1, 2, 3}");
  refused(text, "2 joint values");
  std::snprintf(text, sizeof text, three, "m", "{1, 2}", "{1, 2}");
  refused(text, "is in \"m\"");
  refused("recording.create{robot = 'nobody', columns = {{name = 'q1', values = {0}}}}", "nobody");
  refused("recording.create{robot = 'arm', columns = {{name = 'x', values = {0}}}}",
          "no column \"q1\"");
  run("cell = world.create{name = 'cell'} cell:add_robot{robot = arm, name = 'left'}");
  refused("recording.create{world = cell, columns = {{name = 'q1', values = {0}}}}", "no robot");
  refused(
      "recording.create{world = cell, robot = 'right', columns = {{name = 'q1', values = {0}}}}",
      "left");
  run("m = recording.create{world = cell, robot = 'left', columns = {{name = 'time', unit = 's', "
      "values = {0}}, "
      "{name = 'q', unit = 'rad', values = {{0, 0}}}}} m:compute('pose')");
  EXPECT_EQ(eval("return m:values('x')[1]"), "0.9");
}

TEST_F(Measured, ARecordingIsRefusedWhereAnyRecordIsTaken) {
  run("m = recording.create{robot = arm, columns = {{name = 'time', unit = 's', values = {0}}, "
      "{name = 'q', unit = 'rad', values = {{0, 0}}}}}");
  for (const char* call :
       {"fault.list{record = m}", "record.describe{id = m}", "record.outline{id = m}"})
    refused(call, "is a recording, not a record");
}

// All commands that take a robot by its name take it as a record, too.
TEST_F(Measured, ARobotIsAlsoGivenAsARecord) {
  const char* const columns =
      "columns = {{name = 'time', unit = 's', values = {0}}, "
      "{name = 'q', unit = 'rad', values = {{0, 0}}}}}";
  run(std::string("m = recording.create{robot = arm, ") + columns + " m:compute('pose')");
  EXPECT_EQ(eval("return m:values('x')[1]"), "0.9");
  run("cell = world.create{name = 'cell'} cell:add_robot{robot = arm, name = 'left'}");
  run(std::string("m = recording.create{world = cell, robot = arm, ") + columns +
      " m:compute{quantities = 'pose', robot = arm}");
  EXPECT_EQ(eval("return m:values('x')[1]"), "0.9");
  EXPECT_EQ(eval("for _, r in ipairs(recording.list()) do if r.recording == m then return r.robot "
                 "end end"),
            "left");
  run("assert(cell:check_path{robot = arm, path = {{0, 0}, {0.1, 0}}}.is_free ~= nil)\n"
      "job = task.create{name = 'job', steps = {{step = 'wait', time = 1}}}\n"
      "cell:add_task{task = job, robot = arm}\nassert(cell:tasks()[1].robot == 'left')");
  // As the lines of calls name it, also where another kind has the name.
  run("name = arm:describe().name\nworld.create{name = name}\n"
      "for _, text in ipairs{name, 'robot:' .. name} do\n"
      "  assert(cell:check_path{robot = text, path = {{0, 0}, {0.1, 0}}}.is_free ~= nil)\n"
      "  cell:set_robot_q{robot = text, q = {0.1, 0}}\nend");
  refused("world.check_path{id = world.create{name = 'bare'}, robot = arm, path = {{0, 0}}}",
          "is not in the world");
  refused("world.check_path{id = 'bare', robot = 'world:bare', path = {{0, 0}}}", "world:bare");
  run("cell:add_robot{robot = arm, name = 'right'}");
  refused(std::string("recording.create{world = cell, robot = arm, ") + columns,
          "is placed more than once");
}

// Limits that are not symmetric, one beside 0 and one apart from it.
TEST_F(Measured, SummaryAndBandsAgreeHowNearALimitIs) {
  run("crane = robot.create{name = 'crane', links = {{name = 'a1', a = 0.3, lower = -1, upper = 3, "
      "mass = 1}, {name = 'a2', a = 0.2, lower = 1, upper = 2, mass = 1}}}\n"
      "m = recording.create{robot = 'crane', columns = {"
      "{name = 'time', unit = 's', values = {0, 1, 2}}, "
      "{name = 'q', unit = 'rad', values = {{1.4, 1.02}, {0.5, 1.5}, {1, 2.1}}}}}\n"
      "worst = {}\nfor _, b in ipairs(m:bands{warn = 0.01}) do for _, s in ipairs(b.spans) do\n"
      "  if s.column then worst[s.column] = math.max(worst[s.column] or 0, s.share) end\n"
      "end end\n"
      "r = crane:simulate{q = {1.4, 1.02}, duration = 0.01}\n"
      "for _, c in ipairs(r:summary{to = 0}) do shares = shares or {}; shares[c.name] = c end");
  // By hand: the middle of -1 and 3 is 1, that of 1 and 2 is 1.5.
  EXPECT_EQ(eval("return math.abs(shares.q1.share - 0.2) < 1e-9"), "true");
  EXPECT_EQ(eval("return math.abs(shares.q2.share - 0.96) < 1e-9"), "true");
  EXPECT_EQ(eval("return shares.q2.at_share"), "1.02");
  EXPECT_EQ(eval("return math.abs(worst.q2 - 1.2) < 1e-9"), "true");
  run("m:compute('limits')");
  EXPECT_EQ(eval("local u = m:values('used_q2') return math.abs(u[1] - 0.96) < 1e-9 and "
                 "math.abs(u[3] - 1.2) < 1e-9"),
            "true");
}

TEST_F(Measured, BandsSayWhetherLimitsAreMissingOrUnknown) {
  const auto why = [&](const char* r) {
    return eval(std::string("for _, b in ipairs(") + r +
                ":bands()) do if b.name == 'position' then return b.why or 'known' end end");
  };
  run("robot.create{name = 'bare', links = {{a = 0.3}, {a = 0.2}}}\n"
      "free = recording.create{robot = 'bare', columns = {{name = 'time', unit = 's', values = "
      "{0}}, "
      "{name = 'q', unit = 'rad', values = {{0, 0}}}}}\n"
      "nobody = recording.create{columns = {{name = 'time', unit = 's', values = {0}}, "
      "{name = 'q1', unit = 'rad', values = {0}}}}");
  EXPECT_EQ(why("free"), "the joints have no position limits");
  EXPECT_EQ(why("nobody"), "no limits are known: the recording names no robot");
  run("robot.remove('bare')");
  EXPECT_EQ(why("free"), "no limits are known: robot \"bare\" does not exist any more");
}

TEST_F(Measured, PartsAreRowsOfATime) {
  run("m = measured(101)");
  EXPECT_EQ(eval("return #m:part{from = 0.1, to = 0.2}:values('time')"), "21");
  EXPECT_EQ(eval("return m:part{last = 0.1}:values('time')[1]"), "0.4");
  refused("m:part{from = 7}", "0.5 s");
  refused("m:part{from = 0.3, to = 0.2}", "no rows");
}

TEST_F(Measured, TorquesAreComparedWithInverseDynamics) {
  // The model's torques come from the command robot.inverse_dynamics, row by row.
  run(R"(
    function torques(scale)
      return function(t, q, qd, qdd)
        local tau = {}
        for i = 1, #t do
          local exact = arm:inverse_dynamics{q = q[i], qd = qd[i], qdd = qdd[i]}
          tau[i] = {scale * (exact[1] + 0.25), scale * (exact[2] - 0.5 * qd[i][2])}
        end
        return {{name = "qd", unit = "rad/s", values = qd}, {name = "qdd", unit = "rad/s^2", values = qdd},
          scale == 1 and {name = "tau", unit = "N m", values = tau} or {name = "current", values = tau}}
      end
    end
    m = measured(200, torques(1))
    r = m:torque_residual()
    worst = 0
    for i = 1, 200 do
      worst = math.max(worst, math.abs(r.recording:values("tau_residual1")[i] - 0.25),
        math.abs(r.recording:values("tau_residual2")[i] + 0.5 * m:values("qd2")[i]))
    end)");
  EXPECT_EQ(eval("return worst < 1e-9"), "true") << eval("return worst");
  EXPECT_EQ(eval("return r.rows, r.columns[1].name"), "200\ntau_residual1");
  // From currents, and with velocities and accelerations that were not measured.
  run("c = measured(200, torques(0.1)):torque_residual{torque_per_current = {10, 10}}");
  EXPECT_EQ(eval("return math.abs(c.columns[1].mean - 0.25) < 1e-9"), "true");
  run(R"(
    n = measured(200, function(t, q, qd, qdd) return {torques(1)(t, q, qd, qdd)[3]} end)
    f = n:torque_residual{window = 0.06})");
  EXPECT_EQ(eval("return math.abs(f.columns[1].mean - 0.25) < 0.02"), "true")
      << eval("return f.columns[1].mean");
  refused("m:torque_residual{torque_per_current = {1, 1}}", "no column \"current1\"");
  refused("measured(50):torque_residual()", "no measured torque \"tau1\"");
  refused("m:torque_residual{torque_per_current = {1}}", "1 values for 2 joints");
  refused(
      "recording.create{columns = {{name = 'time', unit = 's', values = {0}}}}:torque_residual()",
      "not belong to a robot");
}

TEST_F(Measured, ResidualsAreMadeAgainAfterBothHaveGrown) {
  run("m = measured(50) model = measured(50) r = m:residual{with = model, columns = "
      "'q'}.recording");
  EXPECT_EQ(eval("return r:is_stale().stale"), "false");
  run("m:append{columns = row(1, 0.5, 0.5)} model:append{columns = row(1.5, 0, 0)}");
  EXPECT_EQ(eval("return r:is_stale().stale"), "true");
  EXPECT_EQ(eval("return r:refresh().rows"), "51");
  refused("m:residual{with = model, shift = 0.1, find_shift = 1}", "Leave one out");
  refused("m:residual{with = model, columns = 'tau'}", "no column \"tau\"");
}

}  // namespace
}  // namespace robomosp
