// SPDX-License-Identifier: Apache-2.0
// A plugin that does to its process what q[0] of a batch says; 0 = it works.
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/files.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/module.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/render.h>

namespace {

using namespace robomosp;

/// What of the forbidden went well, by bits.
double misdeeds() {
  int done = 0;
  if (std::ifstream("/etc/passwd").good()) done |= 1;
  if (std::ifstream("/proc/1/cmdline").good()) done |= 2;
  if (const int fd = ::open("/tmp/robomosp-reckless", O_CREAT | O_WRONLY, 0600); fd >= 0) done |= 4;
  if (::socket(AF_INET, SOCK_STREAM, 0) >= 0) done |= 8;
  if (const pid_t pid = ::fork(); pid >= 0) {
    if (pid == 0) ::_exit(0);
    done |= 16;
    ::waitpid(pid, nullptr, 0);
  }
  if (::kill(::getppid(), 0) == 0) done |= 32;
  if (std::system("true") == 0) done |= 64;  // NOLINT
  return done;
}

/// Writes over all that it shares with the program.
void smash(std::uint64_t seed) {
  std::ifstream maps("/proc/self/maps");
  std::mt19937_64 random(seed);
  for (std::string line; std::getline(maps, line);) {
    if (line.find("memfd:robomosp-provider") == std::string::npos) continue;
    unsigned long from = 0, to = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx", &from, &to) != 2) continue;
    auto* bytes = reinterpret_cast<unsigned char*>(from);
    // All but whose turn it is, so that the answer is read.
    for (unsigned long i = 4096; i < to - from; ++i)
      bytes[i] = static_cast<unsigned char>(random());
  }
}

class Reckless final : public InverseDynamics {
 public:
  explicit Reckless(const rmp_host* host) : host_(host) {}
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    if (model.name == "crash in prepare") std::raise(SIGSEGV);
    gain_ = params.real("gain");
    dof_ = model.dof();
    return {};
  }
  std::size_t scratch_size() const override { return 7; }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau,
                       Progress& progress) const override {
    if (b.scratch.size() < 7 || tau.size() != b.count * dof_)
      return error(ErrorCode::internal, "the batch did not arrive");
    const int what = b.q.empty() ? 0 : static_cast<int>(b.q[0]);
    switch (what) {
      case 1: std::raise(SIGSEGV); break;
      case 2: std::abort();
      case 3: std::exit(7);
      case 4:
        for (volatile bool on = true; on;) {
        }
        break;
      case 5: throw std::runtime_error("thrown by hand");
      case 6: {
        std::vector<std::vector<char>> all;
        for (;;) all.emplace_back(std::size_t{1} << 26, 'x');
      }
      case 7:
        for (int i = 0; i < 100'000; ++i)
          std::fputs("endless words of no use, and more of them\n", stdout);
        std::fflush(stdout);
        break;
      case 8: return {};  // nothing filled
      case 9:
        while (!progress.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return error(ErrorCode::cancelled, "cancelled");
      case 10: ::kill(::getpid(), SIGKILL); break;
      case 11: std::fill(tau.begin(), tau.end(), misdeeds()); return {};
      case 12: progress.report(0.5, "half"); break;
      case 13: smash(static_cast<std::uint64_t>(b.q[1])); break;
      case 14: throw 42;
      case 15: std::fputs("assertion \"x > 0\" failed\n", stderr); std::abort();
      case 16: host_.log(Host::Severity::info, "reckless", "said by hand"); break;
      case 17: {
        auto other = host_.create<InverseDynamics>("newton_euler");
        if (!other.ok()) return other.error();
        std::fill(tau.begin(), tau.end(),
                  static_cast<double>(host_.names<InverseDynamics>().size()));
        return {};
      }
      case 18: return error(ErrorCode::unreachable, "it cannot be reached", "Come nearer.", "here");
      default: break;
    }
    for (std::size_t i = 0; i < tau.size(); ++i) tau[i] = gain_ * b.q[i];
    return {};
  }
  Result<void> inertia(const DynamicsBatch&, std::span<double> m, Progress&) const override {
    m[0] = static_cast<double>(::getpid());
    return {};
  }

 private:
  Host host_;
  double gain_ = 0;
  std::size_t dof_ = 0;
};

class Renders final : public render::Renderer {
 public:
  Result<render::Image> draw(const render::Scene&, const render::Options&,
                             Progress&) const override {
    return error(ErrorCode::unsupported, "none");
  }
  Result<std::string> png(const render::Image&) const override { return std::string(); }
};

class Brick final : public CsgPrimitive {
 public:
  Result<CsgTree> build(const Params& params, Progress&) const override {
    CsgTree tree;
    CsgNode& node = tree.nodes.emplace_back();
    node.name = "brick";
    node.sizes = {params.real("gain"), 2, 3};
    auto profile = std::make_shared<CsgProfile>();
    profile->loops.push_back({{1, 2}, {{CsgCurve::Kind::arc, {{3, 4}, {5, 6}}}}});
    node.profile = std::move(profile);
    return tree;
  }
};

class Reader final : public Importer {
 public:
  explicit Reader(const rmp_host* host) : host_(host) {}
  std::string_view extensions() const override { return "words"; }
  Result<Imported> read(std::string_view path, const Params&, Progress&) const override {
    const auto* files = static_cast<const rmp_files*>(host_.extension(RMP_FILES));
    Imported out;
    out.records.push_back({"a.sld", ""});
    char why[200] = "";
    const std::string name(path);
    if (files->read(
            name.c_str(), 1000, &out.records[0].text,
            [](void* to, const char* bytes, std::uint64_t size) {
              static_cast<std::string*>(to)->assign(bytes, size);
            },
            why, sizeof why) != 0)
      return error(ErrorCode::io, why);
    out.notes = {"read"};
    return out;
  }

 private:
  Host host_;
};

class Writer final : public Exporter {
 public:
  std::string_view extensions() const override { return "words, exact"; }
  bool is_exact(std::string_view extension) const override { return extension == "exact"; }
  Result<std::vector<ExportedFile>> write(const ExportTask& task, const Params&,
                                          Progress&) const override {
    std::string text(task.name);
    for (const ExportItem& i : task.items) {
      text += " " + i.name + std::to_string(i.mesh ? i.mesh->vertex_count() : 0);
      if (const auto part = robot_part(i)) text += " joint" + std::to_string(part->joint);
      if (const auto* p = primitive(i)) text += " size" + std::to_string(p->sizes[0]);
    }
    if (task.report) task.report->notes.emplace_back("written");
    return std::vector<ExportedFile>{{std::string(task.name), text}};
  }
};

class Adds final : public Module {
 public:
  static Result<ModuleValue> twice(const Module&, const ModuleValue& arguments, ModuleCall& call) {
    RMP_TRY_ASSIGN(ModuleValue out, call.run("ask.it", arguments));
    RMP_TRY_ASSIGN(const ModuleValue setting, call.setting("factor"));
    call.say(1, "for " + std::string(call.session()));
    out.set("value", arguments["value"].real() * setting.real());
    return out;
  }
  const ModuleTable& table() const override {
    static const rmp_param params[] = {
        {"value", "real", "m", "What.", "5 mm", nullptr, 1, -1, 0, nullptr, nullptr}};
    static const ModuleCommand commands[] = {
        {"reckless.twice", "Doubles.", "", "", "reads", "", params, "map", "", "", {}, &twice}};
    static const ModuleTable t = [] {
      ModuleTable made;
      made.commands = commands;
      made.command_count = 1;
      made.settings = params;
      made.runs = kModuleRunTask;
      return made;
    }();
    return t;
  }
  Result<void> before_run(const ModuleRunNotice& notice, ModuleCall&) const override {
    return error(ErrorCode::conflict,
                 "not " + std::string(notice.command) + " " + (*notice.arguments)["name"].text());
  }
};

const rmp_param kParams[] = {
    {"gain", "real", "", "By which q is multiplied.", "2", nullptr, 1, -1, 0, nullptr, nullptr}};

}  // namespace

#ifdef WITH_MODULE
#define RECKLESS_MODULE , RMP_PROVIDER_NO_PARAMS(Adds, "adds", "A module.", "")
#else
#define RECKLESS_MODULE
#endif
RMP_PLUGIN("test.reckless", "1.0", "Apache-2.0", "Does to its process what it is told.",
           RMP_PROVIDER(Reckless, "reckless", "Told by q[0].", "simple", kParams),
           RMP_PROVIDER_NO_PARAMS(Renders, "draws", "A renderer.", ""),
           RMP_PROVIDER(Brick, "brick", "A primitive.", "", kParams),
           RMP_PROVIDER_NO_PARAMS(Reader, "words", "Reads.", "confined"),
           RMP_PROVIDER_NO_PARAMS(Writer, "words", "Writes.", "") RECKLESS_MODULE)
