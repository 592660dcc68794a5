// SPDX-License-Identifier: Apache-2.0
// Packages of the Real-Time Data Exchange of Universal Robots, version 2 of the protocol, as its
// maker publishes it (layer: plugin). Numbers go with the highest byte first. What comes is a
// stranger's: every length is checked. [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp::bridges::rtde {

inline constexpr int kPort = 30004;
inline constexpr std::uint16_t kVersion = 2;

enum class Package : std::uint8_t {
  text_message = 77,        // 'M'
  setup_outputs = 79,       // 'O'
  pause = 80,               // 'P'
  start = 83,               // 'S'
  data = 85,                // 'U'
  protocol_version = 86,    // 'V'
  controller_version = 118  // 'v'
};

/// A variable of a data package.
enum class Type : std::uint8_t {
  boolean,
  uint8,
  uint32,
  uint64,
  int32,
  number,
  vector3,
  vector6,
  vector6_int32,
  vector6_uint32
};
[[nodiscard]] std::optional<Type> type_named(std::string_view name);  ///< "VECTOR6D"
[[nodiscard]] std::size_t entries_of(Type);
[[nodiscard]] std::size_t bytes_of(Type);

/// A whole package: its length, its kind, its content.
[[nodiscard]] std::string package(Package kind, std::string_view content = {});
[[nodiscard]] std::string request_version();
/// The variables that are wanted at `frequency` [Hz].
[[nodiscard]] std::string request_outputs(double frequency, const std::vector<std::string>& names);

/// Cuts a stream of bytes into packages.
class Reader {
 public:
  struct Found {
    std::uint8_t kind = 0;
    std::string_view content;  ///< until the next call of add()
  };
  void add(std::string_view bytes);
  /// The next whole package; none = more bytes are needed, or is_broken().
  [[nodiscard]] std::optional<Found> next();
  /// A length that no package has: this is another protocol.
  [[nodiscard]] bool is_broken() const { return is_broken_; }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
  bool is_broken_ = false;
};

/// Answer to request_version(), pause and start: whether it was accepted; none = no such answer.
[[nodiscard]] std::optional<bool> accepted(std::string_view content);
/// Answer to request_outputs(): the recipe's number and the types by name ("NOT_FOUND").
struct Recipe {
  std::uint8_t number = 0;
  std::vector<std::string> types;
};
[[nodiscard]] std::optional<Recipe> recipe(std::string_view content);
/// "3.15.8 (106339)" of the answer to controller_version.
[[nodiscard]] std::optional<std::string> controller_version(std::string_view content);
/// The text of a message of the controller; none = it is none.
[[nodiscard]] std::optional<std::string> text_message(std::string_view content);
/// The numbers of a data package of these types, one after the other; none = it has another length
/// or is of another recipe.
[[nodiscard]] std::optional<std::vector<double>> data(std::string_view content, std::uint8_t recipe,
                                                      std::span<const Type> types);

}  // namespace robomosp::bridges::rtde
