// SPDX-License-Identifier: Apache-2.0
// Drafts: edits separate from the document, invisible to other sessions until accepted as one step
// (layer: application).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::document {

/// The records of a document as they were when the draft was opened, and the edits made on them
/// since. Any number of drafts may be open, and any number of threads may edit one: its
/// transactions relate to the draft as others do to the document. [any thread]
class Draft {
 public:
  /// The document must outlive the draft and all transactions on it.
  Draft(Document& document, std::string label, Author author);
  /// A draft on other records than the document's, such as those of an open transaction. It can
  /// only be discarded.
  Draft(Document& document, const Snapshot& base, std::string label, Author author);
  ~Draft();
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  [[nodiscard]] const std::string& label() const;  ///< label of its step
  [[nodiscard]] const Author& author() const;
  /// The document's records when it was opened.
  [[nodiscard]] SnapshotPtr base() const;
  /// The same with the edits made since. Drafts have separate revision numbers, from kFirstRevision
  /// on.
  [[nodiscard]] SnapshotPtr now() const;
  static constexpr std::uint64_t kFirstRevision = std::uint64_t{1} << 62;
  /// The records as accept() would publish them now: the present document with the draft's edits.
  /// After the draft has ended, the present document. While nothing changes it returns the same
  /// snapshot. The errors are the conflicts of accept().
  [[nodiscard]] Result<SnapshotPtr> preview() const;
  /// What accept() would change, each record once, in the order of the first edit.
  [[nodiscard]] std::vector<RecordChange> changes() const;
  [[nodiscard]] std::size_t commits() const;  ///< commits with changes
  /// False after it was accepted or discarded.
  [[nodiscard]] bool is_open() const;

  /// A transaction that commits to the draft instead of the document, and can be overtaken by other
  /// transactions on the draft. Refused if the draft is not open.
  Result<Transaction> begin(std::string label);
  /// Publishes the edits as one step of the document, which ends the draft. If the document has
  /// changed since the draft was opened, the edits are repeated on its current state, provided that
  /// everything read by the draft's commands is unchanged; otherwise the error names the changes.
  /// On an error draft and document are unchanged.
  Result<Commit> accept(const Progress* progress = nullptr);
  /// Ends the draft and drops its edits. False if it has ended already or is being accepted.
  bool discard();

 private:
  friend class Transaction;
  struct Branch;
  std::shared_ptr<Branch> branch_;
};

}  // namespace robomosp::document
