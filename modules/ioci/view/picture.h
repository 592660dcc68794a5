// SPDX-License-Identifier: Apache-2.0
// What the commands that draw pictures share: parameters of the camera and the look, how they are
// read, and the renderer (layer: application). Internal to modules/ioci.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <robomosp/sdk/render.h>

#include "ioci/core/commands.h"
#include "scene/build.h"
#include "scene/extras.h"
#include "scene/path_lines.h"

namespace robomosp::ioci {

/// What a picture of a kind can show.
struct PictureAbilities {
  bool has_mass = true, has_frames = true, has_parts = true, has_joints = false, moves = false;
  bool records = false;      ///< recordings of robots alone
  bool has_layers = false;   ///< overlays by name
  bool has_members = false;  ///< of a world, which can be left out
  bool has_fading = false;   ///< places drawn with less opacity
};

/// `without`: members of a world that are left out.
[[nodiscard]] ParamSpec without_param();
/// `fade`: places drawn with less opacity.
[[nodiscard]] ParamSpec fade_param();
/// Applies them to what build() made; `what` is the record that paths without another one are of.
[[nodiscard]] Result<void> apply_visibility(const CommandContext& ctx, const Map& args, AnyId what,
                                            scene::Built& built);
/// Turns the overlays on that the argument `layers` names.
[[nodiscard]] Result<void> read_layers(const Map& args, scene::Extras& extras);

/// Parameters of where a picture is taken from: view, projection, zoom, eye, target.
[[nodiscard]] Schema camera_params();
/// Parameters of a picture besides what is drawn and the file.
[[nodiscard]] Schema picture_params(const PictureAbilities& can);

/// Reads camera_params().
[[nodiscard]] Result<render::Camera> read_camera(const Map& args);
/// Reads what of picture_params() is not about what is drawn: size, quality, look without section.
[[nodiscard]] Result<render::Options> read_picture(const Map& args);
/// `paths`: what of trajectories a picture shows.
[[nodiscard]] ParamSpec paths_param();
/// What of trajectories a picture shows.
[[nodiscard]] scene::ShownPath read_paths(const Map& args);
/// The section of a picture; an axis alone goes through the middle of the scene.
[[nodiscard]] Result<std::optional<render::Section>> read_section(const CommandContext& ctx,
                                                                  const Map& args,
                                                                  const render::Scene& scene);
/// True when there is something to draw, all of it on the side that is taken away.
[[nodiscard]] bool takes_all(const render::Section& section, const render::Scene& scene);

/// Finds out before the work whether a file can be written there afterwards: its ending, such as
/// ".png" in either case, and its folder. `only` is what to do about another ending.
[[nodiscard]] Result<void> check_new_file(const std::string& file, const std::string& extension,
                                          const char* only);

/// The renderer of the program, made with the first picture.
[[nodiscard]] Result<std::shared_ptr<render::Renderer>> renderer(Application& app);
/// A picture of the size that was asked for.
[[nodiscard]] Result<render::Image> draw_image(const render::Renderer& drawer,
                                               const render::Scene& scene,
                                               const render::Options& options, Progress& progress);
/// A picture as the bytes of a PNG file.
[[nodiscard]] Result<std::string> draw_png(const render::Renderer& drawer,
                                           const render::Scene& scene,
                                           const render::Options& options, Progress& progress);

}  // namespace robomosp::ioci
