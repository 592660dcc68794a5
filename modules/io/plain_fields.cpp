// SPDX-License-Identifier: Apache-2.0
#include "io/plain_fields.h"

#include <algorithm>
#include <array>
#include <deque>

#include "model/records.h"
#include "model/solid.h"

namespace robomosp::io {
namespace {

using Names = std::initializer_list<std::string_view>;

bool is_among(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

PlainFields all_but(const model::Type& type, const Names& own_forms) {
  PlainFields out;
  for (const model::Field& f : type.fields)
    if (!f.is_read_only && !is_among(own_forms, f.name)) out.push_back(&f);
  return out;
}

}  // namespace

const PlainFields& plain_link_fields() {
  static const PlainFields all =
      all_but(model::type_of<model::Link>(),
              {"name", "parent", "joint", "row", "convention", "origin", "axis", "mimic", "lower",
               "upper", "drive", "given", "parts"});
  return all;
}

const PlainFields& plain_drive_fields() {
  static const PlainFields all =
      all_but(model::type_of<model::Drive>(), {"coulomb_positive", "coulomb_negative"});
  return all;
}

const PlainFields& plain_segment_fields() {
  static const PlainFields all = all_but(model::type_of<model::TrajectorySegment>(),
                                         {"shape", "law", "orientation", "turning", "points",
                                          "joints", "stored", "placement", "transition"});
  return all;
}

const PlainFields& plain_node_fields() {
  static const PlainFields all =
      all_but(model::type_of<model::SolidNode>(),
              {"kind", "name", "parent", "placement", "sizes", "profile", "geometry", "select",
               "primitive", "is_global", "is_centred"});
  return all;
}

bool is_step_form(std::string_view field) { return is_among({"profile", "is_straight"}, field); }

const PlainFields& file_step_fields(model::StepKind kind) {
  static std::deque<model::Field> fields;  // with the words and marks of files
  static const auto all = [] {
    std::array<PlainFields, model::kStepWords.size()> made;
    for (std::size_t i = 0; i < made.size(); ++i) {
      const auto of = static_cast<model::StepKind>(i);
      for (const model::Field* f : model::step_fields(of)) {
        model::Field& own = fields.emplace_back(*f);
        own.file_word = model::step_word(f->name, of);
        own.is_unit_written = own.type->shape == model::Shape::real && !own.si_unit.empty();
        own.is_always_written = of == model::StepKind::repeat && f->name == "count";
        own.is_needed = of == model::StepKind::call && f->name == "task";
        made[i].push_back(&own);
      }
    }
    return made;
  }();
  return all[static_cast<std::size_t>(kind)];
}

const PlainFields& plain_step_fields(model::StepKind kind) {
  static const auto all = [] {
    std::array<PlainFields, model::kStepWords.size()> made;
    for (std::size_t i = 0; i < made.size(); ++i)
      for (const model::Field* f : file_step_fields(static_cast<model::StepKind>(i)))
        if (!is_step_form(f->name)) made[i].push_back(f);
    return made;
  }();
  return all[static_cast<std::size_t>(kind)];
}

}  // namespace robomosp::io
