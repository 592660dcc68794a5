// SPDX-License-Identifier: Apache-2.0
#include "recording/file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "kernel/text.h"
#include "kernel/units.h"
#include "recording/number_table.h"

namespace robomosp::recording {
namespace {

constexpr std::string_view kHead = "robomosp recording 1";
constexpr std::size_t kMostColumns = 100000;

/// Lines of a text with their numbers; `\r` before the end of a line is left out.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] std::size_t number() const { return number_; }  ///< of the line read last, from 1
  std::string_view next() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  [[nodiscard]] std::string_view rest() const { return text_.substr(std::min(at_, text_.size())); }
  [[nodiscard]] Error fault(std::string message, std::string hint) const {
    return error(ErrorCode::syntax, std::move(message), std::move(hint),
                 "line " + std::to_string(number_));
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0, number_ = 0;
};

/// The words of a line: plain ones, and texts in double quotes as text::quote writes them. False =
/// a quote that does not end.
bool split_words(std::string_view line, std::vector<std::string>& words) {
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == ' ') {
      ++i;
      continue;
    }
    std::string word;
    if (line[i] != '"') {
      while (i < line.size() && line[i] != ' ') word += line[i++];
      words.push_back(std::move(word));
      continue;
    }
    for (++i; i < line.size() && line[i] != '"'; ++i) {
      if (line[i] != '\\') {
        word += line[i];
        continue;
      }
      if (++i == line.size()) return false;
      word += line[i] == 'n' ? '\n' : line[i] == 't' ? '\t' : line[i] == 'r' ? '\r' : line[i];
    }
    if (i++ >= line.size()) return false;
    words.push_back(std::move(word));
  }
  return true;
}

/// Numbers as text::print writes them.
std::optional<double> read_number(std::string_view s) {
  if (s == "nan") return std::numeric_limits<double>::quiet_NaN();
  if (s == "-0") return -0.0;  // to the same bits
  return text::read_real(s);
}
std::string print_number(double v) {
  std::string s;
  append_number(s, v, true);
  return s;
}

std::string json_text(const std::string& s) {
  constexpr const char* kHex = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : s) {
    const auto u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') out += '\\', out += c;
    else if (c == '\n') out += "\\n";
    else if (u < 0x20) out += "\\u00", out += kHex[u >> 4], out += kHex[u & 15];
    else out += c;
  }
  return out + '"';
}

std::string csv_field(const std::string& s) {
  if (s.find_first_of(",\"\n\r") == std::string::npos) return s;
  std::string quoted = "\"";
  for (const char c : s) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

/// Fields of a line of CSV; quotes as in RFC 4180, but no line ends within them.
std::vector<std::string> csv_fields(std::string_view line, char separator) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') out.back() += line[++i];
    else if (c == '"') quoted = !quoted;
    else if (c == separator && !quoted) out.emplace_back();
    else out.back() += c;
  }
  for (std::string& field : out) field = std::string(text::trim(field));
  return out;
}

Error too_many_columns(const Lines& lines) {
  return lines.fault("it has more than " + std::to_string(kMostColumns) + " columns",
                     "Split it by columns.");
}

/// Name and unit of `q1 [rad]` or `q1 (rad)`.
std::pair<std::string, std::string> name_and_unit(const std::string& field) {
  for (const auto& [open, close] : {std::pair{'[', ']'}, {'(', ')'}}) {
    const std::size_t from = field.find(open);
    if (from != std::string::npos && field.ends_with(close))
      return {std::string(text::trim(field.substr(0, from))),
              std::string(text::trim(field.substr(from + 1, field.size() - from - 2)))};
  }
  return {field, ""};
}

}  // namespace

Result<std::string> to_text(const Recording& r, std::string_view world, Progress& progress) {
  std::string out(kHead);
  out += "\ntitle " + text::quote(r.title) + "\nworld " + text::quote(world) + "\nrobot " +
         text::quote(r.robot) + "\ntrajectory " + text::quote(r.trajectory) + "\ndof " +
         std::to_string(r.dof) + "\nvoxel " + print_number(r.voxel) + '\n' +
         (r.base_moves ? "base moving\n" : "");
  for (const std::string& note : r.notes) out += "note " + text::quote(note) + '\n';
  for (const Column& c : r.columns)
    out += "column " + text::quote(c.name) + ' ' + text::quote(c.unit) + ' ' +
           text::print(c.lower) + ' ' + text::print(c.upper) + ' ' + text::quote(c.doc) + '\n';
  out += "rows " + std::to_string(r.rows()) + '\n';
  RMP_TRY(append_rows(out, r.columns, {}, progress));
  out += "end\n";
  return out;
}

Result<FiledRecording> recording_from_text(std::string_view text, Progress& progress) {
  Lines lines(text);
  if (const auto head = lines.next(); head != kHead) {
    if (head.starts_with("robomosp recording "))
      return lines.fault(
          "it is a recording of a newer version, " + text::quote(std::string(head.substr(19))),
          "Load it with a newer program.");
    return lines.fault("it is not a recording of this program",
                       "Such a file starts with \"" + std::string(kHead) + "\".");
  }
  FiledRecording out;
  Recording& r = out.recording;
  std::optional<std::size_t> rows;
  std::unordered_set<std::string> names;
  while (!rows) {
    if (lines.at_end()) return lines.fault("the file ends before its rows", "It is truncated.");
    std::vector<std::string> words;
    const bool is_whole = split_words(lines.next(), words);
    const std::string what = words.empty() ? "" : words.front();
    const std::size_t wanted = what == "column" ? 6 : 2;
    if (!is_whole || words.size() != wanted)
      return lines.fault("it cannot be read", "Such a line is: title \"...\", rows 100.");
    std::string& value = words[1];
    const auto count = text::read_int(value);
    if (what == "title") r.title = std::move(value);
    else if (what == "world") out.world = std::move(value);
    else if (what == "robot") r.robot = std::move(value);
    else if (what == "trajectory") r.trajectory = std::move(value);
    else if (what == "note") r.notes.push_back(std::move(value));
    else if (what == "voxel" && read_number(value)) r.voxel = *read_number(value);
    else if (what == "base" && value == "moving") r.base_moves = true;
    else if (what == "dof" && count && *count >= 0) r.dof = static_cast<std::size_t>(*count);
    else if (what == "rows" && count && *count >= 0) rows = static_cast<std::size_t>(*count);
    else if (what == "column" && read_number(words[3]) && read_number(words[4])) {
      if (!names.insert(value).second)
        return lines.fault("there are two columns " + text::quote(value), "Rename one.");
      if (r.columns.size() == kMostColumns) return too_many_columns(lines);
      r.columns.push_back(
          {value, words[2], words[5], {}, *read_number(words[3]), *read_number(words[4])});
    } else {
      return lines.fault(text::quote(what) + " with " + text::quote(value) + " is not allowed here",
                         "A recording has title, world, robot, trajectory, dof, voxel, base, note, "
                         "column and rows.");
    }
  }
  if (r.columns.empty() && *rows > 0) return lines.fault("it has rows but no columns", "");
  const std::size_t width = r.columns.size();
  RMP_TRY_ASSIGN(const RowsRead read,
                 read_rows(
                     lines.rest(), lines.number() + 1, r.columns,
                     [width](std::string_view line, double* row, Error& fault) {
                       if (line == "end") return LineKind::end;
                       std::size_t fields = 0;
                       for (std::size_t at = 0; at <= line.size(); ++fields) {
                         const std::size_t end = std::min(line.find(' ', at), line.size());
                         const std::string_view field = line.substr(at, end - at);
                         at = end + 1;
                         if (fields >= width) continue;
                         const auto v = read_number(field);
                         if (!v) {
                           fault = error(ErrorCode::syntax, text::quote(field) + " is not a number",
                                         "Write such as 0.5.");
                           return LineKind::fault;
                         }
                         row[fields] = *v;
                       }
                       if (fields == width) return LineKind::row;
                       fault = error(ErrorCode::syntax,
                                     "the row has " + std::to_string(fields) +
                                         " numbers, but there are " + std::to_string(width) +
                                         " columns",
                                     "Separate the numbers with one blank.");
                       return LineKind::fault;
                     },
                     progress));
  const auto fault = [&](std::string message, std::string hint) {
    return error(ErrorCode::syntax, std::move(message), std::move(hint),
                 "line " + std::to_string(lines.number() + read.lines + (read.found_end ? 1 : 0)));
  };
  if (read.rows < *rows)
    return fault(
        "the file ends after row " + std::to_string(read.rows) + " of " + std::to_string(*rows),
        "It is truncated.");
  if (!read.found_end || read.rows > *rows)
    return fault("the rows are not followed by \"end\"", "There are more rows than declared.");
  return out;
}

Result<std::string> to_csv(const Recording& recording, Progress& progress) {
  std::string out;
  for (std::size_t c = 0; c < recording.columns.size(); ++c) {
    const auto& column = recording.columns[c];
    if (c) out += ',';
    out += csv_field(column.unit.empty() ? column.name : column.name + " [" + column.unit + "]");
  }
  out += "\r\n";
  const TableForm form{.separator = ',', .line_end = "\r\n", .signs_zero = false};
  RMP_TRY(append_rows(out, recording.columns, form, progress));
  return out;
}

Result<Recording> recording_from_csv(std::string_view text, Progress& progress) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  Lines lines(text);
  const std::string_view header = lines.next();
  char separator = ',';
  for (const char c : {';', '\t'})
    if (std::count(header.begin(), header.end(), c) >
        std::count(header.begin(), header.end(), separator))
      separator = c;
  Recording r;
  std::vector<units::Unit> given;
  std::unordered_set<std::string> names;
  for (const std::string& field : csv_fields(header, separator)) {
    const auto [name, unit] = name_and_unit(field);
    if (name.empty() || text::read_real(name))
      return lines.fault(name.empty() ? "a column has no name"
                                      : text::quote(name) + " is not the name of a column",
                         "The first line names the columns, such as: time [s],q1 [deg].");
    if (!names.insert(name).second)
      return lines.fault("there are two columns " + text::quote(name), "Rename one.");
    if (r.columns.size() == kMostColumns) return too_many_columns(lines);
    auto read = units::parse(unit);
    if (!read.ok()) return std::move(read).error().in("line 1, column " + text::quote(name));
    given.push_back(*read);
    r.columns.push_back({name, read->factor == 1 ? unit : units::si_name(read->dimension), "", {}});
  }
  const std::size_t width = r.columns.size();
  RMP_TRY(read_rows(
      lines.rest(), lines.number() + 1, r.columns,
      [&r, &given, separator, width](std::string_view line, double* row, Error& fault) {
        if (text::trim(line).empty()) return LineKind::skipped;
        std::size_t fields = 0;
        const auto take = [&](std::string_view field) {
          if (fields >= width) return true;
          std::string with_point;
          // Where semicolons separate, commas are often the decimal sign.
          if (separator != ',' && field.find(',') != field.npos) {
            with_point = field;
            std::replace(with_point.begin(), with_point.end(), ',', '.');
            field = with_point;
          }
          const auto v = field.empty() ? std::optional(std::nan("")) : read_number(field);
          if (v) {
            row[fields] = units::to_si(*v, given[fields]);
            return true;
          }
          fault = error(ErrorCode::syntax,
                        text::quote(field) + " of column " + text::quote(r.columns[fields].name) +
                            " is not a number",
                        "Leave the field empty where there is no value.");
          return false;
        };
        if (line.find('"') == line.npos) {
          for (std::size_t at = 0; at <= line.size(); ++fields) {
            const std::size_t end = std::min(line.find(separator, at), line.size());
            if (!take(text::trim(line.substr(at, end - at)))) return LineKind::fault;
            at = end + 1;
          }
        } else {
          for (const std::string& field : csv_fields(line, separator)) {
            if (!take(field)) return LineKind::fault;
            ++fields;
          }
        }
        if (fields == width) return LineKind::row;
        fault = error(ErrorCode::syntax,
                      "it has " + std::to_string(fields) + " fields, but the header has " +
                          std::to_string(width),
                      "Give every column in every line.");
        return LineKind::fault;
      },
      progress));
  if (r.rows() == 0) return lines.fault("it has no lines of numbers", "");
  if (const Column* time = r.find("time"))
    for (std::size_t i = 1; i < time->values.size(); ++i)
      if (!(time->values[i] > time->values[i - 1]))
        return error(ErrorCode::syntax,
                     "the time does not increase from row " + std::to_string(i) + " to row " +
                         std::to_string(i + 1),
                     "Sort the lines by time and remove duplicates.");
  return r;
}

Result<Recording> recording_from_plot(std::string_view text) {
  Lines lines(text);
  std::optional<std::size_t> joints;
  Recording r;
  while (!lines.at_end()) {
    const std::string_view line = text::trim(lines.next());
    if (line.empty()) continue;
    if (line.front() == '#' && r.columns.empty()) {
      const auto digit = line.find_first_of("0123456789");
      if (joints || digit == std::string_view::npos) continue;  // names, or a remark
      const auto end = line.find_first_not_of("0123456789", digit);
      const auto n = text::read_int(line.substr(digit, end - digit));
      if (!n || *n < 1 || static_cast<std::size_t>(*n) > kMostColumns / 3 - 1)
        return lines.fault(text::quote(line) + " is not a number of joints", "Write such as #6.");
      joints = static_cast<std::size_t>(*n);
      continue;
    }
    std::vector<double> row;
    std::string_view rest = line;
    while (!rest.empty()) {
      const auto end = std::min(rest.find_first_of(" \t,"), rest.size());
      if (const std::string_view word = rest.substr(0, end); !word.empty()) {
        const auto x = text::read_real(word);
        if (!x && r.columns.empty()) {  // the line of names
          row.clear();
          break;
        }
        if (!x)
          return lines.fault(text::quote(word) + " is not a number", "Give numbers in every row.");
        row.push_back(*x);
      }
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    if (row.empty()) continue;
    if (!joints)
      return lines.fault("the line with the number of joints is missing before the numbers",
                         "Write such as #6 in front. Samples of trajectories have no joints.");
    if (r.columns.empty()) {
      const bool is_motion = row.size() == 1 + 3 * *joints;
      if (!is_motion && row.size() != 1 + *joints)
        return lines.fault(
            "it has " + std::to_string(row.size()) + " numbers, for " + std::to_string(*joints) +
                " joints",
            "A row is the time and a torque for each joint, or the time and each joint's "
            "positions, velocities and accelerations.");
      r.dof = *joints;
      r.columns.push_back({"time", "s", "time", {}});
      struct Kind {
        const char *stem, *unit, *doc;
      };
      const std::vector<Kind> kinds = is_motion
                                          ? std::vector<Kind>{{"q", "rad", "position"},
                                                              {"qd", "rad/s", "velocity"},
                                                              {"qdd", "rad/s^2", "acceleration"}}
                                          : std::vector<Kind>{{"tau", "N m", "torque"}};
      for (const Kind& kind : kinds)
        for (std::size_t j = 1; j <= *joints; ++j)
          r.columns.push_back({kind.stem + std::to_string(j),
                               kind.unit,
                               kind.doc + std::string(" of joint ") + std::to_string(j),
                               {}});
    }
    if (row.size() != r.columns.size())
      return lines.fault("it has " + std::to_string(row.size()) +
                             " numbers, but the previous row " + std::to_string(r.columns.size()),
                         "Give the same number in every row.");
    for (std::size_t c = 0; c < row.size(); ++c) r.columns[c].values.push_back(row[c]);
  }
  if (r.rows() == 0) return lines.fault("it has no rows of numbers", "");
  const std::vector<double>& time = r.columns.front().values;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (!(time[i] > time[i - 1]))
      return error(ErrorCode::syntax,
                   "the time does not increase from row " + std::to_string(i) + " to row " +
                       std::to_string(i + 1),
                   "Sort the rows by time and remove duplicates.");
  return r;
}

std::string to_json(const Recording& r) {
  std::string out;
  const auto number = [&out](double v) {
    // -0 would be a whole number without a sign to many readers.
    if (!std::isfinite(v)) out += "null";
    else if (v == 0 && std::signbit(v)) out += "-0.0";
    else append_number(out, v, false);
  };
  out = "{\n  \"title\": " + json_text(r.title) + ",\n  \"robot\": " + json_text(r.robot) +
        ",\n  \"trajectory\": " + json_text(r.trajectory) +
        ",\n  \"dof\": " + std::to_string(r.dof) + ",\n  \"notes\": [";
  for (std::size_t i = 0; i < r.notes.size(); ++i) out += (i ? ", " : "") + json_text(r.notes[i]);
  out += "],\n  \"columns\": [";
  for (std::size_t k = 0; k < r.columns.size(); ++k) {
    const Column& c = r.columns[k];
    out += std::string(k ? "," : "") + "\n    {\"name\": " + json_text(c.name) +
           ", \"unit\": " + json_text(c.unit) + ", \"doc\": " + json_text(c.doc);
    if (std::isfinite(c.lower)) out += ", \"lower\": ", number(c.lower);
    if (std::isfinite(c.upper)) out += ", \"upper\": ", number(c.upper);
    out += ", \"values\": [";
    for (std::size_t i = 0; i < c.values.size(); ++i) {
      if (i) out += ',';
      number(c.values[i]);
    }
    out += "]}";
  }
  return out + "\n  ]\n}\n";
}

}  // namespace robomosp::recording
