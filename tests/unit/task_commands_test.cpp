// SPDX-License-Identifier: Apache-2.0
// The list of a task's steps from the console, against a plain tree; files of tasks; undo.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

/// A step with those that are in it.
struct Node {
  std::string text;  ///< of a message; "" = a repeat
  int count = 0;     ///< of a repeat
  std::vector<std::unique_ptr<Node>> inner;
};
using Nodes = std::vector<std::unique_ptr<Node>>;

/// Where a step stands: in which list, and at which place of it.
struct Place {
  Nodes* list = nullptr;
  std::size_t at = 0;
  [[nodiscard]] Node& node() const { return *(*list)[at]; }
};

void places_of(Nodes& list, std::vector<Place>& out) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    out.push_back({&list, i});
    places_of(list[i]->inner, out);
  }
}
std::string listed(const Nodes& list, int parent, int& number) {
  std::string out;
  for (const auto& n : list) {
    const int own = ++number;
    out += std::to_string(own) + " " + std::to_string(parent) + " " +
           (n->text.empty() ? std::to_string(n->count) : n->text) + "\n";
    out += listed(n->inner, own, number);
  }
  return out;
}
bool holds(const Node& n, const Nodes* list) {
  if (&n.inner == list) return true;
  for (const auto& i : n.inner)
    if (holds(*i, list)) return true;
  return false;
}

class TaskCommands : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
    run("t = task.create{name = 'shift'}\n"
        "function listed() local s = ''\n"
        "  for _, r in ipairs(t:steps()) do\n"
        "    s = s .. r.number .. ' ' .. r.parent .. ' ' .. (r.text or r.count) .. '\\n'\n"
        "  end\n  return s end");
  }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r : r.error().sentence();
  }
  void run(const std::string& code) {
    auto r = state_->eval(code);
    ASSERT_TRUE(r.ok()) << r.error().sentence() << "\n" << code;
  }
  void expect_listed(const Nodes& tree) {
    int number = 0;
    const std::string wanted = listed(tree, 0, number);
    run("assert(listed() == [==[\n" + wanted + "]==], listed())");
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

TEST_F(TaskCommands, EditTheListOfStepsAndUndoThat) {
  std::mt19937 random(20061122);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  Nodes tree;
  int made = 0;
  // A step and its spelling: a message, or a repeat with up to two messages in it.
  const auto make = [&](bool is_block, bool is_empty) {
    auto n = std::make_unique<Node>();
    std::string code;
    if (is_block) {
      n->count = ++made;
      for (std::size_t k = is_empty ? 0 : below(3); k > 0; --k) {
        n->inner.push_back(std::make_unique<Node>());
        n->inner.back()->text = "m" + std::to_string(++made);
        code += "{step = 'message', text = '" + n->inner.back()->text + "'}, ";
      }
      code = "{step = 'repeat', count = " + std::to_string(n->count) + ", steps = {" + code + "}}";
    } else {
      n->text = "m" + std::to_string(++made);
      code = "{step = 'message', text = '" + n->text + "'}";
    }
    return std::pair(std::move(n), code);
  };
  std::vector<std::string> digests{app().document.content_digest()};
  std::array<int, 5> done{};
  for (int k = 0; k < 250; ++k) {
    std::vector<Place> all;
    places_of(tree, all);
    const std::size_t what = all.size() < 4 ? below(2) : all.size() > 40 ? 4 : below(5);
    if (what == 0) {  // at the end of the task or of a block
      auto [n, code] = make(below(3) == 0, false);
      std::size_t parent = 0;
      Nodes* into = &tree;
      if (!all.empty() && below(2) == 0) {
        const std::size_t i = below(all.size());
        if (all[i].node().text.empty()) parent = i + 1, into = &all[i].node().inner;
      }
      into->push_back(std::move(n));
      run("t:add_step{step = " + code + ", parent = " + std::to_string(parent) + "}");
    } else if (what == 1) {  // before another
      auto [n, code] = make(below(3) == 0, false);
      if (all.empty()) {
        tree.push_back(std::move(n));
        run("t:add_step{step = " + code + "}");
      } else {
        const std::size_t i = below(all.size());
        all[i].list->insert(all[i].list->begin() + static_cast<std::ptrdiff_t>(all[i].at),
                            std::move(n));
        run("assert(t:add_step{step = " + code + ", before = " + std::to_string(i + 1) +
            "} == " + std::to_string(i + 1) + ")");
      }
    } else if (what == 2) {  // another in its place
      const std::size_t i = below(all.size());
      auto [n, code] = make(below(2) == 0, true);
      if (n->text.empty() && all[i].node().text.empty()) n->inner.swap(all[i].node().inner);
      (*all[i].list)[all[i].at] = std::move(n);
      run("t:set_step(" + std::to_string(i + 1) + ", " + code + ")");
    } else if (what == 3) {  // elsewhere
      const std::size_t i = below(all.size()), to = below(all.size());
      const std::string code = "t:move_step{index = " + std::to_string(i + 1) +
                               ", before = " + std::to_string(to + 1) + "}";
      if (i == to || holds(all[i].node(), all[to].list)) {
        EXPECT_NE(eval(code).find("which is itself or within it"), std::string::npos) << code;
        continue;
      }
      const Node* before = &all[to].node();
      std::unique_ptr<Node> moved = std::move((*all[i].list)[all[i].at]);
      all[i].list->erase(all[i].list->begin() + static_cast<std::ptrdiff_t>(all[i].at));
      Nodes& into = *all[to].list;
      const auto at =
          std::find_if(into.begin(), into.end(), [&](const auto& n) { return n.get() == before; });
      ASSERT_NE(at, into.end());
      into.insert(at, std::move(moved));
      run(code);
    } else {
      const std::size_t i = below(all.size());
      all[i].list->erase(all[i].list->begin() + static_cast<std::ptrdiff_t>(all[i].at));
      run("t:remove_step(" + std::to_string(i + 1) + ")");
    }
    ++done[what];
    expect_listed(tree);
    // A step moved before the one behind it changes nothing, and there is nothing to undo.
    if (const auto digest = app().document.content_digest(); digest != digests.back())
      digests.push_back(digest);
    if (HasFailure()) return;
  }
  for (const int count : done) EXPECT_GT(count, 15);
  for (; digests.size() > 1; digests.pop_back()) {
    ASSERT_EQ(app().document.content_digest(), digests.back());
    ASSERT_TRUE(app().document.undo().ok());
  }
  EXPECT_EQ(app().document.content_digest(), digests.back());
}

TEST_F(TaskCommands, EveryKindOfStepIsWrittenWithUnitsAndReadAgain) {
  run("way = trajectory.create{name = 'way', segments = {{shape = 'line', points = {{0, 0, 0, 0, "
      "0, "
      "0}, {0.4, 0, 0, 0, 0, 0}}, speed = 0.1}}}\n"
      "inner = task.create{name = 'inner'}\n"
      "a = task.create{name = 'all', description = 'of every kind', steps = {\n"
      "  {step = 'move', robot = 'left', target = {0.1, 0, 0, 0, 0, '90 deg'}, frame = 'bench', "
      "tool "
      "= 'part', path = 'straight', tool_speed = '150 mm/s', duration = '2500 ms'},\n"
      "  {step = 'move', joints = {0.5, 1}, speed = 0.25, profile = 'trapezoidal'},\n"
      "  {step = 'move', pose = 'home'}, {step = 'move', trajectory = way, target = {1, 0, 0, 0, "
      "0, 0}},\n"
      "  {step = 'attach', object = 'part', link = 'flange'}, {step = 'detach', object = 'part'},\n"
      "  {step = 'set', signal = 'p', value = '2 bar'}, {step = 'wait', time = '200 ms'},\n"
      "  {step = 'repeat', count = 3, steps = {{step = 'wait', condition = 'p > 1 bar', timeout = "
      "'1 min'}, {step = 'if', condition = 'left.q1 > 0.5 rad', steps = {{step = 'message', text = "
      "'far'}}}, {step = 'else', steps = {{step = 'call', task = inner, robot = 'right'}}}}}}}");
  for (const char* part : {"tool_speed 0.15 m/s", "duration 2.5 s", "time 0.2 s", "timeout 60 s",
                           "tool \"part\"", "link \"flange\"", "path straight"})
    run("assert(a:text():find([[" + std::string(part) + "]], 1, true), a:text())");
  run("list = a:steps() assert(list[1].tool == 'part' and list[1].duration == 2.5)\n"
      "assert(list[9].count == 3 and list[10].timeout == 60 and list[5].link == 'flange')");
  const auto folder =
      std::filesystem::temp_directory_path() / ("robomosp-tasks-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  run("a:save('" + (folder / "all.tsk").string() + "') before = a:text()");
  run("document.clear() b = file.load('" + (folder / "all.tsk").string() +
      "')\nassert(b:text() == before, b:text())");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace robomosp::lua
