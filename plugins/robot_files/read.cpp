// SPDX-License-Identifier: Apache-2.0
#include "read.h"

#include <tinyxml2.h>

#include <algorithm>

#include "records.h"

namespace robomosp::robot_files {
namespace {

bool names_xacro(const Element& root) {
  for (const auto* a = root.FirstAttribute(); a; a = a->Next())
    if (std::string_view(a->Name()) == "xmlns:xacro") return true;
  return false;
}

/// An element of xacro's own, anywhere; the search needs no stack.
bool uses_xacro(const Element& root) {
  const tinyxml2::XMLNode* n = &root;
  while (n) {
    if (const Element* e = n->ToElement())
      if (std::string_view(e->Name()).starts_with("xacro:")) return true;
    if (n->FirstChild()) {
      n = n->FirstChild();
      continue;
    }
    while (n && n != &root && !n->NextSibling()) n = n->Parent();
    n = !n || n == &root ? nullptr : n->NextSibling();
  }
  return false;
}

}  // namespace

Result<Imported> read_robot(std::string_view text, Options options) {
  if (!options.reach) options.reach = std::make_shared<Reach>(options.folder);
  Documents documents(options.reach);
  RMP_TRY_ASSIGN(const Element* root, documents.parse(text, options.file));
  const std::string_view kind = root->Name();
  if (kind == "robot" && (uses_xacro(*root) || (names_xacro(*root) && !root->FirstChildElement())))
    return error(ErrorCode::unsupported, "it is written in the macro language xacro",
                 "Expand it first: xacro robot.urdf.xacro > robot.urdf");
  RMP_TRY_ASSIGN(Mechanism m, kind == "robot"    ? read_urdf(*root, options)
                              : kind == "mujoco" ? read_mjcf(*root, options, documents)
                              : kind == "sdf" || kind == "gazebo"
                                  ? read_sdf(*root, options, documents)
                                  : Result<Mechanism>(fault(
                                        *root, "it is not a robot's file",
                                        "URDF files start with <robot>, MJCF files with <mujoco>, "
                                        "SDF files with <sdf>; give the file that includes this "
                                        "one if it is a part.")));
  const bool moves = std::any_of(m.bodies.begin(), m.bodies.end(),
                                 [](const Body& b) { return !b.joints.empty(); });
  if (!moves)
    return error(ErrorCode::unsupported, "it has no joint, so nothing moves",
                 "A robot needs a link on a joint; import other objects as meshes.");
  if (std::string told = options.reach->told(); !told.empty()) m.notes.push_back(std::move(told));
  return records(std::move(m), options);
}

}  // namespace robomosp::robot_files
