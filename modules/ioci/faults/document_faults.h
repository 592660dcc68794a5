// SPDX-License-Identifier: Apache-2.0
// What is wrong in the document and in its runs now (layer: application, ioci only).
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/fault.h"

namespace robomosp::ioci {

/// Clears what the document does not have: a record that is gone with its path, and the end of a
/// path that the record does not have.
void keep_what_opens(FaultSubject&, const document::Snapshot&);

/// Collects faults of records and recordings, with remedies that were tried.
class DocumentFaults {
 public:
  /// `tries`: remedies are tried, and those that do not help are dropped.
  DocumentFaults(CommandContext& ctx, std::size_t most, bool tries)
      : ctx_(ctx), most_(most), tries_(tries) {}
  /// Errors: cancelled.
  Result<void> look_at(AnyId record);
  /// `all_notes`: also what the run noted without a fault.
  Result<void> look_at_recording(std::uint64_t number, bool all_notes);
  [[nodiscard]] bool is_full() const { return faults_.size() >= most_; }
  /// The result of fault.list, of so many records and recordings.
  Map answer(std::size_t all);

 private:
  void add(Fault, const Handle&);
  void add(const Error&, AnyId);
  void look_at_providers(AnyId, const model::Record&);
  void look_at_parameters(AnyId, const ProviderInfo&, const model::ProviderChoice&,
                          const char* field);
  Result<void> look_at_solid(AnyId);
  Result<void> look_at_program(AnyId);
  Result<void> look_at_runs_of(AnyId world);
  void try_remedies(Fault&);
  /// Whether the remedy helps; nullopt = it was not tried, and has the reason.
  std::optional<bool> outcome_of(const Fault&, FaultRemedy&);

  CommandContext& ctx_;
  const std::size_t most_;
  const bool tries_;
  std::vector<Fault> faults_;
  std::set<std::uint64_t> recordings_;  ///< looked at
  std::size_t looked_at_ = 0;
  std::size_t tried_ = 0;
  std::chrono::steady_clock::duration trying_{};  ///< time that trials took
};

}  // namespace robomosp::ioci
