// SPDX-License-Identifier: Apache-2.0
// Recordings, plots and replay pages that follow edits: after each commit a job updates those that
// are out of date (layer: application, ioci).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "ioci/core/command.h"
#include "ioci/core/origins.h"

namespace robomosp::ioci {

/// A watched recording or drawing, as it is listed.
struct WatchStatus {
  std::uint64_t number = 0;
  std::string what;             ///< "recording", or the command that draws: "recording.plot"
  std::uint64_t recording = 0;  ///< 0 = of records alone, such as trajectory.plot
  std::string file;
  std::string state;  ///< "current", "waiting", "working" or "failed"
  std::string fault;  ///< of the last attempt
};

/// While nothing is watched, a commit costs one comparison of numbers. Updates run one after
/// another in a job; a new edit cancels the computation for the previous one. [any thread]
class RecordingWatchers {
 public:
  explicit RecordingWatchers(Application& app) : app_(app), session_("watch") {
    session_.deny(Effect::edits);
  }
  /// Starts following the document.
  void start();
  /// Stops watching, and cancels the running computation.
  void stop();

  /// Watches a recording with a known origin. Adding it twice has no further effect.
  Result<void> add_recording(std::uint64_t number);
  /// Watches the file drawn by a command with these arguments; the same file replaces the previous
  /// entry.
  Result<void> add_drawing(const document::Snapshot&, const std::string& command, const Map& given,
                           const Map& checked);
  [[nodiscard]] std::vector<WatchStatus> list() const;
  /// Whether this file is kept up to date.
  [[nodiscard]] bool draws(const std::string& file) const;
  /// Removes the entries for which it returns true; returns their number.
  std::size_t remove(const std::function<bool(const WatchStatus&)>& is_it);
  /// Waits until all updates are done; serves the solvers in Lua of this thread meanwhile. False if
  /// it gave up.
  bool settle(const std::function<bool()>& gives_up = {});
  /// Checks for updates to do; ignores edits made by the updates themselves.
  void look(const Session* by = nullptr);

 private:
  struct Watch {
    WatchStatus status;
    RecordingOrigin::Step draws;  ///< of a drawing
    Inputs inputs;                ///< of a drawing, as it was drawn last
    std::set<std::uint64_t> recordings;
    /// Of a drawing: the folder of the session that requested it; null = anywhere.
    std::shared_ptr<const FileRoot> files = nullptr;
  };
  class Pass;
  Result<Value> work(Progress&);
  void update(Progress&);
  void update_recording(std::uint64_t number, Progress&);
  void update_drawing(std::uint64_t number, Progress&);
  /// Stores the result of the last attempt, and posts new ones.
  void told(const std::function<bool(const WatchStatus&)>& of, const std::string& state,
            const std::string& fault);
  Application& app_;
  Session session_;  ///< of the job, of which there is one at a time
  std::atomic<std::size_t> count_{0};
  std::atomic<std::uint64_t> generation_{0};
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::vector<Watch> watches_;
  std::uint64_t next_ = 1;
  std::uint64_t job_ = 0;  ///< that runs; 0 = none
  bool is_stopped_ = false;
};

/// Called after a command has drawn: watches its file if its arguments request it.
Result<void> watch_drawing(CommandContext& ctx, const std::string& command, const Map& checked);

/// `watch`, of commands that make recordings.
[[nodiscard]] ParamSpec watch_field();
[[nodiscard]] Schema with_watch(Schema params);
/// `watch`, of commands that draw into files.
[[nodiscard]] ParamSpec watch_file_field();

}  // namespace robomosp::ioci
