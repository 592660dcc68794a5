// SPDX-License-Identifier: Apache-2.0
// Faults as commands see them: what those of a failed call are about, the table of codes, what is
// wrong in the document now, and pictures of faults.
#include <algorithm>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/failed_call.h"
#include "ioci/core/trial.h"
#include "ioci/faults/document_faults.h"
#include "ioci/schema/choices.h"
#include "ioci/view/picture.h"
#include "kernel/argument_faults.h"
#include "kernel/fault.h"
#include "kernel/type.h"
#include "kernel/units.h"
#include "model/field_types.h"
#include "scene/build.h"
#include "scene/path_lines.h"

namespace robomosp::ioci {
namespace {

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
         "without?: list<string>; is_tried?: bool; untried?: string}>}";
}
const NamedType kFaultType{"fault", "map", fault_type};

/// The name of the argument that a path begins with.
std::string_view root_of(std::string_view path) { return path.substr(0, path.find_first_of("[.")); }

/// The part of "robot.create, links[2], a" that is the path of an argument; "" = none is. Of a
/// place in a record, as "link 3.mimic.link", what follows the element is such a path.
std::string argument_in(const CommandSpec& spec, std::string_view where) {
  while (!where.empty()) {
    const std::size_t end = std::min(where.find(", "), where.size());
    std::string_view part = where.substr(0, end);
    if (const std::size_t blank = part.rfind(' '); blank != std::string_view::npos) {
      const std::size_t dot = part.find('.', blank);
      part.remove_prefix(dot == std::string_view::npos ? part.size() : dot + 1);
    }
    if (!part.empty() && find_param(spec.params, root_of(part))) return std::string(part);
    where.remove_prefix(std::min(end + 2, where.size()));
  }
  return {};
}

/// Whether a place begins with an argument of a command, and names no command.
bool is_at_argument(const FailedCall& call, std::string_view where) {
  const std::string_view first = where.substr(0, where.find(", "));
  return !first.empty() && first.find(' ') == std::string_view::npos &&
         find_param(call.spec.params, root_of(first)) && !call.ctx.app.commands.find(first);
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
  const std::string_view root = root_of(s.argument);
  const bool is_name = f.code == "argument.unknown" && root == s.argument;
  if (is_name ? call.given.find(root) != nullptr : find_param(call.spec.params, root) != nullptr)
    return;
  // An entry of a table in an argument, such as a parameter of a provider: it is no argument by
  // itself, and neither is what repeats the call with it.
  const std::string outer = argument_in(call.spec, where);
  s.argument = outer.empty() ? outer : outer + "." + s.argument;
  drop_repeats(f);
}

/// Tries a remedy by a command. False where it succeeds, or could not be tried.
bool fails(const CommandSpec& spec, const Map& args, FaultRemedy& r, const FailedCall& call) {
  r.untried = Trial::why_not(spec);
  if (!r.untried.empty()) return false;
  const auto trial = call.may_try ? Trial::open(call.ctx, call.records) : nullptr;
  if (!trial) {
    r.untried = kUntriedHere;
    return false;
  }
  r.is_tried = trial->run(spec.name, args).ok();
  if (!r.is_tried && trial->is_over()) r.untried = kUntriedTooLong;
  return !r.is_tried && r.untried.empty();
}

/// A record of the library that has the name and is not loaded yet.
bool offer_library(Fault& f, const FailedCall& call, std::string_view kinds,
                   const std::string& name) {
  for (const std::string_view kind : text::split(kinds, '|')) {
    const auto k = kind_from(kind);
    const std::string command = std::string(kind) + ".get";
    const CommandSpec* get = call.ctx.app.commands.find(command);
    if (!k || !get || !library_file(call.ctx.app, *k, name)) continue;
    FaultRemedy r;
    r.label = "Load " + std::string(kind) + " " + text::quote(name) + " from the library";
    r.command = command;
    r.args = {{"name", name}};
    if (fails(*get, r.args, r, call)) continue;
    f.remedies.push_back(std::move(r));
    return true;
  }
  return false;
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
  if (offer_library(f, call, kinds, *given->as_string())) return;
  const auto name = text::nearest(*given->as_string(), known);
  if (!name || !call.ctx.app.resolve(call.records, kinds, Value(*name)).ok()) return;
  FaultRemedy r;
  r.label = "Use " + text::quote(*name);
  r.args.set(p->name, *name);
  r.repeats = true;
  r.is_tried = true;
  f.remedies.push_back(std::move(r));
}

/// Whether a type takes the name of a member, such as a link, alone or among others.
bool takes_member(const TypeTree& t) {
  return t.kind == TypeKind::member ||
         std::any_of(t.options.begin(), t.options.end(),
                     [](const auto& option) { return takes_member(*option); });
}

/// The argument whose value a sentence quotes, of those that name a member; "" = none.
std::string member_argument(const Fault& f, const FailedCall& call) {
  for (const ParamSpec& p : call.spec.params) {
    const Value* v = takes_member(type_tree(p.type)) ? call.given.find(p.name) : nullptr;
    if (v && v->as_string() && f.message.find(text::quote(*v->as_string())) != std::string::npos)
      return p.name;
  }
  return {};
}

/// Names among `choices` instead of `wrong`: the nearest, else the first few. None where `wrong` is
/// one of them, as something else is wrong then.
std::vector<std::string> names_instead(const std::vector<Choice>& choices,
                                       const std::string& wrong) {
  constexpr std::size_t kMostOffered = 3;
  std::vector<std::string> names;
  for (const Choice& c : choices)
    if (c.value.as_string() && c.why_not.empty() && c.is_decided)
      names.push_back(*c.value.as_string());
  if (std::find(names.begin(), names.end(), wrong) != names.end()) return {};
  if (const auto near = text::nearest(wrong, names)) return {*near};
  names.resize(std::min(names.size(), kMostOffered));
  return names;
}

/// What exists instead of a name that does not, at any depth of an argument: members, and records
/// that are near in name or in the library.
void offer_names(Fault& f, const FailedCall& call) {
  const bool is_record = f.code == "argument.unknown_record";
  const std::string& path = f.subject.argument;
  const ParamSpec* p = find_param(call.spec.params, root_of(path));
  const Value* given = p ? call.given.find(p->name) : nullptr;
  const auto wrong = given ? part_at(*given, path, p->name) : std::nullopt;
  if (!wrong || !wrong->as_string()) return;
  const std::string& name_given = *wrong->as_string();
  auto choices = choices_of(call.ctx, call.spec.params, path, call.given, {}, is_record);
  if (!choices.ok()) return;
  constexpr std::string_view kOfLibrary = " of the library";
  if (is_record) {
    for (const Choice& c : *choices)
      if (c.doc.ends_with(kOfLibrary) && c.value.text() == name_given &&
          offer_library(f, call, std::string_view(c.doc).substr(0, c.doc.find(' ')), name_given))
        return;
    std::erase_if(*choices, [&](const Choice& c) { return c.doc.ends_with(kOfLibrary); });
  }
  std::vector<std::string> names = names_instead(*choices, name_given);
  // Of records, those that are not near in name have nothing to do with it.
  if (is_record && !text::nearest(name_given, names)) return;
  for (const std::string& name : names) {
    auto changed = with_part(*given, path, p->name, Value(name));
    if (!changed) return;
    FaultRemedy r;
    r.label = "Use " + text::quote(name);
    r.args.set(p->name, std::move(*changed));
    r.repeats = r.is_tried = true;
    f.remedies.push_back(std::move(r));
  }
}

void name_record(FaultSubject& s, const FailedCall& call) {
  const ParamSpec* p = find_param(call.spec.params, "id");
  const Value* id = call.given.find("id");
  if (!p || !id || !p->type.starts_with("ref:")) return;
  const auto found = call.ctx.app.resolve(call.records, std::string_view(p->type).substr(4), *id);
  if (found.ok()) s.record = *found;
}

/// A field that a command sets by path and value, such as record.set.
void name_value(FaultSubject& s, const FailedCall& call) {
  const Value* path = call.given.find("path");
  if (!path || !path->as_string() || !call.given.find("value")) return;
  s.argument = "value";
  if (s.path.empty()) s.path = *path->as_string();
}

/// Names instead of one that record.set and its like give for a field, by the field's declaration.
void offer_in_field(Fault& f, const FailedCall& call) {
  const Value *id = call.given.find("id"), *path = call.given.find("path"),
              *value = call.given.find("value");
  const ParamSpec* of = find_param(call.spec.params, "id");
  if (!id || !path || !path->as_string() || !value || !value->as_string() || !of ||
      !of->type.starts_with("ref:"))
    return;
  const auto record = call.ctx.app.resolve(call.records, std::string_view(of->type).substr(4), *id);
  const auto kind = record.ok() ? kind_from(record->kind) : std::nullopt;
  if (!kind) return;
  name_value(f.subject, call);
  Schema fields = model::record_fields(model::info(*kind));
  fields.push_back(needed("id", "ref:" + record->kind, "", ""));
  const auto choices = choices_of(call.ctx, fields, *path->as_string(), Map{{"id", *id}}, {});
  if (!choices.ok()) return;
  for (const std::string& name : names_instead(*choices, *value->as_string())) {
    FaultRemedy r;
    r.label = "Use " + text::quote(name);
    r.args.set("value", name);
    r.repeats = true;
    if (fails(call.spec, repeated(r, call.given), r, call)) continue;
    f.remedies.push_back(std::move(r));
  }
}

/// The limit instead of a number that a field of a record must not have.
void offer_limit(Fault& f, const FailedCall& call) {
  if (!f.witness.limit || !f.witness.value || !f.remedies.empty()) return;
  const std::size_t at = f.subject.path.find_last_of('.');
  const std::string field =
      at == std::string::npos ? f.subject.path : f.subject.path.substr(at + 1);
  const std::string name = find_param(call.spec.params, "value") ? "value" : field;
  const Value* given = call.given.find(name);
  const bool is_it =
      given && (given->as_string() || (given->is_number() && given->number() == *f.witness.value));
  if (!is_it || !find_param(call.spec.params, name)) return;
  FaultRemedy r;
  r.label = "Set " + field + " to " +
            (f.witness.unit.empty() || f.witness.unit == "1"
                 ? text::print_rounded(*f.witness.limit)
                 : units::print_with_unit(*f.witness.limit, f.witness.unit));
  r.args.set(name, *f.witness.limit);
  r.repeats = true;
  if (fails(call.spec, repeated(r, call.given), r, call)) return;
  f.remedies.push_back(std::move(r));
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
      if (f.code == "argument.unknown_record") {
        if (root_of(s.argument) == s.argument) offer_record(f, call);
        else offer_names(f, call);
      }
      if (f.code == "error.unknown_name") {
        if (s.argument.empty()) s.argument = member_argument(f, call);
        if (s.argument.empty()) offer_in_field(f, call);
        else if (f.remedies.empty()) offer_names(f, call);
      }
      if (f.code == "argument.out_of_range" && s.argument.empty()) name_value(s, call);
      if (f.code == "record.out_of_range" || s.argument == "value") offer_limit(f, call);
      for (FaultRemedy& r : f.remedies)
        if (r.repeats) r.command = call.spec.name;
      if (s.record.number == 0 && s.name.empty() && s.argument != "id") name_record(s, call);
    } else if (s.command != call.spec.name) {
      drop_repeats(f);
    }
    keep_what_opens(s, call.records);
  });
  // As the check of arguments, a command that refuses one of them is named.
  if (is_one && is_at_argument(call, e.where)) e = std::move(e).in(call.spec.name);
}

namespace {

Result<Value> list_faults(CommandContext& ctx, const Map& args) {
  std::vector<AnyId> ids;
  const bool has_recording = has(args, "recording");
  if (has(args, "record")) {
    ids.push_back(ref(args, "record"));
  } else if (!has_recording) {
    for (const Kind k : all_kinds())
      for (const AnyId id : ctx.snapshot().list(k)) ids.push_back(id);
  }
  DocumentFaults found(ctx, static_cast<std::size_t>(integer(args, "at_most")),
                       flag(args, "try_remedies"));
  if (has_recording)
    RMP_TRY(found.look_at_recording(args.find("recording")->as_handle()->number, true));
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
  RMP_TRY(apply_visibility(ctx, args, id, built));
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
  for (ParamSpec& p : picture_params(
           {.has_mass = false, .has_parts = false, .has_members = true, .has_fading = true}))
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
           "Checks each record by itself, makes the solids, compiles the programs, and checks the "
           "solvers of robots with their parameters. Lists also what imports left out, links with "
           "values that are hardly meant, and of worlds the recordings that are out of date or "
           "start in "
           "contact; with recording also all notes of that run. A fault is a table: code, class, "
           "severity, message, where, hint and text; subject (record, name, path, file, line, "
           "column); extent, witness, cause and remedies where known. Remedies are tried on a "
           "draft "
           "that is dropped, and those that do not help are left out; the reason "
           "why one was not tried is in untried. The check can be cancelled.",
       .example = "program.create{name = \"weld\", source = \"PROGRAM weld; BEGIN x := 1; "
                  "ENDPROGRAM;\"}\n"
                  "local found = fault.list{record = \"weld\"}\n"
                  "assert(found.faults[1].code == \"program.syntax\")\n"
                  "assert(found.faults[1].subject.line == 1)",
       .params = {optional("record", "ref:any", "", "Only this record."),
                  optional("recording", "ref:recording", "", "Only this recording."),
                  defaulted("try_remedies", "bool", "", true, "Tries the remedies."),
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
