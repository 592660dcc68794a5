// SPDX-License-Identifier: Apache-2.0
// Events: what happened, for whoever wants to know: changes of the document, messages, jobs, runs
// and recordings, all through one door (layer: application).
#pragma once

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

enum class Topic : std::uint8_t { change, message, job, run, recording };
inline constexpr Topic kAllTopics[] = {Topic::change, Topic::message, Topic::job, Topic::run,
                                       Topic::recording};
[[nodiscard]] std::string_view to_string(Topic);

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

struct Event {
  Topic topic = Topic::change;
  std::shared_ptr<const Change> change;
  std::shared_ptr<const Message> message;
  std::shared_ptr<const JobStatus> job;
  std::shared_ptr<const RunState> run;
  std::shared_ptr<const recording::RecordingChange> recording;
  /// Messages that were left out before this event, because too many waited.
  std::size_t left_out = 0;
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
  [[nodiscard]] bool has_subscribers() const;
  /// The highest rate at which a subscriber wants states of runs [1/s]; 0 = nobody wants them.
  [[nodiscard]] double run_rate() const;

  void publish(const document::Commit&);  ///< in the order of the commits
  void publish(const Message&);
  void publish(const JobStatus&);
  void publish(RunState);
  /// One that says that rows came takes the place of one that waits and says so.
  void publish(const recording::RecordingChange&);

 private:
  struct Subscription {
    EventFilter filter;
    std::function<void()> wake;
    std::deque<Event> waiting;
    std::size_t left_out = 0;
  };
  void push(Subscription&, Event);  // with mutex_ held
  void bound(Subscription&);        // with mutex_ held
  template <class Wants>
  void deliver(const Wants& wants);
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Subscription> subscriptions_;  // guarded by mutex_
  std::uint64_t next_ = 1;                               // guarded by mutex_
};

/// Names of the fields in which two records of one kind differ.
[[nodiscard]] std::vector<std::string> changed_fields(const model::Record& before,
                                                      const model::Record& after);
/// An event as front ends see it.
[[nodiscard]] Map event_value(const Event& event);

}  // namespace robomosp::ioci
