// SPDX-License-Identifier: Apache-2.0
// Settings of a controller, such as its tool and its frame: which value each motion sees, by the
// flow of the IRL that was written.
#include <algorithm>
#include <cctype>
#include <string>
#include <unordered_map>

#include "reader.h"

namespace robomosp::readers {
namespace {

constexpr int kNoValue = -1, kManyValues = -2;
/// What a setting may hold at a place of the program.
struct Held {
  bool is_unset = false;    ///< the controller's own value
  bool is_callers = false;  ///< what the caller of the routine had
  int value = kNoValue;     ///< a constant by its number, kNoValue or kManyValues
  /// True if this changed.
  bool join(const Held& b) {
    const Held before = *this;
    is_unset |= b.is_unset;
    is_callers |= b.is_callers;
    if (value == kNoValue) value = b.value;
    else if (b.value != kNoValue && b.value != value) value = kManyValues;
    return is_unset != before.is_unset || is_callers != before.is_callers || value != before.value;
  }
};
struct FlowState {
  bool is_reached = false;
  std::vector<Held> held;
  bool join(const FlowState& b) {
    if (!b.is_reached) return false;
    if (!is_reached) {
      *this = b;
      return true;
    }
    bool is_changed = false;
    for (std::size_t i = 0; i < held.size(); ++i) is_changed |= held[i].join(b.held[i]);
    return is_changed;
  }
};

enum class FlowWord : std::uint8_t {
  use,
  change,
  call,
  start,
  if_,
  elsif,
  else_,
  endif,
  head,  ///< of WHILE and FOR
  loop,
  endloop,
  repeat,
  until,
  exit,
  case_,
  when,
  default_,
  endcase,
  jump,
  label,
  leave
};
struct FlowStep {
  FlowWord word;
  std::size_t what = 0;  ///< number of the use, change, routine or label
};
struct FlowRoutine {
  std::vector<FlowStep> steps;
  bool is_apart = false;  ///< runs beside the others: an interrupt or a process
  bool is_called = false;
  std::vector<FlowState> at_step;  ///< of loops and calls
  std::vector<FlowState> at_label;
  FlowState end;
  std::vector<Held> entry;  ///< what its callers had, joined
};

/// Keywords of IRL that steer the flow, and the step that each makes.
const std::unordered_map<std::string, FlowWord>& flow_words() {
  static const std::unordered_map<std::string, FlowWord> kWords{
      {"IF", FlowWord::if_},           {"ELSIF", FlowWord::elsif},     {"ELSE", FlowWord::else_},
      {"ENDIF", FlowWord::endif},      {"WHILE", FlowWord::head},      {"FOR", FlowWord::head},
      {"ENDWHILE", FlowWord::endloop}, {"ENDFOR", FlowWord::endloop},  {"LOOP", FlowWord::loop},
      {"ENDLOOP", FlowWord::endloop},  {"REPEAT", FlowWord::repeat},   {"UNTIL", FlowWord::until},
      {"EXIT", FlowWord::exit},        {"CASE", FlowWord::case_},      {"WHEN", FlowWord::when},
      {"DEFAULT", FlowWord::default_}, {"ENDCASE", FlowWord::endcase}, {"RETURN", FlowWord::leave},
      {"HALT", FlowWord::leave}};
  return kWords;
}

/// The flow of the program's settings: of each step what may be set, for any caller, and then what
/// the callers had.
class SettingFlow {
 public:
  SettingFlow(std::size_t settings, std::size_t uses) : settings_(settings), seen_(uses) {}
  std::vector<FlowRoutine> routines;
  struct Change {
    std::size_t setting = 0;
    int value = kManyValues;
    bool is_part = false, is_unset = false;
  };
  std::vector<Change> changes;
  std::vector<std::size_t> setting_of_use;
  /// What a use may see; is_reached apart.
  struct Seen {
    bool is_reached = false;
    Held held;
  };

  std::vector<Seen> solve(const std::vector<Held>& at_start) {
    for (FlowRoutine& r : routines) {
      r.at_step.assign(r.steps.size(), {});
      r.end = {};
      r.entry.assign(settings_, {});
    }
    for (int round = 0; round < 64; ++round) {
      is_changed_ = false;
      for (FlowRoutine& r : routines) walk(r);
      if (!is_changed_) break;
    }
    if (is_changed_) {  // not known: nothing is a constant
      for (Seen& s : seen_) s = {true, {true, false, kManyValues}};
      return seen_;
    }
    for (FlowRoutine& r : routines)
      for (const FlowStep& s : r.steps)
        if (s.word == FlowWord::call || s.word == FlowWord::start)
          routines[s.what].is_called = true;
    // What routines that run beside the others set may be set at any time.
    std::vector<Held> beside(settings_);
    for (std::size_t i = 0; i < routines.size(); ++i)
      if (routines[i].is_apart) collect(i, beside);
    std::vector<Held> all(settings_);
    for (const Change& c : changes) all[c.setting].join(what(c));
    routines[0].entry = at_start;
    for (std::size_t i = 1; i < routines.size(); ++i) {
      if (!routines[i].is_called) routines[i].entry = at_start;  // somebody else calls it
      if (routines[i].is_apart)
        for (std::size_t k = 0; k < settings_; ++k) routines[i].entry[k].join(all[k]);
    }
    for (bool again = true; again;) {
      again = false;
      for (FlowRoutine& r : routines)
        for (std::size_t i = 0; i < r.steps.size(); ++i) {
          const FlowStep& s = r.steps[i];
          if ((s.word != FlowWord::call && s.word != FlowWord::start) || !r.at_step[i].is_reached)
            continue;
          for (std::size_t k = 0; k < settings_; ++k)
            again |= routines[s.what].entry[k].join(resolved(r, r.at_step[i].held[k], k));
        }
    }
    for (FlowRoutine& r : routines)
      for (std::size_t i = 0; i < r.steps.size(); ++i) {
        if (r.steps[i].word != FlowWord::use || !r.at_step[i].is_reached) continue;
        const std::size_t k = setting_of_use[r.steps[i].what];
        Held h = resolved(r, r.at_step[i].held[k], k);
        h.join(beside[k]);
        seen_[r.steps[i].what] = {true, h};
      }
    return seen_;
  }

 private:
  static Held what(const Change& c) {
    return c.is_unset ? Held{true, false, kNoValue} : Held{false, false, c.value};
  }
  static Held resolved(const FlowRoutine& r, Held h, std::size_t setting) {
    if (h.is_callers) {
      h.is_callers = false;
      h.join(r.entry[setting]);
    }
    return h;
  }
  void collect(std::size_t routine, std::vector<Held>& into) {
    std::vector<std::size_t> open{routine};
    std::vector<bool> done(routines.size());
    while (!open.empty()) {
      const std::size_t i = open.back();
      open.pop_back();
      if (done[i]) continue;
      done[i] = true;
      for (const FlowStep& s : routines[i].steps) {
        if (s.word == FlowWord::call) open.push_back(s.what);
        if (s.word == FlowWord::change) into[changes[s.what].setting].join(what(changes[s.what]));
      }
    }
  }
  void keep(FlowState& at, const FlowState& s) { is_changed_ |= at.join(s); }
  void walk(FlowRoutine& r) {
    struct Open {
      FlowState entry, out;
      std::size_t step = 0;
      FlowWord word = FlowWord::if_;
      bool has_else = false, has_arm = false;
    };
    std::vector<Open> open;
    FlowState now;
    now.is_reached = true;
    now.held.assign(settings_, {false, true, kNoValue});
    const auto is_loop = [](const Open& o) {
      return o.word == FlowWord::head || o.word == FlowWord::loop || o.word == FlowWord::repeat;
    };
    for (std::size_t i = 0; i < r.steps.size(); ++i) {
      const FlowStep& s = r.steps[i];
      switch (s.word) {
        case FlowWord::use:
        case FlowWord::start: keep(r.at_step[i], now); break;
        case FlowWord::change: {
          if (!now.is_reached) break;
          Held& h = now.held[changes[s.what].setting];
          if (changes[s.what].is_unset) h = {true, false, kNoValue};
          else if (changes[s.what].is_part) h.join({false, false, kManyValues});
          else h = {false, false, changes[s.what].value};
          break;
        }
        case FlowWord::call: {
          keep(r.at_step[i], now);
          const FlowState& end = routines[s.what].end;
          if (!now.is_reached) break;
          if (!end.is_reached) {  // not known yet, or it never comes back
            now = {};
            break;
          }
          for (std::size_t k = 0; k < settings_; ++k) {
            Held h = end.held[k];
            if (std::exchange(h.is_callers, false)) h.join(now.held[k]);
            now.held[k] = h;
          }
          break;
        }
        case FlowWord::if_:
        case FlowWord::case_: open.push_back({now, {}, i, s.word, false, false}); break;
        case FlowWord::elsif:
        case FlowWord::when:
        case FlowWord::else_:
        case FlowWord::default_:
          if (open.empty() || is_loop(open.back())) break;
          // Nothing is between CASE and its first arm.
          if (open.back().word == FlowWord::if_ || open.back().has_arm) open.back().out.join(now);
          open.back().has_arm = true;
          open.back().has_else |= s.word == FlowWord::else_ || s.word == FlowWord::default_;
          now = open.back().entry;
          break;
        case FlowWord::endif:
        case FlowWord::endcase: {
          if (open.empty() || is_loop(open.back())) break;
          FlowState out = std::move(open.back().out);
          out.join(now);
          if (!open.back().has_else) out.join(open.back().entry);
          now = std::move(out);
          open.pop_back();
          break;
        }
        case FlowWord::head:
        case FlowWord::loop:
        case FlowWord::repeat:
          keep(r.at_step[i], now);
          now = r.at_step[i];
          open.push_back({now, {}, i, s.word, false, false});
          break;
        case FlowWord::endloop:
        case FlowWord::until: {
          if (open.empty() || !is_loop(open.back())) break;
          Open o = std::move(open.back());
          open.pop_back();
          keep(r.at_step[o.step], now);
          if (s.word == FlowWord::until) o.out.join(now);
          else if (o.word == FlowWord::head) o.out.join(r.at_step[o.step]);
          now = std::move(o.out);
          break;
        }
        case FlowWord::exit:
          for (std::size_t k = open.size(); k-- > 0;)
            if (is_loop(open[k])) {
              open[k].out.join(now);
              break;
            }
          now = {};
          break;
        case FlowWord::jump:
          keep(r.at_label[s.what], now);
          now = {};
          break;
        case FlowWord::label:
          keep(r.at_label[s.what], now);
          now = r.at_label[s.what];
          break;
        case FlowWord::leave:
          keep(r.end, now);
          now = {};
          break;
      }
    }
    keep(r.end, now);
  }

  std::size_t settings_;
  bool is_changed_ = false;
  std::vector<Seen> seen_;
};

/// Steps of the lines of a routine's body.
class FlowScanner {
 public:
  FlowScanner(FlowRoutine& to, const std::unordered_map<std::string, std::size_t>& names,
              const std::vector<bool>& are_apart)
      : to_(to), names_(names), are_apart_(are_apart) {}
  void line(std::string_view s) {
    for (std::size_t i = 0; i < s.size();) {
      const char c = s[i];
      if (c == '{') {
        while (i < s.size() && s[i] != '}') ++i;
        ++i;
      } else if (c == '\'') {
        ++i;
        while (i < s.size() && s[i] != '\'') ++i;
        ++i;
      } else if (c == kUseMark || c == kChangeMark) {
        std::size_t n = 0;
        for (++i; i < s.size() && s[i] != kMarkEnd; ++i)
          n = n * 10 + static_cast<std::size_t>(s[i] - '0');
        ++i;
        add({c == kUseMark ? FlowWord::use : FlowWord::change, n});
      } else if (std::isalpha(static_cast<unsigned char>(c))) {
        std::size_t end = i;
        while (end < s.size() &&
               (std::isalnum(static_cast<unsigned char>(s[end])) || s[end] == '_'))
          ++end;
        word(std::string(s.substr(i, end - i)), i > 0 && s[i - 1] == '.');
        i = end;
      } else {
        if (c == ';') statement_.clear();
        ++i;
      }
    }
  }

 private:
  void word(std::string w, bool is_component) {
    if (is_component) return;
    if (statement_ == "GOTO" || statement_ == "LABEL") {
      const auto [it, is_new] = labels_.try_emplace(lower(w), labels_.size());
      if (is_new) to_.at_label.emplace_back();
      to_.steps.push_back({statement_ == "GOTO" ? FlowWord::jump : FlowWord::label, it->second});
      statement_.clear();
      return;
    }
    if (w == "GOTO" || w == "LABEL" || w == "MOVE" || w == "MOVE_INC" || w == "WAIT") {
      statement_ = w;
      return;
    }
    const auto found = flow_words().find(w);
    if (found != flow_words().end()) {
      // WAIT FOR and UNTIL of a motion are no loops; RETURN leaves behind its value.
      if ((w == "FOR" && statement_ == "WAIT") ||
          (w == "UNTIL" && (statement_ == "MOVE" || statement_ == "MOVE_INC")))
        return;
      to_.steps.push_back({found->second, 0});
      return;
    }
    const auto routine = names_.find(lower(w));
    if (routine == names_.end()) return;
    const bool is_apart = are_apart_[routine->second];
    add({is_apart ? FlowWord::start : FlowWord::call, routine->second});
  }
  /// The value of RETURN is computed before it leaves.
  void add(const FlowStep& s) {
    const bool leaves = !to_.steps.empty() && to_.steps.back().word == FlowWord::leave;
    to_.steps.insert(to_.steps.end() - (leaves ? 1 : 0), s);
  }

  FlowRoutine& to_;
  const std::unordered_map<std::string, std::size_t>& names_;
  const std::vector<bool>& are_apart_;
  std::unordered_map<std::string, std::size_t> labels_;
  std::string statement_;
};

/// Whether `inner` is within the blocks `outer`.
bool is_within(const std::vector<int>& outer, const std::vector<int>& inner) {
  return outer.size() <= inner.size() && std::equal(outer.begin(), outer.end(), inner.begin());
}

}  // namespace

void Reader::check_jumps() {
  const auto check = [&](std::vector<Line>& body) {
    FlowRoutine flow;
    const std::unordered_map<std::string, std::size_t> none;
    const std::vector<bool> no_routines;
    FlowScanner scanner(flow, none, no_routines);
    struct Place {
      std::size_t line;
      std::vector<int> blocks;
    };
    std::map<std::size_t, Place> labels;
    std::vector<std::pair<std::size_t, Place>> jumps;
    std::vector<int> blocks;
    int count = 0;
    for (std::size_t i = 0; i < body.size(); ++i) {
      const std::size_t from = flow.steps.size();
      scanner.line(body[i].s);
      for (std::size_t k = from; k < flow.steps.size(); ++k) switch (flow.steps[k].word) {
          case FlowWord::if_:
          case FlowWord::head:
          case FlowWord::loop:
          case FlowWord::repeat:
          case FlowWord::case_: blocks.push_back(++count); break;
          case FlowWord::elsif:
          case FlowWord::else_:
          case FlowWord::when:
          case FlowWord::default_:
            if (!blocks.empty()) blocks.back() = ++count;
            break;
          case FlowWord::endif:
          case FlowWord::endloop:
          case FlowWord::until:
          case FlowWord::endcase:
            if (!blocks.empty()) blocks.pop_back();
            break;
          case FlowWord::label:
            labels.insert_or_assign(flow.steps[k].what, Place{i, blocks});
            break;
          case FlowWord::jump: jumps.emplace_back(flow.steps[k].what, Place{i, blocks}); break;
          default: break;
        }
    }
    for (const auto& [name, jump] : jumps) {
      const auto label = labels.find(name);
      if (label != labels.end() && is_within(label->second.blocks, jump.blocks)) continue;
      Line& l = body[jump.line];
      fail(l.at,
           label == labels.end() ? "the label of this jump is not in the same routine"
                                 : "this jump leads into a block from outside, which IRL rejects",
           "Put the label before the block.");
      l.s = std::string(std::min(l.s.find_first_not_of(' '), l.s.size()), ' ') +
            "{ not read: " + source_line(l.at) + " }";
    }
  };
  check(main_.body);
  for (Routine& r : routines_) check(r.body);
}

std::string Reader::setting_name(const std::string& key) const {
  std::string s = "the " + key;
  std::replace(s.begin(), s.end(), '_', ' ');
  return s;
}

void Reader::settle() {
  check_jumps();
  check_targets();
  learned_.constant_settings.clear();
  learned_.unset_uses.clear();
  learned_.known_uses.clear();
  std::map<std::string, std::size_t> numbers;
  std::vector<std::string> keys;
  for (const SettingChange& c : changes_)
    if (numbers.try_emplace(c.key, keys.size()).second) keys.push_back(c.key);
  std::set<std::string> nowhere;
  for (const SettingUse& u : uses_of_settings_)
    if (!u.is_left_out && u.is_relevant && !numbers.contains(u.key) && !at_start_.contains(u.key) &&
        nowhere.insert(u.key).second)
      fail(u.at,
           setting_name(u.key) +
               " is not set in the program; zero is used instead of the controller's value",
           "Set it at the start of the program.");
  if (changes_.empty()) return;
  // Constants by number, one row a setting.
  std::vector<std::vector<std::string>> texts(keys.size());
  const auto number_of = [&](std::size_t setting, const std::string& text) {
    auto& all = texts[setting];
    const auto it = std::find(all.begin(), all.end(), text);
    if (it != all.end()) return static_cast<int>(it - all.begin());
    if (all.size() >= 64) return kManyValues;
    all.push_back(text);
    return static_cast<int>(all.size()) - 1;
  };
  SettingFlow flow(keys.size(), uses_of_settings_.size());
  for (const SettingChange& c : changes_) {
    const std::size_t k = numbers[c.key];
    flow.changes.push_back(
        {k, c.is_constant ? number_of(k, c.text) : kManyValues, c.is_part, c.is_unset});
  }
  for (const SettingUse& u : uses_of_settings_) {
    const auto it = numbers.find(u.key);
    flow.setting_of_use.push_back(it == numbers.end() ? keys.size() : it->second);
  }
  std::vector<Held> at_start(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const auto it = at_start_.find(keys[k]);
    if (it == at_start_.end()) at_start[k].is_unset = true;
    else at_start[k].value = number_of(k, it->second);
  }
  // The program first, then its routines by the name that is called.
  std::unordered_map<std::string, std::size_t> names;
  std::vector<bool> are_apart{false};
  for (const Routine& r : routines_) {
    const std::size_t b = r.head.find(' ');
    const std::size_t e = r.head.find_first_of(" (", b == std::string::npos ? b : b + 1);
    if (b != std::string::npos) names[lower(r.head.substr(b + 1, e - b - 1))] = are_apart.size();
    are_apart.push_back(r.end == "ENDINTERRUPT" || r.end == "ENDPROCESS");
  }
  flow.routines.resize(are_apart.size());
  const auto scan_body = [&](const std::vector<Line>& body, FlowRoutine& to) {
    FlowScanner scanner(to, names, are_apart);
    for (const Line& l : body) scanner.line(l.s);
  };
  scan_body(main_.body, flow.routines[0]);
  for (std::size_t i = 0; i < routines_.size(); ++i) {
    flow.routines[i + 1].is_apart = are_apart[i + 1];
    scan_body(routines_[i].body, flow.routines[i + 1]);
  }
  // Uses of what is never set are no steps.
  for (FlowRoutine& r : flow.routines)
    std::erase_if(r.steps, [&](const FlowStep& s) {
      return s.word == FlowWord::use && flow.setting_of_use[s.what] == keys.size();
    });
  const auto seen = flow.solve(at_start);

  std::vector<int> value(keys.size(), kNoValue);
  std::vector<bool> is_one(keys.size(), true);
  for (const SettingFlow::Change& c : flow.changes)
    if (!c.is_unset && (c.is_part || c.value < 0)) is_one[c.setting] = false;
  std::set<std::pair<std::size_t, std::uint32_t>> reported;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SettingUse& u = uses_of_settings_[i];
    const std::size_t k = flow.setting_of_use[i];
    if (k == keys.size() || !seen[i].is_reached) continue;
    const Held& h = seen[i].held;
    const bool is_never = h.is_unset && h.value == kNoValue;
    if (is_never) learned_.unset_uses.emplace(u.key, u.at.file, u.at.begin);
    if (h.is_unset && u.is_relevant) {
      if (!is_never || !u.is_left_out) is_one[k] = false;
      if (reported.emplace(k, is_never).second)
        fail(u.at,
             setting_name(u.key) +
                 (is_never ? " is not set before this point: here the controller's value applies"
                           : " is not set on every path to this point; zero is used otherwise"),
             "Set it at the start of the program.");
    }
    if (h.value >= 0 && !h.is_unset)
      learned_.known_uses[{u.key, u.at.file, u.at.begin}] =
          texts[k][static_cast<std::size_t>(h.value)];
    if (h.value == kManyValues) is_one[k] = false;
    else if (h.value != kNoValue) {
      if (value[k] != kNoValue && value[k] != h.value) is_one[k] = false;
      value[k] = h.value;
    }
  }
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (!is_one[k]) continue;
    // Without a use any value does, where there is one only.
    if (value[k] == kNoValue && texts[k].size() != 1) continue;
    learned_.constant_settings[keys[k]] = texts[k][static_cast<std::size_t>(std::max(value[k], 0))];
  }
}

}  // namespace robomosp::readers
