// SPDX-License-Identifier: Apache-2.0
#include "scene/mp4.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#if ROBOMOSP_HAS_OPENH264
#include <wels/codec_api.h>
#endif

namespace robomosp::scene {

#if ROBOMOSP_HAS_OPENH264
namespace {

constexpr std::size_t kWidest = 3840, kHighest = 2160;  ///< that the encoder takes
constexpr int kQuantizer = 20;  ///< of 0..51: no difference to the eye, a tenth of the size
constexpr std::uint32_t kTicks = 90000;  ///< in a second

/// The two doors of the library.
struct Library {
  int (*create)(ISVCEncoder**) = nullptr;
  void (*destroy)(ISVCEncoder*) = nullptr;
};

/// Opened once and kept; empty where the system has none.
const Library& library() {
  static const Library found = [] {
    Library l;
    void* handle = dlopen("libopenh264.so.7", RTLD_NOW | RTLD_LOCAL);
    if (!handle) return l;
    l.create = reinterpret_cast<int (*)(ISVCEncoder**)>(dlsym(handle, "WelsCreateSVCEncoder"));
    l.destroy = reinterpret_cast<void (*)(ISVCEncoder*)>(dlsym(handle, "WelsDestroySVCEncoder"));
    return l;
  }();
  return found;
}

/// A box of the container: its length, its name, what is in it. All numbers are big-endian.
class Box {
 public:
  explicit Box(const char* name) { bytes_ = std::string(4, '\0') + name; }
  Box& u8(std::uint32_t v) { return number(v, 1); }
  Box& u16(std::uint32_t v) { return number(v, 2); }
  Box& u32(std::uint32_t v) { return number(v, 4); }
  Box& u64(std::uint64_t v) { return number(v, 8); }
  Box& text(const std::string& s) {
    bytes_ += s;
    return *this;
  }
  Box& zeros(std::size_t n) {
    bytes_.append(n, '\0');
    return *this;
  }
  /// The turn and place of a picture: none.
  Box& matrix() {
    for (const std::uint32_t v : {0x10000U, 0U, 0U, 0U, 0x10000U, 0U, 0U, 0U, 0x40000000U}) u32(v);
    return *this;
  }
  Box& add(const Box& inner) { return text(inner.str()); }
  [[nodiscard]] std::string str() const {
    std::string out = bytes_;
    for (std::size_t i = 0; i < 4; ++i)
      out[i] = static_cast<char>(out.size() >> (8 * (3 - i)) & 0xFFU);
    return out;
  }

 private:
  Box& number(std::uint64_t v, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) bytes_ += static_cast<char>(v >> (8 * i) & 0xFFU);
    return *this;
  }
  std::string bytes_;
};

/// BT.709 in the range of video, as players take pictures of this size.
struct Planes {
  std::size_t width, height;  // even
  std::vector<std::uint8_t> y, u, v;

  void take(std::span<const std::uint8_t> rgba, std::size_t w, std::size_t h) {
    const auto at = [&](std::size_t px, std::size_t py) {
      const std::size_t i = 4 * (std::min(py, h - 1) * w + std::min(px, w - 1));
      return std::array<double, 3>{double(rgba[i]), double(rgba[i + 1]), double(rgba[i + 2])};
    };
    const auto byte = [](double value) {
      return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
    };
    for (std::size_t py = 0; py < height; py += 2)
      for (std::size_t px = 0; px < width; px += 2) {
        std::array<double, 3> mean{};
        for (const std::size_t dy : {0U, 1U})
          for (const std::size_t dx : {0U, 1U}) {
            const auto c = at(px + dx, py + dy);
            for (std::size_t k = 0; k < 3; ++k) mean[k] += 0.25 * c[k];
            y[(py + dy) * width + px + dx] =
                byte(16 + 0.1826 * c[0] + 0.6142 * c[1] + 0.0620 * c[2]);
          }
        const std::size_t i = py / 2 * (width / 2) + px / 2;
        u[i] = byte(128 - 0.1006 * mean[0] - 0.3386 * mean[1] + 0.4392 * mean[2]);
        v[i] = byte(128 + 0.4392 * mean[0] - 0.3989 * mean[1] - 0.0403 * mean[2]);
      }
  }
};

Error failed(const char* what) {
  return error(ErrorCode::plugin_failed, std::string("the encoder of MP4 films ") + what,
               "Write a *.gif instead, or the frames, and report it.", "file");
}

}  // namespace

struct Mp4Writer::Impl {
  std::size_t width = 0, height = 0;
  double fps = 25;
  Planes planes;
  ISVCEncoder* encoder = nullptr;
  std::string sps, pps;              // what a decoder must know, once
  std::string data;                  // units of all frames, each behind its length
  std::vector<std::uint32_t> sizes;  // of each frame [bytes]
  std::vector<std::uint32_t> keys;   // frames that stand alone, from 1

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (!encoder) return;
    encoder->Uninitialize();
    library().destroy(encoder);
  }

  Result<void> open();
  [[nodiscard]] std::string file() const;
  [[nodiscard]] Box sample_table(std::uint32_t ticks, std::uint32_t offset) const;
};

Result<void> Mp4Writer::Impl::open() {
  if (library().create(&encoder) != 0 || !encoder) return failed("does not start");
  int quiet = WELS_LOG_QUIET;
  encoder->SetOption(ENCODER_OPTION_TRACE_LEVEL, &quiet);
  SEncParamExt p;
  encoder->GetDefaultParams(&p);
  p.iUsageType = SCREEN_CONTENT_REAL_TIME;
  p.iPicWidth = static_cast<int>(planes.width);
  p.iPicHeight = static_cast<int>(planes.height);
  p.fMaxFrameRate = static_cast<float>(std::clamp(fps, 1.0, 60.0));
  p.iRCMode = RC_OFF_MODE;  // one quality, whatever it takes
  p.iMultipleThreadIdc = 1;
  p.uiIntraPeriod = static_cast<unsigned>(std::max(1.0, std::round(2 * fps)));
  p.eSpsPpsIdStrategy = CONSTANT_ID;
  p.bEnableFrameSkip = false;
  p.bEnableAdaptiveQuant = p.bEnableBackgroundDetection = p.bEnableDenoise = false;
  p.bEnableSceneChangeDetect = true;  // which this usage asks for
  SSpatialLayerConfig& layer = p.sSpatialLayers[0];
  layer.iVideoWidth = p.iPicWidth;
  layer.iVideoHeight = p.iPicHeight;
  layer.fFrameRate = p.fMaxFrameRate;
  layer.iDLayerQp = kQuantizer;
  layer.uiProfileIdc = PRO_BASELINE;
  layer.bVideoSignalTypePresent = layer.bColorDescriptionPresent = true;
  layer.bFullRange = false;
  layer.uiColorPrimaries = CP_BT709;
  layer.uiTransferCharacteristics = TRC_BT709;
  layer.uiColorMatrix = CM_BT709;
  if (encoder->InitializeExt(&p) != cmResultSuccess) return failed("does not take this size");
  return {};
}

Box Mp4Writer::Impl::sample_table(std::uint32_t ticks, std::uint32_t offset) const {
  const auto count = static_cast<std::uint32_t>(sizes.size());
  const auto byte = [](char c) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(c));
  };
  Box config("avcC");
  config.u8(1).u8(byte(sps[1])).u8(byte(sps[2])).u8(byte(sps[3])).u8(0xFF).u8(0xE1);
  config.u16(static_cast<std::uint32_t>(sps.size())).text(sps);
  config.u8(1).u16(static_cast<std::uint32_t>(pps.size())).text(pps);
  Box picture("avc1");
  picture.zeros(6).u16(1).zeros(16);
  picture.u16(static_cast<std::uint32_t>(planes.width));
  picture.u16(static_cast<std::uint32_t>(planes.height));
  picture.u32(0x480000).u32(0x480000).u32(0).u16(1).zeros(32).u16(24).u16(0xFFFF).add(config);
  Box colour("colr");
  picture.add(colour.text("nclx").u16(1).u16(1).u16(1).u8(0));
  Box stsd("stsd"), stts("stts"), stss("stss"), stsc("stsc"), stsz("stsz"), stco("stco");
  stsd.u32(0).u32(1).add(picture);
  stts.u32(0).u32(1).u32(count).u32(ticks);
  stss.u32(0).u32(static_cast<std::uint32_t>(keys.size()));
  for (const std::uint32_t k : keys) stss.u32(k);
  stsc.u32(0).u32(1).u32(1).u32(count).u32(1);  // all frames in one run
  stsz.u32(0).u32(0).u32(count);
  for (const std::uint32_t s : sizes) stsz.u32(s);
  stco.u32(0).u32(1).u32(offset);
  Box table("stbl");
  return table.add(stsd).add(stts).add(stss).add(stsc).add(stsz).add(stco);
}

std::string Mp4Writer::Impl::file() const {
  const auto ticks = static_cast<std::uint32_t>(std::lround(kTicks / fps));
  const std::uint64_t duration = std::uint64_t{ticks} * sizes.size();
  Box kind("ftyp");
  kind.text("isom").u32(512).text("isomiso2avc1mp41");
  // What comes before the frames tells where they begin: its length does not depend on that.
  const auto movie = [&](std::uint32_t offset) {
    Box mvhd("mvhd");
    mvhd.u32(0x01000000).u64(0).u64(0).u32(kTicks).u64(duration).u32(0x10000).u16(0x100).zeros(10);
    mvhd.matrix().zeros(24).u32(2);
    Box tkhd("tkhd");
    tkhd.u32(0x01000003).u64(0).u64(0).u32(1).u32(0).u64(duration).zeros(16).matrix();
    tkhd.u32(static_cast<std::uint32_t>(planes.width << 16));
    tkhd.u32(static_cast<std::uint32_t>(planes.height << 16));
    Box mdhd("mdhd");
    mdhd.u32(0x01000000).u64(0).u64(0).u32(kTicks).u64(duration).u16(0x55C4).u16(0);
    Box hdlr("hdlr");
    hdlr.u32(0).u32(0).text("vide").zeros(12).text(std::string("film", 5));
    Box vmhd("vmhd"), url("url "), dref("dref"), dinf("dinf"), minf("minf"), mdia("mdia");
    vmhd.u32(1).zeros(8);
    dref.u32(0).u32(1).add(url.u32(1));
    minf.add(vmhd).add(dinf.add(dref)).add(sample_table(ticks, offset));
    mdia.add(mdhd).add(hdlr).add(minf);
    Box trak("trak"), moov("moov");
    return moov.add(mvhd).add(trak.add(tkhd).add(mdia)).str();
  };
  const std::string head = kind.str();
  const std::size_t before = head.size() + movie(0).size() + 8;
  Box frames("mdat");
  return head + movie(static_cast<std::uint32_t>(before)) + frames.text(data).str();
}

Result<Mp4Writer> Mp4Writer::create(std::size_t width, std::size_t height, double fps) {
  if (width < 16 || height < 16 || std::max(width, height) > kWidest ||
      std::min(width, height) > kHighest)
    return error(ErrorCode::invalid_argument,
                 "an MP4 film of " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels cannot be made",
                 "Give 16 to 3840 x 2160 pixels.", "size");
  if (!library().create || !library().destroy)
    return error(ErrorCode::unsupported,
                 "MP4 films need the library OpenH264, which is not installed",
                 "Install it (Debian's package libopenh264-7), or give a file *.gif, or frames, a "
                 "folder for PNG files.",
                 "file");
  auto impl = std::make_unique<Impl>();
  impl->width = width;
  impl->height = height;
  impl->fps = fps;
  Planes& planes = impl->planes;
  planes.width = width + width % 2;
  planes.height = height + height % 2;
  planes.y.resize(planes.width * planes.height);
  planes.u.resize(planes.y.size() / 4);
  planes.v.resize(planes.y.size() / 4);
  RMP_TRY(impl->open());
  return Mp4Writer(std::move(impl));
}

Result<void> Mp4Writer::add(std::span<const std::uint8_t> rgba) {
  Impl& m = *impl_;
  if (rgba.size() != 4 * m.width * m.height)
    return failed("received a picture of a different size");
  m.planes.take(rgba, m.width, m.height);
  SSourcePicture picture{};
  picture.iColorFormat = videoFormatI420;
  picture.iPicWidth = static_cast<int>(m.planes.width);
  picture.iPicHeight = static_cast<int>(m.planes.height);
  picture.iStride[0] = picture.iPicWidth;
  picture.iStride[1] = picture.iStride[2] = picture.iPicWidth / 2;
  picture.pData[0] = m.planes.y.data();
  picture.pData[1] = m.planes.u.data();
  picture.pData[2] = m.planes.v.data();
  picture.uiTimeStamp =
      std::llround(1000 * static_cast<double>(m.sizes.size()) / m.fps);  // [ms], grows
  SFrameBSInfo out{};
  if (m.encoder->EncodeFrame(&picture, &out) != cmResultSuccess ||
      out.eFrameType == videoFrameTypeSkip)
    return failed("dropped a frame");
  const std::size_t before = m.data.size();
  for (int l = 0; l < out.iLayerNum; ++l) {
    const SLayerBSInfo& layer = out.sLayerInfo[l];
    const unsigned char* at = layer.pBsBuf;
    for (int n = 0; n < layer.iNalCount; ++n) {
      const int length = layer.pNalLengthInByte[n];
      // Behind a start code of zeros and a one: 4 bytes, or 3.
      const int code = at[2] == 1 ? 3 : 4;
      const std::string unit(reinterpret_cast<const char*>(at) + code,
                             static_cast<std::size_t>(length - code));
      const int type = unit[0] & 0x1F;
      if (type == 7) m.sps = unit;
      else if (type == 8) m.pps = unit;
      else {
        for (int k = 3; k >= 0; --k) m.data += static_cast<char>(unit.size() >> (8 * k) & 0xFFU);
        m.data += unit;
      }
      at += length;
    }
  }
  m.sizes.push_back(static_cast<std::uint32_t>(m.data.size() - before));
  if (out.eFrameType == videoFrameTypeIDR)
    m.keys.push_back(static_cast<std::uint32_t>(m.sizes.size()));
  if (m.data.size() > 0xF0000000U)
    return error(ErrorCode::unsupported, "the film has more than 4 GB",
                 "Make it smaller or shorter.", "file");
  return {};
}

Result<std::string> Mp4Writer::finish() {
  if (impl_->sizes.empty() || impl_->sps.size() < 4 || impl_->pps.empty())
    return failed("wrote no frame");
  return impl_->file();
}

#else  // built without the library's headers

struct Mp4Writer::Impl {};
Result<Mp4Writer> Mp4Writer::create(std::size_t, std::size_t, double) {
  return error(ErrorCode::unsupported,
               "this program was built without the library OpenH264, so it cannot write MP4 films",
               "Give a file *.gif, or frames, a folder for PNG files.", "file");
}
Result<void> Mp4Writer::add(std::span<const std::uint8_t>) { return {}; }
Result<std::string> Mp4Writer::finish() { return std::string(); }

#endif

Mp4Writer::Mp4Writer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Mp4Writer::Mp4Writer(Mp4Writer&&) noexcept = default;
Mp4Writer& Mp4Writer::operator=(Mp4Writer&&) noexcept = default;
Mp4Writer::~Mp4Writer() = default;

}  // namespace robomosp::scene
