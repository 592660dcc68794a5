// SPDX-License-Identifier: Apache-2.0
// Robots in: URDF, MJCF and SDF; and out: URDF, and packages of ROS 2 (layer: plugin).
#include <filesystem>
#include <string>

#include <robomosp/sdk/host.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/plugin.h>

#include "files.h"
#include "read.h"
#include "ros2_package.h"
#include "urdf_writer.h"

namespace robomosp::robot_files {
namespace {

constexpr std::uintmax_t kMostFileBytes = std::uintmax_t{64} << 20;

const rmp_param kImportParams[] = {
    {"name", "string", "", "Name of the robot; empty = that of the file.", "", nullptr, 1, 0},
    {"shapes", "enum", "", "Shapes for the links.", "visual", "visual|collision", 1, 0},
    {"outside", "bool", "", "Also open files outside the robot's package.", "false", nullptr, 1, 0},
};

const rmp_param kExportParams[] = {
    {"package", "string", "",
     "ROS package of the file: meshes are then named package://<package>/...", "", nullptr, 1, 0},
    {"bodies", "bool", "", "False omits the shapes: only joints and masses are written.", "true",
     nullptr, 1, 0},
};

const rmp_param kPackageParams[] = {
    {"package", "string", "", "Name of the package.", "", nullptr, 1, 0},
    {"bodies", "bool", "", "False omits the shapes: only joints and masses are written.", "true",
     nullptr, 1, 0},
    {"description", "string", "", "Description in package.xml.", "", nullptr, 1, 0},
    {"maintainer", "string", "", "Name of the maintainer in package.xml.", "The maintainer",
     nullptr, 1, 0},
    {"email", "string", "", "Address of the maintainer in package.xml.", "maintainer@example.org",
     nullptr, 1, 0},
    {"licence", "string", "", "Licence of the package.", "Proprietary", nullptr, 1, 0},
    {"version", "string", "", "Version of the package: three numbers.", "0.1.0", nullptr, 1, 0},
    {"group", "string", "",
     "Planning group of the SRDF; for several chains the beginning of their names.", "manipulator",
     nullptr, 1, 0},
    {"hardware", "string", "", "Plugin of ros2_control that drives the joints.",
     "mock_components/GenericSystem", nullptr, 1, 0},
    {"command", "enum", "", "Command interface of the joints.", "position",
     "position|velocity|effort", 1, 0},
    {"rate", "real", "Hz", "Update rate of the controllers.", "100", nullptr, 1, 10000},
};

class RobotImporter final : public Importer {
 public:
  explicit RobotImporter(const rmp_host* host) { files::use(host); }
  std::string_view extensions() const override { return "urdf,mjcf,xml,sdf,world,xacro"; }

  Result<Imported> read(std::string_view path, const Params& params, Progress&) const override {
    const std::filesystem::path file{std::string(path)};
    const std::string where = "file \"" + std::string(path) + "\"";
    if (!files::is_file(file))
      return error(ErrorCode::not_found, "there is no file \"" + std::string(path) + "\"",
                   "Check the path.");
    const auto text = files::read(file, kMostFileBytes);
    if (!text.ok()) {
      std::error_code failed;
      if (std::filesystem::file_size(file, failed) > kMostFileBytes && !failed)
        return error(ErrorCode::unsupported, "it has more than 64 MiB",
                     "Store meshes in separate files.", where);
      return error(ErrorCode::not_found, "it cannot be read", "Check its permissions.", where);
    }
    Options options;
    options.folder = file.parent_path();
    options.file = file;
    options.source = file.filename().string();
    options.name = params.text("name");
    options.collision = params.text("shapes") == "collision";
    options.reach = params.boolean("outside") ? std::make_shared<Reach>()
                                              : std::make_shared<Reach>(options.folder);
    return read_robot(*text, options).in(where);
  }
};

/// What STL files are written with: metres.
class InMetres final : public Params {
 public:
  bool has(std::string_view name) const override { return name == "unit"; }
  double real(std::string_view) const override { return 0; }
  long long integer(std::string_view) const override { return 0; }
  bool boolean(std::string_view) const override { return false; }
  std::string_view text(std::string_view name) const override {
    return name == "unit" ? "m" : std::string_view();
  }
  std::span<const double> reals(std::string_view) const override { return {}; }
  Pose pose(std::string_view) const override { return {}; }
};

/// What writes the meshes: the host's provider of STL files.
class Meshes {
 public:
  explicit Meshes(const rmp_host* host) : host_(host) {}
  /// While both arguments live.
  StlWriter writer(std::unique_ptr<Exporter>& stl, Progress& progress) const {
    return [this, &stl, &progress](const ExportItem& item) -> Result<std::string> {
      const InMetres metres;
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the export was cancelled");
      if (!stl) {
        RMP_TRY_ASSIGN(stl, stl_exporter());
      }
      ExportItem alone = item;
      alone.parent = -1;
      alone.pose = Pose{};
      ExportTask part;
      part.extension = "stl";
      part.name = "part.stl";
      part.items = std::span(&alone, 1);
      RMP_TRY_ASSIGN(auto files, stl->write(part, metres, progress));
      for (ExportedFile& f : files)
        if (f.name == part.name) return std::move(f.bytes);
      return error(ErrorCode::plugin_failed, "the provider of STL files wrote no file");
    };
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<Exporter>> stl_exporter() const {
    for (const std::string& name : host_.names<Exporter>()) {
      RMP_TRY_ASSIGN(auto made, host_.create<Exporter>(name));
      const std::string known = "," + std::string(made->extensions()) + ",";
      if (known.find(",stl,") != std::string::npos) return made;
    }
    return error(ErrorCode::unsupported, "no plugin can write STL files for its bodies",
                 "plugin.list shows the plugins found; bodies = false exports without bodies.");
  }
  Host host_;
};

ExportReport& report_of(const ExportTask& task, ExportReport& unread) {
  const bool takes_report =
      task.struct_size >= offsetof(ExportTask, report) + sizeof task.report && task.report;
  return takes_report ? *task.report : unread;
}

class RobotExporter final : public Exporter {
 public:
  explicit RobotExporter(const rmp_host* host) : meshes_(host) {}
  std::string_view extensions() const override { return "urdf"; }
  bool is_exact(std::string_view) const override { return false; }

  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& progress) const override {
    const UrdfWishes wishes{std::string(params.text("package")), params.boolean("bodies")};
    std::unique_ptr<Exporter> stl;
    ExportReport unread;
    return write_urdf(task, wishes, meshes_.writer(stl, progress), report_of(task, unread));
  }

 private:
  Meshes meshes_;
};

class PackageExporter final : public Exporter {
 public:
  explicit PackageExporter(const rmp_host* host) : meshes_(host) {}
  std::string_view extensions() const override { return "xml"; }
  bool is_exact(std::string_view) const override { return false; }

  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params& params,
                                          Progress& progress) const override {
    const auto text = [&](const char* name) { return std::string(params.text(name)); };
    Ros2Wishes wishes;
    wishes.package = text("package");
    wishes.description = text("description");
    if (wishes.description.empty() && !task.robots.empty())
      wishes.description = "The robot " + task.robots[0].name + ", written by ROBOMOSP.";
    wishes.maintainer = text("maintainer");
    wishes.email = text("email");
    wishes.licence = text("licence");
    wishes.version = text("version");
    wishes.group = text("group");
    wishes.hardware = text("hardware");
    wishes.command = text("command");
    wishes.rate = params.real("rate");
    wishes.with_bodies = params.boolean("bodies");
    std::unique_ptr<Exporter> stl;
    ExportReport unread;
    return write_ros2_package(task, wishes, meshes_.writer(stl, progress), report_of(task, unread));
  }

 private:
  Meshes meshes_;
};

}  // namespace
}  // namespace robomosp::robot_files

using robomosp::robot_files::PackageExporter, robomosp::robot_files::RobotExporter,
    robomosp::robot_files::RobotImporter;

RMP_PLUGIN("org.robomosp.robot_files", "0.1.0", "Apache-2.0",
           "Reads robots from URDF, MJCF and SDF, and writes URDF and packages of ROS 2.",
           RMP_PROVIDER(RobotImporter, "robot",
                        "URDF, MJCF (MuJoCo) and SDF (Gazebo): joints, masses, shapes.",
                        "robot,confined", robomosp::robot_files::kImportParams),
           RMP_PROVIDER(RobotExporter, "urdf", "URDF: joints, masses, limits, shapes.", "robots",
                        robomosp::robot_files::kExportParams),
           RMP_PROVIDER(PackageExporter, "ros2_package",
                        "Packages of ROS 2: URDF with ros2_control, SRDF, settings, launch file.",
                        "robots", robomosp::robot_files::kPackageParams))
