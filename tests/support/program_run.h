// SPDX-License-Identifier: Apache-2.0
// Programs that run in a world: the fixture of the tests of their motions, signals and texts.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp::test {

using recording::RecordingPtr;

/// A world with robots, programs in it, and their runs.
class ProgramRun : public CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    cell_ = world_with({"ur5"});
  }
  Value world_with(const std::vector<std::string>& robots) {
    const Value world = call("world.create", {{"name", "cell" + std::to_string(++made_)}});
    for (std::size_t i = 0; i < robots.size(); ++i)
      call("world.add_robot", {{"id", world},
                               {"robot", call("robot.get", {{"name", robots[i]}})},
                               {"name", robots[i] + (i ? "_" + std::to_string(i + 1) : "")},
                               {"position", List{0.0, 1.5 * static_cast<double>(i), 0.0}}});
    return world;
  }
  /// Puts a program into the world of the test.
  Value put(const std::string& name, const std::string& body, const std::string& declared = "") {
    const Value p = call("program.create", {{"name", name},
                                            {"source", "PROGRAM " + name + ";\n" + declared +
                                                           "BEGIN\n" + body + "ENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", p}});
    return p;
  }
  RecordingPtr run(Map args = {}) {
    args.set("id", cell_);
    const Value made = call("world.run_task", args);
    const Handle* h = made.as_handle();
    return h ? app().recordings.find(h->number) : nullptr;
  }
  std::string fault(Map args = {}) {
    args.set("id", cell_);
    return fails("world.run_task", args).sentence();
  }
  static const std::vector<double>& column(const RecordingPtr& r, const std::string& name) {
    static const std::vector<double> none{NAN};
    for (const auto& c : r->columns)
      if (c.name == name) return c.values;
    ADD_FAILURE() << "no column " << name;
    return none;
  }
  /// The first time at which a column is at least so much.
  static double first(const RecordingPtr& r, const std::string& name, double least) {
    const auto& v = column(r, name);
    for (std::size_t i = 0; i < v.size(); ++i)
      if (v[i] >= least) return column(r, "time")[i];
    return NAN;
  }
  static bool has_note(const RecordingPtr& r, const std::string& part) {
    for (const std::string& n : r->notes)
      if (n.find(part) != std::string::npos) return true;
    return false;
  }
  /// Places of the tool, a row each.
  std::vector<std::array<double, 3>> tool(const RecordingPtr& r) {
    std::vector<std::array<double, 3>> out;
    const std::uint64_t number = app().recordings.add(r);
    call("recording.compute",
         {{"id", Handle{"recording", number}}, {"quantities", List{"pose"}}, {"robot", "ur5"}});
    const RecordingPtr with = app().recordings.find(number);
    const auto &x = column(with, "ur5.x"), &y = column(with, "ur5.y"), &z = column(with, "ur5.z");
    for (std::size_t i = 0; i < x.size(); ++i) out.push_back({x[i], y[i], z[i]});
    return out;
  }

  Value cell_;
  int made_ = 0;
};

inline constexpr const char* kDown = "ORIENTATION: down := ORIZYX(0.0, 180.0, 0.0);\n";

}  // namespace robomosp::test
