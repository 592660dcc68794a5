// SPDX-License-Identifier: Apache-2.0
// Files of programs as the commands read and write them (layer: application, ioci only).
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/commands.h"
#include "model/program.h"
#include "program_source/foreign_files.h"
#include "program_source/place.h"

namespace robomosp::ioci {

/// The program of an argument `id`.
[[nodiscard]] inline const model::Program& program_of(const CommandContext& ctx, const Map& args) {
  const model::Record* r = ctx.snapshot().find(ref(args, "id"));
  return std::get<model::OtherContent>(r->body).as<model::Program>();
}
template <class Fn>
Result<void> edit_program(CommandContext& ctx, AnyId id, Fn&& fn) {
  return ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    return fn(std::get<model::OtherContent>(r.body).as<model::Program>());
  });
}

/// Text of a file or argument; a note is posted if it was not in UTF-8.
[[nodiscard]] inline Result<std::string> told_source(CommandContext& ctx, const std::string& file,
                                                     std::string_view bytes) {
  return program_source::told_source(ctx.app.messages, file, bytes);
}
using program_source::lines_of, program_source::text_of_file;

/// A provider of robomosp.language/1; "" is the default one.
[[nodiscard]] inline Result<std::shared_ptr<Language>> language_of(CommandContext& ctx,
                                                                   const std::string& name) {
  RMP_TRY_ASSIGN(auto language, ctx.app.registry.create<Language>(name));
  return std::shared_ptr<Language>(std::move(language));
}

}  // namespace robomosp::ioci
