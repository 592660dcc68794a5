// SPDX-License-Identifier: Apache-2.0
// Shows text longer than the screen page by page (layer: application, shell).
#pragma once

#include <cstddef>
#include <string_view>

namespace robomosp::shell {

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};
/// Size of the terminal at standard output; 80 by 24 if unknown.
[[nodiscard]] TerminalSize terminal_size();

/// Writes a text and a newline to standard output; it and standard input must be a terminal. Writes
/// at once if the text fits the screen; else through the program named by $PAGER, or page by page.
/// An empty $PAGER, or `cat`, shows everything at once. Ctrl-C ends the pager, not the program.
void show_paged(std::string_view text);

}  // namespace robomosp::shell
