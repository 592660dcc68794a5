// SPDX-License-Identifier: Apache-2.0
// Comparisons as text, Markdown and HTML.
#include <algorithm>

#include "kernel/text.h"
#include "program_post/comparison.h"

namespace robomosp::program_post::comparison {
namespace {

constexpr const char* kSpeedWords[] = {"mm/s", "m/s", "mm/min", "percent", "time"};
constexpr const char* kBlendWords[] = {"none", "distance", "percent", "radius", "zone", "accuracy"};
struct Convention {
  std::string what;
  std::vector<std::string> of;
};
std::vector<Convention> conventions(const Comparison& c) {
  std::vector<Convention> out{{"language", {}}, {"form", {}},         {"speed of paths", {}},
                              {"blending", {}}, {"longest name", {}}, {"additional axes", {}},
                              {"profile", {}},  {"posted", {}},       {"read back by", {}}};
  for (const Side& s : c.sides) {
    const PostCapabilities& k = s.capabilities;
    std::size_t errors = 0;
    for (const SideFault& f : s.faults) errors += f.severity == "error";
    const std::string values[] = {
        s.title,
        s.form,
        kSpeedWords[std::clamp(static_cast<int>(k.speed), 0, 4)],
        kBlendWords[std::clamp(static_cast<int>(k.blending), 0, 5)],
        k.max_name > 0 ? std::to_string(k.max_name) : "any",
        std::to_string(k.external_axes),
        s.profile.empty() ? "none" : s.profile,
        s.is_correct ? "yes"
                     : "no, " + std::to_string(errors) + (errors == 1 ? " error" : " errors"),
        s.reader.empty() ? "nobody: " + s.not_read : s.reader};
    for (std::size_t i = 0; i < out.size(); ++i) out[i].of.push_back(values[i]);
  }
  return out;
}
std::string far_words(double mm, double degrees) {
  return "at most " + text::print_rounded(mm, 3) + " mm and " + text::print_rounded(degrees, 3) +
         " degrees apart";
}
std::string place_of_difference(const Difference& d) {
  return d.line == 0 ? d.file : d.file + ":" + std::to_string(d.line);
}

/// Columns of equal width; what is longer is cut with "~".
std::string column(const std::string& s, std::size_t width) {
  if (s.size() <= width) return s + std::string(width - s.size(), ' ');
  return s.substr(0, width - 1) + "~";
}
std::string html_text(std::string_view s) {
  std::string out;
  for (const char c : s) switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  return out;
}
std::string markdown_text(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '|') out += "\\|";
    else out += c;
  }
  return out;
}
std::string code_cell(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& l : lines) {
    if (l.find_first_not_of(' ') == std::string::npos) continue;
    const std::string ticks = l.find('`') == std::string::npos ? "`" : "``";
    out += (out.empty() ? "" : "<br>") + ticks + markdown_text(l) + ticks;
  }
  return out;
}

}  // namespace

std::string points_sentence(const Comparison& c) {
  std::size_t read = 0;
  std::string out;
  for (const Side& s : c.sides) read += !s.reader.empty();
  if (read < 2)
    out = "The points of the targets are not compared with each other: " + std::to_string(read) +
          " of " + std::to_string(c.sides.size()) + (read == 1 ? " was" : " were") + " read back.";
  else if (c.compared == 0)
    out = "No points are compared: what was read back has no motions in common.";
  else
    out = std::to_string(c.compared) +
          " points read back and compared: " + far_words(c.most_mm, c.most_degrees) + ".";
  for (const Side& s : c.sides) {
    if (s.reader.empty()) {
      out += " Not looked at: " + s.label + ", since " + s.not_read +
             (s.not_read.ends_with('.') ? "" : ".");
      continue;
    }
    if (c.not_traced.empty())
      out += " " + s.label + " and the program: " + std::to_string(s.compared) + " of " +
             std::to_string(c.reached.size()) + " points, " + far_words(s.most_mm, s.most_degrees) +
             ".";
    if (!s.not_said.empty())
      out += " Of " + s.label + " the reader left " + std::to_string(s.not_said.size()) +
             (s.not_said.size() == 1 ? " thing" : " things") + " out; the rest is compared.";
  }
  if (!c.not_traced.empty())
    out += " The program itself is not compared: " + c.not_traced +
           (c.not_traced.ends_with('.') ? "" : ".");
  for (const std::string& s : c.not_compared) out += " Not compared: " + s;
  return out;
}

std::set<std::uint32_t> lines_that_differ(const Comparison& c, const std::string& file,
                                          const char* kind) {
  std::set<std::uint32_t> out;
  for (const Difference& d : c.differences)
    if (d.file == file && (!kind || d.kind == kind)) out.insert(d.line);
  return out;
}

std::string as_text(const Comparison& c, std::size_t width) {
  std::string out;
  for (const Convention& k : conventions(c)) {
    out += column(k.what, 16);
    for (const std::string& v : k.of) out += "  " + v;
    out += "\n";
  }
  out += points_sentence(c) + "\n\n";
  for (const Difference& d : c.differences)
    out += place_of_difference(d) + ": " + d.kind + ": " + d.text + "\n";
  for (const auto& [file, lines] : c.source) {
    out += "\n=== " + file;
    for (const Side& s : c.sides) out += " | " + s.label;
    out += "\n";
    const auto differ = lines_that_differ(c, file, nullptr);
    for (std::uint32_t l = 0; l <= lines.size(); ++l) {
      std::size_t rows = l > 0 ? 1 : 0;
      std::vector<const std::vector<Line>*> of;
      for (const Side& s : c.sides) {
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        of.push_back(it == s.lines.end() || (l == 0 && file != c.source.front().first)
                         ? nullptr
                         : &it->second);
        if (of.back()) rows = std::max(rows, of.back()->size());
      }
      for (std::size_t r = 0; r < rows; ++r) {
        std::string row = r == 0 && l > 0 ? std::to_string(l) : "";
        row = std::string(row.size() < 4 ? 4 - row.size() : 0, ' ') + row +
              (r == 0 && differ.contains(l) && l > 0 ? "! " : "  ") +
              column(r == 0 && l > 0 ? lines[l - 1] : "", width);
        for (const auto* side : of)
          row += " | " + column(side && r < side->size() ? (*side)[r].text : "", width);
        while (row.ends_with(' ')) row.pop_back();
        out += row + "\n";
      }
    }
  }
  return out;
}

std::string as_html(const Comparison& c, const std::string& title) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" +
      html_text(title) +
      "</title>\n<style>\nbody{font:14px/1.4 sans-serif;margin:1.5em;color:#1d2330}\n"
      "h1{font-size:1.4em}h2{font-size:1.1em;margin-top:1.6em}\n"
      "table{border-collapse:collapse}td,th{text-align:left;vertical-align:top;padding:2px 10px;"
      "border-bottom:1px solid #e3e6ec}\n"
      "th{background:#f0f2f6;position:sticky;top:0}\n"
      "table.code td{font:12.5px/1.45 monospace;white-space:pre-wrap;overflow-wrap:anywhere}\n"
      "table.code{width:100%;table-layout:fixed}\n"
      "td.n,th.n{color:#7a8294;text-align:right;width:3.2em;padding-right:6px}\n"
      "tr.point td,tr.cannot td{background:#fde8e8}tr.otherwise td,tr.speed td,tr.blend td,"
      "tr.configuration td,tr.motion td,tr.output td,tr.unread td{background:#fff3d6}tr.missing "
      "td{background:#eef3fd}\n"
      "td .f{color:#7a8294}.why{color:#8a4b00;font-family:sans-serif;white-space:normal}\n"
      ".why.cannot{color:#a11}\n</style></head><body>\n<h1>" +
      html_text(title) + "</h1>\n<table>\n<tr><th></th>";
  for (const Side& s : c.sides) out += "<th>" + html_text(s.label) + "</th>";
  out += "</tr>\n";
  for (const Convention& k : conventions(c)) {
    out += "<tr><td>" + html_text(k.what) + "</td>";
    for (const std::string& v : k.of) out += "<td>" + html_text(v) + "</td>";
    out += "</tr>\n";
  }
  out += "</table>\n<p>" + html_text(points_sentence(c)) + "</p>\n<h2>Differences</h2>\n";
  if (c.differences.empty()) out += "<p>None.</p>\n";
  else {
    out += "<table>\n<tr><th>line</th><th>kind</th><th></th></tr>\n";
    for (const Difference& d : c.differences)
      out +=
          "<tr class=\"" + d.kind + "\"><td>" +
          (d.line ? "<a href=\"#" + html_text(d.file) + "-" + std::to_string(d.line) + "\">" : "") +
          html_text(place_of_difference(d)) + (d.line ? "</a>" : "") + "</td><td>" + d.kind +
          "</td><td>" + html_text(d.text) + "</td></tr>\n";
    out += "</table>\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "<h2>" + html_text(file) +
           "</h2>\n<table class=\"code\">\n<tr><th class=\"n\"></th><th>IRL</th>";
    for (const Side& s : c.sides) out += "<th>" + html_text(s.label) + "</th>";
    out += "</tr>\n";
    for (std::uint32_t l = is_first ? 0 : 1; l <= lines.size(); ++l) {
      // The worst kind of the line colours it.
      std::string kind, why;
      for (const char* each : {"cannot", "point", "motion", "output", "unread", "configuration",
                               "speed", "blend", "otherwise", "missing"})
        if (kind.empty() && l > 0 && lines_that_differ(c, file, each).contains(l)) kind = each;
      out += "<tr" + (kind.empty() ? "" : " class=\"" + kind + "\"") +
             (l > 0 ? " id=\"" + html_text(file) + "-" + std::to_string(l) + "\"" : "") +
             "><td class=\"n\">" + (l > 0 ? std::to_string(l) : "") + "</td><td>" +
             (l > 0 ? html_text(lines[l - 1]) : "<span class=\"f\">of no line</span>") + "</td>";
      for (std::size_t k = 0; k < c.sides.size(); ++k) {
        const Side& s = c.sides[k];
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        out += "<td>";
        if (it != s.lines.end()) {
          for (std::size_t i = 0; i < it->second.size(); ++i)
            out += (i ? "\n" : "") + html_text(it->second[i].text);
        }
        for (const SideFault& f : s.faults)
          if (f.file == file && f.line == l && f.severity != "note")
            out += "<div class=\"why " + std::string(f.severity == "error" ? "cannot" : "") +
                   "\">" + html_text(f.message) + "</div>";
        out += "</td>";
      }
      out += "</tr>\n";
    }
    out += "</table>\n";
    is_first = false;
  }
  return out + "</body></html>\n";
}

std::string as_markdown(const Comparison& c, const std::string& title) {
  std::string out = "# " + title + "\n\n| |";
  for (const Side& s : c.sides) out += " " + s.label + " |";
  out += "\n|---|";
  for (std::size_t i = 0; i < c.sides.size(); ++i) out += "---|";
  out += "\n";
  for (const Convention& k : conventions(c)) {
    out += "| " + k.what + " |";
    for (const std::string& v : k.of) out += " " + markdown_text(v) + " |";
    out += "\n";
  }
  out += "\n" + points_sentence(c) + "\n\n## Differences\n\n";
  if (c.differences.empty()) out += "None.\n";
  else {
    out += "| line | kind | |\n|---|---|---|\n";
    for (const Difference& d : c.differences)
      out +=
          "| " + place_of_difference(d) + " | " + d.kind + " | " + markdown_text(d.text) + " |\n";
  }
  bool is_first = true;
  for (const auto& [file, lines] : c.source) {
    out += "\n## " + file + "\n\n| | IRL |";
    for (const Side& s : c.sides) out += " " + s.label + " |";
    out += "\n|---|---|";
    for (std::size_t i = 0; i < c.sides.size(); ++i) out += "---|";
    out += "\n";
    for (std::uint32_t l = is_first ? 0 : 1; l <= lines.size(); ++l) {
      out += "| " + (l > 0 ? std::to_string(l) : std::string()) + " | " +
             (l > 0 ? code_cell({lines[l - 1]}) : "of no line") + " |";
      for (const Side& s : c.sides) {
        const auto it = s.lines.find(l > 0 ? std::pair(file, l) : std::pair(std::string(), l));
        std::vector<std::string> texts;
        if (it != s.lines.end())
          for (const Line& one : it->second) texts.push_back(one.text);
        out += " " + code_cell(texts) + " |";
      }
      out += "\n";
    }
    is_first = false;
  }
  return out;
}

}  // namespace robomosp::program_post::comparison
