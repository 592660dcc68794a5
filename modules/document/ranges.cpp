// SPDX-License-Identifier: Apache-2.0
#include "document/ranges.h"

#include <cmath>
#include <unordered_set>
#include <vector>

#include "kernel/fault.h"
#include "kernel/text.h"
#include "model/field_path.h"

namespace robomosp::document {

namespace {

using model::Field;
using model::Shape;
using model::Type;
using text::quote;

Error range_fault(std::string message, std::string hint = {}) {
  return error_of(make_fault("record.invalid", std::move(message), std::move(hint)));
}

/// Of a number, with its bound.
Error range_fault(std::string message, double value, double limit, std::string_view unit) {
  Fault f = make_fault("record.out_of_range", std::move(message));
  set_bound(f.witness, value, limit, unit);
  return error_of(std::move(f));
}

/// Puts a step in front of the path within the record: a field, "[3]", or a component.
Error at_step(Error e, std::string_view step) {
  if (step.empty() || e.code == ErrorCode::cancelled) return e;
  amend(e, [&](Fault& f) {
    std::string& path = f.subject.path;
    const bool is_joined = path.empty() || path.front() == '[';
    path = std::string(step) + (is_joined ? "" : ".") + path;
  });
  return e;
}

std::string noun(std::string_view word) {
  std::string s(word);
  for (char& c : s)
    if (c == '_') c = ' ';
  return s;
}

class Checker {
 public:
  Checker(const model::Content& record, Subject& subject, const Watch& watch)
      : record_(record), subject_(subject), watch_(watch) {}

  /// `before`: an earlier version, whose blocks are passed over; null = none.
  Result<void> run(const void* before) {
    return fields(*record_.type, record_.data, {}, 0, before);
  }

 private:
  /// `of`: ` of link "elbow"`, or empty.
  Result<void> fields(const Type& t, const void* p, const std::string& of, std::size_t alternative,
                      const void* before = nullptr) {
    if (t.alternative) alternative = t.alternative(p);
    for (const Field& f : t.fields) {
      if (&t == record_.type) subject_ = {};
      auto checked =
          value(f, *f.type, f.in(p), p, of, alternative, before ? f.in(before) : nullptr);
      if (!checked.ok()) return at_step(std::move(checked).error(), f.name);
    }
    return {};
  }

  Result<void> value(const Field& f, const Type& t, const void* p, const void* owner,
                     const std::string& of, std::size_t alternative, const void* before = nullptr) {
    const auto number = [&](double v, std::size_t i) -> Result<void> {
      if (in_range(f, v)) return {};
      return refuse(f, v, of, f.unit_of(owner, i, alternative));
    };
    switch (t.shape) {
      case Shape::real: return number(*static_cast<const double*>(p), 0);
      case Shape::numbers:
        for (std::size_t i = 0; i < t.count; ++i) {
          auto checked = number(static_cast<const double*>(p)[i], i);
          if (!checked.ok())
            return at_step(std::move(checked).error(), model::component_name(f, owner, i));
        }
        return {};
      case Shape::reals: {
        const auto& v = *static_cast<const std::vector<double>*>(p);
        for (std::size_t i = 0; i < v.size(); ++i) RMP_TRY(number(v[i], 0));
        return {};
      }
      case Shape::integer: {
        const std::int64_t v = t.whole(p);
        if (!f.index_in.empty()) return index(f, v, of);
        return number(static_cast<double>(v), 0);
      }
      case Shape::word:
        if (!t.word_of(p).empty()) return {};
        return range_fault("the " + f.shown_name() + of + " is not one of the known values");
      case Shape::colour:
        for (std::size_t i = 0; i < 4; ++i) {
          const auto v = static_cast<double>(static_cast<const float*>(p)[i]);
          if (!(v >= 0 && v <= 1))
            return range_fault("a component of the " + f.shown_name() + of + " is " +
                               text::print_rounded(v, 6) + "; it must be from 0 to 1");
        }
        return {};
      case Shape::structure: return fields(t, p, of, alternative, before);
      case Shape::optional:
        if (const void* inner = t.held(p))
          return value(f, *t.element, inner, owner, of, alternative);
        return {};
      case Shape::list: return list(f, t, p, owner, of, alternative, before);
      default: return {};  // settings and shared content have rules of their own
    }
  }

  Result<void> list(const Field& f, const Type& t, const void* p, const void* owner,
                    const std::string& of, std::size_t alternative, const void* before) {
    const std::string_view word = f.word_in_files();
    for (std::size_t i = 0; i < t.length(p); ++i) {
      if (const std::size_t shared = t.shared_from(p, before, i)) {
        i += shared - 1;
        continue;
      }
      RMP_TRY(watch_.at(i));
      const void* element = t.at(p, i);
      if (owner == record_.data) subject_ = {word, i};
      const std::string* name = model::name_of(*t.element, element);
      // Only a fault needs the words.
      auto checked = value(f, *t.element, element, owner, {}, alternative);
      if (checked.ok()) continue;
      const std::string which =
          " of " + noun(word) + " " + (name ? quote(*name) : std::to_string(i + 1)) + of;
      auto worded = value(f, *t.element, element, owner, which, alternative);
      if (worded.ok()) return {};
      return at_step(std::move(worded).error(), "[" + std::to_string(i + 1) + "]");
    }
    return {};
  }

  Result<void> index(const Field& f, std::int64_t v, const std::string& of) const {
    const Field* in = record_.type->field(f.index_in);
    const auto n = in ? static_cast<std::int64_t>(in->type->length(in->in(record_.data))) : 0;
    if (v >= -1 && v < n) return {};
    return range_fault("the " + f.shown_name() + of + " is not one of its " + noun(f.index_in));
  }

  static bool in_range(const Field& f, double v) {
    if (std::isnan(v) || (!f.may_be_infinite && std::isinf(v))) return false;
    return (f.is_above_min ? v > f.min : v >= f.min) && v <= f.max;
  }

  static Error refuse(const Field& f, double v, const std::string& of, std::string_view unit) {
    const auto shown = [&unit](double x) {
      return text::print_rounded(x, 6) + (unit.empty() ? "" : " " + std::string(unit));
    };
    const auto beyond = [&](std::string message) {
      return range_fault(std::move(message), v, v < f.min ? f.min : f.max, unit);
    };
    const std::string what = "the " + f.shown_name() + of + " is ";
    if (std::isnan(v) || (!f.may_be_infinite && std::isinf(v)))
      return beyond(what + text::print(v) +
                    (f.may_be_infinite ? "; it must be a number" : "; it must be a finite number"));
    const std::string start = what + shown(v) + "; ";
    const bool has_min = std::isfinite(f.min), has_max = std::isfinite(f.max);
    if (has_min && has_max && f.min == -f.max)
      return beyond(start + "at most " + shown(f.max) + " is allowed");
    if (has_min && has_max && f.is_above_min)
      return beyond(start + "it must be above " + text::print_rounded(f.min, 6) + " and at most " +
                    shown(f.max));
    if (has_min && has_max && f.max <= 1e6)
      return beyond(start + "it must be from " + text::print_rounded(f.min, 6) + " to " +
                    text::print_rounded(f.max, 6));
    if (v > f.max) return beyond(start + "at most " + shown(f.max) + " is allowed");
    if (f.is_above_min)
      return beyond(start + "it must be greater than " +
                    shown(f.min).substr(0, shown(f.min).find(' ')));
    if (f.min == 0) return beyond(start + "it must not be negative");
    return beyond(start + "it must be at least " + shown(f.min));
  }

  model::Content record_;
  Subject& subject_;
  const Watch& watch_;
};

}  // namespace

Result<void> check_ranges(const model::Content& record, Subject& subject, const Watch& watch,
                          const model::Content& before) {
  RMP_TRY(Checker(record, subject, watch).run(before.type == record.type ? before.data : nullptr));
  subject = {};
  return {};
}

Result<void> check_names(const model::Content& record, Subject& subject) {
  for (const Field& f : record.type->fields) {
    if (f.type->shape != Shape::list) continue;
    const std::string_view word = f.word_in_files();
    const void* list = f.in(record.data);
    std::unordered_set<std::string_view> seen;
    for (std::size_t i = 0; i < f.type->length(list); ++i) {
      const std::string* name = model::name_of(*f.type->element, f.type->at(list, i));
      if (!name) break;
      subject = {word, i};
      if (!is_name(*name)) return bad_name(*name, noun(word));
      if (!seen.insert(*name).second)
        return at_step(
            error_of(make_fault("record.duplicate_name",
                                "there are two " + noun(f.name) + " named " + quote(*name),
                                "Give each its own name.")),
            std::string(f.name) + "[" + std::to_string(i + 1) + "]");
    }
  }
  subject = {};
  return {};
}

}  // namespace robomosp::document
