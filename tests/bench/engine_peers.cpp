// SPDX-License-Identifier: Apache-2.0
// The kernels of kinematics and dynamics, alone and in batches, beside KDL and DART on the same
// models and states: ns a sample, the least of many passes over a pool, taken in turns so that a
// busy machine slows all alike. Prints a table of Markdown.
//
// engine_peers [passes]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>

#include "bench/peers.h"
#include "robotics/batch_kinematics.h"
#include "robotics/kinematics.h"
#include "spatial/instruction_set.h"

namespace robomosp::bench {
namespace {

using namespace conformance;

constexpr std::size_t kPool = 512;
const std::string kPlugins = ROBOMOSP_PLUGIN_DIR;

struct Pool {
  explicit Pool(const RobotModel& m) : n(m.dof()) {
    Random random(1);
    for (std::size_t i = 0; i < kPool; ++i)
      for (const double x : random.configuration(m)) q.push_back(x);
    qd = random.vector(q.size(), -1, 1);
    u = random.vector(q.size(), -2, 2);
  }
  [[nodiscard]] State at(std::size_t i) const {
    return {{q.data() + i * n, n}, {qd.data() + i * n, n}, {u.data() + i * n, n}};
  }
  std::size_t n;
  std::vector<double> q, qd, u;
};

void fail(const std::string& sentence) {
  std::fprintf(stderr, "%s\n", sentence.c_str());
  std::exit(1);
}

template <class Interface>
std::unique_ptr<Interface> provider(const char* plugin, const char* name, const RobotModel& m,
                                    const char* set) {
  auto found = find_provider<Interface>(kPlugins + plugin, name);
  if (!found.ok()) fail(found.error().sentence());
  auto made = create<Interface>(**found);
  TableParams params(**found);
  params.set("instructions", set);
  if (const auto r = made->prepare(m, params); !r.ok()) fail(r.error().sentence());
  return made;
}

// Passes over the whole pool; `one` gives the last single result for comparison.
struct Own {
  std::map<std::string, Kernel> single;
  std::map<std::string, std::function<void()>> batch;
};

Own own(const RobotModel& m, const Pool& pool, const char* set) {
  struct Data {
    std::shared_ptr<InverseDynamics> inverse;
    std::shared_ptr<ForwardDynamics> forward, articulated;
    std::vector<double> scratch, one, all;
    std::vector<Pose> frames, poses;
    robotics::BatchKinematics kinematics;
    NoProgress none;
  };
  const auto d = std::make_shared<Data>();
  const std::size_t n = m.dof();
  d->inverse = provider<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, set);
  d->forward = provider<ForwardDynamics>("/dynamics_newton_euler.so", "inertia_matrix", m, set);
  d->articulated =
      provider<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, set);
  d->kinematics =
      robotics::BatchKinematics(m, std::string(set) == "avx2" ? spatial::InstructionSet::avx2
                                                              : spatial::widest_instruction_set());
  d->scratch.resize(std::max({d->inverse->scratch_size(), d->forward->scratch_size(),
                              d->articulated->scratch_size(), d->kinematics.scratch_size()}));
  d->one.resize(std::max<std::size_t>(12, n * std::max<std::size_t>(n, 6)));
  d->all.resize(kPool * n * std::max<std::size_t>(n, 6));
  d->frames.resize(n), d->poses.resize(kPool);
  const auto batch = [d](std::size_t count, const State& s) {
    DynamicsBatch b;
    b.count = count, b.q = s.q, b.qd = s.qd, b.scratch = d->scratch;
    return b;
  };
  const State whole{pool.q, pool.qd, pool.u};
  const auto dynamics = [&](const char* name, std::size_t width, auto compute) {
    const auto run = [=](std::size_t count, const State& s, std::vector<double>& out) {
      const auto r = compute(*d, batch(count, s), s, std::span(out).first(count * width));
      if (!r.ok()) fail(r.error().sentence());
    };
    return std::pair<Kernel, std::function<void()>>(
        [=](const State& s) {
          run(1, s, d->one);
          return std::span<const double>(d->one).first(width);
        },
        [=] { run(kPool, whole, d->all); });
  };
  Own o;
  const auto add = [&](const char* name, std::pair<Kernel, std::function<void()>> k) {
    o.single[name] = std::move(k.first), o.batch[name] = std::move(k.second);
  };
  add("inverse dynamics",
      dynamics("inverse dynamics", n, [](Data& x, DynamicsBatch b, const State& s, auto out) {
        b.qdd = s.u;
        return x.inverse->torques(b, out, x.none);
      }));
  add("inertia",
      dynamics("inertia", n * n, [](Data& x, const DynamicsBatch& b, const State&, auto out) {
        return x.inverse->inertia(b, out, x.none);
      }));
  add("forward dynamics",
      dynamics("forward dynamics", n, [](Data& x, DynamicsBatch b, const State& s, auto out) {
        b.tau = s.u;
        return x.forward->accelerations(b, out, x.none);
      }));
  add("articulated bodies",
      dynamics("articulated bodies", n, [](Data& x, DynamicsBatch b, const State& s, auto out) {
        b.tau = s.u;
        return x.articulated->accelerations(b, out, x.none);
      }));
  o.single["forward kinematics"] = [=, &m](const State& s) {
    robotics::forward_kinematics(m, s.q, d->frames);
    const Pose tip = robotics::tip_pose(m, 0, d->frames);
    std::copy(tip.R.begin(), tip.R.end(), d->one.begin());
    std::copy(tip.p.begin(), tip.p.end(), d->one.begin() + 9);
    return std::span<const double>(d->one).first(12);
  };
  o.single["Jacobian"] = [=, &m](const State& s) {
    robotics::forward_kinematics(m, s.q, d->frames);
    robotics::geometric_jacobian(m, 0, d->frames, robotics::JacobianFrame::base,
                                 std::span(d->one).first(6 * n));
    return std::span<const double>(d->one).first(6 * n);
  };
  o.batch["forward kinematics"] = [=] {
    d->kinematics.tip_poses(0, whole.q, d->poses, d->scratch);
  };
  o.batch["Jacobian"] = [=] {
    d->kinematics.jacobians(0, whole.q, robotics::JacobianFrame::base, d->poses,
                            std::span(d->all).first(kPool * 6 * n), d->scratch);
  };
  return o;
}

struct Row {
  std::string kernel;
  std::vector<std::pair<std::string, std::function<void()>>> columns;  // a pass over the pool each
  std::vector<double> best;
};

void measure(Row& row, int passes) {
  row.best.assign(row.columns.size(), std::numeric_limits<double>::infinity());
  for (int pass = 0; pass < passes; ++pass)
    for (std::size_t c = 0; c < row.columns.size(); ++c) {
      const auto start = std::chrono::steady_clock::now();
      row.columns[c].second();
      const std::chrono::duration<double, std::nano> took =
          std::chrono::steady_clock::now() - start;
      row.best[c] = std::min(row.best[c], took.count() / kPool);
    }
}

// Greatest difference of two kernels' results over some states, relative to the greatest number.
double difference(const Kernel& a, const Kernel& b, const Pool& pool, bool column_major) {
  double worst = 0;
  for (std::size_t i = 0; i < 16; ++i) {
    const auto x = a(pool.at(i)), y = b(pool.at(i));
    double size = 0, off = 0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      // Our Jacobians are column after column.
      const std::size_t at = column_major ? k % 6 * (x.size() / 6) + k / 6 : k;
      size = std::max(size, std::fabs(x[k]));
      off = std::max(off, std::fabs(x[k] - y[at]));
    }
    worst = std::max(worst, off / size);
  }
  return worst;
}

// Forward dynamics are compared with those of the peers whatever the method.
std::string peer_of(const std::string& kernel) {
  return kernel == "articulated bodies" ? "forward dynamics" : kernel;
}

void robot(const RobotModel& m, int passes) {
  const Pool pool(m);
  const bool wide = spatial::widest_instruction_set() == spatial::InstructionSet::avx512;
  const Own ours = own(m, pool, "auto"), narrow = own(m, pool, "avx2");
  std::map<std::string, Peer> peers;
#ifdef ROBOMOSP_BENCH_KDL
  peers["KDL"] = kdl(m);
#endif
#ifdef ROBOMOSP_BENCH_DART
  peers["DART"] = dart(m);
#endif
  const auto over_pool = [&](const Kernel& k) {
    return [&pool, k] {
      for (std::size_t i = 0; i < kPool; ++i) k(pool.at(i));
    };
  };
  const auto cell = [](double ns) { std::printf(" %.4g |", ns); };
  for (const char* kernel : {"forward kinematics", "Jacobian", "inverse dynamics", "inertia",
                             "forward dynamics", "articulated bodies"}) {
    Row row{kernel, {}, {}};
    row.columns.emplace_back("single", over_pool(ours.single.at(kernel)));
    row.columns.emplace_back("batch", ours.batch.at(kernel));
    if (wide) row.columns.emplace_back("AVX2", narrow.batch.at(kernel));
    for (const auto& [name, peer] : peers)
      row.columns.emplace_back(name, over_pool(peer.at(peer_of(kernel))));
    measure(row, passes);
    std::printf("| %s | %s |", m.name.c_str(), kernel);
    cell(row.best[0]), cell(row.best[1]);
    if (wide) cell(row.best[2]);
    else std::printf(" |");
    std::size_t c = wide ? 3 : 2;
    for (const char* name : {"DART", "KDL"}) {
      if (!peers.contains(name)) {
        std::printf(" | | | |");
        continue;
      }
      cell(row.best[c]);
      std::printf(" %.1f | %.0f | %.0e |", row.best[c] / row.best[0], row.best[c] / row.best[1],
                  difference(ours.single.at(kernel), peers[name].at(peer_of(kernel)), pool,
                             std::string(kernel) == "Jacobian"));
      ++c;
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace robomosp::bench

int main(int count, char** arguments) {
  using namespace robomosp;
  const int passes = count > 1 ? std::atoi(arguments[1]) : 50;
  std::printf(
      "| robot | kernel | single | batch | batch AVX2 | DART | / single | / batch | difference | "
      "KDL | / single | / batch | difference |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  RobotModel puma = conformance::puma560();
  for (JointModel& j : puma.joints) j.armature = 0, j.friction = {};
  for (const RobotModel& m :
       {puma, conformance::panda(), conformance::long_chain(30), conformance::long_chain(100)})
    bench::robot(m, m.dof() > 50 ? passes / 5 + 1 : passes);
}
