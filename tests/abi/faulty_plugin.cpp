// SPDX-License-Identifier: Apache-2.0
// Solvers with one fault each, around shipped ones: what the suites of the SDK have to find.
#include <dlfcn.h>

#include <atomic>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/post.h>

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

/// A post that changes what another one writes.
class Retold : public Post {
 public:
  [[nodiscard]] const PostCapabilities& capabilities() const override {
    return inner_->capabilities();
  }
  Result<void> write(const PostTask& task, const Params& params, PostOutput& output,
                     Progress& progress) const override {
    Sink sink(*this, output);
    return inner_->write(task, params, sink, progress);
  }

 protected:
  virtual std::string retold(std::string text) const = 0;

 private:
  struct Sink final : PostOutput {
    Sink(const Retold& by, PostOutput& to) : by_(by), to_(to) {}
    void file(std::string_view name, std::string_view bytes) override {
      to_.file(name, by_.retold(std::string(bytes)));
    }
    void from(std::string_view, std::uint32_t, const rmp_span&) override {}
    void fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
               std::string_view hint) override {
      to_.fault(severity, span, message, hint);
    }
    const Retold& by_;
    PostOutput& to_;
  };
  std::unique_ptr<Post> inner_ = shipped<Post>("post_krl.so", "krl");
};
/// Loses what is done to outputs.
class Loser final : public Retold {
  std::string retold(std::string text) const override {
    for (std::size_t at; (at = text.find("$OUT[")) != std::string::npos;) {
      const std::size_t begin = text.rfind('\n', at) + 1;
      text.erase(begin, text.find('\n', at) + 1 - begin);
    }
    return text;
  }
};
/// Numbers what it writes.
class Restless final : public Retold {
  std::string retold(std::string text) const override {
    return text + "; " + std::to_string(++count_) + "\r\n";
  }
  static inline std::atomic<int> count_ = 0;  // of all instances
};

}  // namespace

RMP_PLUGIN("org.example.faulty", "0.1.0", "Apache-2.0", "Solvers with one fault each",
           RMP_PROVIDER_NO_PARAMS(Forgetful, "forgetful", "Leaves a solution out.",
                                  "serial,closed_form,all_solutions"),
           RMP_PROVIDER_NO_PARAMS(Unwilling, "unwilling", "Solves nothing.", "serial"),
           RMP_PROVIDER_NO_PARAMS(Inverse, "inverse", "Is right.", "serial,tree"),
           RMP_PROVIDER_NO_PARAMS(Allocates, "allocates", "Allocates.", "serial,tree"),
           RMP_PROVIDER_NO_PARAMS(Timid, "timid", "Everything touches.", "approximate"),
           RMP_PROVIDER_NO_PARAMS(Loser, "loser", "Loses outputs.", ""),
           RMP_PROVIDER_NO_PARAMS(Restless, "restless", "Numbers what it writes.", ""))
