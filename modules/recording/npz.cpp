// SPDX-License-Identifier: Apache-2.0
// Arrays of NumPy in a zip archive without compression: numpy.lib.format 1.0, and PKWARE's APPNOTE
// 6.3 without its extensions.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "kernel/text.h"
#include "recording/file.h"

namespace robomosp::recording {
namespace {

template <class Integer>
void put(std::string& out, Integer v) {  // little-endian
  for (std::size_t i = 0; i < sizeof v; ++i) out += static_cast<char>(v >> (8 * i) & 0xff);
}

/// CRC-32 of zip: polynomial 0x04c11db7, bits reversed.
std::uint32_t crc32(std::string_view bytes) {
  static const auto kTable = [] {
    std::array<std::uint32_t, 256> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      t[i] = i;
      for (int k = 0; k < 8; ++k) t[i] = t[i] >> 1 ^ (t[i] & 1U ? 0xedb88320U : 0U);
    }
    return t;
  }();
  std::uint32_t c = ~0U;
  for (const char b : bytes) c = c >> 8 ^ kTable[(c ^ static_cast<unsigned char>(b)) & 0xff];
  return ~c;
}

/// The start of a .npy: magic, version, and the description padded to 64 bytes.
std::string array_head(const std::string& type, const std::string& shape) {
  std::string about = "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  while ((10 + about.size() + 1) % 64 != 0) about += ' ';
  about += '\n';
  std::string out("\x93NUMPY\x01\x00", 8);
  put(out, static_cast<std::uint16_t>(about.size()));
  return out + about;
}

std::string numbers(const std::vector<double>& values) {
  std::string out = array_head("<f8", "(" + std::to_string(values.size()) + ",)");
  out.reserve(out.size() + 8 * values.size());
  for (const double v : values) put(out, std::bit_cast<std::uint64_t>(v));
  return out;
}

/// UTF-8 as code points; a byte that is none stands for itself.
std::u32string code_points(const std::string& s) {
  std::u32string out;
  for (std::size_t i = 0; i < s.size();) {
    const auto b = static_cast<unsigned char>(s[i]);
    const std::size_t more = b >= 0xf0 ? 3 : b >= 0xe0 ? 2 : b >= 0xc0 ? 1 : 0;
    char32_t c = more == 3 ? b & 0x07U : more == 2 ? b & 0x0fU : more == 1 ? b & 0x1fU : b;
    for (std::size_t k = 1; k <= more; ++k)
      c = c << 6 | (i + k < s.size() ? static_cast<unsigned char>(s[i + k]) & 0x3fU : 0U);
    out += c;
    i += 1 + more;
  }
  return out;
}

std::string texts(const std::vector<std::string>& words, bool is_one) {
  std::vector<std::u32string> points;
  std::size_t width = 1;
  for (const std::string& w : words) {
    points.push_back(code_points(w));
    width = std::max(width, points.back().size());
  }
  std::string out = array_head("<U" + std::to_string(width),
                               is_one ? "()" : "(" + std::to_string(words.size()) + ",)");
  for (std::u32string& p : points) {
    p.resize(width, U'\0');
    for (const char32_t c : p) put(out, static_cast<std::uint32_t>(c));
  }
  return out;
}

class Zip {
 public:
  void add(const std::string& name, const std::string& bytes) {
    // Version 2.0, names in UTF-8, stored, 1980-01-01 00:00 so that equal recordings give equal
    // files.
    std::string common;
    put(common, std::uint16_t{20});
    put(common, std::uint16_t{0x0800});
    put(common, std::uint16_t{0});
    put(common, std::uint32_t{0x00210000});
    put(common, crc32(bytes));
    put(common, static_cast<std::uint32_t>(bytes.size()));
    put(common, static_cast<std::uint32_t>(bytes.size()));
    put(common, static_cast<std::uint16_t>(name.size()));
    put(common, std::uint16_t{0});
    directory_ += std::string("PK\x01\x02\x14\x00", 6) + common;
    directory_ += std::string(10, '\0');  // no comment, first disk, no attributes
    put(directory_, static_cast<std::uint32_t>(out_.size()));
    directory_ += name;
    out_ += std::string("PK\x03\x04", 4) + common + name + bytes;
    ++count_;
  }
  [[nodiscard]] std::string finish() && {
    std::string end("PK\x05\x06\x00\x00\x00\x00", 8);
    put(end, count_);
    put(end, count_);
    put(end, static_cast<std::uint32_t>(directory_.size()));
    put(end, static_cast<std::uint32_t>(out_.size()));
    put(end, std::uint16_t{0});
    return out_ + directory_ + end;
  }

 private:
  std::string out_, directory_;
  std::uint16_t count_ = 0;
};

}  // namespace

Result<std::string> to_npz(const Recording& r) {
  constexpr double kMostBytes = 4e9;  // what 32 bits can address
  constexpr std::size_t kMostFiles = 65000;
  if (8.0 * static_cast<double>(r.rows()) * static_cast<double>(r.columns.size()) > kMostBytes ||
      r.columns.size() > kMostFiles)
    return error(ErrorCode::unsupported, "the recording is too large for an .npz file",
                 "Save fewer columns or rows, or as .rec.");
  std::vector<std::string> names, units, docs;
  Zip zip;
  for (const Column& c : r.columns) {
    names.push_back(c.name);
    units.push_back(c.unit);
    docs.push_back(c.doc);
    std::string file = c.name;
    std::replace(file.begin(), file.end(), '/', '_');
    zip.add(file + ".npy", numbers(c.values));
  }
  const auto add_texts = [&](const std::string& name, const std::vector<std::string>& words,
                             bool is_one = false) {
    if (!r.find(name)) zip.add(name + ".npy", texts(words, is_one));
  };
  add_texts("columns", names);
  add_texts("units", units);
  add_texts("docs", docs);
  add_texts("title", {r.title}, true);
  return std::move(zip).finish();
}

}  // namespace robomosp::recording
