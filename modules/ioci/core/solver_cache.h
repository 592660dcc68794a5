// SPDX-License-Identifier: Apache-2.0
// SolverCache: solvers that are bound to a robot model, kept between commands so that a script's
// loop does not prepare one a call (layer: application). [any thread]
#pragma once

#include <cstdint>
#include <iterator>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

#include "kernel/registry.h"
#include "sim/simulate.h"

namespace robomosp::ioci {

class SolverCache {
 public:
  Result<sim::Bound<IkSolver>> ik(const Registry& r, std::shared_ptr<const RobotModel> m,
                                  const model::ProviderChoice& c) {
    return find(ik_, r, std::move(m), c, sim::bind_ik);
  }
  Result<sim::Bound<InverseDynamics>> inverse_dynamics(const Registry& r,
                                                       std::shared_ptr<const RobotModel> m,
                                                       const model::ProviderChoice& c) {
    return find(inverse_, r, std::move(m), c, sim::bind_inverse_dynamics);
  }
  Result<sim::Bound<ForwardDynamics>> forward_dynamics(const Registry& r,
                                                       std::shared_ptr<const RobotModel> m,
                                                       const model::ProviderChoice& c) {
    return find(forward_, r, std::move(m), c, sim::bind_forward_dynamics);
  }

 private:
  static constexpr std::size_t kKept = 8;
  template <class S>
  struct Entry {
    model::ProviderChoice choice;
    std::uint64_t revision;  ///< of the registry: a changed default or provider binds anew
    sim::Bound<S> bound;     ///< keeps the model alive, so that its address is a key
  };
  template <class S, class Bind>
  Result<sim::Bound<S>> find(std::list<Entry<S>>& all, const Registry& registry,
                             std::shared_ptr<const RobotModel> model,
                             const model::ProviderChoice& choice, Bind bind) {
    const std::uint64_t revision = registry.revision();
    {
      const std::lock_guard lock(mutex_);
      for (auto it = all.begin(); it != all.end(); ++it)
        if (it->bound.model == model && it->revision == revision && it->choice == choice) {
          all.splice(all.begin(), all, it);
          return it->bound;
        }
    }
    RMP_TRY_ASSIGN(auto bound, bind(registry, std::move(model), choice));  // a provider's code
    std::list<Entry<S>> dropped;  // ended without the mutex
    const std::lock_guard lock(mutex_);
    all.push_front({choice, revision, bound});
    if (all.size() > kKept) dropped.splice(dropped.begin(), all, std::prev(all.end()));
    return bound;
  }
  std::mutex mutex_;
  // Guarded by mutex_:
  std::list<Entry<IkSolver>> ik_;
  std::list<Entry<InverseDynamics>> inverse_;
  std::list<Entry<ForwardDynamics>> forward_;
};

}  // namespace robomosp::ioci
