// SPDX-License-Identifier: Apache-2.0
#include "scene/build.h"

#include <utility>

#include "scene/frame.h"
#include "scene/scene_model.h"

namespace robomosp::scene {

Result<Built> build(const Source& source, AnyId id, const Extras& extras, Progress& progress,
                    MotionPtr motion) {
  SceneModel model(source.derived, source.registry, id, source.collision_models);
  Wanted wanted;
  wanted.snapshot = std::make_shared<const document::Snapshot>(source.snapshot);
  wanted.extras = extras;
  wanted.motion = std::move(motion);
  RMP_TRY_ASSIGN(const FramePtr frame, model.update(wanted, Detail::exact, progress));
  auto built = built_of(*frame, extras.explode);
  if (built.ok()) built->frame = frame;
  return built;
}

Result<Built> built_of(const Frame& frame, double explode_by) {
  if (frame.failure) return *frame.failure;
  Built out;
  std::vector<std::size_t> group_of;
  const bool is_exploded = explode_by > 0;
  out.scene = to_scene(frame, is_exploded ? &group_of : nullptr);
  if (is_exploded) explode(out.scene, group_of, explode_by);
  out.left_out = left_out(frame);
  return out;
}

}  // namespace robomosp::scene
