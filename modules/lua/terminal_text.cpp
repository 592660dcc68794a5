// SPDX-License-Identifier: Apache-2.0
#include "lua/terminal_text.h"

#include <algorithm>
#include <numeric>

#include "kernel/text.h"

namespace robomosp::lua {
namespace {

constexpr std::size_t kGap = 2, kNarrowest = 12;

bool continues(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

/// Byte behind the first `count` characters.
std::size_t bytes_of(std::string_view s, std::size_t count) {
  std::size_t at = 0;
  while (at < s.size() && count > 0) {
    ++at;
    while (at < s.size() && continues(s[at])) ++at;
    --count;
  }
  return at;
}

/// The least width a column can take without breaking a word that fits.
std::size_t longest_word(const std::vector<std::vector<std::string>>& rows, std::size_t column) {
  std::size_t longest = 1;
  for (const auto& row : rows)
    for (const std::string_view word : text::split(row[column], ' '))
      longest = std::max(longest, width_of(word));
  return longest;
}

std::string lines_of(const std::vector<std::vector<std::string>>& rows,
                     const std::vector<std::size_t>& columns,
                     const std::vector<std::size_t>& widths, const std::vector<bool>& right) {
  std::string out;
  for (const auto& row : rows) {
    std::vector<std::vector<std::string>> cells;
    std::size_t height = 1;
    for (const std::size_t c : columns) {
      cells.push_back(width_of(row[c]) <= widths[c] ? std::vector<std::string>{row[c]}
                                                    : wrapped(row[c], widths[c]));
      height = std::max(height, cells.back().size());
    }
    for (std::size_t l = 0; l < height; ++l) {
      std::string line;
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const std::string cell = l < cells[i].size() ? cells[i][l] : "";
        const std::string blanks(widths[columns[i]] - width_of(cell), ' ');
        if (i > 0) line.append(kGap, ' ');
        line += right[columns[i]] ? blanks + cell : cell + blanks;
      }
      while (line.ends_with(' ')) line.pop_back();
      if (!out.empty()) out += '\n';
      out += line;
    }
  }
  return out;
}

/// Where what follows a line that is too long is to begin: below its last column.
std::size_t hanging(std::string_view line, std::size_t width) {
  std::size_t indent = line.find_first_not_of(' ');
  if (indent == std::string_view::npos) return 0;
  for (std::size_t at = line.find("  ", indent); at != std::string_view::npos;
       at = line.find("  ", at + 1)) {
    const std::size_t next = line.find_first_not_of(' ', at);
    if (next == std::string_view::npos || width_of(line.substr(0, next)) > width * 2 / 3) break;
    indent = width_of(line.substr(0, next));
  }
  return indent;
}

/// "| a | b\|c |" -> cells.
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> out(1);
  line = text::trim(line);
  line.remove_prefix(1);
  if (line.ends_with('|')) line.remove_suffix(1);
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\' && i + 1 < line.size() && line[i + 1] == '|') out.back() += line[++i];
    else if (line[i] == '|') out.emplace_back();
    else if (line[i] != '`') out.back() += line[i];
  }
  for (std::string& cell : out) cell = std::string(text::trim(cell));
  return out;
}

}  // namespace

std::size_t width_of(std::string_view s) {
  return static_cast<std::size_t>(
      std::count_if(s.begin(), s.end(), [](char c) { return !continues(c); }));
}

std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
  width = std::max<std::size_t>(width, 1);
  std::vector<std::string> out;
  std::string line;
  const auto end_line = [&] {
    while (line.ends_with(' ')) line.pop_back();
    out.push_back(std::exchange(line, {}));
  };
  for (std::string_view word : text::split(text, ' ')) {
    if (!line.empty() && width_of(line) + 1 + width_of(word) > width) end_line();
    else if (!line.empty()) line += ' ';
    while (width_of(word) > width) {
      const std::size_t cut = bytes_of(word, width);
      line = std::string(word.substr(0, cut));
      word.remove_prefix(cut);
      end_line();
    }
    line += word;
  }
  if (!line.empty() || out.empty()) end_line();
  return out;
}

std::string table_text(const std::vector<std::vector<std::string>>& rows,
                       const std::vector<bool>& right, std::size_t width) {
  if (rows.empty()) return {};
  const std::size_t count = rows.front().size();
  std::vector<std::size_t> widths(count, 0), least(count, 0), all(count);
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t c = 0; c < count; ++c) {
    for (const auto& row : rows) widths[c] = std::max(widths[c], width_of(row[c]));
    least[c] =
        right[c] ? widths[c] : std::min(widths[c], std::max(longest_word(rows, c), kNarrowest));
  }
  if (width == 0) return lines_of(rows, all, widths, right);

  // Columns that fit beside each other at their least width form a block, headed by the first.
  std::string out;
  std::size_t next = 0;
  while (next < count) {
    std::vector<std::size_t> columns;
    std::size_t used = 0;
    if (next > 0) {
      columns.push_back(0);
      used = least[0];
    }
    const std::size_t repeated = columns.size();
    while (next < count) {
      const std::size_t more = least[next] + (columns.empty() ? 0 : kGap);
      if (columns.size() > repeated && used + more > width) break;
      used += more;
      columns.push_back(next++);
    }
    std::vector<std::size_t> fitting(least);
    if (used > width) {
      // One column beside the repeated one is wider than the terminal: words are broken.
      if (columns.size() > 1) fitting[columns[0]] = std::min(least[columns[0]], width / 2);
      const std::size_t before = columns.size() > 1 ? fitting[columns[0]] + kGap : 0;
      fitting[columns.back()] = std::min(least[columns.back()], width - before);
    }
    // What is left over goes to the columns that want more, the narrowest wish first.
    for (std::size_t left = width > used ? width - used : 0; left > 0;) {
      std::size_t best = count, wish = 0;
      for (const std::size_t c : columns) {
        const std::size_t wants = widths[c] - std::min(widths[c], fitting[c]);
        if (wants > 0 && (best == count || wants < wish)) best = c, wish = wants;
      }
      if (best == count) break;
      const std::size_t given = std::min(wish, left);
      fitting[best] += given;
      left -= given;
    }
    if (!out.empty()) out += "\n\n";
    out += lines_of(rows, columns, fitting, right);
  }
  return out;
}

std::string fitted(std::string_view text, std::size_t width) {
  std::string out;
  bool is_code = false;
  const std::vector<std::string_view> lines = text::split(text, '\n');
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string_view line = lines[i];
    if (line.starts_with("```")) {
      is_code = !is_code;
      continue;
    }
    if (is_code) {
      out += "  " + std::string(line) + "\n";
      continue;
    }
    if (line.starts_with("|")) {
      std::vector<std::vector<std::string>> rows;
      std::vector<std::string> ways;  // how each column is aligned
      for (; i < lines.size() && lines[i].starts_with("|"); ++i) {
        if (lines[i].starts_with("|-")) {
          ways = cells_of(lines[i]);
          continue;
        }
        rows.push_back(cells_of(lines[i]));
        rows.back().resize(rows.front().size());
      }
      --i;
      ways.resize(rows.front().size());
      // An empty column says nothing here.
      for (std::size_t c = rows.front().size(); c-- > 0;) {
        if (std::any_of(rows.begin() + 1, rows.end(), [c](const auto& r) { return !r[c].empty(); }))
          continue;
        for (auto& row : rows) row.erase(row.begin() + static_cast<std::ptrdiff_t>(c));
        ways.erase(ways.begin() + static_cast<std::ptrdiff_t>(c));
      }
      std::vector<bool> right;
      for (const std::string& way : ways) right.push_back(way.ends_with(':'));
      out += table_text(rows, right, width) + "\n";
      continue;
    }
    if (width == 0 || width_of(line) <= width) {
      out += std::string(line) + (i + 1 < lines.size() ? "\n" : "");
      continue;
    }
    const std::size_t indent = hanging(line, width);
    const std::size_t head = bytes_of(line, indent);
    std::string start(line.substr(0, head));
    for (const std::string& rest : wrapped(line.substr(head), width - indent)) {
      out += start + rest + "\n";
      start.assign(indent, ' ');
    }
    if (i + 1 == lines.size()) out.pop_back();
  }
  return out;
}

}  // namespace robomosp::lua
