// SPDX-License-Identifier: Apache-2.0
// The interface robomosp.renderer/1 as it was: scenes and options without a size, elements without
// room. tests/abi/frozen has the header that plugins saw.
#include "kernel/renderer_v1.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/render.h>

namespace robomosp {
namespace render_v1 {

using render::Appearance, render::Background, render::Camera, render::Image, render::Quality,
    render::Section, render::Style;

struct Item {
  std::uint64_t id = 0;
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose pose;
  Appearance appearance;
  bool selected = false;
};
struct Line {
  std::uint64_t id = 0;
  std::vector<Vec3> points;
  Colour colour{0.95F, 0.45F, 0.10F, 1.0F};
  float width = 2.5F;
};
struct Triad {
  std::uint64_t id = 0;
  Pose pose;
  double length = 0.1;
  std::string label;
  bool on_top = false;
};
struct MassMark {
  std::uint64_t id = 0;
  Pose pose;
  Vec3 gyration{};
  std::string label;
};
struct Label {
  Vec3 place{};
  std::string text;
};
struct Legend {
  struct Tick {
    double share = 0;
    std::string text;
  };
  std::string title;
  std::vector<Colour> colours;
  std::vector<Tick> ticks;
};
struct Light {
  enum class Kind : std::int32_t { sun, point, spot };
  Kind kind = Kind::point;
  Pose pose;
  Colour colour;
  double intensity = 1;
  double angle = 0.5;
};
struct Scene {
  std::vector<Item> items;
  std::vector<Line> lines;
  std::vector<Triad> triads;
  std::vector<MassMark> marks;
  std::vector<Label> labels;
  std::vector<Legend> legends;
  std::vector<Light> lights;
};
struct Look {
  Camera camera;
  Style style = Style::smooth;
  bool feature_edges = true;
  bool hidden_edges = false;
  std::optional<Section> section;
  Background background = Background::automatic;
  Colour background_colour{1, 1, 1, 1};
  bool grid = true;
  bool world_axes = true;
  std::string caption;
};
struct Options {
  int width = 800, height = 600;
  Quality quality = Quality::normal;
  Look look;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  virtual Result<Image> draw(const Scene& scene, const Options& options, Progress&) const = 0;
  virtual Result<std::string> png(const Image& image) const = 0;
};

}  // namespace render_v1

namespace {

render_v1::Scene then(const render::Scene& s) {
  render_v1::Scene out;
  for (const render::Item& i : s.items)
    out.items.push_back({i.id, i.name, i.mesh, i.pose, i.appearance, i.selected});
  for (const render::Line& l : s.lines) out.lines.push_back({l.id, l.points, l.colour, l.width});
  for (const render::Triad& t : s.triads)
    out.triads.push_back({t.id, t.pose, t.length, t.label, t.on_top});
  for (const render::MassMark& m : s.marks)
    out.marks.push_back({m.id, m.pose, m.gyration, m.label});
  for (const render::Label& l : s.labels) out.labels.push_back({l.place, l.text});
  for (const render::Legend& l : s.legends) {
    render_v1::Legend& legend = out.legends.emplace_back();
    legend.title = l.title;
    legend.colours = l.colours;
    for (const render::Legend::Tick& t : l.ticks) legend.ticks.push_back({t.share, t.text});
  }
  for (const render::Light& l : s.lights)
    out.lights.push_back(
        {static_cast<render_v1::Light::Kind>(l.kind), l.pose, l.colour, l.intensity, l.angle});
  return out;
}

render_v1::Options then(const render::Options& o) {
  const render::Look& l = o.look;
  return {o.width,
          o.height,
          o.quality,
          {l.camera, l.style, l.feature_edges, l.hidden_edges, l.section, l.background,
           l.background_colour, l.grid, l.world_axes, l.caption}};
}

class RendererNow final : public render::Renderer {
 public:
  explicit RendererNow(render_v1::Renderer* old) : old_(old) {}
  [[nodiscard]] const void* extension(const char* id) const override { return old_->extension(id); }
  Result<render::Image> draw(const render::Scene& scene, const render::Options& options,
                             Progress& progress) const override {
    return old_->draw(then(scene), then(options), progress);
  }
  Result<std::string> png(const render::Image& image) const override { return old_->png(image); }

 private:
  std::unique_ptr<render_v1::Renderer> old_;
};

}  // namespace

void* renderer_of_1(void* made) {
  return static_cast<render::Renderer*>(new RendererNow(static_cast<render_v1::Renderer*>(made)));
}

}  // namespace robomosp
