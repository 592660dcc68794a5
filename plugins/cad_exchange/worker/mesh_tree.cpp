// SPDX-License-Identifier: Apache-2.0
#include "mesh_tree.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

namespace robomosp::cad_exchange {
namespace {

constexpr std::size_t kMostNodes = 100000;

class TreeReader {
 public:
  TreeReader(const MeshTree& tree, Progress& progress) : in_(tree), progress_(progress) {}

  Result<Scene> run() {
    struct Open {
      TreeChild node;
      std::int32_t parent;
      Affine above;      ///< root_T_parent, with scales
      Pose above_rigid;  ///< of the parent's node
    };
    std::vector<Open> stack{{{0, {}}, -1, in_.frame, {}}};
    std::size_t done = 0;
    while (!stack.empty()) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "stopped");
      progress_.report(
          0.5 + 0.5 * static_cast<double>(done) / static_cast<double>(done + stack.size()),
          "checking meshes");
      if (++done > kMostNodes)
        return error(ErrorCode::unsupported, "the file has more than 100000 parts",
                     "Split it in the program it comes from.");
      const Open open = stack.back();
      stack.pop_back();
      const TreeNode& source = in_.nodes[open.node.node];
      const Affine here = open.above * open.node.at;
      if (!std::all_of(here.m.begin(), here.m.end(), [](double x) { return std::isfinite(x); }) ||
          std::abs(determinant(here.m)) < 1e-30) {
        scene_.notes.push_back("A part placed with zero scale was left out.");
        continue;
      }
      const Pose rigid = rigid_part(here);
      Node node;
      node.name = source.name;
      node.parent = open.parent;
      const Affine local = inverse_times(open.above_rigid, as_affine(rigid));
      node.pose.R = local.m;
      node.pose.p = local.t;
      scene_.nodes.push_back(node);
      const auto self = static_cast<std::int32_t>(scene_.nodes.size() - 1);
      if (!source.meshes.empty()) add_meshes(source, inverse_times(rigid, here), self);
      for (std::size_t i = source.children.size(); i-- > 0;)
        stack.push_back({source.children[i], self, here, rigid});
    }
    tidy();
    scene_.notes.insert(scene_.notes.begin(), in_.notes.begin(), in_.notes.end());
    if (scene_.shapes.empty()) {
      std::string why;
      for (const std::string& n : in_.notes) why += n + " ";
      return error(ErrorCode::unsupported, "the file contains no solid",
                   why + "Surfaces that enclose no volume cannot be imported.");
    }
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

  void add_meshes(const TreeNode& node, const Affine& baked, std::int32_t self) {
    std::ostringstream key;
    for (const std::uint32_t i : node.meshes) key << i << ',';
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
    if (node.children.empty()) {
      scene_.nodes[static_cast<std::size_t>(self)].shape = shape;
      return;
    }
    Node part;  // a part cannot have parts, so it stands beside them
    part.name = "$part";
    part.parent = self;
    part.shape = shape;
    scene_.nodes.push_back(std::move(part));
  }

  /// Index of the new shape.
  std::int32_t make_shape(const TreeNode& node, const Affine& baked, std::int32_t self) {
    Shape s;
    s.name = node.name;
    if (s.name.empty()) s.name = in_.meshes[node.meshes.front()].name;
    scene_.nodes[static_cast<std::size_t>(self)].name = s.name;
    std::map<std::uint32_t, std::size_t> colours;
    std::map<std::uint32_t, Paint> paints;
    std::size_t flat = 0;
    for (const std::uint32_t i : node.meshes) {
      const TreeMesh& mesh = in_.meshes[i];
      const auto first = static_cast<std::uint32_t>(s.points.size() / 3);
      for (std::size_t v = 0; v + 2 < mesh.points.size(); v += 3) {
        const Vec3 q = apply(baked, {mesh.points[v], mesh.points[v + 1], mesh.points[v + 2]});
        s.points.insert(s.points.end(), q.begin(), q.end());
      }
      for (const std::uint32_t c : mesh.triangles) s.triangles.push_back(first + c);
      flat += mesh.flat;
      colours[mesh.colour] += mesh.triangles.size();
      paints[mesh.colour] = mesh.paint;
    }
    if (determinant(baked.m) < 0)
      for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3)
        std::swap(s.triangles[t + 1], s.triangles[t + 2]);
    if (flat > 0) scene_.notes.push_back("Points and lines of \"" + s.name + "\" were left out.");
    const auto most = std::max_element(colours.begin(), colours.end(),
                                       [](auto& a, auto& b) { return a.second < b.second; });
    if (most != colours.end()) s.paint = paints[most->first];
    if (colours.size() > 1)
      scene_.notes.push_back("\"" + s.name + "\" has " + std::to_string(colours.size()) +
                             " colours; the most common one is used.");
    scene_.shapes.push_back(std::move(s));
    return static_cast<std::int32_t>(scene_.shapes.size() - 1);
  }

  const MeshTree& in_;
  Progress& progress_;
  Scene scene_;
  std::map<std::string, std::int32_t> made_;
};

}  // namespace

Result<Scene> scene_of(const MeshTree& tree, Progress& progress) {
  return TreeReader(tree, progress).run();
}

}  // namespace robomosp::cad_exchange
