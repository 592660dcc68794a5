// SPDX-License-Identifier: Apache-2.0
// Visits every value in a record by the declarations of its fields alone, with possible changes of
// each. For tests of functions derived from the declarations.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "model/data.h"
#include "model/records.h"

namespace robomosp::test {

using model::Field;
using model::Shape;
using model::Type;

/// A value in a record: its path is also valid in copies of the record.
struct Leaf {
  struct Step {
    const Field* field = nullptr;  ///< of a structure; else
    std::size_t index = 0;         ///< of a list, or none for what is held
    std::string key;               ///< of a table
  };
  std::vector<Step> way;
  const Type* type = nullptr;
  const Field* field = nullptr;
  std::string path;  ///< for messages

  /// The value in another copy of the record.
  [[nodiscard]] void* in(model::Body& body) const {
    const model::MutableContent c = model::content(body);
    const Type* t = c.type;
    void* p = c.data;
    for (const Step& s : way) {
      switch (t->shape) {
        case Shape::structure:
          p = s.field->in(p);
          t = s.field->type;
          continue;
        case Shape::list: p = t->at(p, s.index); break;
        case Shape::table: p = t->entry(p, s.key); break;
        default: p = t->hold(p); break;
      }
      t = t->element;
    }
    return p;
  }
};

/// All values and all lists, tables and held values themselves.
inline void walk(const Type& t, const void* p, Leaf at, std::vector<Leaf>& out) {
  at.type = &t;
  const auto into = [&](Leaf::Step step, const Type& inner, const void* data, const Field* field,
                        const std::string& word) {
    Leaf next = at;
    next.way.push_back(std::move(step));
    next.field = field;
    next.path += word;
    walk(inner, data, std::move(next), out);
  };
  switch (t.shape) {
    case Shape::structure:
      for (const Field& f : t.fields)
        into({&f, 0, {}}, *f.type, f.in(p), &f, "." + std::string(f.name));
      return;
    case Shape::list:
      out.push_back(at);
      for (std::size_t i = 0; i < t.length(p); ++i)
        into({nullptr, i, {}}, *t.element, t.at(p, i), at.field, "[" + std::to_string(i + 1) + "]");
      return;
    case Shape::optional:
    case Shape::shared:
      out.push_back(at);
      if (const void* inner = t.held(p)) into({nullptr, 0, {}}, *t.element, inner, at.field, "");
      return;
    case Shape::table:
      out.push_back(at);
      t.each(p, [&](const std::string& key, const void* v) {
        into({nullptr, 0, key}, *t.element, v, at.field, "{" + key + "}");
      });
      return;
    default: out.push_back(at); return;
  }
}
inline std::vector<Leaf> leaves(const model::Body& body) {
  std::vector<Leaf> out;
  const model::Content c = model::content(body);
  walk(*c.type, c.data, {}, out);
  return out;
}

/// A change of a value. `texts` and `ids` are the choices.
using Change = std::function<void(const Type&, void*)>;
inline std::vector<Change> changes(const Type& t, const std::vector<std::string>& texts,
                                   const std::vector<AnyId>& ids) {
  std::vector<Change> out;
  const auto real = [&out](std::size_t component) {
    for (const double v : {0.5, 0.25, 2.0, 0.125, -0.25, 1.0, 3.0, 0.0})
      out.emplace_back([=](const Type&, void* p) { static_cast<double*>(p)[component] = v; });
    for (const double factor : {1.01, 0.99})
      out.emplace_back([=](const Type&, void* p) { static_cast<double*>(p)[component] *= factor; });
  };
  switch (t.shape) {
    case Shape::boolean:
      out.emplace_back([](const Type&, void* p) { *static_cast<bool*>(p) ^= true; });
      break;
    case Shape::integer:
      for (const std::int64_t v : {1, 2, 0, -1, 3, 7})
        out.emplace_back([v](const Type& type, void* p) { type.set_whole(p, v); });
      break;
    case Shape::word:
      for (const Type::Word& w : t.words)
        out.emplace_back([v = w.value](const Type& type, void* p) { type.set_whole(p, v); });
      break;
    case Shape::real: real(0); break;
    case Shape::numbers:
      for (std::size_t i = 0; i < t.count; ++i) real(i);
      break;
    case Shape::reals:
      out.emplace_back([](const Type&, void* p) {
        auto& v = *static_cast<std::vector<double>*>(p);
        if (v.empty()) v = {0.5, 0.25};
        else v.back() += 0.125;
      });
      out.emplace_back(
          [](const Type&, void* p) { static_cast<std::vector<double>*>(p)->push_back(0.5); });
      break;
    case Shape::text:
      for (const std::string& s : texts)
        out.emplace_back([s](const Type&, void* p) { *static_cast<std::string*>(p) = s; });
      break;
    case Shape::colour:
      for (std::size_t i = 0; i < 4; ++i)
        out.emplace_back([i](const Type&, void* p) { static_cast<float*>(p)[i] = 0.5F; });
      break;
    case Shape::digest:
      out.emplace_back([](const Type&, void* p) { ++static_cast<std::uint64_t*>(p)[1]; });
      break;
    case Shape::reference:
      for (const AnyId id : ids)
        out.emplace_back([id](const Type& type, void* p) {
          if (type.kinds.empty() || type.kinds.front() == id.kind) type.set_id(p, id);
        });
      out.emplace_back([](const Type& type, void* p) { type.set_id(p, {}); });
      break;
    case Shape::setting:
      for (const model::ProviderChoice::Param& v :
           {model::ProviderChoice::Param(0.75), model::ProviderChoice::Param(std::int64_t{3}),
            model::ProviderChoice::Param(std::string("word")), model::ProviderChoice::Param(true)})
        out.emplace_back(
            [v](const Type&, void* p) { *static_cast<model::ProviderChoice::Param*>(p) = v; });
      break;
    case Shape::list:
      out.emplace_back([](const Type& type, void* p) {
        if (const std::size_t n = type.length(p)) type.take_out(p, n - 1);
      });
      out.emplace_back([](const Type& type, void* p) {  // the last one once more
        const std::size_t n = type.length(p);
        type.resize(p, n + 1);
        if (n > 0) type.element->assign(type.at(p, n), type.at(p, n - 1));
      });
      break;
    case Shape::table:
      out.emplace_back([](const Type& type, void* p) {
        std::string first;
        type.each(p, [&](const std::string& key, const void*) { first = key; });
        if (!first.empty()) type.erase(p, first);
      });
      break;
    case Shape::optional:
    case Shape::shared:
      out.emplace_back([](const Type& type, void* p) {
        if (type.held(p)) type.drop(p);
        else type.hold(p);
      });
      break;
    case Shape::structure: break;
  }
  return out;
}

/// All fields that can be reached from a type, each with the name of its place.
inline void declared(const Type& t, const std::string& path,
                     std::vector<std::pair<const Field*, std::string>>& out) {
  if (t.element) return declared(*t.element, path, out);
  for (const Field& f : t.fields) {
    const std::string name = path + "." + std::string(f.name);
    bool is_known = false;
    for (const auto& [known, where] : out) is_known = is_known || known == &f;
    if (is_known) continue;
    out.emplace_back(&f, name);
    declared(*f.type, name, out);
  }
}

}  // namespace robomosp::test
