// SPDX-License-Identifier: Apache-2.0
// Columns of numbers as lines of text and back, by all cores (layer: application, recording,
// internal). [any thread]
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

struct TableForm {
  char separator = ' ';
  std::string_view line_end = "\n";
  bool signs_zero = true;  ///< "-0" for it; else "0"
};

/// Appends a number in its shortest text that reads back to the same bits; "nan", "inf", "-inf".
void append_number(std::string& out, double v, bool signs_zero);

/// Appends a line for each row of the columns, which are of one length. \returns cancelled
[[nodiscard]] Result<void> append_rows(std::string& out, const std::vector<Column>&,
                                       const TableForm&, Progress&);

enum class LineKind { row, skipped, end, fault };
/// Reads one line, without its end, to as many numbers as there are columns, or fills `fault`.
/// Called on several threads at once.
using ReadLine = std::function<LineKind(std::string_view line, double* row, Error& fault)>;

struct RowsRead {
  std::size_t rows = 0, lines = 0;  ///< up to and without the end
  bool found_end = false;
};
/// Appends the rows of a text to the columns, up to the line that `read` calls the end.
/// `first_line` is the number of the text's first line, for faults. \returns the fault that comes
/// first; cancelled
[[nodiscard]] Result<RowsRead> read_rows(std::string_view text, std::size_t first_line,
                                         std::vector<Column>&, const ReadLine& read, Progress&);

}  // namespace robomosp::recording
