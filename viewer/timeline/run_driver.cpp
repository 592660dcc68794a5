// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/run_driver.h"

#include <algorithm>
#include <utility>

#include "viewer/desktop/values.h"

namespace robomosp::viewer {
namespace {

constexpr int kDragEndsAfterMs = 300;

}  // namespace

RunDriver::RunDriver(Desk& desk, Handle run, Player& player, QObject* parent)
    : QObject(parent), desk_(desk), run_(std::move(run)), player_(&player) {
  const QPointer<RunDriver> self(this);
  // The player may outlive this: its calls then find nobody.
  player.follow({[self](double time) {
                   if (self) self->seek(time);
                 },
                 [self](bool on, double speed) {
                   if (!self) return;
                   if (self->seek_end_.isActive()) self->end_drag();
                   if (on) self->desk_.act("run.play", {{"id", self->run_}, {"speed", speed}});
                   else self->desk_.act("run.pause", {{"id", self->run_}});
                 },
                 [self](int rows) {
                   if (!self) return;
                   if (self->seek_end_.isActive()) self->end_drag();
                   self->desk_.act("run.step", {{"id", self->run_}, {"rows", rows}});
                 }});
  seek_end_.setSingleShot(true);
  seek_end_.setInterval(kDragEndsAfterMs);
  // A drag is many seeks for the window, and one act at its end.
  connect(&seek_end_, &QTimer::timeout, this, [this] { end_drag(); });
  desk_.events.add(this, [this](const ioci::Event& e) {
    if (e.topic != ioci::Topic::run || !e.run || e.run->run != run_.number) return;
    newest_ = e.run;
    take(newest_->state);
  });
  ask_state();
}

void RunDriver::ask_state() {
  const QPointer<RunDriver> self(this);
  desk_.ask("run.rows", {{"id", run_}, {"from", 1}, {"most", 1}, {"columns", List{Value("time")}}},
            [self](const Result<Value>& r) {
              if (!self || !r.ok()) return;
              const auto times = numbers_at(map_at(map_of(*r), "columns"), "time");
              if (!times.empty()) self->first_ = times.front();
            });
  desk_.ask("run.state", {{"id", run_}}, [self](const Result<Value>& r) {
    if (self && r.ok()) self->take_answer(map_of(*r));
  });
}

void RunDriver::take_answer(const Map& state) { take(newest_ ? newest_->state : state); }

void RunDriver::take(const Map& state) {
  // While the user drags, the flag is where the mouse is.
  if (!player_ || is_seeking_ || !state.find("time")) return;
  const double time = number_at(state, "time");
  const double from = first_.value_or(0);
  player_->show_run(from, std::max(number_at(state, "recorded"), time), time,
                    flag_at(state, "is_playing"));
}

void RunDriver::seek(double time) {
  seek_time_ = time;
  seek_end_.start();
  if (is_seeking_) {
    wanted_time_ = time;
    return;
  }
  is_seeking_ = true;
  newest_ = nullptr;
  const QPointer<RunDriver> self(this);
  desk_.ask("run.seek", {{"id", run_}, {"time", time}}, [self](const Result<Value>& r) {
    if (!self) return;
    self->is_seeking_ = false;
    if (!r.ok()) {
      self->wanted_time_.reset();
      if (self->newest_) self->take(self->newest_->state);
      return self->desk_.failed(r.error());
    }
    if (const auto next = std::exchange(self->wanted_time_, std::nullopt)) self->seek(*next);
    else self->take_answer(map_of(*r));
  });
}

void RunDriver::end_drag() {
  seek_end_.stop();
  desk_.act("run.seek", {{"id", run_}, {"time", seek_time_}});
}

void RunDriver::stop() { desk_.act("run.stop", {{"id", run_}}); }

}  // namespace robomosp::viewer
