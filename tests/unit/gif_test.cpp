// SPDX-License-Identifier: Apache-2.0
// Animated GIF files, read back by a reader of their own that follows the specification.
#include "scene/gif.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace robomosp::scene {
namespace {

using Pixels = std::vector<std::uint8_t>;  // red, green, blue, opacity

struct Film {
  std::size_t width = 0, height = 0;
  std::vector<Pixels> frames;
  std::vector<int> delays;  // 1/100 s
  std::size_t image_bytes = 0;
};

/// Reads what GifWriter may write, and fails on all that the format does not allow.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  Film film() {
    Film f;
    EXPECT_EQ(bytes_.substr(0, 6), "GIF89a");
    at_ = 6;
    f.width = word();
    f.height = word();
    const unsigned flags = byte();
    EXPECT_TRUE(flags & 0x80U);
    at_ += 2;
    std::vector<GifColour> palette(std::size_t{2} << (flags & 7U));
    for (GifColour& c : palette)
      for (std::uint8_t& channel : c) channel = static_cast<std::uint8_t>(byte());
    Pixels screen(4 * f.width * f.height, 0);
    int delay = 0, clear = -1;
    for (;;) {
      const unsigned kind = byte();
      if (kind == 0x3B) break;
      if (kind == 0x21) {
        if (byte() == 0xF9) {
          EXPECT_EQ(byte(), 4U);
          clear = (byte() & 1U) != 0 ? 0 : -1;
          delay = static_cast<int>(word());
          if (clear == 0) clear = static_cast<int>(byte());
          EXPECT_EQ(byte(), 0U);
        } else {
          (void)blocks();
        }
        continue;
      }
      if (kind != 0x2C) {
        ADD_FAILURE() << "a block of kind " << kind;
        break;
      }
      const std::size_t left = word(), top = word(), width = word(), height = word();
      EXPECT_LE(left + width, f.width);
      EXPECT_LE(top + height, f.height);
      EXPECT_EQ(byte(), 0U);
      const int bits = static_cast<int>(byte());
      const std::string codes = blocks();
      f.image_bytes += codes.size();
      const std::vector<int> indices = decoded(codes, bits);
      EXPECT_EQ(indices.size(), width * height);
      for (std::size_t i = 0; i < std::min(indices.size(), width * height); ++i) {
        if (indices[i] == clear) continue;
        const std::size_t pixel = (top + i / width) * f.width + left + i % width;
        for (std::size_t k = 0; k < 3; ++k)
          screen[4 * pixel + k] = palette.at(static_cast<std::size_t>(indices[i]))[k];
        screen[4 * pixel + 3] = 255;
      }
      f.frames.push_back(screen);
      f.delays.push_back(delay);
    }
    EXPECT_EQ(at_, bytes_.size());
    return f;
  }

 private:
  unsigned byte() { return static_cast<unsigned char>(bytes_.at(at_++)); }
  std::size_t word() {
    const unsigned low = byte();
    return low | byte() << 8U;
  }
  std::string blocks() {
    std::string out;
    while (const unsigned n = byte()) {
      out += bytes_.substr(at_, n);
      at_ += n;
    }
    return out;
  }
  static std::vector<int> decoded(const std::string& data, int least) {
    const int clear = 1 << least, end = clear + 1;
    std::vector<std::vector<int>> table;
    std::vector<int> out;
    int bits = 0, held = 0, count = 0, before = -1;
    std::size_t at = 0;
    const auto reset = [&] {
      table.assign(static_cast<std::size_t>(end) + 1, {});
      for (int i = 0; i < clear; ++i) table[static_cast<std::size_t>(i)] = {i};
      bits = least + 1;
      before = -1;
    };
    reset();
    for (;;) {
      for (; count < bits; count += 8) {
        if (at >= data.size()) {
          ADD_FAILURE() << "the codes end without an end";
          return out;
        }
        held |= static_cast<int>(static_cast<unsigned char>(data[at++])) << count;
      }
      const int code = held & ((1 << bits) - 1);
      held >>= bits;
      count -= bits;
      if (code == end) return out;
      if (code == clear) {
        reset();
        continue;
      }
      const auto size = static_cast<int>(table.size());
      if (code > size || (code == size && before < 0)) {
        ADD_FAILURE() << "code " << code << " of " << size;
        return out;
      }
      std::vector<int> fresh =
          before < 0 ? std::vector<int>{} : table[static_cast<std::size_t>(before)];
      if (before >= 0)
        fresh.push_back(code == size ? fresh.front()
                                     : table[static_cast<std::size_t>(code)].front());
      if (before >= 0 && size < 4096) table.push_back(fresh);
      const std::vector<int>& text = table[static_cast<std::size_t>(code)];
      out.insert(out.end(), text.begin(), text.end());
      if (table.size() == std::size_t{1} << static_cast<unsigned>(bits) && bits < 12) ++bits;
      before = code;
    }
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

Pixels filled(std::size_t count, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
  Pixels out;
  for (std::size_t i = 0; i < count; ++i) out.insert(out.end(), {r, g, b, 255});
  return out;
}

TEST(Gif, FewColoursComeBackExactlyWithTheirTimes) {
  constexpr std::size_t kWidth = 37, kHeight = 11;
  std::vector<Pixels> frames;
  std::mt19937 random(7);
  const std::vector<GifColour> colours{{0, 0, 0}, {255, 255, 255}, {250, 10, 10}, {8, 16, 200}};
  for (int f = 0; f < 6; ++f) {
    Pixels p = f == 0 ? filled(kWidth * kHeight, 255, 255, 255) : frames.back();
    for (int k = 0; k < 30 && f != 3; ++k) {  // the fourth is the third again
      const std::size_t i = random() % (kWidth * kHeight);
      const GifColour& c = colours[random() % colours.size()];
      std::copy(c.begin(), c.end(), p.begin() + static_cast<std::ptrdiff_t>(4 * i));
    }
    frames.push_back(std::move(p));
  }
  GifPalette palette;
  for (const Pixels& p : frames) palette.add(p);
  ASSERT_EQ(palette.colours(255).size(), 4U);
  // A pattern would show between colours this far apart only where they are asked for in between.
  GifWriter writer(kWidth, kHeight, palette.colours(255));
  for (std::size_t i = 0; i < frames.size(); ++i)
    writer.add(frames[i], static_cast<double>(i + 1) / 30);
  const std::string bytes = writer.finish();
  const Film film = Reader(bytes).film();
  EXPECT_EQ(film.width, kWidth);
  EXPECT_EQ(film.height, kHeight);
  ASSERT_EQ(film.frames.size(), frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(film.frames[i], frames[i]) << i;
  // 30 Hz in hundredths: 3, 4, 3, ... and 20 in all.
  int sum = 0;
  for (const int d : film.delays) {
    EXPECT_TRUE(d == 3 || d == 4) << d;
    sum += d;
  }
  EXPECT_EQ(sum, 20);
}

TEST(Gif, ALongTableOfCodesIsBegunAnew) {
  // Noise fills the 4096 codes many times over.
  constexpr std::size_t kSide = 200;
  std::mt19937 random(11);
  std::vector<GifColour> colours;
  for (int i = 0; i < 255; ++i)
    colours.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i),
                       static_cast<std::uint8_t>((i * 7) % 256)});
  Pixels noise;
  for (std::size_t i = 0; i < kSide * kSide; ++i)
    for (int k = 0; k < 4; ++k) noise.push_back(static_cast<std::uint8_t>(random()));
  GifWriter writer(kSide, kSide, colours);
  writer.add(noise, 0.04);
  writer.add(noise, 0.08);
  const std::string bytes = writer.finish();
  const Film film = Reader(bytes).film();
  ASSERT_EQ(film.frames.size(), 2U);
  EXPECT_EQ(film.frames[0], film.frames[1]);
  for (std::size_t i = 3; i < film.frames[0].size(); i += 4)
    ASSERT_EQ(film.frames[0][i], 255) << "a pixel that was never written";
}

TEST(Gif, AGradientStaysTrueOnTheAverage) {
  constexpr std::size_t kWidth = 256, kHeight = 64;
  Pixels gradient;
  for (std::size_t y = 0; y < kHeight; ++y)
    for (std::size_t x = 0; x < kWidth; ++x)
      gradient.insert(gradient.end(), {static_cast<std::uint8_t>(180 + x / 4),
                                       static_cast<std::uint8_t>(150 + x / 4 + y / 2),
                                       static_cast<std::uint8_t>(200 - y), 255});
  GifPalette palette;
  palette.add(gradient);
  GifWriter writer(kWidth, kHeight, palette.colours(255));
  writer.add(gradient, 1);
  const std::string bytes = writer.finish();
  const Film film = Reader(bytes).film();
  ASSERT_EQ(film.frames.size(), 1U);
  int worst = 0;
  for (std::size_t i = 0; i < gradient.size(); ++i)
    worst = std::max(worst, std::abs(film.frames[0][i] - gradient[i]));
  EXPECT_LE(worst, 12);
  // Means of 16 x 16 pixels are what eyes see.
  for (std::size_t by = 0; by < kHeight; by += 16)
    for (std::size_t bx = 0; bx < kWidth; bx += 16)
      for (std::size_t k = 0; k < 3; ++k) {
        double off = 0;
        for (std::size_t y = by; y < by + 16; ++y)
          for (std::size_t x = bx; x < bx + 16; ++x) {
            const std::size_t i = 4 * (y * kWidth + x) + k;
            off += film.frames[0][i] - gradient[i];
          }
        EXPECT_LT(std::abs(off / 256), 2.5) << bx << " " << by << " " << k;
      }
}

TEST(Gif, WhatStandsStillTakesNoRoom) {
  const Pixels grey = filled(640 * 480, 120, 130, 140);
  GifPalette palette;
  palette.add(grey);
  GifWriter writer(640, 480, palette.colours(255));
  for (int i = 1; i <= 100; ++i) writer.add(grey, i * 0.04);
  const std::string bytes = writer.finish();
  EXPECT_LT(bytes.size(), 100U * 40U + 5000U);
  EXPECT_EQ(Reader(bytes).film().frames.size(), 100U);
}

TEST(Gif, APaletteKeepsSmallBodiesBesideALargeFloor) {
  std::mt19937 random(3);
  Pixels p;
  for (int i = 0; i < 300000; ++i) {
    const auto grey = static_cast<std::uint8_t>(150 + random() % 60);
    p.insert(p.end(), {grey, grey, static_cast<std::uint8_t>(grey + 5), 255});
  }
  for (int i = 0; i < 60; ++i) p.insert(p.end(), {230, 30, 20, 255});
  GifPalette palette;
  palette.add(p);
  const auto colours = palette.colours(255);
  EXPECT_TRUE(std::any_of(colours.begin(), colours.end(), [](const GifColour& c) {
    return std::abs(c[0] - 230) < 4 && std::abs(c[1] - 30) < 4 && std::abs(c[2] - 20) < 4;
  }));
  EXPECT_LE(colours.size(), 255U);
  EXPECT_EQ(GifPalette().colours(255), (std::vector<GifColour>{{0, 0, 0}}));
  EXPECT_EQ(palette.colours(1).size(), 1U);
}

}  // namespace
}  // namespace robomosp::scene
