// SPDX-License-Identifier: Apache-2.0
#include "ioci/application.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "document/validate.h"
#include "io/native.h"
#include "ioci/commands.h"
#include "ioci/handle_text.h"
#include "ioci/live_runs.h"
#include "kernel/check.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

/// A component made of two functions.
class Part final : public Component {
 public:
  explicit Part(std::function<Result<void>()> on_start = {}, std::function<void()> on_stop = {})
      : start_(std::move(on_start)), stop_(std::move(on_stop)) {}
  Result<void> start() override { return start_ ? start_() : Result<void>(); }
  void stop() noexcept override {
    if (stop_) stop_();
  }

 private:
  std::function<Result<void>()> start_;
  std::function<void()> stop_;
};

/// Progress of the command that a session runs.
class SessionProgress final : public Progress {
 public:
  SessionProgress(const AppThread& thread, const Session& session)
      : thread_(thread), session_(session) {}
  void report(double fraction, std::string_view what) override {
    if (session_.show_progress && thread_.is_current()) session_.show_progress(fraction, what);
  }
  [[nodiscard]] bool cancelled() const override { return session_.interrupted(); }

 private:
  const AppThread& thread_;
  const Session& session_;
};

/// Restores what a session joins when a scope ends.
class Joined {
 public:
  Joined(document::Transaction*& slot, document::Transaction* now) : slot_(slot), before_(slot) {
    slot_ = now;
  }
  ~Joined() { slot_ = before_; }
  Joined(const Joined&) = delete;
  Joined& operator=(const Joined&) = delete;

 private:
  document::Transaction*& slot_;
  document::Transaction* before_;
};

std::vector<std::filesystem::path> library_path(const ApplicationOptions& options,
                                                const std::filesystem::path& share) {
  if (!options.library.empty()) return options.library;
  std::vector<std::filesystem::path> out;
  if (const char* given = std::getenv("ROBOMOSP_LIBRARY"))
    for (const std::string_view folder : text::split(given, ':'))
      if (!folder.empty()) out.emplace_back(folder);
  if (out.empty()) out.push_back(share / "library");
  return out;
}

bool is_record_kind(std::string_view kind) { return kind_from(kind).has_value(); }

}  // namespace

std::optional<Handle> handle_from_text(std::string_view s) {
  const auto hash = s.rfind('#');
  if (hash == std::string_view::npos) return std::nullopt;
  const auto number = text::read_int(s.substr(hash + 1));
  if (!number || *number <= 0) return std::nullopt;
  const std::string_view kind = s.substr(0, std::min(hash, s.find(':')));
  if (!is_record_kind(kind) && kind != "recording" && kind != "job" && kind != "run")
    return std::nullopt;
  return Handle{std::string(kind), static_cast<std::uint64_t>(*number)};
}

bool kinds_include(std::string_view kinds, std::string_view kind) {
  if (kinds == "any") return true;
  while (!kinds.empty()) {
    const auto bar = kinds.find('|');
    if (kinds.substr(0, bar) == kind) return true;
    if (bar == std::string_view::npos) return false;
    kinds.remove_prefix(bar + 1);
  }
  return false;
}

namespace {

std::string kinds_text(std::string_view kinds) {
  std::string out(kinds == "any" ? "record" : kinds);
  for (std::size_t at = 0; (at = out.find('|', at)) != std::string::npos; at += 4)
    out.replace(at, 1, " or ");
  return out;
}

Error stale(const Handle& h) {
  return error(ErrorCode::stale_handle,
               h.kind + "#" + std::to_string(h.number) + " no longer exists",
               "It was removed, or its creation was undone. Get a new handle by name.");
}

Error caught(std::string_view command, std::string what) {
  return error(ErrorCode::internal,
               std::string(command) + " failed unexpectedly: " + std::move(what),
               "The document is as before. Please report this.");
}

/// Prepares the context for expressions, and reads those among the arguments.
Result<Map> read_expressions(CommandContext& ctx, const CommandSpec& spec, const Map& args) {
  const document::Snapshot& now = ctx.snapshot();
  model::Parametric own;
  std::string own_world;
  if (spec.params.front().name == "id") {
    const Value* given = args.find("id");
    const auto handle =
        given ? ctx.app.resolve(now, std::string_view(spec.params.front().type).substr(4), *given)
              : Result<Handle>(Handle{});
    const auto id =
        handle.ok() ? Application::record_id(now, *handle) : Result<AnyId>(handle.error());
    if (!id.ok()) return args;  // the schema's check says what is wrong
    const model::Record& record = *now.find(*id);
    if (const auto* p = model::parametric_of(record.body)) own = *p;
    if (id->kind == Kind::world) own_world = record.name;
  } else {
    if (const Value* name = args.find("name");
        name && name->as_string() && spec.name.starts_with("world."))
      own_world = *name->as_string();
    RMP_TRY_ASSIGN(own, read_parameters(now, own_world, args.find("parameters"), "parameters"));
  }
  ctx.expressions = Expressions(now, std::move(own), std::move(own_world));
  return ctx.expressions.read(spec.params, args, "");
}

}  // namespace

Application::Application(ApplicationOptions options)
    : plugins(registry),
      derived(registry),
      runs(std::make_unique<Runs>()),
      share(executable_folder() / ".." / "share" / "robomosp"),
      options_(std::move(options)) {
  library = library_path(options_, share);
  derived.set_enabled(options_.cache);
}

Application::~Application() {
  components_.stop_all();
  // Posted tasks may refer to what is destroyed next; they are run or dropped here, not later.
  jobs.cancel_all();
}

Result<void> Application::start() {
  const auto add = [this](std::string id, Layer layer, std::vector<std::string> needs,
                          std::function<Result<void>()> on_start = {},
                          std::function<void()> on_stop = {}) {
    return components_.add({std::move(id), layer, std::move(needs)},
                           std::make_unique<Part>(std::move(on_start), std::move(on_stop)));
  };
  using enum Layer;
  RMP_TRY(add("messages", core, {}));
  RMP_TRY(add("registry", core, {"messages"}));
  RMP_TRY(add("jobs", core, {"messages"}, {}, [this] { jobs.cancel_all(); }));
  RMP_TRY(add("spatial", data_processing, {}));
  RMP_TRY(add("model", data_processing, {"spatial"}));
  RMP_TRY(add("robotics", data_processing, {"model"}));
  RMP_TRY(add("motion", data_processing, {"model", "registry"}));
  RMP_TRY(add("plugins", data_processing, {"registry", "messages"}, [this]() -> Result<void> {
    plugins.set_search_path(PluginLoader::search_path(options_.plugin_path));
    plugins.load_all();
    // The fastest for arms; where it is absent, the first that there is.
    (void)registry.set_default(ForwardDynamics::kInterfaceId, "inertia_matrix");
    for (const PluginReport& report : plugins.reports()) {
      if (report.refusal)
        messages.post(Severity::warning, "plugin_refused", report.refusal->sentence(),
                      "plugin_loader");
      for (const std::string& remark : report.remarks)
        messages.post(Severity::warning, "plugin_remark", remark, "plugin_loader");
    }
    return {};
  }));
  RMP_TRY(add("document", application, {"model"}));
  RMP_TRY(add("derived", application, {"document", "registry", "robotics"}));
  RMP_TRY(add("io", application, {"document"}));
  RMP_TRY(add("sim", application, {"derived", "motion", "plugins"}));
  RMP_TRY(add("ioci", application, {"document", "derived", "io", "sim", "plugins", "jobs"},
              [this]() -> Result<void> {
                register_commands(commands);
                return {};
              }));
  return components_.start_all();
}

Result<std::unique_ptr<Application>> Application::create(ApplicationOptions options) {
  std::unique_ptr<Application> app(new Application(std::move(options)));
  RMP_TRY(app->start());
  return app;
}

Result<Value> Application::dispatch(Session& session, std::string_view name, const Map& args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return commands.unknown(name);
  return run(session, *spec, args);
}

Result<Value> Application::run(Session& session, const CommandSpec& spec, const Map& args) {
  RMP_CHECK(thread.is_current(), "dispatch off the application thread");
  if (!session.may(spec.effect))
    return error(ErrorCode::permission,
                 "session " + text::quote(session.name()) + " may not run " + spec.name +
                     ", which " +
                     (spec.effect == Effect::files_read    ? std::string("reads files")
                      : spec.effect == Effect::files_write ? std::string("writes files")
                      : spec.effect == Effect::loads_code  ? std::string("loads code")
                      : spec.effect == Effect::stops
                          ? std::string("stops the program")
                          : std::string(to_string(spec.effect)) + " the document"),
                 "Start the session with the right to do so.");
  try {
    SessionProgress progress(thread, session);
    CommandContext ctx(*this, session, progress);
    ctx.given_ = &args;
    ctx.base_ = document.now();
    ctx.transaction_ = session.transaction_;

    Map with_numbers;  // instead of expressions
    if (spec.takes_expressions) {
      auto read = read_expressions(ctx, spec, args);
      if (!read.ok()) return std::move(read).error().in(spec.name);
      with_numbers = std::move(*read);
      ctx.given_ = &with_numbers;
    }
    Map checked;
    if (!spec.params.empty() || !args.empty()) {
      auto result = check(spec.params, *ctx.given_, [&](std::string_view kinds, const Value& v) {
        return resolve(ctx.snapshot(), kinds, v);
      });
      if (!result.ok()) return std::move(result).error().in(spec.name);
      checked = std::move(*result);
    }

    if (spec.own_transaction && spec.effect == Effect::edits && open_)
      return error(ErrorCode::conflict, spec.name + " cannot run while a group of edits is open",
                   "Finish the group first.");
    const bool edits = !spec.own_transaction &&
                       (spec.effect == Effect::edits || spec.effect == Effect::files_read ||
                        spec.effect == Effect::files_write);
    std::optional<document::Transaction> transaction;
    if (edits && !session.transaction_) {
      std::string label = spec.name, gesture;
      if (const Value* id = checked.find("id"); id && id->as_handle())
        if (const auto target = name_of(*id->as_handle())) label += " " + *target;
      if (const Value* g = checked.find("gesture");
          g && g->as_string() && !g->as_string()->empty()) {
        const Value* path = checked.find("path");
        gesture = label + "|" + (path ? path->text() : std::string()) + "|" + *g->as_string();
      }
      auto begun = document.begin(std::move(label), std::move(gesture));
      if (!begun.ok()) return std::move(begun).error().in(spec.name);
      transaction.emplace(std::move(*begun));
      ctx.transaction_ = &*transaction;
    }
    ctx.may_edit_ = edits;

    Result<Value> result = [&] {
      const Joined joined(session.transaction_, edits ? ctx.transaction_ : session.transaction_);
      const Joined open(open_, session.transaction_ ? session.transaction_ : open_);
      return spec.run(ctx, checked);
    }();
    if (!result.ok()) return result;
    if (transaction) {
      auto commit = transaction->commit();
      if (!commit.ok()) return std::move(commit).error();
    }
    if (spec.effect != Effect::reads)
      messages.post(Severity::info, "audit", command_line(*this, spec, args), session.name());
    return result;
  } catch (const std::bad_alloc&) {
    return error(ErrorCode::internal, spec.name + " ran out of memory",
                 "The document is as before.");
  } catch (const std::exception& e) {
    return caught(spec.name, e.what());
  } catch (...) {
    return caught(spec.name, "an unknown exception");
  }
}

Result<Value> Application::dispatch_positional(Session& session, std::string_view name,
                                               std::span<const Value> args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return commands.unknown(name);
  if (args.size() > spec->params.size())
    return error(ErrorCode::usage,
                 count_given(args.size(), "argument") + "; " + spec->name + " takes at most " +
                     std::to_string(spec->params.size()),
                 spec->params.empty() ? "Call it without arguments."
                                      : "help(\"" + spec->name + "\") lists them.",
                 spec->name);
  Map named;
  for (std::size_t i = 0; i < args.size(); ++i)
    if (!args[i].is_nil()) named.set(spec->params[i].name, args[i]);
  return run(session, *spec, named);
}

Result<void> Application::transaction(Session& session, std::string label,
                                      const std::function<Result<void>()>& body) {
  if (session.transaction_) return body();  // joins the outer group
  auto begun = document.begin(std::move(label));
  if (!begun.ok()) return std::move(begun).error();
  document::Transaction group = std::move(*begun);
  {
    const Joined joined(session.transaction_, &group);
    const Joined open(open_, &group);
    RMP_TRY(body());
  }
  auto commit = group.commit();
  if (!commit.ok()) return std::move(commit).error();
  return {};
}

Handle Application::handle(AnyId id) { return {std::string(to_string(id.kind)), id.number}; }

Result<AnyId> Application::record_id(const document::Snapshot& snapshot, const Handle& h) {
  const auto kind = kind_from(h.kind);
  if (!kind)
    return error(ErrorCode::invalid_argument, document::with_article(h.kind) + " is not a record");
  const AnyId id{*kind, h.number};
  if (!snapshot.find(id)) return stale(h);
  return id;
}

Result<Handle> Application::resolve(const document::Snapshot& snapshot, std::string_view kinds,
                                    const Value& value) const {
  const auto check_handle = [&](const Handle& h) -> Result<Handle> {
    if (!kinds_include(kinds, h.kind))
      return error(ErrorCode::invalid_argument, describe(h) + " is " +
                                                    document::with_article(h.kind) + ", not " +
                                                    document::with_article(kinds_text(kinds)));
    if (is_record_kind(h.kind)) {
      RMP_TRY(record_id(snapshot, h));
    } else if (h.kind == "recording") {
      if (!recordings.find(h.number)) return stale(h);
    } else if (h.kind == "job") {
      if (!jobs.status(h.number).ok()) return stale(h);
    } else if (h.kind == "run") {
      if (!runs->find(h.number)) return stale(h);
    } else {
      return error(ErrorCode::invalid_argument, "there is nothing of kind " + text::quote(h.kind));
    }
    return h;
  };
  if (const Handle* h = value.as_handle()) return check_handle(*h);
  const std::string* name = value.as_string();
  if (!name)
    return error(ErrorCode::invalid_argument,
                 value.text() + " is not the name of " + document::with_article(kinds_text(kinds)),
                 "Give its name or a handle.");
  for (const Kind k : kAllKinds)
    if (kinds_include(kinds, to_string(k)))
      if (const auto id = snapshot.find(k, *name)) return handle(*id);
  if (const auto h = handle_from_text(*name)) return check_handle(*h);
  for (const std::string_view kind : {"recording", "job", "run"})
    if (kinds_include(kinds, kind) && kinds != "any")
      if (const auto number = text::read_int(*name); number && *number > 0)
        return check_handle(Handle{std::string(kind), static_cast<std::uint64_t>(*number)});

  std::vector<std::string> known;
  std::string hint;
  for (const Kind k : kAllKinds) {
    if (!kinds_include(kinds, to_string(k))) continue;
    for (const AnyId id : snapshot.list(k)) known.push_back(snapshot.find(id)->name);
    if (hint.empty() && library_file(*this, k, *name))
      hint =
          std::string(to_string(k)) + ".get(" + text::quote(*name) + ") loads it from the library.";
  }
  if (hint.empty()) hint = text::did_you_mean(*name, known);
  if (hint.empty() && !known.empty() && known.size() <= 12)
    hint =
        "There " + std::string(known.size() == 1 ? "is " : "are ") + text::enumerate(known) + ".";
  return error(ErrorCode::unknown_name,
               "there is no " + kinds_text(kinds) + " " + text::quote(*name) + " in the document",
               hint);
}

std::optional<std::string> Application::name_of(const Handle& h) const {
  if (const auto kind = kind_from(h.kind)) {
    const AnyId id{*kind, h.number};
    if (open_) {
      const model::Record* r = open_->now().find(id);
      return r ? std::optional(r->name) : std::nullopt;
    }
    const auto snapshot = document.now();
    const model::Record* r = snapshot->find(id);
    return r ? std::optional(r->name) : std::nullopt;
  }
  if (h.kind == "recording") {
    const auto r = recordings.find(h.number);
    return r ? std::optional(r->title) : std::nullopt;
  }
  if (h.kind == "run")
    if (const LiveRunEntry* run = runs->find(h.number)) return run->title;
  if (h.kind == "job")
    if (const auto status = jobs.status(h.number); status.ok()) return status->label;
  return std::nullopt;
}

std::string Application::describe(const Handle& h) const {
  const std::string number = "#" + std::to_string(h.number);
  if (!is_record_kind(h.kind)) return h.kind + number;
  const auto name = name_of(h);
  return name ? h.kind + ":" + *name + number : h.kind + number;
}

namespace {

bool is_word(std::string_view s) {
  const auto letter = [](char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  return !s.empty() && letter(s[0]) && std::all_of(s.begin(), s.end(), [&](char c) {
    return letter(c) || (c >= '0' && c <= '9');
  });
}

constexpr std::string_view kGenerated = "\n\nGenerated from the command table; do not edit.";

}  // namespace

Result<void> write_reference(const CommandTable& table, const std::filesystem::path& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return error(
        ErrorCode::io,
        "the folder " + text::quote(folder.string()) + " cannot be made: " + failed.message(),
        "Check the path and its permissions.");
  const auto pages = reference_pages(table);
  for (const auto& [name, page] : pages) RMP_TRY(io::write_file(folder / name, page));
  // Pages of topics that are gone; what somebody wrote by hand stays.
  std::vector<std::filesystem::path> gone;
  for (std::filesystem::directory_iterator it(folder, failed), end; !failed && it != end;
       it.increment(failed)) {
    const auto& path = it->path();
    if (path.extension() != ".md" || pages.contains(path.filename().string())) continue;
    const auto old = io::read_file(path);
    if (old.ok() && old->find(kGenerated) != std::string::npos) gone.push_back(path);
  }
  for (const auto& path : gone) std::filesystem::remove(path, failed);
  return {};
}

std::string command_line(const Application& app, const CommandSpec& spec, const Map& args) {
  constexpr std::size_t kLongest = 400;
  std::string out = spec.name;
  if (args.empty()) return out + "()";
  out += "{";
  bool first = true;
  for (const auto& [name, value] : args) {
    if (!first) out += ", ";
    first = false;
    out += (is_word(name) ? name : "[" + text::quote(name) + "]") + " = ";
    std::string shown;
    if (value.as_string()) shown = text::quote(*value.as_string());
    else if (const Handle* h = value.as_handle())
      shown = text::quote(app.name_of(*h).value_or(app.describe(*h)));
    else shown = value.text();
    if (shown.size() > kLongest) {
      shown.resize(kLongest);
      while (!shown.empty() && (static_cast<unsigned char>(shown.back()) & 0xC0U) == 0x80U)
        shown.pop_back();
      shown += " ...";
    }
    out += shown;
  }
  return out + "}";
}

}  // namespace robomosp::ioci
