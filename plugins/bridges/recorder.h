// SPDX-License-Identifier: Apache-2.0
// Appends rows to recordings of a ROBOMOSP server, through the C client (layer: plugin).
#pragma once

#include <chrono>
#include <csignal>
#include <cstdint>
#include <string>
#include <vector>

#include <robomosp_client.h>
#include "config.h"
#include "log.h"
#include "row_queue.h"

namespace robomosp::bridges {

/// Counters of rows.
struct RowCounts {
  std::uint64_t recorded = 0;
  std::uint64_t late = 0;     ///< not later than the previous one
  std::uint64_t refused = 0;  ///< by the server, for example for a missing robot
};

/// Keeps a connection, reconnects when it is lost, and appends rows. One thread.
///
/// A recording continues after a lost connection if the same instance of the server answers;
/// nothing is appended twice, since the server is asked for the number of rows received. A new
/// recording is begun when it is full, when another instance answers, when it was removed, and when
/// the time jumps back.
class Recorder {
 public:
  Recorder(ServerWish server, std::vector<RecordingWish> recordings, Log& log,
           const volatile std::sig_atomic_t* stop);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// The connected client; nullptr = disconnected, and it is too early to reconnect.
  rmpc_client* connected();
  /// Appends the rows; those that must wait for a connection are left in `rows`.
  void append(std::vector<Row>& rows);
  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  /// Number of connections made so far.
  [[nodiscard]] std::uint64_t connections() const { return connections_; }

 private:
  struct Growing {
    RecordingWish wish;
    rmpc_handle handle{};
    bool is_open = false;
    std::size_t rows = 0;      ///< rows confirmed by the server
    std::size_t in_doubt = 0;  ///< sent, without an answer
    double origin = 0;         ///< controller's time of the first row
    double last = 0;           ///< of the rows that it has or may have
    double last_in_doubt = 0;
    std::vector<rmpc_handle> before;  ///< oldest first
  };
  enum class Outcome { done, lost, refused };
  Outcome send(Growing& g, const std::vector<const Row*>& rows);
  /// After a connection was lost during a request: reads how many rows arrived. false = lost again.
  bool settle(Growing& g);
  void lost();

  ServerWish server_;
  std::vector<Growing> recordings_;
  Log& log_;
  rmpc_client* client_;
  std::string instance_;
  RowCounts counts_;
  std::chrono::steady_clock::time_point next_try_{};
  std::chrono::milliseconds pause_{250};
  bool was_connected_ = false;
  std::uint64_t connections_ = 0;
};

}  // namespace robomosp::bridges
