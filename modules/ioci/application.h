// SPDX-License-Identifier: Apache-2.0
// Application: the program without front ends; owns the parts, starts them as components and
// dispatches commands (layer: application).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "document/derived.h"
#include "document/document.h"
#include "ioci/command.h"
#include "ioci/solver_cache.h"
#include "kernel/app_thread.h"
#include "kernel/component.h"
#include "kernel/jobs.h"
#include "kernel/messages.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"
#include "sim/collision_cache.h"
#include "sim/recording.h"

namespace robomosp::render {
class Renderer;
}

namespace robomosp::ioci {

class Runs;

struct ApplicationOptions {
  std::vector<std::filesystem::path> plugin_path;  ///< searched first
  std::vector<std::filesystem::path> library;  ///< empty = <executable>/../share/robomosp/library
  bool cache = true;
};

/// [application thread]
class Application {
 public:
  /// Starts all components; plugins of the search path are loaded (refusals become messages).
  static Result<std::unique_ptr<Application>> create(ApplicationOptions = {});
  ~Application();

  /// Looks up, checks permission and schema, runs, commits one undo step, keeps the audit line.
  /// Nothing throws out of it; on an error the document is as before.
  Result<Value> dispatch(Session&, std::string_view name, const Map& args);
  /// The same for positional arguments, in the order of the schema.
  Result<Value> dispatch_positional(Session&, std::string_view name, std::span<const Value> args);
  /// A classic line: `PRobot pa10 mGetDHP`, `World cell WorldInvKineSim pa10 circle`.
  Result<Value> dispatch_classic(Session&, std::string_view line);

  /// Groups all edits of `body` into one undo step; an error of body rolls back.
  Result<void> transaction(Session&, std::string label, const std::function<Result<void>()>& body);

  /// Handle or name -> handle; `kinds` as in "ref:robot" without the prefix, "solid|object".
  [[nodiscard]] Result<Handle> resolve(const document::Snapshot&, std::string_view kinds,
                                       const Value&) const;
  /// A handle's record id, checked to exist; stale_handle otherwise.
  [[nodiscard]] static Result<AnyId> record_id(const document::Snapshot&, const Handle&);
  [[nodiscard]] static Handle handle(AnyId);
  /// `robot:pa10#17`, `recording#3`.
  [[nodiscard]] std::string describe(const Handle&) const;
  /// The name methods are called by; nullopt when stale.
  [[nodiscard]] std::optional<std::string> name_of(const Handle&) const;

  AppThread thread;
  Messages messages;
  Registry registry;
  PluginLoader plugins;
  document::Document document;
  document::Derived derived;
  sim::Recordings recordings;
  Jobs jobs;  ///< after what its work reads, so that it is joined first
  CommandTable commands;
  SolverCache solvers;
  sim::CollisionCache collision_models;
  std::unique_ptr<Runs> runs;  ///< live ones; after what they read, so that they end first
  std::shared_ptr<render::Renderer> renderer;  ///< made with the first picture
  std::uint64_t renderer_revision = 0;         ///< of the registry, when it was made
  std::vector<std::filesystem::path> library;  ///< folders of shipped materials, robots, worlds
  std::filesystem::path share;                 ///< <executable>/../share/robomosp
  bool quit_requested = false;                 ///< set by the command `quit`; front ends end then
  std::function<void()> redraw;                ///< set by the viewer, if there is one

 private:
  explicit Application(ApplicationOptions);
  Result<void> start();
  Result<Value> run(Session&, const CommandSpec&, const Map& args);
  ApplicationOptions options_;
  document::Transaction* open_ = nullptr;  ///< whichever session's; there is at most one
  Components components_;
};

/// Adds every command of this program to the table (one add per commands_*.cpp).
void register_commands(CommandTable&);

/// A command as one line of Lua, `robot.set_link{id = "pa10", link = 3, lower = -1}`; what the
/// audit message shows. Long arguments are cut.
[[nodiscard]] std::string command_line(const Application&, const CommandSpec&, const Map& args);

}  // namespace robomosp::ioci
