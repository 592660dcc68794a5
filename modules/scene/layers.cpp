// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "kernel/text.h"
#include "scene/extras.h"

namespace robomosp::scene {
namespace {

struct Layer {
  const char* name;
  void (*set)(Extras&, bool);
};

void set_paths(Extras& e, ShownPath layer, bool is_shown) {
  if (is_shown) e.paths = std::max(e.paths, layer);
  else e.paths = std::min(e.paths, static_cast<ShownPath>(static_cast<int>(layer) - 1));
}

constexpr std::array kLayers{
    Layer{"centres_of_mass", [](Extras& e, bool on) { e.com = on; }},
    Layer{"clearances", [](Extras& e, bool on) { e.clearances = on; }},
    Layer{"contacts", [](Extras& e, bool on) { e.contacts = on; }},
    Layer{"dh_rows", [](Extras& e, bool on) { e.dh_rows = on; }},
    Layer{"dimensions", [](Extras& e, bool on) { e.dimensions = on; }},
    Layer{"force_ellipsoids", [](Extras& e, bool on) { e.ellipsoids.force = on; }},
    Layer{"frames", [](Extras& e, bool on) { e.frames = on; }},
    Layer{"labels", [](Extras& e, bool on) { e.labels = on; }},
    Layer{"path_arrows", [](Extras& e, bool on) { set_paths(e, ShownPath::arrows, on); }},
    Layer{"path_faults", [](Extras& e, bool on) { e.path_faults = on; }},
    Layer{"path_frames", [](Extras& e, bool on) { set_paths(e, ShownPath::frames, on); }},
    Layer{"path_points", [](Extras& e, bool on) { set_paths(e, ShownPath::points, on); }},
    Layer{"path_speeds", [](Extras& e, bool on) { e.path_speeds = on; }},
    Layer{"paths", [](Extras& e, bool on) { set_paths(e, ShownPath::line, on); }},
    Layer{"velocity_ellipsoids", [](Extras& e, bool on) { e.ellipsoids.velocity = on; }},
};

}  // namespace

std::vector<std::string> layer_names() {
  std::vector<std::string> out;
  for (const Layer& layer : kLayers) out.emplace_back(layer.name);
  return out;
}

Result<void> set_layer(Extras& extras, std::string_view name, bool is_shown) {
  for (const Layer& layer : kLayers)
    if (layer.name == name) {
      layer.set(extras, is_shown);
      return {};
    }
  return error(ErrorCode::unknown_name, "there is no layer " + text::quote(name),
               "Layers are: " + text::join(layer_names(), ", ") + ".");
}

}  // namespace robomosp::scene
