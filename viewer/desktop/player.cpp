// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/player.h"

#include <algorithm>
#include <cmath>

namespace robomosp::viewer {
namespace {

constexpr int kTickMs = 16;

}  // namespace

Player::Player(QObject* parent) : QObject(parent) {
  ticker_.setInterval(kTickMs);
  ticker_.setTimerType(Qt::PreciseTimer);
  connect(&ticker_, &QTimer::timeout, this, [this] { tick(); });
}

void Player::set_range(double from, double to) {
  ticker_.stop();
  from_ = from;
  to_ = std::max(from, to);
  time_ = from_;
  state_changed();
  if (has_motion()) time_changed(time_);
}

void Player::set_time(double time) {
  if (!has_motion() || !std::isfinite(time)) return;
  time_ = std::clamp(time, from_, to_);
  time_changed(time_);
}

void Player::play(bool on) {
  if (on && has_motion()) {
    if (time_ >= to_) set_time(from_);
    clock_.start();
    ticker_.start();
  } else {
    ticker_.stop();
  }
  state_changed();
}

void Player::set_speed(double speed) {
  if (!std::isfinite(speed) || speed <= 0) return;
  speed_ = speed;
  state_changed();
}

void Player::tick() {
  const double wanted = time_ + speed_ * 1e-3 * static_cast<double>(clock_.restart());
  if (wanted < to_) {
    set_time(wanted);
  } else if (is_looping_) {
    set_time(from_ + std::fmod(wanted - from_, to_ - from_));
  } else {
    set_time(to_);
    play(false);
  }
}

}  // namespace robomosp::viewer
