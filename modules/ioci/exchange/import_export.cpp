// SPDX-License-Identifier: Apache-2.0
// Foreign files in and out through providers of robomosp.importer/1 and robomosp.exporter/1.
#include <algorithm>
#include <deque>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <numbers>
#include <optional>
#include <set>
#include <unordered_set>
#include <utility>

#include <robomosp/sdk/io.h>

#include "evaluation/attached_tools.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/import_faults.h"
#include "ioci/core/loaded.h"
#include "ioci/exchange/export_pairs.h"
#include "ioci/exchange/exported.h"
#include "ioci/records/solid_nodes.h"
#include "ioci/robot/inertia.h"
#include "ioci/robot/robot_faults.h"
#include "kernel/executor.h"
#include "kernel/file_root.h"
#include "kernel/fingerprint.h"
#include "kernel/provider_guard.h"
#include "kernel/quiet_progress.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kMostItems = 100000;

// --- providers -----------------------------------------------------------------------------

std::string extension_of(const std::string& file) {
  std::string e = std::filesystem::path(file).extension().string();
  if (!e.empty()) e.erase(0, 1);
  std::transform(e.begin(), e.end(), e.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return e;
}

template <class I>
struct Chosen {
  ProviderInfo info;
  std::shared_ptr<I> provider;
};

/// The first enabled provider that knows the extension.
template <class I>
Result<Chosen<I>> provider_for(const CommandContext& ctx, const std::string& wanted,
                               const char* verb) {
  std::vector<std::string> known;
  for (const ProviderInfo& info : ctx.app.registry.list(I::kInterfaceId)) {
    if (!info.enabled) continue;
    auto provider = ctx.app.registry.create<I>(info.name);
    if (!provider.ok()) {  // the others are of use all the same
      ctx.app.messages.post(Severity::warning, "provider_left_out", provider.error().sentence(),
                            "plugin");
      continue;
    }
    for (const std::string_view e : text::split((*provider)->extensions(), ',')) {
      if (text::trim(e) == wanted) return Chosen<I>{info, std::move(*provider)};
      known.emplace_back(text::trim(e));
    }
  }
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  if (known.empty())
    return error(ErrorCode::unsupported, std::string("no plugin can ") + verb + " foreign files",
                 "plugin.list lists the plugins that were found.");
  return error(ErrorCode::invalid_argument,
               wanted.empty()
                   ? std::string("the format of the file cannot be determined from its extension")
                   : "files with the extension ." + wanted + " cannot be " + verb + "ed",
               "Known: " + text::enumerate(known) + ".", "file");
}

/// Parameters of a format's own: `options` of import and export.
Result<void> take_options(const ProviderInfo& info, const Map& args, Map& values) {
  const Value* given = args.find("options");
  if (!given || !given->as_map()) return {};
  for (const auto& [name, value] : *given->as_map()) {
    if (std::none_of(info.schema.begin(), info.schema.end(),
                     [&, &key = name](const ParamSpec& p) { return p.name == key; })) {
      std::vector<std::string> known;
      for (const ParamSpec& p : info.schema) known.push_back(p.name);
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty())
        hint = known.empty() ? "It has none." : "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name,
                   "the provider " + text::quote(info.name) + " has no option " + text::quote(name),
                   hint, "options");
    }
    values.set(name, value);
  }
  return {};
}

/// Hands on those of `names` that were given and are in the provider's table; one that is given
/// but not in the table is refused.
Result<std::unique_ptr<Params>> params_for(const ProviderInfo& info, const Map& args, Map values,
                                           const std::vector<std::string>& names,
                                           const std::string& file) {
  for (const std::string& name : names) {
    const Value* v = args.find(name);
    if (!v || v->is_nil()) continue;
    const bool is_known = std::any_of(info.schema.begin(), info.schema.end(),
                                      [&](const ParamSpec& p) { return p.name == name; });
    if (!is_known)
      return error(ErrorCode::invalid_argument, "." + extension_of(file) + " files have no " + name,
                   "Leave it out.", name);
    values.set(name, *v);
  }
  RMP_TRY(take_options(info, args, values));
  // What the command itself asks for is left out where the provider does not know it.
  if (std::none_of(info.schema.begin(), info.schema.end(),
                   [](const ParamSpec& p) { return p.name == "materials"; }))
    values.erase("materials");
  RMP_TRY_ASSIGN(Map checked, check(info.schema, values));
  return make_params(std::move(checked));
}

// --- in ------------------------------------------------------------------------------------

/// `importer` is told which one read it.
Result<Imported> read_file(CommandContext& ctx, const Map& args, Map values,
                           std::string& importer) {
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Importer>(ctx, extension_of(file), "import"));
  RMP_TRY_ASSIGN(const auto params,
                 params_for(chosen.info, args, std::move(values),
                            {"name", "unit", "heal", "density", "shapes"}, file));
  importer = "importer " + text::quote(chosen.info.name);
  RMP_TRY_ASSIGN(const auto path, permitted_path(file, Effect::files_read));
  return guarded(chosen.info.name,
                 [&] { return chosen.provider->read(path.string(), *params, ctx.progress); });
}

const FaultCodes kImportCodes{
    {"import.note", ErrorCode::unsupported, "What an importer reports of a file that it read."},
    {"import.left_out", ErrorCode::unsupported, "A part of a file was not imported."},
    {"import.open_mesh", ErrorCode::unsupported,
     "An imported mesh encloses no volume, and operations on solids refuse it."},
    {"import.no_mass", ErrorCode::unsupported, "Imported links move without mass."},
};

/// The sentence of an importer without its period.
Fault import_fault(const char* code, std::string sentence, Severity severity,
                   const std::string& file) {
  if (sentence.ends_with('.')) sentence.pop_back();
  Fault f = make_fault(code, std::move(sentence));
  f.severity = severity;
  f.subject.file = file;
  return f;
}

/// Posts the notes of an importer and what was left out; they are kept for fault.list with the
/// record that was made last, if there is one.
void report_notes(CommandContext& ctx, const Imported& imported, const std::string& file,
                  std::vector<Fault> left_out = {}, AnyId made = {}) {
  std::vector<Fault> all = std::move(left_out);
  for (const std::string& note : imported.notes)
    all.push_back(import_fault("import.note", note, Severity::info, file));
  for (const Fault& f : all) ctx.app.messages.post(f, "import");
  if (made.number == 0) return;
  for (Fault& f : all) f.subject.record = Application::handle(made);
  ctx.app.kept<ImportFaults>().note(made, ctx.snapshot().find(made)->name, std::move(all));
}

/// Says which files an import of several was read from, each once.
void tell_files(CommandContext& ctx, const std::string& file, const Imported& imported,
                const std::vector<std::string>& unread) {
  std::vector<std::string> files{file};
  std::unordered_set<std::string> told{file};
  const std::unordered_set<std::string> left_out(unread.begin(), unread.end());
  for (const ForeignGeometry& f : imported.foreign)
    if (!left_out.contains(f.name) && told.insert(f.path).second) files.push_back(f.path);
  if (files.size() == 1) return;
  const std::size_t count = files.size();
  for (std::string& f : files) f = text::quote(f);
  ctx.app.messages.post(Severity::info, "import_files",
                        std::to_string(count) + " files were read: " + text::enumerate(files) + ".",
                        "import");
}

/// All meshes of what an importer made as one, where its objects place them; in metres. [any
/// thread]
Result<CsgGeometry> merged_mesh(const CommandContext& ctx, Imported imported,
                                const std::string& path) {
  if (imported.records.empty())
    return error(ErrorCode::unsupported, "it contains no mesh", "Check the file.");
  io::MemoryFiles files;
  for (ImportedGeometry& g : imported.geometries) {
    RMP_TRY_ASSIGN(auto made, io::make_geometry(std::move(g.geometry)));
    files.geometries.emplace(std::move(g.name), std::move(made));
  }
  const std::string main = imported.records.back().name;
  for (ImportedFile& r : imported.records) files.texts.emplace(r.name, std::move(r.text));
  document::Document scratch;
  RMP_TRY_ASSIGN(auto tx, scratch.begin("mesh"));
  RMP_TRY_ASSIGN(const io::Loaded loaded,
                 io::load_memory(tx, files, main, path, std::filesystem::path(path).parent_path(),
                                 ctx.app.library));
  CsgGeometry out;
  out.form = CsgGeometry::Form::mesh;
  std::vector<std::pair<AnyId, Pose>> stack{{loaded.id, Pose{}}};
  std::size_t seen = 0;
  while (!stack.empty()) {
    const auto [id, at] = stack.back();
    stack.pop_back();
    if (++seen > kMostItems) return error(ErrorCode::unsupported, "it has more than 100000 parts");
    if (const auto* object = tx.now().get(ObjectId{id.number}); object && id.kind == Kind::object) {
      for (const model::ObjectPart& p : object->parts)
        stack.emplace_back(p.what, spatial::compose(at, model::pose(p.placement)));
      continue;
    }
    const auto* solid = tx.now().get(SolidId{id.number});
    if (!solid || solid->nodes.empty() || !solid->nodes[0].geometry ||
        solid->nodes[0].geometry->form != CsgGeometry::Form::mesh)
      return error(ErrorCode::unsupported, "it is not a mesh file",
                   "Links accept meshes such as STL, OBJ and COLLADA.");
    const CsgGeometry& g = *solid->nodes[0].geometry;
    const auto first = static_cast<std::uint32_t>(out.points.size() / 3);
    for (std::size_t i = 0; i + 2 < g.points.size(); i += 3) {
      const Vec3 p = spatial::transform(at, {g.points[i], g.points[i + 1], g.points[i + 2]});
      out.points.insert(out.points.end(), p.begin(), p.end());
    }
    for (const std::uint32_t k : g.triangles) out.triangles.push_back(first + k);
  }
  return out;
}

/// The mesh of a file that an importer names, read by the importer of its own format; not scaled
/// yet. [any thread]
Result<CsgGeometry> foreign_mesh(const CommandContext& ctx, const ForeignGeometry& f,
                                 Progress& progress) {
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Importer>(ctx, extension_of(f.path), "import"));
  Map values;
  for (const ParamSpec& p : chosen.info.schema) {
    if (p.name == "unit") values.set("unit", f.unit);
    if (p.name == "materials") values.set("materials", false);
  }
  RMP_TRY_ASSIGN(Map checked, check(chosen.info.schema, values));
  const auto params = make_params(std::move(checked));
  // The importer that named it need not have asked whether it may be read.
  RMP_TRY_ASSIGN(const auto path, permitted_path(f.path, Effect::files_read));
  RMP_TRY_ASSIGN(Imported read, guarded(chosen.info.name, [&] {
                   return chosen.provider->read(path.string(), *params, progress);
                 }));
  return merged_mesh(ctx, std::move(read), f.path);
}

CsgGeometry scaled(CsgGeometry mesh, const ForeignGeometry& f) {
  for (std::size_t i = 0; i < mesh.points.size(); ++i) mesh.points[i] *= f.scale[i % 3];
  // A mirrored mesh is inside out.
  if (f.scale[0] * f.scale[1] * f.scale[2] < 0)
    for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3)
      std::swap(mesh.triangles[i + 1], mesh.triangles[i + 2]);
  mesh.source = std::filesystem::path(f.path).filename().string();
  return mesh;
}

/// A geometry to stand where a mesh could not be read, until its solid is taken out again. No
/// content has its digest, by which that solid is found.
io::GeometryPtr stand_in(const std::string& name) {
  auto g = std::make_shared<CsgGeometry>();
  g->form = CsgGeometry::Form::mesh;
  g->points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  g->triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  Fingerprinter fp("stand-in/1");
  fp.add(std::string_view(name));
  const Fingerprint digest = fp.finish();
  g->digest = {digest.hi, digest.lo};
  return g;
}

/// Reads the meshes that stand in files of their own, each file once and several at the same time;
/// those that failed are in `failed`, with a fault each in `left_out`.
Result<void> read_foreign(CommandContext& ctx, Imported& imported, std::vector<std::string>& failed,
                          std::vector<Fault>& left_out) {
  struct File {
    const ForeignGeometry* asked = nullptr;
    Result<CsgGeometry> mesh = error(ErrorCode::cancelled, "stopped");
  };
  std::vector<File> files;
  std::map<std::pair<std::string, std::string>, std::size_t> known;  // by path and unit
  std::vector<std::size_t> file_of;
  for (const ForeignGeometry& f : imported.foreign) {
    const auto [at, is_new] = known.try_emplace({f.path, f.unit}, files.size());
    if (is_new) files.push_back({&f});
    file_of.push_back(at->second);
  }
  std::mutex tell;
  std::size_t done = 0;  // guarded by tell
  Executor& executor = Executor::of_process();
  executor.spread(files.size(), executor.cores(), [&](std::size_t i) {
    if (ctx.progress.cancelled()) return;
    QuietProgress quiet(ctx.progress);
    const ForeignGeometry& f = *files[i].asked;
    try {
      files[i].mesh = foreign_mesh(ctx, f, quiet);
    } catch (const std::exception& e) {
      files[i].mesh = error(ErrorCode::internal, std::string("reading it failed: ") + e.what());
    }
    const std::lock_guard lock(tell);
    ctx.progress.report(static_cast<double>(++done) / static_cast<double>(files.size()),
                        "reading " + std::filesystem::path(f.path).filename().string());
  });
  if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "the import was cancelled");
  for (std::size_t i = 0; i < imported.foreign.size(); ++i) {
    const ForeignGeometry& f = imported.foreign[i];
    const Result<CsgGeometry>& mesh = files[file_of[i]].mesh;
    if (!mesh.ok() && mesh.error().code == ErrorCode::cancelled) return mesh.error();
    if (!mesh.ok()) {
      Fault fault =
          import_fault("import.left_out",
                       "Mesh " + text::quote(f.path) + " was left out: " + mesh.error().sentence(),
                       Severity::warning, f.path);
      fault.cause = std::make_shared<const Fault>(faults_of(mesh.error()).front());
      left_out.push_back(std::move(fault));
      failed.push_back(f.name);
      continue;
    }
    imported.geometries.push_back({f.name, scaled(*mesh, f)});
  }
  return {};
}

/// Takes the solids whose geometry could not be read out of the robots that were made.
Result<void> drop_failed(CommandContext& ctx, io::Loaded& loaded,
                         const std::set<std::array<std::uint64_t, 2>>& failed) {
  if (failed.empty()) return {};
  std::set<AnyId> drop;
  for (const AnyId id : loaded.all)
    if (const auto* s = id.kind == Kind::solid ? ctx.snapshot().get(SolidId{id.number}) : nullptr)
      if (!s->nodes.empty() && s->nodes[0].geometry &&
          failed.contains(s->nodes[0].geometry->digest))
        drop.insert(id);
  for (const AnyId id : loaded.all)
    if (id.kind == Kind::robot)
      RMP_TRY(change<model::Robot>(ctx, id, [&](model::Robot& r) -> Result<void> {
        const auto is_gone = [&](const model::BodyPart& p) { return drop.contains(p.what); };
        std::erase_if(r.base_parts, is_gone);
        std::vector<model::Link*> bare;
        bool has_parts = !r.base_parts.empty();
        for (model::Link& l : r.links) {
          if (std::erase_if(l.parts, is_gone) > 0 && l.parts.empty()) bare.push_back(&l);
          has_parts = has_parts || !l.parts.empty();
        }
        // Nothing is generated in the place of one body among designed ones.
        if (has_parts)
          for (model::Link* l : bare) l->visible = false;
        return {};
      }));
  for (const AnyId id : drop) RMP_TRY(ctx.edit().remove(id));
  std::erase_if(loaded.all, [&](AnyId id) { return drop.contains(id); });
  return {};
}

/// Says of each imported solid that is no clean one why, and what it is good for.
Result<void> tell_meshes(CommandContext& ctx, const std::vector<AnyId>& made) {
  constexpr std::size_t kMostTold = 20;
  std::vector<AnyId> solids;
  for (const AnyId id : made)
    if (const auto* s = id.kind == Kind::solid ? ctx.snapshot().get(SolidId{id.number}) : nullptr)
      if (!s->nodes.empty() && s->nodes[0].geometry &&
          s->nodes[0].geometry->form == CsgGeometry::Form::mesh)
        solids.push_back(id);
  RMP_TRY(ctx.app.derived.prepare(ctx.snapshot(), solids, ctx.progress));
  std::size_t count = 0;
  for (std::size_t i = solids.size(); i-- > 0;) {
    RMP_TRY_ASSIGN(const auto states,
                   ctx.app.derived.mesh_states(ctx.snapshot(), SolidId{solids[i].number}, false,
                                               ctx.progress));
    if (states.empty() || ++count > kMostTold) continue;
    const std::string name = name_in(ctx, solids[i]);
    Fault f = import_fault(
        "import.open_mesh",
        "The " + name + ": " +
            (states[0].note.empty() ? states[0].why.sentence() : states[0].note) +
            " Operations on solids refuse it; solid.mesh_faults lists and shows the places",
        Severity::info, {});
    f.subject.record = f.witness.scene = Application::handle(solids[i]);
    f.subject.path = "nodes[1]";
    if (!states[0].why.message.empty())
      f.cause = std::make_shared<const Fault>(faults_of(states[0].why).front());
    ctx.app.messages.post(f, "import");
    ctx.app.kept<ImportFaults>().note(solids[i], ctx.snapshot().find(solids[i])->name,
                                      {std::move(f)});
  }
  if (count > kMostTold)
    ctx.app.messages.post(
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
void report_doubts(CommandContext& ctx, const std::vector<AnyId>& made) {
  constexpr std::size_t kMostNamed = 6;
  for (const AnyId id : made) {
    const auto* robot = id.kind == Kind::robot ? ctx.snapshot().get(RobotId{id.number}) : nullptr;
    if (!robot) continue;
    std::vector<std::string> impossible, still;
    const std::vector<Fault> doubts = robot_doubts(ctx.snapshot(), id);
    const auto post = [&](const char* code, std::string sentence) {
      Fault f = import_fault(code, std::move(sentence), Severity::warning, {});
      for (const Fault& one : doubts)
        if (one.code == code && f.subject.path.empty()) f.subject = one.subject;
      f.witness.scene = Application::handle(id);
      ctx.app.messages.post(f, "import");
    };
    if (robot->base_mass && is_impossible(robot->base_mass->inertia))
      impossible.push_back("the base (" + moments_text(robot->base_mass->inertia) + ")");
    for (const model::Link& l : robot->links) {
      if (l.given && is_impossible(l.given->inertia))
        impossible.push_back(text::quote(l.name) + " (" + moments_text(l.given->inertia) + ")");
      if (l.joint != model::JointKind::fixed && !l.mimic && l.lower == l.upper)
        still.push_back(text::quote(l.name) + " (" +
                        (l.joint == model::JointKind::prismatic
                             ? text::print_rounded(l.lower, 6) + " m"
                             : text::print_rounded(l.lower * 180 / std::numbers::pi, 6) + " deg") +
                        ")");
    }
    if (!impossible.empty())
      post("robot.impossible_inertia",
           "The " + name_in(ctx, id) +
               " has inertias that no body can have, with the principal moments in kg m^2: " +
               text::enumerate_some(impossible, kMostNamed) +
               ". No moment can be negative or exceed the sum of the two others. They were kept; "
               "correct them before you trust its torques.");
    if (!still.empty())
      post("robot.stuck_joint",
           "The " + name_in(ctx, id) +
               " has joints that cannot move, as their lower and upper limits are the same: " +
               text::enumerate_some(still, kMostNamed) +
               ". Set lower and upper of these links, or make the joints fixed.");
  }
}

/// A robot whose moving links have no mass moves, but has no dynamics.
void tell_masses(CommandContext& ctx, const std::vector<AnyId>& made) {
  for (const AnyId id : made) {
    const auto* robot = id.kind == Kind::robot ? ctx.snapshot().get(RobotId{id.number}) : nullptr;
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
        "The " + name_in(ctx, id) +
            (is_none ? " has no masses: the file gives none for "
                     : " has moving links without mass: ") +
            (is_none ? "any of its " + std::to_string(moving) + " moving links, such as " + named
                     : named) +
            (is_none ? ". Its dynamics are those of nothing; give the links masses, or design "
                       "them and set masses to designed"
                     : ""),
        is_none ? Severity::warning : Severity::info, {});
    f.subject.record = f.witness.scene = Application::handle(id);
    f.subject.path = "links[" + std::to_string(first + 1) + "]";
    ctx.app.messages.post(f, "import");
    ctx.app.kept<ImportFaults>().note(id, ctx.snapshot().find(id)->name, {std::move(f)},
                                      [id, first](const document::Snapshot& records) {
                                        const auto* now = records.get(RobotId{id.number});
                                        return now &&
                                               now->mass_source == model::MassSource::given &&
                                               first < now->links.size() &&
                                               !carries_mass(*now, first);
                                      });
  }
}

Result<Value> import_file(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  Map values;
  if (has(args, "material")) {
    if (has(args, "density"))
      return error(ErrorCode::invalid_argument, "both material and density are given",
                   "The material has a density; leave one out.", "density");
    values.set("materials", false);
  }
  std::string importer;
  RMP_TRY_ASSIGN(Imported imported, read_file(ctx, args, std::move(values), importer));
  if (imported.records.empty())
    return imported.profile.loops.empty()
               ? error(ErrorCode::unsupported, text::quote(file) + " contains nothing to import")
               : error(ErrorCode::unsupported, text::quote(file) + " is a drawing without solids",
                       "Use import_profile, and its profile in a prism or revolution.");
  std::vector<std::string> unread;
  std::vector<Fault> left_out;
  RMP_TRY(read_foreign(ctx, imported, unread, left_out));
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
  RMP_TRY_ASSIGN(
      io::Loaded loaded,
      io::load_memory(ctx.edit(), files, main, file, folder, ctx.app.library).in(importer));
  RMP_TRY(drop_failed(ctx, loaded, failed));
  if (has(args, "material"))
    for (const AnyId id : loaded.all)
      if (id.kind == Kind::solid)
        RMP_TRY(change<model::Solid>(ctx, id, [&](model::Solid& s) -> Result<void> {
          s.material = typed<model::Material>(args, "material");
          return {};
        }));
  report_notes(ctx, imported, file, std::move(left_out), loaded.id);
  tell_files(ctx, file, imported, unread);
  RMP_TRY(tell_meshes(ctx, loaded.all));
  report_doubts(ctx, loaded.all);
  tell_masses(ctx, loaded.all);
  for (const std::string& note : loaded.notes)
    ctx.app.messages.post(Severity::info, "file_note", note, "io");
  List made;
  for (std::size_t i = loaded.all.size(); i-- > 0;)
    made.emplace_back(Application::handle(loaded.all[i]));
  return Value(std::move(made));
}

Result<Value> import_profile(CommandContext& ctx, const Map& args) {
  std::string importer;
  RMP_TRY_ASSIGN(const Imported imported, read_file(ctx, args, {}, importer));
  if (imported.profile.loops.empty()) {
    std::string why;
    for (const std::string& n : imported.notes) why += (why.empty() ? "" : " ") + n;
    return error(ErrorCode::unsupported,
                 text::quote(text_of(args, "file")) + " contains no closed outline", why);
  }
  report_notes(ctx, imported, text_of(args, "file"));
  return profile_value(imported.profile);
}

// --- out -----------------------------------------------------------------------------------

/// Export items of records, and what keeps their content alive.
class Items {
 public:
  /// `chord` [m] instead of that of the solids; 0 = theirs.
  Items(CommandContext& ctx, bool wants_exact, double chord)
      : ctx_(ctx), wants_exact_(wants_exact), chord_(chord) {}

  Result<void> add(AnyId id, const std::string& name, const Pose& pose, std::int32_t parent) {
    struct Open {
      AnyId what;
      std::string name;
      Pose pose;
      std::int32_t parent;
      MaterialId material;
    };
    std::vector<Open> stack{{id, name, pose, parent, {}}};
    while (!stack.empty()) {
      const Open open = std::move(stack.back());
      stack.pop_back();
      if (items.size() >= kMostItems)
        return error(ErrorCode::unsupported, "there are more than 100000 parts to export",
                     "Export them in groups.");
      if (open.what.kind == Kind::solid) {
        RMP_TRY(
            add_solid(SolidId{open.what.number}, open.name, open.pose, open.parent, open.material));
        continue;
      }
      const auto* object = ctx_.snapshot().get(ObjectId{open.what.number});
      if (!object) continue;
      const std::int32_t self = group(open.name, open.pose, open.parent);
      for (std::size_t i = object->parts.size(); i-- > 0;) {
        const model::ObjectPart& p = object->parts[i];
        // The outermost material given wins, as in masses.
        stack.push_back({p.what, p.name, model::pose(p.placement), self,
                         open.material.number ? open.material : p.material});
      }
    }
    return {};
  }

  /// A robot at the joint values; generated bodies are meshes.
  Result<void> add_robot(RobotId id, const std::string& name, const Pose& world_T_mounting,
                         std::vector<double> q) {
    const model::Robot& robot = *ctx_.snapshot().get(id);
    RMP_TRY_ASSIGN(const auto model,
                   ctx_.app.derived.robot_model(ctx_.snapshot(), id, {0, 0, -9.81}, ctx_.progress));
    if (q.size() != model->coordinate_count()) q = robotics::home_joint_values(robot);
    std::vector<Pose> joints(model->joints.size());
    const auto links = robotics::link_frames(robot);
    std::vector<Pose> frames(links.size());
    robotics::forward_kinematics(*model, q, joints);
    robotics::link_poses(links, joints, frames);
    const std::int32_t self = group(name, spatial::compose(world_T_mounting, model->base), -1);
    ExportRobot one;
    one.name = name;
    one.model = model.get();
    one.pose = spatial::compose(world_T_mounting, model->base);
    one.q = q;
    RMP_TRY_ASSIGN(const model::Robot equipped,
                   evaluation::with_tool_frames(ctx_.snapshot(), name, robot));
    mechanisms_.push_back(mechanism_of(equipped, robot));
    set_mechanism(one, &mechanisms_.back());
    RMP_TRY_ASSIGN(const auto standing,
                   ctx_.app.derived.standing_mass(ctx_.snapshot(), id, ctx_.progress));
    if (standing) {
      masses_.push_back(spatial::in_frame(*standing, spatial::inverse(model->base)));
      set_standing_mass(one, &masses_.back());
    }
    robots.push_back(std::move(one));
    models_.push_back(model);
    if (!wants_bodies) return {};
    RMP_TRY_ASSIGN(auto bodies, ctx_.app.derived.robot_bodies(ctx_.snapshot(), id, ctx_.progress));
    std::vector<std::string> inexact, hidden, drawn;
    for (std::size_t b = 0; b < bodies.bodies.size(); ++b) {
      const std::string& part = b == 0 ? std::string("base") : robot.links[b - 1].name;
      const Pose at = b == 0 ? Pose{} : frames[b - 1];
      const ItemOfRobot link{static_cast<std::int32_t>(robots.size()) - 1,
                             b == 0 ? -1 : links[b - 1].joint};
      const auto number = static_cast<std::int32_t>(b) - 1;
      std::int32_t body = -1;
      const auto open = [&] {
        if (body < 0) body = group(part, at, self, link, number);
      };
      const auto add_tools = [&]() -> Result<void> {
        for (const model::AttachedTool& t : robot.attached) {
          if (t.link != number) continue;
          open();
          RMP_TRY(add(t.what, t.name, model::pose(t.placement), body));
        }
        return {};
      };
      if (bodies.is_generated[b]) {
        if (bodies.tools_from[b] > 0 && wants_exact_) inexact.push_back(text::quote(part));
        const std::size_t own = wants_exact_ ? 0 : bodies.tools_from[b];
        if (own > 0) {
          drawn.push_back(text::quote(part));
          open();
        }
        for (std::size_t k = 0; k < own; ++k) {
          evaluation::Drawable& d = bodies.bodies[b][k];
          ExportItem item;
          item.name = d.name.empty() ? part : d.name;
          item.parent = body;
          item.pose = d.placement;
          item.colour = d.colour;
          item.mesh = keep(d.mesh);
          set_only_drawn(item);
          items.push_back(std::move(item));
        }
        RMP_TRY(add_tools());
        continue;
      }
      const auto& parts = b == 0 ? robot.base_parts : robot.links[b - 1].parts;
      if (!parts.empty() && b > 0 && !robot.links[b - 1].visible) {
        hidden.push_back(text::quote(part));
      } else if (!parts.empty()) {
        open();
        for (const model::BodyPart& p : parts)
          RMP_TRY(add(p.what, ctx_.snapshot().find(p.what)->name, model::pose(p.placement), body));
      }
      RMP_TRY(add_tools());
    }
    if (!inexact.empty())
      notes.push_back("Robot " + text::quote(name) + " has no designed bodies for " +
                      text::enumerate_some(inexact, 6) +
                      "; what is drawn there is not exact and was left out.");
    if (!drawn.empty() && chord_ > 0)
      notes.push_back("The chord does not hold for what is drawn of robot " + text::quote(name) +
                      " where nothing is designed: " + text::enumerate_some(drawn, 6) + ".");
    if (!hidden.empty())
      notes.push_back("Links of robot " + text::quote(name) +
                      " that are not visible were left out: " + text::enumerate_some(hidden, 6) +
                      ".");
    return {};
  }

  /// Replaces all solids by what the plane (top_T_plane) cuts out of them.
  Result<void> cut(const Pose& plane) {
    std::vector<Pose> poses;
    std::vector<ExportItem> outlines;
    for (std::size_t i = 0; i < items.size(); ++i) {
      const ExportItem& item = items[i];
      poses.push_back(
          item.parent < 0
              ? item.pose
              : spatial::compose(poses[static_cast<std::size_t>(item.parent)], item.pose));
      if (solids_[i].number == 0) continue;
      const Pose solid_T_plane = spatial::compose(spatial::inverse(poses[i]), plane);
      const double chord = chord_ > 0 ? chord_ : ctx_.snapshot().get(solids_[i])->chord;
      RMP_TRY_ASSIGN(const auto profile,
                     ctx_.app.derived.section(ctx_.snapshot(), solids_[i], solid_T_plane, chord,
                                              ctx_.progress));
      if (profile->loops.empty()) continue;
      ExportItem outline;
      outline.name = item.name;
      outline.colour = item.colour;
      outline.profile = profile.get();
      profiles_.push_back(profile);
      outlines.push_back(std::move(outline));
    }
    if (outlines.empty())
      return error(ErrorCode::invalid_argument, "the plane cuts nothing",
                   "Give plane= a pose with x and y axes through the solid.", "plane");
    items = std::move(outlines);
    return {};
  }

  std::vector<ExportItem> items;
  std::vector<ExportRobot> robots;
  std::vector<std::string> notes;
  bool wants_bodies = true;  ///< of robots

  /// Of the only robot.
  void set_pairs(std::vector<ExportPair> pairs) {
    if (mechanisms_.size() == 1) mechanisms_.front().pairs = std::move(pairs);
  }

  /// `number` is the link's, -1 = the base.
  std::int32_t group(const std::string& name, const Pose& pose, std::int32_t parent,
                     ItemOfRobot link = {}, std::int32_t number = -1) {
    ExportItem item;
    if (link.robot >= 0) {
      set_robot_part(item, link);
      set_link(item, number);
    }
    item.name = name;
    item.parent = parent;
    item.pose = pose;
    push(std::move(item), {});
    return static_cast<std::int32_t>(items.size() - 1);
  }

 private:
  void push(ExportItem item, SolidId solid) {
    solids_.resize(items.size());
    solids_.push_back(solid);
    items.push_back(std::move(item));
  }
  const Mesh* keep(std::shared_ptr<const Mesh> mesh) {
    meshes_.push_back(std::move(mesh));
    return meshes_.back().get();
  }

  Result<void> add_solid(SolidId id, const std::string& name, const Pose& pose, std::int32_t parent,
                         MaterialId material) {
    const model::Solid* solid = ctx_.snapshot().get(id);
    if (!solid) return {};
    ExportItem item;
    item.name = name;
    item.parent = parent;
    item.pose = pose;
    item.definition = id.number;
    if (!material.number) material = solid->material;
    if (const auto* m = ctx_.snapshot().get(material)) item.colour = m->colour;
    if (wants_exact_) {
      RMP_TRY_ASSIGN(auto geometry, ctx_.app.derived.geometry(ctx_.snapshot(), id, ctx_.progress));
      item.geometry = geometry.get();
      geometries_.push_back(std::move(geometry));
    } else {
      RMP_TRY_ASSIGN(auto mesh, ctx_.app.derived.mesh(ctx_.snapshot(), id, chord_, ctx_.progress));
      item.mesh = keep(std::move(mesh));
      if (const auto p = primitive_of(*solid)) {
        primitives_.push_back(*p);
        set_primitive(item, &primitives_.back());
      }
    }
    std::string stand_in;
    // What is exact is exported without a mesh, and needs none to be told so.
    if (!item.geometry || item.geometry->form == CsgGeometry::Form::mesh) {
      RMP_TRY_ASSIGN(stand_in,
                     ctx_.app.derived.stand_in(ctx_.snapshot(), id, chord_, ctx_.progress));
    }
    const std::string note = ctx_.snapshot().describe(id) + ": " + stand_in;
    if (!stand_in.empty() && std::find(notes.begin(), notes.end(), note) == notes.end())
      notes.push_back(note);
    push(std::move(item), id);
    return {};
  }

  /// Boxes, cylinders and spheres that are the whole solid.
  static std::optional<ExportPrimitive> primitive_of(const model::Solid& s) {
    if (s.nodes.size() != 1) return std::nullopt;
    const model::SolidNode& n = s.nodes[0];
    ExportPrimitive p;
    double lift = 0;
    if (n.kind == CsgKind::box && n.sizes[3] == 0) {
      p.form = ExportPrimitive::Form::box;
      p.sizes = {n.sizes[0], n.sizes[1], n.sizes[2]};
      lift = n.sizes[2] / 2;
    } else if (n.kind == CsgKind::cylinder && n.sizes[2] == 0) {
      p.form = ExportPrimitive::Form::cylinder;
      p.sizes = {n.sizes[0], n.sizes[1], 0};
      lift = n.sizes[1] / 2;
    } else if (n.kind == CsgKind::sphere) {
      p.form = ExportPrimitive::Form::sphere;
      p.sizes = {n.sizes[0], 0, 0};
    } else {
      return std::nullopt;
    }
    p.pose = spatial::compose(
        model::pose(n.placement),
        spatial::compose(model::node_T_body(n), spatial::translation({0, 0, lift})));
    return p;
  }

  /// `plain`: without its attached tools as further tools.
  static ExportMechanism mechanism_of(const model::Robot& robot, const model::Robot& plain) {
    ExportMechanism out;
    const auto frames = robotics::link_frames(robot);
    const auto joints = robotics::link_joints(robot);
    for (std::size_t i = 0; i < robot.links.size(); ++i) {
      const model::Link& l = robot.links[i];
      ExportLink link;
      link.name = l.name;
      link.parent = l.parent;
      link.joint = frames[i].joint;
      link.joint_count = joints[i].joint_count;
      link.joint_T_link = frames[i].joint_T_link;
      link.is_row = !l.origin;
      link.has_mass = l.given && l.given->mass != 0;
      out.links.push_back(std::move(link));
    }
    const auto frame = [&](const std::string& name, std::int32_t link, const Pose& pose) {
      ExportFrame f;
      f.name = name;
      f.link = link;
      f.pose = pose;
      out.frames.push_back(std::move(f));
    };
    for (const model::RobotTool& t : robot.tools) frame(t.name, t.link, model::pose(t.placement));
    // The last link carries the tool for whoever reads the file.
    const Pose at = model::pose(robot.tool);
    if (at.p != Vec3{} || at.R != Pose{}.R || !robot.tools.empty())
      frame("tool", static_cast<std::int32_t>(robot.links.size()) - 1, at);
    for (const model::NamedPose& p : robot.poses) out.poses.push_back({p.name, p.q});
    bool has_payload = robot.payload.has_value();
    for (const model::RobotTool& t : robot.tools) has_payload = has_payload || t.payload;
    if (!plain.attached.empty())
      out.left_out.emplace_back(
          "Attached tools were written as bodies, masses and frames of the links that carry them.");
    if (has_payload) out.left_out.emplace_back("Payloads were added to the links that carry them.");
    if (!robot.pair_rules.empty())
      out.left_out.emplace_back("Rules of which bodies may touch were left out.");
    if (!robot.parametric.parameters.empty() || !robot.parametric.expressions.empty())
      out.left_out.emplace_back("Expressions were written as the numbers that they have now.");
    return out;
  }

  CommandContext& ctx_;
  bool wants_exact_;
  double chord_;
  std::vector<SolidId> solids_;  ///< of each item; number 0 = none
  std::deque<std::shared_ptr<const Mesh>> meshes_;
  std::deque<std::shared_ptr<const RobotModel>> models_;
  std::deque<ExportMechanism> mechanisms_;
  std::deque<MassProperties> masses_;
  std::deque<ExportPrimitive> primitives_;
  std::deque<std::shared_ptr<const CsgGeometry>> geometries_;
  std::deque<std::shared_ptr<const CsgProfile>> profiles_;
};

Result<void> collect(CommandContext& ctx, AnyId id, Items& out) {
  const std::string& name = ctx.snapshot().find(id)->name;
  if (id.kind == Kind::robot) return out.add_robot(RobotId{id.number}, name, {}, {});
  if (id.kind != Kind::world) return out.add(id, name, {}, -1);
  const model::World& world = *ctx.snapshot().get(WorldId{id.number});
  for (const model::PlacedObject& o : world.objects)
    RMP_TRY(out.add(o.what, o.name, model::pose(o.placement), -1));
  for (const model::PlacedRobot& r : world.robots)
    RMP_TRY(out.add_robot(r.robot, r.name, model::pose(r.placement), r.q));
  return {};
}

/// The plane a drawing is cut at: the given one, else level at half the height.
Result<Pose> drawing_plane(CommandContext& ctx, const Map& args, AnyId id) {
  if (const Value* given = args.find("plane"); given && !given->is_nil())
    if (const auto pose = pose_from(*given)) return *pose;
  if (id.kind != Kind::solid && id.kind != Kind::object)
    return error(ErrorCode::invalid_argument, "plane is missing",
                 "Give the pose of the cutting plane, or as = \"mesh\".", "plane");
  RMP_TRY_ASSIGN(const auto box, ctx.app.derived.bounds(ctx.snapshot(), id, ctx.progress));
  Pose plane;
  plane.p[2] = 0.5 * (box[0][2] + box[1][2]);
  ctx.app.messages.post(Severity::info, "export_note",
                        "The drawing is the section at half the height, z = " +
                            text::print_rounded(plane.p[2] * 1e3) +
                            " mm. Give plane= for another, or as = \"mesh\".",
                        "export");
  return plane;
}

struct Exported {
  std::string file;
  std::vector<std::string> others, notes;
  std::size_t parts = 0, triangles = 0;
  std::vector<ExportReport::Count> counts;
};

/// What an export may have that is no argument of all exports.
struct ExportExtras {
  std::string file;               ///< instead of the argument
  std::vector<ExportPair> pairs;  ///< of a robot
  bool may_replace = true;        ///< files that are there
};

/// Writes a record by the provider that writes files of the extension.
Result<Exported> export_record(CommandContext& ctx, AnyId id, const Map& args,
                               const std::string& extension, const Map& options,
                               ExportExtras extras = {}) {
  Exported done;
  done.file = extras.file.empty() ? text_of(args, "file") : extras.file;
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Exporter>(ctx, extension, "export"));
  RMP_TRY_ASSIGN(const auto params,
                 params_for(chosen.info, args, options, {"unit", "schema"}, done.file));
  const bool is_drawing = extension == "dxf" && text_of(args, "as") != "mesh";
  if (!is_drawing && args.find("plane") && !args.find("plane")->is_nil())
    return error(ErrorCode::invalid_argument, "plane is for drawings (.dxf) only", "Leave it out.",
                 "plane");
  const bool is_exact = chosen.provider->is_exact(extension);
  if (is_exact && has(args, "chord"))
    return error(ErrorCode::invalid_argument, "." + extension + " files hold exact surfaces",
                 "Leave chord out.", "chord");
  Items out(ctx, is_exact, has(args, "chord") ? real(args, "chord") : 0);
  out.wants_bodies = !params->has("bodies") || params->boolean("bodies");
  RMP_TRY(collect(ctx, id, out).in(name_in(ctx, id)));
  out.set_pairs(std::move(extras.pairs));
  if (is_drawing) {
    RMP_TRY_ASSIGN(const Pose plane, drawing_plane(ctx, args, id));
    RMP_TRY(out.cut(plane).in(name_in(ctx, id)));
  }
  for (const ExportItem& item : out.items) {
    done.parts += item.mesh || item.geometry || item.profile ? 1U : 0U;
    done.triangles += item.mesh ? item.mesh->triangle_count() : 0U;
  }
  const auto& tags = chosen.info.tags;
  const bool writes_robots = std::find(tags.begin(), tags.end(), "robots") != tags.end();
  if (done.parts == 0 && !(writes_robots && !out.robots.empty()))
    return error(ErrorCode::invalid_argument, "there is nothing in it to export",
                 "Add a solid or an object first.", name_in(ctx, id));
  ExportReport report;
  ExportTask task;
  const std::string own_name = std::filesystem::path(done.file).filename().string();
  task.extension = extension;
  task.name = own_name;
  task.items = out.items;
  task.robots = out.robots;
  task.report = &report;
  auto files = guarded(chosen.info.name,
                       [&] { return chosen.provider->write(task, *params, ctx.progress); });
  if (!files.ok()) return std::move(files).in(name_in(ctx, id)).error();
  if (!extras.may_replace) RMP_TRY(check_new(*files, done.file));
  std::vector<std::filesystem::path> replaced;
  for (const ExportedFile& f : *files)
    if (f.name == own_name && file_kind(done.file) == FileKind::file &&
        !io::file_holds(done.file, f.bytes))
      replaced.emplace_back(done.file);
  RMP_TRY(write_exported(*files, done.file).in(name_in(ctx, id)));
  report_replaced(ctx, Severity::info, replaced);
  const auto folder = std::filesystem::path(done.file).parent_path();
  for (const ExportedFile& f : *files)
    if (f.name != own_name) done.others.push_back((folder / f.name).string());
  done.notes = std::move(report.notes);
  done.notes.insert(done.notes.end(), out.notes.begin(), out.notes.end());
  done.counts = std::move(report.counts);
  for (const std::string& note : done.notes)
    ctx.app.messages.post(Severity::info, "export_note", note, "export");
  return done;
}

List texts(const std::vector<std::string>& all) { return {all.begin(), all.end()}; }

Result<Value> export_any(CommandContext& ctx, AnyId id, const Map& args) {
  const std::string extension = extension_of(text_of(args, "file"));
  RMP_TRY_ASSIGN(const Exported done, export_record(ctx, id, args, extension, {}));
  Map out{{"file", done.file},
          {"parts", done.parts},
          {"triangles", done.triangles},
          {"others", texts(done.others)},
          {"notes", texts(done.notes)}};
  return Value(std::move(out));
}

Result<Value> export_urdf(CommandContext& ctx, const Map& args) {
  Map options;
  for (const char* name : {"package", "bodies"})
    if (has(args, name)) options.set(name, *args.find(name));
  RMP_TRY_ASSIGN(const Exported done, export_record(ctx, ref(args, "id"), args, "urdf", options));
  Map out{{"file", done.file}, {"meshes", texts(done.others)}, {"notes", texts(done.notes)}};
  for (const ExportReport::Count& c : done.counts) out.set(c.what, c.count);
  return Value(std::move(out));
}

/// "My arm" gives "my_arm_description".
std::string package_of(const std::string& robot) {
  std::string out;
  for (char c : robot) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (is_plain) out += c;
    else if (!out.empty() && out.back() != '_') out += '_';
  }
  if (out.empty() || (out[0] >= '0' && out[0] <= '9')) out = "robot_" + out;
  return out + (out.back() == '_' ? "" : "_") + "description";
}

Result<Value> export_ros2(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  Map options;
  for (const char* name : {"bodies", "description", "maintainer", "email", "licence", "version",
                           "group", "hardware", "command", "rate"})
    if (has(args, name)) options.set(name, *args.find(name));
  const std::string package =
      has(args, "package") ? text_of(args, "package") : package_of(ctx.snapshot().find(id)->name);
  options.set("package", package);
  ExportExtras extras;
  const std::filesystem::path folder = std::filesystem::path(text_of(args, "folder")) / package;
  extras.file = (folder / "package.xml").string();
  extras.may_replace = flag(args, "overwrite");
  const auto samples = static_cast<std::size_t>(integer(args, "samples"));
  std::vector<std::string> notes;
  if (samples > 0) {
    RMP_TRY_ASSIGN(extras.pairs, export_pairs(ctx, RobotId{id.number}, samples,
                                              static_cast<std::uint64_t>(integer(args, "seed"))));
  } else {
    notes.emplace_back("No pairs of links were looked for that need no check for collision.");
  }
  const std::size_t pairs = extras.pairs.size();
  RMP_TRY_ASSIGN(Exported done, export_record(ctx, id, args, "xml", options, std::move(extras)));
  notes.insert(notes.begin(), done.notes.begin(), done.notes.end());
  std::vector<std::string> files = std::move(done.others);
  files.push_back(done.file);
  Map out{{"package", package},
          {"folder", folder.string()},
          {"files", texts(files)},
          {"disabled_pairs", pairs},
          {"notes", texts(notes)}};
  for (const ExportReport::Count& c : done.counts) out.set(c.what, c.count);
  return Value(std::move(out));
}

Result<Value> export_what(CommandContext& ctx, const Map& args) {
  return export_any(ctx, ref(args, "what"), args);
}
Result<Value> export_id(CommandContext& ctx, const Map& args) {
  return export_any(ctx, ref(args, "id"), args);
}

// --- table ---------------------------------------------------------------------------------

ParamSpec maybe_choice(std::string name, std::vector<std::string> choices, std::string doc) {
  ParamSpec p = choice(std::move(name), std::move(choices), std::move(doc));
  p.default_value.reset();
  p.required = false;
  return p;
}

constexpr const char* kOptions =
    "Parameters of the format's provider by name; `provider.params` lists them.";

Schema export_params(ParamSpec first) {
  ParamSpec plane = optional("plane", "pose", "",
                             "Of a drawing: the section plane, cut along its x and y; by default "
                             "horizontal at half the height.");
  return {std::move(first),
          needed("file", "path", "", "The file; its extension selects the format."),
          maybe_choice("unit", {"mm", "cm", "m", "in", "ft"},
                       "Length unit of the file; default: mm. GLB is always in metres."),
          maybe_choice("schema", {"ap214", "ap203", "ap242"},
                       "Application protocol of a STEP file; default: ap214."),
          above_zero(optional("chord", "real", "m",
                              "Greatest deviation of triangles, or of curves in a drawing; by "
                              "default the chord of each solid.")),
          choice("as", {"section", "mesh"}, "Content of a DXF file."),
          optional("options", "map", "", kOptions),
          std::move(plane)};
}

const char* const kFormats =
    "| extension | content |\n"
    "|---|---|\n"
    "| `.step`, `.stp` | exact solids, names, colours, assemblies with shared parts |\n"
    "| `.iges`, `.igs` | exact solids, names, colours |\n"
    "| `.stl`, `.obj`, `.ply` | one mesh; the file states no unit |\n"
    "| `.glb` | meshes, names, colours, assemblies; metres, y up |\n"
    "| `.3mf` | meshes, names, colours, assemblies |\n"
    "| `package.xml` | a ROS 2 package as of `robot.export_ros2`, without the pairs that need no "
    "check; `provider.params` of `ros2_package` |\n"
    "| `.urdf` | one robot: links, joints, masses, limits, shapes; `provider.params` of `urdf` |\n"
    "| `.dxf` | the section at a plane (lines, arcs, circles, splines), or the mesh as faces |\n";

const char* const kBlock =
    "local block = solid.create{name = \"block\", root = {kind = \"box\", x = 0.1, y = 0.1, z = "
    "0.02}}\n";
std::string with_block(const char* rest) { return std::string(kBlock) + rest; }

}  // namespace

RMP_COMMANDS(exchange_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "import",
       .classic = "",
       .summary = "Reads solids from a CAD or mesh file, or a robot from URDF, MJCF or SDF.",
       .details =
           "Exact solids come from STEP (AP203, AP214, AP242) and IGES, meshes from STL, OBJ, PLY, "
           "glTF, GLB, DAE (COLLADA), 3MF and DXF; plugins may add formats. Each part becomes a "
           "solid with one `imported` node, an assembly becomes an object, and copies share their "
           "solid. Files are read in a separate process; if it fails nothing is created, and a "
           "successful import is one step. Messages report what was repaired, left out or assumed. "
           "A mesh that does not bound a clean solid (open or self-intersecting) is drawn and "
           "collides unchanged, and has the mass that its triangles enclose; a message reports "
           "each such mesh, and `solid.mesh_faults` shows the places.\n\n"
           "Masses in such files are ignored. Each colour becomes a material with the density of "
           "aluminium unless `density` or `material` is given; a message reports this.\n\n"
           "Robots come from URDF (`.urdf`), MJCF (`.xml`, `.mjcf`) and SDF (`.sdf`), with the "
           "masses, limits and friction given in the file; meshes are read from the files it "
           "names, and a message lists every file that was read.",
       .example =
           with_block("block:export(\"example.step\")\nlocal made = import{file = "
                      "\"example.step\", name = \"copy\"}\nassert(made[1].name == \"copy\")"),
       .params = {needed("file", "path", "", "The file; its extension selects the format."),
                  optional("name", "string", "",
                           "Name of the new record; by default that of the file."),
                  maybe_choice("unit", {"auto", "mm", "cm", "m", "in", "ft"},
                               "Length unit of a file that does not state one (STL, OBJ, PLY, some "
                               "DXF); default: mm, with a message."),
                  optional("material", "ref:material", "", "Material of all imported solids."),
                  above_zero(optional("density", "real", "kg/m^3",
                                      "Density of the materials created from the file's colours.")),
                  optional("heal", "bool", "", "Repair faulty geometry; default: true."),
                  maybe_choice(
                      "shapes", {"visual", "collision"},
                      "Of a robot's file: the shapes that its links get; default: visual."),
                  optional("options", "map", "", kOptions)},
       .returns = {"list", "", "Handles of all new records, the main one first.", {}},
       .effect = Effect::files_read | Effect::edits,
       .sometimes = Effect::processes,
       .run = import_file});
  all.push_back(
      {.name = "import_profile",
       .classic = "",
       .summary = "Reads the closed outlines of a drawing (DXF) as a profile.",
       .details = "Prisms and revolutions take such a profile. LINE, ARC, CIRCLE, ELLIPSE, "
                  "LWPOLYLINE, POLYLINE and SPLINE are read, also in blocks; pieces are joined end "
                  "to end in any order.",
       .example = with_block("block:export(\"example.dxf\")\nlocal profile = import_profile{file = "
                             "\"example.dxf\"}\nassert(#profile == 1)"),
       .params = {needed("file", "path", "", "The file, *.dxf."),
                  maybe_choice("unit", {"auto", "mm", "cm", "m", "in", "ft"},
                               "Length unit if the drawing does not state one; default: mm, with a "
                               "message.")},
       .returns = {"list", "", "The loops of the profile.", {}},
       .effect = Effect::files_read,
       .sometimes = Effect::processes,
       .run = import_profile});
  const std::vector<ParamSpec> fields{
      field("file", "string", "", "The file."), field("parts", "int", "", "Number of parts in it."),
      field("triangles", "int", "", "Number of triangles in it."),
      field("others", "list", "", "Additional files written."),
      field("notes", "list", "", "Changes and omissions, one sentence each.")};
  const auto add = [&](std::string name, std::string what, ParamSpec first, std::string example,
                       auto run) {
    all.push_back({.name = std::move(name),
                   .classic = "",
                   .summary = "Writes " + what + " as a CAD or mesh file.",
                   .details = std::string(kFormats) +
                              "\nMeshes are as fine as the `chord` of their solids, or as `chord` "
                              "here. Generated bodies of robots keep their chord.",
                   .example = std::move(example),
                   .params = export_params(std::move(first)),
                   .returns = {"map", "", "", fields},
                   .effect = Effect::files_write,
                   .sometimes = Effect::processes,
                   .run = run});
  };
  add("export", "a solid, object, robot or world",
      needed("what", "ref:solid|object|robot|world", "", "The record to write."),
      with_block("assert(export{what = block, file = \"example.step\"}.parts == 1)"), export_what);
  add("solid.export", "a solid", self("solid"),
      with_block("assert(block:export(\"example.stl\").triangles == 12)"), export_id);
  add("object.export", "an object", self("object"),
      with_block("local o = object.create{name = \"o\", parts = {{what = \"block\"}}}\n"
                 "assert(o:export(\"example.glb\").triangles == 12)"),
      export_id);
  add("world.export", "all objects and robots of a world", self("world"),
      with_block("local w = world.create{name = \"w\"}\nw:add_object{what = \"block\", name = "
                 "\"b\"}\nassert(w:export(\"example.3mf\").parts == 1)"),
      export_id);
  all.push_back(
      {.name = "robot.export_urdf",
       .classic = "",
       .summary = "Writes the robot as a URDF file with separate mesh files.",
       .details = "Links, joints, limits, masses, friction and followers are written as URDF "
                  "elements; boxes, cylinders and spheres are exact, other bodies become STL files "
                  "in a folder `<file>_meshes`. Properties that URDF cannot express are written in "
                  "an element `<robomosp>` of the joint, which other programs ignore (motor "
                  "inertia, springs, passive joints, uneven friction, limits of acceleration), or "
                  "are left out (closed loops, poses). `notes` lists all of these, one sentence "
                  "each. Masses are those used by the solvers, payloads included. `import` reads "
                  "the file back with equal poses and torques, except as listed in `notes`.",
       .example = with_arm("local done = arm:export_urdf{file = \"example.urdf\"}\n"
                           "assert(done.joints >= 6)\nlocal back = import{file = \"example.urdf\", "
                           "name = \"back\"}\nassert(back[1].name == \"back\")"),
       .params = {self("robot"), needed("file", "path", "", "The file, *.urdf."),
                  optional(
                      "package", "string", "",
                      "ROS package of the file: meshes are then named package://<package>/..."),
                  defaulted("bodies", "bool", "", true,
                            "False omits the shapes: only joints and masses are written.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."),
                    field("links", "int", "", "Number of links in it."),
                    field("joints", "int", "", "Number of joints in it, including fixed ones."),
                    field("meshes", "list", "", "The mesh files written."),
                    field("notes", "list", "", "Changes and omissions, one sentence each.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = export_urdf});
  all.push_back(
      {.name = "robot.export_ros2",
       .classic = "",
       .summary = "Writes the robot as a description package of ROS 2.",
       .details =
           "A folder with package.xml, CMakeLists.txt, the URDF with its meshes and a ros2_control "
           "system (mock components unless `hardware` names another plugin), an SRDF with groups, "
           "named poses and the pairs of links that need no collision check, settings of "
           "controllers, joint limits and kinematics, and a launch file. Pairs are found as by "
           "`robot.find_allowed_pairs`: Adjacent, Never and Always, and User for the robot's "
           "rules; a pair that touched in none of the samples may still touch between them. Names "
           "that ROS 2 does not accept are rejected, and so are existing files unless overwrite = "
           "true. The provider ros2_package has further options.",
       .example = with_arm("local done = arm:export_ros2{folder = \"ros2\", samples = 100}\n"
                           "assert(done.package == \"arm_description\" and #done.files >= 8)\n"
                           "assert(done.joints >= 6)"),
       .params =
           {self("robot"),
            needed("folder", "path", "",
                   "Folder in which the package's folder is created, such as src of a workspace."),
            optional("package", "string", "",
                     "Name of the package; by default that of the robot followed by _description."),
            defaulted("overwrite", "bool", "", false, "Replace existing files."),
            defaulted("bodies", "bool", "", true,
                      "False omits the shapes: only joints and masses are written."),
            between(
                defaulted(
                    "samples", "int", "", 10000,
                    "Random configurations in which pairs are checked; 0 = no pairs are searched."),
                0, 10000000),
            defaulted("seed", "int", "", 1, "Seed of the random numbers."),
            optional("group", "string", "", "Name of the planning group; default: manipulator."),
            optional("hardware", "string", "",
                     "Plugin of ros2_control; default: mock_components/GenericSystem."),
            maybe_choice("command", {"position", "velocity", "effort"},
                         "Command interface of the joints; default: position."),
            optional("rate", "real", "Hz", "Update rate of the controllers; default: 100 Hz."),
            optional("description", "string", "", "Description of the package in package.xml."),
            optional("maintainer", "string", "", "Name of the maintainer in package.xml."),
            optional("email", "string", "", "Email address of the maintainer."),
            optional("licence", "string", "", "Licence of the package."),
            optional("version", "string", "", "Version of the package, such as 0.1.0.")},
       .returns = {"map",
                   "",
                   "",
                   {field("package", "string", "", "Its name."),
                    field("folder", "string", "", "Folder of the package."),
                    field("files", "list", "", "All files written."),
                    field("links", "int", "", "Number of links of the URDF."),
                    field("joints", "int", "", "Number of its joints, including fixed ones."),
                    field("disabled_pairs", "int", "", "Number of pairs that need no check."),
                    field("notes", "list", "", "Changes and omissions, one sentence each.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = export_ros2});
  return all;
}

}  // namespace robomosp::ioci
