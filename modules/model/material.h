// SPDX-License-Identifier: Apache-2.0
// Materials (layer: data processing, model). SI.
#pragma once

#include <optional>
#include <string>

#include <robomosp/sdk/types.h>

#include "model/basics.h"
#include "model/fields.h"

namespace robomosp::model {

struct Material {
  std::string description;
  std::string source;              ///< source of the density
  double density = 1000;           ///< [kg/m^3]; 0 = a look without mass
  Colour colour;                   ///< base (diffuse) colour, sRGB; a = opacity
  double shininess = 0.3;          ///< 0 matt .. 1 mirror-like
  double metalness = 0.0;          ///< 0 paint or plastic .. 1 bare metal
  std::optional<Colour> ambient;   ///< colour in the shade; none = the base colour
  std::optional<Colour> specular;  ///< colour of highlights; none = by metalness
  Colour emission{0, 0, 0, 1};     ///< emitted light
  Parametric parametric = {};
};
template <class V>
constexpr void fields(V& v, Of<Material>) {
  v("description", &Material::description).doc("Its description.");
  v("source", &Material::source).doc("Source of the density.");
  v("parametric", &Material::parametric).flat().doc("Parameters and expressions.");
  v("density", &Material::density)
      .unit("kg/m^3")
      .at_least(0)
      .needed()
      .with_unit()
      .doc("Mass per volume; 0 for an appearance without mass.");
  v("colour", &Material::colour).doc("Base colour in sRGB, followed by the opacity.");
  v("shininess", &Material::shininess).range(0, 1).doc("From 0 matt to 1 mirror-like.");
  v("metalness", &Material::metalness)
      .range(0, 1)
      .doc("From 0 for paint and plastic to 1 for bare metal.");
  v("ambient", &Material::ambient)
      .label("ambient colour")
      .doc("Colour in the shade; none is the base colour.");
  v("specular", &Material::specular)
      .label("specular colour")
      .doc("Colour of highlights; none follows the metalness.");
  v("emission", &Material::emission).doc("Colour of the emitted light.");
}

}  // namespace robomosp::model
