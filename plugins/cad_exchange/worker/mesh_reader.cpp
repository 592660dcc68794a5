// SPDX-License-Identifier: Apache-2.0
// OBJ, PLY, glTF, GLB, DAE and 3MF in, through Assimp; z points up in what comes out, as in the
// rest of the program (layer: plugin).
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>

#include "../mesh_repair.h"
#include "worker.h"

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <zlib.h>
#include <assimp/Importer.hpp>

namespace robomosp::cad_exchange {
namespace {

constexpr std::size_t kMostNodes = 100000;
/// Columns of a placement that are further from a rotation than this are baked into the points.
constexpr double kRigid = 1e-6;

/// p = m * q + t
struct Affine {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec3 t{};
};

Affine from_assimp(const aiMatrix4x4& a) {
  Affine out;
  for (unsigned i = 0; i < 3; ++i) {
    for (unsigned j = 0; j < 3; ++j) out.m[3 * i + j] = static_cast<double>(a[i][j]);
    out.t[i] = static_cast<double>(a[i][3]);
  }
  return out;
}

Vec3 apply(const Affine& a, const Vec3& p) {
  Vec3 out = a.t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out[i] += a.m[3 * i + j] * p[j];
  return out;
}

Affine operator*(const Affine& a, const Affine& b) {
  Affine out;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      out.m[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) out.m[3 * i + j] += a.m[3 * i + k] * b.m[3 * k + j];
    }
  out.t = apply(a, b.t);
  return out;
}

double determinant(const std::array<double, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// The rotation nearest to the directions of the columns (Gram-Schmidt), right-handed.
Pose rigid_part(const Affine& a) {
  Pose out;
  out.p = a.t;
  std::array<Vec3, 3> c{};
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) c[j][i] = a.m[3 * i + j];
  const auto dot = [](const Vec3& x, const Vec3& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const auto normalise = [&](Vec3& v) {
    const double n = std::sqrt(dot(v, v));
    if (!(n > 0) || !std::isfinite(n)) return false;
    for (double& x : v) x /= n;
    return true;
  };
  if (!normalise(c[0])) return out;
  const double along = dot(c[1], c[0]);
  for (std::size_t i = 0; i < 3; ++i) c[1][i] -= along * c[0][i];
  if (!normalise(c[1])) return out;
  c[2] = {c[0][1] * c[1][2] - c[0][2] * c[1][1], c[0][2] * c[1][0] - c[0][0] * c[1][2],
          c[0][0] * c[1][1] - c[0][1] * c[1][0]};
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) out.R[3 * i + j] = c[j][i];
  return out;
}

/// inverse(t) * a
Affine inverse_times(const Pose& t, const Affine& a) {
  Affine inv;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) inv.m[3 * i + j] = t.R[3 * j + i];
  Affine shifted = a;
  for (std::size_t i = 0; i < 3; ++i) shifted.t[i] -= t.p[i];
  return inv * shifted;
}

Affine as_affine(const Pose& t) { return {t.R, t.p}; }

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return s;
}

/// The value of `name="..."` in a piece of XML, or "".
std::string attribute(const std::string& xml, const std::string& name) {
  const auto at = xml.find(name + "=\"");
  if (at == std::string::npos) return {};
  const auto begin = at + name.size() + 2;
  return xml.substr(begin, xml.find('"', begin) - begin);
}

std::string head_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(std::size_t{1} << 16, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

/// Little-endian number of `n` bytes at a place; 0 beyond the end.
std::size_t word(const std::string& bytes, std::size_t at, std::size_t n) {
  std::size_t v = 0;
  if (at > bytes.size() || n > bytes.size() - at) return 0;
  for (std::size_t i = n; i-- > 0;) v = v << 8 | static_cast<unsigned char>(bytes[at + i]);
  return v;
}

/// The beginning of the first file of a ZIP whose name ends so; "" when there is none.
std::string head_in_zip(const std::string& zip, const std::string& ending, std::size_t most) {
  const auto directory_end = zip.rfind("PK\x05\x06");
  if (directory_end == std::string::npos) return {};
  const std::size_t count = word(zip, directory_end + 10, 2);
  std::size_t at = word(zip, directory_end + 16, 4);
  for (std::size_t i = 0; i < count; ++i) {
    if (zip.compare(std::min(at, zip.size()), 4, "PK\x01\x02") != 0) return {};
    const std::size_t name_size = word(zip, at + 28, 2);
    const std::string name = zip.substr(std::min(at + 46, zip.size()), name_size);
    const std::size_t method = word(zip, at + 10, 2), packed = word(zip, at + 20, 4);
    const std::size_t local = word(zip, at + 42, 4);
    at += 46 + name_size + word(zip, at + 30, 2) + word(zip, at + 32, 2);
    if (!name.ends_with(ending)) continue;
    const std::size_t data = local + 30 + word(zip, local + 26, 2) + word(zip, local + 28, 2);
    if (data > zip.size()) return {};
    std::string content = zip.substr(data, packed);
    if (method == 0) return content.substr(0, most);
    std::string head(most, '\0');
    z_stream z{};
    if (inflateInit2(&z, -MAX_WBITS) != Z_OK) return {};
    z.next_in = reinterpret_cast<Bytef*>(content.data());
    z.avail_in = static_cast<uInt>(content.size());
    z.next_out = reinterpret_cast<Bytef*>(head.data());
    z.avail_out = static_cast<uInt>(head.size());
    ::inflate(&z, Z_SYNC_FLUSH);
    head.resize(head.size() - z.avail_out);
    inflateEnd(&z);
    return head;
  }
  return {};
}

/// Unit of a 3MF file [m] from its model part; the format's default is the millimetre.
double unit_of_3mf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream all;
  all << in.rdbuf();
  const std::string head = head_in_zip(all.str(), ".model", 65536);
  const auto model = head.find("<model");
  const std::string unit =
      model == std::string::npos
          ? ""
          : attribute(head.substr(model, head.find('>', model) - model), "unit");
  if (unit == "micron") return 1e-6;
  if (unit == "centimeter") return 1e-2;
  if (unit == "inch") return 0.0254;
  if (unit == "foot") return 0.3048;
  if (unit == "meter") return 1;
  return 1e-3;
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

class MeshReader {
 public:
  MeshReader(const aiScene& scene, const ReadOptions& options, Affine frame, Progress& progress)
      : in_(scene), options_(options), frame_(frame), progress_(progress) {}

  Result<Scene> run() {
    struct Open {
      const aiNode* node;
      std::int32_t parent;
      Affine above;      ///< root_T_parent, with scales
      Pose above_rigid;  ///< of the parent's node
    };
    std::vector<Open> stack{{in_.mRootNode, -1, frame_, {}}};
    std::size_t done = 0;
    while (!stack.empty()) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "stopped");
      progress_.report(
          0.5 + 0.5 * static_cast<double>(done) / static_cast<double>(done + stack.size()),
          "checking meshes");
      if (++done > kMostNodes)
        return error(ErrorCode::unsupported, "the file has more than 100000 parts");
      const Open open = stack.back();
      stack.pop_back();
      const Affine here = open.above * from_assimp(open.node->mTransformation);
      if (!std::all_of(here.m.begin(), here.m.end(), [](double x) { return std::isfinite(x); }) ||
          std::abs(determinant(here.m)) < 1e-30) {
        scene_.notes.push_back("A part that is flattened to nothing where it stands was left out.");
        continue;
      }
      const Pose rigid = rigid_part(here);
      Node node;
      node.name = open.node->mName.C_Str();
      node.parent = open.parent;
      const Affine local = inverse_times(open.above_rigid, as_affine(rigid));
      node.pose.R = local.m;
      node.pose.p = local.t;
      scene_.nodes.push_back(node);
      const auto self = static_cast<std::int32_t>(scene_.nodes.size() - 1);
      if (open.node->mNumMeshes > 0) add_meshes(*open.node, inverse_times(rigid, here), self);
      for (unsigned i = open.node->mNumChildren; i-- > 0;)
        stack.push_back({open.node->mChildren[i], self, here, rigid});
    }
    tidy();
    if (scene_.shapes.empty())
      return error(ErrorCode::unsupported, "the file holds no solid",
                   "Surfaces that enclose nothing cannot be imported.");
    return std::move(scene_);
  }

 private:
  /// Nodes that hold no shape, below them neither, are left out; one that has its own shape only
  /// becomes that part.
  void tidy() {
    std::vector<char> used(scene_.nodes.size(), 0);
    std::vector<std::int32_t> children(scene_.nodes.size(), 0), last(scene_.nodes.size(), -1);
    for (std::size_t i = scene_.nodes.size(); i-- > 0;) {
      const Node& n = scene_.nodes[i];
      if (n.shape >= 0) used[i] = 1;
      if (used[i] && n.parent >= 0) {
        const auto p = static_cast<std::size_t>(n.parent);
        used[p] = 1;
        ++children[p];
        last[p] = static_cast<std::int32_t>(i);
      }
    }
    // An inner node without a shape and with one child is only a placement.
    std::vector<std::int32_t> to(scene_.nodes.size(), -1);
    std::vector<Node> kept;
    std::vector<Affine> at(scene_.nodes.size());  // kept ancestor_T_node
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
      if (!used[i]) continue;
      Node n = scene_.nodes[i];
      Affine pose = as_affine(n.pose);
      std::int32_t parent = -1;
      if (n.parent >= 0) {
        const auto p = static_cast<std::size_t>(n.parent);
        parent = to[p];
        pose = at[p] * pose;
      }
      if (n.shape < 0 && children[i] == 1) {
        at[i] = pose;
        to[i] = parent;
        Node& child = scene_.nodes[static_cast<std::size_t>(last[i])];
        if (child.name.empty() || is_generated(child.name)) child.name = n.name;
        continue;
      }
      n.pose = rigid_part(pose);
      snap(n.pose);
      n.parent = parent;
      to[i] = static_cast<std::int32_t>(kept.size());
      at[i] = {};
      kept.push_back(std::move(n));
    }
    scene_.nodes = std::move(kept);
  }

  /// What is no motion but for single precision is none.
  static void snap(Pose& t) {
    double off = 0;
    for (std::size_t i = 0; i < 9; ++i)
      off = std::max(off, std::abs(t.R[i] - (i % 4 == 0 ? 1 : 0)));
    if (off < kRigid) t.R = Pose{}.R;
    for (double& x : t.p)
      if (std::abs(x) < 1e-12) x = 0;
  }

  static bool is_generated(const std::string& name) { return name == "$part"; }

  void add_meshes(const aiNode& node, const Affine& baked, std::int32_t self) {
    std::ostringstream key;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) key << node.mMeshes[i] << ',';
    bool is_scaled = false;
    for (std::size_t i = 0; i < 9; ++i)
      is_scaled = is_scaled || std::abs(baked.m[i] - (i % 4 == 0 ? 1 : 0)) > kRigid;
    // Files hold single precision, so that equal scales differ in the last digits.
    if (is_scaled)
      for (const double x : baked.m) key << std::llround(x / kRigid) << ';';
    const auto known = made_.find(key.str());
    std::int32_t shape = known != made_.end() ? known->second : -1;
    if (known == made_.end()) {
      shape = make_shape(node, is_scaled ? baked : Affine{}, self);
      made_.emplace(key.str(), shape);
    }
    if (shape < 0) return;
    if (node.mNumChildren == 0) {
      scene_.nodes[static_cast<std::size_t>(self)].shape = shape;
      return;
    }
    Node part;  // a part cannot have parts, so it stands beside them
    part.name = "$part";
    part.parent = self;
    part.shape = shape;
    scene_.nodes.push_back(std::move(part));
  }

  /// Index of the new shape, -1 when there is no solid in it.
  std::int32_t make_shape(const aiNode& node, const Affine& baked, std::int32_t self) {
    Shape s;
    s.name = node.mName.C_Str();
    if (s.name.empty()) s.name = in_.mMeshes[node.mMeshes[0]]->mName.C_Str();
    scene_.nodes[static_cast<std::size_t>(self)].name = s.name;
    std::map<unsigned, std::size_t> colours;
    std::size_t flat = 0;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *in_.mMeshes[node.mMeshes[i]];
      const auto first = static_cast<std::uint32_t>(s.points.size() / 3);
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiVector3D& p = mesh.mVertices[v];
        const Vec3 q = apply(
            baked, {static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)});
        s.points.insert(s.points.end(), q.begin(), q.end());
      }
      std::size_t count = 0;
      for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices != 3) {
          ++flat;
          continue;
        }
        for (unsigned c = 0; c < 3; ++c) {
          if (face.mIndices[c] >= mesh.mNumVertices) return -1;
          s.triangles.push_back(first + face.mIndices[c]);
        }
        ++count;
      }
      colours[mesh.mMaterialIndex] += count;
    }
    if (determinant(baked.m) < 0)
      for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3)
        std::swap(s.triangles[t + 1], s.triangles[t + 2]);
    if (flat > 0) scene_.notes.push_back("Points and lines of \"" + s.name + "\" were left out.");
    const auto most = std::max_element(colours.begin(), colours.end(),
                                       [](auto& a, auto& b) { return a.second < b.second; });
    if (most != colours.end() && most->first < in_.mNumMaterials)
      s.paint = paint_of(*in_.mMaterials[most->first], is_gltf());
    if (colours.size() > 1)
      scene_.notes.push_back("\"" + s.name + "\" has " + std::to_string(colours.size()) +
                             " colours; the most common one is used.");
    scene_.shapes.push_back(std::move(s));
    return static_cast<std::int32_t>(scene_.shapes.size() - 1);
  }

  [[nodiscard]] bool is_gltf() const {
    return options_.format == "glb" || options_.format == "gltf";
  }

  const aiScene& in_;
  const ReadOptions& options_;
  Affine frame_;  ///< metres and z up from the file's
  Progress& progress_;
  Scene scene_;
  std::map<std::string, std::int32_t> made_;
};

Affine scaled(double s) { return {{s, 0, 0, 0, s, 0, 0, 0, s}, {}}; }
/// Assimp goes by content where the extension misleads, but unit and up axis go by the format.
bool begins_like(const std::string& format, const std::string& head) {
  const auto first = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  const std::string text = first == std::string::npos ? "" : head.substr(first);
  if (format == "glb") return head.starts_with("glTF");
  if (format == "gltf") return text.starts_with("{");
  if (format == "dae") return text.starts_with("<") && text.find("COLLADA") != std::string::npos;
  if (format == "3mf") return head.starts_with("PK");
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
                 "the file does not begin like one of the format " + options.format,
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
  } else if (options.format == "3mf") {
    frame = scaled(unit_of_3mf(path));
  } else {
    frame = scaled(options.unit);
  }
  return MeshReader(*scene, options, frame, progress).run();
}

}  // namespace robomosp::cad_exchange
