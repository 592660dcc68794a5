// SPDX-License-Identifier: Apache-2.0
#include "program_source/place.h"

#include <utility>
#include <variant>

#include "kernel/text.h"
#include "model/program_kinds.h"

namespace robomosp::program_source {

const model::Program* program_in(const document::Snapshot& snapshot, AnyId id) {
  const model::Record* r = snapshot.find(id);
  if (!r || id.kind != program_kind()) return nullptr;
  return &std::get<model::OtherContent>(r->body).as<model::Program>();
}

std::string describe(const document::Snapshot& snapshot, const ProgramPlace& p) {
  return text::quote(p.placed->name) + " in " + snapshot.describe(AnyId(p.world));
}

std::vector<ProgramPlace> programs_of(const document::Snapshot& snapshot, WorldId world) {
  std::vector<ProgramPlace> out;
  const model::World* w = snapshot.get(world);
  for (std::size_t i = 0; w && i < w->programs.size(); ++i)
    out.push_back({world, i, &w->programs[i]});
  return out;
}

std::vector<ProgramPlace> places_of(const document::Snapshot& snapshot, AnyId program,
                                    const PlaceWish& wish) {
  std::vector<ProgramPlace> out;
  for (const AnyId user : snapshot.referrers(program)) {
    if (user.kind != Kind::world || (wish.world.number != 0 && !(user == AnyId(wish.world))))
      continue;
    for (const ProgramPlace& p : programs_of(snapshot, WorldId{user.number}))
      if (p.placed->program == program && (!wish.name || p.placed->name == *wish.name))
        out.push_back(p);
  }
  return out;
}

Result<ProgramPlace> place_of(const document::Snapshot& snapshot, AnyId id, const PlaceWish& wish) {
  const auto fit = places_of(snapshot, id, wish);
  if (fit.size() == 1) return fit.front();
  std::vector<std::string> known;
  for (const ProgramPlace& p : fit.empty() ? places_of(snapshot, id) : fit)
    known.push_back(describe(snapshot, p));
  const std::string where = snapshot.describe(id);
  if (known.empty())
    return error(ErrorCode::not_found, "no world has this program",
                 "Add it to one with world.add_program.", where);
  if (fit.empty())
    return error(ErrorCode::not_found, "the program has no such placement in a world",
                 "It is there as " + text::enumerate(known) + ".", where);
  return error(ErrorCode::invalid_argument,
               "the program is in worlds " + std::to_string(fit.size()) + " times",
               "Give world or name_there, or both: it is there as " + text::enumerate(known) + ".",
               where);
}

Error named_once(Error e, const std::string& where) {
  if (e.where == where || e.where.starts_with(where + ",")) return e;
  return std::move(e).in(where);
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> out;
  for (const std::string_view line : text::split(text, '\n')) out.emplace_back(line);
  if (out.empty()) out.emplace_back();
  return out;
}

std::string text_of_file(const model::ProgramFile& f) {
  std::string out;
  for (std::size_t i = 0; i < f.lines.size(); ++i) {
    if (i) out += '\n';
    out += f.lines[i];
  }
  return out;
}

}  // namespace robomosp::program_source
