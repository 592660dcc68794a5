// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"

namespace robomosp::ioci {
namespace {

Schema look_and_mass(bool creating) {
  Schema s =
      led_by({"density", "colour", "shininess", "metalness", "ambient", "specular", "emission"},
             record_params("material", ""));
  param_named(s, "density").required = creating;
  for (const char* colour : {"ambient", "specular"}) {
    ParamSpec& p = param_named(s, colour);
    p.type = "colour or string";
    p.doc += " Given like colour; \"\" returns to that.";
  }
  param_named(s, "colour").doc =
      "Base colour, \"#rrggbb\" or {r, g, b} from 0 to 1 (sRGB); a fourth component is opacity.";
  s.insert(s.begin() + 2,
           between(optional("opacity", "real", "", "0 invisible to 1 opaque."), 0, 1));
  return s;
}

Result<void> apply(const Map& args, model::Material& m) {
  const float opacity = m.colour.a;
  RMP_TRY(set_fields(m, args));
  if (has(args, "colour")) {
    // Without a fourth part the opacity stays, as one works on colour and opacity in turn.
    const Value& value = *args.find("colour");
    const bool has_alpha =
        value.as_string() ? value.as_string()->size() == 9 : reals(&value).size() == 4;
    if (!has_alpha) m.colour.a = opacity;
  }
  if (has(args, "opacity")) m.colour.a = static_cast<float>(real(args, "opacity"));
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
