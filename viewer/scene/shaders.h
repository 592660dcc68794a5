// SPDX-License-Identifier: GPL-3.0-or-later
// GLSL 1.30 sources of the viewer's programs (layer: GUI). World coordinates have z up; light is
// linear until the last line of each fragment shader.
#pragma once

#include <array>
#include <string>

namespace robomosp::viewer {

/// Sources of one program.
struct ShaderPair {
  std::string vertex, fragment;
};

/// Texture units of the two shadow maps.
inline constexpr int kLampUnit = 1, kSkyUnit = 2, kLampUnit2 = 3, kSkyUnit2 = 4;
/// World to shadow map, of every map that a shader may look up.
inline constexpr std::array<const char*, 4> kMapUniforms{"lamp_map", "sky_map", "lamp_map_2",
                                                         "sky_map_2"};

/// What a program is compiled for.
struct ShaderVariant {
  bool is_quality = false;  ///< physically based highlights and filtered shadows
  bool is_still = false;    ///< one pass of many: linear light, lit from one point of lamp and sky
  bool is_flat = false;     ///< one normal a triangle
  /// Number of lamps, if it is known: software OpenGL runs a loop over a uniform number several
  /// times slower. 0 = as many as the uniform lamp_count says.
  int lamps = 0;
  bool has_own_lamp = false;  ///< the lamp is the renderer's own, which shines in parallel
};

[[nodiscard]] ShaderPair surface_shader(ShaderVariant v);     ///< items and arrows
[[nodiscard]] ShaderPair ground_shader(ShaderVariant v);      ///< floor: grid, axes, shadows
[[nodiscard]] ShaderPair background_shader(ShaderVariant v);  ///< the wall the floor fades into
[[nodiscard]] ShaderPair edge_shader(ShaderVariant v);        ///< feature edges
[[nodiscard]] ShaderPair ribbon_shader(ShaderVariant v);      ///< lines of constant width in pixels
[[nodiscard]] ShaderPair outline_shader(ShaderVariant v);     ///< rim around selected items
[[nodiscard]] ShaderPair paper_shader(ShaderVariant v);       ///< one colour without any light
[[nodiscard]] ShaderPair cut_shader(ShaderVariant v);         ///< cut faces of a section
[[nodiscard]] ShaderPair ball_shader(ShaderVariant v);        ///< the ball at a centre of mass
[[nodiscard]] ShaderPair caster_shader();                     ///< depth only, for shadow maps

}  // namespace robomosp::viewer
