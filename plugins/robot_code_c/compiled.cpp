// SPDX-License-Identifier: Apache-2.0
#include "compiled.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "emit.h"
#include "spatial/instruction_limit.h"
#include "spatial/instruction_set.h"

namespace robomosp::robot_code {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSymbol = "robot";
constexpr double kCompileSeconds = 300;
constexpr std::uint64_t kCompileMemory = std::uint64_t{8} << 30;

/// For this processor, or for one with no more than ROBOMOSP_SIMD allows.
std::vector<std::string> compiler_flags() {
  std::string architecture = "native";
#if defined(__x86_64__)
  const spatial::InstructionSet limit = spatial::instruction_set_limit();
  if (limit == spatial::InstructionSet::baseline) architecture = "x86-64";
  else if (limit == spatial::InstructionSet::avx2 &&
           spatial::widest_instruction_set() == spatial::InstructionSet::avx2)
    architecture = "x86-64-v3";
#endif
  return {"-std=c99",
          "-O3",
          "-march=" + architecture,
          "-ffp-contract=fast",
          "-fno-math-errno",
          "-fno-trapping-math",
          "-fPIC",
          "-shared"};
}

std::uint64_t hash_of(const std::string& s, std::uint64_t h) {
  for (const char c : s) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return h;
}

/// A compiled library runs on processors of one kind only.
std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  std::string line, all;
  while (std::getline(in, line) && !line.empty())
    if (line.starts_with("model name") || line.starts_with("flags")) all += line;
  return all;
}

Result<fs::path> cache_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path root = cache && *cache ? fs::path(cache)
                        : home && *home ? fs::path(home) / ".cache"
                                        : fs::temp_directory_path();
  const fs::path folder = root / "robomosp" / "code";
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!failed) fs::permissions(folder, fs::perms::owner_all, failed);
  if (failed)
    return error(ErrorCode::io,
                 "the folder \"" + folder.string() + "\" cannot be made: " + failed.message(),
                 "Compiled robots are cached there; set XDG_CACHE_HOME to a writable folder.");
  return folder;
}

/// The compiler is what the user's environment says, never what a file of a robot says: opening a
/// stranger's robot must not choose a program to run.
Result<std::string> find_compiler() {
  const char* chosen = std::getenv("ROBOMOSP_CC");
  const std::string wanted = chosen ? chosen : "";
  if (!wanted.empty() && wanted.front() == '/') return wanted;
  const char* path = std::getenv("PATH");
  const std::vector<std::string> names =
      wanted.empty() ? std::vector<std::string>{"cc", "gcc", "clang"} : std::vector{wanted};
  for (const std::string& name : names) {
    std::istringstream folders(path ? path : "/usr/bin:/bin");
    for (std::string folder; std::getline(folders, folder, ':');) {
      const fs::path program = fs::path(folder) / name;
      if (access(program.c_str(), X_OK) == 0) return program.string();
    }
  }
  return error(ErrorCode::not_found,
               wanted.empty()
                   ? "there is no C compiler (cc, gcc or clang) on the search path"
                   : "the C compiler \"" + wanted + "\" of ROBOMOSP_CC is not on the search path",
               "Install one (package gcc), or choose the provider newton_euler.");
}

Result<void> run_compiler(const rmp_host* host, const std::string& program, const fs::path& source,
                          const fs::path& library) {
  if (!host || !RMP_HAS(host, run) || !host->run)
    return error(ErrorCode::unsupported, "this host cannot run a compiler",
                 "Use the provider within robomosp.");
  std::vector<const char*> arguments;
  const std::vector<std::string> flags = compiler_flags();
  for (const std::string& f : flags) arguments.push_back(f.c_str());
  const std::string from = source.string(), to = library.string();
  for (const char* a : {"-o", to.c_str(), from.c_str(), "-lm"}) arguments.push_back(a);
  std::string complaints;
  rmp_program run{};
  run.struct_size = sizeof run;
  run.name = program.c_str();
  run.arguments = arguments.data();
  run.argument_count = static_cast<std::uint32_t>(arguments.size());
  run.seconds = kCompileSeconds;
  run.memory = kCompileMemory;
  run.most_output = 1 << 20;
  run.context = &complaints;
  run.output = [](void*, const char*, std::uint64_t) {};
  run.line = [](void* context, const char* text, std::uint64_t size) {
    auto& all = *static_cast<std::string*>(context);
    if (all.empty()) all.assign(text, size);
  };
  char fault[512] = "";
  if (host->run(&run, fault, sizeof fault) != 0)
    return error(ErrorCode::plugin_failed,
                 "the compiler \"" + program +
                     "\" failed: " + (complaints.empty() ? std::string(fault) : complaints),
                 "Check that it can compile C, set ROBOMOSP_CC to another compiler, or choose the "
                 "provider newton_euler.");
  return {};
}

template <class F>
bool take(void* library, const char* name, F& f) {
  f = reinterpret_cast<F>(dlsym(library, (std::string(kSymbol) + "_" + name).c_str()));
  return f != nullptr;
}

/// Some numbers within reach of every joint, the same each time.
std::vector<double> some_numbers(std::size_t n, int sample) {
  std::vector<double> v(n);
  for (std::size_t i = 0; i < n; ++i)
    v[i] = 0.2 + std::sin(1.7 * static_cast<double>(i + 1) + 2.3 * sample);
  return v;
}

Result<void> check_against(const Compiled& c, const RobotModel& m,
                           const std::vector<Function>& functions) {
  const auto differs = [](const std::vector<double>& a, const std::vector<double>& b) {
    double size = 1;
    for (const double x : b) size = std::max(size, std::fabs(x));
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!(std::fabs(a[i] - b[i]) <= 1e-9 * size) && std::isfinite(b[i])) return true;
    return false;
  };
  for (int sample = 0; sample < 3; ++sample) {
    const auto q = some_numbers(m.coordinate_count(), sample),
               qd = some_numbers(m.dof(), sample + 3), x = some_numbers(m.dof(), sample + 6);
    const std::span<const double> inputs[kArrays] = {q, qd, x, x};
    for (const Function& f : functions) {
      const auto expected = f.evaluate(inputs);
      std::vector<double> got(expected.size());
      if (f.name == "inverse_dynamics")
        c.inverse_dynamics(q.data(), qd.data(), x.data(), got.data());
      else if (f.name == "forward_dynamics")
        c.forward_dynamics(q.data(), qd.data(), x.data(), got.data());
      else if (f.name == "inertia") c.inertia(q.data(), got.data());
      else if (f.name == "jacobian") c.jacobian(q.data(), got.data());
      else c.forward_kinematics(q.data(), got.data());
      if (differs(got, expected))
        return error(ErrorCode::plugin_failed,
                     "the compiled " + f.name + " does not compute the expected values",
                     "Set ROBOMOSP_CC to another compiler, or choose the provider newton_euler.");
    }
  }
  return {};
}

}  // namespace

Result<std::vector<Function>> all_functions(const RobotModel& model,
                                            ForwardDynamicsPolicy forward) {
  RMP_TRY(check_model(model));
  std::vector<Function> out;
  out.push_back(forward_kinematics(model));
  out.push_back(jacobian(model));
  out.push_back(inverse_dynamics(model));
  out.push_back(inertia(model));
  if (model.loops.empty()) {
    auto accelerations = forward_dynamics(model);
    if (accelerations.ok()) out.push_back(std::move(*accelerations));
    else if (forward == ForwardDynamicsPolicy::needed) return std::move(accelerations).error();
  }
  for (const Function& f : out) RMP_TRY(check_size(f, model));
  return out;
}

Result<Compiled> compile(const RobotModel& model, ForwardDynamicsPolicy forward,
                         const rmp_host* host) {
  RMP_TRY_ASSIGN(const auto functions, all_functions(model, forward));
  RMP_TRY_ASSIGN(const std::string program, find_compiler());
  const auto files = write_files(model, kSymbol, functions);
  std::uint64_t key = hash_of(program + processor(), 0xcbf29ce484222325ULL);
  for (const std::string& f : compiler_flags()) key = hash_of(f, key);
  for (const CodeFile& f : files) key = hash_of(f.text, key);
  std::ostringstream digits;
  digits << std::hex << key;
  RMP_TRY_ASSIGN(const fs::path folder, cache_folder());
  const fs::path library = folder / (digits.str() + ".so");
  if (!fs::exists(library)) {
    // Others may compile the same robot now: work in a folder of our own, then rename.
    const fs::path work = folder / (digits.str() + "." + std::to_string(getpid()));
    std::error_code failed;
    fs::create_directories(work, failed);
    for (const CodeFile& f : files) {
      std::ofstream out(work / f.name, std::ios::binary);
      out << f.text;
      if (!out.flush()) failed = std::make_error_code(std::errc::io_error);
    }
    if (failed)
      return error(ErrorCode::io, "the folder \"" + work.string() + "\" cannot be written",
                   "Check its free space and permissions.");
    auto done =
        run_compiler(host, program, work / (std::string(kSymbol) + ".c"), work / "robot.so");
    if (done.ok()) fs::rename(work / "robot.so", library, failed);
    std::error_code ignored;
    fs::remove_all(work, ignored);
    if (!done.ok()) return std::move(done).error();
    if (failed)
      return error(ErrorCode::io,
                   "\"" + library.string() + "\" cannot be written: " + failed.message(),
                   "Check its free space and permissions.");
  }
  void* const opened = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
  Compiled c;
  const bool whole = opened && take(opened, "inverse_dynamics", c.inverse_dynamics) &&
                     take(opened, "inverse_dynamics_batch", c.inverse_dynamics_batch) &&
                     take(opened, "inertia", c.inertia) &&
                     take(opened, "inertia_batch", c.inertia_batch) &&
                     take(opened, "jacobian", c.jacobian) &&
                     take(opened, "forward_kinematics", c.forward_kinematics);
  if (!whole)
    return error(ErrorCode::plugin_failed, "\"" + library.string() + "\" cannot be loaded",
                 "Remove it and try again.");
  take(opened, "forward_dynamics", c.forward_dynamics);
  take(opened, "forward_dynamics_batch", c.forward_dynamics_batch);
  RMP_TRY(check_against(c, model, functions));
  return c;
}

}  // namespace robomosp::robot_code
