// SPDX-License-Identifier: Apache-2.0
#include "kernel/plugin_run.h"

#include <algorithm>
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
  return at == processes_.end() ? nullptr : at->second.process;
}

PluginRun PluginRuns::present(const std::filesystem::path& file) const {
  const std::lock_guard lock(mutex_);
  const auto at = processes_.find(file);
  if (at == processes_.end()) return {};
  return {false, at->second.process->limits(), at->second.only};
}

bool PluginRuns::is_apart(const std::filesystem::path& file, std::string_view interface_id,
                          std::string_view provider) const {
  const std::lock_guard lock(mutex_);
  const auto at = processes_.find(file);
  if (at == processes_.end()) return false;
  const auto& only = at->second.only;
  const std::string whole = std::string(interface_id) + " " + std::string(provider);
  return only.empty() || std::find(only.begin(), only.end(), whole) != only.end();
}

void PluginRuns::set_process(const std::filesystem::path& file,
                             std::shared_ptr<ProviderProcess> process,
                             std::vector<std::string> only) {
  const std::lock_guard lock(mutex_);
  if (process) processes_[file] = {std::move(process), std::move(only)};
  else processes_.erase(file);
}

PluginRunScope::PluginRunScope(const PluginRun& wanted)
    : run(wanted), before_(std::exchange(t_scope, this)) {}
PluginRunScope::~PluginRunScope() { t_scope = before_; }
PluginRunScope* PluginRunScope::current() { return t_scope; }

}  // namespace robomosp
