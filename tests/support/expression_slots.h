// SPDX-License-Identifier: Apache-2.0
// All numbers in records of every kind that can be expressions, and a document with such records.
// For tests of expressions.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "io/native.h"
#include "kernel/units.h"
#include "model/controller.h"
#include "model/declare.h"
#include "model/field_path.h"
#include "model/parametric.h"
#include "support/field_walk.h"
#include "support/sample_records.h"

namespace robomosp::test {

/// The addresses of the reals of a value, found by an independent traversal; without read-only
/// ones, those of parameters, and those that do not apply.
inline void add_reals(const Type& t, const void* p, std::set<const double*>& out) {
  const auto row = [&out](const std::vector<double>& numbers) {
    for (const double& v : numbers) out.insert(&v);
  };
  switch (t.shape) {
    case Shape::real: out.insert(static_cast<const double*>(p)); return;
    case Shape::numbers:
      for (std::size_t i = 0; i < t.count; ++i) out.insert(static_cast<const double*>(p) + i);
      return;
    case Shape::reals: return row(*static_cast<const std::vector<double>*>(p));
    case Shape::setting: {
      const auto& v = *static_cast<const model::ProviderChoice::Param*>(p);
      if (const auto* real = std::get_if<double>(&v)) out.insert(real);
      if (const auto* list = std::get_if<std::vector<double>>(&v)) row(*list);
      return;
    }
    case Shape::structure:
      for (const Field& f : t.fields)
        if (!f.is_read_only && f.name != "parametric" && (!f.counts || f.counts(p)))
          add_reals(*f.type, f.in(p), out);
      return;
    case Shape::list:
      for (std::size_t i = 0; i < t.length(p); ++i) add_reals(*t.element, t.at(p, i), out);
      return;
    case Shape::optional:
    case Shape::shared:
      if (const void* inner = t.held(p)) add_reals(*t.element, inner, out);
      return;
    case Shape::table:
      t.each(p, [&](const std::string&, const void* v) { add_reals(*t.element, v, out); });
      return;
    default: return;
  }
}
inline std::set<const double*> reals_of(const model::Body& body) {
  std::set<const double*> out;
  const model::Content c = model::content(body);
  add_reals(*c.type, c.data, out);
  return out;
}

/// A number by its path.
struct Slot {
  std::string path, unit;
  double value = 0;
};

/// The numbers of a record by path; every real of the traversal must be among them.
inline std::vector<Slot> slots_of(const model::Body& body) {
  std::set<const double*> all = reals_of(body);
  std::vector<Slot> out;
  model::for_each_number(
      model::content(body), [](const double&) { return true; },
      [&](const std::string& path, const double& v) {
        const auto at = model::number_at(body, path);
        EXPECT_TRUE(at) << path << " names no number";
        if (!at) return;
        EXPECT_EQ(model::number_in(body, path), &v) << path << " names another number";
        EXPECT_EQ(
            std::count_if(out.begin(), out.end(), [&](const Slot& s) { return s.path == path; }), 0)
            << path << " names two numbers";
        all.erase(&v);
        const bool is_free = at->unit == model::kAnyUnit || at->unit == model::kByJoint;
        const auto unit = units::parse(at->unit);
        // In the form written to files; a pure number has the unit "1" or none.
        out.push_back({path, is_free || !unit.ok() ? "" : units::si_name(unit->dimension), v});
      });
  // Without a path: sizes that do not apply to the kind of a node, and second radii and starts of
  // circles.
  const auto* solid = std::get_if<model::Solid>(&body);
  for (const double* v : all) {
    bool is_unused = false;
    if (solid)
      for (const model::SolidNode& n : solid->nodes) {
        is_unused = is_unused || (v >= n.sizes.data() + csg_size_count(n.kind) &&
                                  v < n.sizes.data() + n.sizes.size());
        for (std::size_t k = 0; n.profile && k < n.profile->loops.size(); ++k) {
          const CsgLoop& l = n.profile->loops[k];
          const bool is_circle = !l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle;
          is_unused = is_unused || (is_circle && (v == &l.start[0] || v == &l.start[1] ||
                                                  v == &l.curves[0].points[1][1]));
        }
      }
    EXPECT_TRUE(is_unused) << "a number of " << to_string(model::kind_of_body(body))
                           << " has no path: " << *v;
  }
  return out;
}

/// The same bits.
inline bool same_number(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Samples of every kind with a controller, saved into a folder of the test.
struct OpenRecords : ::testing::Test {
  SampleRecords samples;
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("expressions-" + std::to_string(::getpid()));
  document::Document& d = samples.document;

  void SetUp() override {
    std::filesystem::create_directories(folder);
    const Kind kind =
        model::register_kind_of<model::Controller>("controller", ".ctl", "controllers");
    model::Controller c;
    c.target = "krl";
    c.axes = {{"A1", 1, false, false, 1, 0.5, 1000, -10, 10}};
    c.tools.resize(1);
    c.tools[0].name = "torch";
    c.tools[0].placement = SampleRecords::turned();
    c.max_speed = 0.5;
    auto tx = d.begin("controller");
    const auto id = tx->add({"krc", "", model::OtherContent(kind, c)});
    ASSERT_TRUE(id.ok()) << id.error().sentence();
    samples.ids.push_back(*id);
    std::vector<AnyId> all = samples.ids;
    all.insert(all.end(), samples.programs.begin(), samples.programs.end());
    for (const AnyId each : all) {
      const std::string& name = tx->now().find(each)->name;
      const auto saved =
          io::save(*tx, each, folder / (name + std::string(io::extension(each.kind))), {});
      ASSERT_TRUE(saved.ok()) << saved.error().sentence();
    }
    ASSERT_TRUE(tx->commit().ok());
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  [[nodiscard]] const model::Body& body(AnyId id) const { return d.now()->find(id)->body; }

  /// Makes every plain number of a record an expression over a separate new parameter.
  std::vector<Slot> open(AnyId id) {
    std::vector<Slot> slots;
    const auto& known = model::parametric_of(body(id))->expressions;
    for (Slot& s : slots_of(body(id)))
      if (!known.contains(s.path) && std::isfinite(s.value)) slots.push_back(std::move(s));
    auto tx = d.begin("open");
    const auto edited = tx->edit(id, [&](model::Record& r) -> Result<void> {
      model::Parametric& p = *model::parametric_of(r.body);
      for (std::size_t i = 0; i < slots.size(); ++i) {
        p.parameters.push_back({"p" + std::to_string(i), "", slots[i].unit, slots[i].value, ""});
        p.expressions[slots[i].path] = "p" + std::to_string(i);
      }
      return {};
    });
    EXPECT_TRUE(edited.ok()) << (edited.ok() ? "" : edited.error().sentence());
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return slots;
  }
  /// Sets the value of a parameter; false = the record rejects the resulting numbers.
  bool set(AnyId id, const std::string& parameter, double value) {
    auto tx = d.begin("set");
    const auto edited = tx->edit(id, [&](model::Record& r) -> Result<void> {
      auto& all = model::parametric_of(r.body)->parameters;
      for (std::size_t i = 0; i < all.size(); ++i)
        if (std::as_const(all)[i].name == parameter) all[i].value = value;
      return {};
    });
    return edited.ok() && tx->commit().ok();
  }
};

}  // namespace robomosp::test
