// SPDX-License-Identifier: Apache-2.0
// Plugins that are wrong in one way each; CASE_... selects which.
#include <cstdio>
#include <stdexcept>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

namespace {

class Idle : public robomosp::IkSolver {
 public:
  robomosp::Result<void> prepare(const robomosp::RobotModel&, const robomosp::Params&) override {
    return {};
  }
  robomosp::Result<void> solve(const robomosp::IkBatch&, std::span<robomosp::IkResult>,
                               robomosp::Progress&) const override {
    return {};
  }
};

[[maybe_unused]] void* make_idle(const rmp_host* host, char*, std::uint32_t) {
  host->log(1, "abi_good", "an idle solver was made");
  return static_cast<robomosp::IkSolver*>(new Idle);
}
[[maybe_unused]] void* make_nothing(const rmp_host*, char* error, std::uint32_t size) {
  std::snprintf(error, size, "%s", "no licence file was found");
  return nullptr;
}
[[maybe_unused]] void* make_nothing_silently(const rmp_host*, char*, std::uint32_t) {
  return nullptr;
}
[[maybe_unused]] void* make_throw(const rmp_host*, char*, std::uint32_t) {
  throw std::runtime_error("thrown by create");
}

constexpr const char* kIk = "robomosp.ik/1";
constexpr rmp_provider row(const char* interface_id, const char* name,
                           void* (*create)(const rmp_host*, char*, std::uint32_t) = make_idle) {
  return {interface_id, name, "a test provider", "serial,dof=6",
          nullptr,      0,    sizeof(rmp_param), create};
}

template <std::uint32_t N>
[[maybe_unused]] const rmp_plugin* plugin_of(const rmp_provider (&rows)[N]) {
  static const rmp_plugin plugin = {
      sizeof(rmp_plugin),  RMP_ABI_TAG, "org.robomosp.abi", "1.2.3", "Apache-2.0", "test", rows, N,
      sizeof(rmp_provider)};
  return &plugin;
}

}  // namespace

#define ENTRY(version) extern "C" RMP_EXPORT const rmp_plugin* rmp_plugin_entry_v##version(void)

#if defined(CASE_NO_ENTRY)
extern "C" RMP_EXPORT int unrelated(void) { return 1; }

#elif defined(CASE_FUTURE_ENTRY)
ENTRY(2) { return nullptr; }

#elif defined(CASE_WRONG_TAG)
ENTRY(1) {
  static const rmp_plugin plugin = {sizeof(rmp_plugin),
                                    "rmp1000;itanium;libstdc++;cxx11=0;debug",
                                    "org.robomosp.abi",
                                    "1",
                                    "MIT",
                                    "",
                                    nullptr,
                                    0,
                                    sizeof(rmp_provider)};
  return &plugin;
}
#elif defined(CASE_NO_TAG)
ENTRY(1) {
  static const rmp_plugin plugin = {
      sizeof(rmp_plugin),  nullptr, "org.robomosp.abi", "1", "MIT", "", nullptr, 0,
      sizeof(rmp_provider)};
  return &plugin;
}
#elif defined(CASE_SMALL_STRUCT)
ENTRY(1) {
  static const rmp_plugin plugin = {16,      RMP_ABI_TAG, "org.robomosp.abi",  "1", "MIT", "",
                                    nullptr, 0,           sizeof(rmp_provider)};
  return &plugin;
}
#elif defined(CASE_NULL_NAMES)
ENTRY(1) {
  static const rmp_provider rows[] = {row(kIk, nullptr), row(nullptr, "homeless"),
                                      row(kIk, "uncreatable", nullptr), row(kIk, "sound")};
  return plugin_of(rows);
}
#elif defined(CASE_UNKNOWN_INTERFACE)
ENTRY(1) {
  static const rmp_provider rows[] = {row("robomosp.ik/7", "later"),
                                      row("robomosp.teapot/1", "pot"), row(kIk, "sound")};
  return plugin_of(rows);
}
#elif defined(CASE_ENTRY_THROWS)
ENTRY(1) { throw std::runtime_error("thrown by the entry"); }

#elif defined(CASE_ENTRY_NULL)
ENTRY(1) { return nullptr; }

#elif defined(CASE_CREATE_FAILS)
ENTRY(1) {
  static const rmp_provider rows[] = {row(kIk, "thrower", make_throw),
                                      row(kIk, "unlicensed", make_nothing),
                                      row(kIk, "silent", make_nothing_silently)};
  return plugin_of(rows);
}
#elif defined(CASE_DUPLICATES)
ENTRY(1) {
  static const rmp_provider rows[] = {row(kIk, "twin"), row(kIk, "twin")};
  return plugin_of(rows);
}
#elif defined(CASE_BAD_TABLE)
ENTRY(1) {
  static const rmp_param params[] = {{"speed", "real", "m/s", "", "90 deg", nullptr, 1, 0}};
  static const rmp_provider rows[] = {
      {kIk, "misdefault", "", "", params, 1, sizeof(rmp_param), make_idle},
      {kIk, "tableless", "", "", nullptr, 3, sizeof(rmp_param), make_idle},
      {kIk, "cut_short", "", "", params, 1, 8, make_idle}};
  return plugin_of(rows);
}
#elif defined(CASE_UNDEFINED_SYMBOL)
namespace elsewhere {
int needed_function(int);
}
ENTRY(1) { return elsewhere::needed_function(1) ? nullptr : nullptr; }

#elif defined(CASE_MISSING_LIBRARY)
int absent_helper();
ENTRY(1) { return absent_helper() ? nullptr : nullptr; }

#elif defined(CASE_LOAD_CRASHES)
namespace {
struct Crash {
  Crash() { __builtin_trap(); }
} crash;
}  // namespace
ENTRY(1) { return nullptr; }

#elif defined(CASE_ENTRY_CRASHES)
ENTRY(1) {
  volatile int* nowhere = nullptr;
  return *nowhere ? nullptr : nullptr;
}

#elif defined(CASE_LOAD_HANGS)
#include <unistd.h>
namespace {
struct Hang {
  Hang() {
    for (;;) ::pause();
  }
} hang;
}  // namespace
ENTRY(1) { return nullptr; }

#elif defined(CASE_LOAD_EXITS)
#include <cstdlib>
namespace {
struct Exit {
  Exit() { std::exit(0); }
} leave;
}  // namespace
ENTRY(1) { return nullptr; }

#elif defined(CASE_LOAD_LEAVES)
#include <unistd.h>
namespace {
struct Leave {
  Leave() { ::_exit(0); }
} leave;
}  // namespace
ENTRY(1) { return nullptr; }

#elif defined(CASE_ASKS)
// Providers made with the host: they log, and ask others.
#include <robomosp/sdk/host.h>
namespace {
class Asking final : public robomosp::IkSolver {
 public:
  explicit Asking(const rmp_host* host) : host_(host) {}
  robomosp::Result<void> prepare(const robomosp::RobotModel& model,
                                 const robomosp::Params& params) override {
    host_.log(robomosp::Host::Severity::info, "abi_asks",
              "it sees " + std::to_string(host_.names<robomosp::IkSolver>().size()) + " solvers");
    RMP_TRY_ASSIGN(other_, host_.create<robomosp::IkSolver>("helper"));
    return other_->prepare(model, params);
  }
  robomosp::Result<void> solve(const robomosp::IkBatch& b, std::span<robomosp::IkResult> r,
                               robomosp::Progress& p) const override {
    return other_->solve(b, r, p);
  }

 private:
  robomosp::Host host_;
  std::unique_ptr<robomosp::IkSolver> other_;
};
/// Asks for itself, without end.
class Circular final : public robomosp::IkSolver {
 public:
  explicit Circular(const rmp_host* host)
      : host_(host), other_(robomosp::Host(host).create<robomosp::IkSolver>("circular")) {
    if (!other_.ok()) throw std::runtime_error(other_.error().sentence());
  }
  robomosp::Result<void> prepare(const robomosp::RobotModel&, const robomosp::Params&) override {
    return {};
  }
  robomosp::Result<void> solve(const robomosp::IkBatch&, std::span<robomosp::IkResult>,
                               robomosp::Progress&) const override {
    return {};
  }

 private:
  robomosp::Host host_;
  robomosp::Result<std::unique_ptr<robomosp::IkSolver> > other_;
};
class Misreads final : public robomosp::IkSolver {
 public:
  robomosp::Result<void> prepare(const robomosp::RobotModel&, const robomosp::Params&) override {
    const robomosp::Result<int> failed = robomosp::error(robomosp::ErrorCode::io, "no such file");
    return *failed > 0 ? robomosp::Result<void>() : robomosp::Result<void>();
  }
  robomosp::Result<void> solve(const robomosp::IkBatch&, std::span<robomosp::IkResult>,
                               robomosp::Progress&) const override {
    return {};
  }
};
}  // namespace
RMP_PLUGIN("org.example.asks", "1", "MIT", "Asks the host",
           RMP_PROVIDER_NO_PARAMS(Asking, "asking", "Asks another solver.", "serial"),
           RMP_PROVIDER_NO_PARAMS(Circular, "circular", "Asks itself.", "serial"),
           RMP_PROVIDER_NO_PARAMS(Misreads, "misreads", "Reads a failed result.", "serial"))

#elif defined(CASE_GOOD)
static const rmp_param kParams[] = {
    {"damping", "real", "1", "Damping factor.", "0.01", nullptr, 1e-6, 1}};
ENTRY(1) {
  static const rmp_provider rows[] = {
      {kIk, "abi_good", "does nothing", "serial, dof=6", kParams, 1, sizeof(rmp_param), make_idle}};
  return plugin_of(rows);
}
#endif
