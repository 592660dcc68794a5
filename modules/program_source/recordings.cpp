// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <span>

#include "kernel/text.h"
#include "program_source/from_records.h"
#include "program_source/source.h"
#include "spatial/passing.h"

namespace robomosp::program_source {
namespace {

using text::quote;

/// Rows whose joints, passed as a run passes targets (spatial::passing_rate), give all the others
/// within `tolerance`: of each stretch the row that is furthest off is kept, until none is.
std::vector<std::size_t> kept_rows(std::span<const recording::Column* const> q,
                                   const std::vector<double>& time, double tolerance) {
  const std::size_t rows = time.size();
  std::vector<std::size_t> kept{0};
  // Two motions at least: one alone passes nothing, and goes by another law.
  if (rows > 2) kept.push_back(rows / 2);
  if (rows > 1) kept.push_back(rows - 1);
  for (bool is_within = false; !is_within;) {
    is_within = true;
    std::vector<std::vector<double>> rates;  // of each joint, at the rows kept
    for (const recording::Column* c : q) {
      std::vector<double>& rate = rates.emplace_back(kept.size(), 0.0);
      for (std::size_t k = 1; k + 1 < kept.size(); ++k) {
        const std::size_t a = kept[k - 1], m = kept[k], b = kept[k + 1];
        rate[k] = spatial::passing_rate(c->values[m] - c->values[a], time[m] - time[a],
                                        c->values[b] - c->values[m], time[b] - time[m]);
      }
    }
    std::vector<std::size_t> next{0};
    for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
      const std::size_t a = kept[k], b = kept[k + 1];
      double worst = tolerance;
      std::size_t at = 0;
      for (std::size_t i = a + 1; i < b; ++i)
        for (std::size_t j = 0; j < q.size(); ++j) {
          const std::vector<double>& v = q[j]->values;
          const double way = spatial::cubic(v[b] - v[a], rates[j][k], rates[j][k + 1],
                                            time[b] - time[a], time[i] - time[a])
                                 .v;
          const double off = std::fabs(v[i] - v[a] - way);
          if (off > worst) worst = off, at = i;
        }
      if (at != 0) next.push_back(at), is_within = false;
      next.push_back(b);
    }
    kept = std::move(next);
  }
  return kept;
}

}  // namespace

Result<WrittenProgram> from_recording(const evaluation::Sources& from,
                                      const recording::Recording& r, const std::string& wanted,
                                      double tolerance, const std::string& name,
                                      Progress& progress) {
  const model::World* w = from.snapshot.get(r.world);
  if (!w)
    return error(ErrorCode::stale_handle, "the world of the recording no longer exists",
                 "Use a recording of an open world.", "recording");
  std::string robot = wanted.empty() ? r.robot : wanted;
  if (robot.empty() && w->robots.size() == 1) robot = w->robots[0].name;
  if (robot.empty())
    return error(ErrorCode::invalid_argument, "the recording contains several robots",
                 "Name it: robot = ...", "robot");
  RMP_TRY_ASSIGN(const Arm arm, arm_named(from, r.world, robot, progress));
  const recording::Column* time = r.find("time");
  std::vector<const recording::Column*> q;
  for (std::size_t j = 1; j <= arm.model->joints.size(); ++j) {
    const std::string column = "q" + std::to_string(j);
    const recording::Column* c = r.robot == robot ? r.find(column) : nullptr;
    if (!c) c = r.find(robot + "." + column);
    if (c) q.push_back(c);
  }
  if (!time || time->values.empty() || q.size() != arm.model->joints.size())
    return error(ErrorCode::invalid_argument,
                 "the recording lacks joints of robot " + quote(robot) + " over the time",
                 "Simulate it again, or name another robot.", "recording");
  for (std::size_t i = 0; i < time->values.size(); ++i)
    for (const recording::Column* c : q)
      if (!std::isfinite(c->values[i]))
        return error(
            ErrorCode::invalid_argument,
            "row " + std::to_string(i + 1) + " of the recording has no number in " + quote(c->name),
            "Use a recording without gaps.", "recording");
  for (std::size_t i = 1; i < time->values.size(); ++i)
    if (!(time->values[i] > time->values[i - 1]))
      return error(
          ErrorCode::invalid_argument,
          "row " + std::to_string(i + 1) + " of the recording is not later than the previous one",
          "Use a recording with increasing times.", "recording");
  Source source(arm);
  source.body.in();
  const std::vector<std::size_t> rows = kept_rows(q, time->values, tolerance);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::vector<double> at;
    for (const recording::Column* c : q) at.push_back(c->values[rows[k]]);
    RMP_TRY_ASSIGN(const std::string to, source.joints(at));
    std::string line = "MOVE PTP " + to;
    if (k > 0) {
      line += " TIME := " + irl_real(time->values[rows[k]] - time->values[rows[k - 1]]);
      if (k + 1 < rows.size()) line += " C_PASS := TRUE";
    }
    source.body.add(line + ";");
  }
  source.note(std::to_string(rows.size()) + " of " + std::to_string(time->values.size()) +
              " rows are kept and passed without a stop; the joints stay within " +
              irl_real(kDegreesPerRadian * tolerance) + " degrees (" + irl_real(kMm * tolerance) +
              " mm of sliding joints) of the others.");
  const std::string title = r.title.empty() ? "recording" : r.title;
  return finished(source, name.empty() ? robot + " recorded" : name, "Of the recording " + title,
                  {}, {});
}

}  // namespace robomosp::program_source
