// SPDX-License-Identifier: Apache-2.0
#include "exchange/export.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "exchange/export_items.h"
#include "exchange/exported_files.h"
#include "io/native.h"
#include "kernel/file_root.h"
#include "kernel/provider_guard.h"
#include "model/placement.h"

namespace robomosp::exchange {
namespace {

Result<void> collect(const document::Snapshot& records, AnyId id, ExportItems& out) {
  const std::string& name = records.find(id)->name;
  if (id.kind == Kind::robot) return out.add_robot(RobotId{id.number}, name, {}, {});
  if (id.kind != Kind::world) return out.add(id, name, {}, -1);
  const model::World& world = *records.get(WorldId{id.number});
  for (const model::PlacedObject& o : world.objects)
    RMP_TRY(out.add(o.what, o.name, model::pose(o.placement), -1));
  for (const model::PlacedRobot& r : world.robots)
    RMP_TRY(out.add_robot(r.robot, r.name, model::pose(r.placement), r.q));
  return {};
}

/// The plane a drawing is cut at: the given one, else level at half the height.
Result<Pose> drawing_plane(const Exchange& with, const ExportRequest& request, AnyId id) {
  if (request.plane) return *request.plane;
  if (id.kind != Kind::solid && id.kind != Kind::object)
    return error(ErrorCode::invalid_argument, "plane is missing",
                 "Give the pose of the cutting plane, or as = \"mesh\".", "plane");
  RMP_TRY_ASSIGN(const auto box, with.from.derived.bounds(with.from.snapshot, id, with.progress));
  Pose plane;
  plane.p[2] = 0.5 * (box[0][2] + box[1][2]);
  with.messages.post(Severity::info, "export_note",
                     "The drawing is the section at half the height, z = " +
                         text::print_rounded(plane.p[2] * 1e3) +
                         " mm. Give plane= for another, or as = \"mesh\".",
                     "export");
  return plane;
}

}  // namespace

Result<Exported> export_record(const Exchange& with, AnyId id, ExportRequest request) {
  Exported done;
  done.file = request.file;
  const std::string& extension = request.extension;
  RMP_TRY_ASSIGN(const auto chosen, provider_for<Exporter>(with, extension, "export"));
  RMP_TRY_ASSIGN(const auto params,
                 params_for(chosen.info, request.values, request.own, done.file));
  const bool is_drawing = extension == "dxf" && !request.as_mesh;
  if (!is_drawing && request.plane)
    return error(ErrorCode::invalid_argument, "plane is for drawings (.dxf) only", "Leave it out.",
                 "plane");
  const bool is_exact = chosen.provider->is_exact(extension);
  if (is_exact && request.chord > 0)
    return error(ErrorCode::invalid_argument, "." + extension + " files hold exact surfaces",
                 "Leave chord out.", "chord");
  ExportItems out(with, is_exact, request.chord);
  out.wants_bodies = !params->has("bodies") || params->boolean("bodies");
  RMP_TRY(collect(with.from.snapshot, id, out).in(with.from.snapshot.describe(id)));
  out.set_pairs(std::move(request.pairs));
  if (is_drawing) {
    RMP_TRY_ASSIGN(const Pose plane, drawing_plane(with, request, id));
    RMP_TRY(out.cut(plane).in(with.from.snapshot.describe(id)));
  }
  for (const ExportItem& item : out.items) {
    done.parts += item.mesh || item.geometry || item.profile ? 1U : 0U;
    done.triangles += item.mesh ? item.mesh->triangle_count() : 0U;
  }
  const auto& tags = chosen.info.tags;
  const bool writes_robots = std::find(tags.begin(), tags.end(), "robots") != tags.end();
  if (done.parts == 0 && !(writes_robots && !out.robots.empty()))
    return error(ErrorCode::invalid_argument, "there is nothing in it to export",
                 "Add a solid or an object first.", with.from.snapshot.describe(id));
  ExportReport report;
  ExportTask task;
  const std::string own_name = std::filesystem::path(done.file).filename().string();
  task.extension = extension;
  task.name = own_name;
  task.items = out.items;
  task.robots = out.robots;
  task.report = &report;
  auto files = guarded(chosen.info.name,
                       [&] { return chosen.provider->write(task, *params, with.progress); });
  if (!files.ok()) return std::move(files).in(with.from.snapshot.describe(id)).error();
  if (!request.may_replace) RMP_TRY(check_new(*files, done.file));
  for (const ExportedFile& f : *files)
    if (f.name == own_name && file_kind(done.file) == FileKind::file &&
        !io::file_holds(done.file, f.bytes))
      done.replaced.emplace_back(done.file);
  RMP_TRY(write_exported(*files, done.file).in(with.from.snapshot.describe(id)));
  const auto folder = std::filesystem::path(done.file).parent_path();
  for (const ExportedFile& f : *files)
    if (f.name != own_name) done.others.push_back((folder / f.name).string());
  done.notes = std::move(report.notes);
  done.notes.insert(done.notes.end(), out.notes.begin(), out.notes.end());
  done.counts = std::move(report.counts);
  return done;
}

}  // namespace robomosp::exchange
