// SPDX-License-Identifier: Apache-2.0
#include "broker.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include <mosquitto.h>

namespace robomosp::bridges {
namespace {

constexpr int kFirstPause = 250, kLongestPause = 10000;  // [ms]

std::string reason(int code) {
  return code == MOSQ_ERR_ERRNO ? std::strerror(errno) : mosquitto_strerror(code);
}

}  // namespace

BrokerWish read_broker(Table& config) {
  BrokerWish out;
  if (config.has("broker")) {
    Table t = config.table("broker");
    out.host = t.text("host", out.host);
    out.port = static_cast<int>(t.number("port", t.has("ca_file") ? 8883 : 1883, 1, 65535));
    out.keepalive = static_cast<int>(t.number("keepalive", 30, 5, 3600));
    out.client_id = t.text("client_id", "");
    out.username = t.text("username", "");
    if (t.has("password_file"))
      out.password = read_secret(t.text("password_file"), t.path() + ".password_file");
    out.ca_file = t.text("ca_file", "");
    out.certificate_file = t.text("certificate_file", "");
    out.key_file = t.text("key_file", "");
    out.status_topic = t.text("status_topic", "");
    if (out.ca_file.empty() && !(out.certificate_file.empty() && out.key_file.empty()))
      t.fault("is missing, although TLS files are given.", "ca_file");
    if (out.certificate_file.empty() != out.key_file.empty())
      t.fault("is missing; certificate_file and key_file must be given together.",
              out.key_file.empty() ? "key_file" : "certificate_file");
    if (!out.password.empty() && out.username.empty())
      t.fault("is missing, although a password is given.", "username");
    t.done();
  }
  if (out.client_id.empty()) out.client_id = "robomosp-" + std::to_string(::getpid());
  return out;
}

Broker::Broker(BrokerWish wish, std::vector<Subscription> subscriptions, OnMessage on_message,
               Log& log)
    : wish_(std::move(wish)),
      subscriptions_(std::move(subscriptions)),
      on_message_(std::move(on_message)),
      log_(log) {
  mosquitto_lib_init();
  client_ = mosquitto_new(wish_.client_id.c_str(), true, this);
  if (!client_) throw ConfigFault("broker.client_id \"" + wish_.client_id + "\" cannot be used.");
  mosquitto_threaded_set(client_, true);
  mosquitto_connect_callback_set(client_, &Broker::connected);
  mosquitto_disconnect_callback_set(client_, &Broker::disconnected);
  mosquitto_message_callback_set(client_, &Broker::message);
  const auto check = [&](int code, const std::string& what) {
    if (code == MOSQ_ERR_SUCCESS) return;
    const std::string why = reason(code);
    mosquitto_destroy(client_);
    throw ConfigFault(what + " cannot be used: " + why + ".");
  };
  if (!wish_.username.empty())
    check(mosquitto_username_pw_set(client_, wish_.username.c_str(),
                                    wish_.password.empty() ? nullptr : wish_.password.c_str()),
          "broker.username");
  const auto file = [](const std::string& f) { return f.empty() ? nullptr : f.c_str(); };
  if (!wish_.ca_file.empty())
    check(mosquitto_tls_set(client_, wish_.ca_file.c_str(), nullptr, file(wish_.certificate_file),
                            file(wish_.key_file), nullptr),
          "broker.ca_file \"" + wish_.ca_file + "\" or the files beside it");
  if (!wish_.status_topic.empty()) {
    const std::string gone = "{\"online\":false}";
    check(mosquitto_will_set(client_, wish_.status_topic.c_str(), static_cast<int>(gone.size()),
                             gone.data(), 0, true),
          "broker.status_topic \"" + wish_.status_topic + "\"");
  }
  for (const Subscription& s : subscriptions_)
    check(mosquitto_sub_topic_check(s.topic.c_str()), "The topic \"" + s.topic + "\"");
}

Broker::~Broker() {
  stop_ = true;
  if (thread_.joinable()) {
    mosquitto_disconnect(client_);
    thread_.join();
  }
  mosquitto_destroy(client_);
  mosquitto_lib_cleanup();
}

void Broker::start() { thread_ = std::thread(&Broker::run, this); }

void Broker::wait(int milliseconds) const {
  for (int passed = 0; passed < milliseconds && !stop_; passed += 50)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

void Broker::run() {
  const std::string where = wish_.host + ":" + std::to_string(wish_.port);
  int pause = kFirstPause;
  while (!stop_) {
    int code = mosquitto_connect(client_, wish_.host.c_str(), wish_.port, wish_.keepalive);
    while (code == MOSQ_ERR_SUCCESS && !stop_) {
      code = mosquitto_loop(client_, 100, 1);
      if (is_connected_) pause = kFirstPause;
    }
    if (stop_) break;
    if (is_connected_.exchange(false))
      log_.say("The connection to the broker at " + where + " was lost: " + reason(code) +
               ". Retrying.");
    else
      log_.often("broker",
                 "The broker at " + where + " cannot be reached: " + reason(code) + ". Retrying.");
    wait(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
  // Until the farewell is sent.
  for (int i = 0; i < 10 && mosquitto_loop(client_, 20, 1) == MOSQ_ERR_SUCCESS; ++i) {
  }
}

bool Broker::publish(const std::string& topic, const std::string& payload, bool retain) {
  if (!is_connected_) return false;
  return mosquitto_publish(client_, nullptr, topic.c_str(), static_cast<int>(payload.size()),
                           payload.data(), 0, retain) == MOSQ_ERR_SUCCESS;
}

void Broker::connected(mosquitto* client, void* self, int code) {
  auto& me = *static_cast<Broker*>(self);
  const std::string where = me.wish_.host + ":" + std::to_string(me.wish_.port);
  if (code != 0) {
    me.log_.often("refused", "The broker at " + where +
                                 " rejected the connection: " + mosquitto_connack_string(code));
    return;
  }
  me.is_connected_ = true;
  me.log_.say("Connected to the broker at " + where + ".");
  for (const Subscription& s : me.subscriptions_)
    if (const int failed = mosquitto_subscribe(client, nullptr, s.topic.c_str(), s.qos))
      me.log_.say("\"" + s.topic + "\" cannot be subscribed to: " + reason(failed) + ".");
  if (!me.wish_.status_topic.empty())
    (void)me.publish(me.wish_.status_topic, "{\"online\":true}", true);
}

void Broker::disconnected(mosquitto*, void* self, int code) {
  auto& me = *static_cast<Broker*>(self);
  if (code != 0 && me.is_connected_.exchange(false))
    me.log_.say("The broker closed the connection: " + reason(code) + ". Retrying.");
  me.is_connected_ = false;
}

void Broker::message(mosquitto*, void* self, const mosquitto_message* m) {
  static_cast<Broker*>(self)->on_message_(
      m->topic, {static_cast<const char*>(m->payload), static_cast<std::size_t>(m->payloadlen)});
}

}  // namespace robomosp::bridges
