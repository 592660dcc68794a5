// SPDX-License-Identifier: Apache-2.0
#include "ioci/client/window_program.h"

#include <utility>

#include "io/recovery_journal.h"
#include "ioci/core/kept_solvers.h"
#include "kernel/file_cache.h"

namespace robomosp::ioci {

Result<std::unique_ptr<Application>> start_window_program(WindowProgramOptions options) {
  ApplicationOptions wanted;
  wanted.plugin_path = std::move(options.plugin_path);
  wanted.library = std::move(options.library);
  wanted.kept_geometry = FileCache::user_folder();
  wanted.kept_geometry_limit = FileCache::user_limit();
  if (options.keeps_unsaved) wanted.recovery = io::recovery_folder();
  RMP_TRY_ASSIGN(std::unique_ptr<Application> app, Application::create(std::move(wanted)));
  if (options.on_message) {
    for (const Message& m : app->messages.recent()) options.on_message(m);
    (void)app->messages.subscribe(options.on_message);
  }
  if (options.trusts_scripts) app->kept_solvers->trust_all();
  return app;
}

}  // namespace robomosp::ioci
