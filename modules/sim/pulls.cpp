// SPDX-License-Identifier: Apache-2.0
#include "sim/pulls.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <Eigen/Dense>

#include "kernel/text.h"
#include "spatial/pose.h"

namespace robomosp::sim {
namespace {

using namespace std::chrono_literals;

constexpr double kEarth = 9.81;  ///< [m/s^2]
/// How often closed sessions are looked for.
constexpr auto kLookEvery = 100ms;

std::string note_at(double t) { return "t = " + text::print_rounded(t) + " s: "; }

}  // namespace

std::string Pull::body() const {
  return robot.empty() && link.empty()
             ? text::quote(object)
             : "link " + text::quote(link) + (robot.empty() ? "" : " of " + text::quote(robot));
}

void Pulls::set(Pull pull) {
  const std::lock_guard lock(state_->mutex);
  const auto known = std::find_if(state_->all.begin(), state_->all.end(),
                                  [&](const Shown& s) { return s.pull.is_of(pull); });
  if (known != state_->all.end()) known->pull = std::move(pull);
  else state_->all.push_back({std::move(pull), std::nullopt, 0});
  ++state_->revision;
}

std::size_t Pulls::end(const std::function<bool(const Pull&)>& is_meant) {
  const std::lock_guard lock(state_->mutex);
  const std::size_t count =
      std::erase_if(state_->all, [&](const Shown& s) { return is_meant(s.pull); });
  if (count > 0) ++state_->revision;
  return count;
}

void Pulls::set_open_check(std::function<bool(std::uint64_t session)> is_open) {
  const std::lock_guard lock(state_->mutex);
  state_->is_open = std::move(is_open);
}

std::vector<Pulls::Shown> Pulls::shown() const {
  const std::lock_guard lock(state_->mutex);
  return state_->all;
}

void PullsInForce::end_pulls_of_closed_sessions() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < kLookEvery) return;
  looked_ = now;
  std::function<bool(std::uint64_t)> is_open;
  {
    const std::lock_guard lock(state_->mutex);
    is_open = state_->is_open;
  }
  if (!is_open) return;
  std::vector<std::uint64_t> closed;
  for (const Pull& p : all_)
    if (!is_open(p.session)) closed.push_back(p.session);
  if (closed.empty()) return;
  const std::lock_guard lock(state_->mutex);
  std::erase_if(state_->all, [&](const Pulls::Shown& s) {
    return std::find(closed.begin(), closed.end(), s.pull.session) != closed.end();
  });
  ++state_->revision;
}

bool PullsInForce::update(double t, std::vector<std::string>& notes) {
  if (!all_.empty()) end_pulls_of_closed_sessions();
  const std::uint64_t revision = state_->revision;
  if (revision == seen_) return false;
  seen_ = revision;
  std::vector<Pull> now;
  {
    const std::lock_guard lock(state_->mutex);
    for (const Pulls::Shown& s : state_->all) now.push_back(s.pull);
  }
  // By session and body, so that sums of forces do not depend on who came first.
  std::sort(now.begin(), now.end(), [](const Pull& a, const Pull& b) {
    return std::tie(a.session, a.object, a.robot, a.link) <
           std::tie(b.session, b.object, b.robot, b.link);
  });
  std::vector<Record> records(now.size(), Record{t, 0});
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const auto same =
        std::find_if(now.begin(), now.end(), [&](const Pull& p) { return p.is_of(all_[i]); });
    if (same != now.end()) {
      records[static_cast<std::size_t>(same - now.begin())] = records_[i];
      continue;
    }
    notes.push_back(note_at(t) + all_[i].body() + " is released after a pull of " +
                    text::print_rounded(t - records_[i].begin) + " s with at most " +
                    text::print_rounded(records_[i].greatest, 3) + " N");
  }
  for (const Pull& p : now)
    if (std::none_of(all_.begin(), all_.end(), [&](const Pull& old) { return old.is_of(p); }))
      notes.push_back(note_at(t) + p.body() + " is pulled from outside (run.pull)");
  all_ = std::move(now);
  records_ = std::move(records);
  return true;
}

void PullsInForce::report(std::size_t i, const Vec3& at, double force) {
  records_[i].greatest = std::max(records_[i].greatest, force);
  const std::lock_guard lock(state_->mutex);
  for (Pulls::Shown& s : state_->all)
    if (s.pull.is_of(all_[i])) s.at = at, s.force = force;
}

void PullsInForce::drop(std::size_t i, double t, std::vector<std::string>& notes) {
  notes.push_back(note_at(t) + all_[i].body() +
                  " is not pulled any more: it is missing, or forces do not move it");
  {
    const std::lock_guard lock(state_->mutex);
    std::erase_if(state_->all, [&](const Pulls::Shown& s) { return s.pull.is_of(all_[i]); });
  }
  all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(i));
  records_.erase(records_.begin() + static_cast<std::ptrdiff_t>(i));
}

PullSpring::PullSpring(const Pull& pull, double mass, double least_mass, double dt) {
  stiffness = pull.stiffness > 0 ? pull.stiffness : kPullRate * mass;
  damping = 2 * std::sqrt(stiffness * mass);
  most = pull.force > 0 ? pull.force : kPullWeights * kEarth * mass;
  if (!(dt > 0)) return;
  // Explicit steps: a spring that is too hard, or damped too much, would make the body swing ever
  // more.
  stiffness = std::min(stiffness, 0.25 * least_mass / (dt * dt));
  damping = std::min(damping, 0.5 * least_mass / dt);
}

Vec3 PullSpring::force(const Vec3& at, const Vec3& velocity, const Vec3& to) const {
  Vec3 out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = stiffness * (to[i] - at[i]) - damping * velocity[i];
  const double size = spatial::norm(out);
  return size > most ? spatial::scale(out, most / size) : out;
}

double least_mass_at(const MassProperties& body, const Vec3& point) {
  const Sym3& s = body.inertia;
  Eigen::Matrix3d inertia;
  inertia << s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz;
  const Vec3 arm = spatial::sub(point, body.com);
  Eigen::Matrix3d cross;
  cross << 0, -arm[2], arm[1], arm[2], 0, -arm[0], -arm[1], arm[0], 0;
  // The trace is at least the greatest eigenvalue of the point's mobility.
  const double turning = (cross.transpose() * inertia.inverse() * cross).trace();
  return 1 / (1 / body.mass + std::max(0.0, turning));
}

}  // namespace robomosp::sim
