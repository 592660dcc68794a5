// SPDX-License-Identifier: Apache-2.0
// OBJ, PLY, glTF, GLB and DAE in, through Assimp; z points up in what comes out, as in the
// rest of the program (layer: plugin).
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "mesh_tree.h"
#include "worker.h"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

namespace robomosp::cad_exchange {
namespace {

Affine from_assimp(const aiMatrix4x4& a) {
  Affine out;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 3; ++j) out.m[3 * i + j] = static_cast<double>(a[i][j]);
    out.t[i] = static_cast<double>(a[i][3]);
  }
  return out;
}

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return s;
}

std::string head_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(std::size_t{1} << 16, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

Paint paint_of(const aiMaterial& material, bool is_linear) {
  aiColor4D c;
  if (material.Get(AI_MATKEY_BASE_COLOR, c) != AI_SUCCESS &&
      material.Get(AI_MATKEY_COLOR_DIFFUSE, c) != AI_SUCCESS)
    return {};
  const auto tone = [&](float x) {
    x = std::isfinite(x) ? std::clamp(x, 0.0F, 1.0F) : 0.0F;
    if (!is_linear) return x;
    return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
  };
  Paint p;
  p.known = true;
  p.colour = {tone(c.r), tone(c.g), tone(c.b),
              std::isfinite(c.a) ? std::clamp(c.a, 0.0F, 1.0F) : 1.0F};
  float opacity = 1;
  if (!is_linear && material.Get(AI_MATKEY_OPACITY, opacity) == AI_SUCCESS && opacity >= 0 &&
      opacity <= 1)
    p.colour.a = opacity;
  aiString name;
  if (material.Get(AI_MATKEY_NAME, name) == AI_SUCCESS &&
      name == aiString(AI_DEFAULT_MATERIAL_NAME))
    p.known = false;
  return p;
}

/// Assimp's scene as a tree; nothing but triangles comes over.
Result<MeshTree> tree_of(const aiScene& in, bool is_linear) {
  MeshTree out;
  for (unsigned i = 0; i < in.mNumMeshes; ++i) {
    const aiMesh& mesh = *in.mMeshes[i];
    TreeMesh m;
    m.name = mesh.mName.C_Str();
    m.points.reserve(3 * std::size_t{mesh.mNumVertices});
    for (unsigned v = 0; v < mesh.mNumVertices; ++v)
      for (const ai_real x : {mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z})
        m.points.push_back(static_cast<double>(x));
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) {
        ++m.flat;
        continue;
      }
      for (unsigned c = 0; c < 3; ++c) {
        if (face.mIndices[c] >= mesh.mNumVertices)
          return error(ErrorCode::syntax, "a triangle refers to a missing corner",
                       "Check that the file is complete.");
        m.triangles.push_back(face.mIndices[c]);
      }
    }
    m.colour = mesh.mMaterialIndex;
    if (m.colour < in.mNumMaterials) m.paint = paint_of(*in.mMaterials[m.colour], is_linear);
    out.meshes.push_back(std::move(m));
  }
  std::vector<const aiNode*> open{in.mRootNode};
  out.nodes.emplace_back();
  for (std::size_t at = 0; at < open.size(); ++at) {
    const aiNode& node = *open[at];
    out.nodes[at].name = node.mName.C_Str();
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
      if (node.mMeshes[i] < out.meshes.size()) out.nodes[at].meshes.push_back(node.mMeshes[i]);
    for (unsigned i = 0; i < node.mNumChildren; ++i) {
      const aiNode* child = node.mChildren[i];
      out.nodes[at].children.push_back(
          {static_cast<std::uint32_t>(open.size()), from_assimp(child->mTransformation)});
      open.push_back(child);
      out.nodes.emplace_back();
    }
  }
  return out;
}

/// Assimp goes by content where the extension misleads, but unit and up axis go by the format.
bool begins_like(const std::string& format, const std::string& head) {
  const auto first = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  const std::string text = first == std::string::npos ? "" : head.substr(first);
  if (format == "glb") return head.starts_with("glTF");
  if (format == "gltf") return text.starts_with("{");
  if (format == "dae") return text.starts_with("<") && text.find("COLLADA") != std::string::npos;
  if (format == "ply") return text.starts_with("ply");
  return !head.starts_with("glTF") && !head.starts_with("PK") && !text.starts_with("ply");
}

/// x stays, y becomes z, z becomes -y.
Affine y_up() { return {{1, 0, 0, 0, 0, -1, 0, 1, 0}, {}}; }

}  // namespace

Result<Scene> read_meshes(const std::string& path, const ReadOptions& options, Progress& progress) {
  progress.report(0, "reading");
  const std::string head = head_of(path);
  if (!begins_like(options.format, head))
    return error(ErrorCode::syntax,
                 "the beginning of the file is not that of the format " + options.format,
                 "Its extension may be wrong: the unit depends on the format.");
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_PP_PTV_KEEP_HIERARCHY, true);
  const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
  if (!scene || !scene->mRootNode)
    return error(ErrorCode::syntax,
                 "the file is not readable as " + options.format + ": " + importer.GetErrorString(),
                 "Check that it is complete and really of this format.");
  Affine frame;
  if (options.format == "glb" || options.format == "gltf") {
    frame = y_up();
  } else if (options.format == "dae") {
    const std::string text = lower(head);
    if (text.find("<up_axis>z_up") == std::string::npos) frame = y_up();
    if (text.find("<up_axis>x_up") != std::string::npos)
      frame = {{0, -1, 0, 0, 0, -1, 1, 0, 0}, {}};
  } else {
    frame = scaled(options.unit);
  }
  RMP_TRY_ASSIGN(MeshTree tree,
                 tree_of(*scene, options.format == "glb" || options.format == "gltf"));
  tree.frame = frame * from_assimp(scene->mRootNode->mTransformation);
  return scene_of(tree, progress);
}

}  // namespace robomosp::cad_exchange
