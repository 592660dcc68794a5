// SPDX-License-Identifier: Apache-2.0
// Interfaces robomosp.importer/1 and robomosp.exporter/1: foreign files in and out
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// What an importer hands over: native text records (docs: file grammar) that may name each other
/// and, in `imported` nodes, the geometries.
struct ImportedFile {
  std::string name;  ///< native file name, e.g. "arm.rbt"
  std::string text;
};
struct ImportedGeometry {
  std::string name;  ///< as the records name it, e.g. "housing.brep"
  CsgGeometry geometry;
};
/// A geometry that stands in a mesh file of its own: the host has it read by the importer of that
/// file's extension, as one closed mesh. Where that fails, the solid that names it is left out.
struct ForeignGeometry {
  std::string name;        ///< as the records name it, e.g. "forearm.ply"
  std::string path;        ///< of the mesh file
  Vec3 scale{1, 1, 1};     ///< along the file's axes; negative = mirrored, never 0
  std::string unit = "m";  ///< of a file that states none: m, mm, cm, in or ft
};
struct Imported {
  std::vector<ImportedFile> records;  ///< the main one last
  std::vector<ImportedGeometry> geometries;
  std::vector<std::string> notes;  ///< every repair and every thing left out, a sentence each
  CsgProfile profile;              ///< closed outlines of a flat drawing; else no loops
  std::vector<ForeignGeometry> foreign;
};

/// Interface robomosp.importer/1. [any thread]
class Importer {
 public:
  using Interface = Importer;
  static constexpr const char* kInterfaceId = "robomosp.importer/1";
  virtual ~Importer() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Lower-case extensions without dot, comma-separated.
  [[nodiscard]] virtual std::string_view extensions() const = 0;
  virtual Result<Imported> read(std::string_view path, const Params&, Progress&) const = 0;
};

/// A node of what is exported: an assembly (no mesh), or a part; parents before children.
struct ExportItem {
  std::string name;
  std::int32_t parent = -1;
  Pose pose;  ///< parent_T_item
  Colour colour;
  const Mesh* mesh = nullptr;
  const CsgGeometry* geometry = nullptr;  ///< exact, where the exporter asked for it
  /// Items with equal definition [> 0] are copies of one part.
  std::uint64_t definition = 0;
  const CsgProfile* profile = nullptr;  ///< flat outlines in the item's xy plane, for drawings
  Room room{};
};

/// What an item is of a robot.
struct ItemOfRobot {
  std::int32_t robot = -1;  ///< into ExportTask::robots
  std::int32_t joint = -1;  ///< of its model, which carries the link; -1 = its base
};
/// Of the item that stands for a link or a base: all below it is that link's body. Else nothing.
[[nodiscard]] inline std::optional<ItemOfRobot> robot_part(const ExportItem& item) {
  if (item.room.words[0] == 0) return std::nullopt;
  return ItemOfRobot{static_cast<std::int32_t>(item.room.words[0]) - 1,
                     static_cast<std::int32_t>(item.room.words[1]) - 1};
}
/// For the host: numbers from 0, joints from -1.
inline void set_robot_part(ExportItem& item, ItemOfRobot part) {
  item.room.words[0] = static_cast<std::uint64_t>(part.robot + 1);
  item.room.words[1] = static_cast<std::uint64_t>(part.joint + 1);
}

/// A robot in what is exported. Its links' bodies are among the items (robot_part).
struct ExportRobot {
  std::string name;                   ///< where it stands: in the world, else the record's
  const RobotModel* model = nullptr;  ///< joints, limits, masses, as solvers see it
  Pose pose;                          ///< world_T_base
  std::vector<double> q;              ///< the configuration that the items are placed for
  Room room{};
};

/// What is to be written. Made by the host; may gain fields at the end.
struct ExportTask {
  std::uint32_t struct_size = sizeof(ExportTask);  ///< see plugin.h
  std::string_view extension;                      ///< of the main file, lower case, without dot
  std::string_view name;                           ///< of the main file, without folders
  std::span<const ExportItem> items;
  std::span<const ExportRobot> robots;
};

/// A file to be written. The host writes it atomically.
struct ExportedFile {
  std::string name;  ///< relative to the main file's folder; folders in it are made
  std::string bytes;
};

/// Interface robomosp.exporter/1. [any thread]
class Exporter {
 public:
  using Interface = Exporter;
  static constexpr const char* kInterfaceId = "robomosp.exporter/1";
  virtual ~Exporter() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Lower-case extensions without dot, comma-separated.
  [[nodiscard]] virtual std::string_view extensions() const = 0;
  /// Whether files of this extension hold exact solids, so that items need their geometry.
  [[nodiscard]] virtual bool is_exact(std::string_view extension) const = 0;
  /// The files: the main one, whose name is the task's, and any number beside it.
  virtual Result<std::vector<ExportedFile>> write(const ExportTask&, const Params&,
                                                  Progress&) const = 0;
};

}  // namespace robomosp
