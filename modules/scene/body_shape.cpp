// SPDX-License-Identifier: Apache-2.0
#include "scene/body_shape.h"

#include <algorithm>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "scene/ids.h"
#include "scene/leaf_parts.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

using evaluation::Drawable;

/// Drawables come in the order of the leaves; a leaf that failed has any number of them.
class LeafOf {
 public:
  explicit LeafOf(std::vector<LeafPart> leaves) : leaves_(std::move(leaves)) {}
  /// Which leaf a drawable belongs to, and the name of its node where it is an operand.
  std::pair<std::int32_t, std::string> next(const Drawable& d) {
    for (std::size_t i = at_; i < leaves_.size(); ++i) {
      const std::string& name = leaves_[i].name;
      if (d.name == name) {
        at_ = d.is_operand ? i : i + 1;
        return {static_cast<std::int32_t>(i), ""};
      }
      if (d.name.starts_with(name + ".")) {
        at_ = i;
        return {static_cast<std::int32_t>(i), d.name.substr(name.size() + 1)};
      }
    }
    return {-1, ""};
  }
  [[nodiscard]] const LeafPart& leaf(std::int32_t i) const {
    return leaves_[static_cast<std::size_t>(i)];
  }

 private:
  std::vector<LeafPart> leaves_;
  std::size_t at_ = 0;
};

std::int32_t node_named(const document::Snapshot& snapshot, SolidId id, const std::string& name) {
  const auto* solid = name.empty() ? nullptr : snapshot.get(id);
  if (!solid) return -1;
  const auto at = std::find_if(solid->nodes.begin(), solid->nodes.end(),
                               [&](const model::SolidNode& n) { return n.name == name; });
  return at == solid->nodes.end() ? -1 : static_cast<std::int32_t>(at - solid->nodes.begin());
}

void add_drawables(const document::Snapshot& snapshot, AnyId what,
                   const std::vector<Drawable>& drawn, Shape& out) {
  LeafOf leaf_of(leaf_parts(snapshot, what));
  Bounds box = empty_box();
  for (std::size_t p = 0; p < drawn.size(); ++p) {
    const Drawable& d = drawn[p];
    Element<render::Item> e;
    e.what.name = d.name;
    e.what.mesh = d.mesh;
    e.what.pose = d.placement;
    e.what.appearance = appearance_of(d);
    e.number = static_cast<std::uint32_t>(p);
    const auto [leaf, node] = leaf_of.next(d);
    e.of.leaf = leaf;
    if (leaf >= 0) {
      const LeafPart& at = leaf_of.leaf(leaf);
      if (!at.steps.empty()) e.of.part = at.steps.front().part;
      e.of.node = node_named(snapshot, at.solid, node);
    }
    if (d.mesh) grow(box, box_of(*d.mesh, d.placement));
    if (d.is_operand &&
        std::find(out.left_out.begin(), out.left_out.end(), d.failure) == out.left_out.end())
      out.left_out.push_back(d.failure);
    out.items.push_back(std::move(e));
  }
  out.boxes = {box};
}

}  // namespace

render::Appearance appearance_of(const Drawable& d) {
  render::Appearance a{d.colour, static_cast<float>(d.shininess), static_cast<float>(d.metalness)};
  a.ambient = d.ambient;
  a.specular = d.specular;
  a.emission = d.emission;
  // What is left of a solid that could not be made: clear and in the colour of a warning.
  if (d.is_operand) {
    a = render::Appearance{{1.0F, 0.42F, 0.05F, 0.45F}, 0.4F, 0.0F};
    a.emission = {0.25F, 0.06F, 0.0F, 1};
  }
  return a;
}

Result<ShapePtr> body_shape(const Source& source, AnyId what, Progress& progress) {
  auto shape = std::make_shared<Shape>();
  auto drawn = source.derived.drawables(source.snapshot, what, progress);
  if (drawn.ok()) {
    add_drawables(source.snapshot, what, *drawn, *shape);
  } else {
    if (drawn.error().code == ErrorCode::cancelled) return std::move(drawn).error();
    shape->failure = std::move(drawn).error();
    shape->boxes = {empty_box()};
  }
  return ShapePtr(std::move(shape));
}

Result<ShapePtr> coarse_body_shape(const Source& source, AnyId what, double coarser,
                                   Progress& progress) {
  auto shape = std::make_shared<Shape>();
  std::vector<Drawable> drawn;
  for (const LeafPart& leaf : leaf_parts(source.snapshot, what)) {
    const auto* solid = source.snapshot.get(leaf.solid);
    auto mesh = source.derived.mesh(source.snapshot, leaf.solid, coarser * solid->chord, progress);
    if (!mesh.ok()) {
      if (mesh.error().code == ErrorCode::cancelled) return std::move(mesh).error();
      continue;
    }
    const auto* given = leaf.material ? source.snapshot.get(leaf.material) : nullptr;
    const model::Material look = given ? *given : model::Material{};
    drawn.push_back({leaf.name, std::move(mesh).value(), leaf.placement, look.colour,
                     look.shininess, look.metalness, look.ambient, look.specular, look.emission});
  }
  add_drawables(source.snapshot, what, drawn, *shape);
  return ShapePtr(std::move(shape));
}

Result<ShapePtr> body_mark(const Source& source, AnyId what, const Shape& bodies,
                           Progress& progress) {
  // Operands are no bodies with a mass, and what failed altogether has said so.
  if (bodies.failure || !bodies.left_out.empty()) return ShapePtr();
  auto shape = std::make_shared<Shape>();
  const auto mass = source.derived.mass(source.snapshot, what, progress);
  if (!mass.ok()) {
    if (mass.error().code == ErrorCode::cancelled) return mass.error();
    shape->left_out.push_back(mass.error().sentence());
  } else if (!(mass->mass.mass > 0)) {
    shape->left_out.push_back(source.snapshot.describe(what) +
                              " has no mass, so its centre of mass is not shown.");
  } else {
    Element<render::MassMark> e;
    e.what = mass_mark(0, mass->mass);
    e.group = kMarkBody;
    shape->marks.push_back(std::move(e));
  }
  return ShapePtr(std::move(shape));
}

ShapePtr body_frames(const document::Snapshot& snapshot, AnyId what, double length) {
  auto shape = std::make_shared<Shape>();
  const auto add = [&](std::size_t i, const Pose& pose, const std::string& name, PartOf of) {
    Element<render::Triad> e;
    e.what = {0, pose, length, name, true, {}};
    e.group = kFrameBody;
    e.number = static_cast<std::uint32_t>(i);
    e.of = of;
    shape->triads.push_back(std::move(e));
  };
  if (const auto* object =
          what.kind == Kind::object ? snapshot.get(ObjectId{what.number}) : nullptr) {
    for (std::size_t i = 0; i < object->parts.size(); ++i) {
      PartOf of;
      of.part = static_cast<std::int32_t>(i);
      add(i, model::pose(object->parts[i].placement), object->parts[i].name, of);
    }
  } else if (const auto* solid =
                 what.kind == Kind::solid ? snapshot.get(SolidId{what.number}) : nullptr) {
    std::vector<Pose> solid_T_node;
    for (std::size_t i = 0; i < solid->nodes.size(); ++i) {
      const model::SolidNode& n = solid->nodes[i];
      const Pose placement = model::pose(n.placement);
      solid_T_node.push_back(
          n.parent < 0 || n.is_global
              ? placement
              : spatial::compose(solid_T_node[static_cast<std::size_t>(n.parent)], placement));
      PartOf of;
      of.leaf = 0;
      of.node = static_cast<std::int32_t>(i);
      add(i, solid_T_node.back(), n.name, of);
    }
  }
  return shape;
}

ShapePtr body_dimensions(const Shape& bodies) {
  auto shape = std::make_shared<Shape>();
  if (bodies.boxes.empty() || !(diagonal(bodies.boxes[0]) > 0)) return shape;
  const Bounds& box = bodies.boxes[0];
  const auto corner = [&](unsigned c) {
    return Vec3{box[c & 1U][0], box[(c >> 1U) & 1U][1], box[(c >> 2U) & 1U][2]};
  };
  std::uint32_t number = 0;
  for (unsigned c = 0; c < 8; ++c)
    for (unsigned axis = 0; axis < 3; ++axis) {
      if ((c & (1U << axis)) != 0) continue;
      Element<render::Line> e;
      e.what.points = {corner(c), corner(c | (1U << axis))};
      e.what.colour = {0.30F, 0.33F, 0.38F, 0.8F};
      e.what.width = 1.2F;
      e.group = kDimensionBody;
      e.number = number++;
      shape->lines.push_back(std::move(e));
    }
  const auto mm = [&](std::size_t i) {
    return text::print_rounded(1000 * (box[1][i] - box[0][i]), 4);
  };
  Element<render::Label> e;
  e.what.place = {0.5 * (box[0][0] + box[1][0]), 0.5 * (box[0][1] + box[1][1]), box[1][2]};
  e.what.text = mm(0) + " x " + mm(1) + " x " + mm(2) + " mm";
  e.group = kDimensionBody;
  shape->labels.push_back(std::move(e));
  return shape;
}

ShapePtr material_shape(const model::Material& material) {
  render::Appearance look{material.colour, static_cast<float>(material.shininess),
                          static_cast<float>(material.metalness)};
  look.ambient = material.ambient;
  look.specular = material.specular;
  look.emission = material.emission;
  auto shape = std::make_shared<Shape>();
  Bounds box = empty_box();
  for (render::Item& item : material_preview(look)) {
    Element<render::Item> e;
    e.number = static_cast<std::uint32_t>(item.id);
    grow(box, box_of(*item.mesh, item.pose));
    e.what = std::move(item);
    shape->items.push_back(std::move(e));
  }
  shape->boxes = {box};
  return shape;
}

}  // namespace robomosp::scene
