// SPDX-License-Identifier: Apache-2.0
// robomosp-mqtt: a controller's joint states from an MQTT broker into recordings of a ROBOMOSP
// server, and what the world shows as topics (layer: plugin). docs/user/remote/bridges.md
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <mosquitto.h>

#include "../config.h"
#include "../log.h"
#include "../recorder.h"
#include "../row_queue.h"
#include "broker.h"
#include "payload.h"

namespace robomosp::bridges {
namespace {

using Clock = std::chrono::steady_clock;
volatile std::sig_atomic_t stop_asked = 0;

/// Messages of a topic that become rows.
struct Source {
  std::string topic;
  int qos = 0;
  std::optional<FieldMap> time;  ///< none = when they arrive
  std::vector<FieldMap> fields;
  RecordingWish recording;
};
/// Messages of a topic that set something in the world.
struct Setter {
  std::string topic;
  std::string world, robot, parameter;
  FieldMap field;
  std::optional<std::vector<double>> wanted;  ///< the latest, guarded by Bridge::mutex_
};
/// A topic that is told what the world shows.
struct Outlet {
  std::string topic, world, robot;  ///< no robot = changes of the document
  double period = 0.1;              ///< [s]
  bool retain = false;
  Clock::time_point due{};
};

struct Config {
  ServerWish server;
  BrokerWish broker;
  std::vector<Source> sources;
  std::vector<Setter> setters;
  std::vector<Outlet> outlets;
};

Source read_source(Table& t) {
  Source s;
  s.topic = t.text("topic");
  s.qos = static_cast<int>(t.number("qos", 0, 0, 2));
  s.recording = read_recording(t);
  if (t.has("time")) {
    Table time = t.table("time");
    s.time = read_field(time, "");
    if (s.time->count) time.fault("is a list; the time must be one number.", "count");
    const std::string unit = time.text("unit", "s");
    const double factor = unit == "s"    ? 1
                          : unit == "ms" ? 1e-3
                          : unit == "us" ? 1e-6
                          : unit == "ns" ? 1e-9
                                         : 0;
    if (factor == 0) time.fault("is not one of s, ms, us and ns.", "unit");
    s.time->scale[0] *= factor;
    s.time->offset[0] *= factor;
    time.done();
  }
  for (Table& c : t.tables("columns")) {
    const std::string name = c.text("column"), unit = c.text("unit", "");
    FieldMap field = read_field(c, "");
    if (!field.count) s.recording.columns.push_back({name, unit});
    for (std::size_t i = 0; i < field.count.value_or(0); ++i)
      s.recording.columns.push_back({name + std::to_string(i + 1), unit});
    s.fields.push_back(std::move(field));
    c.done();
  }
  if (s.recording.columns.empty()) t.fault("is missing: it maps fields to columns.", "columns");
  t.done();
  return s;
}

Config read(const char* file) {
  const Json json = read_config(file);
  Table t(json, "");
  Config out;
  out.server = read_server(t);
  out.broker = read_broker(t);
  for (Table& each : t.tables("recordings")) out.sources.push_back(read_source(each));
  for (Table& each : t.tables("set")) {
    Setter s;
    s.topic = each.text("topic");
    s.world = each.text("world");
    s.robot = each.text("robot", "");
    s.parameter = each.text("parameter", "");
    if (s.robot.empty() == s.parameter.empty())
      each.fault("needs one of robot (its joint values) and parameter (a number of the world).");
    s.field = read_field(each, s.robot.empty() ? "/value" : "/q");
    if (!s.robot.empty() && !s.field.count)
      each.fault("is missing: the number of joint values.", "count");
    if (s.robot.empty() && s.field.count)
      each.fault("is given, but a parameter is one number.", "count");
    each.done();
    out.setters.push_back(std::move(s));
  }
  for (Table& each : t.tables("publish")) {
    Outlet o;
    o.topic = each.text("topic");
    const bool changes = each.flag("changes", false);
    o.world = each.text("world", "");
    o.robot = each.text("robot", "");
    if (changes ? !(o.world.empty() && o.robot.empty()) : o.world.empty() || o.robot.empty())
      each.fault("needs either world and robot, or changes = true.");
    o.period = 1 / each.number("rate", 10, 0.001, 1000);
    o.retain = each.flag("retain", false);
    if (mosquitto_pub_topic_check(o.topic.c_str()) != MOSQ_ERR_SUCCESS)
      each.fault("is not a topic that can be published to.", "topic");
    each.done();
    out.outlets.push_back(std::move(o));
  }
  t.done();
  if (out.sources.empty() && out.setters.empty() && out.outlets.empty())
    throw ConfigFault("The configuration requests nothing: give recordings, publish or set.");
  return out;
}

class Bridge {
 public:
  Bridge(Config config, bool may_set)
      : config_(std::move(config)),
        may_set_(may_set),
        queue_(config_.server.queue),
        recorder_(config_.server, wishes(config_), log_, &stop_asked) {}

  void run() {
    if (!may_set_ && !config_.setters.empty())
      log_.say("Nothing is set: \"set\" of the configuration needs --allow-set.");
    Broker broker(
        config_.broker, subscriptions(),
        [this](std::string_view topic, std::string_view payload) { hear(topic, payload); }, log_);
    broker.start();
    const std::chrono::milliseconds wait(
        std::max(1L, std::lround(config_.server.batch_seconds * 1e3)));
    while (!stop_asked) {
      flush(wait);
      set();
      publish(broker);
      report(broker);
    }
    // What has come is handed on before the end, if it can be.
    for (int i = 0; i < 10 && queue_.size() > 0; ++i) flush(std::chrono::milliseconds(1));
    report(broker, true);
    const RowCounts& c = recorder_.counts();
    std::printf(
        "%llu rows recorded, %llu messages refused, %llu rows late, %llu dropped, %llu "
        "refused by ROBOMOSP, %zu left\n",
        static_cast<unsigned long long>(c.recorded),
        static_cast<unsigned long long>(refused_.load()), static_cast<unsigned long long>(c.late),
        static_cast<unsigned long long>(queue_.dropped()),
        static_cast<unsigned long long>(c.refused), queue_.size());
  }

 private:
  static std::vector<RecordingWish> wishes(const Config& config) {
    std::vector<RecordingWish> out;
    for (const Source& s : config.sources) out.push_back(s.recording);
    return out;
  }
  [[nodiscard]] std::vector<Broker::Subscription> subscriptions() const {
    std::vector<Broker::Subscription> out;
    for (const Source& s : config_.sources) out.push_back({s.topic, s.qos});
    if (may_set_)
      for (const Setter& s : config_.setters) out.push_back({s.topic, 0});
    return out;
  }

  /// On the broker's thread.
  void hear(std::string_view topic, std::string_view payload) {
    const std::string name(topic);
    const auto matches = [&](const std::string& wanted) {
      bool is = false;
      return mosquitto_topic_matches_sub(wanted.c_str(), name.c_str(), &is) == MOSQ_ERR_SUCCESS &&
             is;
    };
    const auto heed = [&](auto&& use) {
      try {
        use();
      } catch (const PayloadFault& e) {
        ++refused_;
        log_.often("payload " + name,
                   "A message of \"" + name + "\" is not used: " + e.what() + ".");
      }
    };
    for (std::size_t i = 0; i < config_.sources.size(); ++i) {
      const Source& s = config_.sources[i];
      if (matches(s.topic)) heed([&] { queue_.push(row_of(s, i, payload)); });
    }
    if (!may_set_) return;
    for (Setter& s : config_.setters)
      if (matches(s.topic))
        heed([&] {
          std::vector<double> values = read_payload(payload, {&s.field});
          const std::lock_guard lock(mutex_);
          s.wanted = std::move(values);
        });
  }

  Row row_of(const Source& s, std::size_t number, std::string_view payload) const {
    std::vector<const FieldMap*> fields;
    if (s.time) fields.push_back(&*s.time);
    for (const FieldMap& f : s.fields) fields.push_back(&f);
    Row row{number, read_payload(payload, fields)};
    if (!s.time)
      row.values.insert(row.values.begin(),
                        std::chrono::duration<double>(Clock::now() - begin_).count());
    return row;
  }

  void flush(std::chrono::milliseconds wait) {
    std::vector<Row> rows = queue_.take(config_.server.batch_rows, wait);
    if (rows.empty()) {
      (void)recorder_.connected();
      return;
    }
    recorder_.append(rows);
    queue_.put_back(std::move(rows));
    const std::uint64_t dropped = queue_.dropped();
    if (dropped > told_dropped_) {
      log_.often("dropped", std::to_string(dropped) +
                                " rows were dropped so far, the oldest first: " +
                                std::to_string(config_.server.queue) + " can wait at most.");
      told_dropped_ = dropped;
    }
  }

  void set() {
    for (Setter& s : config_.setters) {
      std::optional<std::vector<double>> wanted;
      {
        const std::lock_guard lock(mutex_);
        std::swap(wanted, s.wanted);
      }
      if (!wanted) continue;
      rmpc_client* c = recorder_.connected();
      if (!c) {
        log_.often("set", "\"" + s.topic + "\" set nothing: ROBOMOSP is not connected.");
        continue;
      }
      rmpc_begin(c, s.robot.empty() ? "world.set_parameter" : "world.set_robot_q");
      rmpc_put_text(c, "id", s.world.c_str());
      if (s.robot.empty()) {
        rmpc_put_text(c, "name", s.parameter.c_str());
        rmpc_put_number(c, "value", wanted->front());
      } else {
        rmpc_put_text(c, "robot", s.robot.c_str());
        rmpc_put_numbers(c, "q", wanted->data(), wanted->size());
      }
      if (rmpc_send(c) != RMPC_OK) log_.often("set " + s.topic, rmpc_message(c));
    }
  }

  void publish(Broker& broker) {
    if (!broker.is_connected()) return;
    const auto now = Clock::now();
    for (Outlet& o : config_.outlets) {
      rmpc_client* c = recorder_.connected();
      if (!c) return;
      if (o.robot.empty()) {
        publish_changes(broker, o, c);
        continue;
      }
      if (now < o.due) continue;
      o.due = now +
              std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(o.period));
      rmpc_begin(c, "world.robots");
      rmpc_put_text(c, "id", o.world.c_str());
      if (rmpc_send(c) != RMPC_OK) {
        log_.often("publish " + o.topic, rmpc_message(c));
        continue;
      }
      bool found = false;
      for (std::size_t i = 0; i < rmpc_count(c, "") && !found; ++i) {
        const std::string at = "[" + std::to_string(i) + "]";
        const char* name = nullptr;
        if (rmpc_get_text(c, (at + ".name").c_str(), &name) != RMPC_OK || o.robot != name) continue;
        found = true;
        std::vector<double> q(rmpc_count(c, (at + ".q").c_str()));
        std::size_t count = 0;
        if (rmpc_get_numbers(c, (at + ".q").c_str(), q.data(), q.size(), &count) != RMPC_OK)
          continue;
        (void)broker.publish(o.topic, Json{{"robot", o.robot}, {"q", q}}.dump(), o.retain);
      }
      if (!found)
        log_.often("publish " + o.topic,
                   "World \"" + o.world + "\" has no robot \"" + o.robot + "\" to publish.");
    }
  }

  void publish_changes(Broker& broker, const Outlet& o, rmpc_client* c) {
    if (subscribed_ != recorder_.connections()) {
      long long subscription = 0;
      if (rmpc_subscribe(c, "change", &subscription) != RMPC_OK) {
        log_.often("changes", rmpc_message(c));
        return;
      }
      subscribed_ = recorder_.connections();
    }
    while (rmpc_poll_event(c, 0) == RMPC_OK) {
      const char* topic = "";
      if (std::string_view(rmpc_event_name(c)) != "event" ||
          rmpc_get_text(c, "topic", &topic) != RMPC_OK || std::string_view(topic) != "change")
        continue;
      long long revision = 0;
      const char* label = "";
      (void)rmpc_get_integer(c, "revision", &revision);
      (void)rmpc_get_text(c, "label", &label);
      (void)broker.publish(o.topic, Json{{"revision", revision}, {"label", label}}.dump(),
                           o.retain);
    }
  }
  void report(Broker& broker, bool is_last = false) {
    if (config_.broker.status_topic.empty()) return;
    const auto now = Clock::now();
    if (!is_last && now < next_report_) return;
    next_report_ = now + std::chrono::seconds(2);
    const RowCounts& c = recorder_.counts();
    (void)broker.publish(config_.broker.status_topic,
                         Json{{"online", !is_last},
                              {"recorded", c.recorded},
                              {"refused", refused_.load() + c.refused},
                              {"late", c.late},
                              {"dropped", queue_.dropped()},
                              {"waiting", queue_.size()}}
                             .dump(),
                         true);
  }

  Config config_;
  const bool may_set_;
  Log log_;
  RowQueue queue_;
  Recorder recorder_;
  std::mutex mutex_;
  const Clock::time_point begin_ = Clock::now();
  std::atomic<std::uint64_t> refused_{0};
  std::uint64_t told_dropped_ = 0, subscribed_ = 0;
  Clock::time_point next_report_{};
};

int usage() {
  std::fputs(
      "usage: robomosp-mqtt [--check] [--allow-set] CONFIGURATION.json\n\n"
      "Joint states of an MQTT broker into recordings of `robomosp serve`; see\n"
      "docs/user/remote/bridges.md.\n\n"
      "  --check      only reads the configuration\n"
      "  --allow-set  messages may set joints and parameters, as \"set\" of the configuration "
      "says\n",
      stderr);
  return 2;
}

int run(int argc, char** argv) {
  bool check = false, may_set = false;
  const char* file = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--check") check = true;
    else if (word == "--allow-set") may_set = true;
    else if (word.starts_with("-") || file) return usage();
    else file = argv[i];
  }
  if (!file) return usage();
  try {
    Config config = read(file);
    if (check) {
      std::printf("%zu recordings, %zu to set, %zu published\n", config.sources.size(),
                  config.setters.size(), config.outlets.size());
      return 0;
    }
    struct sigaction on_stop {};
    on_stop.sa_handler = [](int) { stop_asked = 1; };
    sigaction(SIGINT, &on_stop, nullptr);
    sigaction(SIGTERM, &on_stop, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    Bridge(std::move(config), may_set).run();
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "robomosp-mqtt: %s\n", e.what());
    return 1;
  }
}

}  // namespace
}  // namespace robomosp::bridges

int main(int argc, char** argv) { return robomosp::bridges::run(argc, argv); }
