// SPDX-License-Identifier: Apache-2.0
#include "document/document.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "document/digest.h"
#include "document/draft.h"
#include "document/graph.h"
#include "document/history.h"
#include "document/state.h"
#include "document/validate.h"
#include "kernel/check.h"
#include "kernel/fault.h"
#include "kernel/permit.h"
#include "kernel/text.h"

namespace robomosp::document {

namespace {

using text::quote;

constexpr std::size_t kMostNamed = 5;  ///< referrers named in a refusal

Error stale(AnyId id) {
  return error(
      ErrorCode::stale_handle,
      std::string(to_string(id.kind)) + " #" + std::to_string(id.number) + " no longer exists",
      "Look it up again by its name.");
}

std::string name_some(const Snapshot& s, const std::vector<AnyId>& ids) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < ids.size() && i < kMostNamed; ++i)
    words.push_back(s.describe(ids[i]));
  if (ids.size() > kMostNamed) words.push_back(std::to_string(ids.size() - kMostNamed) + " more");
  return text::enumerate(words);
}

}  // namespace

struct Document::Impl {
  struct Gesture {
    std::uint64_t number = 0;
    std::shared_ptr<const Deed> deed;
    std::vector<RecordChange> changes;  ///< since it began
  };

  std::unique_ptr<AppLock> own_lock;
  AppLock* lock = nullptr;
  mutable std::mutex current_mutex;  ///< for a moment only: reading needs no application lock
  SnapshotPtr current = std::make_shared<const Snapshot>();  // guarded by current_mutex
  std::atomic<std::uint64_t> next_id{1};
  /// Of all drafts, so that two of them, or a draft and the document, never show one number.
  std::atomic<std::uint64_t> next_draft_revision{Draft::kFirstRevision};
  std::atomic<std::uint64_t> epoch{0};  ///< counts clear(): what was begun before cannot commit
  // Guarded by the application lock:
  History history;
  std::vector<Gesture> gestures;                                     ///< open ones
  std::unordered_map<AnyId, std::shared_ptr<const Deed>> last_deed;  ///< who changed a record last
  std::vector<std::function<void(const Commit&)>> listeners;
  std::uint64_t revision = 0, next_gesture = 1;

  Impl(std::size_t budget, AppLock* given)
      : own_lock(given ? nullptr : std::make_unique<AppLock>()),
        lock(given ? given : own_lock.get()),
        history(budget) {}

  [[nodiscard]] SnapshotPtr now() const {
    const std::lock_guard guard(current_mutex);
    return current;
  }

  SnapshotPtr publish(std::shared_ptr<Snapshot::State> state) {
    state->revision = ++revision;
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->state_ = std::move(state);
    SnapshotPtr shared = std::move(snapshot);
    SnapshotPtr old = shared;  // let go after the mutex
    const std::lock_guard guard(current_mutex);
    std::swap(current, old);
    return shared;
  }

  void note(const std::shared_ptr<const Deed>& deed, const std::vector<RecordChange>& changes) {
    for (const RecordChange& c : changes) last_deed[c.id] = deed;
  }

  /// Reports what was published.
  Commit report(const Snapshot& now, std::string label, Author author, CommitKind kind,
                std::vector<RecordChange> changes) {
    Commit commit;
    commit.revision = now.revision();
    commit.label = std::move(label);
    commit.author = std::move(author);
    commit.kind = kind;
    commit.changed.reserve(changes.size());
    for (const RecordChange& c : changes) commit.changed.push_back(c.id);
    commit.affected = affected_order(now, commit.changed);
    commit.records = std::move(changes);
    if (!listeners.empty())
      lock->later([all = listeners, commit] {
        for (const auto& fn : all) fn(commit);
      });
    return commit;
  }

  [[nodiscard]] Gesture* find_gesture(std::uint64_t number) {
    const auto at = std::find_if(gestures.begin(), gestures.end(),
                                 [&](const Gesture& g) { return g.number == number; });
    return at == gestures.end() ? nullptr : &*at;
  }

  /// `session "rig" (world.place cell)` for whoever changed a record last.
  [[nodiscard]] std::string culprit(AnyId id) const {
    const auto at = last_deed.find(id);
    if (at == last_deed.end()) return "another edit";
    return words(*at->second);
  }
  static std::string words(const Deed& deed) {
    return (deed.author.name.empty() ? std::string("the program")
                                     : "session " + quote(deed.author.name)) +
           " (" + deed.label + ")";
  }

  /// The state with the records of `changes` as they were before (or after) them: refused when one
  /// of them is not as it was left, or when the document would not hold together.
  Result<std::shared_ptr<Snapshot::State>> put_back(const Snapshot& now,
                                                    const std::vector<RecordChange>& changes,
                                                    bool backwards) const;
  [[nodiscard]] Result<void> follows_worlds(const Snapshot& before, const Snapshot& after,
                                            const std::vector<RecordChange>& changes) const;

  /// Refuses what others may not do while a gesture is open; `own` is the gesture that does it.
  [[nodiscard]] Result<void> free_of_gestures(const Snapshot& after,
                                              const std::vector<RecordChange>& changes,
                                              std::uint64_t own) const {
    for (const Gesture& g : gestures) {
      if (g.number == own || g.changes.empty()) continue;
      for (const RecordChange& c : changes)
        for (const RecordChange& held : g.changes)
          if (held.id == c.id)
            return error(ErrorCode::conflict,
                         after.describe(c.id) + " is in a gesture of " + words(*g.deed),
                         "Wait until that has ended.");
      if (auto undone = put_back(after, g.changes, true); !undone.ok())
        return error(ErrorCode::conflict,
                     "a gesture of " + words(*g.deed) +
                         " could not be cancelled after it: " + undone.error().message,
                     "Wait until that has ended.");
    }
    return {};
  }

  Result<Commit> step(std::optional<std::uint64_t> session, std::uint64_t number, bool is_undo);
};

namespace {

bool is_same(const RecordPtr& a, const RecordPtr& b) { return a == b || (a && b && equal(*a, *b)); }
/// The same for the history: where a record is kept is no part of it.
bool is_alike(const RecordPtr& a, const RecordPtr& b) {
  return a == b || (a && b && same_content(*a, *b));
}
/// The record as it is kept in the file of another.
RecordPtr kept_as(const RecordPtr& record, const RecordPtr& other) {
  if (!record || !other || (record->file == other->file && record->disk == other->disk))
    return record;
  auto out = std::make_shared<Record>(*record);
  out->file = other->file;
  out->disk = other->disk;
  return out;
}

}  // namespace

Result<std::shared_ptr<Snapshot::State>> Document::Impl::put_back(
    const Snapshot& now, const std::vector<RecordChange>& changes, bool backwards) const {
  for (const RecordChange& c : changes)
    if (!is_alike(now.share(c.id), backwards ? c.after : c.before)) {
      const RecordPtr& known = c.after ? c.after : c.before;
      return error(ErrorCode::conflict,
                   std::string(to_string(c.id.kind)) + " " + quote(known->name) +
                       " has since been changed by " + culprit(c.id),
                   "Undo that first, or edit it manually.");
    }
  auto state = std::make_shared<Snapshot::State>(*now.state_);
  std::vector<AnyId> ids;
  for (auto it = changes.rbegin(); it != changes.rend(); ++it) {
    state->put(it->id, kept_as(backwards ? it->before : it->after, now.share(it->id)));
    ids.push_back(it->id);
  }
  state->relink(ids);
  Snapshot after;
  after.state_ = state;
  for (const AnyId id : ids) {
    const Record* record = after.find(id);
    if (!record) {
      const auto users = state->dangling(id);
      if (users.empty()) continue;
      return error(ErrorCode::conflict,
                   name_some(after, users) + (users.size() == 1 ? " refers" : " refer") + " to " +
                       now.describe(id) + " since " + culprit(users.front()),
                   "Undo that first, or remove the reference.");
    }
    if (const auto named = after.find(id.kind, record->name); named != id)
      return error(ErrorCode::conflict,
                   "there is " + with_article(to_string(id.kind)) + " named " +
                       quote(record->name) + " since " + culprit(*named),
                   "Rename that first.");
    if (auto held = check_references(after, *record); !held.ok()) return std::move(held).error();
  }
  RMP_TRY(refuse_cycles(after,
                        {[&now](AnyId id) { return now.find(id); },
                         [&now](AnyId from, AnyId to) { return now.state_->refers(from, to); }},
                        ids));
  RMP_TRY(follows_worlds(now, after, changes));
  return state;
}

/// Expressions over the parameters of worlds that change must still have the values that they hold.
Result<void> Document::Impl::follows_worlds(const Snapshot& before, const Snapshot& after,
                                            const std::vector<RecordChange>& changes) const {
  std::vector<std::string> worlds;
  for (const RecordChange& c : changes) {
    if (c.id.kind != Kind::world) continue;
    const Record* was = before.find(c.id);
    const Record* is = after.find(c.id);
    if (was && is && was->name == is->name &&
        std::get<model::World>(was->body).parametric.parameters ==
            std::get<model::World>(is->body).parametric.parameters)
      continue;
    if (was) worlds.push_back(was->name);
    if (is) worlds.push_back(is->name);
  }
  if (worlds.empty()) return {};
  for (const AnyId user : after.users_of_worlds()) {
    const Record& record = *after.find(user);
    const auto mentions = model::world_mentions(record.body);
    if (std::none_of(mentions.begin(), mentions.end(), [&](const auto& n) {
          return std::find(worlds.begin(), worlds.end(), n.scope) != worlds.end();
        }))
      continue;
    Record again = record;
    const auto known = after.world_parameters();
    bool is_absent = false;
    for (const auto& n : mentions)
      is_absent = is_absent || (before.world_parameters()(n) && !known(n));
    if (!is_absent && model::resolve(again.body, again.name, known).ok() && equal(again, record))
      continue;
    return error(ErrorCode::conflict,
                 after.describe(user) + " uses its parameters since " + culprit(user),
                 "Undo that first, or give its numbers plain values.");
  }
  return {};
}

Result<Commit> Document::Impl::step(std::optional<std::uint64_t> session, std::uint64_t number,
                                    bool is_undo) {
  RMP_TRY(require(Effect::edits));
  const char* verb = is_undo ? "undo" : "redo";
  const AppLock::Hold hold(*lock, verb);
  for (const Gesture& g : gestures)
    if (!session || g.deed->author.session == *session)
      return error(
          ErrorCode::conflict,
          std::string("cannot ") + verb + " while the gesture " + words(*g.deed) + " is open",
          "Commit or cancel it first.");
  Step* s = number    ? history.find(number)
            : is_undo ? history.next_undo(session)
                      : history.next_redo(session);
  if (number && (!s || (s->undone != 0) == is_undo))
    return error(ErrorCode::conflict,
                 s ? "step " + std::to_string(number) + (is_undo ? " is undone" : " is not undone")
                   : "there is no step " + std::to_string(number),
                 "document.history lists the steps.");
  if (number && session && s->deed->author.session != *session)
    return error(ErrorCode::conflict,
                 "step " + std::to_string(number) + " was made by " + words(*s->deed),
                 "A session can undo only its own steps.");
  if (!s) {
    std::string hint;
    if (is_undo && history.forgotten())
      hint = std::to_string(history.forgotten()) +
             " older steps were forgotten to keep the history within " +
             std::to_string(history.budget() >> 20) + " MiB (document.history_memory).";
    return error(ErrorCode::conflict, std::string("there is nothing to ") + verb, hint);
  }
  const SnapshotPtr before = this->now();
  auto state = put_back(*before, s->changes, is_undo);
  if (!state.ok())
    return std::move(state).error().in(std::string(verb) + " of " + quote(s->deed->label));
  std::vector<RecordChange> changes;
  changes.reserve(s->changes.size());
  {
    Snapshot after;
    after.state_ = *state;
    for (const RecordChange& c : s->changes)
      changes.push_back({c.id, before->share(c.id), after.share(c.id)});
    RMP_TRY(free_of_gestures(after, changes, 0));
  }
  const SnapshotPtr now = publish(std::move(*state));
  // A record that goes, and comes back later, knows the file that it was saved to meanwhile.
  for (std::size_t i = 0; i < changes.size(); ++i) {
    s->changes[i].before = is_undo ? changes[i].after : changes[i].before;
    s->changes[i].after = is_undo ? changes[i].before : changes[i].after;
  }
  history.mark(*s, is_undo);
  const Deed deed = *s->deed;
  note(s->deed, changes);
  return report(*now, deed.label, deed.author, is_undo ? CommitKind::undo : CommitKind::redo,
                std::move(changes));
}

namespace {

Error cleared_meanwhile() {
  return error(ErrorCode::conflict, "the document was cleared while this transaction was open");
}

}  // namespace

/// What a draft and the transactions on it share.
struct Draft::Branch {
  Branch(Document& d, std::string name, Author who)
      : document(d), label(std::move(name)), author(std::move(who)), epoch(d.impl_->epoch) {
    base = now = document.now();
  }
  Document& document;
  const std::string label;
  const Author author;
  const std::uint64_t epoch;
  SnapshotPtr base;
  bool is_beside = false;  ///< its base was never the document's
  std::mutex mutex;
  // Guarded by mutex:
  enum class Phase : std::uint8_t { open, accepting, ended } phase = Phase::open;
  SnapshotPtr now;
  Snapshot::Reads reads;       ///< of the transactions that edited it
  std::vector<AnyId> touched;  ///< in order of first touch
  std::unordered_set<AnyId> is_touched;
  std::unordered_map<AnyId, RecordPtr> outside;  ///< of the history
  std::size_t commits = 0;
  /// The last preview on a later state of the document, and what it was made from.
  struct Preview {
    SnapshotPtr document, draft, shown;
  };
  Preview preview;

  /// With mutex held.
  [[nodiscard]] Result<void> usable() const {
    if (phase == Phase::open) return {};
    return error(ErrorCode::conflict,
                 "the draft " + quote(label) +
                     (phase == Phase::accepting ? " is being accepted" : " has ended"),
                 "Open another one.");
  }
};

struct Transaction::Work {
  Document::Impl* document = nullptr;
  std::shared_ptr<Draft::Branch> branch;  ///< what it changes; null = the document
  std::string label, series;
  Author author;
  std::uint64_t gesture = 0;  ///< 0 = a step of its own
  std::uint64_t epoch = 0;
  std::shared_ptr<const Snapshot::State> base;
  Snapshot now;
  std::vector<AnyId> touched;  ///< in order of first touch
  std::unordered_set<AnyId> is_touched;
  bool is_outside = false;                       ///< of the history
  std::unordered_map<AnyId, RecordPtr> outside;  ///< added so, as they were added
  bool is_closed = false, is_overtaken = false;

  /// What it changes in its base.
  [[nodiscard]] std::vector<RecordChange> changes() const;
  /// Whether the records hold together with them.
  [[nodiscard]] Result<void> judge(const std::vector<RecordChange>& all,
                                   const Progress* progress) const;
  Result<void> rebase(std::shared_ptr<const Snapshot::State> onto, const Snapshot::Reads& reads);
  /// Publishes it on its branch.
  Result<Commit> commit_to_branch(std::vector<RecordChange> all, const Snapshot::Reads& reads,
                                  const Progress* progress);

  Snapshot::State& state() {
    // Snapshot hands its state out as const; here it is ours as long as nobody shares it.
    auto mutable_state = std::const_pointer_cast<Snapshot::State>(std::move(now.state_));
    Snapshot::State& s = unique(mutable_state);
    now.state_ = std::move(mutable_state);
    return s;
  }
  void put(AnyId id, RecordPtr record) {
    state().put(id, std::move(record));
    if (is_touched.insert(id).second) touched.push_back(id);
  }
  /// Puts a record other than a world, its expressions evaluated.
  Result<void> put_resolved(AnyId id, const Record* old, std::shared_ptr<Record> record) {
    auto resolved = model::resolve(record->body, record->name, now.world_parameters(),
                                   old ? &old->body : nullptr);
    if (!resolved.ok())
      return std::move(resolved).error().in(std::string(to_string(id.kind)) + " " +
                                            quote(record->name));
    put(id, std::move(record));
    return {};
  }
  Result<void> put_world(AnyId id, const Record* old, std::shared_ptr<Record> record);
  /// Refuses, naming who, when expressions use a parameter of the world.
  [[nodiscard]] Result<void> unused(AnyId world) const {
    const Record& record = *now.find(world);
    const auto& parametric = std::get<model::World>(record.body).parametric;
    std::vector<AnyId> users;
    for (const AnyId user : now.users_of_worlds())
      for (const auto& n : model::world_mentions(now.find(user)->body))
        if (n.scope == record.name && model::find_parameter(parametric, n.name) &&
            (users.empty() || users.back() != user))
          users.push_back(user);
    if (users.empty()) return {};
    return error(ErrorCode::conflict,
                 "cannot remove " + now.describe(world) + ": " + name_some(now, users) +
                     (users.size() == 1 ? " uses its parameters" : " use its parameters"),
                 "Give their numbers plain values or other expressions first.");
  }
  Result<void> usable() const {
    RMP_TRY(require(Effect::edits));
    if (is_closed)
      return error(ErrorCode::conflict, "this transaction has ended", "Start a new one.");
    if (epoch != document->epoch) return cleared_meanwhile();
    return {};
  }
  Result<void> free_of(Kind kind, const std::string& name) const {
    if (!now.find(kind, name)) return {};
    return error(ErrorCode::conflict,
                 "there is already " + with_article(to_string(kind)) + " named " + quote(name),
                 "Choose another name.");
  }
};

/// Puts a world, and with it the records that use its parameters: all or none.
Result<void> Transaction::Work::put_world(AnyId id, const Record* old,
                                          std::shared_ptr<Record> record) {
  const std::string where = "world " + quote(record->name);
  const bool is_renamed = old && old->name != record->name;
  const auto follow_name = [&](const Expression::Name& n) {
    return is_renamed && n.scope == old->name ? Expression::Name{record->name, n.name} : n;
  };
  if (is_renamed) model::rename_in(record->body, follow_name);
  const model::WorldParameters none = [](const Expression::Name&) { return std::nullopt; };
  auto resolved =
      model::resolve(record->body, record->name, none, old && !is_renamed ? &old->body : nullptr);
  if (!resolved.ok()) return std::move(resolved).error().in(where);

  const auto& after = std::get<model::World>(record->body).parametric;
  const model::Parametric nothing;
  const auto& before = old ? std::get<model::World>(old->body).parametric : nothing;
  std::vector<std::pair<AnyId, std::shared_ptr<Record>>> followers;
  if (is_renamed || before.parameters != after.parameters) {
    const auto present = now.world_parameters();
    const model::WorldParameters worlds =
        [&](const Expression::Name& n) -> std::optional<Quantity> {
      if (n.scope != record->name) return present(n);
      const model::Parameter* p = model::find_parameter(after, n.name);
      return p ? std::optional(model::quantity_of(*p)) : std::nullopt;
    };
    for (const AnyId user : now.users_of_worlds()) {
      const Record& reader = *now.find(user);
      bool follows = false;
      for (const auto& n : model::world_mentions(reader.body)) {
        const bool is_old = old && n.scope == old->name;
        follows = follows || is_old || n.scope == record->name;
        if (!is_old || model::find_parameter(after, n.name) ||
            !model::find_parameter(before, n.name))
          continue;
        return error(ErrorCode::conflict,
                     "cannot remove parameter " + quote(n.name) + ": " + now.describe(user) +
                         " uses it (" + text::enumerate(model::uses_of(reader.body, n)) + ")",
                     "Give it a plain number or another expression first.", where);
      }
      if (!follows) continue;
      auto follower = std::make_shared<Record>(reader);
      if (is_renamed) model::rename_in(follower->body, follow_name);
      resolved = model::resolve(follower->body, follower->name, worlds);
      if (!resolved.ok()) return std::move(resolved).error().in(now.describe(user));
      followers.emplace_back(user, std::move(follower));
    }
  }
  put(id, std::move(record));
  for (auto& [user, follower] : followers) put(user, std::move(follower));
  return {};
}

Transaction::Transaction(Document& document, std::string label, Author author, std::string series,
                         std::uint64_t gesture)
    : work_(std::make_unique<Work>()) {
  work_->document = document.impl_.get();
  work_->label = std::move(label);
  work_->author = std::move(author);
  work_->series = std::move(series);
  work_->gesture = gesture;
  work_->epoch = work_->document->epoch;
  work_->base = work_->document->now()->state_;
  work_->now.state_ = work_->base;
  work_->now.reads_ = std::make_shared<Snapshot::Reads>();
}
Transaction::Transaction(Transaction&&) noexcept = default;
Transaction::~Transaction() = default;

void Transaction::base_on(const SnapshotPtr& snapshot) {
  RMP_CHECK(work_->touched.empty(), "a transaction with edits cannot change its base");
  work_->base = snapshot->state_;
  work_->now.state_ = work_->base;
}

const std::vector<AnyId>& Transaction::touched() const { return work_->touched; }
Snapshot Transaction::before() const {
  Snapshot s;
  s.state_ = work_->base;
  return s;
}
const Snapshot& Transaction::now() const {
  RMP_CHECK(work_ != nullptr, "a moved-from transaction was used");
  return work_->now;
}

Result<AnyId> Transaction::add(Record record) {
  RMP_TRY(work_->usable());
  const Kind kind = record.kind();
  if (!is_name(record.name)) return bad_name(record.name, to_string(kind));
  RMP_TRY(work_->free_of(kind, record.name));
  const AnyId id{kind, work_->document->next_id++};
  auto added = std::make_shared<Record>(std::move(record));
  if (kind == Kind::world) RMP_TRY(work_->put_world(id, nullptr, std::move(added)));
  else RMP_TRY(work_->put_resolved(id, nullptr, std::move(added)));
  if (work_->is_outside) work_->outside[id] = work_->now.share(id);
  return id;
}

bool Transaction::set_outside_history(bool on) { return std::exchange(work_->is_outside, on); }

Result<void> Transaction::edit(AnyId id, const std::function<Result<void>(Record&)>& change) {
  RMP_TRY(work_->usable());
  const RecordPtr old = work_->now.share(id);
  if (!old) return stale(id);
  auto record = std::make_shared<Record>(*old);
  RMP_TRY(change(*record));
  if (record->kind() != id.kind)
    return error(ErrorCode::invalid_argument, "an edit cannot turn " + work_->now.describe(id) +
                                                  " into " +
                                                  with_article(to_string(record->kind())));
  if (record->name != old->name) {
    if (!is_name(record->name)) return bad_name(record->name, to_string(id.kind));
    RMP_TRY(work_->free_of(id.kind, record->name));
  }
  model::follow_edit(old->body, record->body);
  return id.kind == Kind::world ? work_->put_world(id, old.get(), std::move(record))
                                : work_->put_resolved(id, old.get(), std::move(record));
}

Result<void> Transaction::remove(AnyId id) {
  RMP_TRY(work_->usable());
  if (!work_->now.find(id)) return stale(id);
  auto referrers = work_->now.referrers(id);
  if (!referrers.empty())
    return error(ErrorCode::conflict,
                 "cannot remove " + work_->now.describe(id) + ": " +
                     name_some(work_->now, referrers) +
                     (referrers.size() == 1 ? " refers to it" : " refer to it"),
                 referrers.size() == 1 ? "Remove or change that one first."
                                       : "Remove or change those first.");
  if (id.kind == Kind::world) RMP_TRY(work_->unused(id));
  work_->put(id, nullptr);
  return {};
}

std::string Transaction::free_name(Kind kind, std::string_view wanted) const {
  const auto numbered = [&](std::size_t n) {
    return n == 1 ? std::string(wanted) : std::string(wanted) + "_" + std::to_string(n);
  };
  const auto is_taken = [&](std::size_t n) { return work_->now.find(kind, numbered(n)); };
  // Of few the first that is free; of many one behind a taken one, without asking for all of them.
  constexpr std::size_t kFew = 16;
  for (std::size_t n = 1; n <= kFew; ++n)
    if (!is_taken(n)) return numbered(n);
  std::size_t taken = kFew, free = 2 * kFew;
  while (is_taken(free)) taken = free, free *= 2;
  while (free - taken > 1)
    if (const std::size_t n = taken + (free - taken) / 2; is_taken(n)) taken = n;
    else free = n;
  return numbered(free);
}

std::vector<RecordChange> Transaction::Work::changes() const {
  std::vector<RecordChange> all;
  for (const AnyId id : touched) {
    const RecordPtr* before = base->find(id);
    const RecordPtr after = now.share(id);
    if (!before && !after) continue;
    if (before && after && is_same(*before, after)) continue;
    all.push_back({id, before ? *before : nullptr, after});
  }
  return all;
}

Result<void> Transaction::Work::judge(const std::vector<RecordChange>& all,
                                      const Progress* progress) const {
  std::vector<AnyId> changed;
  changed.reserve(all.size());
  for (const RecordChange& c : all) changed.push_back(c.id);
  // What a record shares with the one before was right there and is so here, as long as all that it
  // refers to is still there.
  const bool is_all_there =
      std::all_of(all.begin(), all.end(), [](const RecordChange& c) { return c.after != nullptr; });
  for (const RecordChange& c : all) {
    if (!c.after) continue;
    const auto about = [&c](Result<void> checked) {
      if (!checked.ok() && checked.error().code != ErrorCode::cancelled)
        amend(checked.error(), [&](Fault& f) {
          if (f.code.starts_with("error.")) f.code = "record.bad_reference";
          f.subject.record = {std::string(to_string(c.id.kind)), c.id.number};
          f.subject.name = c.after->name;
        });
      return checked;
    };
    RMP_TRY(about(check_edit(*c.after, c.before.get(), progress)));
    RMP_TRY(about(check_references(now, *c.after, is_all_there ? c.before.get() : nullptr)));
  }
  return refuse_cycles(now,
                       {[this](AnyId id) -> const Record* {
                          const RecordPtr* r = base->find(id);
                          return r ? r->get() : nullptr;
                        },
                        [this](AnyId from, AnyId to) { return base->refers(from, to); }},
                       changed);
}

/// Makes the edits again on another state, in which all that was looked at is the same.
Result<void> Transaction::Work::rebase(std::shared_ptr<const Snapshot::State> onto,
                                       const Snapshot::Reads& reads) {
  if (const auto found = reads.difference(*base, *onto)) {
    is_overtaken = true;
    return error(ErrorCode::conflict,
                 found->what +
                     (branch      ? " by another edit of the draft"
                      : found->id ? " by " + document->culprit(found->id)
                                  : "") +
                     " while " + label + " was running",
                 "Nothing was changed. Run it again.");
  }
  auto state = std::make_shared<Snapshot::State>(*onto);
  for (const AnyId id : touched) {
    const RecordPtr *before = base->find(id), *after = Snapshot::State::of(now).find(id),
                    *current = onto->find(id);
    if (!before && !after) continue;
    // Somebody may have saved it meanwhile.
    const bool is_kept_elsewhere = before && after && current &&
                                   (*before)->file == (*after)->file &&
                                   (*before)->disk == (*after)->disk;
    state->put(id, is_kept_elsewhere ? kept_as(*after, *current) : after ? *after : nullptr);
  }
  base = std::move(onto);
  now.state_ = std::move(state);
  return {};
}

Result<Commit> Transaction::commit(const Progress* progress) {
  Work& w = *work_;
  const auto go_on = [&]() -> Result<void> {
    if (!progress || !progress->cancelled()) return {};
    return error(ErrorCode::cancelled, w.label + " was cancelled before it finished",
                 "Nothing was changed.");
  };
  if (w.is_closed || w.epoch != w.document->epoch) RMP_TRY(w.usable());
  Document::Impl& doc = *w.document;
  w.is_closed = true;
  // What is looked at from here on is looked at again after a rebase.
  const auto reads = std::exchange(w.now.reads_, nullptr);
  std::vector<RecordChange> all = w.changes();
  if (all.empty()) {
    Commit none;
    none.revision = doc.now()->revision();
    none.label = w.label;
    none.author = w.author;
    return none;
  }
  RMP_TRY(require(Effect::edits));
  RMP_TRY(go_on());
  RMP_TRY(w.judge(all, progress));
  RMP_TRY(go_on());
  if (w.branch) return w.commit_to_branch(std::move(all), *reads, progress);

  const AppLock::Hold hold(*doc.lock, w.label);
  if (w.epoch != doc.epoch) return cleared_meanwhile();
  if (const auto current = doc.now()->state_; current != w.base) {
    RMP_TRY(w.rebase(current, *reads));
    all = w.changes();
    RMP_TRY(w.judge(all, progress));
  }
  Document::Impl::Gesture* gesture = w.gesture ? doc.find_gesture(w.gesture) : nullptr;
  if (w.gesture && !gesture)
    return error(ErrorCode::conflict, "the gesture of this edit has ended", "Start a new one.");
  if (!doc.gestures.empty()) RMP_TRY(doc.free_of_gestures(w.now, all, w.gesture));

  w.state();  // ours alone, so that publish() may number it
  auto state = std::const_pointer_cast<Snapshot::State>(std::move(w.now.state_));
  w.now.state_ = w.base;
  const SnapshotPtr now = doc.publish(std::move(state));
  w.now.state_ = now->state_;

  // What came from the library was there before the step, as far as the history knows; and that a
  // record was saved is nothing to take back.
  std::vector<RecordChange> step;
  for (const RecordChange& c : all) {
    const auto loaded = w.outside.empty() ? w.outside.end() : w.outside.find(c.id);
    const bool is_loaded = loaded != w.outside.end();
    const RecordPtr& before = is_loaded ? loaded->second : c.before;
    // They differ in something, which is what they hold unless it is what is known of the file.
    const bool is_kept_alike =
        before && c.after && before->file == c.after->file && before->disk == c.after->disk;
    if ((is_kept_alike && !is_loaded) || !is_alike(before, c.after))
      step.push_back({c.id, before, c.after});
  }
  const auto deed = std::make_shared<const Deed>(Deed{w.author, w.label});
  doc.note(deed, w.outside.empty() ? step : all);
  CommitKind kind = !step.empty()       ? CommitKind::edit
                    : w.outside.empty() ? CommitKind::save
                                        : CommitKind::load;
  if (gesture) {
    kind = CommitKind::preview;
    merge_changes(gesture->changes, std::move(step));
  } else if (!step.empty()) {
    doc.history.add(deed, w.series, std::move(step));
  }
  return doc.report(*now, w.label, w.author, kind, std::move(all));
}

Result<Commit> Transaction::Work::commit_to_branch(std::vector<RecordChange> all,
                                                   const Snapshot::Reads& reads,
                                                   const Progress* progress) {
  SnapshotPtr old;  // let go after the mutex
  const std::lock_guard lock(branch->mutex);
  RMP_TRY(branch->usable());
  if (const auto current = branch->now->state_; current != base) {
    RMP_TRY(rebase(current, reads));
    all = changes();
    RMP_TRY(judge(all, progress));
  }
  for (const AnyId id : touched)
    if (branch->is_touched.insert(id).second) branch->touched.push_back(id);
  for (const auto& [id, record] : outside) branch->outside[id] = record;
  branch->reads.join(reads);
  state().revision = document->next_draft_revision++;
  auto shown = std::make_shared<Snapshot>();
  shown->state_ = now.state_;
  old = std::exchange(branch->now, std::move(shown));
  ++branch->commits;
  Commit commit;
  commit.revision = branch->now->revision();
  commit.label = label;
  commit.author = author;
  for (const RecordChange& c : all) commit.changed.push_back(c.id);
  commit.affected = affected_order(*branch->now, commit.changed);
  commit.records = std::move(all);
  return commit;
}

bool Transaction::is_overtaken() const { return work_->is_overtaken; }

std::string_view to_string(CommitKind kind) {
  switch (kind) {
    case CommitKind::edit: return "edit";
    case CommitKind::load: return "load";
    case CommitKind::save: return "save";
    case CommitKind::undo: return "undo";
    case CommitKind::redo: return "redo";
    case CommitKind::preview: return "preview";
    case CommitKind::kept: return "kept";
    case CommitKind::cancelled: return "cancelled";
    case CommitKind::clear: return "clear";
  }
  return "edit";
}

Document::Document(std::size_t history_bytes, AppLock* lock)
    : impl_(std::make_unique<Impl>(history_bytes, lock)) {}
Document::~Document() = default;

SnapshotPtr Document::now() const { return impl_->now(); }

Result<Transaction> Document::begin(std::string label, std::string series) {
  return begin(std::move(label), Author{}, std::move(series));
}

Result<Transaction> Document::begin(std::string label, Author author, std::string series) {
  return Transaction(*this, std::move(label), std::move(author), std::move(series), 0);
}

Result<std::uint64_t> Document::begin_gesture(std::string label, Author author) {
  const AppLock::Hold hold(*impl_->lock, "begin_gesture");
  RMP_TRY(require(Effect::edits));
  for (const Impl::Gesture& g : impl_->gestures)
    if (g.deed->author.session == author.session)
      return error(ErrorCode::conflict, "the gesture " + Impl::words(*g.deed) + " is already open",
                   "Commit or cancel it first.");
  const std::uint64_t number = impl_->next_gesture++;
  impl_->gestures.push_back(
      {number, std::make_shared<const Deed>(Deed{std::move(author), std::move(label)}), {}});
  return number;
}

namespace {

Error no_gesture(std::uint64_t number) {
  return error(ErrorCode::unknown_name, "there is no open gesture " + std::to_string(number),
               "Begin one.");
}

}  // namespace

Result<Transaction> Document::begin_update(std::uint64_t gesture) {
  const AppLock::Hold hold(*impl_->lock, "begin_update");
  const Impl::Gesture* g = impl_->find_gesture(gesture);
  if (!g) return no_gesture(gesture);
  return Transaction(*this, g->deed->label, g->deed->author, {}, gesture);
}

Result<Commit> Document::commit_gesture(std::uint64_t gesture) {
  const AppLock::Hold hold(*impl_->lock, "commit_gesture");
  RMP_TRY(require(Effect::edits));
  Impl::Gesture* g = impl_->find_gesture(gesture);
  if (!g) return no_gesture(gesture);
  const auto deed = g->deed;
  std::vector<RecordChange> step = std::move(g->changes);
  std::erase_if(step, [](const RecordChange& c) { return is_alike(c.before, c.after); });
  impl_->gestures.erase(impl_->gestures.begin() + (g - impl_->gestures.data()));
  if (!step.empty()) {
    impl_->note(deed, step);
    impl_->history.add(deed, {}, std::move(step));
  }
  return impl_->report(*now(), deed->label, deed->author, CommitKind::kept, {});
}

Result<Commit> Document::cancel_gesture(std::uint64_t gesture) {
  const AppLock::Hold hold(*impl_->lock, "cancel_gesture");
  Impl::Gesture* g = impl_->find_gesture(gesture);
  if (!g) return no_gesture(gesture);
  const auto deed = g->deed;
  std::vector<RecordChange> changes;
  for (const RecordChange& c : g->changes)
    if (!is_alike(c.before, c.after)) changes.push_back({c.id, c.after, c.before});
  auto state = impl_->put_back(*now(), g->changes, true);
  if (!state.ok()) return std::move(state).error().in("cancelling " + quote(deed->label));
  impl_->gestures.erase(impl_->gestures.begin() + (g - impl_->gestures.data()));
  if (changes.empty())
    return impl_->report(*now(), deed->label, deed->author, CommitKind::cancelled, {});
  const SnapshotPtr after = impl_->publish(std::move(*state));
  impl_->note(deed, changes);
  return impl_->report(*after, deed->label, deed->author, CommitKind::cancelled,
                       std::move(changes));
}

std::vector<std::pair<std::uint64_t, Author>> Document::gestures() const {
  const AppLock::Hold hold(*impl_->lock, "gestures");
  std::vector<std::pair<std::uint64_t, Author>> out;
  for (const Impl::Gesture& g : impl_->gestures) out.emplace_back(g.number, g.deed->author);
  return out;
}

Result<Commit> Document::undo(std::optional<std::uint64_t> session, std::uint64_t step) {
  return impl_->step(session, step, true);
}
Result<Commit> Document::redo(std::optional<std::uint64_t> session, std::uint64_t step) {
  return impl_->step(session, step, false);
}

std::vector<std::string> Document::undo_labels(std::optional<std::uint64_t> session) const {
  const AppLock::Hold hold(*impl_->lock, "undo_labels");
  std::vector<std::string> labels;
  const auto& steps = impl_->history.steps();
  for (auto it = steps.rbegin(); it != steps.rend(); ++it)
    if (!it->undone && (!session || it->deed->author.session == *session))
      labels.push_back(it->deed->label);
  return labels;
}

std::vector<std::string> Document::redo_labels(std::optional<std::uint64_t> session) const {
  const AppLock::Hold hold(*impl_->lock, "redo_labels");
  std::vector<const Step*> undone;
  for (const Step& s : impl_->history.steps())
    if (s.undone && (!session || s.deed->author.session == *session)) undone.push_back(&s);
  std::sort(undone.begin(), undone.end(),
            [](const Step* a, const Step* b) { return a->undone > b->undone; });
  std::vector<std::string> labels;
  for (const Step* s : undone) labels.push_back(s->deed->label);
  return labels;
}

std::vector<HistoryEntry> Document::history() const {
  const AppLock::Hold hold(*impl_->lock, "history");
  std::vector<HistoryEntry> out;
  for (const Step& s : impl_->history.steps()) {
    HistoryEntry e{s.number, s.deed->author, s.deed->label, s.undone != 0, {}};
    for (const RecordChange& c : s.changes) e.changed.push_back(c.id);
    out.push_back(std::move(e));
  }
  return out;
}

std::size_t Document::history_budget() const {
  const AppLock::Hold hold(*impl_->lock, "history_budget");
  return impl_->history.budget();
}
std::size_t Document::history_bytes() const {
  const AppLock::Hold hold(*impl_->lock, "history_bytes");
  return impl_->history.bytes();
}
std::uint64_t Document::forgotten_steps() const {
  const AppLock::Hold hold(*impl_->lock, "forgotten_steps");
  return impl_->history.forgotten();
}
Result<void> Document::set_history_budget(std::size_t bytes) {
  const AppLock::Hold hold(*impl_->lock, "set_history_budget");
  RMP_TRY(require(Effect::edits));
  impl_->history.set_budget(bytes);
  return {};
}

void Document::clear(Author author) {
  RMP_CHECK(require(Effect::edits).ok(), "the document was cleared without a permit");
  // What goes may be large; it is let go after the lock.
  std::deque<Step> steps;
  std::vector<Impl::Gesture> gestures;
  std::unordered_map<AnyId, std::shared_ptr<const Deed>> deeds;
  SnapshotPtr before;
  const AppLock::Hold hold(*impl_->lock, "clear");
  before = now();
  steps = impl_->history.clear();
  std::swap(gestures, impl_->gestures);
  std::swap(deeds, impl_->last_deed);
  ++impl_->epoch;
  std::vector<RecordChange> gone;
  for (const AnyId id : before->list()) gone.push_back({id, before->share(id), nullptr});
  const SnapshotPtr after = impl_->publish(std::make_shared<Snapshot::State>());
  impl_->report(*after, "clear", std::move(author), CommitKind::clear, std::move(gone));
}

void Document::on_commit(std::function<void(const Commit&)> listener) {
  const AppLock::Hold hold(*impl_->lock, "on_commit");
  impl_->listeners.push_back(std::move(listener));
}

Draft::Draft(Document& document, std::string label, Author author)
    : branch_(std::make_shared<Branch>(document, std::move(label), std::move(author))) {}
Draft::Draft(Document& document, const Snapshot& base, std::string label, Author author)
    : Draft(document, std::move(label), std::move(author)) {
  const auto own = std::make_shared<Snapshot>(base);
  own->reads_.reset();
  branch_->base = branch_->now = own;
  branch_->is_beside = true;
}
Draft::~Draft() { (void)discard(); }

const std::string& Draft::label() const { return branch_->label; }
const Author& Draft::author() const { return branch_->author; }
SnapshotPtr Draft::base() const { return branch_->base; }

SnapshotPtr Draft::now() const {
  const std::lock_guard lock(branch_->mutex);
  return branch_->now;
}

std::size_t Draft::commits() const {
  const std::lock_guard lock(branch_->mutex);
  return branch_->commits;
}

bool Draft::is_open() const {
  const std::lock_guard lock(branch_->mutex);
  return branch_->phase != Branch::Phase::ended;
}

std::vector<RecordChange> Draft::changes() const {
  std::vector<AnyId> touched;
  SnapshotPtr after;
  {
    const std::lock_guard lock(branch_->mutex);
    touched = branch_->touched;
    after = branch_->now;
  }
  std::vector<RecordChange> all;
  for (const AnyId id : touched) {
    RecordChange c{id, branch_->base->share(id), after->share(id)};
    if (!is_same(c.before, c.after)) all.push_back(std::move(c));
  }
  return all;
}

Result<SnapshotPtr> Draft::preview() const {
  Branch& b = *branch_;
  Document::Impl& doc = *b.document.impl_;
  Transaction tx(b.document, b.label, b.author, {}, 0);
  Transaction::Work& w = *tx.work_;
  const auto reads = std::exchange(w.now.reads_, nullptr);
  SnapshotPtr draft, current;
  {
    const std::lock_guard lock(b.mutex);
    current = doc.now();
    draft = b.now;
    if (b.phase == Branch::Phase::ended || b.touched.empty()) return current;
    if (current->state_ == b.base->state_) return draft;
    const bool is_of_draft = b.preview.draft == draft;
    // Just now the document may have its edits already, which would be a conflict with themselves.
    if (b.phase == Branch::Phase::accepting) return is_of_draft ? b.preview.shown : draft;
    if (is_of_draft && b.preview.document == current) return b.preview.shown;
    if (b.epoch != doc.epoch) return cleared_meanwhile();
    w.base = b.base->state_;
    w.now.state_ = draft->state_;
    reads->join(b.reads);
    w.touched = b.touched;
  }
  {
    const AppLock::Hold hold(*doc.lock, "preview");  // a conflict names who changed a record
    RMP_TRY(w.rebase(current->state_, *reads));
  }
  RMP_TRY(w.judge(w.changes(), nullptr));
  w.state().revision = doc.next_draft_revision++;
  auto made = std::make_shared<Snapshot>();
  made->state_ = std::move(w.now.state_);
  SnapshotPtr shown = std::move(made);
  Branch::Preview old{current, draft, shown};  // let go after the mutex
  const std::lock_guard lock(b.mutex);
  std::swap(b.preview, old);
  return shown;
}

Result<Transaction> Draft::begin(std::string label) {
  SnapshotPtr now;
  {
    const std::lock_guard lock(branch_->mutex);
    RMP_TRY(branch_->usable());
    now = branch_->now;
  }
  Transaction tx(branch_->document, std::move(label), branch_->author, {}, 0);
  tx.work_->branch = branch_;
  tx.work_->epoch = branch_->epoch;
  tx.base_on(now);
  return tx;
}

Result<Commit> Draft::accept(const Progress* progress) {
  Branch& b = *branch_;
  if (b.is_beside)
    return error(ErrorCode::unsupported,
                 "the draft " + quote(b.label) + " is on records that were never the document's",
                 "Discard it.");
  Transaction tx(b.document, b.label, b.author, {}, 0);
  Transaction::Work& w = *tx.work_;
  {
    const std::lock_guard lock(b.mutex);
    RMP_TRY(b.usable());
    b.phase = Branch::Phase::accepting;  // nothing is added while it is published
    w.epoch = b.epoch;
    w.base = b.base->state_;
    w.now.state_ = b.now->state_;
    w.now.reads_->join(b.reads);
    w.touched = b.touched;
    w.is_touched = b.is_touched;
    w.outside = b.outside;
  }
  struct Accepting {
    Branch& branch;
    Branch::Phase then = Branch::Phase::open;
    ~Accepting() {
      const std::lock_guard lock(branch.mutex);
      branch.phase = then;
    }
  } accepting{b};
  auto commit = tx.commit(progress);
  if (commit.ok()) accepting.then = Branch::Phase::ended;
  return commit;
}

bool Draft::discard() {
  const std::lock_guard lock(branch_->mutex);
  if (branch_->phase != Branch::Phase::open) return false;
  branch_->phase = Branch::Phase::ended;
  return true;
}

std::string Document::content_digest() const { return document::content_digest(*now()); }

std::string content_digest(const Snapshot& snapshot) {
  const Snapshot* s = &snapshot;
  std::vector<std::pair<std::pair<Kind, std::string_view>, AnyId>> records;
  for (const AnyId id : s->list()) records.push_back({{id.kind, s->find(id)->name}, id});
  std::sort(records.begin(), records.end());
  Fingerprinter fp("document/1");
  for (const auto& [key, id] : records) {
    fp.add(key.second);
    feed(fp, s->find(id)->body, [s](Fingerprinter& f, AnyId target) {
      f.add(to_string(target.kind)).add(std::string_view(s->find(target)->name));
    });
    feed(fp, s->find(id)->solvers);
  }
  return fp.finish().hex();
}

}  // namespace robomosp::document
