// SPDX-License-Identifier: Apache-2.0
// What the bridges' configuration files have in common (layer: plugin). Keys that nobody knows, and
// values of another type or beyond their range, are refused with a sentence that names the place.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace robomosp::bridges {

using Json = nlohmann::json;

/// A fault of the configuration: one sentence.
struct ConfigFault : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A table of a configuration and its place in it ("recordings[2].time").
class Table {
 public:
  Table(const Json& json, std::string path);
  [[nodiscard]] bool has(const char* key);
  /// Throws where it is missing or no text.
  [[nodiscard]] std::string text(const char* key);
  [[nodiscard]] std::string text(const char* key, std::string when_left_out);
  [[nodiscard]] double number(const char* key, double when_left_out, double least, double most);
  [[nodiscard]] bool flag(const char* key, bool when_left_out);
  [[nodiscard]] const Json* any(const char* key);
  [[nodiscard]] Table table(const char* key);
  [[nodiscard]] std::vector<Table> tables(const char* key);
  /// Throws where there is a key that nobody has asked for.
  void done() const;
  [[noreturn]] void fault(const std::string& what, const char* key = nullptr) const;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  const Json& json_;
  std::string path_;
  std::set<std::string, std::less<>> asked_;
};

/// A recording that grows by what a controller sends.
struct RecordingWish {
  std::string title, robot, world;
  struct Column {
    std::string name, unit;
  };
  std::vector<Column> columns;      ///< without the time
  std::size_t most_rows = 1000000;  ///< then another recording is begun
  std::size_t keep = 4;             ///< recordings of it; the oldest are removed
};
/// The keys `title`, `robot`, `world`, `rows`, `keep`.
[[nodiscard]] RecordingWish read_recording(Table& table);

/// How ROBOMOSP is reached, and how rows wait.
struct ServerWish {
  std::string address = "127.0.0.1:7007";
  std::string token;
  std::size_t queue = 20000;      ///< rows that wait at most
  double batch_seconds = 0.1;     ///< rows are handed on after so long at the latest
  std::size_t batch_rows = 1000;  ///< and so many at once at most
};
/// The key `robomosp`, which may be left out.
[[nodiscard]] ServerWish read_server(Table& table);

/// The configuration file; throws where it cannot be read or is no JSON. Comments are allowed.
[[nodiscard]] Json read_config(const std::filesystem::path& file);
/// A secret of one line in a file that only its owner may read; throws otherwise.
[[nodiscard]] std::string read_secret(const std::string& file, const std::string& where);

}  // namespace robomosp::bridges
