// SPDX-License-Identifier: Apache-2.0
#include "sim/plot_file.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "kernel/text.h"

namespace robomosp::sim {

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
    if (c == '\n' || c == '\r') out += ' ';
    else out += c;
  }
  return out + "\"";
}

namespace {

/// Gnuplot's name for the kind of file, and its size: pixels, or inches at 96 dots each.
std::string terminal_of(const Drawing& d, bool is_pdf) {
  const double dots = is_pdf ? 96 : 1;
  return fmt::format(
      "set terminal {} noenhanced size {},{} font 'DejaVu Sans,11' background '#ffffff'\n",
      is_pdf ? "pdfcairo" : "pngcairo",
      text::print_rounded(d.width / dots + 0.0, 6) + (is_pdf ? "in" : ""),
      text::print_rounded(d.height / dots + 0.0, 6) + (is_pdf ? "in" : ""));
}

Result<void> write_by_gnuplot(const Drawing& drawing, const std::string& path, bool is_pdf) {
  namespace fs = std::filesystem;
  std::error_code ec;
  const fs::path folder = fs::absolute(path, ec).parent_path();
  if (!fs::is_directory(folder, ec))
    return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                 "Create it first.");
  // The script goes through a file, so that gnuplot's complaints can be read back from the pipe.
  std::string script = (folder / (".robomosp-plot-XXXXXX")).string();
  const int fd = mkstemp(script.data());
  if (fd < 0)
    return error(ErrorCode::io, "cannot write in folder " + text::quote(folder.string()),
                 "Check its permissions.");
  std::FILE* f = fdopen(fd, "w");
  const std::string body =
      terminal_of(drawing, is_pdf) + "set output " + gnuplot_text(path) + "\n" + drawing.gnuplot();
  const bool written = f && std::fwrite(body.data(), 1, body.size(), f) == body.size();
  if (f) std::fclose(f);
  fs::remove(path, ec);
  std::string said;
  int status = -1;
  if (written) {
    const std::string command = "gnuplot '" + script + "' 2>&1";
    if (std::FILE* pipe = popen(command.c_str(), "r")) {
      std::array<char, 512> line{};
      while (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) said += line.data();
      status = pclose(pipe);
    }
  }
  fs::remove(script, ec);
  if (status == 0 && fs::exists(path, ec)) return {};
  if (said.find("not found") != std::string::npos || status == -1)
    return error(ErrorCode::not_found,
                 "PNG and PDF plots need the program gnuplot, which is not installed",
                 "Install gnuplot, or write an .svg plot.");
  return error(ErrorCode::io,
               "gnuplot did not write " + text::quote(path) + ": " + std::string(text::trim(said)),
               "Write an .svg plot instead.");
}

}  // namespace

Result<void> write_drawing(const Drawing& drawing, const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".png" || extension == ".pdf")
    return write_by_gnuplot(drawing, path, extension == ".pdf");
  if (extension != ".svg")
    return error(ErrorCode::invalid_argument, "a plot cannot be written as " + text::quote(path),
                 "Give a file name that ends with .svg, .png or .pdf.");
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << drawing.svg();
  out.close();
  if (!out)
    return error(ErrorCode::io, "cannot write " + text::quote(path),
                 "Check the folder and its permissions.");
  return {};
}

}  // namespace robomosp::sim
