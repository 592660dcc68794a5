// SPDX-License-Identifier: Apache-2.0
#include "ioci/schema/member_choices.h"

#include <string>

#include "ioci/core/commands.h"
#include "kernel/interface_file.h"
#include "kernel/text.h"
#include "model/data.h"
#include "robotics/tip_names.h"

namespace robomosp::ioci {
namespace {

constexpr ListMember kListMembers[] = {
    {"link", Kind::robot, "links"},
    {"link_or_base", Kind::robot, "links"},
    {"pose", Kind::robot, "poses"},
    {"tool", Kind::robot, "tools"},
    {"attached", Kind::robot, "attached"},
    {"loop", Kind::robot, "loops"},
    {"axis", Kind::robot, "axes"},
    {"robot", Kind::world, "robots"},
    {"object", Kind::world, "objects"},
    {"trajectory", Kind::world, "trajectories"},
    {"frame", Kind::world, "frames"},
    {"light", Kind::world, "lights"},
    {"task", Kind::world, "tasks"},
    {"program", Kind::world, "programs"},
    {"signal", Kind::world, "signals"},
    {"node", Kind::solid, "nodes"},
    {"part", Kind::object, "parts"},
    {"tcp", Kind::object, "tcps"},
    {"segment", Kind::trajectory, "segments"},
    {"step", Kind::task, "steps"},
};

void add_joints(CommandContext&, const model::Record& r, ChoiceList& out) {
  const auto& robot = std::get<model::Robot>(r.body);
  for (const model::Link& l : robot.links) {
    if (out.is_full()) return;
    if (l.joint == model::JointKind::fixed) continue;
    Choice* c = out.add(l.name, model::kJointWords[static_cast<std::size_t>(l.joint)]);
    if (c && l.mimic && l.mimic->link >= 0 &&
        static_cast<std::size_t>(l.mimic->link) < robot.links.size())
      c->why_not = "It follows the joint of link " +
                   text::quote(robot.links[static_cast<std::size_t>(l.mimic->link)].name) + ".";
  }
}

void add_tips(CommandContext&, const model::Record& r, ChoiceList& out) {
  robotics::each_tip_name(std::get<model::Robot>(r.body), [&out](std::string_view name) {
    out.add(name);
    return !out.is_full();
  });
}

void add_links_and_tools(CommandContext&, const model::Record& r, ChoiceList& out) {
  for (const char* list : {"tools", "attached", "links"}) add_list(r, list, out);
}

void add_robot_bodies(const model::Robot& robot, std::string prefix, ChoiceList& out) {
  const std::size_t own = prefix.size();
  const auto add = [&](std::string_view name) {
    prefix.resize(own);
    prefix += name;
    out.add(prefix);
  };
  add("base");
  for (const model::Link& l : robot.links) {
    if (out.is_full()) return;
    add(l.name);
  }
  for (const model::AttachedTool& t : robot.attached) add(t.name);
}

/// Bodies of a robot; of a world its objects and robots, and each robot's as `robot.link`.
void add_bodies(CommandContext& ctx, const model::Record& r, ChoiceList& out) {
  if (const auto* robot = std::get_if<model::Robot>(&r.body)) {
    add_robot_bodies(*robot, "", out);
    return;
  }
  const auto* world = std::get_if<model::World>(&r.body);
  if (!world) return;
  add_list(r, "objects", out);
  add_list(r, "robots", out);
  for (const model::PlacedRobot& p : world->robots) {
    if (out.is_full()) return;
    if (const auto* robot = ctx.snapshot().get(p.robot))
      add_robot_bodies(*robot, p.name + ".", out);
  }
}

void add_members(CommandContext&, const model::Record& r, ChoiceList& out) {
  for (const ListMember& m : kListMembers)
    if (m.kind == Kind::world) add_list(r, m.list, out, m.word);
}

void add_parameters(CommandContext&, const model::Record& r, ChoiceList& out) {
  if (const model::Parametric* own = model::parametric_of(r.body))
    for (const model::Parameter& p : own->parameters) {
      if (out.is_full()) return;
      out.add(p.name, p.description);
    }
}

constexpr RecordMember kRecordMembers[] = {
    {"joint", "robot", add_joints},
    {"tip", "robot", add_tips},
    {"link_or_tool", "robot", add_links_and_tools},
    {"body", "robot|world", add_bodies},
    {"member", "world", add_members},
    {"parameter", "material|solid|object|robot|trajectory|world|task", add_parameters},
};

void add_commands(CommandContext& ctx, ChoiceList& out) {
  for (const CommandSpec* spec : ctx.app.commands.list()) out.add(spec->name, spec->summary);
}
void add_kinds(CommandContext&, ChoiceList& out) {
  for (const Kind k : all_kinds()) out.add(to_string(k));
}
void add_interfaces(CommandContext&, ChoiceList& out) {
  constexpr std::string_view kPrefix = "robomosp.";
  for (const InterfaceEntry* entry : InterfaceFile::all()) {
    std::string word = entry->id.substr(0, entry->id.find('/'));
    if (word.starts_with(kPrefix)) word.erase(0, kPrefix.size());
    out.add(word, entry->id);
  }
}
void add_modules(CommandContext& ctx, ChoiceList& out) {
  for (const ProviderInfo& p : ctx.app.registry.list("robomosp.module/1"))
    out.add(p.name, p.summary);
}
void add_settings(CommandContext& ctx, ChoiceList& out) {
  const auto listed = ctx.dispatch("plugin.settings", {});
  if (!listed.ok() || !listed->as_list()) return;
  for (const Value& each : *listed->as_list()) {
    const Map* m = each.as_map();
    const Value* name = m ? m->find("setting") : nullptr;
    const Value* plugin = m ? m->find("plugin") : nullptr;
    if (name && plugin) out.add_value(*name, "Of plugin " + plugin->text() + ".");
  }
}

constexpr ProgramMember kProgramMembers[] = {
    {"command", add_commands}, {"kind", add_kinds},       {"interface", add_interfaces},
    {"module", add_modules},   {"setting", add_settings},
};

}  // namespace

std::span<const ListMember> list_members() { return kListMembers; }
std::span<const RecordMember> record_members() { return kRecordMembers; }
std::span<const ProgramMember> program_members() { return kProgramMembers; }

void add_list(const model::Record& r, std::string_view list, ChoiceList& out,
              std::string_view doc) {
  const model::Content content = model::content(r.body);
  const model::Field* field = content.type->field(list);
  if (!field) return;
  const void* elements = field->in(content.data);
  const std::size_t count = field->type->length(elements);
  for (std::size_t i = 0; i < count && !out.is_full(); ++i) {
    const std::string* name = model::name_of(*field->type->element, field->type->at(elements, i));
    if (name) out.add(*name, doc);
    else out.add_value(Value(static_cast<std::int64_t>(i + 1)), doc);
  }
}

}  // namespace robomosp::ioci
