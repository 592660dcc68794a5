// SPDX-License-Identifier: Apache-2.0
// Targets of motions that the program never gives a value, or gives only some components: the
// controller moves to what it has stored, or stops; zeros would be another place.
#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "reader.h"

namespace robomosp::readers {
namespace {

bool is_part_of_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
}
/// The names in a line of IRL; components behind a point are none.
std::set<std::string> names_in(std::string_view s) {
  std::set<std::string> out;
  for (std::size_t i = 0; i < s.size();) {
    if (s[i] == '\'') {
      i = std::min(s.find('\'', i + 1), s.size() - 1) + 1;
      continue;
    }
    if (!is_part_of_word(s[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < s.size() && is_part_of_word(s[end])) ++end;
    if (i == 0 || s[i - 1] != '.') out.emplace(s.substr(i, end - i));
    i = end;
  }
  return out;
}
/// A word of the source as IRL writes names: lower case, without "." within them.
std::string as_in_irl(std::string_view word) {
  std::string out = lower(word);
  for (char& c : out)
    if (!is_part_of_word(c)) c = '_';
  return out;
}
/// Without the number that IRL adds where names meet: "p_2" is the p of a part of the source.
std::string without_number(const std::string& name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  const bool has_one = last != std::string::npos && last + 1 < name.size() && name[last] == '_';
  return has_one ? name.substr(0, last) : name;
}
struct TargetGift {
  std::string to, part;  ///< "p", and "POS.X" or nothing
  std::set<std::string> from;
};
/// True if these components are all of a target: position and orientation, or every joint.
bool are_all(K kind, const std::vector<const TargetGift*>& gifts, int axes) {
  std::set<std::string> parts;
  int turns = 0;
  bool is_turned = false;
  for (const TargetGift* g : gifts) {
    std::string_view part = g->part;
    for (const std::string_view outer : {std::string_view("PSE."), std::string_view("M_JOINT.")})
      if (part.starts_with(outer)) part.remove_prefix(outer.size());
    if (part == "PSE" || part == "M_JOINT") return true;
    if (part == "ORI") {
      ++turns;
      // A, B and C of one name keep the others.
      is_turned = is_turned || turns >= 3 || !g->from.contains(g->to);
    }
    parts.emplace(part);
  }
  if (kind == K::joint) {
    for (int j = 1; j <= axes; ++j)
      if (!parts.contains("A" + std::to_string(j))) return false;
    return true;
  }
  const bool is_placed =
      parts.contains("POS") ||
      (parts.contains("POS.X") && parts.contains("POS.Y") && parts.contains("POS.Z"));
  return is_placed && is_turned;
}

}  // namespace

void Reader::check_targets() {
  if (unvalued_targets_.empty()) return;
  std::map<std::string, K> open;  // without a value yet
  for (const auto& [name, kind] : unvalued_targets_) open.emplace(name, kind);
  std::multimap<std::string, std::string> by_source;  // by the names that the source may have
  for (const auto& [name, kind] : open) {
    const std::string low = lower(name), bare = without_number(low);
    by_source.emplace(low, name);
    if (bare != low) by_source.emplace(bare, name);
  }
  const auto close_all = [&](std::string_view word) {
    const auto [from, to] = by_source.equal_range(as_in_irl(word));
    for (auto it = from; it != to; ++it) open.erase(it->second);
  };
  // What a reader reported itself: also places computed from it need no second error.
  for (const Fault& f : faults_)
    if (f.severity == RMP_FAULT_ERROR)
      close_all(std::string_view(f.message).substr(0, f.message.find(' ')));
  // Bodies with the names of their routine's head: its parameters are other variables.
  std::vector<std::pair<const std::vector<Line>*, std::set<std::string>>> bodies;
  bodies.emplace_back(&main_.body, std::set<std::string>{});
  std::set<std::string> givers = routine_names_;  // routines that may give an argument a value
  for (const Routine& r : routines_) {
    std::set<std::string> head = names_in(r.head);
    if (!head.contains("OUT") && !head.contains("INOUT"))
      for (const std::string& name : head) givers.erase(name);
    bodies.emplace_back(&r.body, std::move(head));
  }
  std::vector<TargetGift> gifts;
  std::vector<std::pair<const Line*, std::set<std::string>>> moves;
  for (const auto& [body, head] : bodies)
    for (const Line& l : *body) {
      // Without the marks of settings and the blanks before.
      std::string s;
      for (std::size_t i = 0; i < l.s.size(); ++i) {
        if (l.s[i] == kUseMark || l.s[i] == kChangeMark)
          i = std::min(l.s.find(kMarkEnd, i), l.s.size() - 1);
        else if (!s.empty() || l.s[i] != ' ') s += l.s[i];
      }
      if (s.starts_with("MOVE ") || s.starts_with("MOVE_INC ")) {
        const std::size_t end = std::min({s.find(" TOOL := "), s.find(" FRAME := "), s.size()});
        std::set<std::string> names = names_in(std::string_view(s).substr(0, end));
        std::erase_if(names, [&head](const std::string& n) { return head.contains(n); });
        moves.emplace_back(&l, std::move(names));
        continue;
      }
      const std::size_t begin = std::min(s.find_first_of("(;{: "), s.size());
      const std::size_t sign = s.find(" := ");
      std::set<std::string> from = names_in(s);
      std::erase_if(from, [&head](const std::string& n) { return head.contains(n); });
      const bool is_call = std::any_of(
          from.begin(), from.end(), [&](const std::string& name) { return givers.contains(name); });
      const std::string to = s.substr(0, begin);
      const bool is_gift = begin == sign && !to.empty();
      // A call may give it a value; a statement that is not read has its own error.
      if (s.starts_with('{')) {
        if (s.starts_with("{ not read"))
          for (const std::string& name : from) close_all(name);
        continue;
      }
      const bool is_condition = s.starts_with("IF ") || s.starts_with("ELSIF ") ||
                                s.starts_with("WHILE ") || s.starts_with("WAIT ") ||
                                s.starts_with("UNTIL ") || s.starts_with("WRITE");
      if (is_call || (!is_gift && !is_condition))
        for (const std::string& name : from) open.erase(name);
      const std::size_t dot = to.find('.');
      if (!is_gift || head.contains(to.substr(0, dot))) continue;
      gifts.push_back({to.substr(0, dot), dot == std::string::npos ? "" : to.substr(dot + 1),
                       names_in(std::string_view(s).substr(sign + 4))});
    }
  std::multimap<std::string, const TargetGift*> of;
  for (const TargetGift& g : gifts)
    if (open.contains(g.to)) of.emplace(g.to, &g);
  for (bool again = true; again;) {
    again = false;
    for (auto it = open.begin(); it != open.end();) {
      std::vector<const TargetGift*> parts;
      bool has_value = false;
      const auto [first, last] = of.equal_range(it->first);
      for (auto each = first; each != last; ++each) {
        const TargetGift& g = *each->second;
        const bool is_known = std::none_of(g.from.begin(), g.from.end(), [&](const std::string& n) {
          return open.contains(n) && (g.part.empty() || n != g.to);
        });
        if (!is_known) continue;
        if (g.part.empty()) has_value = true;
        else parts.push_back(&g);
      }
      has_value = has_value || are_all(it->second, parts, learned_.axes);
      again = again || has_value;
      it = has_value ? open.erase(it) : std::next(it);
    }
  }
  for (const auto& [line, names] : moves)
    for (const std::string& name : names) {
      const auto it = open.find(name);
      if (it == open.end()) continue;
      open.erase(it);
      const auto [first, last] = of.equal_range(name);
      const bool is_in_parts =
          std::any_of(first, last, [](const auto& each) { return !each.second->part.empty(); });
      fail(
          line->at,
          name + (is_in_parts
                      ? " gets only some of its components in the program; the others are zero here"
                      : " has no value in the program; it is zero here"),
          "Give it its value in the program, or read the file that stores it.");
    }
}

}  // namespace robomosp::readers
