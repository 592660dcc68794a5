// SPDX-License-Identifier: GPL-3.0-or-later
// Desk: what all panels of the window share: the client of its session, the selection, and the
// events that they follow (layer: GUI). Everything the user does is a command called here; nothing
// is computed on the thread of the window.
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <QObject>
#include <QString>
#include <QTimer>

#include <robomosp/sdk/result.h>

#include "ioci/client/client.h"
#include "ioci/client/live_view.h"
#include "viewer/desktop/listeners.h"
#include "viewer/gizmo/tool_settings.h"

namespace robomosp::viewer {

/// A record, or a part of it by its path as record.outline gives it.
struct Selected {
  Handle record;
  std::string path{};  ///< "" = the record itself
  bool operator==(const Selected&) const = default;
};
using Selection = std::vector<Selected>;

struct RecordOrder {
  bool operator()(const Handle& a, const Handle& b) const {
    return a.number != b.number ? a.number < b.number : a.kind < b.kind;
  }
};
/// In order of creation.
using RecordSet = std::set<Handle, RecordOrder>;

/// [GUI thread]
class Desk : public QObject {
 public:
  using Answer = ioci::Client::Answer;
  using Done = ioci::Client::Done;

  /// Opens the session. The application outlives the desk.
  static Result<std::unique_ptr<Desk>> open(ioci::Application& app,
                                            std::vector<std::filesystem::path> plugin_path);
  ~Desk() override;

  [[nodiscard]] ioci::Application& application() const { return app_; }
  [[nodiscard]] ioci::Client& client() const { return base_->client(); }
  /// The view that other views are opened beside. It shows nothing itself.
  [[nodiscard]] ioci::LiveView& base() const { return *base_; }

  /// Calls a command for the user. A failure without `done` is announced by `failed`.
  Answer act(std::string command, Map args = {}, Done done = {});
  /// The same as a part of a gesture; of none it is act().
  Answer act_in(const ioci::Client::Edits& gesture, std::string command, Map args, Done done);
  /// The same as a job, for commands that may take long.
  Answer start(std::string command, Map args = {}, Done done = {});
  /// Calls a command for the window itself, to show something. Failures are ignored without `done`.
  Answer ask(std::string command, Map args, Done done);
  /// The same for a panel: `done` is not called after `asker` was deleted.
  Answer ask(std::string command, Map args, const QObject& asker, Done done);
  /// Opens a file, a record of the library, or what a script returns.
  Answer open_record(ioci::OpenRequest request,
                     std::function<void(const Result<ioci::Opened>&)> done);
  /// Evaluates an input of the console; `shown` as in LiveView::evaluate().
  Answer evaluate(std::string input, Done done, std::shared_ptr<List> shown = {});
  /// True if no call waits or runs, and all results and events have been delivered. While the
  /// console evaluates an input or a script runs, other calls wait for that and do not count.
  [[nodiscard]] bool is_idle() const {
    return evaluating_ > 0 || scripts_ > 0 ? !client().has_news() : client().is_idle();
  }

  /// True while any call has not ended, also inputs of the console and scripts.
  [[nodiscard]] bool has_calls() const { return calls_ > 0 || evaluating_ > 0; }

  [[nodiscard]] const Selection& selection() const { return selection_; }
  /// `from` is the panel that selects; it is called as all others are.
  void select(Selection selection, const QObject* from = nullptr);

  /// What the mouse is over in a picture or in the navigator; empty = nothing.
  [[nodiscard]] const Selection& hovered() const { return hovered_; }
  /// `from` is the panel with the mouse; it is called as all others are.
  void hover(Selection what, const QObject* from);

  /// True if the record differs from its file or has none, as far as events have reported.
  [[nodiscard]] bool is_unsaved(const Handle& record) const { return unsaved_.contains(record); }
  /// The same, and true at once after an edit, which is compared with the file a little later.
  [[nodiscard]] bool may_be_unsaved(const Handle& record) const {
    return unsaved_.contains(record) || edited_.contains(record);
  }
  [[nodiscard]] const RecordSet& unsaved() const { return unsaved_; }
  /// Whether any record may be unsaved.
  [[nodiscard]] bool has_unsaved() const { return !unsaved_.empty() || !edited_.empty(); }

  Listeners<> unsaved_changed;  ///< unsaved() or what may be unsaved
  Listeners<const ioci::Event&> events;
  Listeners<const QObject*> selection_changed;  ///< with the panel that selected
  Listeners<const QObject*> hover_changed;      ///< with the panel with the mouse
  Listeners<const std::string&> printed;        ///< by scripts
  /// A command that this session called, as a line of Lua that runs.
  Listeners<const std::string&> acted;
  /// A remark of the window itself, such as a failure of an act.
  Listeners<const Error&> failed;
  Listeners<const QString&> noted;
  ToolSettings tools;  ///< of all views

  /// Announces the line of something the window did itself, such as window.set{...}.
  void echo(const std::string& line) {
    if (quiet_ == 0) acted(line);
  }
  /// While one exists, echo() announces nothing: what acts is a command with a line already.
  class Quiet {
   public:
    explicit Quiet(Desk& desk) : desk_(desk) { ++desk_.quiet_; }
    ~Quiet() { --desk_.quiet_; }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;

   private:
    Desk& desk_;
  };

 private:
  explicit Desk(ioci::Application& app) : app_(app) {}
  void deliver();
  void take(const ioci::Event& event);
  void take_unsaved(const ioci::Event& event);
  void add_gesture_line(const ioci::CommandRun& run);
  /// Reads the list again, where events about it were dropped.
  void ask_unsaved();
  Done counted(Done done);
  /// A call of the window for the user (an act), or for itself.
  struct Called {
    std::string command;
    bool is_act = false;
  };
  Done reported(const std::string& command, bool is_act, Done done);

  ioci::Application& app_;
  std::unique_ptr<ioci::LiveView> base_;
  Selection selection_, hovered_;
  RecordSet unsaved_, edited_;
  int edits_ = 0;         ///< counts changes
  int unsaved_news_ = 0;  ///< counts events about what is unsaved
  QTimer unsaved_timer_;  ///< until the edits are over
  std::size_t calls_ = 0;
  int evaluating_ = 0;                                ///< inputs of the console that have not ended
  int quiet_ = 0;                                     ///< how many Quiet there are
  int scripts_ = 0;                                   ///< that were opened and have not ended
  std::deque<std::shared_ptr<const Called>> called_;  ///< in order, neither reported nor ended
  /// The lines of each open gesture, by the places that they set.
  std::map<std::uint64_t, std::vector<std::pair<std::string, std::string>>> gestures_;
  std::uint64_t session_ = 0;  ///< number of the session; 0 = not known yet
};

}  // namespace robomosp::viewer
