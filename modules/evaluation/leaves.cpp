// SPDX-License-Identifier: Apache-2.0
#include "evaluation/leaves.h"

#include <utility>

#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

constexpr std::size_t kMostLeaves = 100'000;  ///< solids in one object, nested ones included

using document::Snapshot;
using model::Record;

/// A part that is still to be resolved.
struct Step {
  AnyId what;
  Pose placement;
  MaterialId material;
  std::string name;
  std::optional<std::size_t> group;
  std::optional<std::size_t> measured = std::nullopt;
  bool is_asked_for = false;  ///< its own measured mass is the caller's affair
};

/// Resolves the steps, last first; numbers of groups begin at `groups`.
Result<std::vector<Leaf>> resolve(const Snapshot& s, std::vector<Step> stack, std::size_t groups,
                                  std::vector<MeasuredPart>& measured, AnyId whole) {
  std::vector<Leaf> leaves;
  std::size_t steps = 0;
  while (!stack.empty()) {
    Step step = std::move(stack.back());
    stack.pop_back();
    if (++steps > kMostLeaves || leaves.size() >= kMostLeaves)
      return error(
          ErrorCode::unsupported,
          "it has more than " + std::to_string(kMostLeaves) + " parts, nested ones included",
          "Split it into smaller objects.", s.describe(whole));
    const Record* record = s.find(step.what);
    if (!record) return stale(s, step.what);
    const auto* mass = measured_of(*record);
    if (!step.is_asked_for && mass && mass->has_value() && !step.measured) {
      step.measured = measured.size();
      measured.push_back({step.what, step.placement, **mass});
    }
    if (const auto* solid = std::get_if<model::Solid>(&record->body)) {
      leaves.push_back({SolidId{step.what.number}, step.placement,
                        step.material ? step.material : solid->material,
                        step.name.empty() ? record->name : std::move(step.name),
                        step.group ? *step.group : groups++, step.measured});
      continue;
    }
    const auto* object = std::get_if<model::Object>(&record->body);
    if (!object)
      return error(ErrorCode::invalid_argument,
                   s.describe(step.what) + " is neither a solid nor an object");
    if (!step.group && object->overlap == model::Overlap::once) step.group = groups++;
    for (auto p = object->parts.rbegin(); p != object->parts.rend(); ++p)
      stack.push_back({p->what, spatial::compose(step.placement, model::pose(p->placement)),
                       step.material ? step.material : p->material,
                       step.name.empty() ? p->name : step.name + "." + p->name, step.group,
                       step.measured});
  }
  return leaves;
}

}  // namespace

Error stale(const Snapshot& s, AnyId id) {
  return error(ErrorCode::stale_handle, s.describe(id) + " does not exist",
               "Look it up again by its name.");
}

const std::optional<model::MeasuredMass>* measured_of(const Record& record) {
  if (const auto* solid = std::get_if<model::Solid>(&record.body)) return &solid->measured;
  if (const auto* object = std::get_if<model::Object>(&record.body)) return &object->measured;
  return nullptr;
}

Result<std::vector<Leaf>> leaves_of(const Snapshot& s, AnyId id,
                                    std::vector<MeasuredPart>& measured) {
  return resolve(s, {{id, {}, {}, "", std::nullopt, std::nullopt, true}}, 0, measured, id);
}

Result<std::vector<Leaf>> leaves_of(const Snapshot& s, std::span<const model::BodyPart> parts,
                                    std::vector<MeasuredPart>& measured) {
  std::vector<Step> stack;
  for (std::size_t i = parts.size(); i-- > 0;) {
    const model::BodyPart& p = parts[i];
    const Record* record = s.find(p.what);
    const auto* object = record ? std::get_if<model::Object>(&record->body) : nullptr;
    std::optional<std::size_t> group = 0;
    if (object && object->overlap == model::Overlap::sum) group.reset();
    stack.push_back({p.what, model::pose(p.placement), {}, "", group});
  }
  return resolve(s, std::move(stack), 1, measured, parts.empty() ? AnyId{} : parts.front().what);
}

Result<std::vector<Leaf>> leaves_of(const Snapshot& s, AnyId id) {
  std::vector<MeasuredPart> measured;
  return leaves_of(s, id, measured);
}

}  // namespace robomosp::evaluation
