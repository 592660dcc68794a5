// SPDX-License-Identifier: Apache-2.0
// Rows into recordings of a ROBOMOSP server, over the client in C (layer: plugin).
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

/// What happened to rows so far.
struct RowCounts {
  std::uint64_t recorded = 0;
  std::uint64_t late = 0;     ///< not later than the one before
  std::uint64_t refused = 0;  ///< by the server, such as a robot that is not there
};

/// Keeps a connection, tries again when it is lost, and appends rows. One thread.
///
/// A recording goes on after a lost connection when the same program is at the other end, and so
/// does nothing twice: it is asked how many rows came. Another is begun when it is full, when
/// another program answers, when somebody removed it, and when the time jumps back.
class Recorder {
 public:
  Recorder(ServerWish server, std::vector<RecordingWish> recordings, Log& log,
           const volatile std::sig_atomic_t* stop);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// The client, connected; nullptr = it is not, and it is not yet time to try again.
  rmpc_client* connected();
  /// Takes the rows; those that have to wait for a connection are left in `rows`.
  void append(std::vector<Row>& rows);
  [[nodiscard]] const RowCounts& counts() const { return counts_; }
  /// How often a connection was made.
  [[nodiscard]] std::uint64_t connections() const { return connections_; }

 private:
  struct Growing {
    RecordingWish wish;
    rmpc_handle handle{};
    bool is_open = false;
    std::size_t rows = 0;      ///< that the server has
    std::size_t in_doubt = 0;  ///< sent, and no answer came
    double origin = 0;         ///< controller's time of the first row
    double last = 0;           ///< of the rows that it has or may have
    double last_in_doubt = 0;
    std::vector<rmpc_handle> before;  ///< the oldest first
  };
  enum class Outcome { done, lost, refused };
  Outcome send(Growing& g, const std::vector<const Row*>& rows);
  /// After a connection was lost within a request: how many rows came. false = it is lost again.
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
