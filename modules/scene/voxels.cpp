// SPDX-License-Identifier: Apache-2.0
#include "scene/voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "kernel/fingerprint.h"
#include "kernel/text.h"
#include "recording/plot/colour_map.h"

namespace robomosp::scene {
namespace {

using Cell = std::array<std::int64_t, 3>;

// Cells of a grid of at most 2^20 voxels along each axis, with room for neighbours.
std::uint64_t key_of(const Cell& c) {
  std::uint64_t key = 0;
  for (const std::int64_t k : c) key = key << 21 | static_cast<std::uint64_t>(k + 1);
  return key;
}

/// Four corners of the face of a voxel, counter-clockwise from outside.
void add_face(Mesh& mesh, const Vec3& middle, double size, std::size_t axis, double side) {
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto first = static_cast<std::uint32_t>(mesh.vertex_count());
  constexpr double kCorners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (const auto& corner : kCorners) {
    Vec3 p = middle, n{};
    p[axis] += 0.5 * size * side;
    p[u] += 0.5 * size * corner[0] * side;
    p[v] += 0.5 * size * corner[1];
    n[axis] = side;
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.positions.push_back(static_cast<float>(p[k]));
      mesh.normals.push_back(static_cast<float>(n[k]));
    }
  }
  for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.triangles.push_back(first + i);
}

render::Legend legend_of(const recording::Column& column, const std::vector<Colour>& colours,
                         double low, double high) {
  render::Legend legend;
  legend.title = column.name;
  std::replace(legend.title.begin(), legend.title.end(), '_', ' ');
  if (!column.unit.empty()) legend.title += " [" + column.unit + "]";
  legend.colours = colours;
  const auto ticks = recording::ticks_within(low, high, 5);
  for (const double t : ticks)
    legend.ticks.push_back({(t - low) / (high - low),
                            recording::tick_text(t, ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0)});
  return legend;
}

/// Colours as bright as in the legend in light and shade: part of them shines by itself.
render::Appearance voxel_appearance(Colour c, double opacity) {
  constexpr float kGlow = 0.45F;
  c.a = static_cast<float>(opacity);
  render::Appearance a{c, 0.1F, 0.0F};
  a.specular = Colour{0, 0, 0, 1};
  a.emission = {kGlow * c.r, kGlow * c.g, kGlow * c.b, 1};
  return a;
}

}  // namespace

Result<void> add_voxels(render::Scene& scene, const recording::Recording& r,
                        const Pose& world_T_mounting, const VoxelView& view) {
  if (!(r.voxel > 0) || r.columns.size() < 4 || r.rows() == 0)
    return error(ErrorCode::invalid_argument, "the recording has no voxels",
                 "Give one of robot.workspace or robot.reachability.");
  const std::string name = !view.column.empty() ? view.column
                           : r.find("share")    ? "share"
                                                : "manipulability";
  RMP_TRY_ASSIGN(const auto picked, r.select(std::span(&name, 1)));
  const recording::Column& column = *picked.front();
  const recording::ValueRange range = recording::value_range(column.values);
  const double low = view.low.value_or(range.low), high = view.high.value_or(range.high);
  if (!(low < high))
    return error(ErrorCode::invalid_argument,
                 "the colours cannot range from " + text::print_rounded(low, 6) + " to " +
                     text::print_rounded(high, 6),
                 "Give low and high in this order.", "low");

  Vec3 first{};
  for (std::size_t k = 0; k < 3; ++k)
    first[k] = *std::min_element(r.columns[k].values.begin(), r.columns[k].values.end());
  const auto middle_of = [&](std::size_t row) {
    return Vec3{r.columns[0].values[row], r.columns[1].values[row], r.columns[2].values[row]};
  };
  const auto cell_of = [&](const Vec3& p) {
    Cell c;
    for (std::size_t k = 0; k < 3; ++k) c[k] = std::llround((p[k] - first[k]) / r.voxel);
    return c;
  };
  std::unordered_map<std::uint64_t, std::size_t> row_at;  // of the voxels that are shown
  for (std::size_t row = 0; row < r.rows(); ++row) {
    if (!std::isfinite(column.values[row]) || column.values[row] < view.above.value_or(-INFINITY))
      continue;
    const Vec3 p = middle_of(row);
    double beyond = -1;
    if (view.cut) {
      beyond = 0;
      for (std::size_t k = 0; k < 3; ++k)
        beyond += (p[k] - view.cut->point[k]) * view.cut->normal[k];
      beyond -= 1e-9 * r.voxel;  // a layer in the plane is shown
    }
    if (beyond < 0) row_at.emplace(key_of(cell_of(p)), row);
  }
  if (row_at.empty())
    return error(ErrorCode::invalid_argument, "the map has no visible voxel",
                 "Reverse or move the cut, and lower the value above which voxels are shown.",
                 "map");

  const auto colours = recording::colour_map(view.bands);
  std::vector<std::shared_ptr<Mesh>> meshes(view.bands);
  for (std::size_t row = 0; row < r.rows(); ++row) {
    const Vec3 p = middle_of(row);
    const Cell cell = cell_of(p);
    if (!row_at.contains(key_of(cell)) || row_at.at(key_of(cell)) != row) continue;
    const double share = std::clamp((column.values[row] - low) / (high - low), 0.0, 1.0);
    const auto n = static_cast<double>(view.bands);
    auto& mesh = meshes[static_cast<std::size_t>(std::min(share * n, n - 1))];
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        Cell beside = cell;
        beside[axis] += side;
        if (row_at.contains(key_of(beside))) continue;
        if (!mesh) mesh = std::make_shared<Mesh>();
        add_face(*mesh, p, r.voxel, axis, side);
      }
  }
  for (std::size_t band = 0; band < meshes.size(); ++band) {
    if (!meshes[band]) continue;
    // A line of one point: the borders of colours are no edges.
    meshes[band]->edge_points = {static_cast<float>(first[0]), static_cast<float>(first[1]),
                                 static_cast<float>(first[2])};
    meshes[band]->edge_sizes = {1};
    render::Item item;
    item.id = Fingerprinter("voxels/1").add(static_cast<std::int64_t>(band)).finish().lo;
    item.name =
        column.name + " " +
        text::print_rounded(
            low + (high - low) * static_cast<double>(band) / static_cast<double>(view.bands), 4) +
        " to " +
        text::print_rounded(
            low + (high - low) * static_cast<double>(band + 1) / static_cast<double>(view.bands),
            4);
    item.mesh = meshes[band];
    item.pose = world_T_mounting;
    item.appearance = voxel_appearance(colours[band], view.opacity);
    scene.items.push_back(std::move(item));
  }
  scene.legends.push_back(legend_of(column, colours, low, high));
  return {};
}

}  // namespace robomosp::scene
