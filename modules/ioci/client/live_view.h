// SPDX-License-Identifier: Apache-2.0
// LiveView: the base of a window: the client of a session, and the scene of one record that
// follows the document, runs and recordings (layer: application). Why:
// docs/decisions/0104-live-views.md.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "ioci/client/client.h"
#include "ioci/client/opening.h"
#include "ioci/client/scripts.h"
#include "scene/extras.h"
#include "scene/flat_scene.h"
#include "scene/frame.h"

namespace robomosp::ioci {

/// Each function notes what is wanted and returns; threads of the executor compute it. A wake of
/// the host announces results, which deliver() passes on. Only the newest wish of each kind counts.
/// [the host's thread; picture() and settle(): any]
class LiveView {
 public:
  /// What is shown. Immutable. When its last owner releases a picture or its frame, a thread of the
  /// executor destroys it or makes a later picture from it, writing only what differs.
  struct Picture {
    Picture() = default;
    Picture(const Picture&) = delete;
    Picture& operator=(const Picture&) = delete;
    scene::FramePtr frame;
    scene::FlatScene flat;
    /// The frame as renderers take it, exploded, with the map.
    const render::Scene& scene = flat.scene();
    bool only_moved = false;  ///< only poses differ from the picture delivered before it
    /// Sentences about what is not shown, about motions that do not fit the world, and about a
    /// draft in conflict with the document.
    std::vector<std::string> left_out;
  };
  using PicturePtr = std::shared_ptr<const Picture>;

  struct Options {
    std::string name = "window";  ///< of the session
    SessionKind kind = SessionKind::window;
    /// As in Client::Options.
    std::function<void()> wake;
    /// Called by deliver() with the newest picture.
    std::function<void(const PicturePtr&)> on_picture;
    /// Called by deliver() with events of these topics, bits by Topic.
    std::function<void(const Event&)> on_event;
    std::uint32_t topics = 0;
    /// As in Client::Options.
    std::function<bool(std::string_view command)> waits_for_host;
    scene::Extras extras;  ///< shown at first
    /// Searched first for scripts that are plugins.
    std::vector<std::filesystem::path> plugin_path;
    /// Called by deliver() with what scripts print; empty = it goes to standard output.
    std::function<void(const std::string&)> on_print;
  };

  /// The errors of Client::open(). The application outlives the view.
  static Result<std::unique_ptr<LiveView>> open(Application&, Options);
  /// Another view of the same session, such as for a second tab of a window: it has the client of
  /// this view, which must outlive it, and its events. Of the options only `wake`, `on_picture` and
  /// `extras` count. Its deliver() passes on pictures only.
  [[nodiscard]] std::unique_ptr<LiveView> open_beside(Options);
  /// Stops what is computed and waits for its end; see ~Client(). Not within deliver(). Callbacks
  /// are destroyed here.
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  [[nodiscard]] Client& client() const;

  /// open_shown() on the client's thread. It shows nothing yet.
  Client::Answer open_record(OpenRequest, std::function<void(const Result<Opened>&)> done);
  /// Evaluates one input of a console in the session's script state; `done` gets the text of its
  /// results. `shown`, if not null, has the results that can be pictures or plots by then; see
  /// Scripts::evaluate().
  Client::Answer evaluate(std::string input, Client::Done done, std::shared_ptr<List> shown = {});
  /// What an input may be completed to at byte `cursor`; `done` is not called if the program has
  /// no scripting language or the call is cancelled.
  struct Completed {
    ScriptCompletion completion;
    bool is_incomplete = false;  ///< the input is the beginning of a statement
  };
  Client::Answer complete(std::string input, std::size_t cursor,
                          std::function<void(const Completed&)> done);
  /// compute_map() likewise; `done` gets the handle of the recording.
  Client::Answer compute_map(const Handle& what, std::string map, std::string robot,
                             Client::Done done);

  /// Shows this record instead of the present one, placed as in the document, without a map.
  void show(const Handle& what);
  /// Shows the record as it would be if a draft of the client were accepted now, and follows the
  /// draft's edits, until the draft ends or show_document() is called. If the draft is in conflict
  /// with the document, it is shown without the document's later changes, and `left_out` gives the
  /// conflict. The answer fails if the edits are a gesture, or could not be opened.
  Client::Answer show_draft(const Client::Edits& draft, Client::Done done = {});
  /// Shows the document again.
  void show_document();
  /// Moves the members of the world, or the robot, to where a recording has them at a time [s].
  void show_recording(const Handle& recording, double time);
  /// Moves them with a live run from now on.
  void show_run(const Handle& run);
  /// Moves them back to where the document has them.
  void rest();
  /// Turns a layer on or off, see scene::set_layer().
  Result<void> show_layer(std::string_view name, bool is_shown);
  /// Sets all layers at once, with what has no name alone: joint values of robots, ghosts.
  void show_extras(scene::Extras extras);
  void explode(double by);  ///< see scene::Extras::explode
  /// What is shown besides the bodies, as it was wanted last.
  [[nodiscard]] scene::Extras extras() const;
  /// Adds voxels; `map` as the argument `map` of view.render, for the record that is shown.
  Client::Answer show_map(Map map, Client::Done done = {});

  /// The newest picture; null before the first.
  [[nodiscard]] PicturePtr picture() const;
  /// Whether a picture of the newest wishes is still to come or to be delivered. Events that were
  /// not delivered do not count. [the host's thread]
  [[nodiscard]] bool is_busy() const;
  /// Waits until the present document and the newest wishes are shown exactly. The only error is
  /// ErrorCode::cancelled.
  Result<PicturePtr> settle(Progress&);

  /// Delivers results of calls, events and the newest picture, as Client::deliver().
  bool deliver(std::chrono::microseconds at_most = std::chrono::microseconds(500));

 private:
  struct State;
  explicit LiveView(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace robomosp::ioci
