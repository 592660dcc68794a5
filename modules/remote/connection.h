// SPDX-License-Identifier: Apache-2.0
// Connection: one client of a server, from its first byte to its end (layer: application, remote).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <asio/generic/stream_protocol.hpp>
#include <asio/steady_timer.hpp>

#include "ioci/core/application.h"
#include "remote/conversation.h"
#include "remote/json.h"
#include "remote/limits.h"
#include "remote/reactor.h"
#include "remote/rpc.h"
#include "remote/server.h"
#include "remote/tls.h"
#include "remote/web.h"

namespace robomosp::remote {

/// States of runs as JSON, made once for all clients that follow a run. [any thread]
class StateTexts {
 public:
  using Text = std::shared_ptr<const std::string>;
  /// Calls `make` for a state that is not cached.
  Text of(const std::shared_ptr<const ioci::RunState>& state,
          const std::function<std::string()>& make);

 private:
  static constexpr std::size_t kMost = 64;  ///< runs
  std::mutex mutex_;
  std::map<std::uint64_t, std::pair<std::shared_ptr<const ioci::RunState>, Text>> last_;
};

/// State shared by connections. It must outlive them.
struct Hall {
  ioci::Application& app;
  Reactor& reactor;
  const ServerOptions& options;
  const Tokens& tokens;
  const WebRules* web = nullptr;  ///< null: no browser access
  /// Adds a line to the audit file, if there is one.
  std::function<void(Map line)> audit;
  std::function<void(std::uint64_t number)> gone;
  std::string instance;                   ///< random, so that clients notice another program
  std::atomic<std::uint64_t> scripts{0};  ///< clients that have run one
  /// Memory of the program [MiB] while it exceeds the limit; else 0.
  std::atomic<std::uint64_t> too_large{0};
  /// Called when a client has started a job.
  std::function<void(std::uint64_t job)> job_started{};
  StateTexts state_texts{};
};

/// Only one thread at a time reads; a command runs on the thread that read it, or on a free one.
/// [any thread] unless marked
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  using Socket = asio::generic::stream_protocol::socket;
  using Clock = std::chrono::steady_clock;
  Connection(Hall& hall, std::uint64_t number, Socket socket, std::string peer, bool needs_token,
             std::shared_ptr<TlsContext> tls);
  ~Connection();
  void start();
  /// Sends the reason to the client if possible, and ends the connection.
  void close(const std::string& reason);
  /// Ends timed-out work; called periodically.
  void look(Clock::time_point now);
  /// Start time of its running command, unless that was already cancelled; nullopt if there is
  /// none.
  [[nodiscard]] std::optional<Clock::time_point> running_since() const;
  /// Cancels the running command because the program uses too much memory.
  void end_for_memory();
  [[nodiscard]] ClientInfo info() const;
  [[nodiscard]] bool is_closed() const;

 private:
  struct Talk;  ///< state after hello
  /// Why the running command was ended.
  enum class Ended : std::uint8_t { no, time, memory };
  /// Rows of a run or recording already sent to a client.
  struct Sent {
    std::size_t next = 0;  ///< index of the first row not sent
    std::optional<std::size_t> restarts{};
    bool has_more = false;  ///< more rows wait until the client has read
  };
  struct Subscription {
    std::uint64_t all = 0;   ///< token of events sent at once
    std::uint64_t runs = 0;  ///< token of events sent at a limited rate: states of runs, and
                             ///< recordings
    bool with_rows = false;
    std::vector<std::string> columns{};  ///< of the rows; empty = all
    Arrays arrays = Arrays::numbers;
    std::chrono::nanoseconds every{0};
    Clock::time_point last{};
    bool is_waiting = false;  ///< until its next time
  };

  // One thread at a time:
  void wait_readable();
  void on_readable();
  bool received(std::string_view plain);
  bool received_from_web(std::string_view plain);
  bool too_long();
  bool line(std::string_view text);
  bool hello(std::string_view text);
  bool hello_classic(std::string_view text);
  bool admit(const std::string& secret, const std::string& client, Value id, const Value* wanted);
  bool refuse(const std::string& answer, const std::string& why);

  void drain();
  void send(std::string text);
  void send_bytes(std::string bytes);
  void push(std::uint64_t number);
  void push_all();
  bool push_runs(std::uint64_t number, const Subscription& s);
  void send_recording(std::uint64_t number, const Subscription& s, const ioci::Event&);
  /// `rows` returns the rows after those the client has.
  void send_rows(std::uint64_t number, const Subscription& s, Sent& sent, const Handle& of,
                 Map params, const std::function<Result<Map>(const Sent&)>& rows);
  void send_run_rows(std::uint64_t number, const Subscription& s, std::uint64_t run, Map params);
  void send_recording_rows(std::uint64_t number, const Subscription& s, std::uint64_t recording,
                           Map params);
  void send_event(std::uint64_t number, Map params, Arrays arrays = Arrays::numbers);
  void send_event(std::uint64_t number, std::string_view params);
  [[nodiscard]] std::string event_text(Map params, Arrays arrays) const;
  std::function<void()> after(double seconds, std::function<void()> fn);
  void flush_locked();
  void end_locked();
  void shut();
  Result<Value> subscribe(const Map& params);
  Result<Value> unsubscribe(const Map& params);
  std::optional<Error> admitted(std::uint64_t own);
  [[nodiscard]] std::size_t unread() const;

  Hall& hall_;
  const std::uint64_t number_;
  const std::string peer_;
  const bool needs_token_;
  const Clock::time_point begin_ = Clock::now();
  Lines lines_;              ///< the reader's
  bool is_first_ = true;     ///< the reader's: no byte came yet
  bool is_classic_ = false;  ///< the reader's
  /// Created by the first byte of a browser, on the reader's thread, and kept.
  std::unique_ptr<WebDoor> web_;
  std::unique_ptr<Talk> talk_;  ///< created by hello, on the reader's thread, and kept
  std::atomic<bool> has_talk_{false};
  std::atomic<bool> is_web_{false};  ///< lines are sent as frames of a WebSocket
  std::atomic<bool> is_draining_{false};
  std::atomic<bool> is_closing_{false};
  std::atomic<bool> is_told_{false};     ///< set by close(), after sending the reason
  std::atomic<bool> is_leaving_{false};  ///< the client said goodbye
  std::atomic<Ended> ended_{Ended::no};
  std::atomic<std::uint64_t> requests_{0}, bytes_in_{0}, bytes_out_{0};
  std::atomic<Clock::rep> last_in_, last_out_, line_begin_{0};
  std::atomic<bool> is_paused_{false};  ///< reading is suspended until requests are answered

  std::mutex push_mutex_;  ///< serialises the sending of events; lock it before mutex_
  /// Rows of runs and recordings sent to subscriptions. Guarded by push_mutex_
  std::map<std::uint64_t, std::map<std::uint64_t, Sent>> rows_, recording_rows_;
  mutable std::mutex mutex_;
  // Guarded by mutex_:
  Socket socket_;
  std::unique_ptr<TlsStream> tls_;
  std::string out_;
  std::size_t sent_ = 0;  ///< of out_
  bool waits_writable_ = false, is_shut_ = false;
  bool is_ending_ = false;  ///< it is closed when everything is sent
  Clock::time_point closing_since_{};
  Clock::duration goodbye_;          ///< time limit of the client after that
  Clock::time_point stuck_since_{};  ///< when the peer last received something, while data is
                                     ///< waiting
  std::map<std::uint64_t, Subscription> subscriptions_;
  std::uint64_t next_subscription_ = 1;
  double tokens_left_ = 0;  ///< of the rate limit
  Clock::time_point refilled_{};
};

}  // namespace robomosp::remote
