// SPDX-License-Identifier: Apache-2.0
// Calls of commands: on the document, on drafts, as jobs.
#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "document/draft.h"
#include "ioci/core/application.h"
#include "ioci/core/commands.h"
#include "ioci/core/drafts.h"
#include "ioci/core/failed_call.h"
#include "ioci/core/handle_text.h"
#include "ioci/core/lua_line.h"
#include "ioci/core/modules.h"
#include "ioci/core/origins.h"
#include "ioci/core/reads_wanted.h"
#include "ioci/core/renamed_arguments.h"
#include "ioci/core/room_parts.h"
#include "ioci/core/runs.h"
#include "ioci/core/scripted.h"
#include "ioci/core/secrets.h"
#include "ioci/core/surroundings.h"
#include "ioci/core/watchers.h"
#include "kernel/bare_numbers.h"
#include "kernel/check.h"
#include "kernel/fault.h"
#include "kernel/part_faults.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/value_text.h"

namespace robomosp::ioci {
namespace {

constexpr Effects kEveryEffect = Effects::all();
/// Effects outside the document, which are not taken back where an edit is refused or stopped.
constexpr Effects kElsewhere = Effect::files_write | Effect::processes | Effect::providers |
                               Effect::loads_code | Effect::stops | Effect::simulates;
/// What discarding a draft would not take back.
constexpr Effects kNotOnDraft =
    Effect::providers | Effect::loads_code | Effect::stops | Effect::administers;
/// How often a short command is run that others overtake.
constexpr int kMostAttempts = 8;

/// Progress of the command that a session runs, shown by the thread that runs it.
class SessionProgress final : public Progress {
 public:
  explicit SessionProgress(const Session& session) : session_(session) {}
  void report(double fraction, std::string_view what) override {
    if (session_.show_progress && std::this_thread::get_id() == thread_)
      session_.show_progress(fraction, what);
  }
  [[nodiscard]] bool cancelled() const override { return session_.interrupted(); }

 private:
  const Session& session_;
  const std::thread::id thread_ = std::this_thread::get_id();
};

/// Of a job, whose progress is there only once it runs.
class LateProgress final : public Progress {
 public:
  void report(double fraction, std::string_view what) override {
    if (to_) to_->report(fraction, what);
  }
  [[nodiscard]] bool cancelled() const override { return to_ && to_->cancelled(); }
  void set(Progress* to) { to_ = to; }

 private:
  Progress* to_ = nullptr;
};

/// Restores a value when a scope ends.
template <class T>
class Restored {
 public:
  Restored(T& slot, T now) : slot_(slot), before_(slot) { slot_ = now; }
  ~Restored() { slot_ = before_; }
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;

 private:
  T& slot_;
  T before_;
};
/// What a session joins.
using ScopedTransaction = Restored<document::Transaction*>;

Error caught(std::string_view command, std::string what) {
  return error(ErrorCode::internal,
               std::string(command) + " failed unexpectedly: " + std::move(what),
               "The document is unchanged. Please report this.");
}

/// Whether a text is among arguments, at any depth.
bool holds(const Map& args, std::string_view text);
bool holds(const Value& v, std::string_view text) {
  if (const std::string* s = v.as_string()) return s->find(text) != std::string::npos;
  if (const Map* map = v.as_map()) return holds(*map, text);
  const List* list = v.as_list();
  return list && std::any_of(list->begin(), list->end(),
                             [&](const Value& item) { return holds(item, text); });
}
bool holds(const Map& args, std::string_view text) {
  return std::any_of(args.begin(), args.end(),
                     [&](const auto& entry) { return holds(entry.second, text); });
}

/// Whether a number is among arguments, at any depth.
// NOLINTBEGIN(misc-no-recursion): values are as deep as what made them
bool holds(const Value& v, double number) {
  if (v.is_number()) return v.number() == number;
  if (const NumericArray* a = v.as_array())
    return std::find(a->data().begin(), a->data().end(), number) != a->data().end();
  if (const Map* map = v.as_map())
    return std::any_of(map->begin(), map->end(),
                       [&](const auto& entry) { return holds(entry.second, number); });
  const List* list = v.as_list();
  return list && std::any_of(list->begin(), list->end(),
                             [&](const Value& item) { return holds(item, number); });
}
// NOLINTEND(misc-no-recursion)

/// Prepares the context for expressions, and reads those among the arguments.
Result<Map> read_expressions(CommandContext& ctx, const CommandSpec& spec, const Map& args) {
  RMP_TRY_ASSIGN(ctx.expressions, expressions_of(ctx, spec, args));
  return ctx.expressions.read(spec.params, args, "");
}

/// Commands that this thread runs, one within another.
thread_local std::size_t running_here = 0;

}  // namespace

/// One dispatch: start() reads the arguments, compute() runs the command without the application
/// lock, finish() publishes what it edited.
class Application::Call {
 public:
  /// `args` outlives it. What it edits joins `joined`, if there is one. `is_own_thread`: it
  /// computes on the session's thread, so that what a script does meanwhile joins it.
  Call(Application& app, Session& session, const CommandSpec& spec, const Map& args,
       document::Transaction* joined, Progress& progress, bool is_own_thread, Effects allowed,
       Place place)
      : app_(app),
        session_(session),
        spec_(spec),
        args_(args),
        is_own_thread_(is_own_thread),
        place_(std::move(place)),
        all_(spec.effect | spec.sometimes | Effect::reads),
        // The program's own commands are stopped by what they declare; of a plugin's that is a
        // right that it lacks.
        denied_(session.denied_to(spec.name) | denied_within()),
        permit_{session.name(),
                spec.name,
                all_,
                denied_ | beyond(spec, allowed, all_) | (place_.draft ? kNotOnDraft : Effects()),
                false,
                !denied_within().empty(),
                files_of(session)},
        ctx_(app, session, progress) {
    ctx_.given_ = &args_;
    ctx_.allowed_ = spec.plugin.empty() ? allowed : narrowed(allowed, all_);
    ctx_.base_ = records();
    ctx_.transaction_ = joined;
    ctx_.is_own_thread_ = is_own_thread;
    ctx_.draft_ = place_.draft;
    ctx_.draft_number_ = place_.number;
    ctx_.is_trial_ = place_.is_trial;
    ctx_.gesture_ = place_.gesture;
  }

  Result<void> start();
  Result<Value> compute();
  Result<Value> finish(Result<Value> result);
  void set_job() { is_job_ = true; }
  /// Tells of texts that were taken as quantities in SI units.
  void tell(const BareNumbers& bare);
  /// In a confined session, paths stay what they were read as wherever they are used later.
  void keep_paths();
  /// Opens the transaction of a command that edits. `series`: the word that joins steps, or "".
  Result<void> begin_edit(const std::string& series);
  /// Of a world with one robot that one need not be named.
  void fill_lone_robot();
  /// Robots that a command takes by name, in a world or a recording, may be given as records.
  Result<void> name_robot();
  /// The error of this call with what its faults are about (failed_call.h).
  [[nodiscard]] Error completed(Error e) {
    const bool joins = ctx_.transaction_ && !transaction_;
    const document::SnapshotPtr kept = joins ? nullptr : records();
    // Within a group only what the session itself called, as commands may fail inside another.
    const bool may_try = place_.gesture == 0 && (!joins || running_here <= 1);
    complete_faults(e, {ctx_, kept ? *kept : ctx_.snapshot(), spec_, args_, may_try});
    return e;
  }
  /// Whether finish() refused, because others changed what it had looked at.
  [[nodiscard]] bool is_overtaken() const { return transaction_ && transaction_->is_overtaken(); }
  /// The command and what it works on: "world.plan_path cell".
  [[nodiscard]] std::string label() const;

 private:
  /// What finish() does before hooks are called.
  Result<Value> settle(Result<Value> result);
  /// The records as they are now where it edits.
  [[nodiscard]] document::SnapshotPtr records() const {
    return place_.draft ? place_.draft->now() : app_.document.now();
  }
  /// Why it cannot run on a draft.
  [[nodiscard]] Error not_on_draft(std::string_view why) const {
    return error(ErrorCode::unsupported, spec_.name + " cannot run on a draft: " + std::string(why),
                 "Run it outside of the draft, or accept the draft first.");
  }
  /// Of the session; where it has none, of what this is a part of.
  [[nodiscard]] static std::shared_ptr<const FileRoot> files_of(const Session& session) {
    if (session.files()) return session.files();
    return current_permit() ? current_permit()->files : nullptr;
  }
  /// What is denied besides what the session is denied. Whether one of the program's own starts a
  /// program lies with the provider that is chosen, and is not in the table.
  [[nodiscard]] static Effects beyond(const CommandSpec& spec, Effects allowed, Effects all) {
    if (!spec.plugin.empty()) return kEveryEffect.without(narrowed(allowed, all));
    const Effects denied = kEveryEffect.without(allowed);
    return all.has(Effect::processes) ? denied : denied.without(Effect::processes);
  }
  [[nodiscard]] static Effects narrowed(Effects some, Effects to) {
    return some.without(kEveryEffect.without(to));
  }
  [[nodiscard]] std::uint32_t run_kind() const {
    return spec_.runs == RunKind::simulation ? kModuleRunSimulation
           : spec_.runs == RunKind::task     ? kModuleRunTask
           : is_job_                         ? kModuleRunJob
                                             : 0U;
  }
  Application& app_;
  Session& session_;
  const CommandSpec& spec_;
  const Map& args_;
  const bool is_own_thread_;
  bool is_job_ = false;
  const Place place_;
  const Effects all_;
  const Effects denied_;  ///< to the session, and to what runs here
  const Permit permit_;
  CommandContext ctx_;
  Map without_gesture_, with_new_words_, with_robot_, with_name_, with_paths_,
      with_numbers_;  ///< the arguments without old words, and without expressions
  Map checked_;
  std::optional<GivenExpressions> expressions_;  ///< of commands that edit
  std::optional<document::Transaction> transaction_;
  std::optional<ModuleRunScope> hooked_;
};

std::string Application::Call::label() const {
  std::string out = spec_.name;
  if (const Value* id = checked_.find("id"); id && id->as_handle())
    if (const auto target = app_.name_in(ctx_.snapshot(), *id->as_handle())) out += " " + *target;
  return out;
}

void Application::Call::tell(const BareNumbers& bare) {
  if (bare.empty()) return;
  for (std::string& said :
       bare.sentences([&](std::string_view text) { return holds(args_, text); }))
    app_.messages.post(Severity::info, "bare_number", spec_.name + ": " + std::move(said),
                       session_.name());
  const auto is_given = [&](double number) {
    return std::any_of(args_.begin(), args_.end(),
                       [&](const auto& entry) { return holds(entry.second, number); });
  };
  const auto numbers = bare.numbers(is_given);
  if (numbers.empty()) return;
  // A loop over many such numbers says it once; so does what is read once more for a link's units.
  const auto recent = app_.messages.recent(20);
  for (const std::string& said : numbers) {
    std::string sentence = spec_.name + ": " + said;
    const std::string beginning = sentence.substr(0, sentence.find(" = ") + 3);
    const std::string meaning = said.substr(said.find(" is taken as "));
    if (std::none_of(recent.begin(), recent.end(), [&](const Message& m) {
          return m.code == "likely_unit" &&
                 (m.text.starts_with(beginning) ||
                  (m.text.starts_with(spec_.name) && m.text.ends_with(meaning)));
        }))
      app_.messages.post(Severity::info, "likely_unit", sentence, session_.name());
  }
}

void Application::Call::keep_paths() {
  if (!permit_.files) return;
  for (const ParamSpec& p : spec_.params) {
    const Value* read = plain_type(p.type) == "path" ? checked_.find(p.name) : nullptr;
    if (!read || !ctx_.given_->find(p.name)) continue;
    if (ctx_.given_ != &with_paths_) with_paths_ = *ctx_.given_;
    with_paths_.set(p.name, *read);
    ctx_.given_ = &with_paths_;
  }
}

Result<void> Application::Call::begin_edit(const std::string& series) {
  // The target's name, or what was given for it where it is yet to be loaded.
  std::string label = spec_.name;
  if (const Value* id = ctx_.given_->find("id")) {
    const Handle* handle = id->as_handle();
    const std::string* word = id->as_string();
    std::optional<Handle> from_text;
    if (!handle && word && (from_text = handle_from_text(app_.handle_kinds, *word)))
      handle = &*from_text;
    if (handle) {
      if (const auto target = app_.name_in(ctx_.snapshot(), *handle)) label += " " + *target;
    } else if (word) {
      label += " " + *word;
    }
  }
  std::string shared;
  if (!series.empty()) {
    const Value* path = ctx_.given_->find("path");
    shared = label + "|" + (path ? path->text() : std::string()) + "|" + series;
  }
  if (!app_.document.gestures().empty()) app_.end_orphaned_gestures();
  const std::uint64_t gesture = is_own_thread_ ? session_.gesture_ : place_.gesture;
  auto begun = place_.draft ? place_.draft->begin(label)
               : gesture    ? app_.document.begin_update(gesture)
                            : app_.document.begin(label, app_.author(session_), std::move(shared));
  if (!begun.ok()) return std::move(begun).error().in(spec_.name);
  transaction_.emplace(std::move(*begun));
  transaction_->base_on(ctx_.base_);  // what the arguments are read from
  ctx_.transaction_ = &*transaction_;
  return {};
}

void Application::Call::fill_lone_robot() {
  const Schema& params = spec_.params;
  if (params.empty() || params.front().name != "id" || params.front().type != "ref:world" ||
      ctx_.given_->find("robot"))
    return;
  const auto robot = std::find_if(params.begin(), params.end(), [](const ParamSpec& p) {
    return p.name == "robot" && p.required && !p.type.starts_with("ref:");
  });
  const Value* id = ctx_.given_->find("id");
  if (robot == params.end() || !id) return;
  const auto handle = app_.resolve(ctx_.snapshot(), "world", *id);
  if (!handle.ok()) return;
  const auto& placed = ctx_.snapshot().get(WorldId{handle->number})->robots;
  if (placed.size() != 1) return;
  with_robot_ = *ctx_.given_;
  with_robot_.set("robot", placed.front().name);
  ctx_.given_ = &with_robot_;
}

namespace {

/// The world whose members the arguments of a command name: that of `world`, else the one that it
/// is about, or the world of a recording or live run; number 0 = none.
WorldId world_of_names(const CommandContext& ctx, const CommandSpec& spec, const Map& given) {
  for (const char* name : {"world", "id", "what"}) {
    const ParamSpec* p = find_param(spec.params, name);
    const Value* v = p ? given.find(name) : nullptr;
    const std::string_view type = v ? plain_type(p->type) : std::string_view();
    if (!type.starts_with("ref:")) continue;
    const auto found = ctx.resolve(type.substr(4), *v);
    if (!found.ok()) continue;
    Handle h = *found;
    if (h.kind == "run") {
      const LiveRunPtr run = ctx.app.runs->find(h.number);
      h = run ? run->subject : Handle{};
    }
    if (h.kind == "world") return WorldId{h.number};
    if (h.kind != "recording") continue;
    if (const auto recording = ctx.app.recordings.find(h.number)) return recording->world;
  }
  return {};
}

}  // namespace

Result<void> Application::Call::name_robot() {
  const Value* given = ctx_.given_->find("robot");
  const ParamSpec* p = given ? find_param(spec_.params, "robot") : nullptr;
  if (!p || plain_type(p->type) != "string") return {};
  const std::string* text = given->as_string();
  const Handle* handle = given->as_handle();
  if (!text && (!handle || handle->kind != "robot")) return {};
  const document::Snapshot& now = ctx_.snapshot();
  const auto* world = now.get(world_of_names(ctx_, spec_, *ctx_.given_));
  // A text is the name of a member if there is one; the lines of calls have the record's.
  if (text && world &&
      std::any_of(world->robots.begin(), world->robots.end(),
                  [text](const model::PlacedRobot& r) { return r.name == *text; }))
    return {};
  auto found = text ? handle_by_name(now, "robot", *text) : std::optional(*handle);
  if (!found) found = handle_from_text(app_.handle_kinds, *text);
  if (!found || found->kind != "robot") return {};  // the command reports it
  auto id = record_id(now, *found);
  if (!id.ok()) return std::move(id).error().in("robot").in(spec_.name);
  std::string name = now.find(*id)->name;
  if (world) {
    const auto is_placed = [&](const model::PlacedRobot& r) { return AnyId(r.robot) == *id; };
    const auto& robots = world->robots;
    const auto first = std::find_if(robots.begin(), robots.end(), is_placed);
    if (first == robots.end() && text) return {};
    if (first == robots.end())
      return error(ErrorCode::unknown_name, now.describe(*id) + " is not in the world",
                   "Add it with world.add_robot, or give another one.", "robot")
          .in(spec_.name);
    if (std::find_if(first + 1, robots.end(), is_placed) != robots.end())
      return error(ErrorCode::conflict, now.describe(*id) + " is placed more than once",
                   "Give the member's name.", "robot")
          .in(spec_.name);
    name = first->name;
  }
  with_name_ = *ctx_.given_;
  with_name_.set("robot", std::move(name));
  ctx_.given_ = &with_name_;
  return {};
}

Result<void> Application::Call::start() {
  if ((spec_.effect | Effect::reads).meets(kEveryEffect.without(ctx_.allowed_)))
    return error(ErrorCode::permission,
                 "what called " + spec_.name + " may have the effects " + ctx_.allowed_.text() +
                     " only, and " + spec_.name + " has " + spec_.effect.text(),
                 "The plugin's command must declare them.");
  if ((spec_.effect | Effect::reads).meets(denied_))
    for (const Effect e : (spec_.effect | Effect::reads).list()) {
      if (session_.denied_to(spec_.name).has(e))
        return not_permitted(session_.name(), spec_.name, e);
      if (denied_.has(e))
        return error(ErrorCode::permission,
                     "a solver that came with a file may not run " + spec_.name + ", which " +
                         std::string(phrase(e)),
                     "Such a solver may only compute and read the document.");
    }
  if (place_.draft) {
    if (spec_.own_transaction)
      return not_on_draft("it works on the document's history and not on records");
    for (const Effect e : spec_.effect.list())
      if (Effects(kNotOnDraft).has(e))
        return not_on_draft("it " + std::string(phrase(e)) +
                            ", which discarding the draft would not take back");
    if (spec_.effect.has(Effect::edits) && spec_.effect.has(Effect::files_write))
      return not_on_draft("it saves records, and those of a draft are not the document's yet");
    if (const Value* watch = args_.find("watch"); watch && watch->as_bool() && *watch->as_bool())
      return not_on_draft("what is watched follows the document");
  }
  const PermitScope permitted(&permit_);
  const bool has_edits = all_.has(Effect::edits);
  std::string series;  // edits in a row with the same word share a step
  if (const Value* word = has_edits ? args_.find("gesture") : nullptr;
      word && word->as_string() && spec_.name != "gesture.begin" &&
      std::none_of(spec_.params.begin(), spec_.params.end(),
                   [](const ParamSpec& p) { return p.name == "gesture"; })) {
    series = *word->as_string();
    without_gesture_ = args_;
    without_gesture_.erase("gesture");
    ctx_.given_ = &without_gesture_;
    if (!std::exchange(session_.told_gesture_, true))
      app_.messages.post(Severity::info, "old_word",
                         "The argument gesture is from before; gesture.begin, gesture.update and "
                         "gesture.commit make one step of any commands.",
                         session_.name());
  }
  if (auto renamed = with_new_words(spec_.name, *ctx_.given_)) {
    app_.messages.post(Severity::info, "old_word", renamed->note, session_.name());
    with_new_words_ = std::move(renamed->args);
    ctx_.given_ = &with_new_words_;
  }
  const bool may_edit = !spec_.own_transaction && has_edits;
  const bool joins = ctx_.transaction_ != nullptr;
  ctx_.may_edit_ = may_edit;
  fill_lone_robot();
  // Before the arguments are read, as these may name what is loaded from the library.
  if (may_edit && !joins) RMP_TRY(begin_edit(series));
  RMP_TRY(name_robot());
  if (spec_.takes_expressions) {
    auto read = read_expressions(ctx_, spec_, *ctx_.given_);
    if (!read.ok()) {
      // Expressions need the parameters that come with them: their faults first.
      const ParamSpec* own = find_param(spec_.params, "parameters");
      const Value* given = own ? ctx_.given_->find(own->name) : nullptr;
      if (given)
        if (auto faults = part_faults(*own, *given, own->name); !faults.empty())
          return error_of(std::move(faults)).in(spec_.name);
      return std::move(read).error().in(spec_.name);
    }
    with_numbers_ = std::move(*read);
    ctx_.given_ = &with_numbers_;
  }
  if (may_edit) expressions_.emplace(ctx_, spec_, args_);
  if (!spec_.params.empty() || !ctx_.given_->empty()) {
    const BareNumbers bare;
    const NumberReader::Scope numbers(may_edit ? &*expressions_ : nullptr);
    auto result = check(spec_.params, *ctx_.given_, [&](std::string_view kinds, const Value& v) {
      // What is not there need not be loaded to be removed.
      return spec_.name.ends_with(".remove") ? app_.resolve(ctx_.snapshot(), kinds, v)
                                             : ctx_.resolve(kinds, v);
    });
    if (!result.ok()) return std::move(result).error().in(spec_.name);
    checked_ = std::move(*result);
    tell(bare);
    keep_paths();
  }
  if (spec_.own_transaction && has_edits && joins)
    return error(ErrorCode::conflict, spec_.name + " cannot run while a group of edits is open",
                 "Finish the group first.");
  return {};
}

Result<Value> Application::Call::compute() {
  const PermitScope permitted(&permit_);
  const auto body = [&] {
    const BareNumbers bare;  // of tables within the arguments
    const NumberReader::Scope numbers(expressions_ ? &*expressions_ : nullptr);
    auto answer = spec_.run ? spec_.run(ctx_, checked_) : spec_.plugged(ctx_, checked_);
    if (answer.ok()) tell(bare);
    if (answer.ok() && expressions_ && ctx_.transaction_)
      if (auto kept = expressions_->keep(*ctx_.transaction_); !kept.ok())
        return Result<Value>(std::move(kept).error().in(spec_.name));
    return answer;
  };
  try {
    if (const std::uint32_t kind = run_kind(); kind && app_.modules->watches(kind)) {
      hooked_.emplace(*app_.modules, ctx_, spec_, checked_, kind, is_job_);
      RMP_TRY(hooked_->begin());
    }
    if (!is_own_thread_) return body();
    const ScopedTransaction scoped(session_.transaction_,
                                   ctx_.may_edit_ ? ctx_.transaction_ : session_.transaction_);
    return body();
  } catch (const StaleHandle& gone) {
    return stale_handle(gone.handle);
  } catch (const std::bad_alloc&) {
    return error(ErrorCode::internal, spec_.name + " ran out of memory",
                 "The document is unchanged.");
  } catch (const std::exception& e) {
    return caught(spec_.name, e.what());
  } catch (...) {
    return caught(spec_.name, "an unknown exception");
  }
}

Result<Value> Application::Call::finish(Result<Value> result) {
  if (result.ok() && spec_.effect.has(Effect::simulates))
    if (const std::uint64_t made = recording_in(*result)) {
      const PermitScope permitted(&permit_);
      app_.origins->note(ctx_.snapshot(), spec_.name, *ctx_.given_, checked_, *result);
      if (flag(checked_, "watch")) RMP_TRY(app_.watchers->add_recording(made));
    }
  result = settle(std::move(result));
  if (!hooked_) return result;
  if (transaction_) {  // the records as they are now
    ctx_.transaction_ = nullptr;
    ctx_.base_ = records();
  }
  hooked_->end(result);
  return result;
}

Result<Value> Application::Call::settle(Result<Value> result) {
  if (!result.ok()) {
    // What neither the session nor what runs here is denied, the draft is.
    if (permit_.was_refused && place_.draft && !denied_.meets(all_))
      return not_on_draft("with these arguments it changes more than records");
    if (!permit_.was_refused || result.error().code == ErrorCode::permission) return result;
    Error refused = std::move(result).error();
    refused.code = ErrorCode::permission;
    return refused;
  }
  const PermitScope permitted(&permit_);
  try {
    if (transaction_) {
      // What has effects elsewhere is done by now and is not taken back.
      const bool can_stop = !is_own_thread_ && !all_.meets(kElsewhere);
      if (auto done = complete_in_rooms(ctx_); !done.ok()) return std::move(done).error();
      auto commit = transaction_->commit(can_stop ? &ctx_.progress : nullptr);
      if (!commit.ok()) return std::move(commit).error();
      if (place_.draft && !place_.is_trial && !commit->changed.empty())
        app_.kept<Drafts>().tell_edited(place_.number, *place_.draft, *commit);
    }
    if (all_ != Effects(Effect::reads) && !place_.is_trial)
      app_.messages.post(Severity::info, "audit", command_line(app_, spec_, args_),
                         session_.name());
    return result;
  } catch (const std::exception& e) {
    return caught(spec_.name, e.what());
  }
}

Result<Value> Application::run(Session& session, const CommandSpec& spec, const Map& args,
                               document::Transaction* joined, Progress& progress,
                               bool is_own_thread, Effects allowed, const Place& place) {
  RMP_CHECK(!AppLock::is_any_held(), "a command was dispatched by who holds the application lock");
  // Commands with effects outside the document are done once and for all.
  const bool can_repeat = !(spec.effect | spec.sometimes).meets(kElsewhere);
  for (int attempt = 1;; ++attempt) {
    Call call(*this, session, spec, args, joined, progress, is_own_thread, allowed, place);
    const auto begin = std::chrono::steady_clock::now();
    if (auto begun = call.start(); !begun.ok()) return call.completed(std::move(begun).error());
    Result<Value> result = call.finish(call.compute());
    if (result.ok()) return result;
    if (!call.is_overtaken() || !can_repeat || attempt == kMostAttempts ||
        std::chrono::steady_clock::now() - begin > AppLock::kLongestHold)
      return call.completed(std::move(result).error());
  }
}

namespace {

/// An error may repeat what was given, which may be long.
template <class T>
Result<T> readable(Result<T> result) {
  if (result.ok()) return result;
  return text::shortened(std::move(result).error());
}

/// Names of files in the folder of the session as it gives them, relative to that.
// NOLINTNEXTLINE(misc-no-recursion): values are as deep as what made them
Value seen_from(const FileRoot& root, Value value, int depth = 0) {
  constexpr int kDeepest = 64;
  if (depth > kDeepest) return value;
  if (const std::string* s = value.as_string()) {
    if (s->starts_with(root.folder().native())) return Value(root.shown_name(*s));
  } else if (const List* list = value.as_list()) {
    List out;
    for (const Value& each : *list) out.push_back(seen_from(root, each, depth + 1));
    return Value(std::move(out));
  } else if (const Map* map = value.as_map()) {
    Map out;
    for (const auto& [name, each] : *map) out.set(name, seen_from(root, each, depth + 1));
    return Value(std::move(out));
  }
  return value;
}

/// What a session gets to see of a result.
Result<Value> for_session(const std::shared_ptr<const FileRoot>& root, Result<Value> result) {
  if (!root) return readable(std::move(result));
  if (result.ok()) return seen_from(*root, std::move(*result));
  Error e = std::move(result).error();
  edit_texts(e, [&root](std::string part) { return root->shown(std::move(part)); });
  return text::shortened(std::move(e));
}

}  // namespace

/// Tells those who want to know of a command that a session called, when it ends; what it
/// dispatches itself is a part of it.
class Application::Told {
 public:
  Told(Application& app, Session& session, const CommandSpec& spec, const Map& args,
       const Place& place)
      : app_(app), spec_(spec), args_(args), place_(place) {
    if (running_here++ > 0) return;
    topics_ = app.events.topics();
    if (!(topics_ & bit(Topic::command))) return;
    only_reads_ = (spec.effect | spec.sometimes | Effect::reads) == Effects(Effect::reads);
    // Before it runs, as it may remove what its handles name. A command that only reads removes
    // nothing, and its line is often not wanted.
    if (!only_reads_ || (topics_ & kReadsWanted)) line_ = lua_line(app, spec, args);
    author_ = app.author(session);
    begin_ = std::chrono::steady_clock::now();
  }
  ~Told() { --running_here; }
  Told(const Told&) = delete;
  Told& operator=(const Told&) = delete;
  void end(const Result<Value>& result) {
    if (running_here > 1) return;
    if ((topics_ & bit(Topic::command)) && (line_ || !result.ok())) {
      if (!line_) line_ = lua_line(app_, spec_, args_);
      CommandRun run;
      run.command = spec_.name;
      run.line = std::move(line_->text);
      run.is_whole = line_->is_whole;
      run.author = author_;
      run.seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
      run.only_reads = only_reads_;
      if (!result.ok()) run.failure = result.error();
      run.job = Jobs::here();
      run.gesture = place_.gesture;
      run.draft = place_.number;
      run.is_scripted = is_scripted_;
      app_.events.publish(std::move(run));
    }
    if (topics_ & kSurroundings) app_.kept<Surroundings>().look();
  }

 private:
  Application& app_;
  const CommandSpec& spec_;
  const Map& args_;
  const Place& place_;
  std::uint32_t topics_ = 0;
  bool only_reads_ = false;
  bool is_scripted_ = ScriptedCalls::here();
  std::optional<LuaLine> line_;
  document::Author author_;
  std::chrono::steady_clock::time_point begin_;
};

Result<Value> Application::run_outermost(Session& session, const CommandSpec& spec, const Map& args,
                                         document::Transaction* joined, Progress& progress,
                                         bool is_own_thread, const Place& place) {
  Told told(*this, session, spec, args, place);
  Result<Value> result = for_session(session.files_, run(session, spec, args, joined, progress,
                                                         is_own_thread, kEveryEffect, place));
  told.end(result);
  return result;
}

Result<Value> Application::dispatch(Session& session, std::string_view name, const Map& args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  return dispatch(session, *spec, args);
}

Result<Value> Application::dispatch(Session& session, const CommandSpec& spec, const Map& args) {
  SessionProgress progress(session);
  return run_outermost(session, spec, args, session.transaction_, progress, true,
                       {.gesture = session.gesture_});
}

Result<Value> Application::dispatch_on_draft(Session& session, std::uint64_t draft,
                                             std::string_view name, const Map& args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  if (session.transaction_)
    return error(ErrorCode::conflict, "a draft cannot be edited while a group of edits is open",
                 "Finish the group first.", spec->name);
  RMP_TRY_ASSIGN(auto on, kept<Drafts>().own(session, draft));
  SessionProgress progress(session);
  return run_outermost(session, *spec, args, nullptr, progress, true,
                       {.number = draft, .draft = std::move(on)});
}

Result<Value> Application::dispatch_beside(Session& session, std::string_view name, const Map& args,
                                           Progress& progress) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  return run_outermost(session, *spec, args, nullptr, progress, false, Place());
}

Result<Value> Application::dispatch_within(CommandContext& outer, std::string_view name,
                                           const Map& args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  return run(outer.session, *spec, args, outer.transaction_, outer.progress, outer.is_own_thread_,
             outer.allowed_,
             {.gesture = outer.gesture_,
              .number = outer.draft_number_,
              .draft = outer.draft_,
              .is_trial = outer.is_trial_});
}

Result<Value> Application::dispatch_on_trial(CommandContext& outer,
                                             const std::shared_ptr<document::Draft>& draft,
                                             std::string_view name, const Map& args,
                                             Progress& progress) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  return for_session(outer.session.files_,
                     run(outer.session, *spec, args, nullptr, progress, outer.is_own_thread_,
                         outer.allowed_, {.draft = draft, .is_trial = true}));
}

Result<Handle> Application::run_async(Session& session, const CommandSpec& spec, Map args,
                                      Place place) {
  if (session.transaction_)
    return error(ErrorCode::conflict, "a job cannot start while a group of edits is open",
                 "Finish the group first.", spec.name);
  if (spec.own_transaction)
    return error(ErrorCode::usage, spec.name + " works on the history and cannot be a job",
                 "Call it without a job.", spec.name);
  struct Job {
    Job(Application& app, Session& session, const CommandSpec& spec, Map given, Place where)
        : args(std::move(given)),
          place(std::move(where)),
          call(app, session, spec, args, nullptr, progress, false, kEveryEffect, place) {
      call.set_job();
    }
    Map args;
    const Place place;
    LateProgress progress;
    Call call;
  };
  const document::Author who = author(session);
  JobOwner owner{who.session, who.name, place.gesture, place.number};
  const auto job = std::make_shared<Job>(*this, session, spec, std::move(args), std::move(place));
  if (auto begun = job->call.start(); !begun.ok())
    return for_session(session.files_, job->call.completed(std::move(begun).error())).error();
  const std::uint64_t id =
      jobs.submit(job->call.label(), std::move(owner),
                  [this, job, &session, &spec, files = session.files_](Progress& progress) {
                    job->progress.set(&progress);
                    // The session waits for its jobs before it ends.
                    Told told(*this, session, spec, job->args, job->place);
                    auto done = job->call.finish(job->call.compute());
                    if (!done.ok()) done = job->call.completed(std::move(done).error());
                    auto result = for_session(files, std::move(done));
                    told.end(result);
                    return result;
                  });
  session.jobs_ = shared_jobs_;
  std::erase_if(session.own_, [&](std::uint64_t old) {
    const auto status = jobs.status(old);
    return !status.ok() ||
           (status->state != JobState::waiting && status->state != JobState::running);
  });
  session.own_.push_back(id);
  return Handle{"job", id};
}

Result<Value> Application::update_gesture(Session& session, std::uint64_t gesture,
                                          std::string_view name, const Map& args) {
  RMP_TRY(own_gesture(session, gesture));
  const Restored<std::uint64_t> updating(session.gesture_, gesture);
  return dispatch(session, name, args);
}

namespace {

/// Arguments by position as arguments by name.
Result<Map> named_arguments(const CommandSpec& spec, std::span<const Value> args) {
  if (args.size() > spec.params.size())
    return error(ErrorCode::usage,
                 count_given(args.size(), "argument") + "; " + spec.name + " takes at most " +
                     std::to_string(spec.params.size()),
                 spec.params.empty() ? "Call it without arguments."
                                     : "help(\"" + spec.name + "\") lists them.",
                 spec.name);
  Map named;
  for (std::size_t i = 0; i < args.size(); ++i)
    if (!args[i].is_nil()) named.set(spec.params[i].name, args[i]);
  return named;
}

}  // namespace

Result<Handle> Application::dispatch_async(Session& session, std::string_view name, Map args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  return run_async(session, *spec, std::move(args), Place());
}

Result<Handle> Application::dispatch_async(Session& session, std::string_view name, Map args,
                                           Joined joined) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  RMP_CHECK(joined.gesture == 0 || joined.draft == 0, "a job joined a gesture and a draft");
  Place place{joined.gesture, joined.draft};
  if (joined.gesture) RMP_TRY(own_gesture(session, joined.gesture));
  if (joined.draft) {
    RMP_TRY_ASSIGN(place.draft, kept<Drafts>().own(session, joined.draft));
  }
  return run_async(session, *spec, std::move(args), std::move(place));
}

Result<Handle> Application::dispatch_async_positional(Session& session, std::string_view name,
                                                      std::span<const Value> args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  RMP_TRY_ASSIGN(Map named, named_arguments(*spec, args));
  return run_async(session, *spec, std::move(named), Place());
}

Result<Value> Application::dispatch_positional(Session& session, std::string_view name,
                                               std::span<const Value> args) {
  const CommandSpec* spec = commands.find(name);
  if (!spec) return text::shortened(commands.unknown(name));
  RMP_TRY_ASSIGN(const Map named, named_arguments(*spec, args));
  return dispatch(session, *spec, named);
}

Result<void> Application::transaction(Session& session, std::string label,
                                      const std::function<Result<void>()>& body) {
  if (session.transaction_) return body();  // joins the outer group
  auto begun = document.begin(std::move(label), author(session));
  if (!begun.ok()) return std::move(begun).error();
  document::Transaction group = std::move(*begun);
  {
    const ScopedTransaction scoped(session.transaction_, &group);
    RMP_TRY(body());
    SessionProgress progress(session);
    CommandContext ctx(*this, session, progress);
    ctx.transaction_ = &group;
    ctx.may_edit_ = true;
    RMP_TRY(complete_in_rooms(ctx));
  }
  auto commit = group.commit();
  if (!commit.ok()) return std::move(commit).error();
  return {};
}

std::string command_line(const Application& app, const CommandSpec& spec, const Map& args) {
  constexpr std::size_t kLongest = 400;
  if (has_secrets(args)) return command_line(app, spec, without_secrets(args));
  std::string out = spec.name;
  if (args.empty()) return out + "()";
  out += "{";
  bool first = true;
  for (const auto& [name, value] : args) {
    if (!first) out += ", ";
    first = false;
    out += (is_plain_name(name) ? name : "[" + text::quote(name) + "]") + " = ";
    std::string shown;
    if (value.as_string()) shown = text::quote(beginning_of(value, kLongest));
    else if (const Handle* h = value.as_handle())
      shown = text::quote(app.name_of(*h).value_or(app.describe(*h)));
    else shown = beginning_of(value, kLongest);
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
