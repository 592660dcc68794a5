// SPDX-License-Identifier: Apache-2.0
#include <optional>

#include "ioci/core/commands.h"

namespace robomosp::ioci {
namespace {

Schema look_and_mass(bool creating) {
  const auto density = [&](ParamSpec p) {
    p.min = 0;
    p.required = creating;
    return p;
  };
  return {
      density(optional("density", "real", "kg/m^3", "Density; 0 for an appearance without mass.")),
      optional("colour", "any", "",
               "Base colour, \"#rrggbb\" or {r, g, b} from 0 to 1 (sRGB); a fourth component is "
               "opacity."),
      between(optional("opacity", "real", "", "0 invisible to 1 opaque."), 0, 1),
      between(optional("shininess", "real", "", "0 matt to 1 mirror-like."), 0, 1),
      between(optional("metalness", "real", "", "0 paint or plastic to 1 bare metal."), 0, 1),
      optional("ambient", "any", "",
               "Colour in the shade, given like colour; \"\" returns to the base colour."),
      optional("specular", "any", "",
               "Colour of highlights, given like colour; \"\" returns to that of metalness."),
      optional("emission", "any", "", "Emitted light, given like colour; black is none."),
      optional("description", "string", "", "Its description."),
      optional("source", "string", "", "Source of the density.")};
}

/// A colour that "" takes away.
Result<void> apply_colour(const Map& args, std::string_view name, std::optional<Colour>& to) {
  if (!has(args, name)) return {};
  const Value& value = *args.find(name);
  if (value.as_string() && value.as_string()->empty()) {
    to.reset();
    return {};
  }
  RMP_TRY_ASSIGN(to, read_colour(value, name));
  return {};
}

Result<void> apply(const Map& args, model::Material& m) {
  if (has(args, "density")) m.density = real(args, "density");
  if (has(args, "colour")) {
    // Without a fourth part the opacity stays, as one works on colour and opacity in turn.
    const Value& value = *args.find("colour");
    const float opacity = m.colour.a;
    RMP_TRY_ASSIGN(m.colour, read_colour(value, "colour"));
    const bool has_alpha =
        value.as_string() ? value.as_string()->size() == 9 : reals(&value).size() == 4;
    if (!has_alpha) m.colour.a = opacity;
  }
  if (has(args, "opacity")) m.colour.a = static_cast<float>(real(args, "opacity"));
  if (has(args, "shininess")) m.shininess = real(args, "shininess");
  if (has(args, "metalness")) m.metalness = real(args, "metalness");
  RMP_TRY(apply_colour(args, "ambient", m.ambient));
  RMP_TRY(apply_colour(args, "specular", m.specular));
  if (has(args, "emission")) {
    RMP_TRY_ASSIGN(m.emission, read_colour(*args.find("emission"), "emission"));
  }
  if (has(args, "description")) m.description = text_of(args, "description");
  if (has(args, "source")) m.source = text_of(args, "source");
  return {};
}

Result<Value> create_material(CommandContext& ctx, const Map& args) {
  model::Material m;
  RMP_TRY_ASSIGN(m.parametric,
                 read_parameters(ctx.snapshot(), {}, args.find("parameters"), "parameters"));
  RMP_TRY(apply(args, m));
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(text_of(args, "name"), std::move(m)));
  return Value(Application::handle(id));
}

Result<Value> set_material(CommandContext& ctx, const Map& args) {
  RMP_TRY(change<model::Material>(ctx, ref(args, "id"),
                                  [&](model::Material& m) { return apply(args, m); }));
  return Value();
}

}  // namespace

RMP_COMMANDS(material_commands) {
  std::vector<CommandSpec> all;
  Schema create_params = look_and_mass(true);
  create_params.insert(create_params.begin(),
                       needed("name", "string", "", "Name, unique among materials."));
  create_params.push_back(parameters_field());
  all.push_back({.name = "material.create",
                 .classic = "",
                 .summary = "Makes a material.",
                 .details = "",
                 .example =
                     "local steel = material.create{name = \"steel\", density = 7850, colour = "
                     "\"#b0b4b8\", metalness = 1}\nassert(steel:describe().density == 7850)\n"
                     "material.create{name = \"lamp\", density = 1200, colour = \"#ffd080\", "
                     "opacity = 0.5, emission = {0.4, 0.3, 0.1}}",
                 .params = std::move(create_params),
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create_material});
  Schema set_params = look_and_mass(false);
  set_params.insert(set_params.begin(), self("material"));
  all.push_back(
      {.name = "material.set",
       .classic = "",
       .summary = "Changes the given properties of a material.",
       .details = "The mass and the appearance of everything made of it follow at once.",
       .example = "local steel = material.create{name = \"steel\", density = \"7.85 "
                  "g/cm^3\"}\nsteel:set{density = 7900}\nassert(steel:describe().density == 7900)",
       .params = std::move(set_params),
       .returns = {},
       .effect = Effect::edits,
       .run = set_material});
  return all;
}

}  // namespace robomosp::ioci
