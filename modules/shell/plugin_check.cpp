// SPDX-License-Identifier: Apache-2.0
#include "shell/plugin_check.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/compiler.h>
#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_primitive.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/io.h>
#include <robomosp/sdk/joint_segment.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/post.h>
#include <robomosp/sdk/retimer.h>
#include <robomosp/sdk/robot_code.h>
#include <robomosp/sdk/trajectory.h>

#include "kernel/plugin_loader.h"
#include "kernel/registry.h"
#include "kernel/text.h"
#include "shell/json.h"

namespace robomosp::shell {
namespace {

constexpr int kPatience = 60000;  // ms without a word from the child

template <class I>
bool try_create(const Registry& registry, const ProviderInfo& p, std::string& fault) {
  if (p.interface_id != I::kInterfaceId) return false;
  const auto made = registry.create<I>(p.name);
  if (!made.ok()) fault = made.error().sentence();
  return true;
}

/// Makes one instance of a provider; "" or what went wrong.
std::string create_fault(const Registry& registry, const ProviderInfo& p) {
  std::string fault;
  (void)(try_create<CsgEngine>(registry, p, fault) ||
         try_create<CsgPrimitive>(registry, p, fault) || try_create<IkSolver>(registry, p, fault) ||
         try_create<InverseDynamics>(registry, p, fault) ||
         try_create<ForwardDynamics>(registry, p, fault) ||
         try_create<SegmentMaker>(registry, p, fault) ||
         try_create<CurveMaker>(registry, p, fault) ||
         try_create<MotionLawMaker>(registry, p, fault) ||
         try_create<OrientationMaker>(registry, p, fault) ||
         try_create<JointSegmentMaker>(registry, p, fault) ||
         try_create<Retimer>(registry, p, fault) || try_create<Planner>(registry, p, fault) ||
         try_create<CollisionEngine>(registry, p, fault) ||
         try_create<PhysicsEngine>(registry, p, fault) ||
         try_create<Integrator>(registry, p, fault) || try_create<Controller>(registry, p, fault) ||
         try_create<RobotCodeGenerator>(registry, p, fault) ||
         try_create<Compiler>(registry, p, fault) ||
         try_create<PostProcessor>(registry, p, fault) ||
         try_create<Importer>(registry, p, fault) || try_create<Exporter>(registry, p, fault));
  return fault;
}

Map inspect(const std::string& file) {
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path(PluginLoader::search_path({}));
  const PluginReport& r = loader.load(file);
  List providers, remarks;
  for (const ProviderInfo& p : registry.list()) {
    Map one{{"interface", p.interface_id}, {"name", p.name}, {"summary", p.summary}};
    if (std::string fault = create_fault(registry, p); !fault.empty())
      one.set("fault", std::move(fault));
    providers.emplace_back(std::move(one));
  }
  for (const std::string& remark : r.remarks) remarks.emplace_back(remark);
  Map out{{"file", r.file.string()},
          {"loaded", r.loaded},
          {"id", r.id},
          {"version", r.version},
          {"license", r.license},
          {"summary", r.summary},
          {"providers", std::move(providers)},
          {"remarks", std::move(remarks)}};
  if (r.refusal) out.set("error", error_map(*r.refusal));
  return out;
}

std::string text_of(const Map& m, const char* key) {
  const Value* v = m.find(key);
  return v && v->as_string() ? *v->as_string() : std::string();
}

/// All that the child writes, or what stopped it.
std::string read_all(int fd) {
  std::string out;
  char chunk[4096];
  for (;;) {
    pollfd ready{fd, POLLIN, 0};
    const int n = ::poll(&ready, 1, kPatience);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return out;
    const ssize_t got = ::read(fd, chunk, sizeof chunk);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return out;
    out.append(chunk, static_cast<std::size_t>(got));
  }
}

PluginCheck broken(const std::string& file, std::string what) {
  const Error e =
      error(ErrorCode::plugin_refused, std::move(what),
            "Do not install it; report it to its author.", "plugin " + text::quote(file));
  return {3, e.sentence(), Map{{"file", file}, {"loaded", false}, {"error", error_map(e)}}};
}

PluginCheck summary(Map report) {
  PluginCheck out;
  const Value* fault = report.find("error");
  if (fault && fault->as_map()) {
    Error e;
    e.message = text_of(*fault->as_map(), "message");
    e.where = text_of(*fault->as_map(), "where");
    e.hint = text_of(*fault->as_map(), "hint");
    out.text = e.sentence();
    out.exit_code = 3;
  } else {
    out.text = text_of(report, "id") + " " + text_of(report, "version") + " (" +
               text_of(report, "license") + "): accepted";
    if (const Value* providers = report.find("providers"); providers && providers->as_list())
      for (const Value& p : *providers->as_list()) {
        const Map& m = *p.as_map();
        out.text += "\n  " + text_of(m, "interface") + " " + text_of(m, "name") + ": ";
        const std::string bad = text_of(m, "fault");
        out.text += bad.empty() ? text_of(m, "summary") : "cannot be made. " + bad;
        if (!bad.empty()) out.exit_code = 3;
      }
  }
  if (const Value* remarks = report.find("remarks"); remarks && remarks->as_list())
    for (const Value& r : *remarks->as_list())
      out.text += "\n  " + (r.as_string() ? *r.as_string() : std::string());
  out.report = std::move(report);
  return out;
}

}  // namespace

PluginCheck check_plugin(const std::string& file) {
  int ends[2];
  if (::pipe(ends) != 0)
    return broken(file, std::string("the check could not start: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0)
    return broken(file, std::string("the check could not start: ") + std::strerror(errno));
  if (child == 0) {
    ::close(ends[0]);
    const std::string text = to_json(inspect(file));
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t n = ::write(ends[1], text.data() + done, text.size() - done);
      if (n <= 0) break;
      done += static_cast<std::size_t>(n);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  const std::string text = read_all(ends[0]);
  ::close(ends[0]);
  int status = 0;
  if (::waitpid(child, &status, WNOHANG) == 0 && text.empty()) ::kill(child, SIGKILL);
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status))
    return broken(file, std::string("it ended the check with signal ") +
                            std::to_string(WTERMSIG(status)) + " (" +
                            ::strsignal(WTERMSIG(status)) + ")");
  auto report = from_json(text);
  if (!report.ok() || !report->as_map())
    return broken(file, "it ended the process that checked it");
  return summary(std::move(*report->as_map()));
}

}  // namespace robomosp::shell
