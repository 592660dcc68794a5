// SPDX-License-Identifier: Apache-2.0
#include "exchange/import_meshes.h"

#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <utility>

#include "kernel/executor.h"
#include "kernel/file_root.h"
#include "kernel/fingerprint.h"
#include "kernel/provider_guard.h"
#include "kernel/quiet_progress.h"
#include "kernel/schema.h"
#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::exchange {
namespace {

constexpr std::size_t kMostParts = 100000;

/// All meshes of what an importer made as one, where its objects place them; in metres. [any
/// thread]
Result<CsgGeometry> merged_mesh(const Exchange& with, Imported imported, const std::string& path) {
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
                                 with.library));
  CsgGeometry out;
  out.form = CsgGeometry::Form::mesh;
  std::vector<std::pair<AnyId, Pose>> stack{{loaded.id, Pose{}}};
  std::size_t seen = 0;
  while (!stack.empty()) {
    const auto [id, at] = stack.back();
    stack.pop_back();
    if (++seen > kMostParts) return error(ErrorCode::unsupported, "it has more than 100000 parts");
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
Result<CsgGeometry> foreign_mesh(const Exchange& with, const ForeignGeometry& f,
                                 Progress& progress) {
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Importer>(with, extension_of(f.path), "import"));
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
  return merged_mesh(with, std::move(read), f.path);
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

}  // namespace

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

Result<void> read_foreign(const Exchange& with, Imported& imported,
                          std::vector<std::string>& failed, std::vector<Fault>& left_out) {
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
    if (with.progress.cancelled()) return;
    QuietProgress quiet(with.progress);
    const ForeignGeometry& f = *files[i].asked;
    try {
      files[i].mesh = foreign_mesh(with, f, quiet);
    } catch (const std::exception& e) {
      files[i].mesh = error(ErrorCode::internal, std::string("reading it failed: ") + e.what());
    }
    const std::lock_guard lock(tell);
    with.progress.report(static_cast<double>(++done) / static_cast<double>(files.size()),
                         "reading " + std::filesystem::path(f.path).filename().string());
  });
  if (with.progress.cancelled()) return error(ErrorCode::cancelled, "the import was cancelled");
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

Result<void> drop_failed(document::Transaction& edit, io::Loaded& loaded,
                         const std::set<std::array<std::uint64_t, 2>>& failed) {
  if (failed.empty()) return {};
  std::set<AnyId> drop;
  for (const AnyId id : loaded.all)
    if (const auto* s = id.kind == Kind::solid ? edit.now().get(SolidId{id.number}) : nullptr)
      if (!s->nodes.empty() && s->nodes[0].geometry &&
          failed.contains(s->nodes[0].geometry->digest))
        drop.insert(id);
  for (const AnyId id : loaded.all)
    if (id.kind == Kind::robot)
      RMP_TRY(edit.edit(id, [&](model::Record& record) -> Result<void> {
        auto& r = std::get<model::Robot>(record.body);
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
  for (const AnyId id : drop) RMP_TRY(edit.remove(id));
  std::erase_if(loaded.all, [&](AnyId id) { return drop.contains(id); });
  return {};
}

}  // namespace robomosp::exchange
