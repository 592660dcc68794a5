// SPDX-License-Identifier: Apache-2.0
// GIF89a as CompuServe specified it in 1990: blocks, and codes of variable length (LZW).
#include "scene/gif.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::scene {
namespace {

constexpr unsigned kBinBits = 5, kLookBits = 6;
constexpr std::size_t kBins = std::size_t{1} << (3 * kBinBits);
constexpr std::size_t kLooks = std::size_t{1} << (3 * kLookBits);
constexpr int kMostCodes = 4096;
constexpr std::uint16_t kUnknown = 0xFFFF;

/// Thresholds of an 8x8 pattern in which every number is far from its neighbours (Bayer 1973).
constexpr int kPattern[8][8] = {{0, 32, 8, 40, 2, 34, 10, 42},  {48, 16, 56, 24, 50, 18, 58, 26},
                                {12, 44, 4, 36, 14, 46, 6, 38}, {60, 28, 52, 20, 62, 30, 54, 22},
                                {3, 35, 11, 43, 1, 33, 9, 41},  {51, 19, 59, 27, 49, 17, 57, 25},
                                {15, 47, 7, 39, 13, 45, 5, 37}, {63, 31, 55, 23, 61, 29, 53, 21}};

std::size_t cell(int r, int g, int b, unsigned bits) {
  const unsigned drop = 8 - bits;
  return (static_cast<std::size_t>(r >> drop) << (2 * bits)) |
         (static_cast<std::size_t>(g >> drop) << bits) | static_cast<std::size_t>(b >> drop);
}

void put16(std::string& out, std::size_t v) {
  out += static_cast<char>(v & 0xFFU);
  out += static_cast<char>((v >> 8U) & 0xFFU);
}

/// Bits, the lowest first, in blocks of at most 255 bytes.
class BitBlocks {
 public:
  explicit BitBlocks(std::string& out) : out_(out) {}
  void put(unsigned code, int bits) {
    held_ |= static_cast<std::uint32_t>(code) << count_;
    for (count_ += bits; count_ >= 8; count_ -= 8) {
      block_ += static_cast<char>(held_ & 0xFFU);
      held_ >>= 8U;
      if (block_.size() == 255) flush();
    }
  }
  void end() {
    if (count_ > 0) block_ += static_cast<char>(held_ & 0xFFU);
    if (!block_.empty()) flush();
    out_ += '\0';
  }

 private:
  void flush() {
    out_ += static_cast<char>(block_.size());
    out_ += block_;
    block_.clear();
  }
  std::string& out_;
  std::string block_;
  std::uint32_t held_ = 0;
  int count_ = 0;
};

/// The indices as LZW codes, with the length of the smallest codes before them.
void put_image_data(std::string& out, const std::vector<std::uint8_t>& indices, int least_bits) {
  out += static_cast<char>(least_bits);
  BitBlocks blocks(out);
  const int clear = 1 << least_bits, end = clear + 1;
  // next[prefix * 256 + index] = code of that string.
  std::vector<std::uint16_t> next(static_cast<std::size_t>(kMostCodes) * 256, 0);
  int fresh = end + 1, bits = least_bits + 1;
  blocks.put(static_cast<unsigned>(clear), bits);
  int prefix = -1;
  for (const std::uint8_t index : indices) {
    if (prefix < 0) {
      prefix = index;
      continue;
    }
    std::uint16_t& known = next[static_cast<std::size_t>(prefix) * 256 + index];
    if (known != 0) {
      prefix = known;
      continue;
    }
    blocks.put(static_cast<unsigned>(prefix), bits);
    if (fresh < kMostCodes) {
      known = static_cast<std::uint16_t>(fresh++);
      // The reader makes its codes one later.
      if (fresh - 1 == 1 << bits && bits < 12) ++bits;
    } else {
      blocks.put(static_cast<unsigned>(clear), bits);
      std::fill(next.begin(), next.end(), std::uint16_t{0});
      fresh = end + 1;
      bits = least_bits + 1;
    }
    prefix = index;
  }
  if (prefix >= 0) blocks.put(static_cast<unsigned>(prefix), bits);
  // After its last code the reader may have grown to longer ones.
  if (fresh == 1 << bits && bits < 12) ++bits;
  blocks.put(static_cast<unsigned>(end), bits);
  blocks.end();
}

}  // namespace

GifPalette::GifPalette() : bins_(kBins) {}

void GifPalette::add(std::span<const std::uint8_t> rgba) {
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) {
    Bin& bin = bins_[cell(rgba[i], rgba[i + 1], rgba[i + 2], kBinBits)];
    ++bin.count;
    bin.red += rgba[i];
    bin.green += rgba[i + 1];
    bin.blue += rgba[i + 2];
  }
}

std::vector<GifColour> GifPalette::colours(std::size_t most) const {
  struct Point {
    std::array<double, 3> colour{};
    double count = 0;
  };
  std::vector<Point> points;
  for (const Bin& bin : bins_) {
    if (bin.count == 0) continue;
    const auto n = static_cast<double>(bin.count);
    points.push_back({{static_cast<double>(bin.red) / n, static_cast<double>(bin.green) / n,
                       static_cast<double>(bin.blue) / n},
                      // Small bodies before a large floor keep colours of their own.
                      std::sqrt(n)});
  }
  struct Box {
    std::size_t from = 0, to = 0;  // of points
    std::array<double, 3> mean{};
    int axis = 0;      // along which it is widest
    double error = 0;  // squared, along that axis
  };
  const auto measured = [&points](std::size_t from, std::size_t to) {
    Box box{from, to, {}, 0, 0};
    double n = 0;
    std::array<double, 3> square{};
    for (std::size_t i = from; i < to; ++i) {
      n += points[i].count;
      for (std::size_t k = 0; k < 3; ++k) box.mean[k] += points[i].count * points[i].colour[k];
    }
    for (double& m : box.mean) m /= n;
    for (std::size_t i = from; i < to; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const double off = points[i].colour[k] - box.mean[k];
        square[k] += points[i].count * off * off;
      }
    const auto widest = std::max_element(square.begin(), square.end());
    box.axis = static_cast<int>(widest - square.begin());
    box.error = to - from > 1 ? *widest : 0;
    return box;
  };
  if (points.empty()) return {GifColour{0, 0, 0}};
  std::vector<Box> boxes{measured(0, points.size())};
  while (boxes.size() < most) {
    const auto worst = std::max_element(
        boxes.begin(), boxes.end(), [](const Box& a, const Box& b) { return a.error < b.error; });
    if (worst->error <= 0) break;
    const Box cut = *worst;
    const auto axis = static_cast<std::size_t>(cut.axis);
    const auto begin = points.begin();
    const auto middle = std::partition(
        begin + static_cast<std::ptrdiff_t>(cut.from), begin + static_cast<std::ptrdiff_t>(cut.to),
        [&](const Point& p) { return p.colour[axis] < cut.mean[axis]; });
    const auto at = static_cast<std::size_t>(middle - begin);
    if (at == cut.from || at == cut.to) {
      worst->error = 0;  // equal but for rounding
      continue;
    }
    *worst = measured(cut.from, at);
    boxes.push_back(measured(at, cut.to));
  }
  std::vector<GifColour> out;
  for (const Box& box : boxes)
    out.push_back({static_cast<std::uint8_t>(std::lround(box.mean[0])),
                   static_cast<std::uint8_t>(std::lround(box.mean[1])),
                   static_cast<std::uint8_t>(std::lround(box.mean[2]))});
  return out;
}

struct GifWriter::Impl {
  std::size_t width = 0, height = 0;
  std::vector<GifColour> palette;
  std::string out;
  std::vector<std::uint16_t> nearest;  ///< by colour, kUnknown = not looked up yet
  std::vector<std::uint8_t> shown;     ///< indices of the frame before
  std::vector<std::uint8_t> frame;
  int bits = 8;
  std::uint8_t clear = 0;  ///< index of pixels that stay
  double spread = 0;       ///< of the pattern
  std::int64_t clock = 0;  ///< end of the last frame [1/100 s]
  std::size_t frames = 0;

  std::uint8_t index_of(int r, int g, int b) {
    std::uint16_t& known = nearest[cell(r, g, b, kLookBits)];
    if (known == kUnknown) {
      int least = std::numeric_limits<int>::max();
      for (std::size_t i = 0; i < palette.size(); ++i) {
        const int dr = palette[i][0] - r, dg = palette[i][1] - g, db = palette[i][2] - b;
        const int d = 2 * dr * dr + 4 * dg * dg + 3 * db * db;  // as eyes weigh them
        if (d < least) {
          least = d;
          known = static_cast<std::uint16_t>(i);
        }
      }
    }
    return static_cast<std::uint8_t>(known);
  }

  void quantize(std::span<const std::uint8_t> rgba) {
    frame.resize(width * height);
    for (std::size_t y = 0, i = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x, ++i) {
        const double shift = spread * (kPattern[y % 8][x % 8] / 64.0 - 0.5);
        const auto shifted = [&](std::size_t k) {
          return static_cast<int>(std::clamp(rgba[4 * i + k] + shift + 0.5, 0.0, 255.0));
        };
        frame[i] = index_of(shifted(0), shifted(1), shifted(2));
      }
  }
};

GifWriter::GifWriter(std::size_t width, std::size_t height, std::vector<GifColour> palette)
    : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.width = width;
  m.height = height;
  m.palette = std::move(palette);
  m.clear = static_cast<std::uint8_t>(m.palette.size());
  m.nearest.assign(kLooks, kUnknown);
  m.bits = 2;
  while ((std::size_t{1} << static_cast<unsigned>(m.bits)) < m.palette.size() + 1) ++m.bits;
  // About the distance between neighbours of the palette, so that steps between them vanish.
  double sum = 0;
  for (std::size_t i = 0; i < m.palette.size(); ++i) {
    int least = 3 * 255 * 255;
    for (std::size_t j = 0; j < m.palette.size(); ++j) {
      if (i == j) continue;
      int d = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int off = m.palette[i][k] - m.palette[j][k];
        d += off * off;
      }
      least = std::min(least, d);
    }
    sum += std::sqrt(least / 3.0);
  }
  m.spread = m.palette.size() < 2 ? 0 : std::min(24.0, sum / static_cast<double>(m.palette.size()));

  m.out = "GIF89a";
  put16(m.out, width);
  put16(m.out, height);
  m.out += static_cast<char>(0x80U | 0x70U | static_cast<unsigned>(m.bits - 1));
  m.out.append(2, '\0');
  for (std::size_t i = 0; i < std::size_t{1} << static_cast<unsigned>(m.bits); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      m.out += i < m.palette.size() ? static_cast<char>(m.palette[i][k]) : '\0';
  m.out += "\x21\xFF\x0BNETSCAPE2.0\x03\x01";
  m.out.append(3, '\0');  // for ever, end of block
}

GifWriter::~GifWriter() = default;

void GifWriter::add(std::span<const std::uint8_t> rgba, double end) {
  Impl& m = *impl_;
  m.quantize(rgba);
  // Only the box around what changed is written, and what in it stays is left clear.
  std::size_t left = m.width, right = 0, top = m.height, bottom = 0;
  const bool is_first = m.frames == 0;
  for (std::size_t y = 0, i = 0; y < m.height; ++y)
    for (std::size_t x = 0; x < m.width; ++x, ++i) {
      if (!is_first && m.frame[i] == m.shown[i]) continue;
      left = std::min(left, x);
      right = std::max(right, x + 1);
      top = std::min(top, y);
      bottom = std::max(bottom, y + 1);
    }
  if (left >= right) left = 0, right = 1, top = 0, bottom = 1;
  std::vector<std::uint8_t> indices;
  indices.reserve((right - left) * (bottom - top));
  for (std::size_t y = top; y < bottom; ++y)
    for (std::size_t x = left; x < right; ++x) {
      const std::size_t i = y * m.width + x;
      indices.push_back(!is_first && m.frame[i] == m.shown[i] ? m.clear : m.frame[i]);
    }
  // Rounded ends, so that rates which are no whole hundredths do not drift.
  const std::int64_t until =
      std::max(m.clock + 1, static_cast<std::int64_t>(std::llround(100 * end)));
  const auto delay = static_cast<std::size_t>(std::min<std::int64_t>(until - m.clock, 65535));
  m.clock = until;
  m.out += "\x21\xF9\x04";
  m.out += static_cast<char>(0x04U | 0x01U);  // the frame stays; one colour is clear
  put16(m.out, delay);
  m.out += static_cast<char>(m.clear);
  m.out += '\0';
  m.out += '\x2C';
  put16(m.out, left);
  put16(m.out, top);
  put16(m.out, right - left);
  put16(m.out, bottom - top);
  m.out += '\0';
  put_image_data(m.out, indices, m.bits);
  std::swap(m.shown, m.frame);
  ++m.frames;
}

std::string GifWriter::finish() {
  impl_->out += '\x3B';
  return std::move(impl_->out);
}

}  // namespace robomosp::scene
