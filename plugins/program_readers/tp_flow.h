// SPDX-License-Identifier: Apache-2.0
// What the statements of FANUC TP programs may find set: the active user frame, the active tool and
// the conditions of SKIP and offsets, along every path that jumps, blocks and calls allow
// (plugin program_readers, std only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace robomosp::readers {

/// Values that each setting may have at a place, a bit each: number n is bit n.
struct TpState {
  std::uint64_t frame = 0, tool = 0, skip = 0, offset = 0, tool_offset = 0;
  bool operator==(const TpState&) const = default;
};
/// A number that is computed, or too great for a bit.
inline constexpr std::uint64_t kTpComputed = std::uint64_t{1} << 62;
/// What was active before the program began: the controller alone knows it.
inline constexpr std::uint64_t kTpBefore = std::uint64_t{1} << 63;
[[nodiscard]] std::uint64_t tp_bit(std::int64_t number);
/// The number, where it is the only one.
[[nodiscard]] std::optional<std::int64_t> tp_only(std::uint64_t numbers);

/// What one statement does to the settings, and where the program goes from it.
struct TpStep {
  std::optional<std::uint64_t> frame, tool, skip, offset, tool_offset;  ///< what it sets
  /// A motion to a place that was taught in this frame or tool: the controller refuses it in
  /// another, so behind it this one is active.
  std::uint64_t taught_frame = 0, taught_tool = 0;
  std::vector<std::size_t> to;  ///< statements that it may jump to
  bool jumps_anywhere = false;  ///< to any label
  bool is_label = false;
  bool goes_on = true;   ///< to the next statement
  bool returns = false;  ///< END
  std::vector<std::string> calls;
  bool is_conditional = false;  ///< its calls may be left out
};

class TpFlow {
 public:
  /// Programs by their names in lower case; the first one is where it begins.
  void add(std::string name, std::vector<TpStep> steps);
  void solve();
  /// What may be set where a statement begins; empty = no path leads there.
  [[nodiscard]] TpState before(const std::string& program, std::size_t step) const;

 private:
  struct Listing {
    std::vector<TpStep> steps;
    std::vector<TpState> before;
    TpState entry, exit;
  };
  TpState run(Listing& of, const TpState& entry);
  [[nodiscard]] TpState behind_calls(const TpStep& step, TpState state) const;

  std::map<std::string, Listing> listings_;
  std::string first_;
};

}  // namespace robomosp::readers
