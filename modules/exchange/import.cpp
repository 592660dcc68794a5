// SPDX-License-Identifier: Apache-2.0
#include "exchange/import.h"

#include <array>
#include <filesystem>
#include <memory>
#include <numbers>
#include <set>
#include <unordered_set>
#include <utility>

#include "evaluation/robot_doubts.h"
#include "exchange/import_meshes.h"
#include "kernel/file_root.h"
#include "kernel/provider_guard.h"
#include "model/handle.h"

namespace robomosp::exchange {
namespace {

const FaultCodes kImportCodes{
    {"import.note", ErrorCode::unsupported, "What an importer reports of a file that it read."},
    {"import.left_out", ErrorCode::unsupported, "A part of a file was not imported."},
    {"import.open_mesh", ErrorCode::unsupported,
     "An imported mesh encloses no volume, and operations on solids refuse it."},
    {"import.no_mass", ErrorCode::unsupported, "Imported links move without mass."},
};

/// `importer` is set to the one that read it.
Result<Imported> read_file(const Exchange& with, const std::string& file, const FormatValues& asked,
                           Map values, std::string& importer) {
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Importer>(with, extension_of(file), "import"));
  RMP_TRY_ASSIGN(const auto params, params_for(chosen.info, asked, std::move(values), file));
  importer = "importer " + text::quote(chosen.info.name);
  RMP_TRY_ASSIGN(const auto path, permitted_path(file, Effect::files_read));
  return guarded(chosen.info.name,
                 [&] { return chosen.provider->read(path.string(), *params, with.progress); });
}

/// Posts the notes of an importer and what was left out, and returns them.
std::vector<Fault> report_notes(const Exchange& with, const Imported& imported,
                                const std::string& file, std::vector<Fault> left_out) {
  std::vector<Fault> all = std::move(left_out);
  for (const std::string& note : imported.notes)
    all.push_back(import_fault("import.note", note, Severity::info, file));
  for (const Fault& f : all) with.messages.post(f, "import");
  return all;
}

/// Says which files an import of several was read from, each once.
void tell_files(const Exchange& with, const std::string& file, const Imported& imported,
                const std::vector<std::string>& unread) {
  std::vector<std::string> files{file};
  std::unordered_set<std::string> told{file};
  const std::unordered_set<std::string> left_out(unread.begin(), unread.end());
  for (const ForeignGeometry& f : imported.foreign)
    if (!left_out.contains(f.name) && told.insert(f.path).second) files.push_back(f.path);
  if (files.size() == 1) return;
  const std::size_t count = files.size();
  for (std::string& f : files) f = text::quote(f);
  with.messages.post(Severity::info, "import_files",
                     std::to_string(count) + " files were read: " + text::enumerate(files) + ".",
                     "import");
}

/// Says of each imported solid that is no clean one why, and what it is good for.
Result<void> tell_meshes(const Exchange& with, const document::Snapshot& now,
                         const std::vector<AnyId>& made, ImportReport& out) {
  constexpr std::size_t kMostTold = 20;
  std::vector<AnyId> solids;
  for (const AnyId id : made)
    if (const auto* s = id.kind == Kind::solid ? now.get(SolidId{id.number}) : nullptr)
      if (!s->nodes.empty() && s->nodes[0].geometry &&
          s->nodes[0].geometry->form == CsgGeometry::Form::mesh)
        solids.push_back(id);
  RMP_TRY(with.from.derived.prepare(now, solids, with.progress));
  std::size_t count = 0;
  for (std::size_t i = solids.size(); i-- > 0;) {
    RMP_TRY_ASSIGN(const auto states, with.from.derived.mesh_states(now, SolidId{solids[i].number},
                                                                    false, with.progress));
    if (states.empty() || ++count > kMostTold) continue;
    const std::string name = now.describe(solids[i]);
    Fault f = import_fault(
        "import.open_mesh",
        "The " + name + ": " +
            (states[0].note.empty() ? states[0].why.sentence() : states[0].note) +
            " Operations on solids refuse it; solid.mesh_faults lists and shows the places",
        Severity::info, {});
    f.subject.record = f.witness.scene = model::handle(solids[i]);
    f.subject.path = "nodes[1]";
    if (!states[0].why.message.empty())
      f.cause = std::make_shared<const Fault>(faults_of(states[0].why).front());
    with.messages.post(f, "import");
    out.kept.push_back({solids[i], {std::move(f)}, {}});
  }
  if (count > kMostTold)
    with.messages.post(
        Severity::info, "import_mesh",
        std::to_string(count - kMostTold) +
            " more solids are meshes as they are; solid.mesh_faults lists the faults of each.",
        "import");
  return {};
}

/// Whether the link, or one that it moves, has mass.
bool carries_mass(const model::Robot& robot, std::size_t link) {
  std::vector<bool> is_moved(robot.links.size());
  for (std::size_t i = link; i < robot.links.size(); ++i) {
    const auto parent = robot.links[i].parent;
    is_moved[i] = i == link || (parent >= 0 && is_moved[static_cast<std::size_t>(parent)]);
    if (is_moved[i] && robot.links[i].given && robot.links[i].given->mass > 0) return true;
  }
  return false;
}

/// Inertias that no body has, and joints that cannot move because both limits are one: kept as the
/// file has them, and reported, a sentence of each kind for a robot.
void report_doubts(const Exchange& with, const document::Snapshot& now,
                   const std::vector<AnyId>& made) {
  constexpr std::size_t kMostNamed = 6;
  for (const AnyId id : made) {
    const auto* robot = id.kind == Kind::robot ? now.get(RobotId{id.number}) : nullptr;
    if (!robot) continue;
    std::vector<std::string> impossible, still;
    const std::vector<Fault> doubts = evaluation::robot_doubts(now, id);
    const auto post = [&](const char* code, std::string sentence) {
      Fault f = import_fault(code, std::move(sentence), Severity::warning, {});
      for (const Fault& one : doubts)
        if (one.code == code && f.subject.path.empty()) f.subject = one.subject;
      f.witness.scene = model::handle(id);
      with.messages.post(f, "import");
    };
    if (robot->base_mass && evaluation::is_impossible(robot->base_mass->inertia))
      impossible.push_back("the base (" + evaluation::moments_text(robot->base_mass->inertia) +
                           ")");
    for (const model::Link& l : robot->links) {
      if (l.given && evaluation::is_impossible(l.given->inertia))
        impossible.push_back(text::quote(l.name) + " (" +
                             evaluation::moments_text(l.given->inertia) + ")");
      if (l.joint != model::JointKind::fixed && !l.mimic && l.lower == l.upper)
        still.push_back(text::quote(l.name) + " (" +
                        (l.joint == model::JointKind::prismatic
                             ? text::print_rounded(l.lower, 6) + " m"
                             : text::print_rounded(l.lower * 180 / std::numbers::pi, 6) + " deg") +
                        ")");
    }
    if (!impossible.empty())
      post("robot.impossible_inertia",
           "The " + now.describe(id) +
               " has inertias that no body can have, with the principal moments in kg m^2: " +
               text::enumerate_some(impossible, kMostNamed) +
               ". No moment can be negative or exceed the sum of the two others. They were kept; "
               "correct them before you trust its torques.");
    if (!still.empty())
      post("robot.stuck_joint",
           "The " + now.describe(id) +
               " has joints that cannot move, as their lower and upper limits are the same: " +
               text::enumerate_some(still, kMostNamed) +
               ". Set lower and upper of these links, or make the joints fixed.");
  }
}

/// A robot whose moving links have no mass moves, but has no dynamics.
void tell_masses(const Exchange& with, const document::Snapshot& now,
                 const std::vector<AnyId>& made, ImportReport& out) {
  for (const AnyId id : made) {
    const auto* robot = id.kind == Kind::robot ? now.get(RobotId{id.number}) : nullptr;
    if (!robot || robot->mass_source != model::MassSource::given) continue;
    std::vector<std::string> without;
    std::size_t moving = 0, first = 0;
    for (std::size_t i = 0; i < robot->links.size(); ++i) {
      if (robot->links[i].joint == model::JointKind::fixed) continue;
      ++moving;
      if (carries_mass(*robot, i)) continue;
      if (without.empty()) first = i;
      without.push_back(text::quote(robot->links[i].name));
    }
    if (without.empty()) continue;
    const bool is_none = without.size() == moving;
    const std::size_t count = without.size();
    constexpr std::size_t kMostNamed = 5;
    if (count > kMostNamed) without.resize(kMostNamed);
    std::string named = text::enumerate(without);
    if (count > kMostNamed) named += " and " + std::to_string(count - kMostNamed) + " more";
    Fault f = import_fault(
        "import.no_mass",
        "The " + now.describe(id) +
            (is_none ? " has no masses: the file gives none for "
                     : " has moving links without mass: ") +
            (is_none ? "any of its " + std::to_string(moving) + " moving links, such as " + named
                     : named) +
            (is_none ? ". Its dynamics are those of nothing; give the links masses, or design "
                       "them and set masses to designed"
                     : ""),
        is_none ? Severity::warning : Severity::info, {});
    f.subject.record = f.witness.scene = model::handle(id);
    f.subject.path = "links[" + std::to_string(first + 1) + "]";
    with.messages.post(f, "import");
    out.kept.push_back({id, {std::move(f)}, [id, first](const document::Snapshot& records) {
                          const auto* left = records.get(RobotId{id.number});
                          return left && left->mass_source == model::MassSource::given &&
                                 first < left->links.size() && !carries_mass(*left, first);
                        }});
  }
}

}  // namespace

Fault import_fault(const char* code, std::string sentence, Severity severity,
                   const std::string& file) {
  if (sentence.ends_with('.')) sentence.pop_back();
  Fault f = make_fault(code, std::move(sentence));
  f.severity = severity;
  f.subject.file = file;
  return f;
}

Result<ImportReport> import_file(const Exchange& with, document::Transaction& edit,
                                 const ImportRequest& request) {
  const std::string& file = request.file;
  Map values;
  if (request.material.number != 0) values.set("materials", false);
  std::string importer;
  RMP_TRY_ASSIGN(Imported imported,
                 read_file(with, file, request.values, std::move(values), importer));
  if (imported.records.empty())
    return imported.profile.loops.empty()
               ? error(ErrorCode::unsupported, text::quote(file) + " contains nothing to import")
               : error(ErrorCode::unsupported, text::quote(file) + " is a drawing without solids",
                       "Use import_profile, and its profile in a prism or revolution.");
  std::vector<std::string> unread;
  std::vector<Fault> left_out;
  RMP_TRY(read_foreign(with, imported, unread, left_out));
  io::MemoryFiles files;
  for (ImportedGeometry& g : imported.geometries) {
    RMP_TRY_ASSIGN(
        auto made,
        io::make_geometry(std::move(g.geometry)).in(importer + ", " + heard(text::quote(g.name))));
    files.geometries.emplace(std::move(g.name), std::move(made));
  }
  std::set<std::array<std::uint64_t, 2>> failed;
  for (const std::string& name : unread) {
    io::GeometryPtr none = stand_in(name);
    failed.insert(none->digest);
    files.geometries.insert_or_assign(name, std::move(none));
  }
  const std::string main = imported.records.back().name;
  for (ImportedFile& r : imported.records) files.texts.emplace(r.name, std::move(r.text));
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  RMP_TRY_ASSIGN(io::Loaded loaded,
                 io::load_memory(edit, files, main, file, folder, with.library).in(importer));
  RMP_TRY(drop_failed(edit, loaded, failed));
  if (request.material.number != 0)
    for (const AnyId id : loaded.all)
      if (id.kind == Kind::solid)
        RMP_TRY(edit.edit(id, [&](model::Record& r) -> Result<void> {
          std::get<model::Solid>(r.body).material = request.material;
          return {};
        }));
  ImportReport out;
  std::vector<Fault> notes = report_notes(with, imported, file, std::move(left_out));
  for (Fault& f : notes) f.subject.record = model::handle(loaded.id);
  out.kept.push_back({loaded.id, std::move(notes), {}});
  tell_files(with, file, imported, unread);
  RMP_TRY(tell_meshes(with, edit.now(), loaded.all, out));
  report_doubts(with, edit.now(), loaded.all);
  tell_masses(with, edit.now(), loaded.all, out);
  for (const std::string& note : loaded.notes)
    with.messages.post(Severity::info, "file_note", note, "io");
  out.loaded = std::move(loaded);
  return out;
}

Result<CsgProfile> import_profile(const Exchange& with, const std::string& file,
                                  const FormatValues& values) {
  std::string importer;
  RMP_TRY_ASSIGN(Imported imported, read_file(with, file, values, {}, importer));
  if (imported.profile.loops.empty()) {
    std::string why;
    for (const std::string& n : imported.notes) why += (why.empty() ? "" : " ") + n;
    return error(ErrorCode::unsupported, text::quote(file) + " contains no closed outline", why);
  }
  report_notes(with, imported, file, {});
  return std::move(imported.profile);
}

}  // namespace robomosp::exchange
