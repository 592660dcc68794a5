// SPDX-License-Identifier: Apache-2.0
// Solvers with one fault each, around shipped ones: what the suites of the SDK have to find.
#include <dlfcn.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

namespace {

using namespace robomosp;

/// A provider of a shipped plugin, by the entry that the host uses.
template <class I>
std::unique_ptr<I> shipped(const char* file, const char* name) {
  void* library = dlopen((std::string(ROBOMOSP_PLUGIN_DIR "/") + file).c_str(), RTLD_NOW);
  void* symbol = library ? dlsym(library, "rmp_plugin_entry_v1") : nullptr;
  if (!symbol) return nullptr;
  rmp_plugin_entry_fn entry = nullptr;
  std::memcpy(&entry, &symbol, sizeof entry);
  const rmp_plugin* plugin = entry();
  static const rmp_host host{sizeof(rmp_host), "test", nullptr, nullptr, nullptr, nullptr, nullptr};
  for (std::uint32_t i = 0; i < plugin->provider_count; ++i) {
    const rmp_provider& p = rmp_provider_at(*plugin, i);
    char why[256];
    if (std::string(p.interface_id) == I::kInterfaceId && std::string(p.name) == name)
      return std::unique_ptr<I>(static_cast<I*>(p.create(&host, why, sizeof why)));
  }
  return nullptr;
}

/// Leaves one solution out.
class Forgetful final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    joints_ = model.coordinate_count();
    return inner_->prepare(model, params);
  }
  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    RMP_TRY(inner_->solve(batch, results, progress));
    for (IkResult& r : results)
      if (r.q.size() > joints_) r.q.resize(r.q.size() - joints_);
    return {};
  }

 private:
  std::unique_ptr<IkSolver> inner_ = shipped<IkSolver>("ik_spherical_wrist.so", "spherical_wrist");
  std::size_t joints_ = 0;
};

/// Solves nothing, and says so.
class Unwilling final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel&, const Params&) override {
    return error(ErrorCode::unsupported, "this solver solves no robot", "Choose another one.");
  }
  Result<void> solve(const IkBatch&, std::span<IkResult>, Progress&) const override {
    return error(ErrorCode::unsupported, "this solver solves nothing");
  }
};

/// Right, without forward dynamics.
class Inverse : public InverseDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    return inner_->prepare(model, params);
  }
  std::size_t scratch_size() const override { return inner_->scratch_size(); }
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    return inner_->torques(batch, tau, progress);
  }
  Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                       Progress& progress) const override {
    return inner_->inertia(batch, m, progress);
  }

 private:
  std::unique_ptr<InverseDynamics> inner_ =
      shipped<InverseDynamics>("dynamics_newton_euler.so", "newton_euler");
};

/// The same with memory of its own for every call, which nobody frees before the next one.
class Allocates final : public Inverse {
 public:
  Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                       Progress& progress) const override {
    std::vector<double> own(tau.size());
    RMP_TRY(Inverse::torques(batch, own, progress));
    std::copy(own.begin(), own.end(), tau.begin());
    return {};
  }
};

/// Everything always touches: never wrong for something that "may report less".
class Timid final : public CollisionEngine {
  class Scene final : public CollisionScene {
   public:
    explicit Scene(std::unique_ptr<CollisionScene> inner) : inner_(std::move(inner)) {}
    Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                           double interest, std::span<PairDistance> out,
                           Progress& progress) const override {
      RMP_TRY(inner_->distances(poses, pairs, interest, out, progress));
      for (PairDistance& d : out) d.distance = -1;
      return {};
    }
    Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                            std::span<std::uint8_t> out, Progress& progress) const override {
      RMP_TRY(inner_->collisions(poses, pairs, out, progress));
      for (std::uint8_t& touches : out) touches = 1;
      return {};
    }

   private:
    std::unique_ptr<CollisionScene> inner_;
  };

 public:
  Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                const Params& params,
                                                Progress& progress) const override {
    RMP_TRY_ASSIGN(auto inner, inner_->build(bodies, params, progress));
    return std::unique_ptr<CollisionScene>(std::make_unique<Scene>(std::move(inner)));
  }

 private:
  std::unique_ptr<CollisionEngine> inner_ = shipped<CollisionEngine>("collision_fcl.so", "fcl");
};

}  // namespace

RMP_PLUGIN("org.example.faulty", "0.1.0", "Apache-2.0", "Solvers with one fault each",
           RMP_PROVIDER_NO_PARAMS(Forgetful, "forgetful", "Leaves a solution out.",
                                  "serial,closed_form,all_solutions"),
           RMP_PROVIDER_NO_PARAMS(Unwilling, "unwilling", "Solves nothing.", "serial"),
           RMP_PROVIDER_NO_PARAMS(Inverse, "inverse", "Is right.", "serial,tree"),
           RMP_PROVIDER_NO_PARAMS(Allocates, "allocates", "Allocates.", "serial,tree"),
           RMP_PROVIDER_NO_PARAMS(Timid, "timid", "Everything touches.", "approximate"))
