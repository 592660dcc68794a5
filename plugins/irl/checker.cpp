// SPDX-License-Identifier: Apache-2.0
// Units, scopes, declarations.
#include "checker.h"

#include <algorithm>
#include <array>
#include <limits>

namespace robomosp::irl {
namespace {

using Id = std::uint32_t;
constexpr std::uint64_t kMostSlots = 16'000'000;  ///< values that a type holds

std::string_view base_name(std::string_view path) {
  const std::size_t slash = path.find_last_of("/\\");
  return slash == std::string_view::npos ? path : path.substr(slash + 1);
}
/// Letters that differ, up to a limit.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t next =
          std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = row[j];
      row[j] = next;
    }
  }
  return row.back();
}

}  // namespace

Checker::Checker(ProgramTables& out, Names& names, Faults& faults,
                 std::span<const SourceFile> files, Progress& progress)
    : out_(out), names_(names), faults_(faults), files_(files), progress_(progress) {
  for (std::uint32_t t = 0; t <= RMP_TYPE_PROCESS; ++t)
    add_type({t, RMP_ROLE_NONE, "", kNone, 0, 0, 0, 0, {}});
}

// ---- helpers ----

rmp_span Checker::span(const Node& n) const {
  const Token &a = s_->tokens[n.token], &b = s_->tokens[n.last];
  return {s_->file, a.line, a.column, a.begin, std::max(a.end, b.end)};
}
rmp_span Checker::name_span(const Node& n) const {
  const Token& a = s_->tokens[n.name == kNone ? n.token : n.name_token];
  return {s_->file, a.line, a.column, a.begin, a.end};
}
std::string Checker::written(const Node& n) const {
  return std::string(s_->word(s_->tokens[n.name_token]));
}
void Checker::fail(const Node& n, std::string message, std::string hint) {
  Token t = s_->tokens[n.token];
  t.end = std::max(t.end, s_->tokens[n.last].end);
  faults_.error(s_->file, t, std::move(message), std::move(hint));
}
void Checker::fail_name(const Node& n, std::string message, std::string hint) {
  faults_.error(s_->file, s_->tokens[n.name_token], std::move(message), std::move(hint));
}
void Checker::warn(const Node& n, std::string message, std::string hint) {
  Token t = s_->tokens[n.token];
  t.end = std::max(t.end, s_->tokens[n.last].end);
  faults_.warning(s_->file, t, std::move(message), std::move(hint));
}
Id Checker::child(const Node& n, int i) const {
  Id c = n.first;
  while (c != kNone && i-- > 0) c = at(c).next;
  return c;
}

// ---- units ----

Source& Checker::load(std::string_view name, std::string_view text, Unit unit) {
  Source& s = sources_.emplace_back();
  s.file = static_cast<Id>(out_.files.size());
  s.name = name;
  s.text = text;
  out_.files.push_back({out_.keep(base_name(name))});
  scan(s, names_, faults_);
  parse(s, unit, names_, faults_, depth_ == Depth::heads);
  return s;
}

Id Checker::find_file(std::string_view name) const {
  const std::string wanted = upper(base_name(name));
  for (std::size_t i = 0; i < files_.size(); ++i)
    if (upper(base_name(files_[i].name)) == wanted) return static_cast<Id>(i);
  return kNone;
}

bool Checker::run() {
  const rmp_span nowhere{};
  const Id predefined = new_scope(RMP_SCOPE_PREDEFINED, kNone, "predefined", nowhere);
  // The program's file is number 0, whatever else is read before it.
  Source& main = load(files_[0].name, files_[0].text, Unit::program);
  const bool is_program = !main.nodes.empty() && main.nodes[0].kind == N::program;
  const bool is_module = !main.nodes.empty() && main.nodes[0].kind == N::module;
  // Routine 0 is the program.
  out_.routines.push_back({RMP_ROUTINE_PROGRAM, kNone, kNone, 0, 0, RMP_TYPE_VOID, kNone, kNone,
                           kNone, 0, 0, 0, 0, 0, nowhere});
  calls_.emplace_back();

  s_ = &main;
  scope_ = predefined;
  static constexpr std::pair<const char*, Id> kTypes[] = {
      {"INT", RMP_TYPE_INT},   {"REAL", RMP_TYPE_REAL},          {"CHAR", RMP_TYPE_CHAR},
      {"BOOL", RMP_TYPE_BOOL}, {"STRING", RMP_TYPE_STRING},      {"TEXT", RMP_TYPE_TEXT},
      {"FILE", RMP_TYPE_FILE}, {"SEMAPHORE", RMP_TYPE_SEMAPHORE}};
  const auto predefine = [&](std::string_view name, std::uint32_t kind, Id type, Id constant) {
    out_.symbols.push_back(
        {kind, 0, out_.keep(name), type, predefined, kNone, kNone, constant, 0, 0, nowhere});
    symbol_names_.push_back(names_.number(name));
    known_[predefined].emplace(symbol_names_.back(), static_cast<Id>(out_.symbols.size() - 1));
  };
  for (const auto& [name, type] : kTypes) predefine(name, RMP_SYMBOL_TYPE, type, kNone);
  for (const bool v : {false, true})
    predefine(v ? "TRUE" : "FALSE", RMP_SYMBOL_CONSTANT, RMP_TYPE_BOOL,
              out_.integer(v, RMP_TYPE_BOOL));
  for (const Intrinsic& i : intrinsics())
    predefine(i.name, RMP_SYMBOL_INTRINSIC, RMP_TYPE_VOID, kNone);
  check_unit(load("predefined.irl", kPredefined, Unit::program), predefined);
  if (!is_program && !is_module) return true;

  // The cell: what the program names, or the standard one.
  s_ = &main;
  const Node& root = main.nodes[0];
  const Node* specification = nullptr;
  for (Id h = root.first; h != kNone; h = at(h).next) {
    if (at(h).kind != N::specification) continue;
    if (specification) fail(at(h), "a program can have only one system specification");
    else specification = &at(h);
  }
  const Id system = new_scope(RMP_SCOPE_SYSTEM, predefined, "system", nowhere);
  if (!specification) {
    check_unit(load("standard.ssi", kStandardCell, Unit::program), system);
  } else {
    const std::string name = string_value(main.word(main.tokens[specification->name_token]));
    const Id f = find_file(name);
    if (f == kNone) {
      std::string all;
      for (std::size_t i = 1; i < files_.size() && i < 10; ++i)
        all += (i > 1 ? ", " : "") + std::string(base_name(files_[i].name));
      fail(
          *specification,
          "the system specification '" + name + "' is not among the program's files",
          all.empty() ? "Add the file to the program: program.set_file." : "They are " + all + ".");
      // What the cell would give is not said to be missing, too.
      check_unit(load("standard.ssi", kStandardCell, Unit::program), system);
    } else {
      check_unit(load(files_[f].name, files_[f].text, Unit::program), system);
    }
  }
  s_ = &main;
  const std::string name(main.word(main.tokens[main.nodes[0].name_token]));
  out_.set_name(name);
  const Id scope = new_scope(is_module ? RMP_SCOPE_MODULE : RMP_SCOPE_PROGRAM, system, name,
                             span(main.nodes[0]));
  scope_ = scope;
  rmp_code_symbol self{};
  self.kind = RMP_SYMBOL_ROUTINE;
  self.name = out_.keep(name);
  self.type = RMP_TYPE_VOID;
  self.scope = scope;
  self.value = self.constant = kNone;
  self.span = name_span(main.nodes[0]);
  out_.routines[0].symbol = static_cast<Id>(out_.symbols.size());
  out_.routines[0].scope = scope;
  out_.routines[0].span = span(main.nodes[0]);
  use(main.nodes[0], static_cast<Id>(out_.symbols.size()), Use::symbol, true);
  out_.symbols.push_back(self);
  symbol_names_.push_back(kNone);
  check_unit(main, scope);
  if (is_cancelled_) return false;
  is_given_.resize(given_.size());
  s_ = &main;
  for (std::size_t i = 0; i < given_.size(); ++i)
    if (!is_given_[i])
      fail(main.nodes[0],
           "the program declares no " + std::string(given_[i].name) + ", which is given a value",
           "Declare it in the program, after VAR or CONST.");

  // Taught values.
  s_ = &main;
  scope_ = scope;
  bool has_list = false;
  for (Id h = main.nodes[0].first; h != kNone; h = main.nodes[h].next) {
    s_ = &main;
    const Node& head = main.nodes[h];
    if (head.kind != N::use_data_list) continue;
    has_list = true;
    data_list(string_value(main.word(main.tokens[head.name_token])), &head);
  }
  if (!has_list && find_file("datalist.dls") != kNone) data_list("datalist.dls", nullptr);
  s_ = &main;
  for (const auto& [symbol, where] : teaches_)
    if (!taught_.contains(symbol))
      warn(where, std::string(out_.symbols[symbol].name) + " has no taught value yet",
           "Assign one in a data list: " + std::string(out_.symbols[symbol].name) + " := ...;");
  mark_recursion();
  return !is_cancelled_;
}

void Checker::check_unit(Source& s, Id scope) {
  Source* const before = s_;
  const Id before_scope = scope_, before_routine = routine_;
  s_ = &s;
  scope_ = scope;
  routine_ = kNone;
  if (!s.nodes.empty()) {
    const Node& root = at(0);
    for (Id h = root.first; h != kNone; h = at(h).next)
      if (at(h).kind == N::import_) import(at(h));
    sections(root.first);
    for (Id d = root.first; d != kNone && !is_cancelled_; d = at(d).next) {
      const Node& n = at(d);
      if (n.kind == N::export_) {
        if (root.kind != N::module) fail(n, "a program cannot export names; only modules can");
        for (Id x = n.first; x != kNone; x = at(x).next) {
          if (!known_[scope].contains(at(x).name))
            fail_name(at(x), "the module declares no " + written(at(x)));
          else use(at(x), known_[scope].at(at(x).name));
          exports_[scope].insert(at(x).name);
        }
      }
      const bool is_routine = n.kind == N::procedure || n.kind == N::function ||
                              n.kind == N::process || n.kind == N::interrupt;
      if (is_routine)
        if (const auto body = bodies_.find(d); body != bodies_.end() && body->second.first == s_)
          routine_body(n, body->second.second);
      if (n.kind == N::block && depth_ == Depth::all) {
        if (out_.scopes[scope].kind != RMP_SCOPE_PROGRAM) {
          if (n.first != kNone)
            fail(at(n.first), "a system specification has no statements",
                 "It can declare constants, types and variables only.");
          continue;
        }
        routine_ = 0;
        gotos_.clear();
        labels_.clear();
        blocks_.clear();
        const Id body = block(d);
        out_.routines[0].body = body;
        resolve_gotos();
        routine_ = kNone;
      }
    }
    std::erase_if(bodies_, [&](const auto& b) { return b.second.first == s_; });
  }
  s_ = before;
  scope_ = before_scope;
  routine_ = before_routine;
}

Id Checker::module_scope(const Node& where, std::uint32_t name) {
  if (const auto found = modules_.find(name); found != modules_.end()) return found->second;
  const std::string& wanted = names_.upper(name);
  if (loading_.contains(name)) {
    fail(where, "module " + wanted + " imports itself, through its imports");
    return modules_[name] = kNone;
  }
  if (module_files_.empty())
    for (std::size_t i = 1; i < files_.size(); ++i) {
      const std::string_view base = base_name(files_[i].name);
      module_files_.emplace(upper(base.substr(0, base.rfind('.'))), i);
    }
  if (const auto there = module_files_.find(wanted); there != module_files_.end()) {
    const SourceFile& f = files_[there->second];
    const std::string_view base = base_name(f.name);
    if (loading_.size() >= 64) {
      fail(where, "imports are nested more than 64 modules deep");
      return modules_[name] = kNone;
    }
    loading_.insert(name);
    Source& s = load(f.name, f.text, Unit::program);
    Id scope = kNone;
    if (s.nodes.empty() || s.nodes[0].kind != N::module) {
      fail(where, "the file " + std::string(base) + " contains no module",
           "A module must begin with MODULE and its name.");
    } else {
      scope = new_scope(RMP_SCOPE_MODULE, 1, wanted, {s.file, 1, 1, 0, 0});
      check_unit(s, scope);
    }
    loading_.erase(name);
    return modules_[name] = scope;
  }
  fail(where, "the module " + wanted + " is not among the program's files",
       "Its file must have its name: " + wanted + ".irl");
  return modules_[name] = kNone;
}

void Checker::import(const Node& n) {
  const auto take = [&](Id scope, std::uint32_t name, const Node& where) {
    const Id symbol = known_[scope].at(name);
    if (where.name == name) use(where, symbol);
    if (!known_[scope_].emplace(name, symbol).second)
      fail(where, names_.upper(name) + " already exists");
  };
  if (n.name != kNone) {
    const Id scope = module_scope(n, n.name);
    for (Id x = n.first; x != kNone && scope != kNone; x = at(x).next) {
      if (known_[scope].contains(at(x).name) && exports_[scope].contains(at(x).name))
        take(scope, at(x).name, at(x));
      else
        fail_name(at(x), "module " + written(n) + " exports no " + written(at(x)),
                  known_[scope].contains(at(x).name) ? "Name it in the module's EXPORT." : "");
    }
    return;
  }
  for (Id x = n.first; x != kNone; x = at(x).next) {
    const Id scope = module_scope(at(x), at(x).name);
    if (scope == kNone) continue;
    const std::set<std::uint32_t> all = exports_[scope];
    for (const std::uint32_t name : all)
      if (known_[scope].contains(name)) take(scope, name, at(x));
  }
}

void Checker::data_list(std::string_view name, const Node* where) {
  const Id f = find_file(name);
  if (f == kNone) {
    fail(*where, "the data list '" + std::string(name) + "' is not among the program's files",
         "Add the file to the program: program.set_file.");
    return;
  }
  // A list that the program does not name may be of other programs in its folder: it counts for the
  // variables that this program teaches, and must not keep it from running.
  const bool is_of_folder = where == nullptr;
  const std::size_t faults_before = faults_.all.size();
  const std::uint32_t errors_before = faults_.errors();
  Source& s = load(files_[f].name, files_[f].text, Unit::data_list);
  if (is_of_folder && faults_.errors() > errors_before) {
    std::string why;
    Token at_fault;
    for (std::size_t i = faults_.all.size(); i-- > faults_before;)
      if (faults_.all[i].severity == RMP_FAULT_ERROR) {
        why = faults_.all[i].message;
        at_fault = faults_.all[i].at;
      }
    faults_.drop_after(faults_before, errors_before);
    const std::string what =
        "the data list '" + std::string(base_name(s.name)) + "' cannot be read: " + why;
    if (teaches_.empty())
      faults_.warning(s.file, at_fault, what, "No TEACH of this program needs it.");
    else
      faults_.error(s.file, at_fault, what,
                    "Correct it, or name the program's list: DATALIST 'name.dls';");
    return;
  }
  std::set<Id> needed;
  for (const auto& [symbol, at_teach] : teaches_) needed.insert(symbol);
  std::vector<std::string> unknown;
  Source* const before = s_;
  s_ = &s;
  if (!s.nodes.empty() && s.nodes[0].first != kNone) {
    const Id routine = static_cast<Id>(out_.routines.size());
    rmp_code_symbol self{};
    self.kind = RMP_SYMBOL_ROUTINE;
    self.name = out_.keep(base_name(files_[f].name));
    self.type = RMP_TYPE_VOID;
    self.scope = scope_;
    self.routine = routine;
    self.value = self.constant = kNone;
    out_.routines.push_back({RMP_ROUTINE_DATA_LIST, static_cast<Id>(out_.symbols.size()), scope_, 0,
                             0, RMP_TYPE_VOID, kNone, kNone, kNone, 0, 0, 0, 0, 0,
                             span(s.nodes[0])});
    out_.symbols.push_back(self);
    symbol_names_.push_back(kNone);
    calls_.emplace_back();
    Id first = kNone, last = kNone;
    for (Id n = at(s.nodes[0].first).first; n != kNone; n = at(n).next) {
      const Node& a = at(n);
      if (a.kind != N::assign || at(a.first).kind != N::name) {
        fail(a, "a data list can contain values of variables only", "Such as: place := POSE(...);");
        continue;
      }
      const Id named = lookup(at(a.first).name);
      use(at(a.first), named);
      if (is_of_folder && !needed.contains(named)) {
        if (named == kNone) unknown.emplace_back(written(at(a.first)));
        continue;
      }
      const bool is_new = named == kNone || taught_.insert(named).second;
      const Id statement_id = statement(a);
      if (statement_id == kNone) continue;
      const rmp_code_statement st = out_.statements[statement_id];
      const Id symbol = out_.expressions[st.a].symbol;
      if (!is_pure(st.b))
        fail(a, "a taught value must consist of numbers, constants and functions of the language");
      if (!is_new)
        warn(a, std::string(out_.symbols[symbol].name) + " already has a taught value above",
             "The last one applies.");
      if (last == kNone) first = statement_id;
      else out_.statements[last].next = statement_id;
      last = statement_id;
    }
    out_.routines[routine].body = first;
  }
  if (!unknown.empty()) {
    constexpr std::size_t kMostNamed = 5;
    std::string names;
    for (std::size_t i = 0; i < unknown.size() && i < kMostNamed; ++i)
      names += (i ? ", " : "") + unknown[i];
    if (unknown.size() > kMostNamed)
      names += " and " + std::to_string(unknown.size() - kMostNamed) + " more";
    faults_.note(s.file, s.tokens[0],
                 "values of " + names + " are ignored: the program declares no such " +
                     (unknown.size() == 1 ? "variable" : "variables"),
                 "They may belong to another program in the folder.");
  }
  s_ = before;
}

/// Which routines call themselves, by whatever way: members of circles of the graph of calls
/// (Tarjan, SIAM J. Comput. 1, 1972), without a stack of this program's.
void Checker::mark_recursion() {
  const std::size_t n = out_.routines.size();
  std::vector<std::vector<Id>> calls(n);
  for (std::size_t r = 0; r < n && r < calls_.size(); ++r)
    calls[r].assign(calls_[r].begin(), calls_[r].end());
  std::vector<Id> index(n, kNone), low(n, 0), stack;
  std::vector<bool> on_stack(n, false);
  Id count = 0;
  struct Step {
    Id routine;
    std::size_t next;
  };
  std::vector<Step> steps;
  for (Id root = 0; root < n; ++root) {
    if (index[root] != kNone) continue;
    steps.push_back({root, 0});
    while (!steps.empty()) {
      const Id r = steps.back().routine;
      if (steps.back().next == 0) {
        index[r] = low[r] = count++;
        stack.push_back(r);
        on_stack[r] = true;
      }
      if (steps.back().next < calls[r].size()) {
        const Id c = calls[r][steps.back().next++];
        if (index[c] == kNone) steps.push_back({c, 0});
        else if (on_stack[c]) low[r] = std::min(low[r], index[c]);
        if (c == r) out_.routines[r].is_recursive = 1;
        continue;
      }
      if (calls[r].empty() || steps.back().next >= calls[r].size()) {
        for (const Id c : calls[r])
          if (on_stack[c]) low[r] = std::min(low[r], low[c]);
        if (low[r] == index[r]) {
          std::vector<Id> together;
          Id top = kNone;
          do {
            top = stack.back();
            stack.pop_back();
            on_stack[top] = false;
            together.push_back(top);
          } while (top != r);
          if (together.size() > 1)
            for (const Id t : together) out_.routines[t].is_recursive = 1;
        }
        steps.pop_back();
      }
    }
  }
}

// ---- scopes and names ----

Id Checker::new_scope(std::uint32_t kind, Id parent, std::string_view name, const rmp_span& where) {
  out_.scopes.push_back({kind, parent, out_.keep(name), where});
  known_.emplace_back();
  exports_.emplace_back();
  return static_cast<Id>(out_.scopes.size() - 1);
}

Id Checker::declare(std::uint32_t kind, const Node& n, Id type) {
  if (const auto found = known_[scope_].find(n.name); found != known_[scope_].end()) {
    const rmp_code_symbol& old = out_.symbols[found->second];
    const bool is_here = old.span.file == s_->file && old.span.line > 0;
    fail_name(n, written(n) + " is already declared",
              is_here ? "The first one is in line " + std::to_string(old.span.line) + "." : "");
    return kNone;
  }
  rmp_code_symbol s{};
  s.kind = kind;
  s.name = out_.keep(written(n));
  s.type = type;
  s.scope = scope_;
  s.routine = routine_;
  s.value = s.constant = kNone;
  s.span = name_span(n);
  const Id id = static_cast<Id>(out_.symbols.size());
  out_.symbols.push_back(s);
  symbol_names_.push_back(n.name);
  known_[scope_].emplace(n.name, id);
  use(n, id, Use::symbol, true);
  return id;
}

Id Checker::lookup(std::uint32_t name) const {
  for (Id s = scope_; s != kNone; s = out_.scopes[s].parent)
    if (const auto found = known_[s].find(name); found != known_[s].end()) return found->second;
  return kNone;
}

std::string Checker::suggestion(std::uint32_t name) const {
  const std::string& wanted = names_.upper(name);
  if (wanted.size() > 40) return {};
  std::size_t best = wanted.size() / 3 + 1, looked = 0;
  Id found = kNone;
  for (Id s = scope_; s != kNone; s = out_.scopes[s].parent)
    for (const auto& [known, symbol] : known_[s]) {
      const std::string& k = names_.upper(known);
      if (k.size() > 40 || ++looked > 3000) continue;
      const std::size_t d = distance(wanted, k);
      if (d < best || (d == best && found != kNone && k < names_.upper(symbol_names_[found]))) {
        best = d;
        found = symbol;
      }
    }
  return found == kNone || symbol_names_[found] == kNone
             ? std::string()
             : "Did you mean " + std::string(out_.symbols[found].name) + "?";
}

// ---- declarations ----

void Checker::sections(Id first) {
  for (Id d = first; d != kNone && !is_cancelled_ && !faults_.is_full(); d = at(d).next) {
    const Node& n = at(d);
    switch (n.kind) {
      case N::const_section:
      case N::var_section: variables(n); break;
      case N::type_section: types(n); break;
      case N::signal_section: signals(n); break;
      case N::procedure:
      case N::function:
      case N::process:
      case N::interrupt: {
        if (routine_ != kNone) {
          fail(n, "a routine is declared within another routine",
               "Declare routines in the program or in a module.");
          break;
        }
        const std::size_t before = out_.routines.size();
        routine_head(n);
        if (out_.routines.size() > before)
          bodies_[d] = {s_, static_cast<Id>(out_.routines.size() - 1)};
        break;
      }
      default: break;
    }
    is_cancelled_ = is_cancelled_ || progress_.cancelled();
  }
}

void Checker::variables(const Node& section) {
  const bool is_constant = section.kind == N::const_section;
  for (Id d = section.first; d != kNone; d = at(d).next) {
    const Node& decl = at(d);
    const Id t = type(decl.first);
    for (Id v = at(decl.first).next; v != kNone; v = at(v).next) {
      const Node& n = at(v);
      Id value = kNone;
      // The count of a semaphore is an INT.
      if (n.first != kNone && t != RMP_TYPE_SEMAPHORE) value = component(n.first, t, written(n));
      if (t == RMP_TYPE_SEMAPHORE && n.first != kNone) {
        const auto count = constant_int(n.first, "the count of a semaphore");
        if (count && *count < 0) fail(at(n.first), "the count of a semaphore must not be negative");
        if (count) value = literal(out_.integer(*count, RMP_TYPE_SEMAPHORE), span(at(n.first)));
      }
      const Id s = declare(is_constant ? RMP_SYMBOL_CONSTANT : RMP_SYMBOL_VARIABLE, n, t);
      if (is_constant && n.first == kNone)
        fail(n, "the constant " + written(n) + " has no value", "Such as: INT: n := 3;");
      if (is_constant && value != kNone && type_of(value) != kBad && !is_pure(value))
        fail(at(n.first), "the value of a constant is unknown before run time",
             "Declare it as a variable, after VAR.");
      if (is_constant && (t == RMP_TYPE_FILE || t == RMP_TYPE_TEXT || t == RMP_TYPE_SEMAPHORE))
        fail(n, shown(t) + " cannot be constant", "Declare it as a variable, after VAR.");
      if (s == kNone) continue;
      if (!given_.empty() && routine_ == kNone && out_.scopes[scope_].kind == RMP_SCOPE_PROGRAM)
        value = given(n, t, value);
      out_.symbols[s].value = value;
      if (is_constant && value != kNone)
        out_.symbols[s].constant = out_.expressions[value].constant;
    }
  }
}

Id Checker::given(const Node& n, Id type, Id value) {
  const std::string name = upper(written(n));
  is_given_.resize(given_.size());
  for (std::size_t i = 0; i < given_.size(); ++i) {
    const GivenValue& g = given_[i];
    if (upper(g.name) != name) continue;
    is_given_[i] = true;
    const std::string what = "the value that " + written(n) + " is given";
    if (type == kBad) continue;
    if (type == RMP_TYPE_SEMAPHORE || type == RMP_TYPE_FILE || type == RMP_TYPE_TEXT) {
      fail(n, written(n) + " is given a value, and " + shown(type) + " takes none");
      continue;
    }
    // The part of a record that its declaration makes.
    Id wanted = type, part = kNone;
    if (!g.field.empty()) {
      const std::string field = upper(g.field);
      const rmp_code_type t = out_.types[type];
      for (Id k = 0; t.kind == RMP_TYPE_RECORD && k < t.field_count; ++k)
        if (upper(out_.fields[t.first_field + k].name) == field) {
          part = k;
          wanted = out_.fields[t.first_field + k].type;
        }
      if (part == kNone) {
        fail(n, shown(type) + " has no field " + std::string(g.field) + ", which is given a value");
        continue;
      }
      if (value == kNone || out_.expressions[value].op != RMP_EXPR_MAKE ||
          out_.expressions[value].count != t.field_count) {
        fail(n,
             std::string(g.field) + " of " + written(n) +
                 " is given a value, but its declaration gives the others none",
             "Such as: ROBTARGET: " + written(n) +
                 " := ROBTARGET(place, -1, [-128, -128], "
                 "ADD_JOINT(0.0));");
        continue;
      }
    }
    if (!given_source_) {
      for (const GivenValue& one : given_) {
        std::string line = std::string(one.name) + " := " + std::string(one.text) + ";";
        std::replace(line.begin(), line.end(), '\n', ' ');
        given_text_ += line + "\n";
      }
      given_source_ = &load("given values", given_text_, Unit::data_list);
    }
    Source* const before = s_;
    s_ = given_source_;
    Id text = kNone;
    std::size_t statements = 0;  // a value is one
    if (!s_->nodes.empty() && s_->nodes[0].first != kNone)
      for (Id a = at(s_->nodes[0].first).first; a != kNone; a = at(a).next) {
        if (s_->tokens[at(a).token].line != i + 1) continue;
        ++statements;
        if (at(a).kind == N::assign) text = at(at(a).first).next;
      }
    if (statements != 1) text = kNone;
    Id made = kNone;
    if (text != kNone) {
      made = component(text, wanted, what);
      if (type_of(made) != kBad && !is_pure(made))
        fail(at(text), what + " is unknown before run time",
             "It must consist of numbers, constants and functions of the language.");
    }
    s_ = before;
    if (made == kNone) {
      if (faults_.errors() == 0) fail(n, what + " is not an expression: " + std::string(g.text));
      continue;
    }
    if (part == kNone) {
      value = made;
      continue;
    }
    const rmp_code_expression old = out_.expressions[value];
    std::vector<Id> parts;
    for (Id k = 0; k < old.count; ++k) parts.push_back(out_.links[old.first + k]);
    parts[part] = made;
    value = add_with(RMP_EXPR_MAKE, type, old.span, parts);
  }
  return value;
}

void Checker::types(const Node& section) {
  for (Id d = section.first; d != kNone; d = at(d).next) {
    const Node& n = at(d);
    if (n.kind == N::robot_decl) {
      const Id value = expression(n.first);
      const Id t = type_of(value);
      if (t != kBad && out_.types[t].kind != RMP_TYPE_RECORD)
        fail(at(n.first), "a robot must be described by a record, but this is " + shown(t),
             "Such as: ROBOT arm := R_SPEC_TYPE(...);");
      const Id s = declare(RMP_SYMBOL_ROBOT, n, t);
      if (s != kNone) out_.symbols[s].value = value;
      continue;
    }
    Id t = type(n.first);
    if (t != kBad && at(n.first).kind != N::type_name) {
      // A named type is one of its own.
      rmp_code_type copy = out_.types[t];
      copy.name = out_.keep(written(n));
      copy.span = name_span(n);
      if (copy.kind == RMP_TYPE_RECORD) out_.types[t] = copy;
      else t = add_type(copy);
      give_role(t, n.name, n);
    }
    declare(RMP_SYMBOL_TYPE, n, t);
  }
}

/// What a record means to motions is known by its name, as cells declare it.
void Checker::give_role(Id t, std::uint32_t name, const Node& where) {
  const rmp_code_type& x = out_.types[t];
  if (x.kind != RMP_TYPE_RECORD || routine_ != kNone) return;
  const std::string& n = names_.upper(name);
  const auto field_role = [&](Id k) {
    const Id f = out_.fields[x.first_field + k].type;
    return f == kBad ? 0U : out_.types[f].role;
  };
  // Joints that are whole numbers, such as those of grippers, are INT in cells of 2006.
  const auto all_numbers = [&] {
    for (Id k = 0; k < x.field_count; ++k)
      if (const Id of = out_.fields[x.first_field + k].type;
          of != RMP_TYPE_REAL && of != RMP_TYPE_INT)
        return false;
    return true;
  };
  std::uint32_t role = RMP_ROLE_NONE;
  bool fits = true;
  std::string needed;
  if (out_.scopes[scope_].kind == RMP_SCOPE_PREDEFINED) {
    if (n == "POSITION") role = RMP_ROLE_POSITION;
    if (n == "ORIENTATION") role = RMP_ROLE_ORIENTATION;
    if (n == "POSE") role = RMP_ROLE_POSE;
  } else if (n == "MAIN_JOINT" || n == "ADD_JOINT") {
    role = n == "MAIN_JOINT" ? RMP_ROLE_MAIN_JOINT : RMP_ROLE_ADD_JOINT;
    fits = all_numbers();
    needed = "REAL or INT fields only";
  } else if (n == "JOINT") {
    role = RMP_ROLE_JOINT;
    fits = x.field_count == 2 && field_role(0) == RMP_ROLE_MAIN_JOINT &&
           field_role(1) == RMP_ROLE_ADD_JOINT;
    needed = "a MAIN_JOINT and an ADD_JOINT";
  } else if (n == "ROBTARGET") {
    role = RMP_ROLE_ROBTARGET;
    fits = x.field_count == 4 && field_role(0) == RMP_ROLE_POSE &&
           out_.fields[x.first_field + 1].type == RMP_TYPE_INT &&
           out_.fields[x.first_field + 2].type != kBad &&
           out_.types[out_.fields[x.first_field + 2].type].kind == RMP_TYPE_ARRAY &&
           out_.types[out_.fields[x.first_field + 2].type].element == RMP_TYPE_INT &&
           field_role(3) == RMP_ROLE_ADD_JOINT;
    needed = "a POSE, an INT (status), an array of INT (turns) and an ADD_JOINT";
  } else if (n == "R_SPEC_TYPE") {
    role = RMP_ROLE_ROBOT;
  }
  if (!fits) {
    // What is made of a record that is an error already says nothing new.
    bool is_said = false;
    for (Id k = 0; k < x.field_count; ++k)
      is_said = is_said || misfits_.contains(out_.fields[x.first_field + k].type);
    if (!is_said)
      fail_name(where, n + " has a meaning for motions and holds " + needed,
                "Give it another name, or these fields.");
    role = RMP_ROLE_NONE;
    misfits_.insert(t);
  }
  out_.types[t].role = role;
}

void Checker::signals(const Node& section) {
  for (Id d = section.first; d != kNone; d = at(d).next) {
    const Node& n = at(d);
    const Id t = type(n.first);
    if (t != kBad && t != RMP_TYPE_BOOL && t != RMP_TYPE_INT && t != RMP_TYPE_REAL)
      fail(at(n.first), "a signal must be BOOL, INT or REAL, not " + shown(t));
    if (routine_ != kNone) fail(n, "signals must be declared by the program, a module or the cell");
    const Id s = declare(n.flag ? RMP_SYMBOL_OUTPUT : RMP_SYMBOL_INPUT, n, t);
    const Id a = at(n.first).next;
    const auto address = constant_int(a, "the number of a signal");
    std::optional<std::int32_t> width = 1;
    if (at(a).next != kNone) width = constant_int(at(a).next, "the width of a signal");
    if (!address || !width || s == kNone) continue;
    if (*address < 0) fail(at(a), "the number of a signal must not be negative");
    if (*width < 1 || *width > 64) fail(at(at(a).next), "a signal must be 1 to 64 bits wide");
    if (t == RMP_TYPE_BOOL && *width != 1) fail(at(at(a).next), "a BOOL signal must be 1 bit wide");
    out_.symbols[s].address = *address;
    out_.symbols[s].width = *width;
  }
}

void Checker::routine_head(const Node& n) {
  const Id r = static_cast<Id>(out_.routines.size());
  const std::uint32_t kind = n.kind == N::procedure  ? RMP_ROUTINE_PROCEDURE
                             : n.kind == N::function ? RMP_ROUTINE_FUNCTION
                             : n.kind == N::process  ? RMP_ROUTINE_PROCESS
                                                     : RMP_ROUTINE_INTERRUPT;
  if (n.name == kNone) return;
  const Id symbol = declare(RMP_SYMBOL_ROUTINE, n, RMP_TYPE_VOID);
  if (symbol == kNone) return;
  out_.symbols[symbol].routine = r;
  const Id scope = new_scope(RMP_SCOPE_ROUTINE, scope_, written(n), span(n));
  out_.routines.push_back({kind, symbol, scope, static_cast<Id>(out_.symbols.size()), 0,
                           RMP_TYPE_VOID, kNone, kNone, kNone, 0, 0, 0, 0, 0, span(n)});
  calls_.emplace_back();
  const Id outer = scope_;
  Id result = RMP_TYPE_VOID, priority = kNone, condition = kNone;
  for (Id c = n.first; c != kNone; c = at(c).next) {
    const Node& x = at(c);
    if (x.kind == N::params) {
      scope_ = scope;
      routine_ = r;
      for (Id p = x.first; p != kNone; p = at(p).next) {
        scope_ = outer;
        const Id t = type(at(p).first);
        scope_ = scope;
        if (at(p).flag == RMP_MODE_IN &&
            (t == RMP_TYPE_FILE || t == RMP_TYPE_TEXT || t == RMP_TYPE_SEMAPHORE))
          fail(at(p), "a " + shown(t) + " cannot be copied", "Make it an INOUT parameter.");
        for (Id v = at(at(p).first).next; v != kNone; v = at(v).next) {
          const Id s = declare(RMP_SYMBOL_PARAMETER, at(v), t);
          if (s == kNone) continue;
          out_.symbols[s].mode = at(p).flag;
          ++out_.routines[r].parameter_count;
        }
      }
      scope_ = outer;
      routine_ = kNone;
    } else if (x.kind == N::result) {
      result = type(x.first);
      if (result == RMP_TYPE_FILE || result == RMP_TYPE_TEXT || result == RMP_TYPE_SEMAPHORE)
        fail(x, "a " + shown(result) + " cannot be copied or returned");
    } else if (x.kind == N::priority) {
      priority = convert(expression(x.first), RMP_TYPE_INT, at(x.first), "a priority");
    } else if (x.kind == N::condition) {
      condition = boolean(x.first, "WHEN");
    } else {
      break;
    }
  }
  out_.symbols[symbol].type = result;
  out_.routines[r].result = result;
  out_.routines[r].priority = priority;
  out_.routines[r].condition = condition;
}

void Checker::routine_body(const Node& n, Id r) {
  const Id outer = scope_;
  scope_ = out_.routines[r].scope;
  routine_ = r;
  gotos_.clear();
  labels_.clear();
  blocks_.clear();
  returns_ = 0;
  loops_ = 0;
  sections(n.first);
  for (Id c = n.first; c != kNone; c = at(c).next) {
    if (at(c).kind != N::block || depth_ != Depth::all) continue;
    const Id body = block(c);
    out_.routines[r].body = body;
    resolve_gotos();
    if (n.kind == N::function && !faults_.is_full()) {
      if (returns_ == 0)
        fail_name(n, "the function " + written(n) + " has no RETURN", "Such as: RETURN value;");
      else if (!always_returns(c))
        faults_.warning(s_->file, s_->tokens[n.name_token],
                        "the function " + written(n) + " may reach its end without a RETURN",
                        "That is an error at run time.");
    }
  }
  routine_ = kNone;
  scope_ = outer;
  is_cancelled_ = is_cancelled_ || progress_.cancelled();
}

// ---- types ----

Id Checker::add_type(const rmp_code_type& t) {
  std::uint64_t count = 1;
  if (t.kind == RMP_TYPE_ARRAY && t.element != kBad)
    count = slots_[t.element] * static_cast<std::uint64_t>(std::int64_t{t.upper} - t.lower + 1);
  if (t.kind == RMP_TYPE_RECORD) {
    count = 0;
    for (Id k = 0; k < t.field_count; ++k) {
      const Id f = out_.fields[t.first_field + k].type;
      count += f == kBad ? 1 : slots_[f];
    }
  }
  out_.types.push_back(t);
  slots_.push_back(count);
  return static_cast<Id>(out_.types.size() - 1);
}

Id Checker::array_of(Id element, std::int32_t lower, std::int32_t upper) {
  const std::string key =
      "a" + std::to_string(element) + "," + std::to_string(lower) + "," + std::to_string(upper);
  const auto [it, is_new] = structural_.try_emplace(key, 0);
  if (is_new) it->second = add_type({RMP_TYPE_ARRAY, 0, "", element, 0, 0, lower, upper, {}});
  return it->second;
}
Id Checker::list_of(Id element) {
  const auto [it, is_new] = structural_.try_emplace("l" + std::to_string(element), 0);
  if (is_new) it->second = add_type({RMP_TYPE_LIST, 0, "", element, 0, 0, 0, 0, {}});
  return it->second;
}

std::optional<std::int32_t> Checker::constant_int(Id n, const std::string& what) {
  const Id e = expression(n);
  if (type_of(e) == kBad) return std::nullopt;
  const rmp_code_constant* c = known(e);
  if (type_of(e) != RMP_TYPE_INT) {
    fail(at(n), what + " must be an INT, but this is " + shown(type_of(e)));
    return std::nullopt;
  }
  if (!c) {
    fail(at(n), what + " must be known before run time", "Use numbers and constants only.");
    return std::nullopt;
  }
  return static_cast<std::int32_t>(c->integer);
}

Id Checker::type(Id id) {
  const Node& n = at(id);
  switch (n.kind) {
    case N::bad: return kBad;
    case N::type_name: {
      const Id s = lookup(n.name);
      use(n, s);
      if (s == kNone) {
        fail_name(n, "there is no type " + written(n), suggestion(n.name));
        return kBad;
      }
      if (out_.symbols[s].kind != RMP_SYMBOL_TYPE) {
        fail_name(n, written(n) + " is not a type");
        return kBad;
      }
      return out_.symbols[s].type;
    }
    case N::type_list: {
      const Id element = type(n.first);
      if (element == RMP_TYPE_FILE || element == RMP_TYPE_TEXT || element == RMP_TYPE_SEMAPHORE) {
        fail(n, "a " + shown(element) + " cannot be copied or be an element of a list");
        return kBad;
      }
      return element == kBad ? kBad : list_of(element);
    }
    case N::type_array: {
      std::vector<std::pair<std::int32_t, std::int32_t>> bounds;
      Id b = n.first;
      bool is_bad = false;
      for (; at(b).kind == N::bounds; b = at(b).next) {
        const auto low = constant_int(at(b).first, "the bound of an array");
        const auto high = constant_int(at(at(b).first).next, "the bound of an array");
        if (!low || !high) {
          is_bad = true;
        } else if (*high < *low) {
          fail(at(b), "the upper bound " + std::to_string(*high) + " is below the lower one, " +
                          std::to_string(*low));
          is_bad = true;
        } else {
          bounds.emplace_back(*low, *high);
        }
      }
      Id t = type(b);
      if (is_bad || t == kBad) return kBad;
      for (auto it = bounds.rbegin(); it != bounds.rend(); ++it) {
        const auto length = static_cast<std::uint64_t>(std::int64_t{it->second} - it->first + 1);
        if (length > kMostSlots || length * slots(t) > kMostSlots) {
          fail(n, "this array holds more than " + std::to_string(kMostSlots) + " values");
          return kBad;
        }
        t = array_of(t, it->first, it->second);
      }
      return t;
    }
    default: return record(n);
  }
}

Id Checker::record(const Node& n) {
  // Types within come first, so that the fields of one record stand in a row.
  std::vector<rmp_code_field> fields;
  std::vector<Id> names;
  std::set<std::uint32_t> seen;
  std::uint64_t count = 0;
  for (Id d = n.first; d != kNone; d = at(d).next) {
    const Id t = type(at(d).first);
    if (t == RMP_TYPE_FILE || t == RMP_TYPE_TEXT || t == RMP_TYPE_SEMAPHORE)
      fail(at(d), "a " + shown(t) + " cannot be copied or be a field of a record");
    for (Id v = at(at(d).first).next; v != kNone; v = at(v).next) {
      if (at(v).first != kNone)
        fail(at(v), "a field cannot have an initial value",
             "Assign values to variables of the type.");
      if (!seen.insert(at(v).name).second)
        fail_name(at(v), "the record has a field " + written(at(v)) + " already");
      fields.push_back({out_.keep(written(at(v))), t, name_span(at(v))});
      names.push_back(at(v).name);
      count += t == kBad ? 1 : slots(t);
    }
  }
  if (fields.empty()) fail(n, "a record needs at least one field");
  if (count > kMostSlots) {
    fail(n, "this record holds more than " + std::to_string(kMostSlots) + " values");
    return kBad;
  }
  const Id first = static_cast<Id>(out_.fields.size());
  out_.fields.insert(out_.fields.end(), fields.begin(), fields.end());
  field_names_.insert(field_names_.end(), names.begin(), names.end());
  for (std::size_t k = 0; k < names.size(); ++k)
    field_at_.emplace(std::pair(first, names[k]), static_cast<Id>(k));
  Id row = first;
  for (Id d = n.first; d != kNone; d = at(d).next)
    for (Id v = at(at(d).first).next; v != kNone; v = at(v).next)
      use(at(v), row++, Use::field, true);
  return add_type(
      {RMP_TYPE_RECORD, 0, "", kBad, first, static_cast<Id>(fields.size()), 0, 0, span(n)});
}

}  // namespace robomosp::irl
