// SPDX-License-Identifier: Apache-2.0
// Application: the program without front ends; owns the parts, starts them as components and
// dispatches commands (layer: application).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <typeindex>
#include <vector>

#include "collision/cache.h"
#include "document/document.h"
#include "evaluation/derived.h"
#include "io/recovery_journal.h"
#include "ioci/core/classic_state.h"
#include "ioci/core/command.h"
#include "ioci/core/events.h"
#include "ioci/core/handle_kinds.h"
#include "ioci/core/path_cache.h"
#include "ioci/core/solver_cache.h"
#include "kernel/app_lock.h"
#include "kernel/component.h"
#include "kernel/jobs.h"
#include "kernel/messages.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"
#include "recording/recording.h"

namespace robomosp::render {
class Renderer;
}

namespace robomosp::ioci {

class KeptSolvers;
class Modules;
class RecordingOrigins;
class RecordingWatchers;
class Runs;

struct ApplicationOptions {
  std::vector<std::filesystem::path> plugin_path;  ///< searched first
  std::vector<std::filesystem::path> library;  ///< empty = <executable>/../share/robomosp/library
  bool cache = true;
  /// Folder for computed geometry kept between runs (FileCache::user_folder()); empty = none.
  std::filesystem::path kept_geometry{};
  std::uint64_t kept_geometry_limit = std::uint64_t{512} << 20;  ///< [bytes]
  bool plugins = true;  ///< false: no plugins are loaded, not even shipped ones
  /// Folder for journals of unsaved work, written and searched; empty = none.
  std::filesystem::path recovery{};
  std::chrono::milliseconds recovery_interval{1000};
  std::string recovery_program = "robomosp";  ///< program name in the journal
};

/// The parts synchronise themselves; the document by the application lock. Each session dispatches
/// on its own thread. [any thread] unless marked
class Application {
 public:
  /// Starts all components; plugins of the search path are loaded (refusals become messages).
  static Result<std::unique_ptr<Application>> create(ApplicationOptions = {});
  ~Application();

  /// Looks the command up, checks permission and schema, runs it, commits one undo step, and writes
  /// the audit line. Never throws; on an error the document is unchanged. If the commit is
  /// overtaken by other sessions, a short command is run again, and a long one is refused with the
  /// conflicting changes. [the session's thread]
  Result<Value> dispatch(Session&, std::string_view name, const Map& args);
  Result<Value> dispatch(Session&, const CommandSpec&, const Map& args);
  /// Checks the arguments and runs the command in a job, on the records as they are now; returns
  /// the handle of the job, which has the command's result. [the session's thread]
  Result<Handle> dispatch_async(Session&, std::string_view name, Map args);
  Result<Handle> dispatch_async_positional(Session&, std::string_view name,
                                           std::span<const Value> args);
  /// The same for positional arguments, in the order of the schema.
  Result<Value> dispatch_positional(Session&, std::string_view name, std::span<const Value> args);
  /// The same on a thread other than the session's; one job at a time may call it.
  Result<Value> dispatch_beside(Session&, std::string_view name, const Map& args, Progress&);
  /// A classic line: `PRobot pa10 mGetDHP`, `World cell WorldInvKineSim pa10 circle`.
  Result<Value> dispatch_classic(Session&, std::string_view line);

  /// Runs a command as an update of an open gesture: its edits are published as a preview and enter
  /// the history only with document.commit_gesture(). For a command without edits, the same as
  /// dispatch().
  Result<Value> update_gesture(Session&, std::uint64_t gesture, std::string_view name,
                               const Map& args);
  /// Runs a command on a draft of the session: it sees the draft's records, and its edits stay
  /// there until draft.accept. Refuses commands with effects that discarding the draft would not
  /// revert.
  Result<Value> dispatch_on_draft(Session&, std::uint64_t draft, std::string_view name,
                                  const Map& args);
  /// Runs a command on a draft that is no session's, for trials (trial.h): with the rights of the
  /// command `outer`, on its thread, and no event or audit message. It joins no open group.
  Result<Value> dispatch_on_trial(CommandContext& outer, const std::shared_ptr<document::Draft>&,
                                  std::string_view name, const Map& args, Progress&);
  /// dispatch_async() with edits that join a gesture or a draft of the session; not both. It works
  /// on the records of that, as they are now.
  struct Joined {
    std::uint64_t gesture = 0, draft = 0;  ///< numbers; 0 = none
  };
  Result<Handle> dispatch_async(Session&, std::string_view name, Map args, Joined joined);
  /// The author that the document records for a session; gives the session its number.
  [[nodiscard]] document::Author author(Session&);
  struct SessionInfo {
    std::uint64_t number = 0;
    std::string name;
    SessionKind kind = SessionKind::script;
    bool is_open = true;
  };
  /// Ends the subscription with the session.
  void keep_subscription(Session&, std::uint64_t token);
  [[nodiscard]] bool has_subscription(Session&, std::uint64_t token);
  void end_subscription(Session&, std::uint64_t token);
  /// Sessions that have run a command, in the order of their numbers; at least the last 1,000
  /// closed ones.
  [[nodiscard]] std::vector<SessionInfo> sessions() const;
  /// Records that would be lost on exit: they differ from their files, or have none. Empty while
  /// nothing was edited. [the session's thread]
  [[nodiscard]] std::vector<AnyId> unsaved() const;
  /// Keeps the journal for the next start, which offers it. The newest `most` journals of the same
  /// `recovery_program` are kept; 0 = all. [the session's thread, before this ends]
  Result<void> keep_unsaved(std::size_t most);
  /// A folder for Session::confine(). Shipped files may be read as well: the library, Lua modules.
  /// ErrorCode::not_found, ErrorCode::io.
  [[nodiscard]] Result<FileRoot> file_root(const std::filesystem::path& folder) const;

  /// Groups all edits of `body` into one undo step; an error of body rolls back.
  Result<void> transaction(Session&, std::string label, const std::function<Result<void>()>& body);

  /// Handle or name -> handle; `kinds` as in "ref:robot" without the prefix, "solid|object".
  [[nodiscard]] Result<Handle> resolve(const document::Snapshot&, std::string_view kinds,
                                       const Value&) const;
  /// A handle's record id, if it exists; stale_handle otherwise.
  [[nodiscard]] static Result<AnyId> record_id(const document::Snapshot&, const Handle&);
  [[nodiscard]] static Handle handle(AnyId);
  /// `robot:pa10#17`, `recording#3`; includes changes of the session's open group of edits.
  [[nodiscard]] std::string describe(const Handle&, const Session* = nullptr) const;
  /// The name methods are called by; nullopt when stale.
  [[nodiscard]] std::optional<std::string> name_of(const Handle&, const Session* = nullptr) const;

  /// An object that an outer module keeps with the application, one of each type: created by the
  /// first call, destroyed before everything else.
  template <class T>
  [[nodiscard]] T& kept() {
    const std::lock_guard guard(kept_mutex_);
    std::shared_ptr<void>& slot = kept_[std::type_index(typeid(T))];
    if (!slot) slot = std::make_shared<T>(*this);
    return *static_cast<T*>(slot.get());
  }

  mutable AppLock lock;
  Messages messages;
  Registry registry;
  PluginLoader plugins;
  Events events;  ///< before what publishes
  document::Document document;
  evaluation::Derived derived;
  HandleKinds handle_kinds;  ///< of what is no record
  recording::Recordings recordings;
  std::unique_ptr<RecordingOrigins> origins;  ///< how they were made
  Jobs jobs;  ///< after what its work reads, so that it is joined first
  CommandTable commands;
  std::unique_ptr<Modules> modules;  ///< of plugins; their commands are in the table
  SolverCache solvers;
  PathCache paths;
  std::unique_ptr<KeptSolvers> kept_solvers;  ///< in Lua, that came with records
  ClassicState classic;                       ///< of lines of the 2006 program
  collision::CollisionCache collision_models;
  std::unique_ptr<RecordingWatchers> watchers;  ///< recordings and files that follow edits
  std::unique_ptr<Runs> runs;  ///< live ones; after what they read, so that they end first
  std::mutex renderer_mutex;
  std::shared_ptr<render::Renderer> renderer;  ///< made with the first picture; by renderer_mutex
  std::uint64_t renderer_revision = 0;  ///< of the registry, when it was made; by renderer_mutex
  std::mutex plugins_mutex;             ///< for plugins, once this is created
  std::vector<std::filesystem::path> library;    ///< folders of shipped materials, robots, worlds
  std::filesystem::path share;                   ///< <executable>/../share/robomosp
  std::filesystem::path recovery_folder;         ///< of journals; may be empty
  std::unique_ptr<io::RecoveryJournal> journal;  ///< of this process; null = none
  std::vector<io::ClaimedJournal> restored_journals;  ///< removed when the program ends
  std::atomic<bool> was_edited{false};      ///< something else than loading from the library
  std::atomic<bool> quit_requested{false};  ///< set by the command `quit`; front ends end then
  std::function<void()> redraw;             ///< set by the viewer, if there is one, before all else

 private:
  friend class CommandContext;
  class Call;
  class Told;
  /// Where the edits of a command go instead of the document.
  struct Place {
    std::uint64_t gesture = 0, number = 0;  ///< of the gesture, and of the draft
    std::shared_ptr<document::Draft> draft = {};
    bool is_trial = false;  ///< no event or audit message reports what runs on the draft
  };
  explicit Application(ApplicationOptions);
  Result<void> start();
  Result<Value> run(Session&, const CommandSpec&, const Map& args, document::Transaction* joined,
                    Progress&, bool is_own_thread, Effects allowed, const Place& place);
  Result<Value> run_outermost(Session&, const CommandSpec&, const Map& args,
                              document::Transaction* joined, Progress&, bool is_own_thread,
                              const Place& place);
  Result<Value> dispatch_within(CommandContext&, std::string_view name, const Map& args);
  Result<Handle> run_async(Session&, const CommandSpec&, Map args, Place place);
  [[nodiscard]] Result<void> own_gesture(Session&, std::uint64_t gesture);
  /// Publishes that a session was opened, and on release of the returned pointer, that it was
  /// closed.
  [[nodiscard]] std::shared_ptr<const int> told_end(const Session&, std::uint64_t number);
  [[nodiscard]] std::optional<std::string> name_in(const document::Snapshot&, const Handle&) const;
  /// Cancels gestures of sessions that no longer exist.
  void end_orphaned_gestures();
  struct KnownSession {
    SessionInfo info;
    std::weak_ptr<const int> alive;
    std::vector<std::uint64_t> subscriptions;
  };
  void end_orphaned_subscriptions();
  void forget_closed_sessions();
  std::mutex kept_mutex_;
  std::map<std::type_index, std::shared_ptr<void>> kept_;  // guarded by kept_mutex_
  // Under the lock; sessions are looked through only when they have doubled, so that one costs the
  // same however many came before it:
  std::map<std::uint64_t, KnownSession> sessions_;  ///< by number; the oldest closed ones go
  std::uint64_t next_session_ = 1;
  std::size_t most_sessions_ = 0;
  std::set<std::uint64_t> subscribed_;  ///< sessions with subscriptions
  bool told_forgotten_ = false;         ///< that the history forgets steps
  ApplicationOptions options_;
  Components components_;
  std::shared_ptr<Jobs> shared_jobs_;  ///< `jobs`, for as long as this lives
};

/// Adds every command of this program to the table: those of all CommandFiles.
void register_commands(CommandTable&);

/// A command as one line of Lua, `robot.set_link{id = "pa10", link = 3, lower = -1}`; what the
/// audit message shows. Long arguments are cut, and secrets left out (secrets.h).
[[nodiscard]] std::string command_line(const Application&, const CommandSpec&, const Map& args);

}  // namespace robomosp::ioci
