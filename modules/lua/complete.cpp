// SPDX-License-Identifier: Apache-2.0
// Completion for every console: what may stand at the cursor, found without running any script.
#include <algorithm>
#include <set>

#include "ioci/core/lua_line.h"
#include "ioci/records/solid_nodes.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/program_state.h"

namespace robomosp::lua {
namespace {

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// An open bracket and where it stands.
struct Open {
  char bracket;
  std::size_t at;
};

/// What surrounds the cursor.
struct Scan {
  std::vector<Open> open;
  bool in_string = false;
  std::size_t string_start = 0;  ///< of the quote
  bool in_comment = false;
};

/// Length of a long bracket `[[`, `[==[` at `at`, 0 if there is none; `level` is its number of `=`.
std::size_t long_bracket(std::string_view s, std::size_t at, std::size_t& level) {
  if (at >= s.size() || s[at] != '[') return 0;
  std::size_t i = at + 1;
  while (i < s.size() && s[i] == '=') ++i;
  if (i >= s.size() || s[i] != '[') return 0;
  level = i - at - 1;
  return i + 1 - at;
}

Scan scan(std::string_view s) {
  Scan out;
  for (std::size_t i = 0; i < s.size();) {
    const char c = s[i];
    const bool is_comment = c == '-' && i + 1 < s.size() && s[i + 1] == '-';
    const std::size_t body = is_comment ? i + 2 : i;
    std::size_t level = 0;
    if (const std::size_t length = (is_comment || c == '[') ? long_bracket(s, body, level) : 0) {
      const std::string end = "]" + std::string(level, '=') + "]";
      const std::size_t close = s.find(end, body + length);
      if (close == std::string_view::npos) {
        out.in_comment = true;  // nothing to offer inside a long string either
        return out;
      }
      i = close + end.size();
    } else if (is_comment) {
      const std::size_t line = s.find('\n', i);
      if (line == std::string_view::npos) {
        out.in_comment = true;
        return out;
      }
      i = line + 1;
    } else if (c == '"' || c == '\'') {
      std::size_t j = i + 1;
      while (j < s.size() && s[j] != c && s[j] != '\n') j += s[j] == '\\' ? 2 : 1;
      if (j >= s.size()) {
        out.in_string = true;
        out.string_start = i;
        return out;
      }
      i = j + 1;
    } else {
      if (c == '(' || c == '{' || c == '[') out.open.push_back({c, i});
      if ((c == ')' || c == '}' || c == ']') && !out.open.empty()) out.open.pop_back();
      ++i;
    }
  }
  return out;
}

/// `robot.solve_ik` or `pa10:fk` that ends just before `at` (blanks skipped); empty if none.
std::string_view chain_before(std::string_view s, std::size_t at) {
  while (at > 0 && (s[at - 1] == ' ' || s[at - 1] == '\t')) --at;
  std::size_t from = at;
  while (from > 0 && (is_word(s[from - 1]) || s[from - 1] == '.' || s[from - 1] == ':')) --from;
  return s.substr(from, at - from);
}

/// `key` of `key = ` before `at`.
std::string_view key_before(std::string_view s, std::size_t at) {
  while (at > 0 && (s[at - 1] == ' ' || s[at - 1] == '\t')) --at;
  if (at == 0 || s[at - 1] != '=') return {};
  if (at >= 2 && (s[at - 2] == '=' || s[at - 2] == '~' || s[at - 2] == '<' || s[at - 2] == '>'))
    return {};
  const std::string_view word = chain_before(s, at - 1);
  return word.find_first_of(".:") == std::string_view::npos ? word : std::string_view();
}

/// Pushes the value of a chain by raw access; false (nothing pushed) when it leads nowhere.
bool push_chain(lua_State* L, std::string_view chain) {
  lua_pushglobaltable(L);
  std::size_t from = 0;
  while (from <= chain.size()) {
    const std::size_t end = std::min(chain.find_first_of(".:", from), chain.size());
    const std::string_view word = chain.substr(from, end - from);
    bool found = false;
    if (!word.empty() && lua_istable(L, -1)) {
      lua_pushlstring(L, word.data(), word.size());
      found = lua_rawget(L, -2) != LUA_TNIL;
      lua_remove(L, -2);
    }
    if (!found) {
      lua_pop(L, 1);
      return false;
    }
    from = end + 1;
  }
  return true;
}

/// The command that `chain` calls, as a method when it has a colon.
const ioci::CommandSpec* command_called(Impl& impl, lua_State* L, std::string_view chain,
                                        bool& is_method) {
  is_method = false;
  if (chain.empty()) return nullptr;
  if (const auto colon = chain.rfind(':'); colon != std::string_view::npos) {
    if (!push_chain(L, chain.substr(0, colon))) return nullptr;
    const KindInfo* info = handle_kind(L, -1);
    lua_pop(L, 1);
    if (!info) return nullptr;
    is_method = true;
    return impl.host.find(info->kind + "." + std::string(chain.substr(colon + 1)));
  }
  if (const auto* spec = impl.host.find(chain)) return spec;
  return impl.host.find(std::string(chain) + ".get");
}

/// The call around an open bracket: `f{`, `f(`, `f({`.
const ioci::CommandSpec* command_around(Impl& impl, lua_State* L, std::string_view s,
                                        const std::vector<Open>& open, bool& is_method) {
  if (open.empty()) return nullptr;
  std::size_t at = open.back().at;
  if (chain_before(s, at).empty() && open.size() > 1 && open[open.size() - 2].bracket == '(' &&
      open.back().bracket == '{')
    at = open[open.size() - 2].at;
  return command_called(impl, L, chain_before(s, at), is_method);
}

/// Names that a command of the program behind the state lists.
void add_listed(Impl& impl, std::string_view command, const Map& args, std::set<std::string>& out) {
  const ioci::CommandSpec* spec = impl.host.find(command);
  if (!spec) return;
  const auto listed = impl.host.dispatch(*spec, args);
  if (!listed.ok() || !listed->as_list()) return;
  for (const Value& item : *listed->as_list()) {
    const Value* name = item.as_map() ? item.as_map()->find("name") : &item;
    if (name && name->as_string()) out.insert(*name->as_string());
    else if (const auto known =
                 item.as_handle() ? impl.host.name_of(*item.as_handle()) : std::nullopt)
      out.insert(*known);
  }
}

void add_records(Impl& impl, std::string_view kinds, std::set<std::string>& out) {
  if (impl.is_untrusted) {  // its document is elsewhere
    for (const std::string_view kind : text::split(kinds, '|'))
      add_listed(impl, std::string(kind) + ".list", {}, out);
    return;
  }
  const auto now = program_of(impl).app.document.now();
  for (const Kind kind : all_kinds()) {
    if (kinds != "any" &&
        (std::string("|") + std::string(kinds) + "|")
                .find("|" + std::string(to_string(kind)) + "|") == std::string::npos)
      continue;
    for (const AnyId id : now->list(kind))
      if (const auto* record = now->find(id)) out.insert(record->name);
  }
}

/// Names of the shipped files of a kind: what <kind>.get would load.
void add_library(Impl& impl, const std::string& kind, std::set<std::string>& out) {
  add_listed(impl, "library.list", Map{{"kind", kind}}, out);
}

void add_files(const Impl& impl, std::string_view partial, std::set<std::string>& out) {
  // The files of a session in a folder are listed by file.list; those of another program are not
  // here.
  if (impl.is_untrusted || program_of(impl).session.files()) return;
  const auto slash = partial.rfind('/');
  const std::string folder(slash == std::string_view::npos ? std::string_view()
                                                           : partial.substr(0, slash + 1));
  std::error_code ec;
  for (auto it = std::filesystem::directory_iterator(folder.empty() ? "." : folder, ec);
       !ec && it != std::filesystem::directory_iterator(); it.increment(ec)) {
    const std::string name = it->path().filename().string();
    const bool hidden =
        name.starts_with(".") &&
        !(slash == std::string_view::npos ? partial : partial.substr(slash + 1)).starts_with(".");
    if (hidden) continue;
    std::error_code ignored;
    out.insert(folder + name + (it->is_directory(ignored) ? "/" : ""));
  }
}

/// `target` of `pa10:fk`, as a handle; nullopt when it is none.
std::optional<Handle> handle_before_colon(lua_State* L, std::string_view chain) {
  const auto colon = chain.rfind(':');
  if (colon == std::string_view::npos || !push_chain(L, chain.substr(0, colon)))
    return std::nullopt;
  const auto h = handle_at(L, -1);
  lua_pop(L, 1);
  return h;
}

/// Names of the poses of a robot, or of all robots there are.
void add_poses(Impl& impl, const std::optional<Handle>& robot, std::set<std::string>& out) {
  const auto add = [&](const Value& id) {
    const ioci::CommandSpec* poses = impl.host.find("robot.poses");
    const auto found = poses ? impl.host.dispatch(*poses, Map{{"id", id}}) : Result<Value>(Value());
    if (!found.ok() || !found->as_map()) return;
    for (const auto& [name, q] : *found->as_map()) out.insert(name);
  };
  if (robot && robot->kind == "robot") return add(Value(*robot));
  const ioci::CommandSpec* list = impl.host.find("robot.list");
  const auto robots = list ? impl.host.dispatch(*list, Map()) : Result<Value>(Value());
  if (!robots.ok() || !robots->as_list()) return;
  for (const Value& each : *robots->as_list()) add(each);
}

/// Names of the providers that a parameter of this name may choose; of all interfaces where the
/// name does not say.
void add_providers(Impl& impl, std::string_view key, std::string_view command,
                   std::set<std::string>& out) {
  const ioci::CommandSpec* list = impl.host.find("provider.list");
  const auto all = list ? impl.host.dispatch(*list, Map()) : Result<Value>(Value());
  if (!all.ok() || !all->as_list()) return;
  std::string_view wanted = key == "provider" ? command : key;
  if (wanted.find("ik") != std::string_view::npos) wanted = "ik";
  for (const std::string_view each : {"inverse_dynamics", "forward_dynamics"})
    if (wanted.find(each) != std::string_view::npos) wanted = each;
  std::set<std::string> every, some;
  for (const Value& one : *all->as_list()) {
    const Map* m = one.as_map();
    const Value* name = m ? m->find("name") : nullptr;
    const Value* interface_id = m ? m->find("interface") : nullptr;
    if (!name || !name->as_string()) continue;
    every.insert(*name->as_string());
    if (interface_id && interface_id->as_string() &&
        interface_id->as_string()->find(wanted) != std::string::npos)
      some.insert(*name->as_string());
  }
  out.merge(some.empty() ? every : some);
}

/// Choices of a parameter of this name, of any command of a topic: `kind` within root = {...} is
/// among those of solid.set_kind and its like.
void add_choices_of_topic(Impl& impl, std::string_view topic, std::string_view key,
                          std::set<std::string>& out) {
  for (const ioci::CommandSpec* spec : impl.host.list()) {
    if (!spec->name.starts_with(std::string(topic) + ".")) continue;
    for (const ParamSpec& p : spec->params)
      if (p.name == key) out.insert(p.choices.begin(), p.choices.end());
  }
}

/// The topic of the outermost call that is open: "solid" within solid.create{root = {kind = ".
std::string topic_around(lua_State* L, std::string_view s, const std::vector<Open>& open) {
  for (auto it = open.rbegin(); it != open.rend(); ++it) {
    const std::string_view chain = chain_before(s, it->at);
    if (chain.empty()) continue;
    if (const auto h = handle_before_colon(L, chain)) return h->kind;
    return std::string(chain.substr(0, chain.find_first_of(".:")));
  }
  return {};
}

/// Arguments that are written as plain texts before the cursor, in the bracket that is open there:
/// `id = "cell"`.
Map texts_given(std::string_view s, const Scan& at) {
  Map out;
  if (at.open.empty()) return out;
  for (std::size_t i = at.open.back().at + 1; i < at.string_start; ++i) {
    const char quote = s[i];
    if (quote != '"' && quote != '\'') continue;
    const std::size_t end = s.find(quote, i + 1);
    if (end == std::string_view::npos || end >= at.string_start) break;
    const std::string_view key = key_before(s, i);
    if (!key.empty()) out.set(std::string(key), std::string(s.substr(i + 1, end - i - 1)));
    i = end;
  }
  return out;
}

/// What schema.choices lists for an argument; false = nothing, or the program behind the state has
/// no such command.
bool add_choices(Impl& impl, lua_State* L, const ioci::CommandSpec& spec,
                 const std::string& argument, std::string_view s, const Scan& at,
                 std::string_view call, std::string_view partial, std::set<std::string>& out) {
  const ioci::CommandSpec* choices = impl.host.find("schema.choices");
  if (!choices) return false;
  Map given = texts_given(s, at);
  if (const auto handle = handle_before_colon(L, call)) given.set("id", *handle);
  const auto listed = impl.host.dispatch(*choices, Map{{"command", spec.name},
                                                       {"argument", argument},
                                                       {"given", std::move(given)},
                                                       {"prefix", std::string(partial)}});
  if (!listed.ok() || !listed->as_list()) return false;
  for (const Value& each : *listed->as_list())
    if (const Value* value = each.as_map() ? each.as_map()->find("value") : nullptr)
      if (value->as_string()) out.insert(*value->as_string());
  return !out.empty();
}

/// Words for the text that begins at a quote.
void string_words(Impl& impl, lua_State* L, std::string_view s, const Scan& at,
                  std::set<std::string>& out) {
  const std::string_view partial = s.substr(at.string_start + 1);
  bool is_method = false;
  const std::string_view direct = chain_before(s, at.string_start);
  const std::string_view key = key_before(s, at.string_start);
  const ioci::CommandSpec* spec = direct.empty() ? command_around(impl, L, s, at.open, is_method)
                                                 : command_called(impl, L, direct, is_method);
  const ParamSpec* param = nullptr;
  if (spec && !key.empty()) {
    param = find_param(spec->params, key);
  } else if (spec && key.empty()) {
    const std::size_t first = is_method ? 1 : 0;
    if (first < spec->params.size()) param = &spec->params[first];
  }
  if (spec && param) {
    const std::string_view call =
        !direct.empty() ? direct : chain_before(s, at.open.empty() ? 0 : at.open.back().at);
    if (add_choices(impl, L, *spec, param->name, s, at, call, partial, out)) return;
  }
  constexpr std::string_view kProviders[] = {"provider",         "ik",         "inverse_dynamics",
                                             "forward_dynamics", "controller", "planner"};
  const bool is_provider =
      std::find(std::begin(kProviders), std::end(kProviders), key) != std::end(kProviders);
  if (key == "q" || key == "seed" || (param && (param->name == "q" || param->name == "seed"))) {
    const std::string_view call =
        !direct.empty() ? direct : chain_before(s, at.open.empty() ? 0 : at.open.back().at);
    add_poses(impl, handle_before_colon(L, call), out);
    return;
  }
  if (is_provider &&
      (!param || plain_type(param->type) == "any" || plain_type(param->type) == "string")) {
    add_providers(impl, key,
                  at.open.empty() ? std::string_view() : chain_before(s, at.open.back().at), out);
    return;
  }
  if ((!spec || !param) && !key.empty()) {
    const std::string topic = topic_around(L, s, at.open);
    if (topic == "solid" && key == "kind" && at.open.size() > 1)
      for (std::string& word : ioci::kind_words()) out.insert(std::move(word));
    else add_choices_of_topic(impl, topic, key, out);
    if (!out.empty()) return;
  }
  if (!spec || !param) {
    add_records(impl, "any", out);
    add_files(impl, partial, out);
    return;
  }
  if (spec->name == "help")
    for (const auto* c : impl.host.list()) out.insert(c->name);
  else if (plain_type(param->type).starts_with("ref:"))
    add_records(impl, plain_type(param->type).substr(4), out);
  else if (!param->choices.empty()) out.insert(param->choices.begin(), param->choices.end());
  else if (plain_type(param->type) == "path") add_files(impl, partial, out);
  else if (spec->name.ends_with(".get")) {
    const std::string kind = spec->name.substr(0, spec->name.size() - 4);
    add_records(impl, kind, out);
    add_library(impl, kind, out);
  } else if (plain_type(param->type) == "string") {
    add_records(impl, spec->name.substr(0, spec->name.find('.')), out);
  }
}

/// Names behind `chain.` or `chain:`.
void member_words(Impl& impl, lua_State* L, std::string_view chain, char separator,
                  std::set<std::string>& out) {
  if (!push_chain(L, chain)) return;
  if (const KindInfo* info = handle_kind(L, -1)) {
    for (std::string& m : method_names(impl, info->kind)) out.insert(std::move(m));
    if (separator == '.') out.insert({"exists", "kind", "name", "number"});
  } else {
    if (lua_type(L, -1) == LUA_TSTRING) lua_getglobal(L, "string");
    if (array_at(L, -1)) push_array_methods(L);
    if (lua_istable(L, -1)) {
      lua_pushnil(L);
      while (lua_next(L, -2) != 0) {
        if (lua_type(L, -2) == LUA_TSTRING && (separator == '.' || lua_isfunction(L, -1)))
          out.insert(lua_tostring(L, -2));
        lua_pop(L, 1);
      }
    }
  }
}

void global_words(lua_State* L, std::set<std::string>& out) {
  out.insert(ioci::kLuaKeywords.begin(), ioci::kLuaKeywords.end());
  lua_pushglobaltable(L);
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    if (lua_type(L, -2) == LUA_TSTRING) out.insert(lua_tostring(L, -2));
    lua_pop(L, 1);
  }
}

}  // namespace

Completion completion(Impl& impl, lua_State* L, std::string_view input, std::size_t cursor) {
  const std::string_view s = input.substr(0, std::min(cursor, input.size()));
  const Scan at = scan(s);
  Completion out;
  out.start = s.size();
  if (at.in_comment) return out;
  std::set<std::string> words;
  if (at.in_string) {
    out.start = at.string_start + 1;
    string_words(impl, L, s, at, words);
  } else {
    while (out.start > 0 && is_word(s[out.start - 1])) --out.start;
    const char before = out.start > 0 ? s[out.start - 1] : '\0';
    const bool concatenation = before == '.' && out.start > 1 && s[out.start - 2] == '.';
    if ((before == '.' || before == ':') && !concatenation) {
      member_words(impl, L, chain_before(s, out.start - 1), before, words);
    } else {
      bool is_method = false;
      if (!at.open.empty() && at.open.back().bracket == '{' && key_before(s, out.start).empty())
        if (const ioci::CommandSpec* spec = command_around(impl, L, s, at.open, is_method))
          for (std::size_t i = is_method ? 1 : 0; i < spec->params.size(); ++i)
            words.insert(spec->params[i].name + " = ");
      // Where parameters are named, other words would only hide them.
      const std::string_view partial = s.substr(out.start);
      const bool named = std::any_of(words.begin(), words.end(),
                                     [&](const std::string& w) { return w.starts_with(partial); });
      if (!named && !(partial.empty() && at.open.empty())) global_words(L, words);
    }
  }
  const std::string_view partial = s.substr(out.start);
  for (const std::string& w : words)
    if (w.starts_with(partial)) out.words.push_back(w);
  return out;
}

Completion LuaState::complete(std::string_view input, std::size_t cursor) const {
  Completion out;
  const auto done = run_protected(*impl_, [&](lua_State* L) -> Result<void> {
    out = completion(*impl_, L, input, cursor);
    return {};
  });
  return done.ok() ? out : Completion{std::min(cursor, input.size()), {}};
}

}  // namespace robomosp::lua
