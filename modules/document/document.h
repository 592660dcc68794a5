// SPDX-License-Identifier: Apache-2.0
// Document: immutable snapshots of all records, transactions, undo and redo (layer: application).
// An edit makes a new snapshot; undo publishes an old one; nothing is ever changed in place.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/ids.h"
#include "model/parametric.h"
#include "model/records.h"

namespace robomosp::document {

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
  friend class Transaction;
  struct State;
  std::shared_ptr<const State> state_;
};
using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// What a commit, undo or redo changed: `changed` directly, `affected` = changed and all that
/// depends on it, in dependency order (a record after what it refers to).
struct Commit {
  std::uint64_t revision = 0;
  std::string label;
  std::vector<AnyId> changed, affected;
};

class Document;

/// A group of edits that becomes one undo step, or nothing. Rolls back if destroyed uncommitted.
/// Only one at a time. [application thread]
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
  /// The records as they would be after commit.
  [[nodiscard]] const Snapshot& now() const;
  /// A name like `wanted` that its kind does not have yet: "bolt", "bolt_2", ...
  [[nodiscard]] std::string free_name(Kind, std::string_view wanted) const;

  /// Checks that references exist and are of the right kind, that names are unique and that there
  /// is no cycle (the message names its path), then publishes. A commit without changes leaves no
  /// undo step. On an error the document is as before.
  Result<Commit> commit();

 private:
  friend class Document;
  Transaction(Document&, std::string label, std::string gesture);
  struct Work;
  std::unique_ptr<Work> work_;
};

/// The records and their history. [application thread] unless marked.
class Document {
 public:
  explicit Document(std::size_t history_bytes = std::size_t{256} << 20);
  ~Document();
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  [[nodiscard]] SnapshotPtr now() const;  ///< [any thread]
  /// A transaction; commits with the same non-empty `gesture` in a row share one undo step.
  [[nodiscard]] Result<Transaction> begin(std::string label, std::string gesture = {});
  Result<Commit> undo();  ///< an error when there is nothing to undo
  Result<Commit> redo();
  [[nodiscard]] std::vector<std::string> undo_labels() const;  ///< next undo first
  [[nodiscard]] std::vector<std::string> redo_labels() const;  ///< next redo first
  /// Forgets all records and the history.
  void clear();
  /// Called after every commit, undo and redo.
  void on_commit(std::function<void(const Commit&)>);
  /// Fingerprint-like text of all records, independent of ids and revision; equal content, equal
  /// text.
  [[nodiscard]] std::string content_digest() const;

 private:
  friend class Transaction;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::document
