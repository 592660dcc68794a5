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
  [[nodiscard]] const Record* find(AnyId) const;  ///< nullptr if missing
  [[nodiscard]] RecordPtr share(AnyId) const;
  [[nodiscard]] std::optional<AnyId> find(Kind, std::string_view name) const;
  [[nodiscard]] std::vector<AnyId> list(Kind) const;  ///< in order of creation
  [[nodiscard]] std::vector<AnyId> list() const;
  [[nodiscard]] std::vector<AnyId> referrers(AnyId) const;  ///< records that refer to it, ascending
  /// Records with expressions that use parameters of worlds, loaded or not; ascending.
  [[nodiscard]] std::vector<AnyId> users_of_worlds() const;
  /// Parameters of the existing worlds, for model::resolve(). The snapshot must outlive it.
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
  std::shared_ptr<Reads> reads_;  ///< reads of a transaction; null = not recorded
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

/// Merges later changes into `into`: one entry per record, from before its first change to after
/// its last.
void merge_changes(std::vector<RecordChange>& into, std::vector<RecordChange> later);

enum class CommitKind : std::uint8_t {
  edit,  ///< a step, or part of one
  load,  ///< only loads from the library: no step
  save,  ///< changes only the links between records and files: no step
  undo,
  redo,
  preview,    ///< an update of a gesture: no step yet
  kept,       ///< a gesture became a step; the state of its previews remains
  cancelled,  ///< a gesture was undone by cancelling it
  clear
};
[[nodiscard]] std::string_view to_string(CommitKind);

/// Records changed by a commit, undo or redo: `changed` directly, `affected` = changed and all that
/// depend on them, in dependency order (a record after those it refers to).
struct Commit {
  std::uint64_t revision = 0;
  std::string label;
  std::vector<AnyId> changed, affected;
  Author author;
  CommitKind kind = CommitKind::edit;
  std::vector<RecordChange> records;  ///< of `changed`
};

/// An entry of the history.
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
  /// Replaces the record by the result of `change` on a copy, with its expressions evaluated.
  /// Records that use parameters of a world are updated when these change or the world is renamed;
  /// removing a parameter in use is refused.
  Result<void> edit(AnyId, const std::function<Result<void>(Record&)>& change);
  /// Removes a record; refused, with their names, while others refer to it or use its parameters.
  Result<void> remove(AnyId);
  /// Bases the transaction on an earlier snapshot of the document; before the first edit.
  void base_on(const SnapshotPtr& snapshot);
  /// The records as they would be after commit.
  [[nodiscard]] const Snapshot& now() const;
  /// The records as they were when it began.
  [[nodiscard]] Snapshot before() const;
  /// Records added, edited or removed, each once, in order of the first edit.
  [[nodiscard]] const std::vector<AnyId>& touched() const;
  /// A name like `wanted` that its kind does not have yet: "bolt", "bolt_2", ...
  [[nodiscard]] std::string free_name(Kind, std::string_view wanted) const;

  /// While set, added records are not part of the step: undoing it keeps them. For records loaded
  /// from the library. Returns the previous value.
  bool set_outside_history(bool on);

  /// Checks that references exist and have the right kind, that names are unique and that the graph
  /// has no cycle (the message gives its path), then publishes under the application lock. A commit
  /// without changes leaves no undo step. If the document has changed meanwhile, the edits are
  /// repeated on its current state, provided that everything this transaction read is unchanged;
  /// otherwise the error names the changes. On an error the document is unchanged. `progress`, if
  /// any, is polled for cancellation until publication (ErrorCode::cancelled).
  Result<Commit> commit(const Progress* progress = nullptr);
  /// True if commit() was refused because other sessions changed records it had read.
  [[nodiscard]] bool is_overtaken() const;

 private:
  friend class Document;
  friend class Draft;
  Transaction(Document&, std::string label, Author author, std::string series,
              std::uint64_t gesture);
  struct Work;
  std::unique_ptr<Work> work_;
};

/// The records and their history, guarded by the application lock, which every function that
/// changes or reads the history acquires itself. Edits need the permit of Effect::edits. [any
/// thread]
///
/// Undo is per session: a step can be undone while its records are as it left them, whatever
/// happened since to others; otherwise the refusal names who changed what.
///
/// A gesture (dragging, a slider) is any number of commits that all sessions see at once and that
/// finally become one step, or nothing. While it is open, no other session may change its records,
/// or make any change that would prevent cancelling it.
class Document {
 public:
  /// `lock` must outlive it; none = a separate one.
  explicit Document(std::size_t history_bytes = std::size_t{256} << 20, AppLock* lock = nullptr);
  ~Document();
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  [[nodiscard]] SnapshotPtr now() const;
  /// A transaction; consecutive commits of a session with the same non-empty `series` share one
  /// step.
  [[nodiscard]] Result<Transaction> begin(std::string label, std::string series = {});
  [[nodiscard]] Result<Transaction> begin(std::string label, Author author,
                                          std::string series = {});

  /// Undoes the newest step of a session, or of any session if none is given; or the step with that
  /// number. An error if there is none, or if a record is not as the step left it.
  Result<Commit> undo(std::optional<std::uint64_t> session = {}, std::uint64_t step = 0);
  Result<Commit> redo(std::optional<std::uint64_t> session = {}, std::uint64_t step = 0);
  [[nodiscard]] std::vector<std::string> undo_labels(
      std::optional<std::uint64_t> session = {}) const;  ///< next undo first
  [[nodiscard]] std::vector<std::string> redo_labels(
      std::optional<std::uint64_t> session = {}) const;     ///< next redo first
  [[nodiscard]] std::vector<HistoryEntry> history() const;  ///< oldest first
  [[nodiscard]] std::size_t history_budget() const;         ///< [bytes]
  [[nodiscard]] std::size_t history_bytes() const;          ///< held only by the history,
                                                            ///< approximate
  [[nodiscard]] std::uint64_t forgotten_steps() const;      ///< dropped to stay within the budget
  Result<void> set_history_budget(std::size_t bytes);       ///< drops the oldest steps beyond it

  /// Opens a gesture of a session, which may have one at a time; returns its number.
  Result<std::uint64_t> begin_gesture(std::string label, Author author);
  /// A transaction that commits as a preview of the gesture.
  [[nodiscard]] Result<Transaction> begin_update(std::uint64_t gesture);
  /// Makes the gesture one step; none if it changed nothing.
  Result<Commit> commit_gesture(std::uint64_t gesture);
  /// Reverts the gesture; undo and redo are as before it.
  Result<Commit> cancel_gesture(std::uint64_t gesture);
  /// The open gestures: number and author.
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

/// Document::content_digest() for any snapshot.
[[nodiscard]] std::string content_digest(const Snapshot&);
/// `changed` and all records that depend on them, each after those it refers to; removed ones
/// first.
[[nodiscard]] std::vector<AnyId> affected_order(const Snapshot& s,
                                                const std::vector<AnyId>& changed);

}  // namespace robomosp::document
