// SPDX-License-Identifier: Apache-2.0
#include "ioci/view/run_motion.h"

#include <memory>
#include <utility>

#include "kernel/text.h"

namespace robomosp::ioci {

Result<scene::MotionPtr> run_motion(const document::Snapshot& snapshot, AnyId world,
                                    const LiveRunEntry& run) {
  if (world.kind != Kind::world || run.subject.kind != "world" ||
      run.subject.number != world.number)
    return error(ErrorCode::invalid_argument,
                 "the run " + text::quote(run.title) + " is not of " + snapshot.describe(world),
                 "Give the world that it simulates.", "run");
  const sim::LiveRun::Shown shown = run.run->shown();
  recording::Recording row = run.run->head();
  if (row.columns.empty() || shown.values.size() < row.columns.size()) return scene::MotionPtr();
  for (std::size_t c = 0; c < row.columns.size(); ++c) row.columns[c].values = {shown.values[c]};
  RMP_TRY_ASSIGN(scene::Motion motion,
                 scene::motion_at(snapshot, WorldId{world.number}, row, shown.time));
  return scene::MotionPtr(std::make_shared<const scene::Motion>(std::move(motion)));
}

}  // namespace robomosp::ioci
