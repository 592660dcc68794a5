// SPDX-License-Identifier: Apache-2.0
// Client: connects this program to a server, another instance of it (layer: application, remote).
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <asio/generic/stream_protocol.hpp>
#include <asio/io_context.hpp>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/value.h"
#include "remote/address.h"
#include "remote/conversation.h"
#include "remote/tls.h"

namespace robomosp::remote {

struct ClientOptions {
  Address address;
  std::string token;  ///< "" = none
  std::string name;   ///< shown in the server's lists
  /// Empty: TLS for other machines only.
  std::optional<bool> tls{};
  std::filesystem::path certificate;  ///< trusted certificates; empty = the system's authorities
  double seconds = 10;                ///< connection timeout
  bool wants_notes = false;           ///< request the notes of each command; see take_notes()
  std::size_t longest_answer = std::size_t{256} << 20;  ///< [bytes]
};

/// Works on the calling thread, and waits without any lock of the program. Handles of the server
/// are represented by tables {"$handle": {kind, number, name, generation}}. A failure of the server
/// is one sentence and ends the connection until reconnect(). [one thread at a time] unless marked
class Client {
 public:
  using Clock = std::chrono::steady_clock;
  /// ErrorCode::io if nothing answers at the address, unsupported if it is not a server of this
  /// protocol, permission if access is denied or the server is not trusted, cancelled.
  static Result<std::unique_ptr<Client>> connect(ClientOptions options, Progress& progress);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Calls a method with a map or list of params; its errors are returned unchanged. After
  /// `seconds` (0 = no limit), or on cancellation by `progress`, the request is cancelled on the
  /// server, and the connection can be used for the next call. `as_job`: the command runs as a job
  /// on the server, and the result is its handle.
  Result<Value> call(const std::string& method, Value params, bool as_job, double seconds,
                     Progress& progress);
  /// Events of subscriptions, oldest first; waits at most this long for the first.
  Result<List> events(double seconds, Progress& progress);
  /// A note posted on the server by a command of this connection.
  struct Note {
    std::string code, text;
  };
  /// Notes of the calls since the last time, oldest first; none unless the options ask for them.
  [[nodiscard]] std::vector<Note> take_notes() { return std::exchange(notes_, {}); }
  /// Connects again, retrying for this many seconds while nothing answers. Handles stay valid if
  /// the server is the same instance. Subscriptions are lost.
  Result<void> reconnect(double seconds, Progress& progress);
  void close();

  [[nodiscard]] bool is_open() const { return socket_ != nullptr; }
  [[nodiscard]] const Map& hello() const { return hello_; }
  [[nodiscard]] const ClientOptions& options() const { return options_; }
  /// Incremented when the server is a new instance.
  [[nodiscard]] std::uint64_t generation() const { return generation_; }

 private:
  using Socket = asio::generic::stream_protocol::socket;
  /// Most waiting events; beyond it the oldest are dropped, and the next one reports that.
  static constexpr std::size_t kMostEvents = 10'000;

  explicit Client(ClientOptions options) : options_(std::move(options)), lines_(0) {}
  Result<void> open(Progress& progress);
  Result<void> open_socket(Clock::time_point end, Progress& progress);
  Result<void> say_hello(Clock::time_point end, Progress& progress);
  /// Runs the network until `is_done`; false on timeout.
  template <class Done>
  Result<bool> run(std::optional<Clock::time_point> end, Progress& progress, Done is_done);
  void read();
  void received(std::string_view bytes);
  void plain(std::string_view bytes);
  bool line(std::string_view text);
  void take_event(Map params);
  void write(std::string_view line);
  void flush();
  /// Ends the connection with this reason.
  void lose(Error why);
  [[nodiscard]] Error lost() const;
  [[nodiscard]] Error no_server(const std::string& why) const;
  /// A value to send: with handles of the server; fails if they belong to an instance that has
  /// ended.
  [[nodiscard]] Result<Value> outgoing(const Value& v, int depth = 0) const;

  const ClientOptions options_;
  asio::io_context io_;
  std::unique_ptr<Socket> socket_;
  std::unique_ptr<TlsStream> tls_;
  Lines lines_;
  std::string out_;
  std::size_t sent_ = 0;  ///< of out_
  bool is_writing_ = false;
  std::string buffer_;
  std::string first_;  ///< beginning of its first line
  bool has_spoken_ = false;
  std::uint64_t next_id_ = 1;
  std::uint64_t awaited_ = 0;          ///< id; 0 = none
  std::optional<Result<Value>> told_;  ///< the answer to it
  std::deque<Value> events_;
  std::vector<Note> notes_;
  std::size_t left_out_ = 0;
  std::string goodbye_;  ///< the server's reason for ending the connection
  std::optional<Error> lost_;
  Map hello_;
  std::string instance_;
  std::uint64_t generation_ = 1;
  std::size_t longest_request_ = 0;  ///< [bytes]
};

}  // namespace robomosp::remote
