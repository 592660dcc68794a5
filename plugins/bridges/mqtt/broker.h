// SPDX-License-Identifier: Apache-2.0
// A persistent connection to an MQTT broker (layer: plugin).
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "../config.h"
#include "../log.h"

struct mosquitto;
struct mosquitto_message;

namespace robomosp::bridges {

struct BrokerWish {
  std::string host = "127.0.0.1";
  int port = 1883;
  int keepalive = 30;  ///< [s]
  std::string client_id, username, password;
  std::string ca_file, certificate_file, key_file;  ///< TLS, when ca_file is given
  std::string status_topic;                         ///< "" = none
};
/// The key `broker`.
[[nodiscard]] BrokerWish read_broker(Table& config);

/// Subscribes, passes messages on, and publishes. A separate thread reads; when the connection is
/// lost, it reconnects, at most every 10 s, and subscribes again.
class Broker {
 public:
  struct Subscription {
    std::string topic;
    int qos = 0;
  };
  /// Called on the reading thread.
  using OnMessage = std::function<void(std::string_view topic, std::string_view payload)>;

  /// Throws ConfigFault for unusable settings, such as TLS files.
  Broker(BrokerWish wish, std::vector<Subscription> subscriptions, OnMessage on_message, Log& log);
  ~Broker();  ///< disconnects and waits for the thread
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  void start();
  /// false = there is no connection, and the message is dropped. [any thread]
  bool publish(const std::string& topic, const std::string& payload, bool retain);
  [[nodiscard]] bool is_connected() const { return is_connected_; }

 private:
  void run();
  void wait(int milliseconds) const;
  static void connected(mosquitto*, void* self, int code);
  static void disconnected(mosquitto*, void* self, int code);
  static void message(mosquitto*, void* self, const mosquitto_message* m);

  BrokerWish wish_;
  std::vector<Subscription> subscriptions_;
  OnMessage on_message_;
  Log& log_;
  mosquitto* client_ = nullptr;
  std::atomic<bool> is_connected_{false}, stop_{false};
  std::thread thread_;
};

}  // namespace robomosp::bridges
