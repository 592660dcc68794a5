// SPDX-License-Identifier: Apache-2.0
#include "ioci/faults/document_faults.h"

#include <algorithm>
#include <utility>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "document/validate.h"
#include "evaluation/robot_doubts.h"
#include "ioci/core/import_faults.h"
#include "ioci/core/origins.h"
#include "ioci/core/trial.h"
#include "ioci/simulation/run_start.h"
#include "kernel/known_provider.h"
#include "model/field_path.h"
#include "model/program_kinds.h"
#include "motion/provider_params.h"

namespace robomosp::ioci {
namespace {

const FaultCodes kDocumentCodes{
    {"solid.failed", ErrorCode::plugin_failed, "A solid cannot be made from its nodes."},
    {"provider.missing", ErrorCode::unknown_name,
     "A record chooses a provider that is not loaded or is disabled."},
    {"recording.out_of_date", ErrorCode::conflict,
     "A recording is older than the records that it was made from."},
    {"run.note", ErrorCode::conflict, "A remark of a run, such as a limit that was reached."},
};

/// Remedies of one list that are tried, and the time after which no further one is.
constexpr std::size_t kMostTried = 50;
constexpr std::chrono::seconds kLongestTrials{5};

/// The longest beginning of a path that the record has.
std::string path_within(const model::Record& record, std::string path) {
  while (!path.empty() && !model::find(model::content(record.body), path)) {
    const std::size_t at = path.find_last_of(".[");
    path.resize(at == std::string::npos ? 0 : at);
  }
  return path;
}

/// The same thing is wrong at the same place.
bool is_same(const Fault& a, const Fault& b) {
  return a.code == b.code && a.subject.record == b.subject.record &&
         a.subject.path == b.subject.path && a.subject.file == b.subject.file &&
         a.subject.line == b.subject.line && a.subject.column == b.subject.column;
}

FaultRemedy set_remedy(AnyId id, std::string label, std::string path, Value value) {
  FaultRemedy r;
  r.label = std::move(label);
  r.command = "record.set";
  r.args = {{"id", Application::handle(id)}, {"path", std::move(path)}};
  r.args.set("value", std::move(value));
  return r;
}

/// Position of the node that an engine's sentence names, from 1: `node "bore"`, `node 3 ("bore")`,
/// or `node 3 ("thread.ridge")` of the primitive "thread"; 0 = none.
std::size_t node_in(std::string_view text, const model::Solid& solid) {
  for (const std::string_view end : {"\"", "."})
    for (std::size_t i = 0; i < solid.nodes.size(); ++i) {
      const std::string name = "\"" + solid.nodes[i].name + std::string(end);
      if (text.find("node " + name) != text.npos || text.find(" (" + name) != text.npos)
        return i + 1;
    }
  return 0;
}

/// The time of a note "t = 1.5 s: ...".
std::optional<double> time_in(std::string_view note) {
  constexpr std::string_view kBegin = "t = ";
  if (!note.starts_with(kBegin)) return std::nullopt;
  const std::string_view rest = note.substr(kBegin.size());
  const std::size_t end = rest.find(" s");
  return end == std::string_view::npos ? std::nullopt : text::read_real(rest.substr(0, end));
}

}  // namespace

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

void DocumentFaults::add(Fault f, const Handle& of) {
  if (is_full()) return;
  if (f.subject.record.number == 0) f.subject.record = of;
  keep_what_opens(f.subject, ctx_.snapshot());
  faults_.push_back(std::move(f));
}

void DocumentFaults::add(const Error& e, AnyId id) {
  for (Fault& f : faults_of(e)) {
    f.subject.record = Application::handle(id);
    add(std::move(f), {});
  }
}

Result<void> DocumentFaults::look_at(AnyId id) {
  ++looked_at_;
  const model::Record& record = *ctx_.snapshot().find(id);
  if (const auto held = document::check_record(record); !held.ok()) add(held.error(), id);
  look_at_providers(id, record);
  for (Fault& f : evaluation::robot_doubts(ctx_.snapshot(), id)) {
    if (f.code == "robot.impossible_inertia")
      evaluation::offer_designed_mass(ctx_.snapshot(), ctx_.app.derived, ctx_.progress,
                                      RobotId{id.number}, f);
    add(std::move(f), {});
  }
  for (Fault& f : ctx_.app.kept<ImportFaults>().of(ctx_.snapshot(), id))
    add(std::move(f), Application::handle(id));
  if (id.kind == Kind::solid) return look_at_solid(id);
  if (id.kind == program_kind()) return look_at_program(id);
  if (id.kind == Kind::world) return look_at_runs_of(id);
  return {};
}

void DocumentFaults::look_at_providers(AnyId id, const model::Record& record) {
  struct Choice {
    std::string_view interface_id;
    const char* field;
    const model::ProviderChoice& choice;
  };
  const auto* robot = std::get_if<model::Robot>(&record.body);
  if (!robot) return;
  const Choice chosen[] = {
      {IkSolver::kInterfaceId, "ik", robot->ik},
      {InverseDynamics::kInterfaceId, "inverse_dynamics", robot->inverse_dynamics},
      {ForwardDynamics::kInterfaceId, "forward_dynamics", robot->forward_dynamics},
      {Controller::kInterfaceId, "controller", robot->controller}};
  for (const Choice& c : chosen) {
    const std::string& name = c.choice.name;
    if (name.empty()) continue;
    const auto found = ctx_.app.registry.find(c.interface_id, name);
    if (found.ok()) {
      look_at_parameters(id, *found, c.choice, c.field);
      continue;
    }
    Fault f = make_fault("provider.missing", found.error().message, found.error().hint,
                         name_in(ctx_, id));
    f.error = found.error().code;
    f.subject.path = c.field;
    f.subject.provider = name;
    f.subject.interface_id = c.interface_id;
    if (known_provider(ctx_.app.registry, c.interface_id, name).ok()) {
      FaultRemedy enable;
      enable.label = "Enable " + text::quote(name);
      enable.command = "provider.enable";
      enable.args = {{"interface", c.interface_id}, {"name", name}};
      f.remedies.push_back(std::move(enable));
    }
    std::vector<std::string> known;
    for (const ProviderInfo& p : ctx_.app.registry.list(c.interface_id))
      if (p.enabled) known.push_back(p.name);
    if (const auto near = text::nearest(name, known))
      f.remedies.push_back(set_remedy(id, "Use " + text::quote(*near), c.field, Value(*near)));
    f.remedies.push_back(
        set_remedy(id, "Use the default of " + std::string(c.field), c.field, Value("")));
    add(std::move(f), Application::handle(id));
  }
}

void DocumentFaults::look_at_parameters(AnyId id, const ProviderInfo& info,
                                        const model::ProviderChoice& choice, const char* field) {
  const auto checked = motion::checked_params(
      info, choice, name_in(ctx_, id) + ", provider " + text::quote(info.name));
  if (checked.ok()) return;
  for (Fault& f : faults_of(checked.error())) {
    const std::string parameter = f.cause ? f.cause->subject.argument : std::string();
    f.subject.path = field;
    if (!parameter.empty()) f.subject.path += ".params." + parameter;
    if (f.witness.limit && !parameter.empty())
      f.remedies.push_back(
          set_remedy(id, "Set " + parameter + " to " + text::print_rounded(*f.witness.limit, 6),
                     f.subject.path, Value(*f.witness.limit)));
    f.remedies.push_back(set_remedy(id, "Use " + text::quote(info.name) + " with its defaults",
                                    field, Value(info.name)));
    add(std::move(f), Application::handle(id));
  }
}

Result<void> DocumentFaults::look_at_solid(AnyId id) {
  const auto made = ctx_.app.derived.mesh(ctx_.snapshot(), SolidId{id.number}, ctx_.progress);
  if (made.ok()) return {};
  if (made.error().code == ErrorCode::cancelled) return made.error();
  const auto& solid = std::get<model::Solid>(ctx_.snapshot().find(id)->body);
  Error e = made.error();
  amend(e, [&](Fault& f) {
    f.code = "solid.failed";
    f.witness.scene = Application::handle(id);
    if (const std::size_t node = node_in(e.sentence(), solid))
      f.subject.path = "nodes[" + std::to_string(node) + "]";
  });
  add(e, id);
  return {};
}

Result<void> DocumentFaults::look_at_program(AnyId id) {
  auto checked = ctx_.dispatch("program.check", Map{{"id", Application::handle(id)}});
  if (!checked.ok()) {
    if (checked.error().code == ErrorCode::cancelled) return std::move(checked).error();
    add(checked.error(), id);
    return {};
  }
  for (const Value& row : *checked->as_map()->find("faults")->as_list()) {
    auto f = fault_from(*row.as_map()->find("fault"));
    if (f && f->severity != Severity::info) add(std::move(*f), Application::handle(id));
  }
  return {};
}

Result<void> DocumentFaults::look_at_runs_of(AnyId world) {
  for (const auto& [number, r] : ctx_.app.recordings.list())
    if (AnyId(r->world) == world) RMP_TRY(look_at_recording(number, false));
  return {};
}

Result<void> DocumentFaults::look_at_recording(std::uint64_t number, bool all_notes) {
  const recording::RecordingPtr r = ctx_.app.recordings.find(number);
  if (!r || !recordings_.insert(number).second) return {};
  const Handle handle{"recording", number};
  const std::string who = "recording#" + std::to_string(number);
  const bool has_world = ctx_.snapshot().get(r->world) != nullptr;
  const auto complete = [&](Fault& f) {
    f.subject.record = handle;
    f.subject.name = r->title;
    if (f.where.empty()) f.where = who;
    if (has_world && f.witness.scene.number == 0)
      f.witness.scene = Application::handle(AnyId(r->world));
  };
  const OriginPtr origin = ctx_.app.origins->find(number);
  if (origin && origin->fixed.empty()) {
    const auto changes = changes_since(ctx_.app, ctx_.snapshot(), origin->inputs);
    if (!changes.empty()) {
      Fault f = make_fault("recording.out_of_date", "it is older than " + text::enumerate(changes),
                           "recording.refresh updates it.");
      f.severity = Severity::warning;
      complete(f);
      FaultRemedy remedy;
      remedy.label = "Run it again";
      remedy.command = "recording.refresh";
      remedy.args = {{"id", handle}};
      f.remedies.push_back(std::move(remedy));
      add(std::move(f), handle);
    }
  }
  RMP_TRY_ASSIGN(std::vector<Fault> starts, start_faults(ctx_, r));
  std::set<std::string> told;
  for (Fault& f : starts) {
    // Of records that have changed since, the first row says nothing of what the run noted.
    const std::string note = sentence(f);
    told.insert(note);
    if (std::find(r->notes.begin(), r->notes.end(), note) == r->notes.end()) continue;
    complete(f);
    add(std::move(f), handle);
  }
  for (const std::string& note : r->notes) {
    if (!all_notes) break;
    if (told.contains(note)) continue;
    std::string message = note;
    if (message.ends_with('.')) message.pop_back();
    Fault f = make_fault("run.note", std::move(message));
    f.severity = Severity::info;
    f.extent.at = time_in(note);
    complete(f);
    add(std::move(f), handle);
  }
  return {};
}

std::optional<bool> DocumentFaults::outcome_of(const Fault& f, FaultRemedy& r) {
  const CommandSpec* spec = ctx_.app.commands.find(r.command);
  r.untried = !tries_ ? "Trials were not wanted."
              : !spec ? "There is no such command."
                      : Trial::why_not(*spec);
  if (r.untried.empty() && (tried_ >= kMostTried || trying_ > kLongestTrials))
    r.untried = "Too many others were tried before.";
  const auto trial = r.untried.empty() ? Trial::open(ctx_, ctx_.snapshot()) : nullptr;
  if (!trial) {
    if (r.untried.empty()) r.untried = kUntriedHere;
    return std::nullopt;
  }
  ++tried_;
  if (!trial->run(r.command, r.args).ok()) {
    if (!trial->is_over()) return false;
    r.untried = kUntriedTooLong;
    return std::nullopt;
  }
  if (f.subject.record.number == 0 || !kind_from(f.subject.record.kind)) {
    r.untried = "It succeeds, but whether the fault is gone was not looked at.";
    return std::nullopt;
  }
  const auto left =
      trial->run("fault.list", {{"record", f.subject.record}, {"try_remedies", false}});
  if (!left.ok()) {
    r.untried = kUntriedTooLong;
    return std::nullopt;
  }
  const List& all = *left->as_map()->find("faults")->as_list();
  return std::none_of(all.begin(), all.end(), [&](const Value& v) {
    const auto other = fault_from(v);
    return other && is_same(*other, f);
  });
}

void DocumentFaults::try_remedies(Fault& f) {
  std::erase_if(f.remedies, [&](FaultRemedy& r) {
    if (r.is_tried || r.repeats || r.command.empty()) return false;
    const auto begin = std::chrono::steady_clock::now();
    const auto helps = outcome_of(f, r);
    trying_ += std::chrono::steady_clock::now() - begin;
    r.is_tried = helps == true;
    return helps == false;
  });
}

Map DocumentFaults::answer(std::size_t all) {
  List out;
  for (Fault& f : faults_) {
    try_remedies(f);
    out.emplace_back(fault_map(f));
  }
  return Map{
      {"faults", std::move(out)}, {"looked_at", looked_at_}, {"is_whole", looked_at_ == all}};
}

}  // namespace robomosp::ioci
