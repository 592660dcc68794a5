// SPDX-License-Identifier: GPL-3.0-or-later
// Stories: three introductions with steps that are ticked by what was done (layer: GUI). One table
// has their words, the checks of their steps, and the lines that show each step.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <QString>

#include "viewer/desktop/desk.h"

namespace robomosp::viewer {

class Settings;

/// Commands of which one must succeed.
struct StoryAct {
  std::vector<std::string> commands;
};

/// What must be the case after a change that was made during the story.
enum class StoryFact : std::uint8_t {
  none,
  joints_turned,    ///< `count` joints of robot `name` in the world of this name differ from the
                    ///< start
  poses_added,      ///< `count` more named poses of robot `name` than at the start
  parameter_made,   ///< a changed solid has a parameter `name`
  parameter_least,  ///< of a changed solid, parameter `name` is at least `value`
  solid_on_robot,   ///< a changed robot uses a solid that was changed before
  program_written   ///< a changed program has motions
};

struct StoryStep {
  QString title{}, how{};
  QString page{};                   ///< of the help
  std::vector<std::string> show{};  ///< lines of Lua that do it
  std::vector<StoryAct> acts{};     ///< in this order; empty = the fact alone
  StoryFact fact = StoryFact::none;
  std::string name{};
  int count = 0;
  double value = 0;
};

struct Story {
  QString id, title, summary;
  int minutes = 0;
  std::string world;  ///< of the library, that it opens; "" = none
  std::vector<StoryStep> steps;
};

[[nodiscard]] const std::vector<Story>& stories();
/// Null if there is none.
[[nodiscard]] const Story* story_named(const QString& id);

/// Follows the events of the session and ticks the steps of one story. [GUI thread]
class StoryProgress : public QObject {
 public:
  StoryProgress(Desk& desk, Settings& settings, QObject* parent = nullptr);

  /// Begins a story anew, or continues it with the steps that are ticked.
  void begin(const Story& story, bool anew);
  /// Follows none any more; its ticks are kept.
  void leave();
  [[nodiscard]] const Story* story() const { return story_; }
  [[nodiscard]] bool is_done(std::size_t step) const { return done_.contains(step); }
  [[nodiscard]] std::size_t done() const { return done_.size(); }
  /// The first step without a tick; the number of steps if all have one.
  [[nodiscard]] std::size_t current() const;
  /// Ticks that are kept of a story.
  [[nodiscard]] static std::set<std::size_t> kept(const Settings& settings, const Story& story);

  Listeners<> changed;

 private:
  void take(const ioci::Event& event);
  void take_command(const ioci::CommandRun& run);
  void take_change(const ioci::Change& change);
  void look_at_start();
  void check_fact(std::size_t step, const Handle& changed);
  void tick(std::size_t step);
  void ask_joints(const std::string& name, std::function<void(std::vector<double>)> done);
  void ask_pose_count(const std::string& name, std::function<void(int)> done);

  Desk& desk_;
  Settings& settings_;
  const Story* story_ = nullptr;
  int begun_ = 0;  ///< stories begun, so that late answers are dropped
  std::set<std::size_t> done_;
  std::vector<std::size_t> reached_;  ///< acts of each step that are complete
  std::vector<double> joints_;        ///< at the start
  int poses_ = -1;                    ///< at the start; -1 = not known yet
  std::set<std::uint64_t> solids_;    ///< changed during the story
};

}  // namespace robomosp::viewer
