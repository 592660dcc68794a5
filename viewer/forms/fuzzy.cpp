// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/fuzzy.h"

#include <algorithm>

#include "kernel/text.h"

namespace robomosp::viewer {
namespace {

char lower_letter(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
bool is_upper_letter(char c) { return c >= 'A' && c <= 'Z'; }
bool is_separator(char c) { return c == '.' || c == '_' || c == ' ' || c == '|' || c == '-'; }

bool begins_word(std::string_view text, std::size_t i) {
  return i == 0 || is_separator(text[i - 1]) ||
         (is_upper_letter(text[i]) && !is_upper_letter(text[i - 1]));
}

}  // namespace

FuzzyMatch fuzzy_match(std::string_view typed, std::string_view text) {
  std::string wanted;
  for (const char c : typed)
    if (c != ' ') wanted += lower_letter(c);
  if (wanted.empty() || wanted.size() > text.size()) return {};
  constexpr double kNone = -1e9;
  const std::size_t n = wanted.size(), m = text.size();
  if (n * m > 100'000) return {};
  // best[i][j]: best score of the first i + 1 letters with the last one at j.
  std::vector<std::vector<double>> best(n, std::vector<double>(m, kNone));
  std::vector<std::vector<std::size_t>> from(n, std::vector<std::size_t>(m, m));
  for (std::size_t i = 0; i < n; ++i) {
    double before = kNone;  // best of the row above left of j - 1
    std::size_t before_at = m;
    for (std::size_t j = i; j < m; ++j) {
      if (i > 0 && j >= 2 && best[i - 1][j - 2] > before) {
        before = best[i - 1][j - 2];
        before_at = j - 2;
      }
      if (lower_letter(text[j]) != wanted[i]) continue;
      const double own = begins_word(text, j) ? 8 : 1;
      if (i == 0) {
        best[i][j] = own - 0.02 * static_cast<double>(j);
        continue;
      }
      const double run = j > 0 && best[i - 1][j - 1] > kNone ? best[i - 1][j - 1] + 6 + own : kNone;
      const double jump = before > kNone ? before + own - 1 : kNone;
      if (run >= jump && run > kNone) {
        best[i][j] = run;
        from[i][j] = j - 1;
      } else if (jump > kNone) {
        best[i][j] = jump;
        from[i][j] = before_at;
      }
    }
  }
  const auto at = std::max_element(best[n - 1].begin(), best[n - 1].end());
  if (at == best[n - 1].end() || *at <= kNone / 2) return {};
  FuzzyMatch out;
  // Short texts are nearer to what was typed.
  out.score = std::max(0.01, *at * 10 / static_cast<double>(n) - 0.1 * static_cast<double>(m));
  std::size_t j = static_cast<std::size_t>(at - best[n - 1].begin());
  for (std::size_t i = n; i-- > 0;) {
    out.places.push_back(j);
    j = from[i][j];
  }
  std::reverse(out.places.begin(), out.places.end());
  return out;
}

std::vector<FoundCommand> find_commands(std::string_view typed,
                                        const std::vector<SearchedCommand>& commands) {
  std::vector<FoundCommand> out;
  const std::string_view wanted = text::trim(typed);
  std::vector<std::string> words;
  for (const std::string_view w : text::split(wanted, ' '))
    if (!w.empty()) {
      words.emplace_back();
      for (const char c : w) words.back() += lower_letter(c);
    }
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const SearchedCommand& c = commands[i];
    if (words.empty()) {
      out.push_back({i, 0, {}});
      continue;
    }
    FuzzyMatch name = fuzzy_match(wanted, c.name);
    // Letters that are strewn over a name match by chance.
    const bool is_strewn = name.score > 0 && name.score < 30;
    const FuzzyMatch classic = fuzzy_match(wanted, c.classic);
    double score = is_strewn ? name.score * 0.3 : name.score;
    score = std::max(score, classic.score > 40 ? classic.score * 0.9 : 0);
    std::string lower;
    for (const char ch : c.name + " " + c.summary) lower += lower_letter(ch);
    std::size_t found = 0;
    for (const std::string& w : words) found += lower.find(w) != std::string::npos;
    if (found == words.size() && wanted.size() > 1)
      score = std::max(score, 35.0 - 0.02 * static_cast<double>(lower.size()));
    if (score < 4) continue;
    out.push_back({i, score, std::move(name.places)});
  }
  std::stable_sort(out.begin(), out.end(), [&](const FoundCommand& a, const FoundCommand& b) {
    if (a.score != b.score) return a.score > b.score;
    return commands[a.index].name < commands[b.index].name;
  });
  return out;
}

}  // namespace robomosp::viewer
