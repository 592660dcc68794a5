// SPDX-License-Identifier: Apache-2.0
// Solvers in Lua that came with records, run in a separate environment: they may compute and read
// the document, and access nothing else (layer: application, lua, internal).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ioci/core/kept_solvers.h"
#include "kernel/permit.h"
#include "lua/program_state.h"

namespace robomosp::lua {

/// Provides the solvers requested by the application's KeptSolvers, from this state. [the state's
/// thread] except follow().
class KeptScripts final : public ioci::KeptSolvers::Host {
 public:
  explicit KeptScripts(ProgramState& impl) : impl_(impl) { impl_.app.kept_solvers->enter(this); }
  ~KeptScripts() override { impl_.app.kept_solvers->leave(this); }

  Result<void> try_out(const model::KeptSolver& solver) override;
  void follow() override;
  [[nodiscard]] bool is_here() const override { return impl_.calls->is_owner(); }

  /// Does the work that follow() could not do on another thread; cheap if there is none.
  void catch_up();
  /// Makes the next catch_up() retry solvers with a name that was taken.
  void look_again() { seen_ = 0; }

  /// The permit for scripts that came with records.
  [[nodiscard]] static Permit permit(const ProgramState& impl);

 private:
  /// Runs the text; leaves what it provides on the stack.
  Result<void> run(lua_State* L, const model::KeptSolver& solver);
  Result<void> provide(const ioci::KeptSolvers::Wanted& wanted);
  void put_back(const std::string& interface_id, const std::string& name);

  /// A provider of the session, suspended while a record keeps the same text.
  struct Aside {
    std::string interface_id, name;
    ProviderSource source;
    int ref = 0;
  };
  ProgramState& impl_;
  std::uint64_t seen_ = 0;
  bool is_busy_ = false;
  std::vector<Aside> aside_;
};

}  // namespace robomosp::lua
