// SPDX-License-Identifier: Apache-2.0
// Source code of a robot's kinematics and dynamics, by providers of robomosp.robot_code/1.
#include <algorithm>
#include <filesystem>

#include <robomosp/sdk/model_file.h>
#include <robomosp/sdk/robot_code.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "motion/provider_params.h"

namespace robomosp::ioci {
namespace {

struct Part {
  const char* name;
  std::uint32_t bit;
};
constexpr Part kCodeParts[] = {{"forward_kinematics", kCodeForwardKinematics},
                               {"jacobian", kCodeJacobian},
                               {"inverse_dynamics", kCodeInverseDynamics},
                               {"inertia", kCodeInertia},
                               {"forward_dynamics", kCodeForwardDynamics}};

/// Parts that closed loops change, which generators without the tag `loops` do not write.
constexpr std::uint32_t kOfClosedLoops = kCodeInverseDynamics | kCodeInertia | kCodeForwardDynamics;

Result<std::uint32_t> read_code_parts(const Value* given, bool knows_loops) {
  if (!given || given->is_nil()) return knows_loops ? kCodeAll : kCodeAll & ~kOfClosedLoops;
  std::vector<std::string> known;
  for (const Part& p : kCodeParts) known.emplace_back(p.name);
  std::uint32_t parts = 0;
  for (const Value& v : *given->as_list()) {
    const std::string* name = v.as_string();
    const auto* part = std::find_if(std::begin(kCodeParts), std::end(kCodeParts),
                                    [&](const Part& p) { return name && *name == p.name; });
    if (part == std::end(kCodeParts)) return unknown_name("part", name ? *name : v.text(), known);
    parts |= part->bit;
  }
  return parts;
}

/// The robot's name as an identifier of C.
std::string identifier(const std::string& name) {
  std::string s;
  for (const char c : name) {
    const bool fits = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    s += fits ? c : '_';
  }
  return s.empty() || (s.front() >= '0' && s.front() <= '9') ? "robot_" + s : s;
}

Result<Value> generate_code(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto model, model_of(ctx, args));
  model::ProviderChoice choice;
  if (has(args, "provider")) {
    RMP_TRY_ASSIGN(choice, read_provider(*args.find("provider"), "provider"));
  }
  const std::string where = "robot " + text::quote(model->name);
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 ctx.app.registry.find(RobotCodeGenerator::kInterfaceId, choice.name));
  const bool knows_loops = model->loops.empty() || std::find(info.tags.begin(), info.tags.end(),
                                                             "loops") != info.tags.end();
  RMP_TRY_ASSIGN(const std::uint32_t parts, read_code_parts(args.find("parts"), knows_loops));
  for (const Part& p : kCodeParts)
    if (!knows_loops && (parts & kOfClosedLoops & p.bit))
      return error(ErrorCode::unsupported,
                   std::string("its ") + p.name +
                       " would be that of the tree without its closed "
                       "loops, which generator " +
                       text::quote(info.name) + " does not support",
                   "Choose the parts forward_kinematics and jacobian.", where);
  if (!knows_loops && !has(args, "parts"))
    ctx.app.messages.post(Severity::info, "open_tree",
                          where +
                              ": inverse_dynamics, inertia and forward_dynamics are left out, as "
                              "generator " +
                              text::quote(info.name) + " knows no closed loops.",
                          "ioci");
  RMP_TRY_ASSIGN(const auto generator, ctx.app.registry.create<RobotCodeGenerator>(info.name));
  RMP_TRY_ASSIGN(const auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  const std::string name = has(args, "name") ? text_of(args, "name") : identifier(model->name);
  auto files = guarded(
      info.name, [&] { return generator->generate(*model, name, parts, *params, ctx.progress); });
  if (!files.ok()) return std::move(files).error();
  const std::filesystem::path folder = text_of(args, "folder");
  List written;
  for (const CodeFile& f : *files) {
    const std::filesystem::path file = folder / f.name;
    RMP_TRY(write_named_file(ctx, file, f.text));
    written.emplace_back(file.string());
  }
  return Value(Map{{"files", std::move(written)}, {"name", name}, {"provider", info.name}});
}

Result<Value> save_model(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto model, model_of(ctx, args));
  const std::filesystem::path file = text_of(args, "file");
  RMP_TRY(write_named_file(ctx, file, model_text(*model)));
  return Value(Map{{"file", file.string()}});
}

}  // namespace

RMP_COMMANDS(robot_code_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "robot.generate_code",
       .classic = "",
       .summary = "Writes the robot's kinematics and dynamics as source code for a controller.",
       .details = "C99 without dependencies and without allocation: each function for one sample "
                  "and for batches. The robot's rows and masses are constants in the code, so "
                  "generate it again after changes. Gravity is that of an upright robot. Parts: "
                  "forward_kinematics, jacobian, inverse_dynamics, inertia, forward_dynamics; all "
                  "if omitted. For robots with closed loops the first two are functions of all "
                  "coordinates, the others those of the closed mechanism; a generator that does "
                  "not support loops leaves them out with a message.\nThe solvers `compiled` of "
                  "inverse and forward dynamics run the same code within the program.",
       .example =
           with_arm("local code = arm:generate_code{folder = \".\", name = \"example_arm\"}\n"
                    "assert(#code.files == 2)"),
       .params =
           {self("robot"), defaulted("folder", "path", "", ".", "An existing folder."),
            optional(
                "name", "string", "",
                "Prefix of all names in the code and of the files; the robot's name if omitted."),
            optional("parts", "list", "", "Names of the parts; all if omitted."),
            optional("provider", "any", "", "The generator, such as \"c99\".")},
       .returns = {"map",
                   "",
                   "",
                   {field("files", "list", "", "The files written."),
                    field("name", "string", "", "Prefix of all names."),
                    field("provider", "string", "", "The generator.")}},
       .effect = Effect::files_write,
       .run = generate_code});
  all.push_back(
      {.name = "robot.save_model",
       .classic = "",
       .summary = "Writes the mechanism that solvers receive for this robot, for the conformance "
                  "suites of the SDK.",
       .details = "Joints, bodies, drives, tips and closed loops as plain text in SI units, exact "
                  "to the bit (robomosp/sdk/model_file.h describes the format): `robomosp plugin "
                  "test FILE --model ROBOT.model` runs the suites on this robot. It is not a robot "
                  "file: record.save writes that.",
       .example = with_arm("arm:save_model{file = \"example_arm.model\"}"),
       .params = {self("robot"), needed("file", "path", "", "The file to write.")},
       .returns = {"map", "", "", {field("file", "string", "", "The file written.")}},
       .effect = Effect::files_write,
       .run = save_model});
  return all;
}

}  // namespace robomosp::ioci
