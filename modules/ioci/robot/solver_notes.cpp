// SPDX-License-Identifier: Apache-2.0
// Says which solver of inverse kinematics serves a robot that names none, when the robot comes and
// when an edit changes it.
#include <algorithm>
#include <optional>
#include <string>
#include <variant>

#include "ioci/core/commands.h"
#include "ioci/core/room_parts.h"
#include "robotics/build_model.h"
#include "sim/ik_choice.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

/// The solver of a robot that names none; nothing for others, and where the robot cannot be built.
std::optional<sim::AutomaticIk> automatic(const Registry& registry,
                                          const document::RecordPtr& record) {
  const Robot* r = record ? std::get_if<Robot>(&record->body) : nullptr;
  if (!r || !r->ik.name.empty() || !r->ik.params.empty()) return std::nullopt;
  // No closed form serves more, and long chains are edited often.
  constexpr std::ptrdiff_t kMostMoving = 64;
  const auto moves = [](const model::Link& l) { return l.joint != model::JointKind::fixed; };
  if (std::count_if(r->links.begin(), r->links.end(), moves) > kMostMoving) return std::nullopt;
  const auto built = robotics::build_robot_model(record->name, *r, {}, {0, 0, -9.81});
  if (!built.ok()) return std::nullopt;
  auto chosen = sim::automatic_ik(registry, *built);
  if (!chosen.ok()) return std::nullopt;
  return std::move(*chosen);
}

void note(Application& app, const document::RecordChange& change) {
  if (!change.after || !std::holds_alternative<Robot>(change.after->body)) return;
  const auto now = automatic(app.registry, change.after);
  if (!now) return;
  const auto before = automatic(app.registry, change.before);
  if (before && before->provider == now->provider) return;
  std::string said = "robot " + text::quote(change.after->name) +
                     " names no solver: its inverse "
                     "kinematics are ";
  std::string why;
  for (const std::string& refusal : now->refusals) why += (why.empty() ? "" : "; ") + refusal;
  if (now->is_closed_form) {
    said += (before ? "now solved in closed form by " : "solved in closed form by ") +
            text::quote(now->provider) + ". Another choice: robot.set{ik = ...}.";
  } else if (before && before->is_closed_form) {
    said += "now searched for by " + text::quote(now->provider) + ", as " +
            text::quote(before->provider) + " no longer serves it" +
            (why.empty() ? "" : " (" + why + ")") + ".";
  } else if (!why.empty()) {
    said +=
        "searched for by " + text::quote(now->provider) + "; no closed form fits (" + why + ").";
  } else {
    return;
  }
  app.messages.post(Severity::info, "ik_choice", said, "ioci");
}

/// Posts a message after each commit, undo and load that makes a robot with another solver than
/// before; `ik` given by name is left alone.
void follow_ik_choices(Application& app) {
  app.document.on_commit([&app](const document::Commit& commit) {
    if (commit.kind == document::CommitKind::save) return;
    for (const document::RecordChange& change : commit.records) note(app, change);
  });
}

const RoomFile kSolverNotesPart({.document_started = follow_ik_choices});

}  // namespace
}  // namespace robomosp::ioci
