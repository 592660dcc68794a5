// SPDX-License-Identifier: Apache-2.0
// Faults as commands see them: what those of a failed call are about, the table of codes, what is
// wrong in the document now, and pictures of faults.
#include <algorithm>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "document/validate.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/failed_call.h"
#include "ioci/view/picture.h"
#include "kernel/argument_faults.h"
#include "kernel/fault.h"
#include "kernel/type.h"
#include "model/field_path.h"
#include "model/program_kinds.h"
#include "scene/build.h"
#include "scene/path_lines.h"

namespace robomosp::ioci {
namespace {

const FaultCodes kDocumentCodes{
    {"solid.failed", ErrorCode::plugin_failed, "A solid cannot be made from its nodes."},
    {"program.syntax", ErrorCode::syntax, "A program does not compile."},
    {"provider.missing", ErrorCode::unknown_name,
     "A record chooses a provider that is not loaded or not enabled."},
};

std::string fault_type() {
  return "map{code: string; message: string; class?: string; severity?: string; where?: string; "
         "hint?: string; text?: string; "
         "subject?: map{record?: ref:any; name?: string; path?: string; command?: string; "
         "argument?: string; provider?: string; interface?: string; file?: string; line?: int; "
         "column?: int; end_line?: int; end_column?: int}; "
         "extent?: map{first?: int; last?: int; worst?: int; from?: real [s]; to?: real [s]; "
         "at?: real [s]; segment?: int; step?: int; motion?: int}; "
         "witness?: map{scene?: ref:any; robot?: string; q?: real[]; "
         "joints?: list<map{name?: string; number?: int; value?: real; limit?: real; unit?: "
         "string}>; bodies?: list<string>; "
         "points?: list<map{label?: string; position: vec3 [m]}>; "
         "value?: real; limit?: real; excess?: real; unit?: string}; "
         "cause?: type:fault; "
         "remedies?: list<map{label: string; command?: string; args: map; repeats?: bool; "
         "without?: list<string>; is_tried?: bool}>}";
}
const NamedType kFaultType{"fault", "map", fault_type};

/// The name of the argument that a path begins with.
std::string_view root_of(std::string_view path) { return path.substr(0, path.find_first_of("[.")); }

/// The part of "robot.create, links[2], a" that is the path of an argument; "" = none is.
std::string argument_in(const CommandSpec& spec, std::string_view where) {
  while (!where.empty()) {
    const std::size_t end = std::min(where.find(", "), where.size());
    const std::string_view part = where.substr(0, end);
    if (part.find(' ') == std::string_view::npos && find_param(spec.params, root_of(part)))
      return std::string(part);
    where.remove_prefix(std::min(end + 2, where.size()));
  }
  return {};
}

void drop_repeats(Fault& f) {
  std::erase_if(f.remedies, [](const FaultRemedy& r) { return r.repeats; });
}

void name_argument(Fault& f, const std::string& where, const FailedCall& call) {
  FaultSubject& s = f.subject;
  if (s.argument.empty()) {
    s.argument = argument_in(call.spec, where);
    if (!s.argument.empty() && f.code == "error.invalid_argument") f.code = "argument.refused";
    return;
  }
  if (f.code == "argument.unknown" ? call.given.find(s.argument) != nullptr
                                   : find_param(call.spec.params, root_of(s.argument)) != nullptr)
    return;
  // An entry of a table in an argument, such as a parameter of a provider: it is no argument by
  // itself, and neither is what repeats the call with it.
  const std::string outer = argument_in(call.spec, where);
  s.argument = outer.empty() ? outer : outer + "." + s.argument;
  drop_repeats(f);
}

/// The record nearest in name, where it would be found.
void offer_record(Fault& f, const FailedCall& call) {
  const ParamSpec* p = find_param(call.spec.params, f.subject.argument);
  const Value* given = p ? call.given.find(p->name) : nullptr;
  if (!given || !given->as_string() || !p->type.starts_with("ref:")) return;
  const std::string_view kinds = std::string_view(p->type).substr(4);
  std::vector<std::string> known;
  for (const Kind k : all_kinds()) {
    const auto all = text::split(kinds, '|');
    if (kinds != "any" && std::find(all.begin(), all.end(), to_string(k)) == all.end()) continue;
    for (const AnyId id : call.records.list(k)) known.push_back(call.records.find(id)->name);
  }
  const auto name = text::nearest(*given->as_string(), known);
  if (!name || !call.app.resolve(call.records, kinds, Value(*name)).ok()) return;
  FaultRemedy r;
  r.label = "Use " + text::quote(*name);
  r.args.set(p->name, *name);
  r.repeats = true;
  r.is_tried = true;
  f.remedies.push_back(std::move(r));
}

void name_record(FaultSubject& s, const FailedCall& call) {
  const ParamSpec* p = find_param(call.spec.params, "id");
  const Value* id = call.given.find("id");
  if (!p || !id || !p->type.starts_with("ref:")) return;
  const auto found = call.app.resolve(call.records, std::string_view(p->type).substr(4), *id);
  if (found.ok()) s.record = *found;
}

/// The longest beginning of a path that the record has.
std::string path_within(const model::Record& record, std::string path) {
  while (!path.empty() && !model::find(model::content(record.body), path)) {
    const std::size_t at = path.find_last_of(".[");
    path.resize(at == std::string::npos ? 0 : at);
  }
  return path;
}

/// Clears what the document does not have.
void keep_what_opens(FaultSubject& s, const document::Snapshot& records) {
  if (s.record.number == 0 || !kind_from(s.record.kind)) return;
  const auto id = Application::record_id(records, s.record);
  if (!id.ok()) {
    s.record = {};
    s.path.clear();
    return;
  }
  const model::Record& record = *records.find(*id);
  s.name = record.name;
  s.path = path_within(record, std::move(s.path));
}

}  // namespace

void complete_faults(Error& e, const FailedCall& call) {
  const auto kept = kept_faults(e);
  const bool is_one = !kept || kept->size() < 2;
  amend(e, [&](Fault& f) {
    FaultSubject& s = f.subject;
    if (s.command.empty()) {
      s.command = call.spec.name;
      name_argument(f, is_one ? e.where : f.where, call);
      if (f.code == "argument.unknown_record") offer_record(f, call);
      for (FaultRemedy& r : f.remedies)
        if (r.repeats) r.command = call.spec.name;
      if (s.record.number == 0 && s.name.empty() && s.argument != "id") name_record(s, call);
    } else if (s.command != call.spec.name) {
      drop_repeats(f);
    }
    keep_what_opens(s, call.records);
  });
}

namespace {

/// What is wrong now, as far as there is room.
class DocumentFaults {
 public:
  DocumentFaults(CommandContext& ctx, std::size_t most) : ctx_(ctx), most_(most) {}

  Result<void> look_at(AnyId id) {
    ++looked_at_;
    const model::Record& record = *ctx_.snapshot().find(id);
    if (const auto held = document::check_record(record); !held.ok()) add(held.error(), id);
    look_at_providers(id, record);
    if (id.kind == Kind::solid) return look_at_solid(id);
    if (id.kind == program_kind()) return look_at_program(id);
    return {};
  }
  [[nodiscard]] bool is_full() const { return faults_.size() >= most_; }
  Map answer(std::size_t records) {
    return Map{{"faults", std::move(faults_)},
               {"looked_at", looked_at_},
               {"is_whole", looked_at_ == records}};
  }

 private:
  void add(Fault f, AnyId id) {
    if (is_full()) return;
    f.subject.record = Application::handle(id);
    keep_what_opens(f.subject, ctx_.snapshot());
    faults_.emplace_back(fault_map(f));
  }
  void add(const Error& e, AnyId id) {
    for (Fault& f : faults_of(e)) add(std::move(f), id);
  }

  /// Choices of providers anywhere in the record.
  void look_at_providers(AnyId id, const model::Record& record) {
    struct Choice {
      std::string_view interface_id;
      const char* field;
      std::string name;
    };
    std::vector<Choice> chosen;
    if (const auto* robot = std::get_if<model::Robot>(&record.body)) {
      chosen = {{IkSolver::kInterfaceId, "ik", robot->ik.name},
                {InverseDynamics::kInterfaceId, "inverse_dynamics", robot->inverse_dynamics.name},
                {ForwardDynamics::kInterfaceId, "forward_dynamics", robot->forward_dynamics.name},
                {Controller::kInterfaceId, "controller", robot->controller.name}};
    }
    for (const Choice& c : chosen) {
      if (c.name.empty()) continue;
      const auto found = ctx_.app.registry.find(c.interface_id, c.name);
      if (found.ok()) continue;
      Fault f = make_fault("provider.missing", found.error().message, found.error().hint,
                           name_in(ctx_, id));
      f.error = found.error().code;
      f.subject.path = c.field;
      f.subject.provider = c.name;
      f.subject.interface_id = c.interface_id;
      FaultRemedy r;
      r.label = "Use the default of " + std::string(c.field);
      r.command = "record.set";
      r.args = {{"id", Application::handle(id)}, {"path", c.field}, {"value", ""}};
      f.remedies.push_back(std::move(r));
      add(std::move(f), id);
    }
  }

  Result<void> look_at_solid(AnyId id) {
    const auto made = ctx_.app.derived.mesh(ctx_.snapshot(), SolidId{id.number}, ctx_.progress);
    if (made.ok()) return {};
    if (made.error().code == ErrorCode::cancelled) return made.error();
    const auto& solid = std::get<model::Solid>(ctx_.snapshot().find(id)->body);
    Error e = made.error();
    amend(e, [&](Fault& f) {
      f.code = "solid.failed";
      f.witness.scene = Application::handle(id);
      // Engines name the node in their sentence.
      const std::string text = e.sentence();
      for (std::size_t i = 0; i < solid.nodes.size(); ++i)
        if (text.find("node " + text::quote(solid.nodes[i].name)) != std::string::npos)
          f.subject.path = "nodes[" + std::to_string(i + 1) + "]";
    });
    add(e, id);
    return {};
  }

  Result<void> look_at_program(AnyId id) {
    auto checked = ctx_.dispatch("program.check", Map{{"id", Application::handle(id)}});
    if (!checked.ok()) {
      if (checked.error().code == ErrorCode::cancelled) return std::move(checked).error();
      add(checked.error(), id);
      return {};
    }
    for (const Value& row : *checked->as_map()->find("faults")->as_list()) {
      const Map& r = *row.as_map();
      const std::string severity = text_of(r, "severity");
      if (severity == "note") continue;
      std::string message = text_of(r, "message");
      if (message.ends_with(".")) message.pop_back();
      const std::string file = text_of(r, "file");
      const auto line = static_cast<std::uint32_t>(integer(r, "line"));
      const auto column = static_cast<std::uint32_t>(integer(r, "column"));
      Fault f = make_fault("program.syntax", std::move(message), text_of(r, "hint"),
                           name_in(ctx_, id) + ", " + file + ":" + std::to_string(line) + ":" +
                               std::to_string(column));
      if (severity == "warning") f.severity = Severity::warning;
      f.subject.file = file;
      f.subject.line = f.subject.end_line = line;
      f.subject.column = column;
      f.subject.end_column = column + static_cast<std::uint32_t>(integer(r, "length"));
      // A path to a line of a file, where the file is one of the record.
      const std::string path = "files." + file + ".lines[" + std::to_string(line) + "]";
      const bool is_there =
          model::find(model::content(ctx_.snapshot().find(id)->body), path).has_value();
      f.subject.path = is_there ? path : "files";
      add(std::move(f), id);
    }
    return {};
  }

  CommandContext& ctx_;
  const std::size_t most_;
  List faults_;
  std::size_t looked_at_ = 0;
};

Result<Value> list_faults(CommandContext& ctx, const Map& args) {
  std::vector<AnyId> ids;
  if (has(args, "record")) {
    ids.push_back(ref(args, "record"));
  } else {
    for (const Kind k : all_kinds())
      for (const AnyId id : ctx.snapshot().list(k)) ids.push_back(id);
  }
  DocumentFaults found(ctx, static_cast<std::size_t>(integer(args, "at_most")));
  for (std::size_t i = 0; i < ids.size() && !found.is_full(); ++i) {
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "the check was cancelled");
    ctx.progress.report(static_cast<double>(i) / static_cast<double>(ids.size()), "records");
    RMP_TRY(found.look_at(ids[i]));
  }
  return Value(found.answer(ids.size()));
}

Result<Value> list_codes(CommandContext&, const Map&) {
  List out;
  for (const FaultCode& c : fault_codes())
    out.emplace_back(Map{{"code", c.code}, {"class", to_string(c.error)}, {"doc", c.doc}});
  return Value(std::move(out));
}

/// Marks, lines between pairs of points, and the sentence as the caption.
Result<Value> draw_fault(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  RMP_TRY(check_new_file(file, ".png", "Pictures are written as PNG files only."));
  const auto fault = fault_from(*args.find("fault"));
  if (!fault)
    return error(ErrorCode::invalid_argument, "this is not a fault: it has no code and message",
                 "Give an entry of e.faults or of fault.list.", "fault");
  const FaultWitness& w = fault->witness;
  const Handle& shown = w.scene.number ? w.scene : fault->subject.record;
  if (shown.number == 0)
    return error(ErrorCode::invalid_argument, "the fault has nothing that can be drawn",
                 "Only faults with a witness or a record have a picture.", "fault");
  RMP_TRY_ASSIGN(const AnyId id, Application::record_id(ctx.snapshot(), shown));
  RMP_TRY_ASSIGN(render::Options options, read_picture(args));
  if (options.look.caption.empty()) options.look.caption = sentence(*fault);
  scene::Extras extras;
  extras.frames = flag(args, "frames");
  if (!w.q.empty() && w.robot.empty()) extras.q = w.q;
  if (!w.q.empty() && !w.robot.empty()) extras.robot_q[w.robot] = w.q;
  const scene::Source source{ctx.snapshot(), ctx.app.derived, ctx.app.registry};
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, id, extras, ctx.progress));
  for (render::Item& item : built.scene.items)
    for (const std::string& body : w.bodies)
      if (item.name == body || item.name.starts_with(body + ".")) item.selected = true;
  std::vector<scene::MarkedPlace> places;
  constexpr Colour kFaultColour{0.85F, 0.10F, 0.10F, 1.0F};
  for (const FaultPoint& p : w.points) places.push_back({{p.x, p.y, p.z}, p.label, kFaultColour});
  scene::mark_stretches(built.scene, "fault", {}, places);
  RMP_TRY_ASSIGN(options.look.section, read_section(ctx, args, built.scene));
  RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
  RMP_TRY_ASSIGN(const std::string bytes, draw_png(*drawer, built.scene, options, ctx.progress));
  RMP_TRY(io::write_file(file, bytes));
  return Value(file);
}

Schema picture_of_fault_params() {
  Schema s{needed("fault", "type:fault", "", "An entry of e.faults, of fault.list or of a check."),
           needed("file", "path", "", "The picture, *.png.")};
  for (ParamSpec& p : picture_params({.has_mass = false, .has_parts = false}))
    s.push_back(std::move(p));
  return s;
}

}  // namespace

RMP_COMMANDS(fault_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "fault.list",
       .classic = "",
       .summary = "Lists what is wrong in the document now.",
       .details =
           "Checks each record by itself, makes the solids, compiles the programs and looks up the "
           "solvers of robots. A fault is a table: code, class, severity, message, where, hint and "
           "text; subject (record, name, path, file, line, column); extent, witness, cause and "
           "remedies where known. The check can be cancelled.",
       .example = "program.create{name = \"weld\", source = \"PROGRAM weld; BEGIN x := 1; "
                  "ENDPROGRAM;\"}\n"
                  "local found = fault.list{record = \"weld\"}\n"
                  "assert(found.faults[1].code == \"program.syntax\")\n"
                  "assert(found.faults[1].subject.line == 1)",
       .params = {optional("record", "ref:any", "", "Only this record."),
                  between(defaulted("at_most", "int", "", 1000, "Faults to list."), 1, 100000)},
       .returns = {"map",
                   "",
                   "",
                   {field("faults", "list<type:fault>", "", "The faults, record by record."),
                    field("looked_at", "int", "", "Number of records checked."),
                    field("is_whole", "bool", "",
                          "False if the list was full before all records were checked.")}},
       .effect = Effect::reads,
       .run = list_faults});
  all.push_back({.name = "fault.codes",
                 .classic = "",
                 .summary = "Lists the codes of faults with what they mean.",
                 .details = "A code is stable: programs may compare it.",
                 .example = "assert(#fault.codes() > 20)",
                 .params = {},
                 .returns = {"list",
                             "",
                             "",
                             {field("code", "string", "", "Such as argument.out_of_range."),
                              field("class", "string", "", "The usual class of the error."),
                              field("doc", "string", "", "What it means.")}},
                 .effect = Effect::reads,
                 .run = list_codes});
  CommandSpec picture;
  picture.name = "fault.picture";
  picture.summary = "Draws a fault: its robot at the joint values, its bodies and points.";
  picture.details =
      "The scene is that of the witness, or else the record of the subject. Bodies at fault are "
      "highlighted, points marked in red; the caption is the sentence of the fault.";
  picture.example =
      "robot.create{name = \"arm\", links = {{a = 0.3}, {a = 0.2}}}\n"
      "local f = {code = \"error.unreachable\", message = \"the point is out of reach\",\n"
      "  witness = {scene = robot.get(\"arm\"), q = {0.5, 0.5}, points = {{label = \"target\",\n"
      "    position = {0.6, 0.1, 0}}}}}\n"
      "assert(fault.picture{fault = f, file = \"fault.png\"} == \"fault.png\")";
  picture.params = picture_of_fault_params();
  picture.returns = {"string", "", "The file.", {}};
  picture.effect = Effect::files_write;
  picture.run = draw_fault;
  all.push_back(std::move(picture));
  return all;
}

}  // namespace robomosp::ioci
