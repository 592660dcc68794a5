// SPDX-License-Identifier: Apache-2.0
// Document: immutable snapshots of all records, transactions, undo and redo (layer: application).
// An edit makes a new snapshot; undo publishes an old one; nothing is ever changed in place.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/app_lock.h"
#include "model/kind.h"
#include "model/parametric.h"
#include "model/records.h"

namespace robomosp::document {

class Draft;

using model::Record;
using RecordPtr = std::shared_ptr<const Record>;

/// All records at one moment. Immutable, shared; readable from any thread without locks.
class Snapshot {
 public:
  Snapshot();
  ~Snapshot();
  [[nodiscard]] std::uint64_t revision() const;
  [[nodiscard]] std::size_t size() const;         ///< number of records
  [[nodiscard]] const Record* find(AnyId) const;  ///< nullptr if it is not there
  [[nodiscard]] RecordPtr share(AnyId) const;
  [[nodiscard]] std::optional<AnyId> find(Kind, std::string_view name) const;
  [[nodiscard]] std::vector<AnyId> list(Kind) const;  ///< in order of creation
  [[nodiscard]] std::vector<AnyId> list() const;
  [[nodiscard]] std::vector<AnyId> referrers(AnyId) const;  ///< who refers to it, ascending
  /// Records with expressions that use parameters of worlds, loaded or not; ascending.
  [[nodiscard]] std::vector<AnyId> users_of_worlds() const;
  /// Parameters of the worlds that are there, for model::resolve(). The snapshot must outlive it.
  [[nodiscard]] model::WorldParameters world_parameters() const;
  /// The content, or nullptr if the id is stale or of another kind.
  template <Kind K>
  [[nodiscard]] const auto* get(Id<K> id) const {
    using Content = std::variant_alternative_t<static_cast<std::size_t>(K), model::Body>;
    const Record* r = find(AnyId(id));
    return r ? std::get_if<Content>(&r->body) : nullptr;
  }
  /// `robot "pa10"`; `robot #17 (deleted)` when stale.
  [[nodiscard]] std::string describe(AnyId) const;

 private:
  friend class Document;
  friend class Draft;
  friend class Transaction;
  struct State;
  struct Reads;
  std::shared_ptr<const State> state_;
  std::shared_ptr<Reads> reads_;  ///< of a transaction: what was looked at; null = nobody asks
};
using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// Who edits; session 0 is the program itself.
struct Author {
  std::uint64_t session = 0;
  std::string name;
};

/// One record before and after; null before = added, null after = removed.
struct RecordChange {
  AnyId id;
  RecordPtr before, after;
};

/// Joins what happened later into `into`, so that each record is there once, from before the first
/// change to after the last.
void merge_changes(std::vector<RecordChange>& into, std::vector<RecordChange> later);

enum class CommitKind : std::uint8_t {
  edit,  ///< a step, or part of one
  load,  ///< from the library only: no step
  save,  ///< records got files, or files their records: no step
  undo,
  redo,
  preview,    ///< an update of a gesture: no step yet
  kept,       ///< a gesture ended and became a step; what its previews showed stays
  cancelled,  ///< a gesture ended and what it did was put back
  clear
};
[[nodiscard]] std::string_view to_string(CommitKind);

/// What a commit, undo or redo changed: `changed` directly, `affected` = changed and all that
/// depends on it, in dependency order (a record after what it refers to).
struct Commit {
  std::uint64_t revision = 0;
  std::string label;
  std::vector<AnyId> changed, affected;
  Author author;
  CommitKind kind = CommitKind::edit;
  std::vector<RecordChange> records;  ///< of `changed`
};

/// A step of the history as it is listed.
struct HistoryEntry {
  std::uint64_t number = 0;  ///< never reused
  Author author;
  std::string label;
  bool undone = false;
  std::vector<AnyId> changed;
};

class Document;

/// A group of edits that becomes one undo step, or nothing. Rolls back if destroyed uncommitted.
/// Several may be open, each on the records as they were when it began. [one thread at a time]
class Transaction {
 public:
  Transaction(Transaction&&) noexcept;
  Transaction& operator=(Transaction&&) = delete;
  ~Transaction();

  /// Adds a record, its expressions evaluated; refuses an empty or malformed name (letters, digits,
  /// _ - . and spaces; must start with a letter) and a name its kind has already.
  Result<AnyId> add(Record);
  template <class R>
  Result<Id<model::kind_of<R>>> add(std::string name, R content, std::string file = {}) {
    auto id = add(Record{std::move(name), std::move(file), std::move(content)});
    if (!id.ok()) return std::move(id).error();
    return Id<model::kind_of<R>>{id->number};
  }
  /// Replaces the record by what `change` makes of a copy, its expressions evaluated. Records that
  /// use parameters of a world follow when these change or the world is renamed; removing a
  /// parameter that is used is refused.
  Result<void> edit(AnyId, const std::function<Result<void>(Record&)>& change);
  /// Removes; refused, naming them, while others refer to it or use its parameters.
  Result<void> remove(AnyId);
  /// Lets it work on an earlier snapshot of the document; before the first edit.
  void base_on(const SnapshotPtr& snapshot);
  /// The records as they would be after commit.
  [[nodiscard]] const Snapshot& now() const;
  /// The records as they were when it began.
  [[nodiscard]] Snapshot before() const;
  /// The records that were added, edited or removed, each once, in order of the first time.
  [[nodiscard]] const std::vector<AnyId>& touched() const;
  /// A name like `wanted` that its kind does not have yet: "bolt", "bolt_2", ...
  [[nodiscard]] std::string free_name(Kind, std::string_view wanted) const;

  /// Records added while this is on are no part of the step: undoing it leaves them. For what is
  /// loaded from the library. Returns what it was.
  bool set_outside_history(bool on);

  /// Checks that references exist and are of the right kind, that names are unique and that there
  /// is no cycle (the message names its path), then publishes under the application lock. A commit
  /// without changes leaves no undo step. Where the document has changed meanwhile, the edits are
  /// made again on what it is now, if all that this transaction looked at is as it was; else it is
  /// an error that says what changed. On an error the document is as before. `progress`, if any, is
  /// asked until it publishes whether to stop (ErrorCode::cancelled).
  Result<Commit> commit(const Progress* progress = nullptr);
  /// Whether commit() was refused because of what others changed meanwhile.
  [[nodiscard]] bool is_overtaken() const;

 private:
  friend class Document;
  friend class Draft;
  Transaction(Document&, std::string label, Author author, std::string series,
              std::uint64_t gesture);
  struct Work;
  std::unique_ptr<Work> work_;
};

/// The records and their history, guarded by the application lock, which all that changes or asks
/// the history takes for itself. What edits needs the permit of Effect::edits. [any thread]
///
/// Undo is per session: a step can be undone while the records that it changed are as it left
/// them, whatever else happened since; otherwise the refusal names who changed what.
///
/// A gesture (dragging, a slider) is any number of commits that everybody sees at once and that
/// become one step in the end, or nothing. While it is open no other session changes its records,
/// nor anything that would keep it from being cancelled.
class Document {
 public:
  /// `lock` outlives it; none = one of its own.
  explicit Document(std::size_t history_bytes = std::size_t{256} << 20, AppLock* lock = nullptr);
  ~Document();
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  [[nodiscard]] SnapshotPtr now() const;
  /// A transaction; commits of a session with the same non-empty `series` in a row share one step.
  [[nodiscard]] Result<Transaction> begin(std::string label, std::string series = {});
  [[nodiscard]] Result<Transaction> begin(std::string label, Author author,
                                          std::string series = {});

  /// Takes back the newest step of a session, or of anybody when none is given; or the step of that
  /// number. An error when there is none, or when a record is not as the step left it.
  Result<Commit> undo(std::optional<std::uint64_t> session = {}, std::uint64_t step = 0);
  Result<Commit> redo(std::optional<std::uint64_t> session = {}, std::uint64_t step = 0);
  [[nodiscard]] std::vector<std::string> undo_labels(
      std::optional<std::uint64_t> session = {}) const;  ///< next undo first
  [[nodiscard]] std::vector<std::string> redo_labels(
      std::optional<std::uint64_t> session = {}) const;     ///< next redo first
  [[nodiscard]] std::vector<HistoryEntry> history() const;  ///< oldest first
  [[nodiscard]] std::size_t history_budget() const;         ///< [bytes]
  [[nodiscard]] std::size_t history_bytes() const;          ///< kept by the history alone, about
  [[nodiscard]] std::uint64_t forgotten_steps() const;      ///< to stay within the budget
  Result<void> set_history_budget(std::size_t bytes);       ///< forgets the oldest steps beyond

  /// Opens a gesture of a session, which may have one at a time; returns its number.
  Result<std::uint64_t> begin_gesture(std::string label, Author author);
  /// A transaction whose commit is a preview of the gesture.
  [[nodiscard]] Result<Transaction> begin_update(std::uint64_t gesture);
  /// Makes one step of the gesture; no step when it changed nothing.
  Result<Commit> commit_gesture(std::uint64_t gesture);
  /// Puts back what it did; undo and redo are as before it.
  Result<Commit> cancel_gesture(std::uint64_t gesture);
  /// The gestures that are open: number and whose.
  [[nodiscard]] std::vector<std::pair<std::uint64_t, Author>> gestures() const;
  /// Forgets all records, the history and open gestures. Cannot be undone.
  void clear(Author author = {});
  /// Called after every commit, undo and redo, in their order and without the lock.
  void on_commit(std::function<void(const Commit&)>);
  /// Fingerprint-like text of all records, independent of ids and revision; equal content, equal
  /// text.
  [[nodiscard]] std::string content_digest() const;

 private:
  friend class Draft;
  friend class Transaction;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What Document::content_digest() is, of any snapshot.
[[nodiscard]] std::string content_digest(const Snapshot&);
/// `changed` and all that depends on it, each after what it refers to; what is gone comes first.
[[nodiscard]] std::vector<AnyId> affected_order(const Snapshot& s,
                                                const std::vector<AnyId>& changed);

}  // namespace robomosp::document
