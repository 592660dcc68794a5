// SPDX-License-Identifier: Apache-2.0
// Effects: what a command does besides returning a value; permissions are given by effect
// (layer: core).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp {

/// Side effects of a command or other work.
enum class Effect : std::uint8_t {
  reads,        ///< reads the document, recordings or the list of loaded plugins
  edits,        ///< changes the document or its history
  simulates,    ///< makes or changes recordings, runs, jobs and caches
  files_read,   ///< reads files named in its arguments
  files_write,  ///< writes files
  processes,    ///< starts other programs
  providers,    ///< registers, removes or selects providers
  loads_code,   ///< loads plugins, evaluates scripts
  stops,        ///< ends the program
  administers   ///< gives others access to the program, and sets their permissions
};
inline constexpr Effect kAllEffects[] = {Effect::reads,      Effect::edits,       Effect::simulates,
                                         Effect::files_read, Effect::files_write, Effect::processes,
                                         Effect::providers,  Effect::loads_code,  Effect::stops,
                                         Effect::administers};

/// The word that tables and settings use, such as "files_read".
[[nodiscard]] std::string_view to_string(Effect);
/// The effect as a phrase, such as "edits the document".
[[nodiscard]] std::string_view phrase(Effect);

/// A set of effects.
class Effects {
 public:
  constexpr Effects() = default;
  constexpr Effects(Effect e) : bits_(bit(e)) {}  // NOLINT: every effect is a set of one
  [[nodiscard]] static constexpr Effects all() {
    Effects s;
    for (const Effect e : kAllEffects) s = s | e;
    return s;
  }
  [[nodiscard]] constexpr bool has(Effect e) const { return (bits_ & bit(e)) != 0; }
  /// True if the two sets share a member.
  [[nodiscard]] constexpr bool meets(Effects o) const { return (bits_ & o.bits_) != 0; }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  [[nodiscard]] friend constexpr Effects operator|(Effects a, Effects b) {
    Effects s;
    s.bits_ = a.bits_ | b.bits_;
    return s;
  }
  [[nodiscard]] constexpr Effects without(Effects o) const {
    Effects s;
    s.bits_ = bits_ & ~o.bits_;
    return s;
  }
  constexpr bool operator==(const Effects&) const = default;
  /// Its members in the order of the enumeration.
  [[nodiscard]] std::vector<Effect> list() const;
  /// "edits, files_read"; "reads" for the empty set.
  [[nodiscard]] std::string text() const;

 private:
  static constexpr std::uint32_t bit(Effect e) { return 1U << static_cast<unsigned>(e); }
  std::uint32_t bits_ = 0;
};

[[nodiscard]] constexpr Effects operator|(Effect a, Effect b) { return Effects(a) | Effects(b); }

}  // namespace robomosp
