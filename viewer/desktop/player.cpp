// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/player.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace robomosp::viewer {
namespace {

constexpr int kTickMs = 16;
constexpr double kSteps = 100;  ///< of a recording

}  // namespace

Player::Player(QObject* parent) : QObject(parent) {
  ticker_.setInterval(kTickMs);
  ticker_.setTimerType(Qt::PreciseTimer);
  connect(&ticker_, &QTimer::timeout, this, [this] { tick(); });
}

void Player::set_range(double from, double to) {
  ticker_.stop();
  run_.reset();
  is_run_playing_ = false;
  from_ = from;
  to_ = std::max(from, to);
  time_ = from_;
  state_changed();
  if (has_motion()) time_changed(time_);
}

void Player::change_range(double from, double to) {
  if (run_ || (from == from_ && to == to_) || !(to > from)) return;
  from_ = from;
  to_ = to;
  time_ = std::clamp(time_, from_, to_);
  state_changed();
  time_changed(time_);
}

void Player::follow(Run run) {
  ticker_.stop();
  run_ = std::move(run);
  is_run_playing_ = false;
  state_changed();
}

void Player::show_run(double from, double to, double time, bool is_playing) {
  if (!run_) return;
  const bool is_other = from != from_ || to != to_ || is_playing != is_run_playing_;
  const bool is_moved = time != time_;
  from_ = from;
  to_ = std::max(from, to);
  time_ = time;
  is_run_playing_ = is_playing;
  if (is_other) state_changed();
  if (is_moved || is_other) time_changed(time_);
}

void Player::set_time(double time) {
  if (!has_motion() || !std::isfinite(time)) return;
  time_ = std::clamp(time, from_, to_);
  time_changed(time_);
  if (run_) run_->seek(time_);
}

void Player::step(int by) {
  if (run_) run_->step(by);
  else set_time(time_ + by * (to_ - from_) / kSteps);
}

void Player::play(bool on) {
  if (run_) return run_->play(on, speed_);
  if (on && has_motion()) {
    if (speed_ > 0 && time_ >= to_) set_time(from_);
    if (speed_ < 0 && time_ <= from_) set_time(to_);
    clock_.start();
    ticker_.start();
  } else {
    ticker_.stop();
  }
  state_changed();
}

void Player::set_speed(double speed) {
  if (!std::isfinite(speed) || speed == 0) return;
  speed_ = speed;
  if (run_ && is_run_playing_) run_->play(true, speed_);
  state_changed();
}

void Player::tick() {
  const double wanted = time_ + speed_ * 1e-3 * static_cast<double>(clock_.restart());
  if (wanted >= from_ && wanted < to_) {
    set_time(wanted);
  } else if (is_looping_) {
    const double into = std::fmod(wanted - from_, to_ - from_);
    set_time(into < 0 ? to_ + into : from_ + into);
  } else {
    set_time(wanted);  // clamped
    play(false);
  }
}

}  // namespace robomosp::viewer
