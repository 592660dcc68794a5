// SPDX-License-Identifier: Apache-2.0
#include "document/world_index.h"

#include <utility>

#include "document/state.h"

namespace robomosp::document {

WorldIndex::WorldIndex(const model::World& world) {
  const auto add = [this](MemberList list, const auto& members) {
    auto& at = at_[static_cast<std::size_t>(list)];
    at.reserve(members.size());
    for (std::size_t i = 0; i < members.size(); ++i) at.emplace(members[i].name, i);
  };
  add(MemberList::objects, world.objects);
  add(MemberList::robots, world.robots);
  add(MemberList::trajectories, world.trajectories);
  add(MemberList::frames, world.frames);
  add(MemberList::lights, world.lights);
  add(MemberList::tasks, world.tasks);
  add(MemberList::programs, world.programs);
  add(MemberList::signals, world.signals);
}

std::optional<std::size_t> WorldIndex::find(MemberList list, std::string_view name) const {
  const auto& at = at_[static_cast<std::size_t>(list)];
  const auto found = at.find(name);
  return found == at.end() ? std::nullopt : std::optional(found->second);
}

std::shared_ptr<const WorldIndex> world_index(const Snapshot& snapshot, WorldId id) {
  const std::shared_ptr<WorldNames> names = names_of(snapshot, AnyId(id));
  if (!names) return nullptr;
  std::call_once(names->once,
                 [&] { names->index.emplace(std::get<model::World>(names->record->body)); });
  return {names, &*names->index};
}

}  // namespace robomosp::document
