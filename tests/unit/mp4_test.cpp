// SPDX-License-Identifier: Apache-2.0
// MP4 films, taken apart by the rules of the container and played back by a decoder.
#include "scene/mp4.h"

#include <dlfcn.h>

#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#if __has_include(<wels/codec_api.h>)
#include <wels/codec_api.h>

namespace robomosp::scene {
namespace {

std::uint64_t number(const std::string& s, std::size_t at, std::size_t bytes) {
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < bytes; ++i) v = v << 8 | static_cast<unsigned char>(s.at(at + i));
  return v;
}

/// The boxes of a run of bytes by name, those that hold others opened: what is in each, and where
/// it begins in the file.
void open_boxes(const std::string& file, std::size_t from, std::size_t to,
                std::map<std::string, std::pair<std::size_t, std::size_t>>& out) {
  while (from < to) {
    const std::size_t size = number(file, from, 4);
    ASSERT_GE(size, 8U);
    ASSERT_LE(from + size, to);
    const std::string name = file.substr(from + 4, 4);
    out[name] = {from + 8, from + size};
    for (const char* holder : {"moov", "trak", "mdia", "minf", "stbl"})
      if (name == holder) open_boxes(file, from + 8, from + size, out);
    from += size;
  }
  ASSERT_EQ(from, to);
}

/// What a decoder of the library makes of a film: the mean Y, U, V of every frame.
std::vector<std::array<double, 3>> played(const std::string& file, std::size_t offset,
                                          const std::vector<std::size_t>& sizes,
                                          const std::string& start) {
  void* handle = dlopen("libopenh264.so.7", RTLD_NOW | RTLD_LOCAL);
  std::vector<std::array<double, 3>> frames;
  if (!handle) return frames;
  const auto create = reinterpret_cast<long (*)(ISVCDecoder**)>(dlsym(handle, "WelsCreateDecoder"));
  const auto destroy =
      reinterpret_cast<void (*)(ISVCDecoder*)>(dlsym(handle, "WelsDestroyDecoder"));
  ISVCDecoder* decoder = nullptr;
  EXPECT_EQ(create(&decoder), 0);
  SDecodingParam p{};
  p.sVideoProperty.eVideoBsType = VIDEO_BITSTREAM_AVC;
  EXPECT_EQ(decoder->Initialize(&p), 0);
  const auto take = [&](const std::string& bytes) {
    std::array<unsigned char*, 3> planes{};
    SBufferInfo info{};
    EXPECT_EQ(decoder->DecodeFrameNoDelay(reinterpret_cast<const unsigned char*>(bytes.data()),
                                          static_cast<int>(bytes.size()), planes.data(), &info),
              dsErrorFree);
    if (info.iBufferStatus != 1) return;
    std::array<double, 3> mean{};
    for (std::size_t k = 0; k < 3; ++k) {
      const int half = k == 0 ? 1 : 2, stride = info.UsrData.sSystemBuffer.iStride[k == 0 ? 0 : 1];
      const int w = info.UsrData.sSystemBuffer.iWidth / half,
                h = info.UsrData.sSystemBuffer.iHeight / half;
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) mean[k] += planes[k][y * stride + x];
      mean[k] /= w * h;
    }
    frames.push_back(mean);
  };
  std::string ahead = start;
  for (const std::size_t size : sizes) {
    std::string annex = std::exchange(ahead, "");
    for (std::size_t at = offset; at < offset + size;) {
      const std::size_t unit = number(file, at, 4);
      annex += std::string("\0\0\0\1", 4) + file.substr(at + 4, unit);
      at += 4 + unit;
    }
    take(annex);
    offset += size;
  }
  decoder->Uninitialize();
  destroy(decoder);
  dlclose(handle);
  return frames;
}

TEST(Mp4, HasItsFramesDurationAndColoursWhenPlayedBack) {
  constexpr std::size_t kW = 97, kH = 75, kFrames = 60;  // odd: padded
  constexpr double kFps = 25;
  auto made = Mp4Writer::create(kW, kH, kFps);
  if (!made.ok()) GTEST_SKIP() << made.error().sentence();
  for (std::size_t f = 0; f < kFrames; ++f) {
    std::vector<std::uint8_t> rgba(4 * kW * kH, 255);
    for (std::size_t i = 0; i < kW * kH; ++i) {
      rgba[4 * i] = static_cast<std::uint8_t>(4 * f);
      rgba[4 * i + 1] = 100;
      rgba[4 * i + 2] = static_cast<std::uint8_t>(240 - 3 * f);
    }
    ASSERT_TRUE(made->add(rgba).ok());
  }
  const std::string file = made->finish().value();

  std::map<std::string, std::pair<std::size_t, std::size_t>> boxes;
  open_boxes(file, 0, file.size(), boxes);
  for (const char* name : {"ftyp", "mvhd", "tkhd", "mdhd", "hdlr", "vmhd", "stsd", "stts", "stss",
                           "stsc", "stsz", "stco", "mdat"})
    ASSERT_EQ(boxes.count(name), 1U) << name;
  const auto at = [&](const char* name) { return boxes[name].first; };
  // Version 1: two 64-bit times, then the ticks of a second and the duration.
  const double ticks = static_cast<double>(number(file, at("mdhd") + 20, 4));
  EXPECT_DOUBLE_EQ(static_cast<double>(number(file, at("mdhd") + 24, 8)) / ticks, kFrames / kFps);
  EXPECT_DOUBLE_EQ(static_cast<double>(number(file, at("mvhd") + 24, 8)) /
                       static_cast<double>(number(file, at("mvhd") + 20, 4)),
                   kFrames / kFps);
  EXPECT_EQ(number(file, at("stts") + 8, 4), kFrames);
  EXPECT_DOUBLE_EQ(static_cast<double>(number(file, at("stts") + 12, 4)) / ticks, 1 / kFps);
  const std::size_t count = number(file, at("stsz") + 8, 4), keys = number(file, at("stss") + 4, 4);
  ASSERT_EQ(count, kFrames);
  EXPECT_GE(keys, 2U);  // one in two seconds
  std::vector<std::size_t> sizes;
  std::size_t all = 0;
  for (std::size_t f = 0; f < count; ++f) {
    sizes.push_back(number(file, at("stsz") + 12 + 4 * f, 4));
    all += sizes.back();
  }
  EXPECT_EQ(number(file, at("stco") + 8, 4), at("mdat"));
  EXPECT_EQ(all, boxes["mdat"].second - boxes["mdat"].first);
  // Within the picture's entry: 78 bytes, then what a decoder must know.
  const std::size_t entry = at("stsd") + 8 + 8;
  EXPECT_EQ(number(file, entry + 24, 2), 98U);
  EXPECT_EQ(number(file, entry + 26, 2), 76U);
  const std::size_t config = entry + 78;
  ASSERT_EQ(file.substr(config + 4, 4), "avcC");
  const std::size_t sps = number(file, config + 8 + 6, 2), pps_at = config + 8 + 8 + sps + 1;
  const std::string start = std::string("\0\0\0\1", 4) + file.substr(config + 16, sps) +
                            std::string("\0\0\0\1", 4) +
                            file.substr(pps_at + 2, number(file, pps_at, 2));

  const auto frames = played(file, at("mdat"), sizes, start);
  ASSERT_EQ(frames.size(), kFrames);
  for (std::size_t f = 0; f < kFrames; ++f) {
    // BT.709, 16..235.
    const double r = 4.0 * static_cast<double>(f) / 255, g = 100.0 / 255,
                 b = (240 - 3.0 * static_cast<double>(f)) / 255;
    const double y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    EXPECT_NEAR(frames[f][0], 16 + 219 * y, 2) << f;
    EXPECT_NEAR(frames[f][1], 128 + 224 * (b - y) / 1.8556, 2) << f;
    EXPECT_NEAR(frames[f][2], 128 + 224 * (r - y) / 1.5748, 2) << f;
  }
}

TEST(Mp4, WrongSizesAreToldInASentence) {
  for (const auto& [w, h] : {std::pair<std::size_t, std::size_t>{8, 100}, {100, 8}, {8000, 100}}) {
    const auto made = Mp4Writer::create(w, h, 25);
    ASSERT_FALSE(made.ok());
    EXPECT_NE(made.error().sentence().find("pixels"), std::string::npos);
  }
}

}  // namespace
}  // namespace robomosp::scene
#endif
