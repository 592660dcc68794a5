// SPDX-License-Identifier: Apache-2.0
// Requests of the debug adapter about breakpoints.
#include "remote/debug_adapter_parts.h"

namespace robomosp::remote::adapter {

Json Adapter::shown(const Wanted& w) {
  Json out{{"id", w.id}, {"verified", w.is_verified}};
  if (!w.message.empty()) out["message"] = w.message;
  if (w.is_verified) {
    out["line"] = w.at_line - 1 + first_line_;
    out["column"] = column_of(w.program, w.file, w.at_line, w.at_column);
    out["source"] = source_of(w.program, w.file);
  } else if (w.line > 0) {
    out["line"] = w.line - 1 + first_line_;
  }
  return out;
}

void Adapter::clear(Wanted& w) {
  for (const std::int64_t n : w.numbers) {
    (void)ask("run.clear_breakpoint", Map{{"number", n}});
    ids_.erase(n);
  }
  w.numbers.clear();
  w.is_verified = false;
}

void Adapter::clear_all() {
  for (auto& [key, of] : wanted_)
    for (Wanted& w : of.all) clear(w);
  for (Wanted& w : functions_) clear(w);
}

void Adapter::set(Wanted& w, const Known& program, const std::string& file) {
  Map args{{"program", program.name}};
  if (!w.routine.empty()) {
    args.set("routine", w.routine);
  } else {
    args.set("source", file);
    args.set("line", w.line);
  }
  if (!w.condition.empty()) args.set("condition", w.condition);
  if (!w.hits.empty()) args.set("hits", w.hits);
  if (!w.log.empty()) args.set("log", w.log);
  const auto made = ask("run.set_breakpoint", std::move(args));
  if (!made.ok()) {
    if (w.message.empty()) w.message = made.error().sentence();
    return;
  }
  w.numbers.push_back(number_at(*made, "number"));
  ids_[w.numbers.back()] = {w.id, !w.routine.empty()};
  if (w.is_verified) return;
  w.is_verified = true;
  w.at_line = number_at(*made, "line");
  w.at_column = number_at(*made, "column", 1);
  w.program = program.name;
  w.file = text_at(*made, "source");
}

void Adapter::place(WantedOf& of) {
  for (Wanted& w : of.all) {
    w.message.clear();
    if (has_no_debug_) {
      w.message = "The programs run without a debugger.";
      continue;
    }
    const auto files = files_of(of);
    for (const auto& [program, file] : files) set(w, *program, file);
    if (w.is_verified) w.message.clear();
    if (files.empty())
      w.message = debuggee_ ? "No program of the run has a file " + of.name + "."
                            : "The program is not loaded yet.";
  }
}

void Adapter::place(Wanted& w) {
  w.message.clear();
  if (has_no_debug_) w.message = "The programs run without a debugger.";
  else if (!debuggee_) w.message = "The program is not loaded yet.";
  else
    for (const Known& p : programs_) set(w, p, "");
  if (w.is_verified) w.message.clear();
}

void Adapter::place_breakpoints() {
  const auto anew = [](Wanted& w) {
    w.numbers.clear();
    w.is_verified = false;
  };
  ids_.clear();
  for (auto& [key, of] : wanted_) {
    for (Wanted& w : of.all) anew(w);
    place(of);
    for (const Wanted& w : of.all)
      later("breakpoint", {{"reason", "changed"}, {"breakpoint", shown(w)}});
  }
  for (Wanted& w : functions_) {
    anew(w);
    place(w);
    later("breakpoint", {{"reason", "changed"}, {"breakpoint", shown(w)}});
  }
}

std::vector<std::pair<const Adapter::Known*, std::string>> Adapter::files_of(const WantedOf& of) {
  std::vector<std::pair<const Known*, std::string>> out;
  if (of.reference > 0) {
    const auto found = references_to_sources_.find(of.reference);
    if (found == references_to_sources_.end()) return out;
    for (const Known& p : programs_)
      if (p.name == found->second.first) out.emplace_back(&p, found->second.second);
    return out;
  }
  for (const Known& p : programs_)
    for (const std::string& f : p.files)
      if (same(f, of.name)) out.emplace_back(&p, f);
  if (out.size() < 2 || of.path.empty()) return out;
  // Of files of one name, those with the text of this one.
  std::vector<std::pair<const Known*, std::string>> equal;
  for (const auto& one : out)
    if (has_text(of.path, one.first->name, one.second)) equal.push_back(one);
  return equal.empty() ? out : equal;
}

Result<Adapter::WantedOf> Adapter::source_argument(const Json& a) {
  const Json& s = member(a, "source");
  WantedOf out;
  if (!s.is_object()) return error(ErrorCode::invalid_argument, "the request has no source", "");
  const Json& path = member(s, "path");
  if (path.is_string()) out.path = path_of(path.get<std::string>());
  out.name = out.path.empty() ? string_member(s, "name") : fs::path(out.path).filename().string();
  if (const auto r = number_member(s, "sourceReference")) out.reference = *r;
  if (out.name.empty() && out.reference == 0)
    return error(ErrorCode::invalid_argument, "the source has no path",
                 "Give path, or sourceReference.");
  return out;
}

Answer Adapter::set_breakpoints(const Json& a) {
  auto read = source_argument(a);
  if (!read.ok()) return failed(read.error());
  WantedOf of = std::move(*read);
  Json given = member(a, "breakpoints");
  if (given.is_null()) {
    // As old editors say it.
    given = Json::array();
    if (const Json& lines = member(a, "lines"); lines.is_array())
      for (const Json& line : lines) given.push_back({{"line", line}});
  }
  if (!given.is_array()) return AdapterFailure{"breakpoints must be a list."};
  const std::string key =
      of.reference > 0 ? "#" + std::to_string(of.reference) : of.path + "\n" + of.name;
  std::size_t others = 0;
  for (const auto& [source, set] : wanted_)
    if (source != key) others += set.all.size();
  if (given.size() > kMostBreakpoints - others)
    return AdapterFailure{"There are at most " + std::to_string(kMostBreakpoints) + " breakpoints" +
                          (others > 0 ? ", and other sources have " + std::to_string(others) : "") +
                          "."};
  if (!wanted_.contains(key) && (wanted_.size() >= kMostSources || paths_.size() >= kMostSources))
    return AdapterFailure{"At most " + std::to_string(kMostSources) + " sources have breakpoints."};
  for (const Json& one : given) {
    const Json& line = member(one, "line");
    if (!line.is_number_integer())
      return AdapterFailure{"A breakpoint must have a line, a whole number."};
    Wanted w;
    const auto n = number_member(one, "line");
    w.line = n ? std::int64_t{*n} + 1 - first_line_ : 0;
    w.condition = text::trim(string_member(one, "condition"));
    w.hits = text::trim(string_member(one, "hitCondition"));
    w.log = string_member(one, "logMessage");
    if (w.line < 1) w.message = "Lines begin at " + std::to_string(first_line_) + ".";
    of.all.push_back(std::move(w));
  }
  if (const auto old = wanted_.find(key); old != wanted_.end()) {
    if (debuggee_)
      for (Wanted& w : old->second.all) clear(w);
    wanted_.erase(old);
  }
  if (!of.path.empty()) paths_.insert(of.path);
  sources_.clear();  // a path may fit now
  for (Wanted& w : of.all) w.id = ++breakpoints_made_;
  std::vector<Wanted> wrong;
  std::vector<std::size_t> order;
  std::vector<Wanted> all = std::exchange(of.all, {});
  for (Wanted& w : all) (w.line < 1 ? wrong : of.all).push_back(std::move(w));
  place(of);
  std::map<std::int64_t, const Wanted*> by_id;
  for (const Wanted& w : wrong) by_id[w.id] = &w;
  for (const Wanted& w : of.all) by_id[w.id] = &w;
  Json out = Json::array();
  for (const auto& [id, w] : by_id) out.push_back(shown(*w));
  if (!of.all.empty()) wanted_[key] = std::move(of);
  return Json{{"breakpoints", std::move(out)}};
}

Answer Adapter::set_function_breakpoints(const Json& a) {
  const Json& given = member(a, "breakpoints");
  if (!given.is_array()) return AdapterFailure{"breakpoints must be a list."};
  if (given.size() > kMostBreakpoints)
    return AdapterFailure{"There are at most " + std::to_string(kMostBreakpoints) +
                          " function breakpoints."};
  std::vector<Wanted> all;
  for (const Json& one : given) {
    Wanted w;
    w.routine = text::trim(string_member(one, "name"));
    if (w.routine.empty())
      return AdapterFailure{"A function breakpoint must have the name of a routine."};
    w.condition = text::trim(string_member(one, "condition"));
    w.hits = text::trim(string_member(one, "hitCondition"));
    w.id = ++breakpoints_made_;
    all.push_back(std::move(w));
  }
  if (debuggee_)
    for (Wanted& w : functions_) clear(w);
  functions_ = std::move(all);
  Json out = Json::array();
  for (Wanted& w : functions_) {
    place(w);
    out.push_back(shown(w));
  }
  return Json{{"breakpoints", std::move(out)}};
}

Answer Adapter::set_exception_breakpoints(const Json& a) {
  bool breaks = false;
  Json out = Json::array();
  const auto take = [&](const Json& filter) {
    const bool is_known = filter == "fault";
    breaks = breaks || is_known;
    Json one{{"verified", is_known}};
    if (!is_known) one["message"] = "The filter must be \"fault\".";
    out.push_back(std::move(one));
  };
  const Json& filters = member(a, "filters");
  if (!filters.is_array()) return AdapterFailure{"filters must be a list of texts."};
  for (const Json& f : filters) take(f);
  if (const Json& options = member(a, "filterOptions"); options.is_array())
    for (const Json& o : options) take(member(o, "filterId"));
  breaks_on_faults_ = breaks;
  return Json{{"breakpoints", std::move(out)}};
}

Answer Adapter::breakpoint_locations(const Json& a) {
  auto of = source_argument(a);
  if (!of.ok()) return failed(of.error());
  const auto line = number_member(a, "line");
  if (!line) return AdapterFailure{"The request has no line."};
  const std::int64_t first = std::int64_t{*line} + 1 - first_line_;
  std::int64_t last = first;
  if (const auto end = number_member(a, "endLine")) last = std::int64_t{*end} + 1 - first_line_;
  Json out = Json::array();
  const auto files = files_of(*of);
  if (files.empty()) return AdapterFailure{"No program of the run has a file " + of->name + "."};
  const auto& [program, file] = files.front();
  const auto lines = ask("run.program_lines", Map{{"program", program->name}, {"source", file}});
  if (!lines.ok()) return failed(lines.error());
  for (const Value& s : list_at(*lines, "statements")) {
    const std::int64_t n = number_at(s, "line");
    if (n < first || n > last) continue;
    out.push_back({{"line", n - 1 + first_line_},
                   {"column", column_of(program->name, file, n, number_at(s, "column", 1))}});
  }
  return Json{{"breakpoints", std::move(out)}};
}

}  // namespace robomosp::remote::adapter
