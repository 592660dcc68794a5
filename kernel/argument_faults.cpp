// SPDX-License-Identifier: Apache-2.0
#include "kernel/argument_faults.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernel/part_faults.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/units.h"

namespace robomosp {
namespace {

const FaultCodes kArgumentCodes{
    {"argument.missing", ErrorCode::invalid_argument, "A required argument is not given."},
    {"argument.unknown", ErrorCode::unknown_name, "The command has no argument of that name."},
    {"argument.wrong_type", ErrorCode::invalid_argument, "A value is of another type."},
    {"argument.wrong_unit", ErrorCode::invalid_argument,
     "A quantity cannot be read, or has a unit of another dimension."},
    {"argument.wrong_count", ErrorCode::invalid_argument,
     "A list, vector or matrix has another number of entries."},
    {"argument.out_of_range", ErrorCode::invalid_argument, "A number is outside of its range."},
    {"argument.not_a_choice", ErrorCode::invalid_argument,
     "A word is none of the choices of an enum."},
    {"argument.unknown_record", ErrorCode::unknown_name,
     "An argument names a record that the document does not have."},
    {"argument.wrong_record", ErrorCode::invalid_argument,
     "An argument names a record of another kind, or one that was removed."},
    {"argument.malformed", ErrorCode::invalid_argument,
     "A pose, matrix, path or other compound value does not have its form."},
    {"argument.refused", ErrorCode::invalid_argument,
     "The command refuses a value that its schema allows."},
};

/// Bytes of an argument's path that a fault repeats.
constexpr std::size_t kLongestArgument = 300;
/// Entries of a list that a remedy copies.
constexpr std::size_t kMostCopied = 1000;

/// A step from a value to a part of it: the name of a field, or else the index of an element.
struct PartStep {
  std::string_view name;
  std::size_t index = 0;
};

/// "q[2].a" as {1, "a"} behind the name; nullopt = malformed.
std::optional<std::vector<PartStep>> steps_of(std::string_view path, std::string_view name) {
  std::vector<PartStep> out;
  for (std::string_view rest = path.substr(name.size()); !rest.empty();) {
    if (rest.front() == '.') {
      rest.remove_prefix(1);
      const std::size_t end = std::min(rest.find_first_of("[."), rest.size());
      out.push_back({rest.substr(0, end)});
      rest.remove_prefix(end);
      continue;
    }
    const std::size_t end = rest.find(']');
    if (rest.front() != '[' || end == std::string_view::npos) return std::nullopt;
    const auto number = text::read_int(rest.substr(1, end - 1));
    if (!number || *number < 1) return std::nullopt;
    out.push_back({{}, static_cast<std::size_t>(*number - 1)});
    rest.remove_prefix(end + 1);
  }
  return out;
}

/// `v` with `part` at those steps; nullopt where it has no such part.
std::optional<Value> with_part(const Value& v, std::span<const PartStep> at, const Value& part) {
  constexpr std::size_t kDeepest = 20;
  if (at.empty()) return part;
  if (at.size() > kDeepest) return std::nullopt;
  if (const NumericArray* a = v.as_array()) {
    std::vector<double> numbers = a->data();
    if (numbers.size() > kMostCopied || !part.is_number()) return std::nullopt;
    const std::size_t i = at.size() == 1 ? at[0].index : at[0].index * a->cols() + at[1].index;
    if (at.size() > 2 || (at.size() == 2) != a->is_matrix() || i >= numbers.size())
      return std::nullopt;
    numbers[i] = part.number();
    if (!a->is_matrix()) return Value(NumericArray(std::move(numbers), a->unit()));
    return Value(NumericArray(std::move(numbers), a->rows(), a->cols(), a->unit()));
  }
  if (const Map* m = v.as_map()) {
    const Value* old = m->find(at[0].name);
    if (!old || m->size() > kMostCopied) return std::nullopt;
    auto changed = with_part(*old, at.subspan(1), part);
    if (!changed) return std::nullopt;
    Map out = *m;
    out.set(std::string(at[0].name), std::move(*changed));
    return Value(std::move(out));
  }
  const List* list = v.as_list();
  if (!list || !at[0].name.empty() || list->size() > kMostCopied || at[0].index >= list->size())
    return std::nullopt;
  auto changed = with_part((*list)[at[0].index], at.subspan(1), part);
  if (!changed) return std::nullopt;
  List items = *list;
  items[at[0].index] = std::move(*changed);
  return Value(std::move(items));
}

/// Whether the value passes, or fails elsewhere in the argument.
bool is_mended(const ParamSpec& spec, const Value& v, const Fault& fault,
               const ResolveRef& resolve) {
  const auto checked = check_value(spec, v, spec.name, resolve);
  if (!checked.ok())
    return argument_fault(checked.error(), spec.name).subject.argument != fault.subject.argument;
  if (!has_unchecked_parts(spec)) return true;
  const std::vector<Fault> parts = part_faults(spec, *checked, spec.name, kMostCopied);
  return std::none_of(parts.begin(), parts.end(),
                      [&](const Fault& f) { return f.subject.argument == fault.subject.argument; });
}

std::string shown_of(std::string_view unit, const Value& v) {
  if (const std::string* s = v.as_string()) return text::quote(*s);
  if (v.as_int()) return v.text();
  if (unit.empty() || unit == "1" || unit.find(',') != std::string::npos)
    return text::print_rounded(v.number());
  return units::print_with_unit(v.number(), unit);
}

void offer(Fault& fault, const ParamSpec& spec, const Map& given, const Value& element,
           const ResolveRef& resolve) {
  const Value* v = given.find(spec.name);
  const std::string& path = fault.subject.argument;
  if (!v || !path.starts_with(spec.name)) return;
  const auto at = steps_of(path, spec.name);
  if (!at) return;
  auto changed = with_part(*v, *at, element);
  if (!changed || !is_mended(spec, *changed, fault, resolve)) return;
  FaultRemedy r;
  r.label = "Set " + path + " to " + shown_of(fault.witness.unit, element);
  r.args.set(spec.name, std::move(*changed));
  r.repeats = true;
  r.is_tried = true;
  fault.remedies.push_back(std::move(r));
}

/// The name nearest to one that the command does not have, of those not given yet.
void offer_name(Fault& fault, const Schema& schema, const Map& given, const ResolveRef& resolve) {
  std::vector<std::string> free;
  for (const ParamSpec& s : schema)
    if (!given.find(s.name)) free.push_back(s.name);
  const std::string& wrong = fault.subject.argument;
  const Value* v = given.find(wrong);
  const auto name = text::nearest(wrong, free);
  if (!v || !name) return;
  const ParamSpec& spec = *find_param(schema, *name);
  if (!check_value(spec, *v, *name, resolve).ok()) return;
  FaultRemedy r;
  r.label = "Rename " + wrong + " to " + *name;
  r.args.set(*name, *v);
  r.without = {wrong};
  r.repeats = true;
  r.is_tried = true;
  fault.remedies.push_back(std::move(r));
}

/// The same number with a unit of the argument's dimension: that nearest to the one given, or the
/// usual one.
void offer_unit(Fault& fault, const ParamSpec& spec, const Map& given, const ResolveRef& resolve) {
  const Value* v = given.find(spec.name);
  const auto at = v ? steps_of(fault.subject.argument, spec.name) : std::nullopt;
  if (!at) return;
  const Value* element = v;
  for (const PartStep& step : *at) {
    const List* list = element->as_list();
    // A field of a table has its own unit.
    if (!list || !step.name.empty() || step.index >= list->size()) return;
    element = &(*list)[step.index];
  }
  const std::string* text = element->as_string();
  if (!text) return;
  const std::string_view all = text::trim(*text);
  const std::string_view number =
      text::trim(all.substr(0, std::min(all.find_first_not_of("0123456789.+-eE"), all.size())));
  if (!text::read_real(number)) return;
  const std::string_view wrong = text::trim(all.substr(number.size()));
  const std::string si = unit_of(spec);
  std::vector<std::string> fitting;
  for (const char* unit : {"mm", "cm", "m", "deg", "rad", "s", "ms", "min", "kg", "g", "N", "N m",
                           "m/s", "mm/s", "rad/s", "deg/s", "m/s^2", "rad/s^2"})
    if (units::read_quantity("1 " + std::string(unit), si).ok()) fitting.emplace_back(unit);
  std::string unit = text::nearest(wrong, fitting).value_or(std::string(shown_unit_of(si)));
  if (unit.empty()) unit = si;
  const std::string mended = std::string(number) + (unit.empty() || unit == "1" ? "" : " " + unit);
  if (mended != all) offer(fault, spec, given, Value(mended), resolve);
}

}  // namespace

std::string subject_path(std::string path) {
  return text::shortened(std::move(path), kLongestArgument);
}

Error argument_error(std::string_view code, std::string_view path, std::string message,
                     std::string hint) {
  Fault f = make_fault(code, std::move(message), std::move(hint), std::string(path));
  f.subject.argument = subject_path(std::string(path));
  return error_of(std::move(f));
}

Error argument_error(Error e, std::string_view path, std::string_view code) {
  e = std::move(e).in(path);
  amend(e, [&](Fault& f) {
    if (f.code.starts_with("error.")) f.code = code;
    f.subject.argument = subject_path(std::string(path));
  });
  return e;
}

Error range_error(std::string_view path, std::string message, double value, double limit,
                  std::string_view unit) {
  Fault f = make_fault("argument.out_of_range", std::move(message), {}, std::string(path));
  f.subject.argument = subject_path(std::string(path));
  set_bound(f.witness, value, limit, unit == "1" ? std::string_view() : unit);
  return error_of(std::move(f));
}

Fault argument_fault(const Error& e, std::string_view name) {
  Fault f = std::move(faults_of(e).front());
  if (f.subject.argument.empty()) {
    const std::string_view first = std::string_view(e.where).substr(0, e.where.find(", "));
    const bool is_within = first.starts_with(name) && first.size() > name.size() &&
                           (first[name.size()] == '[' || first[name.size()] == '.');
    f.subject.argument = is_within ? first : name;
  }
  if (f.code == "error.invalid_argument") f.code = "argument.malformed";
  return f;
}

void add_remedies(Fault& fault, const Schema& schema, const Map& given, const ResolveRef& resolve) {
  const std::string& path = fault.subject.argument;
  if (fault.code == "argument.unknown") return offer_name(fault, schema, given, resolve);
  const ParamSpec* spec = find_param(schema, path.substr(0, path.find_first_of("[.")));
  if (!spec) return;
  const Value* v = given.find(spec->name);
  if (fault.code == "argument.out_of_range" && fault.witness.limit) {
    // A quantity that must be greater than a bound has no nearest value.
    const double limit = *fault.witness.limit;
    if (limit > 0 && limit <= 1e-300) return;
    if (plain_type(spec->type) == "int") {
      const double whole = *fault.witness.value < limit ? std::ceil(limit) : std::floor(limit);
      offer(fault, *spec, given, Value(static_cast<std::int64_t>(whole)), resolve);
    } else {
      offer(fault, *spec, given, Value(limit), resolve);
    }
  }
  if (fault.code == "argument.wrong_unit") offer_unit(fault, *spec, given, resolve);
  if (fault.code == "argument.not_a_choice" && v && v->as_string()) {
    std::vector<std::string> words = spec->choices;
    if (words.empty())
      for (const WordInfo& w : words_of(*spec)) words.push_back(w.word);
    if (const auto word = text::nearest(*v->as_string(), words))
      offer(fault, *spec, given, Value(*word), resolve);
  }
}

std::optional<Value> part_at(const Value& v, std::string_view path, std::string_view name) {
  const auto at = path.starts_with(name) ? steps_of(path, name) : std::nullopt;
  if (!at) return std::nullopt;
  const Value* part = &v;
  for (const PartStep& step : *at) {
    const Map* m = part->as_map();
    const List* list = part->as_list();
    if (!step.name.empty()) part = m ? m->find(step.name) : nullptr;
    else part = list && step.index < list->size() ? &(*list)[step.index] : nullptr;
    if (!part) return std::nullopt;
  }
  return *part;
}

std::optional<Value> with_part(const Value& v, std::string_view path, std::string_view name,
                               const Value& part) {
  const auto at = path.starts_with(name) ? steps_of(path, name) : std::nullopt;
  return at ? with_part(v, *at, part) : std::nullopt;
}

Map repeated(const FaultRemedy& remedy, const Map& given) {
  Map out = given;
  for (const std::string& name : remedy.without) out.erase(name);
  for (const auto& [name, value] : remedy.args) out.set(name, value);
  return out;
}

}  // namespace robomosp
