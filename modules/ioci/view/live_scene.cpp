// SPDX-License-Identifier: Apache-2.0
// The scene of a record for programs that draw it themselves and follow it, such as the page of the
// server: what changed since they asked last.
#include <memory>
#include <set>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/core/runs.h"
#include "ioci/view/followed_scenes.h"
#include "ioci/view/picture.h"
#include "ioci/view/run_motion.h"
#include "kernel/base64.h"
#include "scene/build.h"
#include "scene/frame.h"
#include "scene/replay.h"

namespace robomosp::ioci {
namespace {

/// Kept with the application.
struct ShownMeshes {
  explicit ShownMeshes(Application&) {}
  scene::MeshKeys keys;
};

Result<Value> scene_of(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "what");
  RMP_TRY_ASSIGN(const render::Camera camera, read_camera(args));
  std::set<std::string> kept;
  if (const Value* given = args.find("meshes"); given && given->as_list())
    for (const Value& key : *given->as_list()) {
      if (!key.as_string())
        return error(ErrorCode::invalid_argument, "a key of a mesh must be a text",
                     "Give keys from the header of a scene.", "meshes");
      kept.insert(*key.as_string());
    }
  scene::MotionPtr motion;
  if (has(args, "run")) {
    const Handle& run = *args.find("run")->as_handle();
    const LiveRunPtr found = ctx.app.runs->find(run.number);
    if (!found) throw StaleHandle{run};
    RMP_TRY_ASSIGN(motion, run_motion(ctx.snapshot(), id, *found));
  }
  RMP_TRY_ASSIGN(const scene::FramePtr frame,
                 ctx.app.kept<FollowedScenes>().frame(ctx, id, {}, std::move(motion)));
  RMP_TRY_ASSIGN(const scene::Built built, scene::built_of(*frame, 0));
  scene::SceneData data = scene::scene_data(built.scene, camera, ctx.app.kept<ShownMeshes>().keys,
                                            has(args, "known") ? text_of(args, "known") : "", kept);
  const std::size_t rows = data.poses.size() / 7;
  Map out{{"shape", data.shape},
          {"poses", rows ? NumericArray(std::move(data.poses), rows, 7) : NumericArray()}};
  if (!data.header.empty()) {
    std::string bytes;
    base64::append(bytes, data.bytes);
    List left_out;
    for (const std::string& sentence : built.left_out) left_out.emplace_back(sentence);
    out.set("header", std::move(data.header));
    out.set("bytes", std::move(bytes));
    out.set("left_out", std::move(left_out));
  }
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(live_scene_commands) {
  CommandSpec c;
  c.name = "view.scene";
  c.summary = "Returns a scene to a program that draws it: all of it, or only the changes.";
  c.details =
      "The header lists bodies, meshes, frames, lines and lights as JSON; the bytes hold their "
      "numbers in the format of modules/scene/replay.h, for the scripts in modules/scene/replay. A "
      "caller that names the shape it has gets only the poses as long as nothing else changed, and "
      "otherwise no mesh that it already keeps.";
  c.example =
      "local plate = solid.create{name = \"plate\", root = {kind = \"box\", x = 0.2, y = 0.1, z = "
      "0.02}}\n"
      "local cell = world.create{name = \"cell\"}\n"
      "cell:add_object{name = \"plate\", what = plate}\n"
      "local all = view.scene{what = cell}\n"
      "assert(#all.header > 100 and #all.poses == 1)\n"
      "cell:place{member = \"plate\", position = {0, 0, 1}}\n"
      "local moved = view.scene{what = cell, known = all.shape}\n"
      "assert(not moved.header and moved.poses[1][3] == 1)";
  c.params = {needed("what", "ref:world|robot|object|solid|material", "", "The record to draw."),
              optional("known", "string", "", "The shape that was returned last."),
              optional("meshes", "list", "",
                       "Keys of the meshes that the caller keeps, from earlier headers."),
              optional("run", "ref:run", "",
                       "A run of the world, which is shown at the run's present time.")};
  for (ParamSpec& p : camera_params()) c.params.push_back(std::move(p));
  c.returns = {
      "map",
      "",
      "",
      {field("shape", "string", "", "Identifies everything except the poses."),
       field("poses", "array", "",
             "x, y, z [m], qw, qx, qy, qz of each body of the header, then of each frame."),
       field("header", "string", "", "JSON; absent if the caller has this shape."),
       field("bytes", "string", "", "The numbers as base64; absent with the header."),
       field("left_out", "list", "",
             "Sentences about items that could not be shown; absent with the header.")}};
  c.effect = Effect::reads;
  c.run = scene_of;
  std::vector<CommandSpec> all;
  all.push_back(std::move(c));
  return all;
}

}  // namespace robomosp::ioci
