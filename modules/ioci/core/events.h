// SPDX-License-Identifier: Apache-2.0
// Events: changes of the document, messages, jobs, runs and recordings, executed commands, and
// other state that a window shows, through one interface (layer: application).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "kernel/jobs.h"
#include "kernel/messages.h"
#include "kernel/value.h"
#include "recording/recording.h"

namespace robomosp::ioci {

enum class Topic : std::uint8_t {
  change,
  message,
  job,
  run,
  recording,
  command,   ///< a command ended
  provider,  ///< providers were registered or withdrawn, or a default changed
  session,   ///< a session was opened or closed
  unsaved,   ///< the set of unsaved records changed
  setting,   ///< a setting of the program was changed
  memory,    ///< memory of the machine became short, or sufficient again
  draft      ///< a draft was opened, edited, accepted or discarded
};
inline constexpr Topic kAllTopics[] = {Topic::change,   Topic::message,   Topic::job,
                                       Topic::run,      Topic::recording, Topic::command,
                                       Topic::provider, Topic::session,   Topic::unsaved,
                                       Topic::setting,  Topic::memory,    Topic::draft};
[[nodiscard]] std::string_view to_string(Topic);
[[nodiscard]] constexpr std::uint32_t bit(Topic t) {
  return std::uint32_t{1} << static_cast<unsigned>(t);
}

/// A change of the document: one commit, or several merged for a slow subscriber.
struct Change {
  std::uint64_t first_revision = 0, revision = 0;          ///< equal for one commit
  std::size_t commits = 1;                                 ///< number of merged commits
  std::string label;                                       ///< of the last one
  document::Author author;                                 ///< of the last one
  document::CommitKind kind = document::CommitKind::edit;  ///< of the last one
  std::vector<document::RecordChange> records;  ///< null before = added, null after = removed
};

struct RunState {
  std::uint64_t run = 0;
  Map state;              ///< as returned by run.state
  bool is_pulse = false;  ///< one of many during playback: it replaces a waiting one
};

/// A command called by a session, reported at its end. Nested commands are part of it.
struct CommandRun {
  std::string command;
  std::string line;              ///< as Lua that runs, without secrets (secrets.h)
  bool is_whole = true;          ///< `line` has all arguments; else it cannot be run
  document::Author author;       ///< the session that called it
  double seconds = 0;            ///< that it took
  bool only_reads = false;       ///< according to the command table
  std::optional<Error> failure;  ///< empty = success
  std::uint64_t job = 0, gesture = 0, draft = 0;  ///< that it was part of; 0 = none
  bool is_scripted = false;  ///< called by Lua: a script, or what a console evaluates
};

/// A change of an object other than a record, as front ends see it.
struct Notice {
  std::string what;  ///< "registered", "closed"
  Map facts;
  /// A state: it replaces a waiting state notice of its topic.
  bool is_state = false;
};

struct Event {
  Topic topic = Topic::change;
  std::shared_ptr<const Change> change;
  std::shared_ptr<const Message> message;
  std::shared_ptr<const JobStatus> job;
  std::shared_ptr<const RunState> run;
  std::shared_ptr<const recording::RecordingChange> recording;
  /// Number of messages, commands and notices dropped before this event because too many waited.
  std::size_t left_out = 0;
  std::shared_ptr<const CommandRun> command = {};
  std::shared_ptr<const Notice> notice = {};  ///< of all further topics
};

/// Rate of states published for a playing run: default and maximum [1/s].
inline constexpr double kUsualRate = 60, kHighestRate = 1000;

/// Events wanted by a subscriber; all by default.
struct EventFilter {
  std::uint32_t topics = ~std::uint32_t{0};  ///< bits by Topic
  std::uint32_t kinds = ~std::uint32_t{0};   ///< bits by Kind: changes of other kinds are left out
  /// Only changes of these records and those they depend on; empty = of all.
  std::vector<AnyId> records{};
  std::uint64_t not_of = 0;            ///< skips events caused by this session; 0 = none
  bool previews = true;                ///< includes updates of gestures
  Severity severity = Severity::info;  ///< skips less severe messages
  double rate = kUsualRate;            ///< of states of a run that plays [1/s]
  std::size_t most = 256;  ///< events that wait; beyond it changes are merged, old messages dropped
  /// Includes commands that only read and succeeded.
  bool reads = false;
};

/// Thread-safe. Events wait until taken: a subscriber is never called under a lock, and may be
/// slow. [any thread]
class Events {
 public:
  /// `wake` (may be empty) is called when the first event arrives in an empty queue, on the
  /// publishing thread; it must not take events itself.
  std::uint64_t subscribe(EventFilter filter, std::function<void()> wake = {});
  /// Replaces `wake`; calls it at once if events are waiting.
  void set_wake(std::uint64_t token, std::function<void()> wake);
  bool unsubscribe(std::uint64_t token);
  /// The waiting events in order, each once; at most this many.
  [[nodiscard]] Result<std::vector<Event>> take(std::uint64_t token, std::size_t at_most = 1000);
  /// The same without waiting for a lock; nullopt = locked at this moment.
  [[nodiscard]] std::optional<std::vector<Event>> try_take(std::uint64_t token,
                                                           std::size_t at_most = 1000);
  [[nodiscard]] bool has_subscribers() const;
  /// The topics with subscribers, bits by Topic.
  [[nodiscard]] std::uint32_t topics() const;
  /// The highest rate of run states requested by a subscriber [1/s]; 0 = none.
  [[nodiscard]] double run_rate() const;

  void publish(const document::Commit&);  ///< in the order of the commits
  void publish(const Message&);
  void publish(const JobStatus&);
  void publish(RunState);
  /// An event for new rows replaces a waiting one of the same recording.
  void publish(const recording::RecordingChange&);
  void publish(CommandRun);
  void publish(Topic topic, Notice notice);

 private:
  struct Subscription {
    EventFilter filter;
    std::function<void()> wake;
    std::deque<Event> waiting;
    std::size_t left_out = 0;
  };
  static std::vector<Event> taken(Subscription&, std::size_t at_most);  // with mutex_ held
  void push(Subscription&, Event);                                      // with mutex_ held
  void bound(Subscription&);                                            // with mutex_ held
  template <class Wants>
  void deliver(const Wants& wants);
  mutable std::mutex mutex_;
  void note_topics();                                    // with mutex_ held
  std::map<std::uint64_t, Subscription> subscriptions_;  // guarded by mutex_
  std::atomic<std::uint32_t> topics_{0};                 ///< of all subscriptions, set with mutex_
  std::uint64_t next_ = 1;                               // guarded by mutex_
};

/// Names of the fields in which two records of one kind differ.
[[nodiscard]] std::vector<std::string> changed_fields(const model::Record& before,
                                                      const model::Record& after);
/// Adds the session that started a job, if one did.
void append_owner(Map& out, const JobOwner& owner);
/// An event as front ends see it.
[[nodiscard]] Map event_value(const Event& event);

}  // namespace robomosp::ioci
