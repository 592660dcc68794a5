// SPDX-License-Identifier: Apache-2.0
// Workshop: all that compiling, checking and posting programs of records uses (layer: application,
// program_source).
#pragma once

#include <functional>
#include <memory>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/document.h"
#include "evaluation/sources.h"
#include "sim/simulate.h"

namespace robomosp::program_source {

/// Refers to parts of the caller, which outlive it. [one thread]
struct Workshop {
  evaluation::Sources from;
  /// Gives numbers to records of worlds that are made for a run and never published.
  document::Document& document;
  /// Binds a solver to a model, or takes one that was bound before.
  std::function<Result<sim::Bound<IkSolver>>(std::shared_ptr<const RobotModel>,
                                             const model::ProviderChoice&)>
      bind_ik;
  Progress& progress;
  [[nodiscard]] const document::Snapshot& snapshot() const { return from.snapshot; }
  /// For runs on other records, which outlive it.
  [[nodiscard]] sim::Simulator simulator_on(const document::Snapshot& records) const {
    return {{from.registry, from.derived, records, from.collision_models}};
  }
};

}  // namespace robomosp::program_source
