// SPDX-License-Identifier: Apache-2.0
// Importer of robots: URDF, MJCF and SDF (layer: plugin).
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <robomosp/sdk/io.h>
#include <robomosp/sdk/plugin.h>

#include "read.h"

namespace robomosp::robot_files {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;

const rmp_param kParams[] = {
    {"name", "string", "", "Name of the robot; empty = the file's.", "", nullptr, 1, 0},
    {"shapes", "enum", "", "Which shapes the links get.", "visual", "visual|collision", 1, 0},
};

class RobotImporter final : public Importer {
 public:
  std::string_view extensions() const override { return "urdf,mjcf,xml,sdf,xacro"; }

  Result<Imported> read(std::string_view path, const Params& params, Progress&) const override {
    const std::filesystem::path file{std::string(path)};
    const std::string where = "file \"" + std::string(path) + "\"";
    std::error_code failed;
    if (!std::filesystem::is_regular_file(file, failed))
      return error(ErrorCode::not_found, "there is no file \"" + std::string(path) + "\"",
                   "Check the path.");
    if (std::filesystem::file_size(file, failed) > kMostBytes || failed)
      return error(ErrorCode::unsupported, "it has more than 64 MiB",
                   "Meshes belong into files of their own.", where);
    std::ifstream in(file, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (!in.good() && !in.eof())
      return error(ErrorCode::not_found, "it cannot be read", "Check its permissions.", where);
    Options options;
    options.folder = file.parent_path();
    options.file = file;
    options.source = file.filename().string();
    options.name = params.text("name");
    options.collision = params.text("shapes") == "collision";
    return read_robot(text, options).in(where);
  }
};

}  // namespace
}  // namespace robomosp::robot_files

using robomosp::robot_files::RobotImporter;

RMP_PLUGIN("org.robomosp.robot_files", "0.1.0", "Apache-2.0", "Robots from URDF, MJCF and SDF.",
           RMP_PROVIDER(RobotImporter, "robot",
                        "URDF, MJCF (MuJoCo) and SDF (Gazebo): joints, masses, shapes.", "robot",
                        robomosp::robot_files::kParams))
