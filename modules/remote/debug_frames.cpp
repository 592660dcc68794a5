// SPDX-License-Identifier: Apache-2.0
// Requests of the debug adapter about frames and variables.
#include "remote/debug_adapter_parts.h"

namespace robomosp::remote::adapter {

Answer Adapter::stack_trace(const Json& a) {
  const auto thread = thread_argument(a);
  if (!thread.ok()) return failed(thread.error());
  auto& stack = stacks_[*thread];
  if (stack.is_nil()) {
    auto all = ask("run.stack", Map{{"program", thread->program}, {"process", thread->process}});
    if (!all.ok()) return failed(all.error());
    stack = std::move(*all);
  }
  const List& all = list_of(stack);
  const std::size_t first =
      std::min<std::size_t>(number_member(a, "startFrame").value_or(0), all.size());
  std::size_t levels = number_member(a, "levels").value_or(0);
  if (levels == 0) levels = all.size();
  Json out = Json::array();
  for (std::size_t i = first; i < all.size() && i - first < levels; ++i) {
    const std::string file = text_at(all[i], "file");
    const std::int64_t line = number_at(all[i], "line");
    Json one{
        {"id", frame_number({*thread, static_cast<std::int64_t>(i) + 1})},
        {"name", text_at(all[i], "routine")},
        {"line", line > 0 ? line - 1 + first_line_ : 0},
        {"column",
         line > 0 ? column_of(thread->program, file, line, number_at(all[i], "column", 1)) : 0}};
    if (!file.empty() && line > 0) one["source"] = source_of(thread->program, file);
    out.push_back(std::move(one));
  }
  return Json{{"stackFrames", std::move(out)}, {"totalFrames", all.size()}};
}

std::int64_t Adapter::frame_number(const FramePlace& f) {
  const auto [it, is_new] = frame_numbers_.try_emplace({f.thread, f.number}, 0);
  if (is_new) {
    it->second = ++frames_made_;
    frames_[it->second] = f;
  }
  return it->second;
}

Result<Adapter::FramePlace> Adapter::frame_argument(const Json& a) {
  const Json& id = member(a, "frameId");
  if (id.is_null()) {
    FramePlace out;
    if (!programs_.empty()) out.thread.program = programs_.front().name;
    out.number = 0;
    return out;
  }
  const auto n = number_member(a, "frameId");
  const auto found = frames_.find(n ? std::int64_t{*n} : -1);
  if (found == frames_.end())
    return error(ErrorCode::not_found, "there is no frame " + id.dump(),
                 "stackTrace lists them while the programs are paused.");
  return found->second;
}

Map Adapter::of_frame(const FramePlace& f) {
  return Map{{"program", f.thread.program}, {"process", f.thread.process}, {"frame", f.number}};
}

std::int64_t Adapter::reference(Reference r) {
  if (references_.size() >= kMostReferences) return 0;
  references_.push_back(std::move(r));
  return static_cast<std::int64_t>(references_.size());
}

Answer Adapter::scopes(const Json& a) {
  if (!member(a, "frameId").is_number_integer())
    return AdapterFailure{"The request has no frameId."};
  const auto frame = frame_argument(a);
  if (!frame.ok()) return failed(frame.error());
  const FramePlace globals{frame->thread, 0};
  Json out = Json::array();
  out.push_back({{"name", "Locals"},
                 {"presentationHint", "locals"},
                 {"variablesReference", reference({Reference::variables, *frame, ""})},
                 {"expensive", false}});
  out.push_back({{"name", "Program"},
                 {"variablesReference", reference({Reference::variables, globals, ""})},
                 {"expensive", false}});
  out.push_back({{"name", "World"},
                 {"variablesReference", reference({Reference::world, globals, ""})},
                 {"expensive", true}});
  return Json{{"scopes", std::move(out)}};
}

Json Adapter::variable(const Value& v, const std::string& path, const FramePlace& frame) {
  const std::int64_t parts = number_at(v, "part_count");
  Json out{{"name", text_at(v, "name")}, {"value", text_at(v, "value")}, {"variablesReference", 0}};
  if (has_types_) out["type"] = text_at(v, "type");
  if (!path.empty()) out["evaluateName"] = path;
  if (parts > 0) {
    out["variablesReference"] = reference({Reference::parts, frame, path});
    if (has_paging_) out[flag_at(v, "is_indexed") ? "indexedVariables" : "namedVariables"] = parts;
  }
  return out;
}

std::string Adapter::part_path(const std::string& whole, const std::string& name) {
  return name.starts_with("[") ? whole + name : whole + "." + name;
}

Answer Adapter::variables(const Json& a) {
  const auto number = number_member(a, "variablesReference");
  if (!number || *number == 0 || *number > references_.size())
    return AdapterFailure{"There is no variablesReference " +
                          member(a, "variablesReference").dump() + " any more."};
  const Reference r = references_[*number - 1];
  const std::size_t start = number_member(a, "start").value_or(0);
  std::size_t count = number_member(a, "count").value_or(0);
  if (count == 0 || count > kMostParts) count = kMostParts;
  const std::string filter = string_member(a, "filter");
  if (r.kind == Reference::world) return world_variables(r, start, count);
  Map args = of_frame(r.frame);
  if (r.kind == Reference::parts) args.set("of", r.path);
  args.set("depth", 0);
  args.set("from", static_cast<std::int64_t>(start) + 1);
  args.set("most", static_cast<std::int64_t>(count));
  const auto all = ask("run.variables", std::move(args));
  if (!all.ok()) return failed(all.error());
  Json out = Json::array();
  for (const Value& v : list_of(*all)) {
    const std::string name = text_at(v, "name");
    const bool is_element = name.starts_with("[");
    if ((filter == "indexed" && !is_element) || (filter == "named" && is_element)) continue;
    out.push_back(
        variable(v, r.kind == Reference::parts ? part_path(r.path, name) : name, r.frame));
  }
  return Json{{"variables", std::move(out)}};
}

Answer Adapter::world_variables(const Reference& r, std::size_t start, std::size_t count) {
  const auto state = ask("run.state");
  if (!state.ok()) return failed(state.error());
  Json all = Json::array();
  const auto put = [&](const std::string& name, const std::string& value, const char* type,
                       const std::string& path) {
    Json one{
        {"name", name},
        {"value", value},
        {"variablesReference", path.empty() ? 0 : reference({Reference::world, r.frame, path})},
        {"presentationHint", {{"attributes", {"readOnly"}}}}};
    if (has_types_) one["type"] = type;
    all.push_back(std::move(one));
  };
  const auto members = [](const Value* v) {
    static const Map none;
    return v && v->as_map() ? *v->as_map() : none;
  };
  const auto numbers = [](const Value& v) {
    std::vector<double> out;
    if (const NumericArray* n = v.as_array()) out = n->data();
    for (const Value& one : list_of(v)) out.push_back(one.number());
    return out;
  };
  if (r.path.empty()) {
    put("time", text::print_rounded(real_at(*state, "time")) + " s", "s", "");
    for (const auto& [name, value] : members(at(*state, "values")))
      if (name.starts_with("signal."))
        put(name.substr(7), text::print_rounded(value.number()), "signal", "");
    for (const auto& [name, value] : members(at(*state, "joints")))
      put(name, value.text(), "robot", "joints/" + name);
    for (const auto& [name, value] : members(at(*state, "objects")))
      put(name, value.text(), "object", "objects/" + name);
  } else {
    const std::size_t slash = r.path.find('/');
    const Map group = members(at(*state, r.path.substr(0, slash)));
    const Value* one = group.find(r.path.substr(slash + 1));
    if (one && one->as_map()) {
      for (const auto& [name, value] : *one->as_map()) put(name, value.text(), "", "");
    } else if (one) {
      std::size_t k = 0;
      for (const double q : numbers(*one))
        put("q" + std::to_string(++k), text::print_rounded(q), "rad, m", "");
      // As the robot's pendant shows them.
      const Map axes = r.path.starts_with("joints/") ? members(at(*state, "axes")) : Map();
      for (const auto& [name, value] : members(axes.find(r.path.substr(slash + 1))))
        put(name, text::print_rounded(value.number()), "deg, mm", "");
    }
  }
  Json out = Json::array();
  for (std::size_t i = start; i < all.size() && i - start < count; ++i)
    out.push_back(std::move(all[i]));
  return Json{{"variables", std::move(out)}};
}

Answer Adapter::assigned(const FramePlace& frame, const std::string& path,
                         const std::string& value) {
  Map args = of_frame(frame);
  args.set("variable", path);
  args.set("value", value);
  const auto now = ask("run.set_variable", std::move(args));
  if (!now.ok()) return failed(now.error());
  Json out = variable(*now, path, frame);
  out.erase("name");
  out.erase("evaluateName");
  return out;
}

Answer Adapter::set_variable(const Json& a) {
  const auto number = number_member(a, "variablesReference");
  if (!number || *number == 0 || *number > references_.size())
    return AdapterFailure{"There is no variablesReference " +
                          member(a, "variablesReference").dump() + " any more."};
  const std::string name = string_member(a, "name");
  if (name.empty() || !member(a, "value").is_string())
    return AdapterFailure{"The request has no name, or no value."};
  const Reference r = references_[*number - 1];
  if (r.kind == Reference::world)
    return AdapterFailure{"Change the world with its commands, such as world.set_signal."};
  return assigned(r.frame, r.kind == Reference::parts ? part_path(r.path, name) : name,
                  string_member(a, "value"));
}

Answer Adapter::set_expression(const Json& a) {
  const auto frame = frame_argument(a);
  if (!frame.ok()) return failed(frame.error());
  const std::string expression = string_member(a, "expression");
  if (expression.empty() || !member(a, "value").is_string())
    return AdapterFailure{"The request has no expression, or no value."};
  return assigned(*frame, expression, string_member(a, "value"));
}

Answer Adapter::evaluate(const Json& a) {
  const auto frame = frame_argument(a);
  if (!frame.ok()) return failed(frame.error());
  const Json& given = member(a, "expression");
  if (!given.is_string()) return AdapterFailure{"The request has no expression."};
  if (!reads_.empty() && string_member(a, "context") == "repl") {
    const auto done =
        ask("run.input", Map{{"text", given.get<std::string>()}, {"program", reads_}});
    if (!done.ok()) return failed(done.error());
    return Json{{"result", "READ gets this line when the program continues."},
                {"variablesReference", 0}};
  }
  std::string expression(text::trim(given.get_ref<const std::string&>()));
  while (expression.ends_with(';')) expression.pop_back();
  if (const std::size_t sign = assignment(expression); sign != std::string::npos) {
    if (string_member(a, "context") != "repl")
      return AdapterFailure{"Assignments are allowed only in the console."};
    auto done = assigned(*frame, std::string(text::trim(expression.substr(0, sign))),
                         std::string(text::trim(expression.substr(sign + 2))));
    if (done.index() == 1) return done;
    Json& out = std::get<0>(done);
    out["result"] = out["value"];
    out.erase("value");
    return done;
  }
  Map args = of_frame(*frame);
  args.set("expression", expression);
  args.set("depth", 0);
  const auto v = ask("run.evaluate", std::move(args));
  if (!v.ok()) return failed(v.error());
  Json out = variable(*v, expression, *frame);
  out["result"] = out["value"];
  for (const char* each : {"name", "value", "evaluateName"}) out.erase(each);
  return out;
}

std::size_t Adapter::assignment(std::string_view s) {
  bool is_text = false;
  for (std::size_t i = 0; i + 1 < s.size(); ++i) {
    if (s[i] == '\'') is_text = !is_text;
    if (!is_text && s[i] == ':' && s[i + 1] == '=') return i;
  }
  return std::string::npos;
}

Answer Adapter::completions(const Json& a) {
  const auto frame = frame_argument(a);
  if (!frame.ok()) return failed(frame.error());
  const Json& given = member(a, "text");
  const auto column = number_member(a, "column");
  if (!given.is_string() || !column)
    return AdapterFailure{"The request has no text, or no column."};
  std::string line = given.get<std::string>();
  std::uint32_t row = 1;
  if (const auto n = number_member(a, "line"))
    row = *n + 1 - static_cast<std::uint32_t>(first_line_);
  line = line_of(line, row);
  const std::size_t behind =
      *column - std::min<std::uint32_t>(*column, static_cast<std::uint32_t>(first_column_));
  line.resize(byte_behind(line, behind));
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  std::size_t word = line.size();
  while (word > 0 && is_word(line[word - 1])) --word;
  const std::string prefix = line.substr(word);
  std::vector<Value> candidates;
  Map args = of_frame(*frame);
  args.set("depth", 0);
  args.set("most", static_cast<std::int64_t>(kMostParts));
  if (word > 0 && line[word - 1] == '.') {
    // The path before it: names, fields, and indices in brackets.
    std::size_t begin = word - 1, depth = 0;
    while (begin > 0) {
      const char c = line[begin - 1];
      if (c == ']') ++depth;
      if (c == '[' && depth-- == 0) break;
      if (depth == 0 && !is_word(c) && c != '.' && c != '[') break;
      --begin;
    }
    args.set("of", line.substr(begin, word - 1 - begin));
    if (const auto all = ask("run.variables", std::move(args)); all.ok())
      candidates = list_of(*all);
  } else {
    Map globals = args;
    globals.set("frame", 0);
    if (frame->number > 0)
      if (const auto all = ask("run.variables", std::move(args)); all.ok())
        candidates = list_of(*all);
    if (const auto all = ask("run.variables", std::move(globals)); all.ok())
      candidates.insert(candidates.end(), list_of(*all).begin(), list_of(*all).end());
  }
  Json out = Json::array();
  for (const Value& v : candidates) {
    const std::string name = text_at(v, "name");
    if (name.size() < prefix.size() || !same(name.substr(0, prefix.size()), prefix) ||
        name.starts_with("[") || out.size() >= kMostCompletions)
      continue;
    // `start` counts from 0 within the text, or from 1 as columns do.
    const auto start = units(line, static_cast<std::int64_t>(word) + 1) - 1;
    out.push_back({{"label", name},
                   {"type", "variable"},
                   {"detail", text_at(v, "type")},
                   {"start", start},
                   {"length", prefix.size()}});
  }
  return Json{{"targets", std::move(out)}};
}

Answer Adapter::exception_info(const Json& a) {
  const auto thread = thread_argument(a);
  if (!thread.ok()) return failed(thread.error());
  if (!is_faulted_) return AdapterFailure{"No program has a fault."};
  const std::string message = text_at(fault_, "error");
  const std::string own = text_at(fault_, "message");
  return Json{{"exceptionId", "fault"},
              {"description", own.empty() ? message : own},
              {"breakMode", "unhandled"},
              {"details", {{"message", message}, {"typeName", "fault"}}}};
}

}  // namespace robomosp::remote::adapter
