// SPDX-License-Identifier: Apache-2.0
#include "recording/number_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "spatial/parallel.h"

namespace robomosp::recording {
namespace {

/// "-2.2250738585072014e-308" and a separator.
constexpr std::size_t kWidest = 25;
/// Numbers, and bytes, that a thread takes at a time; and blocks between two looks at the progress.
constexpr std::size_t kBlockNumbers = 1U << 15;
constexpr std::size_t kBlockBytes = 1U << 19;
constexpr std::size_t kGroup = 32;

char* print_to(char* at, double v, bool signs_zero) {
  if (v == 0) {
    if (signs_zero && std::signbit(v)) *at++ = '-';
    *at++ = '0';
    return at;
  }
  if (std::isnan(v)) return std::copy_n("nan", 3, at);
  return std::to_chars(at, at + kWidest, v).ptr;
}

Error stopped() { return error(ErrorCode::cancelled, "the work on the file was cancelled"); }

/// Lines of a text, and what became of them.
struct Block {
  std::string_view text;
  std::vector<double> numbers;  ///< row by row
  std::size_t rows = 0, lines = 0;
  LineKind last = LineKind::row;  ///< `end` or `fault` when one of those ended it
  Error fault;

  void read(const ReadLine& read_line, std::size_t width) {
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::string_view line = text.substr(at, end - at);
      at = end + 1;
      if (line.ends_with('\r')) line.remove_suffix(1);
      const LineKind kind = read_line(line, numbers.data() + rows * width, fault);
      if (kind == LineKind::row) ++rows;
      if (kind == LineKind::end || kind == LineKind::fault) {
        last = kind;
        return;
      }
      ++lines;
    }
  }
};

}  // namespace

void append_number(std::string& out, double v, bool signs_zero) {
  std::array<char, kWidest> buffer;
  out.append(buffer.data(), print_to(buffer.data(), v, signs_zero));
}

Result<void> append_rows(std::string& out, const std::vector<Column>& columns,
                         const TableForm& form, Progress& progress) {
  if (columns.empty()) return {};
  const std::size_t rows = columns.front().values.size();
  const std::size_t block_rows = std::max<std::size_t>(1, kBlockNumbers / columns.size());
  const std::size_t blocks = (rows + block_rows - 1) / block_rows;
  const std::size_t room =
      std::min(rows, block_rows) * (columns.size() * kWidest + form.line_end.size());
  std::vector<std::string> texts(std::min(blocks, kGroup));
  std::vector<std::size_t> lengths(texts.size());
  for (std::string& t : texts) t.resize(room);
  for (std::size_t first = 0; first < blocks; first += kGroup) {
    if (progress.cancelled()) return stopped();
    progress.report(static_cast<double>(first) / static_cast<double>(blocks), "writing");
    const std::size_t count = std::min(kGroup, blocks - first);
    spatial::in_parallel(count, 1, spatial::cores(), [&](std::size_t from, std::size_t to, auto) {
      for (std::size_t b = from; b < to; ++b) {
        char* at = texts[b].data();
        const std::size_t begin = (first + b) * block_rows;
        for (std::size_t i = begin; i < std::min(rows, begin + block_rows); ++i) {
          for (std::size_t c = 0; c < columns.size(); ++c) {
            if (c) *at++ = form.separator;
            at = print_to(at, columns[c].values[i], form.signs_zero);
          }
          at = std::copy(form.line_end.begin(), form.line_end.end(), at);
        }
        lengths[b] = static_cast<std::size_t>(at - texts[b].data());
      }
    });
    for (std::size_t b = 0; b < count; ++b) out.append(texts[b], 0, lengths[b]);
  }
  return {};
}

Result<RowsRead> read_rows(std::string_view text, std::size_t first_line,
                           std::vector<Column>& columns, const ReadLine& read, Progress& progress) {
  const std::size_t width = columns.size();
  RowsRead out;
  std::vector<Block> blocks;
  for (std::size_t at = 0; at < text.size() && !out.found_end;) {
    if (progress.cancelled()) return stopped();
    progress.report(static_cast<double>(at) / static_cast<double>(text.size()), "reading");
    blocks.resize(kGroup);
    std::size_t count = 0;
    for (; count < kGroup && at < text.size(); ++count) {
      Block& b = blocks[count];
      const std::size_t newline = text.find('\n', std::min(at + kBlockBytes, text.size() - 1));
      const std::size_t end = newline == text.npos ? text.size() : newline + 1;
      b.text = text.substr(at, end - at);
      b.rows = b.lines = 0;
      b.last = LineKind::row;
      const auto lines = static_cast<std::size_t>(std::count(b.text.begin(), b.text.end(), '\n'));
      // A row has a byte for each of its numbers at least, so blank lines ask for no memory.
      b.numbers.resize((std::min(lines, b.text.size() / std::max<std::size_t>(width, 1)) + 1) *
                       width);
      at = end;
    }
    spatial::in_parallel(count, 1, spatial::cores(), [&](std::size_t from, std::size_t to, auto) {
      for (std::size_t b = from; b < to; ++b) blocks[b].read(read, width);
    });
    std::vector<std::size_t> begin(count);
    std::size_t used = 0, rows = out.rows;
    while (used < count && !out.found_end) {
      Block& b = blocks[used];
      if (b.last == LineKind::fault) {
        b.fault.where = "line " + std::to_string(first_line + out.lines + b.lines);
        return std::move(b.fault);
      }
      begin[used++] = rows;
      rows += b.rows;
      out.lines += b.lines;
      out.found_end = b.last == LineKind::end;
    }
    out.rows = rows;
    const std::size_t before = columns.empty() ? 0 : columns.front().values.size();
    const std::size_t base = begin.empty() ? 0 : begin.front();
    for (Column& c : columns) c.values.resize(before + rows - base);
    spatial::in_parallel(used, 1, spatial::cores(), [&](std::size_t from, std::size_t to, auto) {
      for (std::size_t b = from; b < to; ++b)
        for (std::size_t c = 0; c < width; ++c) {
          double* const to_column = columns[c].values.data() + before + begin[b] - base;
          const double* const numbers = blocks[b].numbers.data() + c;
          for (std::size_t i = 0; i < blocks[b].rows; ++i) to_column[i] = numbers[i * width];
        }
    });
  }
  return out;
}

}  // namespace robomosp::recording
