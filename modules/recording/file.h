// SPDX-License-Identifier: Apache-2.0
// Recordings as files: the program's own lossless text, CSV in and out, JSON, and NumPy's archive
// of arrays (layer: application, recording). [any thread]
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

/// A recording as stored in a file: its world by name.
struct FiledRecording {
  Recording recording;
  std::string world;  ///< empty = made without a world
};

/// The text described in docs/user/recordings.md; numbers read back to the same bits. All of these
/// functions return ErrorCode::cancelled on cancellation by `progress`.
[[nodiscard]] Result<std::string> to_text(const Recording&, std::string_view world, Progress&);
/// A fault gives its line.
[[nodiscard]] Result<FiledRecording> recording_from_text(std::string_view text, Progress&);

/// Comma-separated text with a header line `time [s],q1 [rad],...`, RFC 4180, shortest round trip.
[[nodiscard]] Result<std::string> to_csv(const Recording&, Progress&);
/// Comma-, semicolon- or tab-separated numbers below a header line of names, with or without units:
/// `q1 [rad]`, `q1 (deg)`, `q1`. Values are converted to SI; empty fields become NaN. A fault gives
/// its line.
[[nodiscard]] Result<Recording> recording_from_csv(std::string_view text, Progress&);

/// Results of the program of 2006, *.plot: a line with the number of joints after `#`, a line of
/// names, and rows of the time and torques [N m or N], or of the time, positions, velocities and
/// accelerations of the joints [rad or m]. A fault gives its line.
[[nodiscard]] Result<Recording> recording_from_plot(std::string_view text);

/// One object: title, robot, trajectory, dof, notes and columns with name, unit, doc, lower and
/// upper limit (omitted if infinite) and values; non-finite values are null.
[[nodiscard]] std::string to_json(const Recording&);

/// An archive that numpy.load reads: a float64 array for every column by its name, and the texts
/// `columns`, `units`, `docs` and `title`. Stored, not compressed. More than 4 GiB is an error.
/// (Format: numpy.lib.format 1.0, in a zip file.)
[[nodiscard]] Result<std::string> to_npz(const Recording&);

}  // namespace robomosp::recording
