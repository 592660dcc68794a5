// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/events.h"

#include <algorithm>
#include <utility>

#include "ioci/core/reads_wanted.h"
#include "ioci/core/secrets.h"
#include "kernel/fault.h"
#include "model/data.h"

namespace robomosp::ioci {
namespace {

using recording::RecordingChange;

std::string_view word_of(RecordingChange::What what) {
  switch (what) {
    case RecordingChange::What::added: return "added";
    case RecordingChange::What::appended: return "appended";
    case RecordingChange::What::replaced: return "replaced";
    case RecordingChange::What::removed: return "removed";
  }
  return "added";
}

std::uint32_t bit(Kind k) { return std::uint32_t{1} << static_cast<unsigned>(k); }

/// `older` and then `newer` as one change.
std::shared_ptr<const Change> merged(const Change& older, const Change& newer) {
  auto both = std::make_shared<Change>(newer);
  both->first_revision = older.first_revision;
  both->commits = older.commits + newer.commits;
  both->records = older.records;
  document::merge_changes(both->records, newer.records);
  // What came and went meanwhile was never there for the subscriber.
  std::erase_if(both->records, [](const auto& c) { return c.before == c.after; });
  return both;
}

bool is_wanted(const EventFilter& f, const document::Commit& c) {
  using document::CommitKind;
  if (!(f.topics & bit(Topic::change))) return false;
  if (f.not_of != 0 && c.author.session == f.not_of) return false;
  if (!f.previews && c.kind == CommitKind::preview) return false;
  if (!f.records.empty() && std::none_of(f.records.begin(), f.records.end(), [&](AnyId id) {
        return std::find(c.affected.begin(), c.affected.end(), id) != c.affected.end();
      }))
    return false;
  return c.changed.empty() || std::any_of(c.changed.begin(), c.changed.end(),
                                          [&](AnyId id) { return (f.kinds & bit(id.kind)) != 0; });
}

}  // namespace

std::string_view to_string(Topic t) {
  switch (t) {
    case Topic::change: return "change";
    case Topic::message: return "message";
    case Topic::job: return "job";
    case Topic::run: return "run";
    case Topic::recording: return "recording";
    case Topic::command: return "command";
    case Topic::provider: return "provider";
    case Topic::session: return "session";
    case Topic::unsaved: return "unsaved";
    case Topic::setting: return "setting";
    case Topic::memory: return "memory";
    case Topic::draft: return "draft";
  }
  return "change";
}

std::uint64_t Events::subscribe(EventFilter filter, std::function<void()> wake) {
  filter.most = std::max<std::size_t>(filter.most, 2);
  const std::lock_guard lock(mutex_);
  subscriptions_.emplace(next_, Subscription{std::move(filter), std::move(wake), {}, 0});
  note_topics();
  return next_++;
}

void Events::set_wake(std::uint64_t token, std::function<void()> wake) {
  std::function<void()> now;
  {
    const std::lock_guard lock(mutex_);
    const auto at = subscriptions_.find(token);
    if (at == subscriptions_.end()) return;
    at->second.wake = std::move(wake);
    if (!at->second.waiting.empty()) now = at->second.wake;
  }
  if (now) now();
}

bool Events::unsubscribe(std::uint64_t token) {
  const std::lock_guard lock(mutex_);
  if (subscriptions_.erase(token) == 0) return false;
  note_topics();
  return true;
}

void Events::note_topics() {
  std::uint32_t all = 0;
  for (const auto& [token, s] : subscriptions_) {
    all |= s.filter.topics & ~kReadsWanted;
    if (s.filter.reads && (s.filter.topics & bit(Topic::command))) all |= kReadsWanted;
  }
  topics_.store(all, std::memory_order_release);
}

bool Events::has_subscribers() const {
  const std::lock_guard lock(mutex_);
  return !subscriptions_.empty();
}

double Events::run_rate() const {
  double rate = 0;
  const std::lock_guard lock(mutex_);
  for (const auto& [token, s] : subscriptions_)
    if (s.filter.topics & bit(Topic::run)) rate = std::max(rate, s.filter.rate);
  return rate;
}

std::uint32_t Events::topics() const { return topics_.load(std::memory_order_acquire); }

Result<std::vector<Event>> Events::take(std::uint64_t token, std::size_t at_most) {
  const std::lock_guard lock(mutex_);
  const auto at = subscriptions_.find(token);
  if (at == subscriptions_.end())
    return error(ErrorCode::unknown_name, "there is no subscription " + std::to_string(token),
                 "Create one with event.subscribe.");
  return taken(at->second, at_most);
}

std::optional<std::vector<Event>> Events::try_take(std::uint64_t token, std::size_t at_most) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return std::nullopt;
  const auto at = subscriptions_.find(token);
  return at == subscriptions_.end() ? std::vector<Event>() : taken(at->second, at_most);
}

std::vector<Event> Events::taken(Subscription& s, std::size_t at_most) {
  auto& waiting = s.waiting;
  const auto count = static_cast<std::ptrdiff_t>(std::min(at_most, waiting.size()));
  std::vector<Event> out(std::make_move_iterator(waiting.begin()),
                         std::make_move_iterator(waiting.begin() + count));
  waiting.erase(waiting.begin(), waiting.begin() + count);
  return out;
}

/// Merges the changes that wait into one, keeps the newest state of each job, run and recording,
/// the newest of the states that have one, and the newest half of the messages, commands and
/// notices.
void Events::bound(Subscription& s) {
  std::deque<Event> kept;
  std::size_t messages = 0;
  std::shared_ptr<const Change> change;
  std::vector<std::uint64_t> jobs, runs, recordings;
  const auto is_new = [](std::vector<std::uint64_t>& seen, std::uint64_t id) {
    if (std::find(seen.begin(), seen.end(), id) != seen.end()) return false;
    seen.push_back(id);
    return true;
  };
  std::size_t left_out = 0;
  const auto keep_if_new = [&](const Event& e) {
    if (messages >= s.filter.most / 2) {
      ++left_out;
      return;
    }
    ++messages;
    kept.push_front(e);
    kept.front().left_out = 0;
  };
  for (auto it = s.waiting.rbegin(); it != s.waiting.rend(); ++it) {
    left_out += it->left_out;
    switch (it->topic) {
      case Topic::change: change = change ? merged(*it->change, *change) : it->change; break;
      case Topic::message:
      case Topic::command:
      case Topic::provider:
      case Topic::session:
      case Topic::unsaved:
      case Topic::setting:
      case Topic::memory:
      case Topic::draft: keep_if_new(*it); break;
      case Topic::job:
        if (is_new(jobs, it->job->id)) kept.push_front(*it);
        break;
      case Topic::run:
        if (is_new(runs, it->run->run)) kept.push_front(*it);
        break;
      case Topic::recording:
        if (is_new(recordings, it->recording->number)) kept.push_front(*it);
        break;
    }
  }
  if (change) {
    Event e;
    e.topic = Topic::change;
    e.change = std::move(change);
    kept.push_back(std::move(e));
  }
  if (left_out && !kept.empty()) kept.front().left_out = left_out;
  s.waiting = std::move(kept);
}

void Events::push(Subscription& s, Event event) {
  if (event.run && event.run->is_pulse)
    for (auto e = s.waiting.rbegin(); e != s.waiting.rend(); ++e) {
      if (!e->run || e->run->run != event.run->run) continue;
      if (!e->run->is_pulse) break;  // an older state would come after the new one
      e->run = std::move(event.run);
      return;
    }
  constexpr auto kAppended = RecordingChange::What::appended;
  if (event.recording && event.recording->what == kAppended)
    for (auto e = s.waiting.rbegin(); e != s.waiting.rend(); ++e) {
      if (!e->recording || e->recording->number != event.recording->number) continue;
      if (e->recording->what != kAppended) break;
      e->recording = std::move(event.recording);
      return;
    }
  if (event.notice && event.notice->is_state)
    if (const auto old = std::find_if(s.waiting.rbegin(), s.waiting.rend(),
                                      [&](const Event& e) {
                                        return e.topic == event.topic && e.notice &&
                                               e.notice->is_state;
                                      });
        old != s.waiting.rend()) {
      old->notice = std::move(event.notice);
      return;
    }
  if (s.waiting.size() >= s.filter.most) bound(s);
  // Still full of what cannot be joined: then the newest changes are joined one by one.
  if (s.waiting.size() >= s.filter.most && event.change && !s.waiting.empty() &&
      s.waiting.back().change) {
    s.waiting.back().change = merged(*s.waiting.back().change, *event.change);
    return;
  }
  s.waiting.push_back(std::move(event));
}

/// Calls `wants` for each subscription, which gives the event or nothing; then wakes.
template <class Wants>
void Events::deliver(const Wants& wants) {
  std::vector<std::function<void()>> wake;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [token, s] : subscriptions_) {
      std::optional<Event> event = wants(s.filter);
      if (!event) continue;
      if (s.waiting.empty() && s.wake) wake.push_back(s.wake);
      push(s, std::move(*event));
    }
  }
  for (const auto& fn : wake) fn();
}

void Events::publish(const document::Commit& commit) {
  if (!has_subscribers()) return;
  std::shared_ptr<const Change> whole;
  const auto make = [&](const EventFilter* filter) {
    auto change = std::make_shared<Change>();
    change->first_revision = change->revision = commit.revision;
    change->label = commit.label;
    change->author = commit.author;
    change->kind = commit.kind;
    if (!filter) {
      change->records = commit.records;
    } else {
      for (const auto& r : commit.records)
        if (filter->kinds & bit(r.id.kind)) change->records.push_back(r);
    }
    return change;
  };
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!is_wanted(f, commit)) return std::nullopt;
    const bool is_whole = std::all_of(commit.changed.begin(), commit.changed.end(),
                                      [&](AnyId id) { return (f.kinds & bit(id.kind)) != 0; });
    if (is_whole && !whole) whole = make(nullptr);
    Event e;
    e.topic = Topic::change;
    e.change = is_whole ? whole : make(&f);
    return e;
  });
}

void Events::publish(const Message& message) {
  std::shared_ptr<const Message> shared;
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(Topic::message)) || message.severity < f.severity) return std::nullopt;
    if (!shared) shared = std::make_shared<const Message>(message);
    Event e;
    e.topic = Topic::message;
    e.message = shared;
    return e;
  });
}

void Events::publish(const JobStatus& job) {
  std::shared_ptr<const JobStatus> shared;
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(Topic::job))) return std::nullopt;
    if (!shared) shared = std::make_shared<const JobStatus>(job);
    Event e;
    e.topic = Topic::job;
    e.job = shared;
    return e;
  });
}

void Events::publish(RunState run) {
  const auto shared = std::make_shared<const RunState>(std::move(run));
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(Topic::run))) return std::nullopt;
    Event e;
    e.topic = Topic::run;
    e.run = shared;
    return e;
  });
}

void Events::publish(const RecordingChange& recording) {
  std::shared_ptr<const RecordingChange> shared;
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(Topic::recording))) return std::nullopt;
    if (!shared) shared = std::make_shared<const RecordingChange>(recording);
    Event e;
    e.topic = Topic::recording;
    e.recording = shared;
    return e;
  });
}

void Events::publish(CommandRun run) {
  const auto shared = std::make_shared<const CommandRun>(std::move(run));
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(Topic::command))) return std::nullopt;
    if (!f.reads && shared->only_reads && !shared->failure) return std::nullopt;
    if (f.not_of != 0 && shared->author.session == f.not_of) return std::nullopt;
    Event e;
    e.topic = Topic::command;
    e.command = shared;
    return e;
  });
}

void Events::publish(Topic topic, Notice notice) {
  const auto shared = std::make_shared<const Notice>(std::move(notice));
  deliver([&](const EventFilter& f) -> std::optional<Event> {
    if (!(f.topics & bit(topic))) return std::nullopt;
    Event e;
    e.topic = topic;
    e.notice = shared;
    return e;
  });
}

std::vector<std::string> changed_fields(const model::Record& before, const model::Record& after) {
  std::vector<std::string> out;
  if (before.name != after.name) out.emplace_back("name");
  if (before.file != after.file) out.emplace_back("file");
  for (std::string& path : model::differences(before.body, after.body))
    out.push_back(std::move(path));
  return out;
}

void append_owner(Map& out, const JobOwner& owner) {
  if (owner.session == 0) return;
  out.set("session", owner.name);
  out.set("session_number", static_cast<std::int64_t>(owner.session));
  if (owner.gesture) out.set("gesture", static_cast<std::int64_t>(owner.gesture));
  if (owner.draft) out.set("draft", static_cast<std::int64_t>(owner.draft));
}

namespace {

/// The faults of a command that another session ran, without its secrets.
List seen_by_others(Error failure) {
  constexpr std::size_t kMostFaults = 20;
  amend(failure, [](Fault& f) {
    for (FaultRemedy& r : f.remedies) r.args = without_secrets(r.args);
  });
  return fault_list(failure, kMostFaults);
}

}  // namespace

Map event_value(const Event& event) {
  Map out{{"topic", to_string(event.topic)}};
  if (event.left_out) out.set("left_out", event.left_out);
  if (event.change) {
    const Change& c = *event.change;
    List added, removed, edited;
    for (const auto& r : c.records) {
      const Handle handle{std::string(to_string(r.id.kind)), r.id.number};
      if (r.before && r.after) {
        List fields;
        for (std::string& f : changed_fields(*r.before, *r.after))
          fields.emplace_back(std::move(f));
        if (!fields.empty())
          edited.emplace_back(Map{{"id", handle}, {"fields", std::move(fields)}});
      } else if (r.after) {
        added.emplace_back(handle);
      } else if (r.before) {
        removed.emplace_back(Map{{"id", handle}, {"name", r.before->name}});
      }
    }
    out.set("revision", static_cast<std::int64_t>(c.revision));
    out.set("first_revision", static_cast<std::int64_t>(c.first_revision));
    out.set("commits", c.commits);
    out.set("kind", document::to_string(c.kind));
    out.set("label", c.label);
    out.set("session", c.author.name);
    out.set("session_number", static_cast<std::int64_t>(c.author.session));
    out.set("added", std::move(added));
    out.set("removed", std::move(removed));
    out.set("edited", std::move(edited));
  } else if (event.message) {
    const Message& m = *event.message;
    out.set("severity", to_string(m.severity));
    out.set("code", m.code);
    out.set("text", m.text);
    out.set("source", m.source);
    out.set("repeated", static_cast<std::int64_t>(m.repeated));
    if (m.fault) out.set("fault", fault_map(*m.fault));
  } else if (event.job) {
    const JobStatus& j = *event.job;
    out.set("id", Handle{"job", j.id});
    out.set("label", j.label);
    out.set("state", to_string(j.state));
    out.set("fraction", j.fraction);
    out.set("what", j.what);
    append_owner(out, j.owner);
  } else if (event.run) {
    out.set("id", Handle{"run", event.run->run});
    out.set("state", event.run->state);
  } else if (event.recording) {
    const RecordingChange& r = *event.recording;
    out.set("id", Handle{"recording", r.number});
    out.set("kind", word_of(r.what));
    out.set("title", r.title);
    if (r.what != RecordingChange::What::removed) out.set("rows", r.rows);
  } else if (event.command) {
    const CommandRun& c = *event.command;
    out.set("command", c.command);
    out.set("line", c.line);
    if (!c.is_whole) out.set("whole", false);
    out.set("session", c.author.name);
    out.set("session_number", static_cast<std::int64_t>(c.author.session));
    out.set("seconds", c.seconds);
    out.set("only_reads", c.only_reads);
    out.set("outcome", !c.failure                                ? "done"
                       : c.failure->code == ErrorCode::cancelled ? "cancelled"
                                                                 : "failed");
    if (c.failure) {
      out.set("code", to_string(c.failure->code));
      out.set("text", c.failure->sentence());
      out.set("faults", seen_by_others(*c.failure));
    }
    if (c.job) out.set("job", Handle{"job", c.job});
    if (c.gesture) out.set("gesture", static_cast<std::int64_t>(c.gesture));
    if (c.draft) out.set("draft", static_cast<std::int64_t>(c.draft));
  } else if (event.notice) {
    out.set("what", event.notice->what);
    for (const auto& [name, value] : event.notice->facts) out.set(name, value);
  }
  return out;
}

}  // namespace robomosp::ioci
