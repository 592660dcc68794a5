// SPDX-License-Identifier: Apache-2.0
// robomosp-rtde: the joints of a Universal Robots controller into a recording of a ROBOMOSP server
// (layer: plugin). docs/user/remote/bridges.md
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "../config.h"
#include "../log.h"
#include "../recorder.h"
#include "../row_queue.h"
#include "controller.h"

namespace robomosp::bridges::rtde {
namespace {

volatile std::sig_atomic_t stop_asked = 0;

struct Config {
  ServerWish server;
  ControllerWish controller;
  RecordingWish recording;
};

/// What is recorded when the configuration does not say.
struct Default {
  const char *variable, *column, *unit;
};
constexpr Default kDefaults[] = {{"actual_q", "q", "rad"},
                                 {"actual_qd", "qd", "rad/s"},
                                 {"actual_current", "current", ""},
                                 {"target_q", "target_q", "rad"}};

Config read(const char* file) {
  const Json json = read_config(file);
  Table t(json, "");
  Config out;
  out.server = read_server(t);
  out.controller.variables = {"timestamp"};
  out.controller.entries = {1};
  const auto add = [&](const std::string& variable, const std::string& column,
                       const std::string& unit, std::size_t entries) {
    out.controller.variables.push_back(variable);
    out.controller.entries.push_back(entries);
    if (entries == 1) out.recording.columns.push_back({column, unit});
    for (std::size_t i = 0; i < entries && entries > 1; ++i)
      out.recording.columns.push_back({column + std::to_string(i + 1), unit});
  };
  Table recording = t.table("recording");
  out.recording = read_recording(recording);
  for (Table& c : recording.tables("columns")) {
    const std::string variable = c.text("variable");
    if (variable.find(',') != std::string::npos)
      c.fault("is not the name of a variable.", "variable");
    add(variable, c.text("column"), c.text("unit", ""),
        static_cast<std::size_t>(c.number("count", 6, 1, 6)));
    c.done();
  }
  recording.done();
  if (out.recording.columns.empty())
    for (const Default& d : kDefaults) add(d.variable, d.column, d.unit, 6);
  Table controller = t.table("controller");
  out.controller.host = controller.text("host");
  out.controller.port = static_cast<int>(controller.number("port", kPort, 1, 65535));
  out.controller.frequency = controller.number("frequency", 125, 1, 500);
  controller.done();
  t.done();
  return out;
}

void bridge(const Config& config) {
  Log log;
  RowQueue queue(config.server.queue);
  std::atomic<std::uint64_t> refused{0};
  Controller controller(
      config.controller,
      [&](std::vector<double> values) {
        if (std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
          queue.push({0, std::move(values)});
          return;
        }
        ++refused;
        log.often("finite", "A state of the controller contains a number that is not finite.");
      },
      log, &stop_asked);
  std::thread reader([&] { controller.run(); });
  Recorder recorder(config.server, {config.recording}, log, &stop_asked);
  const std::chrono::milliseconds wait(
      std::max(1L, std::lround(config.server.batch_seconds * 1e3)));
  std::uint64_t told = 0;
  const auto flush = [&](std::chrono::milliseconds at_most) {
    std::vector<Row> rows = queue.take(config.server.batch_rows, at_most);
    if (rows.empty()) {
      (void)recorder.connected();
      return;
    }
    recorder.append(rows);
    queue.put_back(std::move(rows));
    if (queue.dropped() > told) {
      told = queue.dropped();
      log.often("dropped", std::to_string(told) + " rows were dropped so far, the oldest first: " +
                               std::to_string(config.server.queue) + " can wait at most.");
    }
  };
  while (!stop_asked) flush(wait);
  reader.join();
  for (int i = 0; i < 10 && queue.size() > 0; ++i) flush(std::chrono::milliseconds(1));
  const RowCounts& c = recorder.counts();
  std::printf(
      "%llu rows recorded, %llu states refused, %llu rows late, %llu dropped, %llu refused by "
      "ROBOMOSP, %zu left\n",
      static_cast<unsigned long long>(c.recorded), static_cast<unsigned long long>(refused.load()),
      static_cast<unsigned long long>(c.late), static_cast<unsigned long long>(queue.dropped()),
      static_cast<unsigned long long>(c.refused), queue.size());
}

int usage() {
  std::fputs(
      "usage: robomosp-rtde [--check] CONFIGURATION.json\n\n"
      "The joints of a Universal Robots controller into a recording of `robomosp serve`; see\n"
      "docs/user/remote/bridges.md.\n\n"
      "  --check  only reads the configuration\n",
      stderr);
  return 2;
}

int run(int argc, char** argv) {
  bool check = false;
  const char* file = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--check") check = true;
    else if (word.starts_with("-") || file) return usage();
    else file = argv[i];
  }
  if (!file) return usage();
  try {
    const Config config = read(file);
    if (check) {
      std::printf("%zu variables, %zu columns\n", config.controller.variables.size(),
                  config.recording.columns.size());
      return 0;
    }
    struct sigaction on_stop {};
    on_stop.sa_handler = [](int) { stop_asked = 1; };
    sigaction(SIGINT, &on_stop, nullptr);
    sigaction(SIGTERM, &on_stop, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    bridge(config);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "robomosp-rtde: %s\n", e.what());
    return 1;
  }
}

}  // namespace
}  // namespace robomosp::bridges::rtde

int main(int argc, char** argv) { return robomosp::bridges::rtde::run(argc, argv); }
