// SPDX-License-Identifier: Apache-2.0
// The table of kinds.
#include <array>
#include <atomic>
#include <mutex>

#include "kernel/check.h"
#include "model/declare.h"
#include "model/records.h"

namespace robomosp {

namespace {

constexpr std::size_t kMostKinds = 32;  ///< as many as bits in Snapshot::State::bit()

/// Only grows, so that readers need no lock: `count` is stored after the row it counts.
struct KindTable {
  std::array<model::KindInfo, kMostKinds> rows;
  std::array<Kind, kMostKinds> kinds;
  std::atomic<std::size_t> count{0};
  std::mutex adding;

  KindTable() {
    using namespace model;
    add({"material", ".mtr", "materials", &type_of<Material>()});
    add({"solid", ".csg", "parts", &type_of<Solid>()});
    add({"object", ".part", "parts", &type_of<Object>()});
    add({"robot", ".rbt", "robots", &type_of<Robot>()});
    add({"trajectory", ".tjc", "trajectories", &type_of<Trajectory>()});
    add({"world", ".wld", "worlds", &type_of<World>()});
    add({"task", ".tsk", "tasks", &type_of<Task>()});
  }
  Kind add(const model::KindInfo& row) {
    const std::size_t n = count.load(std::memory_order_relaxed);
    RMP_CHECK(n < kMostKinds, "there are too many kinds of records");
    rows[n] = row;
    kinds[n] = static_cast<Kind>(n);
    count.store(n + 1, std::memory_order_release);
    return kinds[n];
  }
};

KindTable& table() {
  static KindTable kinds;
  return kinds;
}

}  // namespace

std::span<const Kind> all_kinds() {
  const KindTable& t = table();
  return {t.kinds.data(), t.count.load(std::memory_order_acquire)};
}

std::string_view to_string(Kind k) {
  const KindTable& t = table();
  const auto i = static_cast<std::size_t>(k);
  return i < t.count.load(std::memory_order_acquire) ? t.rows[i].name : "record";
}

std::optional<Kind> kind_from(std::string_view word) {
  const KindTable& t = table();
  const std::size_t count = t.count.load(std::memory_order_acquire);
  for (std::size_t i = 0; i < count; ++i)
    if (t.rows[i].name == word) return static_cast<Kind>(i);
  return std::nullopt;
}

namespace model {

// What is treated in a way of its own somewhere.
template const Type& type_of<Placement>();
template const Type& type_of<Parametric>();
template const Type& type_of<MassProperties>();
template const Type& type_of<MeasuredMass>();
template const Type& type_of<ProviderChoice>();
template const Type& type_of<CsgProfile>();
template const Type& type_of<SolidNode>();
template const Type& type_of<Material>();
template const Type& type_of<Solid>();
template const Type& type_of<Object>();
template const Type& type_of<ObjectPart>();
template const Type& type_of<Robot>();
template const Type& type_of<Trajectory>();
template const Type& type_of<World>();
template const Type& type_of<Link>();
template const Type& type_of<PlacedLight>();
template const Type& type_of<Signal>();
template const Type& type_of<NamedPose>();
template const Type& type_of<CollisionPairRule>();
template const Type& type_of<ProgramBinding>();
template const Type& type_of<PlacedRobot>();
template const Type& type_of<TrajectorySegment>();
template const Type& type_of<TaskStep>();

const KindInfo& info(Kind kind) {
  const KindTable& t = table();
  const auto i = static_cast<std::size_t>(kind);
  RMP_CHECK(i < t.count.load(std::memory_order_acquire), "a kind that nobody registered");
  return t.rows[i];
}

Kind register_kind(const KindInfo& row) {
  KindTable& t = table();
  const std::scoped_lock lock(t.adding);
  if (const auto known = kind_from(row.name)) return *known;
  return t.add(row);
}

}  // namespace model

}  // namespace robomosp
