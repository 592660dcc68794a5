// SPDX-License-Identifier: Apache-2.0
// Lines of the 2006 program: their words, what command they name, their arguments.
#include "ioci/core/classic.h"

#include <algorithm>
#include <cctype>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/core/handle_text.h"
#include "kernel/bare_numbers.h"
#include "kernel/check.h"
#include "kernel/messages.h"
#include "kernel/text.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

/// A word that lines of the 2006 program may have and that is no parameter here: whether it is
/// one, by itself and the word behind it, and what to say of it ("" = nothing).
struct Extra {
  std::string_view name;
  bool (*is_meant)(std::string_view word, std::string_view next);
  std::string (*note)(std::string_view word);
};

bool is_code(std::string_view word) { return word == "0" || word == "1"; }
bool is_plain(std::string_view word) {
  return !word.empty() && word.size() <= 40 &&
         std::all_of(word.begin(), word.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

constexpr std::string_view kTorqueFlag = "~torque_flag";
const Extra kExtras[] = {
    {"~time_delay",
     [](std::string_view w, std::string_view) {
       return same_word(w, "TIME_DELAY_ON") || same_word(w, "TIME_DELAY_OFF") || is_code(w);
     },
     [](std::string_view w) -> std::string {
       if (w == "0" || same_word(w, "TIME_DELAY_OFF")) return "";
       return "A run is computed at once and does not wait for the time it takes: " +
              std::string(w) +
              " changes nothing. recording.replay makes a page that plays the recording in its "
              "time.";
     }},
    {"~kine_type", [](std::string_view w, std::string_view) { return is_plain(w); },
     [](std::string_view w) {
       return "KineType " + std::string(w) +
              " chooses nothing: the recording holds positions (q), velocities (qd) and "
              "accelerations (qdd) of the joints.";
     }},
    {"~tau_option", [](std::string_view w, std::string_view) { return is_plain(w); },
     [](std::string_view w) {
       return "TauOption " + std::string(w) +
              " chooses nothing: the recording holds the torques in total (tau) and their parts "
              "(tau_gravity, tau_inertial, tau_velocity, tau_friction).";
     }},
    // 0 or 1 before a file, or at the end; in a list of torques a number follows.
    {kTorqueFlag,
     [](std::string_view w, std::string_view next) {
       return is_code(w) && (next.empty() || !text::read_real(next));
     },
     [](std::string_view) -> std::string { return ""; }},
};

const Extra* find_extra(std::string_view name) {
  for (const Extra& e : kExtras)
    if (e.name == name) return &e;
  return nullptr;
}

/// `tau` is a file of torques, not numbers or a recording: it has a folder or an extension.
bool is_file(std::string_view word) {
  return !word.empty() && word.front() != '{' && !text::read_real(word) &&
         word.find_first_of("./\\") != std::string_view::npos &&
         word.find(' ') == std::string_view::npos;
}

struct Slot {
  const ParamSpec* param = nullptr;  ///< null = `extra`
  const Extra* extra = nullptr;
};

/// What the words of a classic line say: arguments, and sentences on what changes nothing here.
struct Read {
  Map args;
  std::vector<std::string> notes;
};

/// Sixteen numbers row by row are a matrix, where six are a position and three angles.
std::optional<Value> matrix_of(std::span<const std::string> words) {
  constexpr std::size_t kCount = 16;
  if (words.size() < kCount) return std::nullopt;
  std::vector<double> numbers;
  for (const std::string& w : words.first(kCount)) {
    const auto x = text::read_real(w);
    if (!x) return std::nullopt;
    numbers.push_back(*x);
  }
  return Value(NumericArray(std::move(numbers), 4, 4));
}

/// A number, or one with its unit at it: 30, 30deg.
bool is_quantity(std::string_view word) {
  if (text::read_real(word)) return true;
  return !word.empty() && word.find('=') == std::string_view::npos &&
         (std::isdigit(static_cast<unsigned char>(word.front())) != 0 || word.front() == '-' ||
          word.front() == '+' || word.front() == '.');
}

/// Arguments of a classic line: `name=value` where `name` is a parameter, else by position. The
/// last parameter takes all words that are left when it is a list of numbers or a free text.
Result<Read> classic_arguments(const CommandSpec& spec, const ClassicSpelling& spelling,
                               std::span<const std::string> words, bool is_method) {
  std::vector<Slot> order;
  if (spelling.order) {
    for (const std::string& name : *spelling.order)
      if (const ParamSpec* p = find_param(spec.params, name)) order.push_back({p, nullptr});
      else if (const Extra* e = find_extra(name)) order.push_back({nullptr, e});
  } else {
    for (std::size_t i = is_method ? 1 : 0; i < spec.params.size(); ++i)
      order.push_back({&spec.params[i], nullptr});
  }
  Read out;
  Map& args = out.args;
  std::optional<bool> has_torques;  // by the torque flag
  for (const auto& [name, value] : spelling.fixed) args.set(name, value);
  std::size_t next = 0;
  for (std::size_t w = 0; w < words.size(); ++w) {
    const std::string& word = words[w];
    if (const auto equals = word.find('='); equals != std::string::npos && equals > 0)
      if (const std::string name = word.substr(0, equals); find_param(spec.params, name)) {
        args.set(name, word.substr(equals + 1));
        continue;
      }
    const auto is_passed = [&](const Slot& slot) {
      if (slot.param) return args.find(slot.param->name) != nullptr;
      return !slot.extra->is_meant(
          word, w + 1 < words.size() ? std::string_view(words[w + 1]) : std::string_view());
    };
    while (next < order.size() && is_passed(order[next])) ++next;
    if (next >= order.size())
      return error(ErrorCode::usage, "the word " + text::quote(word) + " is one argument too many",
                   "help(\"" + spec.name + "\") lists the arguments.", spec.name);
    if (const Extra* extra = order[next].extra) {
      if (extra->name == kTorqueFlag) has_torques = word == "1";
      if (std::string note = extra->note(word); !note.empty()) out.notes.push_back(std::move(note));
      ++next;
      continue;
    }
    const ParamSpec& p = *order[next].param;
    std::string value = word;
    const std::string_view type = plain_type(p.type);
    if (type == "pose")
      if (auto matrix = matrix_of(words.subspan(w))) {
        args.set(p.name, std::move(*matrix));
        w += 15;
        ++next;
        continue;
      }
    const bool many = p.name == "q" || p.name == "qd" || p.name == "tau" || type == "real[]" ||
                      type == "vec3" || type == "pose";
    if (many && (word.empty() || word.front() != '{')) {
      const std::size_t most = type == "vec3" ? 3 : type == "pose" ? 6 : words.size();
      std::size_t taken = 1;
      while (taken < most && is_quantity(word) && w + 1 < words.size() &&
             is_quantity(words[w + 1])) {
        value += " " + words[++w];
        ++taken;
      }
    }
    if (type == "enum")
      for (const std::string& c : p.choices)
        if (std::equal(c.begin(), c.end(), value.begin(), value.end(), [](char a, char b) {
              return std::tolower(static_cast<unsigned char>(a)) ==
                     std::tolower(static_cast<unsigned char>(b));
            }))
          value = c;
    if (type == "list") {
      List items;
      std::string_view inner = value;
      if (inner.size() >= 2 && inner.front() == '{' && inner.back() == '}')
        inner = inner.substr(1, inner.size() - 2);
      std::string blanks(inner);
      std::replace(blanks.begin(), blanks.end(), ',', ' ');
      RMP_TRY_ASSIGN(auto entries, split_classic(blanks));
      for (std::string& e : entries) items.emplace_back(std::move(e));
      args.set(p.name, std::move(items));
    } else {
      args.set(p.name, std::move(value));
    }
    ++next;
  }
  if (has_torques == true && !args.find("tau"))
    return error(ErrorCode::usage, "the torque flag is 1, but no torques are given",
                 "Give the torque file after it, or 0.", spec.name);
  if (has_torques == false && args.find("tau"))
    return error(ErrorCode::usage, "the torque flag is 0, but torques are given",
                 "Write 1, or leave the torques out.", spec.name);
  return out;
}

/// Lines of the original name robots and worlds that its library has; here they are loaded when
/// the document has nothing of that name.
std::optional<Kind> shipped_kind(const Application& app, const Session& session,
                                 const document::Snapshot& now, const CommandSpec& spec,
                                 const Map& args) {
  const Value* id = args.find("id");
  const std::string* name = id ? id->as_string() : nullptr;
  if (!name || spec.params.empty() || spec.params.front().name != "id" ||
      !spec.params.front().type.starts_with("ref:") || !session.may(Effect::files_read))
    return std::nullopt;
  const std::string_view kinds = std::string_view(spec.params.front().type).substr(4);
  if (kinds == "any" || handle_from_text(app.handle_kinds, *name)) return std::nullopt;
  std::optional<Kind> shipped;
  for (const Kind k : all_kinds()) {
    if (!kinds_include(kinds, to_string(k))) continue;
    if (now.find(k, *name)) return std::nullopt;
    if (!shipped && library_file(app, k, *name)) shipped = k;
  }
  return shipped;
}

bool is_method(const CommandSpec& spec) {
  return !spec.params.empty() && spec.params.front().name == "id";
}

ClassicSpelling spelling_of(const CommandSpec& spec, std::string_view noun,
                            std::string_view option) {
  const std::string words = std::string(noun) + (option.empty() ? "" : " ") + std::string(option);
  for (ClassicSpelling& s : classic_spellings(spec.classic))
    if (same_word(s.words, words)) return std::move(s);
  return {};
}

}  // namespace

std::vector<ClassicSpelling> classic_spellings(std::string_view classic) {
  std::vector<ClassicSpelling> out;
  for (const std::string_view one : text::split(classic, '|')) {
    const auto open = one.find('(');
    ClassicSpelling s;
    s.words = text::trim(one.substr(0, open));
    if (s.words.empty()) continue;
    if (open != std::string_view::npos) {
      s.order.emplace();
      const std::string_view inside = one.substr(open + 1, one.rfind(')') - open - 1);
      for (const std::string_view item : text::split(inside, ',')) {
        const std::string_view name = text::trim(item);
        if (const auto equals = name.find('='); equals != std::string_view::npos)
          s.fixed.emplace_back(name.substr(0, equals), name.substr(equals + 1));
        else if (!name.empty()) s.order->emplace_back(name);
      }
    }
    out.push_back(std::move(s));
  }
  return out;
}

std::string classic_usage(const ClassicSpelling& spelling, bool is_method) {
  std::vector<std::string_view> words = text::split(spelling.words, ' ');
  std::string out(words.front());
  if (is_method && words.size() > 1) out += " <id>";
  std::size_t first = 0;
  for (std::size_t i = 1; i < words.size(); ++i) {
    out += " " + std::string(words[i]);
    if (i == 1 && words[i] == "Link") {
      out += " <link>";
      first = 1;
    }
  }
  if (spelling.order)
    for (std::size_t i = first; i < spelling.order->size(); ++i) {
      const std::string& name = (*spelling.order)[i];
      out += name.starts_with('~') ? " [" + name.substr(1) + "]" : " <" + name + ">";
    }
  return out;
}

std::string_view without_prefix(std::string_view line) {
  for (const std::string_view prefix : {"IOIC::", "IOCI::"})
    if (line.size() > prefix.size() && same_word(line.substr(0, prefix.size()), prefix))
      return line.substr(prefix.size());
  return line;
}

Result<std::vector<std::string>> split_classic(std::string_view line) {
  std::vector<std::string> words;
  std::size_t at = 0;
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (at < line.size()) {
    if (blank(line[at])) {
      ++at;
      continue;
    }
    std::string word;
    const std::size_t start = at;
    if (line[at] == '"') {
      bool closed = false;
      for (++at; at < line.size() && !closed; ++at) {
        if (line[at] == '\\' && at + 1 < line.size() &&
            (line[at + 1] == '"' || line[at + 1] == '\\'))
          word += line[++at];
        else if (line[at] == '"') closed = true;
        else word += line[at];
      }
      if (!closed)
        return error(ErrorCode::syntax,
                     "the \" at column " + std::to_string(start + 1) + " is not closed",
                     "Add the closing \".");
    } else if (line[at] == '{') {
      std::size_t depth = 0;
      for (; at < line.size(); ++at) {
        if (line[at] == '{') ++depth;
        if (line[at] == '}' && --depth == 0) {
          ++at;
          break;
        }
      }
      if (depth != 0)
        return error(ErrorCode::syntax,
                     "the { at column " + std::to_string(start + 1) + " is not closed",
                     "Add the closing }.");
      word = std::string(line.substr(start, at - start));
    } else {
      // name={1 2} and name="a b" are one word.
      std::size_t depth = 0;
      bool quoted = false;
      for (; at < line.size() && (depth > 0 || quoted || !blank(line[at])); ++at) {
        const char c = line[at];
        if (c == '"') {
          quoted = !quoted;
          continue;
        }
        if (!quoted && c == '{') ++depth;
        if (!quoted && c == '}' && depth > 0) --depth;
        word += c;
      }
      if (quoted || depth > 0)
        return error(ErrorCode::syntax,
                     "the word at column " + std::to_string(start + 1) + " has an open " +
                         (quoted ? "\"" : "{"),
                     "Close it.");
    }
    words.push_back(std::move(word));
  }
  return words;
}

Result<Value> Application::dispatch_classic(Session& session, std::string_view line) {
  const NumbersAreTexts quiet;
  RMP_TRY_ASSIGN(auto words, split_classic(line));
  if (words.empty()) return Value();
  words[0] = std::string(without_prefix(words[0]));
  const auto run_loaded = [&](const CommandSpec& spec, Read read) -> Result<Value> {
    Map& args = read.args;
    const auto now = document.now();
    const auto shipped = shipped_kind(
        *this, session, session.transaction_ ? session.transaction_->now() : *now, spec, args);
    if (const Value* tau = args.find("tau");
        tau && tau->as_string() && is_file(*tau->as_string())) {
      RMP_TRY_ASSIGN(Value recorded, dispatch(session, "recording.load", {{"file", *tau}}));
      args.set("tau", std::move(recorded));
    }
    for (const std::string& note : read.notes)
      messages.post(Severity::info, "classic", note, "ioci");
    if (!shipped) return dispatch(session, spec, args);
    // The library knows names by other spellings too, so the record says which it is. A line that
    // is refused loads nothing.
    Value answer;
    RMP_TRY(transaction(session, std::string(line), [&]() -> Result<void> {
      RMP_TRY_ASSIGN(Value loaded, dispatch(session, std::string(to_string(*shipped)) + ".get",
                                            {{"name", *args.find("id")}}));
      args.set("id", std::move(loaded));
      RMP_TRY_ASSIGN(answer, dispatch(session, spec, args));
      return {};
    }));
    return answer;
  };
  // The table's own names work as well: `robot.fk pa10 {0 0 0}`.
  if (const CommandSpec* spec = commands.find(words[0])) {
    RMP_TRY_ASSIGN(Read read, classic_arguments(*spec, {}, std::span(words).subspan(1), false));
    return run_loaded(*spec, std::move(read));
  }
  const auto word = [&](std::size_t i) {
    return i < words.size() ? std::string_view(words[i]) : std::string_view();
  };
  // `PRobot pa10 Link 3 mGetLocal`: the number stands inside the option.
  if (words.size() >= 5 && same_word(words[2], "Link") &&
      commands.find_classic(words[0], "Link " + words[4])) {
    words[2] += " " + words[4];
    words.erase(words.begin() + 4);
  }
  struct Form {
    std::string option;
    std::size_t arguments;
    bool method;
  };
  const auto joined = [&](std::size_t first, std::size_t count) {
    std::string out;
    for (std::size_t i = first; i < first + count; ++i)
      out += (i > first ? " " : "") + std::string(word(i));
    return out;
  };
  const Form forms[] = {
      {joined(2, 3), 5, true},    // PRobot pa10 LLRL mJacobian Local
      {joined(2, 2), 4, true},    // PRobot pa10 LLRL FKine
      {joined(2, 1), 3, true},    // World cell LsPRobots
      {joined(1, 2), 3, false},   // of nouns that work on no record
      {joined(1, 1), 2, false},   // Worlds LsWorlds
      {std::string(), 1, false},  // ForceReDraw
  };
  for (const Form& form : forms) {
    if (form.arguments > words.size()) continue;
    const CommandSpec* spec = commands.find_classic(words[0], form.option);
    if (!spec || is_method(*spec) != form.method) continue;
    RMP_TRY_ASSIGN(Read read,
                   classic_arguments(*spec, spelling_of(*spec, words[0], form.option),
                                     std::span(words).subspan(form.arguments), form.method));
    if (form.method) read.args.set("id", words[1]);
    return run_loaded(*spec, std::move(read));
  }
  if (words.size() == 2 && commands.find_classic(words[0], words[1]))
    return error(ErrorCode::usage, words[0] + " " + words[1] + " lacks the name of its record",
                 "Write " + words[0] + " <name> " + words[1] + ".");
  if (commands.unknown_classic(words[0], word(2)).message.starts_with("there is no classic") &&
      words[0].find('.') != std::string::npos)
    return commands.unknown(words[0]);
  return commands.unknown_classic(words[0], words.size() > 2 ? word(2) : word(1));
}

}  // namespace robomosp::ioci
