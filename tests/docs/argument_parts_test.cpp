// SPDX-License-Identifier: Apache-2.0
// Parts of arguments: elements of lists, fields of maps and alternatives are checked before a
// command runs. Made from the schemas alone: each part of each argument of every command is given
// wrong in turn, and the call must fail with one fault that has the path of this part.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "docs/examples.h"
#include "ioci/core/application.h"
#include "kernel/fault.h"
#include "kernel/literal.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

Application& parts_app() { return test::examples_app(); }

const TypeTree& resolved(const TypeTree& t) {
  const TypeTree* at = &t;
  while (at->kind == TypeKind::named) at = named_type(at->word);
  return *at;
}

Value valid_value(const TypeTree& given, double min, double max);

Map valid_map(const Schema& fields) {
  Map out;
  for (const ParamSpec& p : fields)
    if (p.required && !p.default_value) {
      const bool has_words = !p.choices.empty() && type_tree(p.type).kind == TypeKind::word;
      out.set(p.name,
              has_words ? Value(p.choices.front()) : valid_value(type_tree(p.type), p.min, p.max));
    }
  return out;
}

double number_within(double min, double max) {
  if (std::isfinite(min) && std::isfinite(max)) return (min + max) / 2;
  if (std::isfinite(min)) return std::floor(min) + 1;
  return std::isfinite(max) ? std::ceil(max) - 1 : 1;
}

/// A value of a type.
Value valid_value(const TypeTree& given, double min, double max) {
  const TypeTree& t = resolved(given);
  min = t.notes.min.value_or(min);
  max = t.notes.max.value_or(max);
  const double x = number_within(min, max);
  switch (t.kind) {
    case TypeKind::boolean: return true;
    case TypeKind::integer: return static_cast<std::int64_t>(x);
    case TypeKind::real:
    case TypeKind::expression: return x;
    case TypeKind::word: return t.choices.empty() ? Value("x") : Value(t.choices.front().word);
    case TypeKind::colour: return "#204060";
    case TypeKind::vector: return List(t.count ? t.count : 1, Value(x));
    case TypeKind::pose: return List(6, Value(0.0));
    case TypeKind::matrix:
      return List(t.rows ? t.rows : 1, Value(List(t.cols ? t.cols : 1, Value(0.0))));
    case TypeKind::joints: return List{0.0};
    case TypeKind::list:
    case TypeKind::table: return List();
    case TypeKind::map: return valid_map(t.fields);
    case TypeKind::variant: {
      Map m = valid_map(t.cases.front().second);
      m.set(t.decided_by, t.cases.front().first);
      return m;
    }
    case TypeKind::one_of: return valid_value(*t.options.front(), min, max);
    case TypeKind::any: return 1;
    default: return "x";
  }
}

/// Whether a value that is no number, text or list may be of a type.
bool takes(const TypeTree& given, const Value& v) {
  const TypeTree& t = resolved(given);
  switch (t.kind) {
    case TypeKind::any: return true;
    case TypeKind::boolean: return v.as_bool() != nullptr;
    case TypeKind::map:
    case TypeKind::variant:
    case TypeKind::pose:
    case TypeKind::provider: return v.as_map() != nullptr;
    case TypeKind::reference:
    case TypeKind::member:
    case TypeKind::handle: return v.as_handle() != nullptr;
    case TypeKind::one_of:
      return std::any_of(t.options.begin(), t.options.end(),
                         [&v](const auto& option) { return takes(*option, v); });
    default: return false;
  }
}

bool has_list_form(const TypeTree& given) {
  const TypeTree& t = resolved(given);
  return t.kind == TypeKind::list || t.kind == TypeKind::table || t.kind == TypeKind::vector ||
         t.kind == TypeKind::matrix || t.kind == TypeKind::joints || t.kind == TypeKind::pose ||
         t.kind == TypeKind::colour || t.kind == TypeKind::any;
}
bool has_map_form(const TypeTree& given) {
  const TypeTree& t = resolved(given);
  return t.kind == TypeKind::map || t.kind == TypeKind::variant || t.kind == TypeKind::pose ||
         t.kind == TypeKind::provider || t.kind == TypeKind::any;
}

/// A part of an argument, given wrong.
struct Wrong {
  std::string path;  ///< of the part
  std::string code;  ///< of the fault
  Value argument;    ///< the whole
};

/// All parts of an argument, given wrong in each way that its type excludes.
class Wrongs {
 public:
  using Wrap = std::function<Value(Value)>;

  void argument(const ParamSpec& p) {
    part(
        type_tree(p.type), p, p.name, [](Value v) { return v; }, true);
  }
  std::vector<Wrong> all;

 private:
  void add(const std::string& path, const char* code, Value v) {
    all.push_back({path, code, std::move(v)});
  }

  void fields(const Schema& schema, const Map& base, const TypeTree* rest, const std::string& path,
              const Wrap& wrap) {
    if (!rest) {
      Map more = base;
      more.set("no_such_field", 1);
      add(path + ".no_such_field", "argument.unknown", wrap(std::move(more)));
    }
    for (const ParamSpec& p : schema) {
      part(
          type_tree(p.type), p, path + "." + p.name,
          [&](Value v) {
            Map m = base;
            m.set(p.name, std::move(v));
            return wrap(std::move(m));
          },
          false);
      if (!p.required || p.default_value) continue;
      Map less = base;
      less.erase(p.name);
      add(path + "." + p.name, "argument.missing", wrap(std::move(less)));
    }
  }

  void range(const TypeTree& t, const ParamSpec& spec, const std::string& path, const Wrap& wrap) {
    const double min = t.notes.min.value_or(spec.min), max = t.notes.max.value_or(spec.max);
    const bool is_list = t.kind == TypeKind::vector;
    for (const double x : {std::isfinite(min) ? std::floor(min) - 1 : min,
                           std::isfinite(max) ? std::ceil(max) + 1 : max}) {
      if (!std::isfinite(x)) continue;
      const Value one =
          t.kind == TypeKind::integer ? Value(static_cast<std::int64_t>(x)) : Value(x);
      List numbers(is_list && t.count ? t.count : 1, Value(number_within(min, max)));
      numbers.back() = one;
      add(is_list ? path + "[" + std::to_string(numbers.size()) + "]" : path,
          "argument.out_of_range", wrap(is_list ? Value(std::move(numbers)) : one));
    }
  }

  void part(const TypeTree& given, const ParamSpec& spec, const std::string& path, const Wrap& wrap,
            bool is_argument) {
    if (given.kind == TypeKind::named && !within_.insert(given.word).second) return;
    const TypeTree& t = resolved(given);
    for (const Value& wrong :
         {Value(true), Value(Map{{"no_such_field", 1}}), Value(Handle{"?", 1})})
      if (!takes(t, wrong) && !(is_argument && t.kind != TypeKind::one_of)) {
        add(path, "", wrap(wrong));
        break;
      }
    switch (t.kind) {
      case TypeKind::integer:
      case TypeKind::real:
      case TypeKind::vector:
        if (!is_argument) range(t, spec, path, wrap);
        break;
      case TypeKind::word:
        if (!is_argument && (!t.choices.empty() || !spec.choices.empty()))
          add(path, "argument.not_a_choice", wrap("no_such_word"));
        break;
      case TypeKind::list: {
        if (!t.element) break;
        const ParamSpec one = of_part(*t.element, spec);
        part(
            *t.element, one, path + "[2]",
            [&](Value v) {
              return wrap(List{valid_value(*t.element, one.min, one.max), std::move(v)});
            },
            false);
        break;
      }
      case TypeKind::table:
        fields(t.fields, valid_map(t.fields), nullptr, path + "[1]",
               [&](Value v) { return wrap(List{std::move(v)}); });
        break;
      case TypeKind::map:
        if (!t.fields.empty()) fields(t.fields, valid_map(t.fields), t.element.get(), path, wrap);
        else if (t.element)
          part(
              *t.element, of_part(*t.element, spec), path + ".one",
              [&](Value v) {
                return wrap(Map{{"one", std::move(v)}});
              },
              false);
        break;
      case TypeKind::variant:
        add(path + "." + t.decided_by, "argument.missing", wrap(Map()));
        add(path + "." + t.decided_by, "argument.not_a_choice",
            wrap(Map{{t.decided_by, "no_such_word"}}));
        for (const auto& [word, schema] : t.cases) {
          Map base = valid_map(schema);
          base.set(t.decided_by, word);
          fields(schema, base, nullptr, path, wrap);
        }
        break;
      case TypeKind::one_of:
        // An alternative that is the only one of its form says what is wrong in it.
        for (const auto& option : t.options) {
          const auto count = [&](bool (*form)(const TypeTree&)) {
            return std::count_if(t.options.begin(), t.options.end(),
                                 [form](const auto& other) { return form(*other); });
          };
          const TypeTree& r = resolved(*option);
          const bool is_list = r.kind == TypeKind::list || r.kind == TypeKind::table;
          const bool is_map = r.kind == TypeKind::map || r.kind == TypeKind::variant;
          if ((is_list && count(has_list_form) == 1) || (is_map && count(has_map_form) == 1))
            part(*option, of_part(*option, spec), path, wrap, true);
        }
        break;
      default: break;
    }
    if (given.kind == TypeKind::named) within_.erase(given.word);
  }

  static ParamSpec of_part(const TypeTree& t, const ParamSpec& outer) {
    ParamSpec p;
    p.min = t.notes.min.value_or(outer.min);
    p.max = t.notes.max.value_or(outer.max);
    return p;
  }

  std::set<std::string> within_;
};

TEST(ArgumentParts, AWrongOneIsOneFaultWithItsPathForEveryCommand) {
  parts_app().document.clear();
  Session session("parts");
  std::size_t commands = 0, arguments = 0, parts = 0;
  for (const CommandSpec* spec : parts_app().commands.list()) {
    bool has_parts = false;
    for (const ParamSpec& p : spec->params) {
      Wrongs wrongs;
      wrongs.argument(p);
      arguments += !wrongs.all.empty();
      has_parts = has_parts || !wrongs.all.empty();
      for (const Wrong& w : wrongs.all) {
        ++parts;
        const Map given{{p.name, w.argument}};
        const std::string call = spec->name + literal(Value(given));
        // The command must not run with it.
        const auto checked = check(spec->params, given);
        ASSERT_FALSE(checked.ok()) << call << " passes; " << w.path << " is wrong";
        const auto done = parts_app().dispatch(session, spec->name, given);
        ASSERT_FALSE(done.ok()) << call;
        std::string found;
        std::size_t count = 0;
        for (const Fault& f : faults_of(done.error())) {
          const std::string& at = f.subject.argument;
          if (at.substr(0, at.find_first_of("[.")) != p.name) continue;
          ++count;
          found += at + " " + f.code + ": " + f.message + "\n";
          EXPECT_TRUE(at == w.path || at.starts_with(w.path + "[") || w.code.empty())
              << call << "\n"
              << w.path << "\n"
              << found;
          EXPECT_TRUE(w.code.empty() || f.code == w.code) << call << "\n"
                                                          << w.code << "\n"
                                                          << found;
        }
        EXPECT_EQ(count, 1U) << call << "\n" << w.path << "\n" << found << done.error().sentence();
        EXPECT_TRUE(found.starts_with(w.path)) << call << "\n" << w.path << "\n" << found;
      }
    }
    commands += has_parts;
  }
  EXPECT_GT(commands, 100U);
  EXPECT_GT(parts, 1500U);
  std::cout << "Note: " << parts << " parts of " << arguments << " arguments of " << commands
            << " commands given wrong.\n";
}

TEST(ArgumentParts, AllWrongOnesAreSaidAtOnce) {
  Session session("parts");
  const Map given{{"name", "arm"},
                  {"links", List{Map{{"a", 0.3}}, Map{{"a", true}, {"joint", "revolving"}},
                                 Map{{"alhpa", 1}, {"d", "3 kg"}, {"coulomb_positive", -1}}}}};
  const auto done = parts_app().dispatch(session, "robot.create", given);
  ASSERT_FALSE(done.ok());
  std::set<std::string> found;
  for (const Fault& f : faults_of(done.error())) found.insert(f.subject.argument + " " + f.code);
  EXPECT_EQ(found, (std::set<std::string>{
                       "links[2].a argument.wrong_type", "links[2].joint argument.not_a_choice",
                       "links[3].alhpa argument.unknown", "links[3].d argument.wrong_unit",
                       "links[3].coulomb_positive argument.out_of_range"}))
      << done.error().sentence();
  // The nearest value in range is a remedy that was tried.
  for (const Fault& f : faults_of(done.error()))
    if (f.code == "argument.out_of_range") {
      ASSERT_EQ(f.remedies.size(), 1U);
      const List& links = *f.remedies.front().args.find("links")->as_list();
      EXPECT_EQ(links[2].as_map()->find("coulomb_positive")->number(), 0);
    }
}

// What a part means may follow from other arguments, such as the unit of a joint or of a signal.
TEST(ArgumentParts, TextsWithUnitsPassWhereTheTypeHasNone) {
  Session session("parts");
  for (const auto& [command, given] : std::initializer_list<std::pair<const char*, Map>>{
           {"robot.close", Map{{"id", "arm"}, {"joints", Map{{"crank", "90 deg"}}}}},
           {"robot.set_joint", Map{{"id", "arm"}, {"joint", 1}, {"value", "30 deg"}}},
           {"world.set_signal", Map{{"id", "cell"}, {"signal", "go"}, {"value", "30 mm"}}},
           {"robot.solve_ik", Map{{"id", "arm"}, {"branch", List{"no_flip", "down"}}}}}) {
    const CommandSpec* spec = parts_app().commands.find(command);
    ASSERT_NE(spec, nullptr) << command;
    const auto checked = check(spec->params, given);
    if (checked.ok()) continue;
    for (const Fault& f : faults_of(checked.error()))
      EXPECT_EQ(f.code, "argument.missing") << command << ": " << sentence(f);
  }
}

}  // namespace
}  // namespace robomosp::ioci
