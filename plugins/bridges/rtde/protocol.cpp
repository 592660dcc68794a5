// SPDX-License-Identifier: Apache-2.0
#include "protocol.h"

#include <array>
#include <bit>
#include <utility>

namespace robomosp::bridges::rtde {
namespace {

struct TypeRow {
  std::string_view name;
  Type type;
  std::size_t entries, bytes;  ///< bytes of one entry
};
constexpr std::array<TypeRow, 10> kTypes{{{"BOOL", Type::boolean, 1, 1},
                                          {"UINT8", Type::uint8, 1, 1},
                                          {"UINT32", Type::uint32, 1, 4},
                                          {"UINT64", Type::uint64, 1, 8},
                                          {"INT32", Type::int32, 1, 4},
                                          {"DOUBLE", Type::number, 1, 8},
                                          {"VECTOR3D", Type::vector3, 3, 8},
                                          {"VECTOR6D", Type::vector6, 6, 8},
                                          {"VECTOR6INT32", Type::vector6_int32, 6, 4},
                                          {"VECTOR6UINT32", Type::vector6_uint32, 6, 4}}};

const TypeRow& row(Type t) {
  for (const TypeRow& r : kTypes)
    if (r.type == t) return r;
  return kTypes[0];
}

constexpr std::size_t kHeader = 3;

void put(std::string& out, std::uint64_t v, std::size_t bytes) {
  for (std::size_t i = bytes; i-- > 0;) out += static_cast<char>((v >> (8 * i)) & 0xFFU);
}
std::uint64_t take(std::string_view in, std::size_t at, std::size_t bytes) {
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < bytes; ++i) v = (v << 8U) | static_cast<unsigned char>(in[at + i]);
  return v;
}

double entry(std::string_view in, std::size_t at, Type t) {
  const std::uint64_t bits = take(in, at, row(t).bytes);
  switch (t) {
    case Type::boolean: return bits != 0 ? 1 : 0;
    case Type::number:
    case Type::vector3:
    case Type::vector6: return std::bit_cast<double>(bits);
    case Type::int32:
    case Type::vector6_int32:
      return static_cast<double>(static_cast<std::int32_t>(static_cast<std::uint32_t>(bits)));
    case Type::uint8:
    case Type::uint32:
    case Type::uint64:
    case Type::vector6_uint32: break;
  }
  return static_cast<double>(bits);
}

}  // namespace

std::optional<Type> type_named(std::string_view name) {
  for (const TypeRow& r : kTypes)
    if (r.name == name) return r.type;
  return std::nullopt;
}
std::size_t entries_of(Type t) { return row(t).entries; }
std::size_t bytes_of(Type t) { return row(t).entries * row(t).bytes; }

std::string package(Package kind, std::string_view content) {
  std::string out;
  put(out, content.size() + kHeader, 2);
  out += static_cast<char>(kind);
  out += content;
  return out;
}
std::string request_version() {
  std::string content;
  put(content, kVersion, 2);
  return package(Package::protocol_version, content);
}
std::string request_outputs(double frequency, const std::vector<std::string>& names) {
  std::string content;
  put(content, std::bit_cast<std::uint64_t>(frequency), 8);
  for (std::size_t i = 0; i < names.size(); ++i) content += (i > 0 ? "," : "") + names[i];
  return package(Package::setup_outputs, content);
}

void Reader::add(std::string_view bytes) {
  bytes_.erase(0, at_);
  at_ = 0;
  bytes_ += bytes;
}

std::optional<Reader::Found> Reader::next() {
  if (is_broken_ || bytes_.size() - at_ < kHeader) return std::nullopt;
  const auto size = static_cast<std::size_t>(take(bytes_, at_, 2));
  if (size < kHeader) {
    is_broken_ = true;
    return std::nullopt;
  }
  if (bytes_.size() - at_ < size) return std::nullopt;
  Found out;
  out.kind = static_cast<std::uint8_t>(bytes_[at_ + 2]);
  out.content = std::string_view(bytes_).substr(at_ + kHeader, size - kHeader);
  at_ += size;
  return out;
}

std::optional<bool> accepted(std::string_view content) {
  if (content.size() != 1) return std::nullopt;
  return content[0] != 0;
}

std::optional<Recipe> recipe(std::string_view content) {
  if (content.empty()) return std::nullopt;
  Recipe out;
  out.number = static_cast<std::uint8_t>(content[0]);
  std::string word;
  for (const char c : content.substr(1)) {
    if (c == ',') out.types.push_back(std::exchange(word, {}));
    else word += c;
  }
  out.types.push_back(word);
  return out;
}

std::optional<std::string> controller_version(std::string_view content) {
  if (content.size() != 16) return std::nullopt;
  const auto n = [&](std::size_t i) { return std::to_string(take(content, 4 * i, 4)); };
  return n(0) + "." + n(1) + "." + n(2) + " (" + n(3) + ")";
}

std::optional<std::string> text_message(std::string_view content) {
  if (content.empty()) return std::nullopt;
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>(content[0]));
  if (content.size() < 1 + length) return std::nullopt;
  return std::string(content.substr(1, length));
}

std::optional<std::vector<double>> data(std::string_view content, std::uint8_t recipe,
                                        std::span<const Type> types) {
  std::size_t size = 1;
  for (const Type t : types) size += bytes_of(t);
  if (content.size() != size || static_cast<std::uint8_t>(content[0]) != recipe)
    return std::nullopt;
  std::vector<double> out;
  std::size_t at = 1;
  for (const Type t : types)
    for (std::size_t i = 0; i < entries_of(t); ++i, at += row(t).bytes)
      out.push_back(entry(content, at, t));
  return out;
}

}  // namespace robomosp::bridges::rtde
