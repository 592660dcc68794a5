// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/command.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "ioci/core/application.h"
#include "ioci/core/argument_types.h"
#include "ioci/core/classic.h"
#include "ioci/core/example_arguments.h"
#include "kernel/check.h"
#include "kernel/letters.h"
#include "kernel/literal.h"
#include "kernel/text.h"
#include "kernel/type.h"

namespace robomosp::ioci {
namespace {

/// "PRobot mGetDHP|PRobot vGetDHp" -> its spellings, without the order of their arguments.
std::vector<std::string> spellings(std::string_view classic) {
  std::vector<std::string> out;
  for (ClassicSpelling& s : classic_spellings(classic)) out.push_back(std::move(s.words));
  return out;
}

void require(bool condition, const CommandSpec& spec, const std::string& what) {
  if (condition) return;
  const std::string text = "command \"" + spec.name + "\": " + what;
  RMP_CHECK(false, text.c_str());
}

std::string escape_cell(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

/// What notes add to the meaning of an argument.
std::string notes_text(const TypeNotes& n) {
  std::string out;
  if (!n.when.is_always()) out += " Counts where " + n.when.text() + ".";
  if (!n.effect.empty()) out += " " + n.effect;
  if (!n.since.empty()) out += " Since " + n.since + ".";
  if (!n.deprecated.empty()) out += " Deprecated: " + n.deprecated;
  return out;
}

void field_table(std::string& out, const std::vector<ParamSpec>& fields, bool with_default) {
  out += with_default ? "| argument | type | unit | default | meaning |\n|---|---|---|---|---|\n"
                      : "| field | type | unit | meaning |\n|---|---|---|---|\n";
  for (const ParamSpec& p : fields) {
    const bool is_plain = plain_type(p.type) == p.type;
    const std::string unit = unit_of(p);
    out += "| `" + p.name + "` | " +
           escape_cell(is_plain ? p.type : type_words(type_tree(p.type))) + " | " +
           escape_cell(unit) + " | ";
    if (with_default)
      out += (p.required        ? std::string("required")
              : p.default_value ? "`" + escape_cell(p.default_value->text()) + "`"
                                : std::string()) +
             " | ";
    out += escape_cell(p.doc);
    if (!p.choices.empty()) out += " One of " + text::enumerate(p.choices) + ".";
    if (!is_plain) out += escape_cell(notes_text(notes_of(p)));
    out += " |\n";
  }
}

std::string topic_of(std::string_view name) {
  const auto dot = name.find('.');
  return std::string(dot == std::string_view::npos ? std::string_view("general")
                                                   : name.substr(0, dot));
}

}  // namespace

std::string fault_of(const CommandSpec& spec) {
  const auto dot = spec.name.find('.');
  if (spec.name.empty() || dot == 0 || dot + 1 == spec.name.size()) return "malformed name";
  if (spec.summary.empty() || spec.summary.back() != '.') return "the summary is not a sentence";
  if (spec.example.empty()) return "no example";
  if (spec.run == nullptr && !spec.plugged) return "nothing to run";
  std::set<std::string_view> names;
  for (const ParamSpec& p : spec.params) {
    if (p.name.empty() || p.type.empty() || p.doc.empty())
      return "a parameter without name, type or doc";
    if (!names.insert(p.name).second) return "two parameters of one name";
  }
  if (std::string fault = schema_fault(spec.params); !fault.empty()) return "parameter " + fault;
  if (std::string fault = schema_fault(spec.returns.fields); !fault.empty())
    return "field " + fault + " of the result";
  if (std::string fault = type_fault(spec.returns.type); !fault.empty())
    return "its result: " + fault;
  for (const ClassicSpelling& s : classic_spellings(spec.classic)) {
    for (const std::string& name : s.order.value_or(std::vector<std::string>{}))
      if (!name.starts_with('~') && !names.contains(name))
        return "a classic spelling names no parameter";
    for (const auto& [name, value] : s.fixed)
      if (!names.contains(name)) return "a classic spelling sets no parameter";
  }
  return "";
}

std::string_view to_string(SessionKind k) {
  switch (k) {
    case SessionKind::console: return "console";
    case SessionKind::script: return "script";
    case SessionKind::connection: return "connection";
    case SessionKind::window: return "window";
  }
  return "script";
}

CommandContext::CommandContext(Application& a, Session& s, Progress& p)
    : app(a), session(s), progress(p) {}

const document::Snapshot& CommandContext::snapshot() const {
  return transaction_ ? transaction_->now() : *base_;
}

document::Transaction& CommandContext::edit() {
  RMP_CHECK(may_edit_ && transaction_ != nullptr,
            "a command that does not edit asked for a transaction");
  return *transaction_;
}

Result<Value> CommandContext::dispatch(std::string_view name, const Map& args) {
  return app.dispatch_within(*this, name, args);
}

recording::RecordingPtr CommandContext::recording(const Handle& h) const {
  auto found = app.recordings.find(h.number);
  if (!found) throw StaleHandle{h};
  return found;
}

std::optional<std::string> CommandContext::name_of(const Handle& h) const {
  return app.name_in(snapshot(), h);
}

void Session::confine(FileRoot root) { files_ = std::make_shared<const FileRoot>(std::move(root)); }

Session::~Session() {
  const std::shared_ptr<Jobs> jobs = jobs_.lock();
  if (!jobs) return;
  for (const std::uint64_t id : own_) jobs->cancel(id);
  for (const std::uint64_t id : own_) (void)jobs->wait(id).ok();
}

void CommandTable::add(std::vector<CommandSpec> specs) {
  const std::unique_lock lock(mutex_);
  for (CommandSpec& given : specs) {
    give_argument_types(given);
    const std::string fault = fault_of(given);
    require(fault.empty(), given, fault);
    auto spec = std::make_unique<CommandSpec>(std::move(given));
    require(by_name_.emplace(spec->name, spec.get()).second, *spec, "is in the table twice");
    for (const std::string& classic : spellings(spec->classic))
      require(by_classic_.emplace(text::lower(classic), spec.get()).second, *spec,
              "a classic spelling is in the table twice");
    specs_.push_back(std::move(spec));
    revision_.fetch_add(1, std::memory_order_release);
  }
}

Result<void> CommandTable::add_plugged(CommandSpec given) {
  if (const std::string fault = fault_of(given); !fault.empty())
    return error(ErrorCode::plugin_refused, fault);
  const std::unique_lock lock(mutex_);
  if (const auto known = by_name_.find(given.name); known != by_name_.end())
    return error(ErrorCode::conflict, known->second->plugin.empty()
                                          ? std::string("the program has a command of that name")
                                          : "plugin " + text::quote(known->second->plugin) +
                                                " has a command of that name");
  specs_.push_back(std::make_unique<CommandSpec>(std::move(given)));
  by_name_.emplace(specs_.back()->name, specs_.back().get());
  revision_.fetch_add(1, std::memory_order_release);
  return {};
}

const CommandSpec* CommandTable::find(std::string_view name) const {
  const std::shared_lock lock(mutex_);
  const auto it = by_name_.find(name);
  return it == by_name_.end() ? nullptr : it->second;
}

const CommandSpec* CommandTable::find_classic(std::string_view noun,
                                              std::string_view option) const {
  const std::shared_lock lock(mutex_);
  const auto it =
      by_classic_.find(text::lower(noun) + (option.empty() ? "" : " " + text::lower(option)));
  return it == by_classic_.end() ? nullptr : it->second;
}

std::vector<const CommandSpec*> CommandTable::list() const {
  const std::shared_lock lock(mutex_);
  std::vector<const CommandSpec*> out;
  out.reserve(by_name_.size());
  for (const auto& [name, spec] : by_name_) out.push_back(spec);
  return out;
}

std::vector<const CommandSpec*> CommandTable::methods_of(std::string_view kind) const {
  const std::shared_lock lock(mutex_);
  std::vector<const CommandSpec*> out;
  const std::string prefix = std::string(kind) + ".";
  for (auto it = by_name_.lower_bound(prefix);
       it != by_name_.end() && it->first.starts_with(prefix); ++it)
    if (!it->second->params.empty() && it->second->params.front().name == "id")
      out.push_back(it->second);
  return out;
}

Error CommandTable::unknown(std::string_view name) const {
  const std::shared_lock lock(mutex_);
  std::vector<std::string> names;
  names.reserve(by_name_.size());
  for (const auto& [n, spec] : by_name_) names.push_back(n);
  const auto dot = name.find('.');
  const std::string_view verb = dot == std::string_view::npos ? name : name.substr(dot + 1);
  std::vector<std::string> near =
      meant(dot == std::string_view::npos ? std::string_view() : name.substr(0, dot), verb);
  for (std::string& one : near) one = text::quote(one);
  // The topic may be right and the verb wrong: then its commands are what helps.
  const std::string topic = topic_of(name);
  std::vector<std::string> verbs;
  for (const std::string& n : names)
    if (topic_of(n) == topic && topic != "general") verbs.push_back(n.substr(topic.size() + 1));
  std::string hint;
  if (!near.empty()) hint = "Did you mean " + text::join(near, " or ") + "?";
  else if (const auto one = text::nearest(verb, verbs))
    hint = "Did you mean " + text::quote(topic + "." + *one) + "?";
  else if (verbs.empty()) hint = text::did_you_mean(name, names);
  if (hint.empty()) {
    hint = verbs.empty() ? "apropos(\"words\") searches the commands."
                         : topic + " has " + text::enumerate(verbs) + ".";
  }
  return error(ErrorCode::unknown_name, "there is no command " + text::quote(name),
               std::move(hint));
}

Error CommandTable::unknown_classic(std::string_view noun, std::string_view option) const {
  const std::shared_lock lock(mutex_);
  const std::string wanted = text::lower(noun);
  std::set<std::string> nouns;
  std::vector<std::string> options;
  for (const auto& [key, spec] : by_classic_) {
    for (const std::string& s : spellings(spec->classic)) {
      if (text::lower(s) != key) continue;
      const auto blank = s.find(' ');
      nouns.insert(s.substr(0, blank));
      if (text::lower(s.substr(0, blank)) == wanted && blank != std::string::npos)
        options.push_back(s.substr(blank + 1));
    }
  }
  if (options.empty()) {
    const std::vector<std::string> all(nouns.begin(), nouns.end());
    const std::string near = text::did_you_mean(noun, all);
    return error(ErrorCode::unknown_name, "there is no classic command " + text::quote(noun),
                 near.empty() ? "Classic lines begin with " + text::enumerate(all) + "." : near);
  }
  const std::string near = text::did_you_mean(option, options);
  return error(ErrorCode::unknown_name,
               option.empty() ? std::string(noun) + " needs an option"
                              : std::string(noun) + " has no option " + text::quote(option),
               near.empty() ? "Options: " + text::enumerate(options) + "." : near);
}

namespace {

/// "edits, files_read", "reads, at times files_read".
std::string effects_text(const CommandSpec& spec) {
  std::string out = spec.effect.text();
  if (!spec.sometimes.empty()) out += ", at times " + spec.sometimes.text();
  return out;
}

}  // namespace

std::string help_text(const CommandSpec& spec) {
  std::string out = "## " + spec.name + "\n\n" + spec.summary + "\n";
  if (!spec.details.empty()) out += "\n" + spec.details + "\n";
  if (!spec.plugin.empty()) out += "\nA command of the plugin `" + spec.plugin + "`.\n";
  if (spec.takes_expressions)
    out += "\nNumbers may be expressions over parameters, such as `\"bore/2 + 3 mm\"`.\n";
  if (!spec.params.empty()) {
    out += "\n";
    field_table(out, spec.params, true);
  }
  out += "\nReturns: ";
  const bool is_plain = plain_type(spec.returns.type) == spec.returns.type;
  out += spec.returns.type == "nil" ? "nothing"
         : is_plain                 ? spec.returns.type
                                    : type_words(type_tree(spec.returns.type));
  if (!spec.returns.unit.empty()) out += " [" + spec.returns.unit + "]";
  out += spec.returns.doc.empty() ? "." : ". " + spec.returns.doc;
  out += "\n";
  if (!spec.returns.fields.empty()) {
    out += "\n";
    field_table(out, spec.returns.fields, false);
  }
  out += "\nEffect: " + effects_text(spec) + ".\n";
  if (const auto classics = classic_spellings(spec.classic); !classics.empty()) {
    const bool is_method = !spec.params.empty() && spec.params.front().name == "id";
    out += "Classic: ";
    for (std::size_t i = 0; i < classics.size(); ++i)
      out += (i ? ", `" : "`") + classic_usage(classics[i], is_method) + "`";
    out += ".\n";
  }
  out += "\n```lua\n" + spec.example + "\n```\n";
  return out;
}

namespace {

/// The example as a request; empty if there are no arguments as data.
std::string example_request(const CommandSpec& spec, const ToJson& to_json) {
  const std::string_view text = example_arguments(spec.name);
  if (!to_json || text.empty()) return {};
  auto args = read_literal(text);
  if (!args.ok()) return {};
  Map request{{"method", spec.name}};
  request.set("params", std::move(*args));
  return "\n```json\n" + to_json(Value(std::move(request))) + "\n```\n";
}

}  // namespace

std::map<std::string, std::string> reference_pages(const CommandTable& table,
                                                   const ToJson& to_json) {
  std::map<std::string, std::string> pages;
  std::map<std::string, std::vector<const CommandSpec*>> topics;
  for (const CommandSpec* spec : table.list()) topics[topic_of(spec->name)].push_back(spec);
  std::string index =
      "# Commands\n\nGenerated from the command table; do not edit. `robomosp commands --markdown "
      "DIR` writes these pages.\n"
      "Every command can be called from Lua, as `robot(\"pa10\"):fk{q = {0, 0.5, 0, 1, 0, 0, 0}}`, "
      "or as\n"
      "`robot.fk{id = \"pa10\", q = {0, 0.5, 0, 1, 0, 0, 0}}` once pa10 is in the document; from a "
      "classic line\n"
      "where one is named, such as `PRobot pa10 mGetDHP`; and from every other front end, with the "
      "same\n"
      "arguments. A classic line loads what it works on from the library when the document lacks "
      "it.\n"
      "Below most examples, their call of the command is shown as a request of "
      "[JSON-RPC](../user/json_rpc.md),\n"
      "with the arguments by name; the records that it names are made by the lines before that "
      "call.\n\n"
      "| command | classic | effect | summary |\n|---|---|---|---|\n";
  std::string classic_lines = "\n## Classic lines\n\n| line | command |\n|---|---|\n";
  std::map<std::string, std::string> classic_index;
  for (const auto& [topic, specs] : topics) {
    std::string page = "# " + topic + "\n\nGenerated from the command table; do not edit.\n";
    for (const CommandSpec* spec : specs) {
      page += "\n" + help_text(*spec) + example_request(*spec, to_json);
      std::string anchor;
      for (const char c : spec->name)
        if (c != '.') anchor += c;
      const std::string link = "[`" + spec->name + "`](" + topic + ".md#" + anchor + ")";
      std::string classics;
      for (const std::string& s : spellings(spec->classic)) {
        classics += (classics.empty() ? "`" : ", `") + s + "`";
        classic_index[s] = link;
      }
      index += "| " + link + " | " + classics + " | " + effects_text(*spec) + " | " +
               escape_cell(spec->summary) + " |\n";
    }
    pages[topic + ".md"] = page;
  }
  for (const auto& [line, link] : classic_index)
    classic_lines += "| `" + line + "` | " + link + " |\n";
  pages["README.md"] = index + classic_lines;
  return pages;
}

}  // namespace robomosp::ioci
