// SPDX-License-Identifier: Apache-2.0
// Programs of records and their places in worlds (layer: application, program_source). [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "model/program.h"
#include "model/world.h"

namespace robomosp::program_source {

/// A place that a program has in a world.
struct ProgramPlace {
  WorldId world;
  std::size_t at = 0;                            ///< in its list of programs
  const model::PlacedProgram* placed = nullptr;  ///< of the snapshot, or one to be tried
};
/// Selects among the places of a program.
struct PlaceWish {
  WorldId world{};                       ///< number 0 = any
  std::optional<std::string> name = {};  ///< of the program there; empty = any
  [[nodiscard]] bool is_given() const { return world.number != 0 || name.has_value(); }
};

/// The program of a record; nullptr = missing, or of another kind.
[[nodiscard]] const model::Program* program_in(const document::Snapshot&, AnyId);
/// Programs of a world, in the order of its list; empty if the world does not exist.
[[nodiscard]] std::vector<ProgramPlace> programs_of(const document::Snapshot&, WorldId);
/// The selected places of a program in worlds, those of one world in a row.
[[nodiscard]] std::vector<ProgramPlace> places_of(const document::Snapshot&, AnyId program,
                                                  const PlaceWish& = {});
/// The selected place of a program, or the only one. Errors: none, or several.
[[nodiscard]] Result<ProgramPlace> place_of(const document::Snapshot&, AnyId program,
                                            const PlaceWish& = {});
/// `"carry" in world "bench"`, with its quotes.
[[nodiscard]] std::string describe(const document::Snapshot&, const ProgramPlace&);
/// The error with `where` before its place, unless it already begins with that, since runs and
/// bindings name the program themselves.
[[nodiscard]] Error named_once(Error e, const std::string& where);

/// Text as lines, of which there is at least one.
[[nodiscard]] std::vector<std::string> lines_of(std::string_view text);
/// The lines of a file as one text.
[[nodiscard]] std::string text_of_file(const model::ProgramFile&);

}  // namespace robomosp::program_source
