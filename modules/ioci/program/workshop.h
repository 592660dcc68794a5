// SPDX-License-Identifier: Apache-2.0
// What programs are compiled, checked and posted with, for a command (layer: application, ioci
// only).
#pragma once

#include <memory>
#include <utility>

#include "ioci/core/application.h"
#include "program_source/workshop.h"

namespace robomosp::ioci {

/// On the records that the command sees; valid while it runs.
[[nodiscard]] inline program_source::Workshop workshop_of(CommandContext& ctx) {
  Application& app = ctx.app;
  return {{app.registry, app.derived, ctx.snapshot(), &app.collision_models},
          app.document,
          [&app](std::shared_ptr<const RobotModel> model, const model::ProviderChoice& choice) {
            return app.solvers.ik(app.registry, std::move(model), choice);
          },
          ctx.progress};
}

}  // namespace robomosp::ioci
