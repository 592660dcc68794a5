// SPDX-License-Identifier: Apache-2.0
// Origins of recordings: command, arguments and the records as they were, so that a recording can
// be made again and compared with the current records (layer: application, ioci).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "document/document.h"
#include "kernel/file_root.h"
#include "kernel/value.h"
#include "recording/recording.h"

namespace robomosp::ioci {

class Application;

/// Inputs of a command: the records named by its arguments with all records these refer to,
/// settings and default providers of the document, and other recordings. Keeps their state.
struct Inputs {
  std::vector<std::pair<AnyId, document::RecordPtr>> records;
  std::vector<AnyId> choices;  ///< settings and default providers at that time
  std::vector<std::pair<std::uint64_t, recording::RecordingPtr>> recordings;
};
/// The inputs named by arguments; a text that is the name of a record counts as that record.
[[nodiscard]] Inputs inputs_of(const Application&, const document::Snapshot&, const Map& args);
/// The changed inputs, one sentence each: `robot "arm": links[2].given.mass`, `world "cell" is
/// gone`. The file of a record does not count.
[[nodiscard]] std::vector<std::string> changes_since(const Application&, const document::Snapshot&,
                                                     const Inputs&);

struct RecordingOrigin {
  struct Step {
    std::string command;
    Map args;  ///< as given; records as handles
  };
  Step made;
  /// The folder of the session that made it, which its files lie in; null = anywhere.
  std::shared_ptr<const FileRoot> files = nullptr;
  std::vector<Step> added;  ///< commands that completed it since: recording.compute,
                            ///< recording.watch
  Inputs inputs;
  std::string fixed;  ///< why it cannot be made again: "it was read from ..."; "" = it can
};
using OriginPtr = std::shared_ptr<const RecordingOrigin>;

/// Origins by the numbers of recordings. [any thread]
class RecordingOrigins {
 public:
  explicit RecordingOrigins(Application& app) : app_(app) {}
  /// Of a recording; null = it was not made by a command.
  [[nodiscard]] OriginPtr find(std::uint64_t number) const;
  /// Stores the origin of the recordings in a command's result; the first call for a recording
  /// wins.
  void note(const document::Snapshot&, const std::string& command, const Map& given,
            const Map& checked, const Value& result);
  /// Marks a recording from elsewhere, with the end of a sentence such as "recording#3 cannot be
  /// made again: it was read from ...".
  void note_fixed(std::uint64_t number, std::string why);
  void note_step(std::uint64_t number, const std::string& command, const Map& given);
  /// Moves the origin of `from` to `to`.
  void move(std::uint64_t from, std::uint64_t to);

 private:
  void put(std::uint64_t number, RecordingOrigin origin);
  Application& app_;
  mutable std::mutex mutex_;
  std::map<std::uint64_t, OriginPtr> origins_;  // guarded by mutex_
  std::size_t prune_at_ = 64;                   // guarded by mutex_
};

/// The recording in a command's result: itself, or the field of a map; 0 = none.
[[nodiscard]] std::uint64_t recording_in(const Value& result);

/// Posts a note if a recording is out of date.
void note_if_stale(Application&, const document::Snapshot&, std::uint64_t number,
                   const std::string& work);

}  // namespace robomosp::ioci
