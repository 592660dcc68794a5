// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/file.h"

#include <filesystem>

#include <fmt/format.h>

#include "kernel/process.h"
#include "kernel/text.h"

namespace robomosp::recording {

std::string escape_xml(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '&') out += "&amp;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

std::string gnuplot_text(std::string_view s) {
  // Plain text in double quotes; enhanced mode is off.
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    // What stands between backquotes would be run by a shell.
    if (c == '`') out += "\\140";
    else if (c == '\n' || c == '\r' || c == '\0') out += ' ';
    else out += c;
  }
  return out + "\"";
}

namespace {

/// Gnuplot's name for the kind of file, and its size: pixels, or inches at 96 dots each.
std::string terminal_of(const Drawing& d, bool is_pdf) {
  const double dots = is_pdf ? 96 : 1;
  return fmt::format(
      "set terminal {} noenhanced size {},{} font 'DejaVu Sans,12' background '#ffffff'\n",
      is_pdf ? "pdfcairo" : "pngcairo",
      text::print_rounded(d.width / dots + 0.0, 6) + (is_pdf ? "in" : ""),
      text::print_rounded(d.height / dots + 0.0, 6) + (is_pdf ? "in" : ""));
}

/// The picture that gnuplot writes to its standard output.
Result<std::string> by_gnuplot(const Drawing& drawing, bool is_pdf) {
  ProcessSpec run;
  run.program = program_on_path("gnuplot");
  if (run.program.empty())
    return error(ErrorCode::not_found,
                 "PNG and PDF plots need the program gnuplot, which is not installed",
                 "Install gnuplot, or write an .svg plot.");
  const std::string script = terminal_of(drawing, is_pdf) + drawing.gnuplot();
  run.arguments = {"-"};
  run.input = script;
  std::string said;
  run.line = [&](std::string_view line) {
    if (!text::trim(line).empty()) said = text::trim(line);
  };
  NoProgress none;
  auto bytes = run_process(run, none);
  if (bytes.ok() && !bytes->empty()) return bytes;
  if (!bytes.ok() && bytes.error().code == ErrorCode::permission) return bytes;
  return error(ErrorCode::io,
               "gnuplot produced no picture: " +
                   (said.empty() && !bytes.ok() ? bytes.error().message : said),
               "Write an .svg plot instead.");
}

}  // namespace

Result<std::string> drawing_file(const Drawing& drawing, const std::string& name) {
  const std::string extension = std::filesystem::path(name).extension().string();
  if (extension == ".png" || extension == ".pdf") return by_gnuplot(drawing, extension == ".pdf");
  if (extension != ".svg")
    return error(ErrorCode::invalid_argument, "a plot cannot be written as " + text::quote(name),
                 "Give a file name that ends with .svg, .png or .pdf.");
  return drawing.svg();
}

}  // namespace robomosp::recording
