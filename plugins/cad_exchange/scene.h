// SPDX-License-Identifier: Apache-2.0
// Scene: what a foreign file holds, neutral to its format, and the bytes by which the worker
// program hands it to the plugin and back (layer: plugin). Lengths in metres.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::cad_exchange {

struct Paint {
  bool known = false;
  Colour colour;  ///< sRGB, a = opacity
};

/// A part's geometry: a B-rep (text, in millimetres) or a closed mesh.
struct Shape {
  std::string name;
  std::string brep;                      ///< "" = a mesh
  double size = 0;                       ///< B-rep: diagonal of the box around it, about [m]
  std::vector<double> points;            ///< 3 per vertex [m]
  std::vector<std::uint32_t> triangles;  ///< 3 vertex indices each
  Paint paint;
};

/// A node of the assembly; parents come before children. Nodes with the same shape are copies.
struct Node {
  std::string name;
  std::int32_t parent = -1;
  Pose pose;                ///< parent_T_node
  std::int32_t shape = -1;  ///< -1 = an assembly
  Paint paint;              ///< of this copy, else the shape's
};

struct Scene {
  std::vector<Shape> shapes;
  std::vector<Node> nodes;
  CsgProfile profile;              ///< closed outlines of a drawing [m]
  std::vector<std::string> notes;  ///< a sentence each
};

/// What the worker answers: a scene, the bytes of a file, or an error.
struct Answer {
  Scene scene;
  std::string file;
};

[[nodiscard]] std::string encode(const Scene&);
[[nodiscard]] std::string encode_file(std::string_view bytes);
[[nodiscard]] std::string encode(const Error&);
/// Reads and checks everything: lengths, indices, parents, finite numbers, rigid poses. Bytes that
/// do not follow are ErrorCode::plugin_failed; an encoded Error comes back as that error.
[[nodiscard]] Result<Answer> decode(std::string_view bytes);
/// The checks of decode() alone.
[[nodiscard]] Result<void> check(const Scene&);

}  // namespace robomosp::cad_exchange
