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
#include "kernel/utf8.h"
#include "model/program.h"

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

/// Text in UTF-8: what is none is of the time before, a byte a letter (ISO 8859-1).
[[nodiscard]] inline std::string as_utf8(std::string_view bytes) {
  if (text::first_bad_byte(bytes) == std::string_view::npos) return std::string(bytes);
  std::string out;
  for (const char c : bytes) {
    const auto u = static_cast<unsigned char>(c);
    if (u == 0) continue;
    if (u < 0x80) {
      out += c;
    } else {
      out += static_cast<char>(0xC0U | (u >> 6U));
      out += static_cast<char>(0x80U | (u & 0x3FU));
    }
  }
  return out;
}
/// Text as lines, of which there is at least one.
[[nodiscard]] inline std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> out;
  for (const std::string_view line : text::split(text, '\n')) out.emplace_back(line);
  if (out.empty()) out.emplace_back();
  return out;
}
[[nodiscard]] inline std::string text_of_file(const model::ProgramFile& f) {
  std::string out;
  for (std::size_t i = 0; i < f.lines.size(); ++i) {
    if (i) out += '\n';
    out += f.lines[i];
  }
  return out;
}
/// A provider of robomosp.language/1; "" is the default one.
[[nodiscard]] inline Result<std::shared_ptr<Language>> language_of(CommandContext& ctx,
                                                                   const std::string& name) {
  RMP_TRY_ASSIGN(auto language, ctx.app.registry.create<Language>(name));
  return std::shared_ptr<Language>(std::move(language));
}

}  // namespace robomosp::ioci
