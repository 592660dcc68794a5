// SPDX-License-Identifier: Apache-2.0
#include "sim/measured_motion.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "kernel/text.h"
#include "sim/recording_columns.h"

namespace robomosp::sim {

using recording::Column;
using recording::Recording;

Result<Fitted> fit_parabolas(const std::vector<double>& time, const std::vector<double>& values,
                             double window) {
  constexpr std::size_t kFewest = 5;
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::size_t n = time.size();
  Fitted out{std::vector<double>(n, none), std::vector<double>(n, none),
             std::vector<double>(n, none)};
  const double half = window / 2;
  std::size_t first = 0, end = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (time[first] < time[i] - half) ++first;
    while (end < n && time[end] <= time[i] + half) ++end;
    if (end - first > kMostInWindow)
      return error(ErrorCode::invalid_argument,
                   "a window of " + text::print_rounded(window) + " s holds " +
                       std::to_string(end - first) + " samples, more than " +
                       std::to_string(kMostInWindow),
                   "Give a shorter one.", "window");
    // Sums of powers of u, which is -1 to 1 within the window, and of them times the values.
    double s[5] = {}, r[3] = {};
    std::size_t count = 0;
    for (std::size_t k = first; k < end; ++k) {
      if (!std::isfinite(values[k])) continue;
      ++count;
      const double u = (time[k] - time[i]) / half;
      double power = 1;
      for (int p = 0; p < 5; ++p, power *= u) {
        s[p] += power;
        if (p < 3) r[p] += power * values[k];
      }
    }
    if (count < kFewest) continue;
    // Cramer's rule for the 3 normal equations.
    const auto det = [](const double(&m)[3][3]) {
      return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
             m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    const double whole[3][3] = {{s[0], s[1], s[2]}, {s[1], s[2], s[3]}, {s[2], s[3], s[4]}};
    const double d = det(whole);
    if (!(std::fabs(d) > 1e-12 * s[0] * s[0] * s[0])) continue;
    double c[3];
    for (int column = 0; column < 3; ++column) {
      double m[3][3];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) m[a][b] = b == column ? r[a] : whole[a][b];
      c[column] = det(m) / d;
    }
    out.value[i] = c[0];
    out.rate[i] = c[1] / half;
    out.second[i] = 2 * c[2] / (half * half);
  }
  return out;
}

Result<recording::RecordingPtr> torques_of_motion(const Simulator& sim, const Recording& measured,
                                                  double window, Progress& progress,
                                                  const std::optional<TipLoad>& load) {
  const Column* const time = measured.find("time");
  if (!time)
    return error(ErrorCode::invalid_argument, "the recording has no time",
                 "Accelerations need a column \"time\".");
  Recording motion;
  motion.title = measured.title + ": torques of the model";
  motion.world = measured.world;
  motion.robot = measured.robot;
  motion.dof = measured.dof;
  motion.loads = measured.loads;
  motion.columns.push_back(*time);
  const auto put = [&](std::string name, std::string unit, std::vector<double> values) {
    motion.columns.push_back({std::move(name), std::move(unit), "", std::move(values)});
  };
  for (std::size_t k = 1;; ++k) {
    const std::string n = std::to_string(k);
    const Column* const q = measured.find("q" + n);
    if (!q) break;
    const Column* const qd = measured.find("qd" + n);
    const Column* const qdd = measured.find("qdd" + n);
    if (!(window > 0)) {
      for (const Column* c : {q, qd, qdd})
        if (c) motion.columns.push_back(*c);
      continue;
    }
    RMP_TRY_ASSIGN(Fitted of_q, fit_parabolas(time->values, q->values, window));
    std::vector<double> rate = std::move(of_q.rate), second = std::move(of_q.second);
    if (qd) {
      RMP_TRY_ASSIGN(Fitted of_qd, fit_parabolas(time->values, qd->values, window));
      rate = std::move(of_qd.value);
      second = std::move(of_qd.rate);
    }
    if (qdd) {
      RMP_TRY_ASSIGN(Fitted of_qdd, fit_parabolas(time->values, qdd->values, window));
      second = std::move(of_qdd.value);
    }
    put("q" + n, q->unit, std::move(of_q.value));
    put("qd" + n, q->unit + "/s", std::move(rate));
    put("qdd" + n, q->unit + "/s^2", std::move(second));
    if (progress.cancelled()) return error(ErrorCode::cancelled, "the torques were not computed");
  }
  for (std::size_t k = 1; k <= 6; ++k)
    if (const Column* const c = measured.find("wrench" + std::to_string(k)))
      motion.columns.push_back(*c);
  if (const Column* const c = measured.find(recording::kApproachColumn))
    motion.columns.push_back(*c);
  const std::string torque = "torque";
  return with_quantities(sim, motion, std::span(&torque, 1), progress, load);
}

}  // namespace robomosp::sim
