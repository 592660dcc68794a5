// SPDX-License-Identifier: Apache-2.0
// Events: what happened, for whoever wants to know: changes of the document, messages, jobs, runs
// and recordings, executed commands, and what else a window shows, all through one interface
// (layer: application).
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
  provider,  ///< providers were registered or withdrawn, or others are the default
  session,   ///< a session was opened or closed
  unsaved,   ///< the records that are not saved are others
  setting,   ///< a setting of the program was changed
  memory,    ///< the memory of the machine gets short, or is there again
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

/// A change of the document: one commit, or several in a row when the subscriber was slow.
struct Change {
  std::uint64_t first_revision = 0, revision = 0;          ///< equal for one commit
  std::size_t commits = 1;                                 ///< how many it was made of
  std::string label;                                       ///< of the last one
  document::Author author;                                 ///< of the last one
  document::CommitKind kind = document::CommitKind::edit;  ///< of the last one
  std::vector<document::RecordChange> records;  ///< null before = added, null after = removed
};

struct RunState {
  std::uint64_t run = 0;
  Map state;              ///< as run.state gives it
  bool is_pulse = false;  ///< one of many while it plays: it takes the place of one that waits
};

/// A command that a session called, at its end. What commands dispatch within is part of them.
struct CommandRun {
  std::string command;
  std::string line;              ///< as Lua that runs, without secrets (secrets.h)
  bool is_whole = true;          ///< `line` has all that was given; else it cannot be run
  document::Author author;       ///< the session that called it
  double seconds = 0;            ///< that it took
  bool only_reads = false;       ///< by the table of commands
  std::optional<Error> failure;  ///< none = it ended well
  std::uint64_t job = 0, gesture = 0, draft = 0;  ///< that it was a part of; 0 = of none
};

/// What happened to something that is no record, as front ends see it.
struct Notice {
  std::string what;  ///< "registered", "closed"
  Map facts;
  /// A state: it takes the place of a notice of its topic that waits and is one.
  bool is_state = false;
};

struct Event {
  Topic topic = Topic::change;
  std::shared_ptr<const Change> change;
  std::shared_ptr<const Message> message;
  std::shared_ptr<const JobStatus> job;
  std::shared_ptr<const RunState> run;
  std::shared_ptr<const recording::RecordingChange> recording;
  /// Messages, commands and notices that were left out before this event, because too many waited.
  std::size_t left_out = 0;
  std::shared_ptr<const CommandRun> command = {};
  std::shared_ptr<const Notice> notice = {};  ///< of all further topics
};

/// How often states of a run that plays are published, when nothing is said and at most [1/s].
inline constexpr double kUsualRate = 60, kHighestRate = 1000;

/// What a subscriber wants; all of it by default.
struct EventFilter {
  std::uint32_t topics = ~std::uint32_t{0};  ///< bits by Topic
  std::uint32_t kinds = ~std::uint32_t{0};   ///< bits by Kind: changes of other kinds are left out
  /// Only changes of these records and of what they depend on; empty = of all.
  std::vector<AnyId> records{};
  std::uint64_t not_of = 0;            ///< leaves out what this session did; 0 = nobody's
  bool previews = true;                ///< with the updates of gestures
  Severity severity = Severity::info;  ///< messages that are less severe are left out
  double rate = kUsualRate;            ///< of states of a run that plays [1/s]
  std::size_t most = 256;  ///< events that wait; beyond it changes are merged, old messages dropped
  /// With commands that only read and ended well.
  bool reads = false;
};

/// Thread-safe. What is published waits until it is taken: a subscriber is never called with
/// anything locked, and can be as slow as it likes. [any thread]
class Events {
 public:
  /// `wake` (may be empty) is called after something came while nothing waited, by the thread that
  /// published it; it takes nothing itself.
  std::uint64_t subscribe(EventFilter filter, std::function<void()> wake = {});
  /// Replaces `wake`, which is called at once when something waits already.
  void set_wake(std::uint64_t token, std::function<void()> wake);
  bool unsubscribe(std::uint64_t token);
  /// What waits, in order, each event once; at most so many.
  [[nodiscard]] Result<std::vector<Event>> take(std::uint64_t token, std::size_t at_most = 1000);
  /// The same where nothing holds the events at this moment; nullopt = something does.
  [[nodiscard]] std::optional<std::vector<Event>> try_take(std::uint64_t token,
                                                           std::size_t at_most = 1000);
  [[nodiscard]] bool has_subscribers() const;
  /// The topics that somebody wants, bits by Topic.
  [[nodiscard]] std::uint32_t topics() const;
  /// The highest rate at which a subscriber wants states of runs [1/s]; 0 = nobody wants them.
  [[nodiscard]] double run_rate() const;

  void publish(const document::Commit&);  ///< in the order of the commits
  void publish(const Message&);
  void publish(const JobStatus&);
  void publish(RunState);
  /// One that says that rows came takes the place of one that waits and says so.
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
