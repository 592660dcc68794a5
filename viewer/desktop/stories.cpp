// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/stories.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

constexpr double kTurned = 1e-4;      ///< least turn of a joint that counts [rad or m]
constexpr double kLeastShare = 1e-9;  ///< of a value, for rounding

std::vector<Story> make_stories() {
  std::vector<Story> all;
  Story moves{"moves",
              "A robot moves, and what it takes",
              "The PUMA 560, its joints, its torques.",
              8,
              "puma560",
              {}};
  moves.steps.push_back(
      {.title = "Turn three joints",
       .how = "Select the robot puma560 in the navigator, below the world, and drag three of its "
              "joints in the properties.",
       .page = "user/kinematics.md",
       .show = {"world.set_robot_q{id = \"puma560\", robot = \"puma560\", q = {\"20 deg\", \"60 "
                "deg\", \"-120 deg\", 0, \"-45 deg\", 0}}"},
       .acts = {},
       .fact = StoryFact::joints_turned,
       .name = "puma560",
       .count = 3});
  moves.steps.push_back(
      {.title = "Draw a line",
       .how =
           "Make a trajectory with a line that begins at the tool, and drag it to the row of the "
           "world in the navigator.",
       .page = "user/trajectories.md",
       .show = {"local q = {\"20 deg\", \"60 deg\", \"-120 deg\", 0, \"-45 deg\", 0}\n"
                "local s = robot(\"puma560\"):fk{q = q}\n"
                "local p, a = s.position, s.rpy\n"
                "local line = trajectory.create{name = \"story_line_\" .. #trajectory.list() + 1,\n"
                "  sample_time = \"20 ms\", segments = {{shape = \"line\", duration = \"2 s\",\n"
                "  points = {{p[1], p[2], p[3], a[1], a[2], a[3]},\n"
                "            {p[1], p[2] + 0.1, p[3] - 0.1, a[1], a[2], a[3]}}}}}\n"
                "world.set_robot_q{id = \"puma560\", robot = \"puma560\", q = q}\n"
                "world.add_trajectory{id = \"puma560\", trajectory = line}"},
       .acts = {{{"world.add_trajectory"}}}});
  moves.steps.push_back(
      {.title = "Record what the motion takes",
       .how =
           "Run world.inverse_dynamics (Ctrl+Shift+P) on the world with the line: it records the "
           "torques of all joints.",
       .page = "user/dynamics.md",
       .show = {"world.inverse_dynamics{id = \"puma560\", robot = \"puma560\", trajectory = "
                "world(\"puma560\"):trajectories()[1].name}"},
       .acts = {{{"world.inverse_dynamics"}}}});
  moves.steps.push_back(
      {.title = "Add a mass, see the torque change",
       .how = "Set a payload (robot.set_payload, for example 2.5 kg) or the mass of a link, and "
              "record the torques again.",
       .page = "command:robot.set_payload",
       .show = {"robot.set_payload{id = \"puma560\", mass = \"2.5 kg\"}",
                "world.inverse_dynamics{id = \"puma560\", robot = \"puma560\", trajectory = "
                "world(\"puma560\"):trajectories()[1].name}"},
       .acts = {{{"robot.set_payload", "robot.set_link", "record.set"}},
                {{"world.inverse_dynamics", "recording.refresh"}}}});
  all.push_back(std::move(moves));

  Story solid{"solid", "From a solid to a torque", "A link, its bore, its mass, its robot.", 10, "",
              {}};
  solid.steps.push_back(
      {.title = "Build hub, eye and web",
       .how =
           "Make a solid (File > New) with a parameter bore of 30 mm, and subtract a cylinder of "
           "this diameter.",
       .page = "user/solids.md",
       .show =
           {"solid.create{name = \"story_link\", material = material \"aluminium_6082\", "
            "parameters = {bore = \"30 mm\"},\n"
            "  root = {kind = \"difference\", children = {\n"
            "    {kind = \"union\", children = {\n"
            "      {kind = \"cylinder\", name = \"hub\", radius = \"40 mm\", height = \"60 mm\"},\n"
            "      {kind = \"cylinder\", name = \"eye\", radius = \"35 mm\", height = \"60 mm\", "
            "position = {\"300 mm\", 0, 0}},\n"
            "      {kind = \"box\", name = \"web\", x = \"300 mm\", y = \"40 mm\", z = \"40 mm\", "
            "position = {\"150 mm\", 0, \"10 mm\"}}}},\n"
            "    {kind = \"cylinder\", name = \"hole\", radius = \"bore/2\", height = \"80 mm\", "
            "position = {0, 0, \"-10 mm\"}}}}}",
            "window.open{record = solid \"story_link\"}"},
       .acts = {},
       .fact = StoryFact::parameter_made,
       .name = "bore"});
  solid.steps.push_back(
      {.title = "Widen the bore from 30 to 42 mm",
       .how = "Select the solid and drag its parameter bore in the properties.",
       .page = "user/parameters.md",
       .show = {"solid.set_parameter{id = \"story_link\", name = \"bore\", value = \"42 mm\"}",
                "solid(\"story_link\"):mass().mass"},
       .acts = {},
       .fact = StoryFact::parameter_least,
       .name = "bore",
       .value = 0.042});
  solid.steps.push_back(
      {.title = "Hang it on a joint",
       .how = "Make a robot whose first link has the solid as a part, placed at the far end of the "
              "link.",
       .page = "user/mechanisms.md",
       .show =
           {"robot.create{name = \"story_arm\", convention = \"dh\", mass_source = \"designed\", "
            "links = {\n"
            "  {name = \"upper\", a = \"300 mm\", parts = {{what = \"story_link\", position = "
            "{\"-300 mm\", 0, \"-30 mm\"}}}}}}",
            "window.open{record = robot \"story_arm\"}"},
       .acts = {},
       .fact = StoryFact::solid_on_robot});
  solid.steps.push_back(
      {.title = "Read the torque, undo, redo",
       .how = "Run robot.gravity_torques with gravity across the axis, press Ctrl+Z, then "
              "Ctrl+Shift+Z.",
       .page = "user/sessions.md",
       .show = {"robot(\"story_arm\"):gravity_torques{q = {0}, gravity = {0, -9.81, 0}}",
                "document.undo()", "document.redo()"},
       .acts = {{{"document.undo"}}, {{"document.redo"}}}});
  all.push_back(std::move(solid));

  Story program{"program",
                "A program for the real controller",
                "Teach, write, check, hand over as KRL.",
                12,
                "kr5",
                {}};
  program.steps.push_back(
      {.title = "Teach two targets",
       .how = "Move the robot kr5 by its joints, and keep two poses by name with robot.set_pose.",
       .page = "command:robot.set_pose",
       .show = {"robot.set_pose{id = \"kr5\", name = \"pick\", q = {\"-20 deg\", \"90 deg\", 0, 0, "
                "\"60 deg\", 0}}",
                "robot.set_pose{id = \"kr5\", name = \"place\", q = {\"25 deg\", \"80 deg\", \"10 "
                "deg\", 0, \"60 deg\", 0}}"},
       .acts = {},
       .fact = StoryFact::poses_added,
       .name = "kr5",
       .count = 2});
  program.steps.push_back({.title = "Write the moves in IRL",
                           .how = "Make a program (File > New) with a MOVE for each target.",
                           .page = "user/irl/language.md",
                           .show = {"program.create{name = \"hand_over\", source = [[\n"
                                    "PROGRAM hand_over;\n"
                                    "BEGIN\n"
                                    "  MOVE PTP MAIN_JOINT(-20.0, 90.0, 0.0, 0.0, 60.0, 0.0);\n"
                                    "  MOVE PTP MAIN_JOINT(25.0, 80.0, 10.0, 0.0, 60.0, 0.0);\n"
                                    "ENDPROGRAM;\n"
                                    "]]}"},
                           .acts = {},
                           .fact = StoryFact::program_written});
  program.steps.push_back(
      {.title = "Run it and look for faults",
       .how = "program.check_run runs it with the robot and reports limits, contacts and reach.",
       .page = "user/irl/checking.md",
       .show = {"program(\"hand_over\"):check_run{robot = \"kr5\"}"},
       .acts = {{{"program.check_run"}}}});
  program.steps.push_back(
      {.title = "Generate KRL and compare with RAPID",
       .how = "program.compare_targets puts the code of both controllers side by side and compares "
              "their points.",
       .page = "command:program.compare_targets",
       .show = {"program(\"hand_over\"):post{target = \"krl\", robot = \"kr5\"}",
                "program(\"hand_over\"):compare_targets{targets = {\"krl\", \"rapid\"}, robot = "
                "\"kr5\"}.points"},
       .acts = {{{"program.compare_targets"}}}});
  all.push_back(std::move(program));
  return all;
}

QString key_of_story(const Story& story) { return "stories/" + story.id; }

}  // namespace

const std::vector<Story>& stories() {
  static const std::vector<Story> all = make_stories();
  return all;
}

const Story* story_named(const QString& id) {
  for (const Story& s : stories())
    if (s.id == id) return &s;
  return nullptr;
}

StoryProgress::StoryProgress(Desk& desk, Settings& settings, QObject* parent)
    : QObject(parent), desk_(desk), settings_(settings) {
  desk_.events.add(this, [this](const ioci::Event& e) { take(e); });
}

std::set<std::size_t> StoryProgress::kept(const Settings& settings, const Story& story) {
  std::set<std::size_t> out;
  for (const QString& word : settings.value(key_of_story(story)).split(' ', Qt::SkipEmptyParts))
    if (const auto step = static_cast<std::size_t>(word.toUInt()); step < story.steps.size())
      out.insert(step);
  return out;
}

void StoryProgress::begin(const Story& story, bool anew) {
  ++begun_;
  story_ = &story;
  done_ = anew ? std::set<std::size_t>() : kept(settings_, story);
  if (anew) settings_.set_value(key_of_story(story), {});
  reached_.assign(story.steps.size(), 0);
  joints_.clear();
  poses_ = -1;
  solids_.clear();
  look_at_start();
  changed();
}

void StoryProgress::leave() {
  ++begun_;
  story_ = nullptr;
  changed();
}

std::size_t StoryProgress::current() const {
  std::size_t step = 0;
  while (story_ && step < story_->steps.size() && done_.contains(step)) ++step;
  return step;
}

void StoryProgress::tick(std::size_t step) {
  if (!story_ || !done_.insert(step).second) return;
  QStringList words;
  for (const std::size_t each : done_) words += QString::number(each);
  settings_.set_value(key_of_story(*story_), words.join(' '));
  changed();
}

// --- what was the case at the start ----------------------------------------------------------

void StoryProgress::look_at_start() {
  const int begun = begun_;
  for (const StoryStep& step : story_->steps) {
    if (step.fact == StoryFact::joints_turned)
      ask_joints(step.name, [this, begun](std::vector<double> q) {
        if (begun == begun_ && joints_.empty()) joints_ = std::move(q);
      });
    if (step.fact == StoryFact::poses_added)
      ask_pose_count(step.name, [this, begun](int count) {
        if (begun == begun_ && poses_ < 0) poses_ = count;
      });
  }
}

void StoryProgress::ask_joints(const std::string& name,
                               std::function<void(std::vector<double>)> done) {
  desk_.ask("world.robots", {{"id", name}}, *this,
            [this, name, done = std::move(done)](const Result<Value>& r) {
              if (!r.ok()) return;
              for (const Value& row : list_of(*r)) {
                if (text_at(map_of(row), "name") != name) continue;
                std::vector<double> q = numbers_at(map_of(row), "q");
                if (!q.empty()) return done(std::move(q));
                // Robots without stored joint values are shown in their pose "home".
                desk_.ask("robot.pose_values", {{"id", name}, {"name", "home"}}, *this,
                          [done](const Result<Value>& home) {
                            if (home.ok()) done(numbers_of(*home));
                          });
              }
            });
}

void StoryProgress::ask_pose_count(const std::string& name, std::function<void(int)> done) {
  desk_.ask("robot.poses", {{"id", name}}, *this, [done = std::move(done)](const Result<Value>& r) {
    if (!r.ok()) return;
    done(static_cast<int>(r->as_map() ? map_of(*r).size() : list_of(*r).size()));
  });
}

// --- what is done ----------------------------------------------------------------------------

void StoryProgress::take(const ioci::Event& event) {
  if (!story_) return;
  if (event.topic == ioci::Topic::command && event.command) take_command(*event.command);
  if (event.topic == ioci::Topic::change && event.change) take_change(*event.change);
}

void StoryProgress::take_command(const ioci::CommandRun& run) {
  if (run.failure || run.draft != 0) return;
  for (std::size_t i = 0; i < story_->steps.size(); ++i) {
    const StoryStep& step = story_->steps[i];
    std::size_t& reached = reached_[i];
    if (is_done(i) || reached >= step.acts.size()) continue;
    const auto& commands = step.acts[reached].commands;
    if (std::find(commands.begin(), commands.end(), run.command) == commands.end()) continue;
    if (++reached == step.acts.size() && step.fact == StoryFact::none) tick(i);
  }
}

void StoryProgress::take_change(const ioci::Change& change) {
  for (const auto& each : change.records) {
    if (!each.after) continue;
    const Handle id{std::string(to_string(each.id.kind)), each.id.number};
    if (id.kind == "solid") solids_.insert(id.number);
    for (std::size_t i = 0; i < story_->steps.size(); ++i)
      if (!is_done(i) && story_->steps[i].fact != StoryFact::none) check_fact(i, id);
  }
}

void StoryProgress::check_fact(std::size_t step, const Handle& record) {
  const StoryStep& s = story_->steps[step];
  const int begun = begun_;
  const auto is_late = [this, begun] { return begun != begun_; };
  switch (s.fact) {
    case StoryFact::none: break;
    case StoryFact::joints_turned:
      if (record.kind == "world" && !joints_.empty())
        ask_joints(s.name, [this, step, is_late](const std::vector<double>& q) {
          if (is_late() || q.size() != joints_.size()) return;
          int turned = 0;
          for (std::size_t k = 0; k < q.size(); ++k)
            turned += std::abs(q[k] - joints_[k]) > kTurned;
          if (turned >= story_->steps[step].count) tick(step);
        });
      break;
    case StoryFact::poses_added:
      if (record.kind == "robot" && poses_ >= 0)
        ask_pose_count(s.name, [this, step, is_late](int count) {
          if (!is_late() && count >= poses_ + story_->steps[step].count) tick(step);
        });
      break;
    case StoryFact::parameter_made:
    case StoryFact::parameter_least:
      if (record.kind == "solid")
        desk_.ask(
            "record.parameters", {{"id", record}}, *this,
            [this, step, is_late](const Result<Value>& r) {
              if (is_late() || !r.ok()) return;
              const StoryStep& now = story_->steps[step];
              const Value* found = map_of(*r).find(now.name);
              if (!found) return;
              const double value = number_at(map_of(*found), "value");
              if (now.fact == StoryFact::parameter_made || value >= now.value * (1 - kLeastShare))
                tick(step);
            });
      break;
    case StoryFact::solid_on_robot:
      if (record.kind == "robot")
        for (const std::uint64_t number : solids_)
          desk_.ask("document.referrers", {{"record", Handle{"solid", number}}}, *this,
                    [this, step, record, is_late](const Result<Value>& r) {
                      if (is_late() || !r.ok()) return;
                      for (const Value& v : list_of(*r))
                        if (const Handle* h = v.as_handle(); h && *h == record) tick(step);
                    });
      break;
    case StoryFact::program_written:
      if (record.kind == "program")
        desk_.ask("program.source", {{"id", record}}, *this,
                  [this, step, is_late](const Result<Value>& r) {
                    const std::string* text = !is_late() && r.ok() ? r->as_string() : nullptr;
                    if (text && text->find("MOVE") != std::string::npos) tick(step);
                  });
      break;
  }
}

}  // namespace robomosp::viewer
