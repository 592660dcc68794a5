// SPDX-License-Identifier: Apache-2.0
// The command table (IOCI): everything a user can do, declared once; every front end only
// translates into it (layer: application).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "ioci/core/expressions.h"
#include "kernel/effects.h"
#include "kernel/file_root.h"
#include "kernel/jobs.h"
#include "kernel/schema.h"
#include "kernel/value.h"
#include "recording/recording.h"

namespace robomosp::document {
class Draft;
}

namespace robomosp::ioci {

class Application;
class Drafts;
class RecordingWatchers;

/// The kind of client of a session.
enum class SessionKind : std::uint8_t { console, script, connection, window };
[[nodiscard]] std::string_view to_string(SessionKind);

/// One user of the program: the console, a script, an rpc peer, a window. Each has a separate undo
/// history. Belongs to one thread, which dispatches for it; its jobs run on others.
class Session {
 public:
  explicit Session(std::string name, SessionKind kind = SessionKind::script)
      : name_(std::move(name)), kind_(kind) {}
  ~Session();  ///< cancels the jobs that it started and waits for them
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] SessionKind kind() const { return kind_; }
  /// Counts up from 1 in the order of the first commands; 0 before that. Never reused.
  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] bool may(Effect e) const { return !denied_.has(e); }
  [[nodiscard]] Effects denied() const { return denied_; }
  void deny(Effects e) { denied_ = denied_ | e; }
  /// Allows a command regardless of its effects.
  void grant(std::string command) { granted_.push_back(std::move(command)); }
  /// Effects denied while a command runs.
  [[nodiscard]] Effects denied_to(std::string_view command) const {
    return is_granted(command) ? Effects() : denied_;
  }
  [[nodiscard]] bool is_granted(std::string_view command) const {
    return std::find(granted_.begin(), granted_.end(), command) != granted_.end();
  }
  /// Confines the session to files in the folder, with relative names relative to it. The root is
  /// made by Application::file_root(), so that the library may be read. The session may no longer
  /// load machine code.
  void confine(FileRoot root);
  /// The folder; null = files are not confined.
  [[nodiscard]] const std::shared_ptr<const FileRoot>& files() const { return files_; }
  /// Copies the rights of another session of the same user.
  void limit_as(const Session& other) {
    denied_ = other.denied_;
    granted_ = other.granted_;
    files_ = other.files_;
  }
  /// Cancels the command that runs now. [any thread, signal-safe: sets an atomic]
  void interrupt() noexcept { interrupted_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool interrupted() const noexcept {
    return interrupted_.load(std::memory_order_relaxed);
  }
  void clear_interrupt() noexcept { interrupted_.store(false, std::memory_order_relaxed); }
  /// Where progress is shown; may be empty.
  std::function<void(double, std::string_view)> show_progress;

 private:
  friend class Application;
  friend class Drafts;
  friend class RecordingWatchers;
  std::string name_;
  SessionKind kind_;
  std::uint64_t number_ = 0;
  std::shared_ptr<const int> alive_ = std::make_shared<const int>(0);  ///< dies with the session
  Effects denied_;
  std::vector<std::string> granted_;  ///< commands
  std::shared_ptr<const FileRoot> files_;
  std::atomic<bool> interrupted_{false};
  std::weak_ptr<Jobs> jobs_;        ///< of the application, once it started one
  std::vector<std::uint64_t> own_;  ///< ids of those that it started
  std::uint64_t gesture_ = 0;       ///< updated by the running command
  bool told_gesture_ = false;       ///< already warned that the argument `gesture` is outdated
  /// Open while a transaction group or an editing command runs; what they dispatch joins it.
  document::Transaction* transaction_ = nullptr;
};

/// Thrown by a command if the object of an argument was deleted.
struct StaleHandle {
  Handle handle;
};

/// Context of a running command. Lives for one dispatch. A command runs without the application
/// lock, on the records as they were when it began; its edits are published when it ends.
class CommandContext {
 public:
  CommandContext(Application& app, Session& session, Progress& progress);
  CommandContext(const CommandContext&) = delete;
  CommandContext& operator=(const CommandContext&) = delete;
  Application& app;
  Session& session;
  Progress& progress;
  /// What was given as expressions, of commands with `takes_expressions`.
  Expressions expressions;
  /// The records as this command must see them (an open transaction's, else the document's).
  [[nodiscard]] const document::Snapshot& snapshot() const;
  /// The transaction of this command; dispatch commits it. Only for commands declared with
  /// Effect::edits; its edits are refused while the session is denied that effect.
  [[nodiscard]] document::Transaction& edit();
  /// The document's records when the command began, without those of an open group.
  [[nodiscard]] const document::SnapshotPtr& base() const { return base_; }
  /// True if it joins an unpublished group of edits, or runs on a draft.
  [[nodiscard]] bool is_in_group() const { return transaction_ != nullptr || draft_; }
  /// Runs another command as a part of this one: it joins the transaction and shows its progress
  /// here.
  [[nodiscard]] Result<Value> dispatch(std::string_view name, const Map& args);
  /// Handle or name -> handle, as Application::resolve() on the records that this command sees. If
  /// the command edits, a name found only in the library is loaded from there, as <kind>.get does,
  /// without a step of the history.
  [[nodiscard]] Result<Handle> resolve(std::string_view kinds, const Value&) const;
  /// The recording named by an argument; throws StaleHandle, which dispatch converts to its error,
  /// if it was removed since the arguments were read.
  [[nodiscard]] recording::RecordingPtr recording(const Handle&) const;
  /// What a handle is called, as this command must see it; nullopt when it is stale.
  [[nodiscard]] std::optional<std::string> name_of(const Handle&) const;
  /// An argument as it was given, before the schema normalised it; nullptr when it was not given.
  [[nodiscard]] const Value* given(std::string_view name) const {
    return given_ ? given_->find(name) : nullptr;
  }

 private:
  friend class Application;
  friend class ModuleRunScope;
  const Map* given_ = nullptr;
  document::SnapshotPtr base_;
  document::Transaction* transaction_ = nullptr;
  Effects allowed_ = Effects::all();  ///< of the commands that it dispatches
  bool may_edit_ = false;
  bool is_own_thread_ = true;  ///< computes on the session's thread
  /// What it edits, and the number that it is known by; null = the document.
  std::shared_ptr<document::Draft> draft_ = {};
  std::uint64_t draft_number_ = 0;
  bool is_trial_ = false;      ///< no event or audit message reports what runs on the draft
  std::uint64_t gesture_ = 0;  ///< that a job joins
};

/// The result. For a map, `fields` gives the units that front ends print.
struct ReturnSpec {
  std::string type = "nil";  ///< as ParamSpec::type, or "handle", "array"
  std::string unit;
  std::string doc;
  std::vector<ParamSpec>
      fields;  ///< name, type, unit, doc of a map's (or of each list entry's) fields
};

/// Kinds of runs that call hooks of modules (robomosp/sdk/module.h).
enum class RunKind : std::uint8_t { none, simulation, task };

struct CommandSpec {
  std::string name;  ///< "robot.dh_table"; the part before the dot is the handle kind or a topic
  std::string classic{};  ///< "PRobot mGetDHP" or "" ; several separated by '|'
  std::string summary;    ///< one sentence
  std::string details;    ///< more, may be empty
  std::string example;    ///< Lua, executed by tests in a fresh session
  Schema params;          ///< a first parameter "id" of type ref:<kind> makes it a method
  ReturnSpec returns;
  /// Effects it always has; refused at once to a session that is denied any of them.
  Effects effect = Effect::reads;
  /// Effects it has with some arguments only; refused when they occur.
  Effects sometimes = {};
  Result<Value> (*run)(CommandContext&, const Map& args) = nullptr;
  /// For commands that work on the history itself or dispatch others: no transaction is opened.
  bool own_transaction = false;
  /// Numbers may be expressions over the parameters of the record `id`, or over those of the
  /// argument `parameters`; what they are wanted for is kept with CommandContext::expressions.
  bool takes_expressions = false;
  /// What it runs, if it simulates a motion or executes tasks.
  RunKind runs = RunKind::none;
  /// The module of a plugin that it is of, and its body in place of `run`; empty for the program's.
  std::string plugin = {};
  std::function<Result<Value>(CommandContext&, const Map& args)> plugged = {};
};

/// "" or what is wrong with an entry of the table: "no example".
[[nodiscard]] std::string fault_of(const CommandSpec&);

/// All commands: those of the program's files (CommandFile), and those added by modules of plugins.
/// Returned pointers stay valid. [any thread]
class CommandTable {
 public:
  void add(std::vector<CommandSpec> specs);  ///< aborts on a malformed or duplicate entry
  /// One of a plugin; a malformed entry or a name that is taken is an error.
  Result<void> add_plugged(CommandSpec spec);
  /// Counts up with every addition.
  [[nodiscard]] std::uint64_t revision() const { return revision_.load(std::memory_order_acquire); }
  [[nodiscard]] const CommandSpec* find(std::string_view name) const;
  /// `noun` and `option` of a classic line, case-blind: ("PRobot", "mGetDHP").
  [[nodiscard]] const CommandSpec* find_classic(std::string_view noun,
                                                std::string_view option) const;
  [[nodiscard]] std::vector<const CommandSpec*> list() const;  ///< by name
  [[nodiscard]] std::vector<const CommandSpec*> methods_of(std::string_view kind) const;
  [[nodiscard]] std::vector<const CommandSpec*> apropos(std::string_view words) const;
  /// "there is no command ..." with near names.
  [[nodiscard]] Error unknown(std::string_view name) const;
  /// The same for a classic line; distinguishes an unknown noun from an unknown option.
  [[nodiscard]] Error unknown_classic(std::string_view noun, std::string_view option) const;

 private:
  /// Candidates for an unknown command, from a topic ("" = from all): commands with this word in
  /// their names (`ik` is in solve_ik), else by common synonyms (`fkine`). The best first; at most
  /// three of equal rank. With mutex_ held.
  [[nodiscard]] std::vector<std::string> meant(std::string_view topic, std::string_view verb) const;
  mutable std::shared_mutex mutex_;
  // Guarded by mutex_:
  std::vector<std::unique_ptr<CommandSpec>> specs_;
  std::map<std::string, const CommandSpec*, std::less<>> by_name_;
  std::map<std::string, const CommandSpec*, std::less<>> by_classic_;
  std::atomic<std::uint64_t> revision_{0};
};

/// Registers the commands of one source file at program start; defined by RMP_COMMANDS. Every table
/// filled by register_commands() has them.
class CommandFile {
 public:
  using Make = std::vector<CommandSpec> (*)();
  CommandFile(const char* file, Make make);
  /// (source file, maker) of all, in no certain order.
  [[nodiscard]] static const std::vector<std::pair<std::string, Make>>& all();
};

/// Markdown of one command, for `help` and docs/ioci.
[[nodiscard]] std::string help_text(const CommandSpec&);

/// A value as one line of JSON; of a layer above.
using ToJson = std::function<std::string(const Value&)>;
/// The pages of docs/ioci by file name, made from the table and the examples as arguments: one a
/// topic, and README.md. Without `to_json` they have no requests.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const CommandTable&,
                                                                 const ToJson& to_json = {});
/// Writes reference_pages() into a folder; a page that is no longer in the table is removed.
Result<void> write_reference(const CommandTable&, const std::filesystem::path& folder,
                             const ToJson& to_json = {});

/// A classic line split into words: blanks separate, "..." and {...} group.
[[nodiscard]] Result<std::vector<std::string>> split_classic(std::string_view line);

}  // namespace robomosp::ioci

/// Begins the function that returns the commands of a file: RMP_COMMANDS(weather_commands) { ... }.
/// No other code names it.
#define RMP_COMMANDS(name)                                                   \
  static std::vector<::robomosp::ioci::CommandSpec> name();                  \
  static const ::robomosp::ioci::CommandFile name##_file(__FILE__, &(name)); \
  static std::vector<::robomosp::ioci::CommandSpec> name()
