// SPDX-License-Identifier: Apache-2.0
#include "ioci/view/run_motion.h"

#include <memory>
#include <utility>

#include "kernel/text.h"

namespace robomosp::ioci {

Result<scene::MotionPtr> run_motion(const document::Snapshot& snapshot, AnyId subject,
                                    const LiveRunEntry& run) {
  if (run.subject.kind != to_string(subject.kind) || run.subject.number != subject.number)
    return error(ErrorCode::invalid_argument,
                 "the run " + text::quote(run.title) + " is not of " + snapshot.describe(subject),
                 "Give the " + run.subject.kind + " that it simulates.", "run");
  const sim::LiveRun::Shown shown = run.run->shown();
  recording::Recording row = run.run->head();
  if (row.columns.empty() || shown.values.size() < row.columns.size()) return scene::MotionPtr();
  for (std::size_t c = 0; c < row.columns.size(); ++c) row.columns[c].values = {shown.values[c]};
  RMP_TRY_ASSIGN(scene::Motion motion,
                 subject.kind == Kind::robot
                     ? scene::motion_at(snapshot, RobotId{subject.number}, row, shown.time)
                     : scene::motion_at(snapshot, WorldId{subject.number}, row, shown.time));
  return scene::MotionPtr(std::make_shared<const scene::Motion>(std::move(motion)));
}

}  // namespace robomosp::ioci
