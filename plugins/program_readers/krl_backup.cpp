// SPDX-License-Identifier: Apache-2.0
#include "krl_backup.h"

#include <algorithm>
#include <array>

#include "readers.h"

namespace robomosp::readers {
namespace {

/// Words that the reader carries out itself, whatever the files have of that name.
bool is_known_word(const std::string& low) {
  return low == "bas" || low == "ir_stopm" || low == "opt_move" || low.starts_with("msg_") ||
         low.starts_with("$") || maker_word(MakerLanguage::krl, low).has_value();
}

/// Words of the language, which name nothing else.
bool is_keyword(std::string_view low) {
  static const std::set<std::string_view> kWords{
      "and",     "anin",   "anout",   "axis",      "b_and",     "b_exor",    "b_not",   "b_or",
      "bool",    "brake",  "c_dis",   "c_ori",     "c_ptp",     "c_spl",     "c_vel",   "ca",
      "case",    "char",   "circ",    "circ_rel",  "const",     "continue",  "decl",    "def",
      "default", "defdat", "deffct",  "delay",     "disable",   "distance",  "do",      "e3axis",
      "e3pos",   "e6axis", "e6pos",   "else",      "enable",    "end",       "enddat",  "endfct",
      "endfor",  "endif",  "endloop", "endspline", "endswitch", "endwhile",  "enum",    "exit",
      "exor",    "ext",    "extfct",  "false",     "for",       "frame",     "global",  "goto",
      "halt",    "if",     "import",  "in",        "int",       "interrupt", "is",      "lin",
      "lin_rel", "loop",   "not",     "off",       "on",        "or",        "out",     "path",
      "pos",     "prio",   "ptp",     "ptp_rel",   "public",    "pulse",     "real",    "repeat",
      "resume",  "return", "scirc",   "sec",       "signal",    "slin",      "spl",     "spline",
      "sptp",    "step",   "struc",   "switch",    "then",      "to",        "trigger", "true",
      "until",   "wait",   "when",    "while",     "with",      "sin",       "cos",     "tan",
      "acos",    "atan2",  "sqrt",    "abs",       "inv_pos",   "#base",     "#tool"};
  return kWords.contains(low);
}

/// Names that inline forms use by their number.
constexpr auto kFormNames =
    std::to_array<const char*>({"tool_data", "base_data", "def_vel_ptp", "def_vel_cp",
                                "def_vel_ori1", "def_apo_cptp", "def_apo_cdis", "def_apo_cvel"});

/// Names among tokens that are neither components nor fields of a structure; enumerators count and
/// follow a "#".
std::vector<bool> names_that_count(const std::vector<Token>& tokens) {
  std::vector<bool> out(tokens.size(), false);
  std::vector<bool> is_first;  // of each open brace: its next name is a component
  bool begins_line = true, is_structure = false;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const Token& t = tokens[i];
    if (t.kind == Tk::line) {
      is_first.clear();
      begins_line = true;
      is_structure = false;
      continue;
    }
    if (begins_line) {
      std::size_t k = i;
      while (k + 1 < tokens.size() && (tokens[k].low == "decl" || tokens[k].low == "global" ||
                                       tokens[k].low == "public" || tokens[k].low == "const"))
        ++k;
      is_structure = tokens[k].kind == Tk::name && tokens[k].low == "struc";
      begins_line = false;
    }
    if (t.low == "{") {
      is_first.push_back(true);
    } else if (t.low == "}") {
      if (!is_first.empty()) is_first.pop_back();
    } else if (t.low == "," && !is_first.empty()) {
      is_first.back() = true;
    } else if (t.kind == Tk::name) {
      const bool is_after_dot = i > 0 && tokens[i - 1].low == "." && tokens[i - 1].kind == Tk::sign;
      const std::string& next = i + 1 < tokens.size() ? tokens[i + 1].low : t.low;
      if (!is_first.empty() && is_first.back()) {
        // {FRAME: X 1}: a type, and then the component
        if (next == ":") {
          out[i] = true;
          ++i;
          continue;
        }
        is_first.back() = false;
        continue;
      }
      const bool is_field = is_structure && i > 0 && tokens[i - 1].low != "struc" &&
                            tokens[i - 1].low != "global" && tokens[i - 1].low != "[" &&
                            (next == "," || next == "[" || next == "\n");
      out[i] = !is_after_dot && !is_field;
    } else if (t.kind != Tk::line && !is_first.empty() && t.low != "[" && t.low != "]") {
      is_first.back() = false;
    }
  }
  return out;
}

class KrlNames final : public Reader {
 public:
  using Reader::Reader;
  void run() override {}

  KrlFile names() {
    scan(0, kKrlStyle);
    counts_ = names_that_count(tokens_);
    out_.module = lower(stem(files_[0].name));
    const std::string kind = extension(files_[0].name);
    out_.is_data = kind == "dat";
    out_.is_submit = kind == "sub";
    out_.is_config = out_.is_data && out_.module == "$config";
    while (!at_end()) {
      if (out_.is_data) data_line();
      else line();
      skip_line();
    }
    end_routine();
    // Values of what is global are global as well.
    std::set<std::string> global;
    for (const KrlDataLine& l : out_.lines)
      if (l.is_global) global.insert(l.declared.begin(), l.declared.end());
    for (KrlDataLine& l : out_.lines)
      l.is_global = l.is_global || (!l.declared.empty() && global.contains(l.declared[0]));
    return std::move(out_);
  }

 private:
  Ex primary() override { return failed(); }

  /// The names of the rest of a line, and signals such as "$out[3]".
  template <class Add>
  void each_name(Add add) {
    for (std::size_t i = at_; i < tokens_.size(); ++i) {
      const Token& t = tokens_[i];
      if (t.kind == Tk::line || t.kind == Tk::end) return;
      if (t.kind != Tk::name || !counts_[i]) continue;
      const bool is_enumerator = i > 0 && tokens_[i - 1].low == "#";
      add(is_enumerator ? "#" + t.low : t.low);
      if (t.raw.starts_with('$') && i + 2 < tokens_.size() && tokens_[i + 1].low == "[" &&
          tokens_[i + 2].kind == Tk::number)
        add(t.low + "[" + std::string(tokens_[i + 2].raw) + "]");
    }
  }
  /// Names that a line declares, without those of ENUM's values or with "#" before them.
  std::vector<std::string> declared() const {
    std::vector<std::string> out;
    std::size_t i = 0;
    while (is("decl", i) || is("global", i) || is("const", i) || is("public", i)) ++i;
    if (is("ext", i) || is("extfct", i) || is("extp", i) || is("extfctp", i) || is("import", i) ||
        is("defdat", i) || is("enddat", i) || is("&", i))
      return out;
    const bool is_enum = is("enum", i);
    if (is("signal", i) || is("struc", i) || is_enum) {
      ++i;
      while (is("global", i) || is("decl", i)) ++i;
      if (peek(i).kind == Tk::name) out.push_back(peek(i).low);
      for (++i; is_enum && peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i)
        if (peek(i).kind == Tk::name) out.push_back("#" + peek(i).low);
      return out;
    }
    if (peek(i).kind == Tk::name && peek(i + 1).kind == Tk::name) ++i;  // behind the type
    int depth = 0;
    for (bool is_next = true; peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i) {
      if (is("[", i) || is("{", i) || is("(", i)) ++depth;
      else if (is("]", i) || is("}", i) || is(")", i)) --depth;
      else if (depth == 0 && is(",", i)) is_next = true;
      else if (depth == 0 && is_next && peek(i).kind == Tk::name) {
        out.push_back(peek(i).low);
        is_next = false;
      }
    }
    return out;
  }
  void import(std::size_t i) {
    // IMPORT [DECL] type alias IS /R1/module..name
    KrlImport one;
    for (; peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i) {
      if (is("is", i + 1) && peek(i).kind == Tk::name) one.alias = peek(i).low;
      if (is(".", i + 1) && is(".", i + 2) && peek(i).kind == Tk::name) {
        one.module = peek(i).low;
        one.name = peek(i + 3).low;
      }
    }
    if (!one.alias.empty() && !one.module.empty()) out_.imports.push_back(std::move(one));
  }
  bool takes_import() {
    std::size_t i = 0;
    while (is("decl", i) || is("global", i)) ++i;
    if (!is("import", i)) return false;
    import(i);
    return true;
  }
  void data_line() {
    if (peek().kind == Tk::line || takes_import()) return;
    if (is("defdat")) {
      for (std::size_t i = 1; peek(i).kind == Tk::name; ++i)
        is_public_ = is_public_ || is("public", i);
      return;
    }
    KrlDataLine l;
    l.begin = here().begin;
    l.declared = declared();
    for (std::size_t i = 0; i < 4; ++i) l.is_global = l.is_global || is("global", i);
    l.is_global = out_.is_config || (l.is_global && is_public_);
    each_name([&](std::string n) { l.named.push_back(std::move(n)); });
    if (!l.declared.empty() || !l.named.empty()) out_.lines.push_back(std::move(l));
  }
  void end_routine() {
    if (out_.routines.empty()) return;
    KrlRoutine& r = out_.routines.back();
    if (r.end == 0) r.end = here().begin;
    for (const std::string& local : r.locals) r.used.erase(local);
  }
  void line() {
    const std::size_t from = at_;
    const std::uint32_t begin = here().begin;
    bool is_global = accept("global");
    if (is("def") || is("deffct")) {
      end_routine();
      const bool is_function = next().low == "deffct";
      is_global = accept("global") || is_global;
      if (is_function) {
        next();
        if (accept("["))
          while (!at_line_end() && !accept("]")) next();
      }
      KrlRoutine r;
      r.begin = begin;
      r.name = next().low;
      // The first routine of a file has the file's name, and all may call it.
      r.is_global = is_global || out_.routines.empty();
      for (std::size_t i = 0; peek(i).kind != Tk::line && peek(i).kind != Tk::end; ++i)
        if (peek(i).kind == Tk::name && (is("(", i - (i > 0)) || is(",", i - (i > 0))))
          r.locals.insert(peek(i).low);
      out_.routines.push_back(std::move(r));
      return;
    }
    at_ = from;
    if (takes_import() || out_.routines.empty()) return;
    KrlRoutine& r = out_.routines.back();
    if (is("end") || is("endfct")) {
      r.end = here().end;
      return;
    }
    const bool is_declaration = is("decl") || is("int") || is("real") || is("bool") || is("char") ||
                                is("frame") || is("pos") || is("e3pos") || is("e6pos") ||
                                is("axis") || is("e3axis") || is("e6axis") || is("signal") ||
                                is("struc") || is("enum") || (is_global && !is("interrupt", 1));
    if (is_declaration && peek(1).kind != Tk::sign)
      for (std::string& n : declared()) r.locals.insert(std::move(n));
    each_name([&](std::string n) { r.used.insert(std::move(n)); });
  }

  KrlFile out_;
  std::vector<bool> counts_;
  bool is_public_ = false;
};

KrlFile names_of(const SourceFile& file) {
  const SourceFile one[] = {file};
  Learned learned;
  NoParams params;
  NoProgress progress;
  return KrlNames(one, learned, params, progress).names();
}

}  // namespace

std::vector<std::string> krl_needs(const SourceFile& file) {
  const std::string kind = extension(file.name);
  if (kind != "src" && kind != "dat") return {};
  const KrlFile f = names_of(file);
  if (f.is_config) return {};
  std::vector<std::string> out;
  if (kind == "src") {
    out.push_back(std::string(stem(file.name)) + ".dat");
    out.insert(out.end(), {"System/$config.dat", "System/sps.sub"});
  }
  std::set<std::string> names, own;
  for (const KrlRoutine& r : f.routines) {
    own.insert(r.name);
    names.insert(r.used.begin(), r.used.end());
  }
  for (const KrlDataLine& l : f.lines) {
    own.insert(l.declared.begin(), l.declared.end());
    names.insert(l.named.begin(), l.named.end());
  }
  for (const std::string& n : names)
    if (!own.contains(n) && !is_known_word(n)) out.push_back("@" + n);
  for (const KrlImport& i : f.imports) out.push_back("@" + i.module + ".dat");
  return out;
}

std::vector<std::string> krl_offers(const SourceFile& file) {
  const KrlFile f = names_of(file);
  std::vector<std::string> out;
  if (f.is_submit || f.is_config) return out;
  for (const KrlRoutine& r : f.routines)
    if (r.is_global) out.push_back(r.name);
  for (const KrlDataLine& l : f.lines)
    if (l.is_global) out.insert(out.end(), l.declared.begin(), l.declared.end());
  if (f.is_data) out.push_back(f.module + ".dat");
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

KrlBackup::KrlBackup(std::span<const SourceFile> sources) {
  for (const SourceFile& s : sources) files_.push_back(names_of(s));
  used_lines_.resize(files_.size());
  std::map<std::string, int> numbers;
  for (std::size_t f = 0; f < files_.size(); ++f) {
    KrlFile& file = files_[f];
    const auto [it, is_new] = numbers.try_emplace(file.module, static_cast<int>(modules_.size()));
    if (is_new) modules_.push_back(file.module);
    module_of_.push_back(it->second);
    if (file.is_submit) continue;
    const int m = it->second;
    for (std::size_t i = 0; i < file.routines.size(); ++i) {
      routines_[{m, file.routines[i].name}].emplace_back(f, i);
      if (file.routines[i].is_global)
        routines_[{kGlobal, file.routines[i].name}].emplace_back(f, i);
    }
    for (std::size_t i = 0; i < file.lines.size(); ++i)
      for (const std::string& n : file.lines[i].declared) {
        lines_[{m, n}].emplace_back(f, i);
        if (file.lines[i].is_global) lines_[{kGlobal, n}].emplace_back(f, i);
      }
  }
  for (std::size_t f = 0; f < files_.size(); ++f)
    for (const KrlImport& i : files_[f].imports)
      if (const auto it = numbers.find(i.module); it != numbers.end())
        imports_[{module_of_[f], i.alias}] = {it->second, i.name};

  // What the program uses.
  std::deque<Scoped> open;
  for (std::size_t f = 0; f < files_.size(); ++f) {
    if (!is_own(f)) continue;
    for (const KrlRoutine& r : files_[f].routines) open.emplace_back(0, r.name);
    for (const KrlDataLine& l : files_[f].lines) {
      used_lines_[f].insert(l.begin);
      for (const std::string& n : l.named) open.emplace_back(0, n);
    }
  }
  while (!open.empty()) {
    const Scoped name = std::move(open.front());
    open.pop_front();
    follow(open, name);
  }

  // Who declares each name: the program first, then what is global.
  std::map<std::string, std::set<int>> owners;
  for (std::size_t f = 0; f < files_.size(); ++f) {
    // What a file keeps to itself is known as well, so that its use elsewhere is an error.
    for (const KrlRoutine& r : files_[f].routines) {
      if (files_[f].is_submit || (r.is_global && !used_routines_.contains({f, r.begin}))) continue;
      owners[r.name].insert(r.is_global ? kGlobal : module_of_[f]);
      if (r.is_global) global_module_.try_emplace(r.name, files_[f].module);
    }
    for (const KrlDataLine& l : files_[f].lines) {
      if (l.is_global && !used_lines_[f].contains(l.begin)) continue;
      for (const std::string& n : l.declared) {
        if (n.starts_with("#")) continue;
        owners[n].insert(l.is_global ? kGlobal : module_of_[f]);
        if (l.is_global) global_module_.try_emplace(n, files_[f].module);
      }
    }
  }
  if (!files_.empty() && !files_[0].routines.empty() && !files_[0].is_data) {
    const KrlRoutine& r = files_[0].routines[0];
    for (const std::string& n : r.locals) owners[n].insert(0);
    // Others may not take the name of the program.
    if (!r.name.empty()) owners[r.name].insert(kGlobal);
  }
  for (auto& [name, scopes] : owners) {
    std::vector<int>& list = owners_[name];
    if (scopes.contains(0)) list.push_back(0);
    if (scopes.contains(kGlobal)) list.push_back(kGlobal);
    for (const int s : scopes)
      if (s > 0) list.push_back(s);
  }
}

void KrlBackup::follow(std::deque<Scoped>& open, const Scoped& name) {
  if (is_known_word(name.second)) {
    used_names_.insert(name.second);
    // Inline forms name tools and bases by their number.
    if (name.second != "bas") return;
    for (const char* n : kFormNames) open.emplace_back(name.first, n);
    return;
  }
  if (!seen_.insert(name).second) return;
  used_names_.insert(name.second);
  if (name.second == "fdat_act" || name.second == "stool2" || name.second == "sbase")
    for (const char* n : kFormNames) open.emplace_back(name.first, n);
  if (const auto it = imports_.find(name); it != imports_.end()) {
    open.push_back(it->second);
    return;
  }
  for (const int scope : {name.first, kGlobal}) {
    const auto routine = routines_.find({scope, name.second});
    const auto line = lines_.find({scope, name.second});
    if (routine != routines_.end())
      for (const auto& [f, i] : routine->second) {
        const KrlRoutine& r = files_[f].routines[i];
        if (!used_routines_.emplace(f, r.begin).second) continue;
        for (const std::string& n : r.used) open.emplace_back(module_of_[f], n);
      }
    if (line != lines_.end())
      for (const auto& [f, i] : line->second) {
        const KrlDataLine& l = files_[f].lines[i];
        if (!used_lines_[f].insert(l.begin).second) continue;
        for (const std::string& n : l.named) open.emplace_back(module_of_[f], n);
      }
    if (routine != routines_.end() || line != lines_.end()) return;
  }
}

bool KrlBackup::is_used(std::size_t file, std::uint32_t begin) const {
  return is_own(file) || used_routines_.contains({file, begin});
}

std::string KrlBackup::canonical(int scope, const std::string& name) const {
  const auto it = owners_.find(name);
  if (it == owners_.end() || it->second.empty() || it->second.front() == scope) return name;
  if (scope != kGlobal) return name + "." + modules_[static_cast<std::size_t>(scope)];
  const auto module = global_module_.find(name);
  return name + "." + (module == global_module_.end() ? std::string("global") : module->second);
}

std::string KrlBackup::renamed(int module, const std::string& name) const {
  if (const auto import = imports_.find({module, name}); import != imports_.end()) {
    const auto& [from, old] = import->second;
    const auto declared = lines_.find({from, old});
    if (declared == lines_.end()) return name;
    const auto& [f, i] = declared->second.front();
    return canonical(files_[f].lines[i].is_global ? kGlobal : from, old);
  }
  const auto it = owners_.find(name);
  if (it == owners_.end()) return name;
  const std::vector<int>& scopes = it->second;
  const auto has = [&](int scope) {
    return std::find(scopes.begin(), scopes.end(), scope) != scopes.end();
  };
  const bool is_own =
      module == 0 ? lines_.contains({0, name}) || routines_.contains({0, name}) : has(module);
  if (is_own && has(module)) return canonical(module, name);
  if (has(kGlobal)) return canonical(kGlobal, name);
  if (has(module)) return name;
  // Another file has it for itself.
  return name + "." + modules_[static_cast<std::size_t>(module)];
}

const KrlRoutine* KrlBackup::routine_at(std::size_t file, std::uint32_t byte) const {
  const auto& all = files_[file].routines;
  const auto it =
      std::upper_bound(all.begin(), all.end(), byte,
                       [](std::uint32_t at, const KrlRoutine& r) { return at < r.begin; });
  if (it == all.begin()) return nullptr;
  const KrlRoutine& r = *std::prev(it);
  return byte < r.end ? &r : nullptr;
}

bool KrlBackup::is_in_used(std::size_t file, std::uint32_t byte) const {
  const KrlRoutine* r = routine_at(file, byte);
  return is_own(file) || (r && is_used(file, r->begin));
}

void KrlBackup::give_new_names(std::size_t file, std::vector<Token>& tokens) {
  if (files_.size() < 2) return;
  const std::vector<bool> counts = names_that_count(tokens);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    Token& t = tokens[i];
    if (t.kind != Tk::name || !counts[i] || t.raw.starts_with('$') ||
        (i > 0 && tokens[i - 1].low == "#") || is_keyword(t.low))
      continue;
    // Names that a routine declares are its own.
    if (const KrlRoutine* r = routine_at(file, t.at.begin); r && r->locals.contains(t.low))
      continue;
    const std::string name = renamed(module_of_[file], t.low);
    if (name == t.low) continue;
    // As it was written, with the file behind it.
    const std::string text =
        name.starts_with(t.low + ".") ? std::string(t.raw) + name.substr(t.low.size()) : name;
    auto it = interned_.find(text);
    if (it == interned_.end()) it = interned_.emplace(text, texts_.emplace_back(text)).first;
    t.raw = it->second;
    t.low = lower(t.raw);
  }
}

}  // namespace robomosp::readers
