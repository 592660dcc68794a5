// SPDX-License-Identifier: Apache-2.0
#include "document/document.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "document/digest.h"
#include "document/state.h"
#include "document/validate.h"
#include "kernel/check.h"
#include "kernel/text.h"

namespace robomosp::document {

namespace {

using text::quote;

/// What one undo step keeps alive besides the records it replaced: chunks and index nodes.
constexpr std::size_t kStepOverhead = 8192;
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

/// Parts of an object that are objects, tasks that a task calls.
std::vector<AnyId> nested_objects(const Snapshot& s, AnyId id) {
  std::vector<AnyId> inner;
  if (id.kind == Kind::task) {
    if (const auto* t = s.get(TaskId{id.number}))
      for (const auto& step : t->steps)
        if (step.task) inner.push_back(step.task);
    return inner;
  }
  if (const auto* o = s.get(ObjectId{id.number}))
    for (const auto& p : o->parts)
      if (p.what.kind == Kind::object && p.what) inner.push_back(p.what);
  return inner;
}

/// `cycle`: objects each of which has the next as a part, the last the first.
Error cycle_error(const Snapshot& s, std::vector<AnyId> cycle, const std::vector<AnyId>& changed) {
  const auto name = [&s](AnyId id) { return quote(s.find(id)->name); };
  const bool is_task = cycle.front().kind == Kind::task;
  if (cycle.size() == 1)
    return is_task
               ? error(ErrorCode::conflict, "task " + name(cycle[0]) + " cannot call itself",
                       "Use a repeat step.")
               : error(ErrorCode::conflict, "cannot place object " + name(cycle[0]) + " in itself");
  // Tell it from the object that was changed last: it is the one to which the part was given.
  for (auto it = changed.rbegin(); it != changed.rend(); ++it) {
    const auto at = std::find(cycle.begin(), cycle.end(), *it);
    if (at == cycle.end()) continue;
    std::rotate(cycle.begin(), at + 1, cycle.end());
    break;
  }
  std::string path;
  for (const AnyId id : cycle) path += (path.empty() ? "" : " > ") + s.find(id)->name;
  if (is_task)
    return error(ErrorCode::conflict,
                 "task " + name(cycle.back()) + " cannot call task " + name(cycle.front()) +
                     ", which calls it in turn (" + path + ")",
                 "Use a repeat step.");
  return error(ErrorCode::conflict, "cannot place object " + name(cycle.front()) + " in object " +
                                        name(cycle.back()) + ": " + name(cycle.back()) +
                                        " is already part of " + name(cycle.front()) + " (" + path +
                                        ")");
}

/// Of what refers to its own kind, objects and tasks must not form a cycle; a new one passes
/// through a record that was changed.
Result<void> refuse_cycles(const Snapshot& s, const std::vector<AnyId>& changed) {
  struct Step {
    AnyId id;
    std::vector<AnyId> inner;
    std::size_t next = 0;
  };
  std::unordered_set<AnyId> done, open;
  for (const AnyId start : changed) {
    if ((start.kind != Kind::object && start.kind != Kind::task) || done.contains(start) ||
        !s.find(start))
      continue;
    std::vector<Step> path;
    path.push_back({start, nested_objects(s, start)});
    open.insert(start);
    while (!path.empty()) {
      Step& top = path.back();
      if (top.next == top.inner.size()) {
        open.erase(top.id);
        done.insert(top.id);
        path.pop_back();
        continue;
      }
      const AnyId inner = top.inner[top.next++];
      if (open.contains(inner)) {
        std::vector<AnyId> cycle;
        for (auto it = path.rbegin(); it != path.rend(); ++it) {
          cycle.insert(cycle.begin(), it->id);
          if (it->id == inner) break;
        }
        return cycle_error(s, std::move(cycle), changed);
      }
      if (done.contains(inner)) continue;
      open.insert(inner);
      path.push_back({inner, nested_objects(s, inner)});
    }
  }
  return {};
}

/// References exist, and where a body is wanted there is one (the other fields have typed ids).
Result<void> check_references(const Snapshot& s, const Record& record) {
  std::optional<Error> fault;
  model::for_each_reference(record.body, [&](AnyId id, std::string_view field) {
    if (fault || s.find(id)) return;
    fault = error(ErrorCode::stale_handle,
                  quote(field) + " refers to " + std::string(to_string(id.kind)) + " #" +
                      std::to_string(id.number) + ", which does not exist");
  });
  const auto want_body = [&](AnyId id, std::string_view field) {
    if (fault || id.kind == Kind::solid || id.kind == Kind::object) return;
    fault = error(ErrorCode::invalid_argument, quote(field) + " refers to " + s.describe(id),
                  "A solid or an object can stand there.");
  };
  if (const auto* o = std::get_if<model::Object>(&record.body))
    for (const auto& p : o->parts) want_body(p.what, p.name);
  if (const auto* r = std::get_if<model::Robot>(&record.body)) {
    for (const auto& p : r->base_parts) want_body(p.what, "base");
    for (const auto& l : r->links)
      for (const auto& p : l.parts) want_body(p.what, l.name);
  }
  if (const auto* w = std::get_if<model::World>(&record.body))
    for (const auto& o : w->objects) want_body(o.what, o.name);
  if (!fault) return {};
  return std::move(*fault).in(std::string(to_string(record.kind())) + " " + quote(record.name));
}

/// `changed` and all that depends on it, each after what it refers to; what is gone comes first.
std::vector<AnyId> affected_order(const Snapshot& s, const std::vector<AnyId>& changed) {
  std::unordered_set<AnyId> all(changed.begin(), changed.end());
  std::vector<AnyId> work(changed.begin(), changed.end());
  while (!work.empty()) {
    const AnyId id = work.back();
    work.pop_back();
    for (const AnyId r : s.referrers(id))
      if (all.insert(r).second) work.push_back(r);
  }
  std::vector<AnyId> gone, objects;
  std::array<std::vector<AnyId>, std::size(kAllKinds)> by_kind;
  for (const AnyId id : all)
    (s.find(id) ? by_kind[static_cast<std::size_t>(id.kind)] : gone).push_back(id);
  std::sort(gone.begin(), gone.end());
  for (auto& ids : by_kind) std::sort(ids.begin(), ids.end());

  // Only objects refer to their own kind: post-order over their parts, with an explicit stack.
  std::unordered_set<AnyId> placed;
  for (const AnyId start : by_kind[static_cast<std::size_t>(Kind::object)]) {
    std::vector<std::pair<AnyId, bool>> stack{{start, false}};
    while (!stack.empty()) {
      const auto [id, is_ready] = stack.back();
      stack.pop_back();
      if (placed.contains(id)) continue;
      if (is_ready) {
        placed.insert(id);
        objects.push_back(id);
        continue;
      }
      stack.emplace_back(id, true);
      const auto inner = nested_objects(s, id);
      for (auto it = inner.rbegin(); it != inner.rend(); ++it)
        if (all.contains(*it) && !placed.contains(*it)) stack.emplace_back(*it, false);
    }
  }
  by_kind[static_cast<std::size_t>(Kind::object)] = std::move(objects);

  std::vector<AnyId> order = std::move(gone);
  // Worlds refer to all other kinds.
  std::rotate(by_kind.begin() + static_cast<std::ptrdiff_t>(Kind::world),
              by_kind.begin() + static_cast<std::ptrdiff_t>(Kind::task), by_kind.end());
  for (const auto& ids : by_kind) order.insert(order.end(), ids.begin(), ids.end());
  return order;
}

}  // namespace

struct Document::Impl {
  /// One undo step: the states before and after, shared with the snapshots of that time.
  struct Step {
    std::string label, gesture;
    std::shared_ptr<const Snapshot::State> before, after;
    std::vector<AnyId> changed;
    std::size_t bytes = 0;
  };

  std::atomic<SnapshotPtr> current{std::make_shared<const Snapshot>()};
  std::deque<Step> done, undone;  ///< the newest at the back
  std::vector<std::function<void(const Commit&)>> listeners;
  std::size_t history_bytes = 0, budget = 0;
  std::uint64_t next_id = 1, revision = 0;
  std::uint64_t epoch = 0;  ///< counts clear(), so that a transaction from before it cannot commit
  bool is_open = false;     ///< a transaction is

  SnapshotPtr publish(std::shared_ptr<Snapshot::State> state) {
    state->revision = ++revision;
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->state_ = std::move(state);
    SnapshotPtr shared = std::move(snapshot);
    current.store(shared);
    return shared;
  }

  void remember(Step step) {
    for (const Step& s : undone) history_bytes -= s.bytes;
    undone.clear();
    const bool same_gesture =
        !step.gesture.empty() && !done.empty() && done.back().gesture == step.gesture;
    if (same_gesture) {
      Step& top = done.back();
      top.after = std::move(step.after);
      top.label = std::move(step.label);
      for (const AnyId id : step.changed)
        if (std::find(top.changed.begin(), top.changed.end(), id) == top.changed.end()) {
          top.changed.push_back(id);
          top.bytes += step.bytes / step.changed.size();
          history_bytes += step.bytes / step.changed.size();
        }
    } else {
      history_bytes += step.bytes;
      done.push_back(std::move(step));
    }
    while (history_bytes > budget && done.size() > 1) {
      history_bytes -= done.front().bytes;
      done.pop_front();
    }
  }

  void tell(const Commit& commit) {
    const auto all = listeners;  // a listener may add listeners
    for (const auto& fn : all) fn(commit);
  }

  Result<Commit> step(std::deque<Step>& from, std::deque<Step>& to, bool is_undo) {
    const char* verb = is_undo ? "undo" : "redo";
    if (is_open)
      return error(ErrorCode::conflict,
                   std::string("cannot ") + verb + " while a transaction is open",
                   "Commit it or drop it first.");
    if (from.empty()) return error(ErrorCode::conflict, std::string("there is nothing to ") + verb);
    Step s = std::move(from.back());
    from.pop_back();
    s.gesture.clear();  // what follows an undo or redo is a step of its own
    if (!done.empty()) done.back().gesture.clear();
    const SnapshotPtr now =
        publish(std::make_shared<Snapshot::State>(*(is_undo ? s.before : s.after)));
    Commit commit{now->revision(), s.label, s.changed, affected_order(*now, s.changed)};
    to.push_back(std::move(s));
    tell(commit);
    return commit;
  }
};

struct Transaction::Work {
  Document::Impl* document = nullptr;
  std::string label, gesture;
  std::uint64_t epoch = 0;
  std::shared_ptr<const Snapshot::State> base;
  Snapshot now;
  std::vector<AnyId> touched;  ///< in order of first touch
  std::unordered_set<AnyId> is_touched;
  bool is_closed = false;

  ~Work() {
    if (!is_closed) document->is_open = false;
  }

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
  Result<void> put_resolved(AnyId id, std::shared_ptr<Record> record) {
    auto resolved = model::resolve(record->body, record->name, now.world_parameters());
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
    if (is_closed)
      return error(ErrorCode::conflict, "this transaction has ended", "Begin another one.");
    if (epoch != document->epoch)
      return error(ErrorCode::conflict, "the document was cleared while this transaction was open");
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
  auto resolved = model::resolve(record->body, record->name, none);
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
                     "Give that a plain number or another expression first.", where);
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

Transaction::Transaction(Document& document, std::string label, std::string gesture)
    : work_(std::make_unique<Work>()) {
  work_->document = document.impl_.get();
  work_->label = std::move(label);
  work_->gesture = std::move(gesture);
  work_->epoch = work_->document->epoch;
  work_->base = work_->document->current.load()->state_;
  work_->now.state_ = work_->base;
  work_->document->is_open = true;
}
Transaction::Transaction(Transaction&&) noexcept = default;
Transaction::~Transaction() = default;

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
  else RMP_TRY(work_->put_resolved(id, std::move(added)));
  return id;
}

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
                                : work_->put_resolved(id, std::move(record));
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
  std::string name(wanted);
  for (int i = 2; work_->now.find(kind, name); ++i)
    name = std::string(wanted) + "_" + std::to_string(i);
  return name;
}

Result<Commit> Transaction::commit() {
  Work& w = *work_;
  RMP_TRY(w.usable());
  Document::Impl& doc = *w.document;
  w.is_closed = true;
  doc.is_open = false;

  std::vector<AnyId> changed;
  std::size_t bytes = kStepOverhead;
  for (const AnyId id : w.touched) {
    const RecordPtr* before = w.base->find(id);
    const Record* after = w.now.find(id);
    if (!before && !after) continue;
    if (before && after && record_fingerprint(**before) == record_fingerprint(*after)) continue;
    if (before) bytes += record_bytes(**before);
    if (after) bytes += record_bytes(*after);
    changed.push_back(id);
  }
  if (changed.empty()) return Commit{doc.current.load()->revision(), w.label, {}, {}};
  for (const AnyId id : changed) {
    const Record* after = w.now.find(id);
    if (!after) continue;
    RMP_TRY(check_record(*after));
    RMP_TRY(check_references(w.now, *after));
  }
  RMP_TRY(refuse_cycles(w.now, changed));

  w.state();  // ours alone, so that publish() may number it
  auto state = std::const_pointer_cast<Snapshot::State>(std::move(w.now.state_));
  w.now.state_ = w.base;
  const SnapshotPtr now = doc.publish(std::move(state));
  w.now.state_ = now->state_;
  Commit commit{now->revision(), w.label, changed, affected_order(*now, changed)};
  doc.remember({w.label, w.gesture, w.base, now->state_, std::move(changed), bytes});
  doc.tell(commit);
  return commit;
}

Document::Document(std::size_t history_bytes) : impl_(std::make_unique<Impl>()) {
  impl_->budget = history_bytes;
}
Document::~Document() = default;

SnapshotPtr Document::now() const { return impl_->current.load(); }

Result<Transaction> Document::begin(std::string label, std::string gesture) {
  if (impl_->is_open)
    return error(ErrorCode::conflict, "another transaction is open", "Commit it or drop it first.");
  return Transaction(*this, std::move(label), std::move(gesture));
}

Result<Commit> Document::undo() { return impl_->step(impl_->done, impl_->undone, true); }
Result<Commit> Document::redo() { return impl_->step(impl_->undone, impl_->done, false); }

std::vector<std::string> Document::undo_labels() const {
  std::vector<std::string> labels;
  for (auto it = impl_->done.rbegin(); it != impl_->done.rend(); ++it) labels.push_back(it->label);
  return labels;
}
std::vector<std::string> Document::redo_labels() const {
  std::vector<std::string> labels;
  for (auto it = impl_->undone.rbegin(); it != impl_->undone.rend(); ++it)
    labels.push_back(it->label);
  return labels;
}

void Document::clear() {
  const SnapshotPtr before = now();
  impl_->done.clear();
  impl_->undone.clear();
  impl_->history_bytes = 0;
  ++impl_->epoch;
  impl_->publish(std::make_shared<Snapshot::State>());
  const auto gone = before->list();
  impl_->tell({impl_->revision, "clear", gone, gone});
}

void Document::on_commit(std::function<void(const Commit&)> listener) {
  impl_->listeners.push_back(std::move(listener));
}

std::string Document::content_digest() const {
  const SnapshotPtr s = now();
  std::vector<std::pair<std::pair<Kind, std::string_view>, AnyId>> records;
  for (const AnyId id : s->list()) records.push_back({{id.kind, s->find(id)->name}, id});
  std::sort(records.begin(), records.end());
  Fingerprinter fp("document/1");
  for (const auto& [key, id] : records) {
    fp.add(key.second);
    feed(fp, s->find(id)->body, [&s](Fingerprinter& f, AnyId target) {
      f.add(to_string(target.kind)).add(std::string_view(s->find(target)->name));
    });
  }
  return fp.finish().hex();
}

}  // namespace robomosp::document
