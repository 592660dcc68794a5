// SPDX-License-Identifier: Apache-2.0
// Meshes placed in a tree, as files of meshes hold them, and the scene that is made of it: copies
// share their shape, placements are rigid, scales and mirrors are in the points (layer: plugin).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "../scene.h"
#include "affine.h"

namespace robomosp::cad_exchange {

struct TreeMesh {
  std::string name;
  std::vector<double> points;            ///< 3 per vertex, in the file's unit
  std::vector<std::uint32_t> triangles;  ///< 3 vertex indices each, in range
  std::size_t flat = 0;                  ///< points and lines that were left out
  std::uint32_t colour = 0;              ///< meshes with one number have one paint
  Paint paint;
};

struct TreeChild {
  std::uint32_t node = 0;
  Affine at;  ///< parent_T_child; any scale
};

/// A node may be the child of several others (copies), never of itself.
struct TreeNode {
  std::string name;
  std::vector<std::uint32_t> meshes;  ///< make one shape together
  std::vector<TreeChild> children;
};

struct MeshTree {
  std::vector<TreeMesh> meshes;
  std::vector<TreeNode> nodes;  ///< the first is the root
  Affine frame;                 ///< metres and z up, of the root's frame
  std::vector<std::string> notes;
};

/// The tree must have no cycles and indices in range. More than 100,000 placed nodes are refused.
[[nodiscard]] Result<Scene> scene_of(const MeshTree& tree, Progress& progress);

}  // namespace robomosp::cad_exchange
