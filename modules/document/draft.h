// SPDX-License-Identifier: Apache-2.0
// Drafts: edits beside the document, which nobody else sees until they are accepted as one step
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

/// The records of a document as they were when the draft was opened, and what was edited on them
/// since. Any number of drafts may be open, and any number of threads may edit one: its
/// transactions are to the draft what others are to the document. [any thread]
class Draft {
 public:
  /// The document outlives the draft and all transactions on it.
  Draft(Document& document, std::string label, Author author);
  ~Draft();
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  [[nodiscard]] const std::string& label() const;  ///< what its step is called
  [[nodiscard]] const Author& author() const;
  /// The document's records when it was opened.
  [[nodiscard]] SnapshotPtr base() const;
  /// The same with what was edited since. Drafts have separate revision numbers, from
  /// kFirstRevision on.
  [[nodiscard]] SnapshotPtr now() const;
  static constexpr std::uint64_t kFirstRevision = std::uint64_t{1} << 62;
  /// What accept() would change, each record once, in the order of the first edit.
  [[nodiscard]] std::vector<RecordChange> changes() const;
  [[nodiscard]] std::size_t commits() const;  ///< that changed something
  /// False once it was accepted or discarded.
  [[nodiscard]] bool is_open() const;

  /// A transaction whose commit changes the draft instead of the document, and that can be
  /// overtaken by other transactions on the draft. Refused when the draft is not open.
  Result<Transaction> begin(std::string label);
  /// Publishes what was edited as one step of the document, which ends the draft. Where the
  /// document has changed since the draft was opened, the edits are made again on what it is now,
  /// if all that the commands which edited the draft looked at is as it was; else it is an error
  /// that names what changed. On an error draft and document are as before.
  Result<Commit> accept(const Progress* progress = nullptr);
  /// Ends it; nothing of it is left. False when it has ended already, or is being accepted.
  bool discard();

 private:
  friend class Transaction;
  struct Branch;
  std::shared_ptr<Branch> branch_;
};

}  // namespace robomosp::document
