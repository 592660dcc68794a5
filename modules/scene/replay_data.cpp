// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "kernel/fingerprint.h"
#include "kernel/text.h"
#include "scene/json_text.h"
#include "scene/replay.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::scene {
namespace {

constexpr std::size_t kMostPoses = 20'000'000;  ///< of all bodies together
constexpr std::size_t kMostSamples = 4000;      ///< of a column: more than a screen has pixels
constexpr double kMeshSteps = 65535, kNormalSteps = 511, kColumnSteps = 65534;
constexpr std::int64_t kNoNumber = 65535;
constexpr double kRotationStep = 1.0 / 131072;  ///< of a quaternion's component: 0.02 mrad
constexpr double kTimeStep = 1e-6;              ///< [s]

/// Whole numbers of seven bits a byte.
class Packer {
 public:
  void whole(std::uint64_t x) {
    for (; x >= 128; x >>= 7U) bytes_.push_back(static_cast<char>(128 | (x & 127)));
    bytes_.push_back(static_cast<char>(x));
  }
  void add(std::int64_t x) {
    whole(x < 0 ? 2 * static_cast<std::uint64_t>(-(x + 1)) + 1 : 2 * static_cast<std::uint64_t>(x));
  }
  void steps(std::span<const std::int64_t> values) {
    std::int64_t before = 0;
    for (const std::int64_t x : values) add(x - std::exchange(before, x));
  }
  void bends(std::span<const std::int64_t> values) {
    std::int64_t before = 0, speed = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::int64_t step = values[i] - std::exchange(before, values[i]);
      add(step - speed);
      speed = i == 0 ? 0 : step;
    }
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

std::int64_t nearest(double x) { return std::llround(x); }

/// x, y, z of points of three floats in steps within a box.
void pack_places(Packer& out, const std::vector<float>& xyz, const Vec3& low, const Vec3& step) {
  std::vector<std::int64_t> values(xyz.size() / 3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = nearest((static_cast<double>(xyz[3 * i + axis]) - low[axis]) / step[axis]);
    out.steps(values);
  }
}

/// A unit vector on the unfolded octahedron, both coordinates -1..1 (Meyer et al., On
/// floating-point normal vectors, Computer Graphics Forum 29 (2010) 1405).
std::array<double, 2> on_octahedron(double x, double y, double z) {
  const double sum = std::abs(x) + std::abs(y) + std::abs(z);
  if (!(sum > 0)) return {0, 0};
  const double u = x / sum, v = y / sum;
  if (z >= 0) return {u, v};
  return {(1 - std::abs(v)) * (u < 0 ? -1 : 1), (1 - std::abs(u)) * (v < 0 ? -1 : 1)};
}

/// The numbers of a mesh go to `out`, if there is one; its description is the result. A mesh that
/// pages keep has a key.
std::string pack_mesh(Packer* out, const Mesh& mesh, const std::string& key = {}) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf}, step{};
  for (const auto* list : {&mesh.positions, &mesh.edge_points})
    for (std::size_t i = 0; i < list->size(); ++i) {
      low[i % 3] = std::min(low[i % 3], static_cast<double>((*list)[i]));
      high[i % 3] = std::max(high[i % 3], static_cast<double>((*list)[i]));
    }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(low[axis] <= high[axis])) low[axis] = high[axis] = 0;
    step[axis] = (high[axis] - low[axis]) / kMeshSteps;
    if (!(step[axis] > 0)) step[axis] = 1;
  }
  if (out) {
    pack_places(*out, mesh.positions, low, step);
    std::vector<std::int64_t> u, v;
    for (std::size_t i = 0; i < mesh.vertex_count(); ++i) {
      const auto n = [&](std::size_t axis) {
        return 3 * i + axis < mesh.normals.size() ? static_cast<double>(mesh.normals[3 * i + axis])
                                                  : (axis == 2 ? 1.0 : 0.0);
      };
      const auto folded = on_octahedron(n(0), n(1), n(2));
      u.push_back(nearest(kNormalSteps * folded[0]));
      v.push_back(nearest(kNormalSteps * folded[1]));
    }
    out->steps(u);
    out->steps(v);
    out->steps(std::vector<std::int64_t>(mesh.triangles.begin(), mesh.triangles.end()));
    for (const std::uint32_t size : mesh.edge_sizes) out->whole(size);
    pack_places(*out, mesh.edge_points, low, step);
  }
  std::vector<json::Field> fields{{"vertices", json::whole(mesh.vertex_count())},
                                  {"triangles", json::whole(mesh.triangle_count())},
                                  {"polylines", json::whole(mesh.edge_sizes.size())},
                                  {"low", json::numbers(low)},
                                  {"step", json::numbers(step)}};
  if (!key.empty()) fields.push_back({"key", json::text(key)});
  if (!out) fields.push_back({"kept", "true"});
  return json::object(fields);
}

bool is_drawable(const render::Item& item) {
  return item.mesh && item.mesh->triangle_count() > 0 &&
         std::all_of(item.mesh->positions.begin(), item.mesh->positions.end(),
                     [](float x) { return std::isfinite(x); }) &&
         std::all_of(item.pose.p.begin(), item.pose.p.end(),
                     [](double x) { return std::isfinite(x); });
}

std::array<double, 7> numbers_of(const Pose& t) {
  const auto q = spatial::to_quaternion(t.R);
  return {t.p[0], t.p[1], t.p[2], q.w, q.x, q.y, q.z};
}

/// Size of what is seen over the whole motion [m]: the steps of places follow it.
double size_of(const render::Scene& scene, const Playback& playback) {
  double most = 0;
  const auto see = [&](const Vec3& p) {
    for (const double x : p) most = std::max(most, std::abs(x));
  };
  for (const render::Item& item : scene.items) see(item.pose.p);
  for (const render::Line& line : scene.lines)
    for (const Vec3& p : line.points) see(p);
  for (const Pose& pose : playback.poses) see(pose.p);
  return most > 0 ? most : 1.0;
}

std::string colour(const Colour& c, std::size_t count) {
  const std::array<double, 4> all{static_cast<double>(c.r), static_cast<double>(c.g),
                                  static_cast<double>(c.b), static_cast<double>(c.a)};
  return json::numbers(std::span(all).first(count), 4);
}

std::string light(const render::Light& l) {
  constexpr const char* kKinds[] = {"sun", "point", "spot", "ambient"};
  return json::object({{"kind", json::text(kKinds[static_cast<std::size_t>(l.kind)])},
                       {"pose", json::numbers(numbers_of(l.pose))},
                       {"colour", colour(l.colour, 3)},
                       {"intensity", json::number(l.intensity, 6)},
                       {"angle", json::number(l.angle, 6)}});
}

std::string camera(const render::Camera& c) {
  constexpr const char* kViews[] = {"isometric", "front", "back",   "left",
                                    "right",     "top",   "bottom", "custom"};
  std::vector<json::Field> fields{{"view", json::text(kViews[static_cast<std::size_t>(c.view)])},
                                  {"perspective", c.perspective ? "true" : "false"},
                                  {"zoom", json::number(c.zoom)}};
  if (c.eye && c.target) {
    fields.push_back({"eye", json::numbers(*c.eye)});
    fields.push_back({"target", json::numbers(*c.target)});
  }
  return json::object(fields);
}

/// What an item is, without its place.
std::vector<json::Field> described(const render::Item& item, std::size_t mesh) {
  const render::Appearance& a = item.appearance;
  return {{"name", json::text(item.name)},
          {"mesh", json::whole(mesh)},
          {"colour", colour(a.colour, 4)},
          {"emission", colour(a.emission, 3)},
          {"shininess", json::number(static_cast<double>(a.shininess), 3)},
          {"metalness", json::number(static_cast<double>(a.metalness), 3)}};
}

std::string pack_line(Packer& out, const render::Line& line, double position_step) {
  std::vector<std::int64_t> values(line.points.size());
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = nearest(line.points[i][k] / position_step);
    out.bends(values);
  }
  return json::object({{"points", json::whole(line.points.size())},
                       {"colour", colour(line.colour, 4)},
                       {"width", json::number(static_cast<double>(line.width), 3)}});
}

/// Rows of a long table that stand for all: of every run of rows, the two where a column has its
/// least and its greatest value are known by `value_at`.
struct Thinning {
  std::size_t rows = 0, run = 1;
  explicit Thinning(std::size_t all) : rows(all) {
    if (all > kMostSamples) run = (2 * all + kMostSamples - 1) / kMostSamples;
  }
  /// Rows whose times are kept.
  [[nodiscard]] std::vector<std::size_t> kept() const {
    std::vector<std::size_t> out;
    if (run < 2) {
      for (std::size_t i = 0; i < rows; ++i) out.push_back(i);
      return out;
    }
    for (std::size_t first = 0; first < rows; first += run) {
      out.push_back(first);
      if (const std::size_t last = std::min(first + run, rows) - 1; last > first)
        out.push_back(last);
    }
    return out;
  }
  /// What a column shows at kept().
  [[nodiscard]] std::vector<double> values(const std::vector<double>& all) const {
    if (run < 2) return all;
    std::vector<double> out;
    for (std::size_t first = 0; first < rows; first += run) {
      const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
      const auto end = all.begin() + static_cast<std::ptrdiff_t>(std::min(first + run, rows));
      const auto [least, greatest] = std::minmax_element(begin, end);
      const auto [a, b] =
          least < greatest ? std::pair{*least, *greatest} : std::pair{*greatest, *least};
      out.push_back(a);
      if (end - begin > 1) out.push_back(b);
    }
    return out;
  }
};

std::string pack_column(Packer& out, const recording::Column& column,
                        const std::vector<double>& shown) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : shown)
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  if (!(low <= high)) low = high = 0;
  const double step = (high - low) / kColumnSteps;
  std::vector<std::int64_t> codes;
  for (const double x : shown)
    codes.push_back(!std::isfinite(x) ? kNoNumber : step > 0 ? nearest((x - low) / step) : 0);
  out.steps(codes);
  std::vector<json::Field> fields{{"name", json::text(column.name)},
                                  {"unit", json::text(column.unit)},
                                  {"doc", json::text(column.doc)},
                                  {"low", json::number(low)},
                                  {"high", json::number(high)}};
  if (std::isfinite(column.lower)) fields.push_back({"lower", json::number(column.lower)});
  if (std::isfinite(column.upper)) fields.push_back({"upper", json::number(column.upper)});
  return json::object(fields);
}

/// The times to which a playback is resampled: even, both ends included.
struct Frames {
  std::size_t count = 0;
  double start = 0, step = 0;
  [[nodiscard]] double time(std::size_t i) const { return start + static_cast<double>(i) * step; }
};

Result<Frames> frames_of(const Playback& playback, double frame_rate) {
  const double length = duration(playback);
  if (!(length > 0))
    return error(ErrorCode::invalid_argument,
                 "the recording has no duration, so there is nothing to replay",
                 "Record two samples or more.");
  double closest = length;
  for (std::size_t i = 1; i < playback.times.size(); ++i)
    closest = std::min(closest, playback.times[i] - playback.times[i - 1]);
  const double wanted = std::max(1 / frame_rate, closest);
  // A little less than one step more is no further frame: times are sums of rounded numbers.
  const double steps = std::max(1.0, std::ceil(length / wanted - 1e-6));
  if (steps * static_cast<double>(std::max<std::size_t>(playback.ids.size(), 1)) >
      static_cast<double>(kMostPoses))
    return error(ErrorCode::invalid_argument,
                 "the replay would hold " + text::print_rounded(steps, 3) + " poses of each of " +
                     std::to_string(playback.ids.size()) + " bodies",
                 "Give a lower fps.", "fps");
  return Frames{static_cast<std::size_t>(steps) + 1, playback.times.front(), length / steps};
}

/// Packs the poses of all moving bodies.
Result<void> pack_tracks(Packer& out, const Playback& playback, const Frames& frames,
                         double position_step, Progress& progress) {
  const std::size_t bodies = playback.ids.size();
  std::vector<std::array<std::vector<std::int64_t>, 7>> tracks(bodies);
  std::vector<std::array<double, 7>> before(bodies);
  for (std::size_t f = 0; f < frames.count; ++f) {
    if (f % 256 == 0) {
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the replay was cancelled", "Write it again.");
      progress.report(static_cast<double>(f) / static_cast<double>(frames.count), "packing motion");
    }
    const auto poses = poses_at(playback, frames.time(f));
    for (std::size_t b = 0; b < bodies; ++b) {
      auto now = numbers_of(poses[b]);
      double cosine = 0;
      for (std::size_t k = 3; k < 7; ++k) cosine += now[k] * before[b][k];
      if (cosine < 0)
        for (std::size_t k = 3; k < 7; ++k) now[k] = -now[k];
      before[b] = now;
      for (std::size_t k = 0; k < 7; ++k)
        tracks[b][k].push_back(nearest(now[k] / (k < 3 ? position_step : kRotationStep)));
    }
  }
  for (const auto& track : tracks)
    for (const auto& numbers : track) out.bends(numbers);
  return {};
}

}  // namespace

Result<ReplayData> replay_data(const render::Scene& scene, const Playback& playback,
                               const ReplayRequest& request, Progress& progress) {
  RMP_TRY(check(playback));
  RMP_TRY_ASSIGN(const Frames frames, frames_of(playback, request.frame_rate));
  for (const recording::Column* column : request.columns)
    if (column->values.size() != playback.times.size())
      return error(ErrorCode::invalid_argument,
                   "column " + text::quote(column->name) + " has a different number of samples",
                   "Simulate again.", "columns");
  // 16 bits over the size of the scene to either side of the origin.
  const double position_step = size_of(scene, playback) / 65536;
  std::unordered_map<std::uint64_t, std::size_t> track_of;
  for (std::size_t i = 0; i < playback.ids.size(); ++i) track_of[playback.ids[i]] = i;
  Packer out;
  std::vector<std::string> meshes, items, triads, lines, lights, columns;

  std::unordered_map<const Mesh*, std::size_t> mesh_of;
  const auto place = [&](std::uint64_t id, const Pose& pose) -> json::Field {
    if (const auto at = track_of.find(id); at != track_of.end())
      return {"track", json::whole(at->second)};
    return {"pose", json::numbers(numbers_of(pose))};
  };
  for (const render::Item& item : scene.items) {
    if (!is_drawable(item)) continue;
    const auto [at, is_new] = mesh_of.try_emplace(item.mesh.get(), meshes.size());
    if (is_new) meshes.push_back(pack_mesh(&out, *item.mesh));
    std::vector<json::Field> fields = described(item, at->second);
    fields.push_back(place(item.id, item.pose));
    items.push_back(json::object(fields));
  }
  RMP_TRY(pack_tracks(out, playback, frames, position_step, progress));
  for (const render::Triad& t : scene.triads)
    triads.push_back(json::object({{"label", json::text(t.label)},
                                   {"length", json::number(t.length, 4)},
                                   place(t.id, t.pose)}));
  for (const render::Line& line : scene.lines) lines.push_back(pack_line(out, line, position_step));
  for (const render::Light& l : scene.lights) lights.push_back(light(l));
  const Thinning thinning(playback.times.size());
  std::vector<std::int64_t> ticks;
  for (const std::size_t row : thinning.kept())
    ticks.push_back(nearest((playback.times[row] - frames.start) / kTimeStep));
  out.bends(ticks);
  for (const recording::Column* column : request.columns)
    columns.push_back(pack_column(out, *column, thinning.values(column->values)));

  ReplayData data;
  data.header = json::object({{"format", "1"},
                              {"title", json::text(request.title)},
                              {"camera", camera(request.camera)},
                              {"frames", json::whole(frames.count)},
                              {"start", json::number(frames.start)},
                              {"step", json::number(frames.step)},
                              {"position_step", json::number(position_step)},
                              {"rotation_step", json::number(kRotationStep)},
                              {"time_step", json::number(kTimeStep)},
                              {"meshes", json::list(meshes)},
                              {"items", json::list(items)},
                              {"tracks", json::whole(playback.ids.size())},
                              {"triads", json::list(triads)},
                              {"lines", json::list(lines)},
                              {"lights", json::list(lights)},
                              {"samples", json::whole(ticks.size())},
                              {"columns", json::list(columns)}});
  data.bytes = out.take();
  data.frames = frames.count;
  data.step = frames.step;
  data.position_step = position_step;
  return data;
}

std::string MeshKeys::of(const std::shared_ptr<const Mesh>& mesh) {
  const std::lock_guard lock(mutex_);
  if (const auto at = keys_.find(mesh); at != keys_.end()) return at->second;
  if (keys_.size() >= cleaned_) {
    std::erase_if(keys_, [](const auto& entry) { return entry.first.expired(); });
    cleaned_ = std::max<std::size_t>(64, 2 * keys_.size());
  }
  Fingerprinter print("shown mesh/1");
  const auto add = [&print](const auto& numbers) {
    using Number = typename std::decay_t<decltype(numbers)>::value_type;
    print.add(std::string_view(reinterpret_cast<const char*>(numbers.data()),
                               numbers.size() * sizeof(Number)));
  };
  add(mesh->positions);
  add(mesh->normals);
  add(mesh->triangles);
  add(mesh->edge_points);
  add(mesh->edge_sizes);
  return keys_.emplace(mesh, print.finish().hex()).first->second;
}

SceneData scene_data(const render::Scene& scene, const render::Camera& view, MeshKeys& keys,
                     std::string_view known, const std::set<std::string>& kept) {
  SceneData data;
  const auto add_pose = [&data](const Pose& pose) {
    const auto numbers = numbers_of(pose);
    data.poses.insert(data.poses.end(), numbers.begin(), numbers.end());
  };
  std::vector<std::string> items, triads, lines, lights, meshes;
  std::vector<const Mesh*> order;
  std::vector<std::string> key_of;
  std::unordered_map<const Mesh*, std::size_t> mesh_of;
  for (const render::Item& item : scene.items) {
    if (!is_drawable(item)) continue;
    const auto [at, is_new] = mesh_of.try_emplace(item.mesh.get(), order.size());
    if (is_new) {
      order.push_back(item.mesh.get());
      key_of.push_back(keys.of(item.mesh));
    }
    items.push_back(json::object(described(item, at->second)));
    add_pose(item.pose);
  }
  for (const render::Triad& t : scene.triads) {
    triads.push_back(
        json::object({{"label", json::text(t.label)}, {"length", json::number(t.length, 4)}}));
    add_pose(t.pose);
  }
  // Lines do not move, so that their step does not either.
  double size = 0;
  for (const render::Line& line : scene.lines)
    for (const Vec3& p : line.points)
      for (const double x : p) size = std::max(size, std::abs(x));
  const double position_step = (size > 0 ? size : 1.0) / 65536;
  Packer points;
  for (const render::Line& line : scene.lines)
    lines.push_back(pack_line(points, line, position_step));
  for (const render::Light& l : scene.lights) lights.push_back(light(l));
  const std::string packed = points.take();
  Fingerprinter print("shown scene/1");
  for (const auto* list : {&items, &triads, &lines, &lights, &key_of}) {
    print.add(list->size());
    for (const std::string& text : *list) print.add(text);
  }
  print.add(packed).add(camera(view));
  data.shape = print.finish().hex();
  if (data.shape == known) return data;
  Packer out;
  for (std::size_t i = 0; i < order.size(); ++i)
    meshes.push_back(pack_mesh(kept.contains(key_of[i]) ? nullptr : &out, *order[i], key_of[i]));
  data.header = json::object({{"format", "1"},
                              {"title", json::text("")},
                              {"camera", camera(view)},
                              {"frames", "1"},
                              {"start", "0"},
                              {"step", "1"},
                              {"position_step", json::number(position_step)},
                              {"rotation_step", json::number(kRotationStep)},
                              {"time_step", json::number(kTimeStep)},
                              {"meshes", json::list(meshes)},
                              {"items", json::list(items)},
                              {"tracks", "0"},
                              {"triads", json::list(triads)},
                              {"lines", json::list(lines)},
                              {"lights", json::list(lights)},
                              {"samples", "0"},
                              {"columns", "[]"}});
  data.bytes = out.take() + packed;
  return data;
}

}  // namespace robomosp::scene
