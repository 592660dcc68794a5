// SPDX-License-Identifier: Apache-2.0
// The command table (IOCI): everything a user can do, declared once; every front end only
// translates into it (layer: application).
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "ioci/expressions.h"
#include "kernel/schema.h"
#include "kernel/value.h"

namespace robomosp::ioci {

class Application;

/// What a command does to the world outside its return value; permissions are given by effect.
enum class Effect : std::uint8_t {
  reads,
  edits,
  simulates,
  files_read,
  files_write,
  loads_code,
  stops
};
inline constexpr Effect kAllEffects[] = {
    Effect::reads,       Effect::edits,      Effect::simulates, Effect::files_read,
    Effect::files_write, Effect::loads_code, Effect::stops};
[[nodiscard]] std::string_view to_string(Effect);

/// One user of the program: the console, a script, an rpc peer. [application thread]
class Session {
 public:
  explicit Session(std::string name) : name_(std::move(name)) {}
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool may(Effect e) const {
    return (denied_ & (1U << static_cast<unsigned>(e))) == 0;
  }
  void deny(Effect e) { denied_ |= 1U << static_cast<unsigned>(e); }
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
  std::string name_;
  std::uint32_t denied_ = 0;
  std::atomic<bool> interrupted_{false};
  /// Open while a transaction group or an editing command runs; what they dispatch joins it.
  document::Transaction* transaction_ = nullptr;
};

/// What a running command may use. Lives for one dispatch.
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
  /// The transaction of this command; dispatch commits it. Only for Effect::edits and files_read.
  [[nodiscard]] document::Transaction& edit();
  /// An argument as it was given, before the schema normalised it; nullptr when it was not given.
  [[nodiscard]] const Value* given(std::string_view name) const {
    return given_ ? given_->find(name) : nullptr;
  }

 private:
  friend class Application;
  const Map* given_ = nullptr;
  document::SnapshotPtr base_;
  document::Transaction* transaction_ = nullptr;
  bool may_edit_ = false;
};

/// What comes back. For a map, `fields` tells the units that front ends print.
struct ReturnSpec {
  std::string type = "nil";  ///< as ParamSpec::type, or "handle", "array"
  std::string unit;
  std::string doc;
  std::vector<ParamSpec>
      fields;  ///< name, type, unit, doc of a map's (or of each list entry's) fields
};

struct CommandSpec {
  std::string name;     ///< "robot.dh_table"; the part before the dot is the handle kind or a topic
  std::string classic;  ///< "PRobot mGetDHP" or "" ; several separated by '|'
  std::string summary;  ///< one sentence
  std::string details;  ///< more, may be empty
  std::string example;  ///< Lua, executed by tests in a fresh session
  Schema params;        ///< a first parameter "id" of type ref:<kind> makes it a method
  ReturnSpec returns;
  Effect effect = Effect::reads;
  Result<Value> (*run)(CommandContext&, const Map& args) = nullptr;
  /// For commands that work on the history itself or dispatch others: no transaction is opened.
  bool own_transaction = false;
  /// Numbers may be expressions over the parameters of the record `id`, or over those of the
  /// argument `parameters`; what they are wanted for is kept with CommandContext::expressions.
  bool takes_expressions = false;
};

/// All commands; filled by one explicit array per commands_*.cpp.
class CommandTable {
 public:
  void add(std::vector<CommandSpec> specs);  ///< aborts on a malformed or duplicate entry
  [[nodiscard]] const CommandSpec* find(std::string_view name) const;
  /// `noun` and `option` of a classic line, case-blind: ("PRobot", "mGetDHP").
  [[nodiscard]] const CommandSpec* find_classic(std::string_view noun,
                                                std::string_view option) const;
  [[nodiscard]] std::vector<const CommandSpec*> list() const;  ///< by name
  [[nodiscard]] std::vector<const CommandSpec*> methods_of(std::string_view kind) const;
  [[nodiscard]] std::vector<const CommandSpec*> apropos(std::string_view words) const;
  /// "there is no command ..." with near names.
  [[nodiscard]] Error unknown(std::string_view name) const;
  /// The same for a classic line; tells an unknown noun from an unknown option.
  [[nodiscard]] Error unknown_classic(std::string_view noun, std::string_view option) const;

 private:
  std::vector<std::unique_ptr<CommandSpec>> specs_;
  std::map<std::string, const CommandSpec*, std::less<>> by_name_;
  std::map<std::string, const CommandSpec*, std::less<>> by_classic_;
};

/// Markdown of one command, for `help` and docs/ioci.
[[nodiscard]] std::string help_text(const CommandSpec&);

/// The pages of docs/ioci by file name, made from the table alone: one a topic, and README.md.
[[nodiscard]] std::map<std::string, std::string> reference_pages(const CommandTable&);
/// Writes reference_pages() into a folder; a page that is no longer in the table is removed.
Result<void> write_reference(const CommandTable&, const std::filesystem::path& folder);

/// A classic line split into words: blanks separate, "..." and {...} group.
[[nodiscard]] Result<std::vector<std::string>> split_classic(std::string_view line);

}  // namespace robomosp::ioci
