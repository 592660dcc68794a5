// SPDX-License-Identifier: Apache-2.0
#include "kernel/plugin_run.h"

#include <utility>

namespace robomosp {
namespace {

thread_local PluginRunScope* t_scope = nullptr;

}  // namespace

PluginRuns& PluginRuns::of_program() {
  static PluginRuns one;
  return one;
}

void PluginRuns::set_wishes(Wishes wishes) {
  const std::lock_guard lock(mutex_);
  wishes_ = std::move(wishes);
}

PluginRun PluginRuns::wished(const std::filesystem::path& file) const {
  if (t_scope) return t_scope->run;
  const std::lock_guard lock(mutex_);
  const auto at = wishes_.find(file);
  return at == wishes_.end() ? PluginRun{} : at->second;
}

std::shared_ptr<ProviderProcess> PluginRuns::process(const std::filesystem::path& file) const {
  const std::lock_guard lock(mutex_);
  const auto at = processes_.find(file);
  return at == processes_.end() ? nullptr : at->second;
}

void PluginRuns::set_process(const std::filesystem::path& file,
                             std::shared_ptr<ProviderProcess> process) {
  const std::lock_guard lock(mutex_);
  if (process) processes_[file] = std::move(process);
  else processes_.erase(file);
}

PluginRunScope::PluginRunScope(const PluginRun& wanted)
    : run(wanted), before_(std::exchange(t_scope, this)) {}
PluginRunScope::~PluginRunScope() { t_scope = before_; }
PluginRunScope* PluginRunScope::current() { return t_scope; }

}  // namespace robomosp
