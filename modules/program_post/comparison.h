// SPDX-License-Identifier: Apache-2.0
// One program for several controllers side by side: by the lines of its source, what each says,
// what one cannot say or says otherwise, and whether the points are the same when the code is read
// back (layer: application).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/post.h>

#include "program/state.h"
#include "program/trace.h"
#include "program_post/cell.h"
#include "program_post/points.h"

namespace robomosp::program_post::comparison {

/// What a language says otherwise than IRL, which has PTP speeds and C_PTP in % and C_CP in mm.
/// Nothing = the same.
struct Units {
  std::string_view target;
  const char *speed_ptp, *blend_ptp, *blend_cp;
};
/// Of languages that are not known nothing is the same.
[[nodiscard]] Units units_of(std::string_view target);

/// A target of a motion as a program reaches it.
struct Reached {
  std::uint32_t line = 0;
  std::uint32_t interpolation = RMP_MOVE_PTP;
  bool is_joints = false, is_place = false;
  bool is_step = false;  ///< from where only the run knows, by mm and turn in the base's axes
  bool has_until = false;
  std::array<double, 3> mm{};
  std::array<double, 4> turn{1, 0, 0, 0};
  program::PlainPose tool;     ///< on the flange
  std::vector<double> joints;  ///< [degrees, mm]
  std::optional<std::int32_t> status;
  double speed = 0;  ///< of paths [mm/s], of PTP [%]
  double c_cp = 0, c_ptp = 0;
  std::vector<double> additional;  ///< joints of the world by number [degrees or mm], if there are
};
/// How a program counts additional joints of the world.
struct Carried {
  const Carrier* carrier = nullptr;  ///< null = it has none
  std::span<const PostAxis> axes;    ///< external ones of a controller, in its order; empty = own
  bool is_controllers = false;       ///< they are read back
  bool is_on_carriage = false;       ///< it measures poses from the carriage
  bool has_no_additional = false;    ///< zeros only fill the type (R_NADDJ := 0)
  /// Puts joints where a target says.
  void set(const program::Target&, bool is_step, std::vector<double>& now) const;
};
/// `cell`: what a world says of targets and tool, which a controller's program says itself.
[[nodiscard]] std::vector<Reached> reached(const program::Trace&, const CellPlaces& cell,
                                           const Carried&);

/// An output that gets a value, or a wait for a time.
struct Deed {
  std::uint32_t line = 0;
  bool is_wait = false;
  std::int32_t address = 0;
  std::string name;
  bool is_real = false;
  double value = 0;  ///< [s] of a wait
};
/// Outputs of several bits are these bits, unless `whole`.
[[nodiscard]] std::vector<Deed> deeds(const program::Trace&, bool whole);

/// A line of a posted file.
struct Line {
  std::string file;
  std::size_t number = 0;
  std::string text;
};
struct SideFault {
  std::string severity, file, message, hint;
  std::uint32_t line = 0;
};
/// A target, or a controller, with what was posted for it and what came of reading that back.
struct Side {
  std::string target, title, profile, form;
  std::string label;  ///< what was asked for: the target, or the controller
  bool is_correct = false;
  std::vector<std::pair<std::string, std::string>> files;
  /// Lines by the file and line of the source; line 0 = of no line.
  std::map<std::pair<std::string, std::uint32_t>, std::vector<Line>> lines;
  std::map<std::pair<std::string, std::size_t>, std::pair<std::string, std::uint32_t>>
      source_of;  ///< the inverse
  std::vector<SideFault> faults;
  std::string reader, not_read;     ///< which reads it back, or why none did
  std::vector<SideFault> not_said;  ///< what the reader could not say: at lines of the source
  std::vector<Reached> reached;
  std::vector<Deed> bits, whole;
  Units units{};
  std::size_t compared = 0;  ///< with the program
  double most_mm = 0, most_degrees = 0;
  PostCapabilities capabilities;
};

struct Difference {
  std::string kind;  ///< cannot, otherwise, missing, form, unread, motion, point, additional,
                     ///< configuration, speed, blend, output
  std::string file;
  std::uint32_t line = 0;
  std::size_t side = 0;
  std::string text;
};

/// One program for several targets. Before compare() it has what was posted and read back, after it
/// what differs.
struct Comparison {
  std::vector<Side> sides;
  std::vector<std::pair<std::string, std::vector<std::string>>> source;  ///< files and their lines
  std::vector<Difference> differences;
  std::vector<Reached> reached;  ///< of the source
  std::vector<Deed> bits, whole;
  std::string not_traced;
  std::vector<std::string> not_compared;  ///< sentences
  std::size_t compared = 0;               ///< targets of which two sides or more were read back
  double most_mm = 0, most_degrees = 0;
};

/// An input of the program, in any letter case; null = it has none of that name.
[[nodiscard]] const rmp_code_symbol* input_named(const rmp_code&, std::string_view name);
/// Values of the program's inputs as those of what was read back: the same line of the controller
/// may have another name there.
[[nodiscard]] program::TraceOptions inputs_of(const rmp_code& program, const program::TraceOptions&,
                                              const rmp_code& read);

/// Fills in the differences, and how many points were compared.
void compare(Comparison&);

/// What was looked at, and what was not.
[[nodiscard]] std::string points_sentence(const Comparison&);
/// Lines of a source file with a difference of that kind; null = of any.
[[nodiscard]] std::set<std::uint32_t> lines_that_differ(const Comparison&, const std::string& file,
                                                        const char* kind);
/// Columns `width` wide.
[[nodiscard]] std::string as_text(const Comparison&, std::size_t width);
[[nodiscard]] std::string as_html(const Comparison&, const std::string& title);
[[nodiscard]] std::string as_markdown(const Comparison&, const std::string& title);

}  // namespace robomosp::program_post::comparison
