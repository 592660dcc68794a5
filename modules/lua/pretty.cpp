// SPDX-License-Identifier: Apache-2.0
#include "lua/pretty.h"

#include <algorithm>
#include <vector>

#include "kernel/text.h"
#include "lua/terminal_text.h"

namespace robomosp::lua {
namespace {

// Values come from commands and from Lua tables, whose depth the conversion bounds; deeper ones
// are shown as their one-line text.
constexpr int kDeepest = 32;

std::string with_unit(std::string text, std::string_view unit) {
  if (!unit.empty() && unit != "1") {
    text += ' ';
    text += unit;
  }
  return text;
}

/// Indices of 0..count-1 to show; the gap of a shortened list is marked by `count`.
std::vector<std::size_t> shown_rows(std::size_t count, std::size_t most) {
  std::vector<std::size_t> out;
  if (count <= most) {
    for (std::size_t i = 0; i < count; ++i) out.push_back(i);
    return out;
  }
  const std::size_t tail = most / 4, head = most - tail;
  for (std::size_t i = 0; i < head; ++i) out.push_back(i);
  out.push_back(count);
  for (std::size_t i = count - tail; i < count; ++i) out.push_back(i);
  return out;
}

void pad(std::string& out, std::size_t used, std::size_t wanted) {
  if (used < wanted) out.append(wanted - used, ' ');
}

std::string indented(std::string_view text, std::size_t by) {
  std::string out;
  for (const char c : text) {
    out += c;
    if (c == '\n') out.append(by, ' ');
  }
  return out;
}

bool is_identifier(std::string_view s) {
  if (s.empty() || (s[0] >= '0' && s[0] <= '9')) return false;
  return std::all_of(s.begin(), s.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

class Printer {
 public:
  Printer(const DescribeHandle& describe, const PrettyStyle& style)
      : describe_(describe), style_(style) {}

  /// `room`: characters there are beside what stands before it.
  std::string print(const Value& v, std::string_view unit, const std::vector<ParamSpec>* fields,
                    int depth, std::size_t room) const {
    if (depth > kDeepest) return v.text();
    if (v.is_number()) return with_unit(number(v), unit);
    if (const NumericArray* a = v.as_array())
      return pretty_array(*a, a->unit().empty() ? unit : a->unit(), within(room));
    if (const Handle* h = v.as_handle()) return describe_(*h);
    if (const std::string* s = v.as_string()) return depth == 0 ? *s : text::quote(*s);
    if (const Map* m = v.as_map()) return print_map(*m, fields, depth, room);
    if (const List* l = v.as_list()) return print_list(*l, unit, fields, depth, room);
    return v.text();
  }

 private:
  static constexpr std::size_t kLeastRoom = 20;

  PrettyStyle within(std::size_t room) const {
    PrettyStyle out = style_;
    out.width = room;
    return out;
  }
  static std::size_t less(std::size_t room, std::size_t by) {
    return room > by + kLeastRoom ? room - by : kLeastRoom;
  }

  std::string number(const Value& v) const {
    if (const std::int64_t* i = v.as_int()) return std::to_string(*i);
    return text::print_rounded(v.number(), style_.digits);
  }

  static const ParamSpec* field(const std::vector<ParamSpec>* fields, std::string_view name) {
    return fields ? find_param(*fields, name) : nullptr;
  }

  /// Keys of a map: those of the return's fields in their order, then the rest as they come.
  static std::vector<const Map::Entry*> ordered(const Map& m,
                                                const std::vector<ParamSpec>* fields) {
    std::vector<const Map::Entry*> out;
    if (fields)
      for (const ParamSpec& f : *fields)
        for (const Map::Entry& e : m)
          if (e.first == f.name) out.push_back(&e);
    for (const Map::Entry& e : m)
      if (!field(fields, e.first)) out.push_back(&e);
    return out;
  }

  std::string print_map(const Map& m, const std::vector<ParamSpec>* fields, int depth,
                        std::size_t room) const {
    if (m.empty()) return "{}";
    const auto entries = ordered(m, fields);
    std::size_t widest = 0;
    for (const Map::Entry* e : entries) widest = std::max(widest, width_of(e->first));
    widest = std::min<std::size_t>(widest, 24);
    std::string out;
    for (const Map::Entry* e : entries) {
      const ParamSpec* f = field(fields, e->first);
      std::string key = is_identifier(e->first) ? e->first : "[" + text::quote(e->first) + "]";
      pad(key, width_of(key), widest);
      key += " = ";
      const bool is_nested = e->second.as_map() && !e->second.as_map()->empty();
      const std::string body = print(e->second, f ? std::string_view(f->unit) : std::string_view(),
                                     nullptr, depth + 1, less(room, is_nested ? 2 : width_of(key)));
      if (!out.empty()) out += '\n';
      if (is_nested) {
        out += e->first + ":\n  " + indented(body, 2);
      } else {
        out += key + indented(body, width_of(key));
      }
    }
    return out;
  }

  /// A list of maps as a table with one column a field.
  std::string print_table(const List& rows, const std::vector<ParamSpec>* fields,
                          std::size_t width) const {
    std::vector<std::string> names;
    if (fields)
      for (const ParamSpec& f : *fields) names.push_back(f.name);
    for (const Value& row : rows)
      for (const Map::Entry& e : *row.as_map())
        if (std::find(names.begin(), names.end(), e.first) == names.end()) names.push_back(e.first);
    std::erase_if(names, [&](const std::string& n) {
      return std::none_of(rows.begin(), rows.end(),
                          [&](const Value& r) { return r.as_map()->find(n) != nullptr; });
    });

    const std::size_t visible = std::min(rows.size(), style_.most_items);
    std::vector<std::vector<std::string>> cells(visible + 1);
    std::vector<bool> right;
    for (const std::string& n : names) {
      const ParamSpec* f = field(fields, n);
      cells[0].push_back(f && !f->unit.empty() && f->unit != "1" ? n + " [" + f->unit + "]" : n);
      right.push_back(std::all_of(rows.begin(), rows.end(), [&](const Value& r) {
        const Value* v = r.as_map()->find(n);
        return !v || v->is_nil() || v->is_number();
      }));
    }
    for (std::size_t i = 0; i < visible; ++i) {
      for (const std::string& n : names) {
        const Value* v = rows[i].as_map()->find(n);
        cells[i + 1].push_back(v && !v->is_nil() ? cell(*v) : "");
      }
    }
    if (style_.fits && !fields) lead_with_name(names, cells, right, width);
    std::string out = table_text(cells, right, style_.fits ? width : 0);
    if (visible < rows.size()) out += '\n' + rest(rows.size() - visible);
    return out;
  }

  /// A table that is cut repeats its first column: then that is what names the row.
  static void lead_with_name(const std::vector<std::string>& names,
                             std::vector<std::vector<std::string>>& cells, std::vector<bool>& right,
                             std::size_t width) {
    std::size_t total = 2 * (names.size() - 1);
    for (std::size_t c = 0; c < names.size(); ++c) {
      std::size_t widest = 0;
      for (const auto& row : cells) widest = std::max(widest, width_of(row[c]));
      total += widest;
    }
    if (total <= width) return;
    for (const char* word : {"name", "link"}) {
      const auto found = std::find(names.begin(), names.end(), word);
      if (found == names.end()) continue;
      const auto at = found - names.begin();
      for (auto& row : cells) std::rotate(row.begin(), row.begin() + at, row.begin() + at + 1);
      std::rotate(right.begin(), right.begin() + at, right.begin() + at + 1);
      return;
    }
  }

  /// The same with as few digits as numbers are shown with, for what is told within a line.
  Value rounded(const Value& v, int depth = 0) const {
    const auto shown = [this](double x) {
      return text::read_real(text::print_rounded(x, style_.digits)).value_or(x);
    };
    if (depth > kDeepest) return v;
    if (const double* x = v.as_real()) return Value(shown(*x));
    if (const NumericArray* a = v.as_array()) {
      std::vector<double> all;
      for (const double x : a->data()) all.push_back(shown(x));
      return Value(a->is_matrix() ? NumericArray(std::move(all), a->rows(), a->cols(), a->unit())
                                  : NumericArray(std::move(all), a->unit()));
    }
    if (const List* list = v.as_list()) {
      List out;
      for (const Value& item : *list) out.push_back(rounded(item, depth + 1));
      return Value(std::move(out));
    }
    if (const Map* map = v.as_map()) {
      Map out;
      for (const auto& [key, item] : *map) out.set(key, rounded(item, depth + 1));
      return Value(std::move(out));
    }
    return v;
  }

  static std::string rest(std::size_t count) { return "... " + std::to_string(count) + " more"; }

  /// One line of at most 64 characters, or 240 where it wraps.
  std::string cell(const Value& v) const {
    std::string s;
    if (const Handle* h = v.as_handle()) s = describe_(*h);
    else if (const std::string* t = v.as_string()) s = *t;
    else if (v.as_array() && !v.as_array()->is_matrix())
      s = pretty_array(*v.as_array(), {}, style_);
    else if (v.is_number()) s = number(v);
    else s = rounded(v).text();
    std::replace(s.begin(), s.end(), '\n', ' ');
    const std::size_t longest = style_.fits ? 240 : 64;
    if (width_of(s) > longest) {
      std::size_t at = 0, seen = 0;
      while (at < s.size() && seen < longest - 3) {
        ++at;
        while (at < s.size() && (static_cast<unsigned char>(s[at]) & 0xC0U) == 0x80U) ++at;
        ++seen;
      }
      s = s.substr(0, at) + "...";
    }
    return s;
  }

  std::string print_list(const List& list, std::string_view unit,
                         const std::vector<ParamSpec>* fields, int depth, std::size_t room) const {
    if (list.empty()) return "{}";
    const bool all_maps = std::all_of(list.begin(), list.end(), [](const Value& v) {
      return v.as_map() && !v.as_map()->empty();
    });
    if (all_maps && depth <= 1) return print_table(list, fields, room);

    std::vector<std::string> items;
    std::size_t total = 0;
    bool has_lines = false;
    const std::size_t visible = std::min(list.size(), style_.most_items);
    for (std::size_t i = 0; i < visible; ++i) {
      items.push_back(list[i].as_map() ? rounded(list[i]).text()
                                       : print(list[i], {}, nullptr, depth + 1, room));
      total += width_of(items.back()) + 2;
      has_lines = has_lines || items.back().find('\n') != std::string::npos;
    }
    if (visible < list.size()) items.push_back(rest(list.size() - visible));
    const bool all_handles =
        depth == 0 &&
        std::all_of(list.begin(), list.end(), [](const Value& v) { return v.as_handle(); });
    if (!has_lines && !all_handles && total <= (style_.fits ? room : style_.width) &&
        visible == list.size()) {
      return with_unit("{" + text::join(items, ", ") + "}", unit);
    }
    return text::join(items, "\n");
  }

  const DescribeHandle& describe_;
  const PrettyStyle& style_;
};

}  // namespace

std::string pretty_array(const NumericArray& array, std::string_view unit,
                         const PrettyStyle& style) {
  const auto print = [&](double v) { return text::print_rounded(v, style.digits); };
  if (!array.is_matrix()) {
    std::vector<std::string> cells;
    for (const std::size_t i : shown_rows(array.size(), 4 * style.most_rows))
      cells.push_back(i == array.size() ? "..." : print(array[i]));
    const std::string line = with_unit("{" + text::join(cells, ", ") + "}", unit);
    if (!style.fits || line.size() <= style.width) return line;
    const std::vector<std::string> lines = wrapped(line, style.width - 1);
    return text::join(lines, "\n ");
  }
  const auto rows = shown_rows(array.rows(), style.most_rows);
  if (rows.empty()) return "[]";
  std::vector<std::string> cells;
  std::vector<std::size_t> widths(array.cols(), 0);
  for (const std::size_t r : rows)
    for (std::size_t c = 0; c < array.cols(); ++c) {
      cells.push_back(r == array.rows() ? "..." : print(array.at(r, c)));
      widths[c] = std::max(widths[c], cells.back().size());
    }
  std::string out;
  std::size_t first = 0;
  // Columns that are too many come below each other, under their numbers.
  while (first < array.cols() || array.cols() == 0) {
    std::size_t end = array.cols();
    if (style.fits) {
      std::size_t used = 2;
      for (end = first; end < array.cols(); ++end) {
        used += widths[end] + (end > first ? 2 : 0);
        if (used > style.width && end > first) break;
      }
    }
    if (end - first < array.cols()) {
      if (first > 0) out += "\n\n";
      out += end == first + 1
                 ? "column " + std::to_string(end) + ":\n"
                 : "columns " + std::to_string(first + 1) + " to " + std::to_string(end) + ":\n";
    }
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (r > 0) out += '\n';
      out += '[';
      for (std::size_t c = first; c < end; ++c) {
        const std::string& s = cells[r * array.cols() + c];
        if (c > first) out += "  ";
        pad(out, s.size(), widths[c]);
        out += s;
      }
      out += ']';
    }
    if (array.cols() == 0) break;
    first = end;
  }
  return with_unit(std::move(out), unit);
}

std::string pretty(const Value& value, const ioci::ReturnSpec* returns,
                   const DescribeHandle& describe, const PrettyStyle& style) {
  const Printer printer(describe, style);
  return printer.print(value, returns ? std::string_view(returns->unit) : std::string_view(),
                       returns && !returns->fields.empty() ? &returns->fields : nullptr, 0,
                       style.width);
}

}  // namespace robomosp::lua
