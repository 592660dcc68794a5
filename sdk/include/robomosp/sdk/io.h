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
/// A geometry in a separate mesh file: the host has it read by the importer of that
/// file's extension, as one mesh, which need not be closed. Where that fails, the solid that names
/// it is left out.
struct ForeignGeometry {
  std::string name;        ///< as the records name it, e.g. "forearm.ply"
  std::string path;        ///< of the mesh file
  Vec3 scale{1, 1, 1};     ///< along the file's axes; negative = mirrored, never 0
  std::string unit = "m";  ///< of a file that states none: m, mm, cm, in or ft
};
struct Imported {
  std::vector<ImportedFile> records;  ///< the main one last
  std::vector<ImportedGeometry> geometries;
  std::vector<std::string> notes;  ///< every repair and every omission, a sentence each
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
/// Of the item of a link or a base: all below it is that link's body. Else nothing.
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

/// A solid that some formats say without triangles, in the item's frame. Its mesh comes too.
struct ExportPrimitive {
  enum class Form : std::int32_t { box, cylinder, sphere };
  Form form = Form::box;
  Pose pose;     ///< item_T_centre; a cylinder's axis is z
  Vec3 sizes{};  ///< box: lengths; cylinder: radius, height; sphere: radius [m]
};
/// nullptr = only the mesh defines it.
[[nodiscard]] inline const ExportPrimitive* primitive(const ExportItem& item) {
  return reinterpret_cast<const ExportPrimitive*>(static_cast<std::uintptr_t>(item.room.words[2]));
}
/// For the host. Both stay where they are while the exporter runs.
inline void set_primitive(ExportItem& item, const ExportPrimitive* p) {
  item.room.words[2] = reinterpret_cast<std::uintptr_t>(p);
}
/// Drawn for a link that nobody designed a body for: to be looked at, not to collide with.
[[nodiscard]] inline bool is_only_drawn(const ExportItem& item) {
  return (item.room.words[3] & 1U) != 0;
}
inline void set_only_drawn(ExportItem& item) { item.room.words[3] |= 1U; }
/// The link of ExportMechanism::links that an item with a robot_part() represents; -1 = the base.
[[nodiscard]] inline std::int32_t link_of(const ExportItem& item) {
  return static_cast<std::int32_t>(item.room.words[4]) - 1;
}
inline void set_link(ExportItem& item, std::int32_t link) {
  item.room.words[4] = static_cast<std::uint64_t>(link + 1);
}

/// A link of the robot as its author named it.
struct ExportLink {
  std::string name;              ///< may be empty
  std::int32_t parent = -1;      ///< into ExportMechanism::links, before this; -1 = the base
  std::int32_t joint = -1;       ///< of the model, its frame carries the link's; -1 = the base
  std::int32_t joint_count = 0;  ///< its own: `joint` and those right before it; 0 = it is fixed
  Pose joint_T_link;
  bool is_row = false;    ///< given by a Denavit-Hartenberg row
  bool has_mass = false;  ///< also true of a fixed link: its mass is part of the joint's body
  Room room{};
};
/// A frame on a link, such as a tool's.
struct ExportFrame {
  std::string name;
  std::int32_t link = -1;  ///< -1 = the base
  Pose pose;               ///< link_T_frame
  Room room{};
};
struct ExportPose {
  std::string name;
  std::vector<double> q;
};
/// Two links with bodies that need no check for collision with each other.
struct ExportPair {
  enum class Why : std::int32_t {
    adjacent,  ///< nothing but one joint between them
    never,     ///< they touch in none of many random configurations
    always,    ///< they touch in all of them
    rule,      ///< the robot's author said so
  };
  std::int32_t a = -1, b = -1;  ///< into ExportMechanism::links; -1 = the base
  Why why = Why::adjacent;
  std::string text;  ///< of a rule: its reason; may be empty
  Room room{};
};
/// What the model of an exported robot does not say. Made by the host; may gain fields at the end.
struct ExportMechanism {
  std::uint32_t struct_size = sizeof(ExportMechanism);  ///< see plugin.h
  std::vector<ExportLink> links;                        ///< parents before children
  std::vector<ExportFrame> frames;                      ///< tools; the current one last
  std::vector<ExportPose> poses;                        ///< named configurations
  /// What the record has and nothing here says, a sentence each.
  std::vector<std::string> left_out;
  std::vector<ExportPair> pairs;  ///< where the command computed them; check struct_size first
};

/// A robot in what is exported. Its links' bodies are among the items (robot_part).
struct ExportRobot {
  std::string name;                   ///< its name in the world, else the record's
  const RobotModel* model = nullptr;  ///< joints, limits, masses, as solvers see it
  Pose pose;                          ///< world_T_base
  std::vector<double> q;              ///< the configuration that the items are placed for
  Room room{};
};
/// Links, tools and poses of an exported robot; nullptr from a program that does not hand them out.
[[nodiscard]] inline const ExportMechanism* mechanism(const ExportRobot& robot) {
  return reinterpret_cast<const ExportMechanism*>(static_cast<std::uintptr_t>(robot.room.words[0]));
}
inline void set_mechanism(ExportRobot& robot, const ExportMechanism* m) {
  robot.room.words[0] = reinterpret_cast<std::uintptr_t>(m);
}
/// What of an exported robot does not move, in the frame of its base: the base, links fixed to it
/// and what these carry. nullptr = no mass of it is known, or the program does not hand it out.
[[nodiscard]] inline const MassProperties* standing_mass(const ExportRobot& robot) {
  return reinterpret_cast<const MassProperties*>(static_cast<std::uintptr_t>(robot.room.words[1]));
}
/// For the host. The mass stays where it is while the exporter runs.
inline void set_standing_mass(ExportRobot& robot, const MassProperties* m) {
  robot.room.words[1] = reinterpret_cast<std::uintptr_t>(m);
}

/// What an exporter reports of what it wrote. Made by the host; may gain fields at the end.
struct ExportReport {
  struct Count {
    std::string what;  ///< plural, such as "links"
    std::int64_t count = 0;
  };
  std::uint32_t struct_size = sizeof(ExportReport);  ///< see plugin.h
  std::vector<std::string> notes;  ///< what was changed or left out, a sentence each
  std::vector<Count> counts;
};

/// What is to be written. Made by the host; may gain fields at the end.
struct ExportTask {
  std::uint32_t struct_size = sizeof(ExportTask);  ///< see plugin.h
  std::string_view extension;                      ///< of the main file, lower case, without dot
  std::string_view name;                           ///< of the main file, without folders
  std::span<const ExportItem> items;
  std::span<const ExportRobot> robots;
  ExportReport* report = nullptr;  ///< to be added to; check struct_size first
};

/// A file to be written. The host writes it atomically.
struct ExportedFile {
  std::string name;  ///< relative to the main file's folder; folders in it are made
  std::string bytes;
};

/// Interface robomosp.exporter/1. A provider with the tag "robots" writes robots themselves
/// (joints, masses, limits), not only their bodies. [any thread]
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
  /// The files: the main one, with the task's name, and any number of others.
  virtual Result<std::vector<ExportedFile>> write(const ExportTask&, const Params&,
                                                  Progress&) const = 0;
};

}  // namespace robomosp
