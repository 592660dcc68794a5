// SPDX-License-Identifier: Apache-2.0
// Client: a session for a thread that must never wait, such as a window's. A thread of the client
// owns the session and dispatches; results come back to the host's thread (layer: application).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

/// Calls commands for its host without ever making it wait: each function returns at once, and
/// deliver(), which the host calls on its own thread after a wake, hands over the results. Calls
/// run one after another, in the order in which they were made; a command that takes long is
/// started as a job, and later calls do not wait for it. [any thread; deliver() and the destructor:
/// the host's]
///
/// Each call ends exactly once: with its command's result, with its error, or with
/// ErrorCode::cancelled when it was cancelled, when a newer one of its slot took its place, or when
/// the client ended first. Nothing throws out of it but what callbacks throw out of deliver(),
/// which continues with the rest the next time.
class Client {
  struct Entry;
  struct EditsState;
  struct State;
  struct Held;

 public:
  /// Called by deliver() with what came of a call. What it holds is destroyed on the host's thread.
  using Done = std::function<void(const Result<Value>&)>;
  /// Called by deliver() with how far a call is, from 0 to 1, and what it does; of reports that
  /// come faster than the host takes them the newest.
  using Shown = std::function<void(double fraction, const std::string& what)>;
  /// Work for the client's thread besides commands. What it throws becomes its error.
  using Work = std::function<Result<Value>(Session&)>;

  struct Options {
    std::string name = "window";  ///< of the session
    SessionKind kind = SessionKind::window;
    /// Called when deliver() has something to do, by any thread, also by the host's within a call;
    /// once until deliver() is called. It must return at once and call nothing of the client.
    std::function<void()> wake;
    /// Called once on the client's thread before all else, such as to limit what the session may.
    std::function<void(Session&)> prepare;
    /// Called once on the client's thread after all else, while the session is still there, such as
    /// to end a script state that uses it. It throws nothing.
    std::function<void(Session&)> finish;
    /// Whether a command waits for the host, such as one that photographs its window: is_idle()
    /// counts neither its call nor what waits behind it. Empty = none does. [any thread]
    std::function<bool(std::string_view command)> waits_for_host;
    /// Events to be delivered; without `on_event` none are.
    EventFilter events;
    std::function<void(const Event&)> on_event;  ///< called by deliver()
  };

  /// Edits that become one step together: of a gesture, which all sessions see at
  /// once, or of a draft, which no other session sees. Copies mean the same one.
  class Edits {
   public:
    Edits() = default;  ///< none
    explicit operator bool() const { return state_ != nullptr; }

   private:
    friend class Client;
    std::shared_ptr<EditsState> state_;
  };

  /// A call that was made. Copies mean the same one. [any thread]
  class Answer {
   public:
    enum class Stage : std::uint8_t { waiting, running, ended };
    Answer() = default;  ///< of no call
    [[nodiscard]] Stage stage() const;
    /// Its result, also before it is delivered; null until it has ended. It lives as long
    /// as a copy of this answer. While the client lives, the client's thread destroys it.
    [[nodiscard]] const Result<Value>* result() const;
    /// Whether a newer call of its slot took its place.
    [[nodiscard]] bool was_replaced() const;

   private:
    friend class Client;
    std::shared_ptr<const Held> held_;
  };

  /// How a command is called.
  struct How {
    Edits in{};        ///< what its edits join
    bool job = false;  ///< as a job: later calls do not wait for it
    /// Of calls of one slot only the newest waits: it takes the place of one that still waits,
    /// unless a call without a slot was made between them. "" = of none.
    std::string slot{};
    Shown progress{};
  };

  /// ErrorCode::internal when the system gives no thread. The application outlives the client.
  static Result<std::unique_ptr<Client>> open(Application& app, Options options);
  /// Cancels all and waits for the end of what runs; callbacks of undelivered calls are not called.
  /// May be called within a callback of deliver().
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  Answer call(std::string command, Map args = {}, Done done = {});
  Answer call(std::string command, Map args, Done done, How how);
  /// The same as a job.
  Answer start(std::string command, Map args = {}, Done done = {});
  /// Runs work on the client's thread, in the order of the calls. `what` names it in errors.
  Answer run(std::string what, Work work, Done done = {});

  /// Begins a gesture; calls that join it wait for that. When it cannot begin, they fail with the
  /// reason.
  Edits begin_gesture(std::string label, Done done = {});
  /// Opens a draft, likewise. Any number may be open.
  Edits open_draft(std::string label, Done done = {});
  /// A command that joins edits; of the updates of a gesture or draft by the same command only the
  /// newest waits. `slot` separates updates that must not take each other's place, such as those
  /// of two links; "" = the command's name.
  Answer update(const Edits& edits, std::string command, Map args, Done done = {},
                std::string slot = {});
  /// Ends edits as one step (gesture.commit, draft.accept), after all that was called before. A
  /// draft that is in conflict with the document stays open.
  Answer commit(const Edits& edits, Done done = {});
  /// Ends edits and takes them back (gesture.cancel, draft.discard). Of what joins them, all that
  /// waits or runs is cancelled.
  Answer cancel(const Edits& edits, Done done = {});

  /// The number of a draft for draft.run and its like. An error if the edits are a gesture, or are
  /// not open (any more); on the client's thread all that was called before has been done. [any
  /// thread]
  [[nodiscard]] Result<std::uint64_t> draft_number(const Edits& edits) const;

  /// Ends a call: one that waits ends at once, one that runs as soon as its command looks whether
  /// it is cancelled. False when it has ended already.
  bool cancel(const Answer& answer);
  void cancel_all();  ///< that wait or run

  /// Calls waiting callbacks: first those of events, then those of calls that ended after these
  /// events, until none is left or the time is over, but at least one. Returns true if more wait;
  /// then it wakes again. The time that callbacks take is the host's.
  bool deliver(std::chrono::microseconds at_most = std::chrono::microseconds(500));

  /// Ends the client without waiting: all is cancelled, its gesture and drafts are taken back, the
  /// session ends. deliver() reports the rest; later calls are cancelled at once.
  void close();
  [[nodiscard]] bool is_closed() const;  ///< its thread and session have ended
  /// Calls that wait for their turn.
  [[nodiscard]] std::size_t waiting() const;
  /// True if deliver() has something to do. [the host's thread]
  [[nodiscard]] bool has_news() const;
  /// True if no call waits or runs, also as a job, and all results and events have been delivered.
  /// [the host's thread]
  [[nodiscard]] bool is_idle() const;

 private:
  explicit Client(std::shared_ptr<State> state);
  Answer add(std::shared_ptr<Entry> entry);
  Edits open_edits(bool is_draft, std::string label, Done done);
  std::shared_ptr<State> state_;
};

}  // namespace robomosp::ioci
