// SPDX-License-Identifier: Apache-2.0
// What is too long for the terminal is shown page by page (layer: application, shell).
#pragma once

#include <cstddef>
#include <string_view>

namespace robomosp::shell {

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};
/// Of standard output; what a terminal does not tell is 80 by 24.
[[nodiscard]] TerminalSize terminal_size();

/// Writes a text and a newline to standard output, which is a terminal, as standard input is: at
/// once where it fits the screen; else through the program that $PAGER names, or page by page. An
/// empty $PAGER, or `cat`, shows all at once. Ctrl-C ends the pager, not the program.
void show_paged(std::string_view text);

}  // namespace robomosp::shell
