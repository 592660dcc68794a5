// SPDX-License-Identifier: Apache-2.0
// Client: this program as a client of another one that serves (layer: application, remote).
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
  std::string name;   ///< for the lists of the server
  /// Left out: TLS for other machines than this one.
  std::optional<bool> tls{};
  std::filesystem::path certificate;  ///< whom to trust; empty = the authorities of the system
  double seconds = 10;                ///< what connecting may take
  bool wants_notes = false;           ///< asks for the notes of each command; see take_notes()
  std::size_t longest_answer = std::size_t{256} << 20;  ///< [bytes]
};

/// Works on the thread that calls it, and waits without any lock of the program. Handles of the
/// other program are tables {"$handle": {kind, number, name, generation}} here. What is wrong with
/// the other end is one sentence; then the connection is over until reconnect(). [one thread at a
/// time] unless marked
class Client {
 public:
  using Clock = std::chrono::steady_clock;
  /// ErrorCode::io when nobody answers there, unsupported when it is no server of this protocol,
  /// permission when it does not let in or is not trusted, cancelled.
  static Result<std::unique_ptr<Client>> connect(ClientOptions options, Progress& progress);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Calls a method with a map or list of params; its errors come as they are. After `seconds` (0 =
  /// no limit), or when progress says so, the request is cancelled over there; the connection is
  /// good for the next call then.
  /// `as_job`: a command goes on as a job over there, whose handle is the answer.
  Result<Value> call(const std::string& method, Value params, bool as_job, double seconds,
                     Progress& progress);
  /// What came for subscriptions, oldest first; waits up to so many seconds for the first.
  Result<List> events(double seconds, Progress& progress);
  /// A note that a command of this connection posted over there.
  struct Note {
    std::string code, text;
  };
  /// Notes of the calls since the last time, oldest first; none unless the options ask for them.
  [[nodiscard]] std::vector<Note> take_notes() { return std::exchange(notes_, {}); }
  /// Connects again, trying for so many seconds while nobody answers. Handles hold on where the
  /// other program is still the same. Subscriptions are gone.
  Result<void> reconnect(double seconds, Progress& progress);
  void close();

  [[nodiscard]] bool is_open() const { return socket_ != nullptr; }
  [[nodiscard]] const Map& hello() const { return hello_; }
  [[nodiscard]] const ClientOptions& options() const { return options_; }
  /// Counts up when another program is there than before.
  [[nodiscard]] std::uint64_t generation() const { return generation_; }

 private:
  using Socket = asio::generic::stream_protocol::socket;
  /// Events that wait; beyond it the oldest are left out, and the next one says so.
  static constexpr std::size_t kMostEvents = 10'000;

  explicit Client(ClientOptions options) : options_(std::move(options)), lines_(0) {}
  Result<void> open(Progress& progress);
  Result<void> open_socket(Clock::time_point end, Progress& progress);
  Result<void> say_hello(Clock::time_point end, Progress& progress);
  /// Runs the network until `is_done`; false when the time is over first.
  template <class Done>
  Result<bool> run(std::optional<Clock::time_point> end, Progress& progress, Done is_done);
  void read();
  void received(std::string_view bytes);
  void plain(std::string_view bytes);
  bool line(std::string_view text);
  void take_event(Map params);
  void write(std::string_view line);
  void flush();
  /// The connection is over, for this reason.
  void lose(Error why);
  [[nodiscard]] Error lost() const;
  [[nodiscard]] Error no_server(const std::string& why) const;
  /// As it is sent: with handles of over there, refused when they are of a program that has ended.
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
  std::string first_;  ///< how its first line begins
  bool has_spoken_ = false;
  std::uint64_t next_id_ = 1;
  std::uint64_t awaited_ = 0;          ///< id; 0 = none
  std::optional<Result<Value>> told_;  ///< the answer to it
  std::deque<Value> events_;
  std::vector<Note> notes_;
  std::size_t left_out_ = 0;
  std::string goodbye_;  ///< why the server ends the connection, as it said
  std::optional<Error> lost_;
  Map hello_;
  std::string instance_;
  std::uint64_t generation_ = 1;
  std::size_t longest_request_ = 0;  ///< [bytes]
};

}  // namespace robomosp::remote
