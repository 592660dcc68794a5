// SPDX-License-Identifier: Apache-2.0
// Worlds as texts, with all that they refer to: from one program to another, without files.
#include "io/pack.h"

#include "ioci/core/commands.h"
#include "kernel/base64.h"

namespace robomosp::ioci {
namespace {

Result<Value> pack(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const io::Pack made, io::pack(ctx.snapshot(), ref(args, "id")));
  Map texts, geometries;
  for (const auto& [name, text] : made.files.texts) texts.append(name, text);
  for (const auto& [name, geometry] : made.files.geometries) {
    RMP_TRY_ASSIGN(const std::string bytes, io::geometry_bytes(*geometry));
    std::string coded;
    base64::append(coded, bytes);
    geometries.append(name, std::move(coded));
  }
  return Value(
      Map{{"main", made.main}, {"texts", std::move(texts)}, {"geometries", std::move(geometries)}});
}

Error wrong(std::string what, std::string where) {
  return error(ErrorCode::invalid_argument, std::move(what),
               "Give the table returned by world.pack.", std::move(where));
}

Result<Value> unpack(CommandContext& ctx, const Map& args) {
  io::MemoryFiles files;
  for (const auto& [name, text] : *args.find("texts")->as_map()) {
    if (!text.as_string()) return wrong("the text " + text::quote(name) + " is no text", "texts");
    files.texts.emplace(name, *text.as_string());
  }
  if (const Value* given = args.find("geometries"); given && given->as_map())
    for (const auto& [name, coded] : *given->as_map()) {
      const std::string* text = coded.as_string();
      const auto size = text ? base64::decoded_size(*text) : std::nullopt;
      std::string bytes(size.value_or(0), '\0');
      if (!size || !base64::decode(*text, bytes.data()))
        return wrong("the geometry " + text::quote(name) + " is not base64", "geometries");
      const auto form =
          std::filesystem::path(name).extension() == io::geometry_extension(CsgGeometry::Form::mesh)
              ? CsgGeometry::Form::mesh
              : CsgGeometry::Form::brep;
      RMP_TRY_ASSIGN(auto geometry, io::parse_geometry(form, std::move(bytes), name));
      files.geometries.emplace(name, std::move(geometry));
    }
  const std::string main = text_of(args, "main");
  if (!files.texts.contains(main))
    return wrong("there is no text " + text::quote(main) + " among them", "main");
  RMP_TRY_ASSIGN(const io::Loaded loaded,
                 io::load_memory(ctx.edit(), files, main, "pack", {}, ctx.app.library));
  if (loaded.id.kind != Kind::world)
    return wrong(
        text::quote(main) + " is no world, but a " + std::string(to_string(loaded.id.kind)),
        "main");
  for (const std::string& note : loaded.notes)
    ctx.app.messages.post(Severity::info, "file_note", note, "io");
  for (const std::string& warning : loaded.warnings)
    ctx.app.messages.post(Severity::warning, "file_note", warning, "io");
  return Value(Application::handle(loaded.id));
}

}  // namespace

RMP_COMMANDS(world_pack_commands) {
  std::vector<CommandSpec> all;
  const char* kExample =
      "local cell = world.create{name = \"cell\"}\n"
      "solid.create{name = \"part\", root = {kind = \"box\", x = 0.05, y = 0.05, z = 0.05}}\n"
      "cell:add_object{what = \"part\"}\n"
      "local pack = cell:pack()\n"
      "local copy = world.unpack(pack)\n"
      "assert(copy.name ~= \"cell\" and copy:objects()[1].name == \"part\")";
  all.push_back(
      {.name = "world.pack",
       .classic = "",
       .summary = "Returns a world with everything it refers to as texts.",
       .details = "In their present state, saved or not. world.unpack recreates the world from "
                  "them, in this program or in another one of the same version.",
       .example = kExample,
       .params = {self("world")},
       .returns = {"map",
                   "",
                   "The texts.",
                   {field("main", "string", "", "Index of the world's text."),
                    field("texts", "map", "", "The text of each record, by its name here."),
                    field("geometries", "map", "",
                          "The bytes of imported geometries, in base64 (RFC 4648).")}},
       .effect = Effect::reads,
       .run = pack});
  all.push_back({.name = "world.unpack",
                 .classic = "",
                 .summary = "Recreates a world from the result of world.pack.",
                 .details = "Records are renamed if their names are taken. Nothing is written.",
                 .example = kExample,
                 .params = {needed("main", "string", "", "Index of the world's text."),
                            needed("texts", "map", "", "The text of each record."),
                            optional("geometries", "map", "", "Bytes of geometries, in base64.")},
                 .returns = {"handle", "", "The world.", {}},
                 .effect = Effect::edits,
                 .run = unpack});
  return all;
}

}  // namespace robomosp::ioci
