// SPDX-License-Identifier: Apache-2.0
// Messages between this program and robomosp-importer, which reads a foreign file in a separate
// process: a request and its reply in native byte order (layer: core, header-only). Both ends are
// of the same build; truncated or oversized messages are rejected.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::import_wire {

inline constexpr std::string_view kMark = "robomosp import 1\n";

/// A parameter, as the functions of Params return it.
struct Parameter {
  double real = 0;
  std::int64_t integer = 0;
  std::uint8_t boolean = 0;
  std::string text;
  std::vector<double> reals;
  Pose pose;
};
struct Request {
  std::string plugin, provider, path;
  std::map<std::string, Parameter> params;
};
struct Answer {
  bool is_ok = false;
  Error fault;  ///< if the import failed
  Imported imported;
};

/// Writes or reads the same fields in the same order: io(value) for each.
class Writer {
 public:
  explicit Writer(std::string& out) : out_(out) {}
  static constexpr bool is_reader = false;
  template <class T>
  void plain(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    out_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  std::uint64_t size(std::uint64_t n) {
    plain(n);
    return n;
  }
  void bytes(std::string& s) {
    size(s.size());
    out_ += s;
  }
  template <class T>
  void numbers(std::vector<T>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    size(v.size());
    out_.append(reinterpret_cast<const char*>(v.data()), v.size() * sizeof(T));
  }

 private:
  std::string& out_;
};
class Reader {
 public:
  explicit Reader(std::string_view in) : in_(in) {}
  static constexpr bool is_reader = true;
  template <class T>
  void plain(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (take(sizeof value)) std::memcpy(&value, taken_.data(), sizeof value);
  }
  /// Size of a list with elements of at least one byte each.
  std::uint64_t size(std::uint64_t) {
    std::uint64_t n = 0;
    plain(n);
    if (n > in_.size()) is_broken_ = true;
    return is_broken_ ? 0 : n;
  }
  void bytes(std::string& s) {
    if (take(size(0))) s = taken_;
  }
  template <class T>
  void numbers(std::vector<T>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::uint64_t n = size(0);
    if (n > in_.size() / sizeof(T)) is_broken_ = true;
    if (!take(is_broken_ ? 0 : n * sizeof(T))) return;
    v.resize(n);
    if (n) std::memcpy(v.data(), taken_.data(), taken_.size());
  }
  [[nodiscard]] bool is_whole() const { return !is_broken_ && in_.empty(); }

 private:
  bool take(std::uint64_t n) {
    if (is_broken_ || n > in_.size()) return is_broken_ = true, false;
    taken_ = in_.substr(0, n);
    in_.remove_prefix(n);
    return true;
  }
  std::string_view in_, taken_;
  bool is_broken_ = false;
};

template <class V, class T, class Each>
void list(V& v, std::vector<T>& all, const Each& each) {
  const std::uint64_t n = v.size(all.size());
  if constexpr (V::is_reader) {
    for (std::uint64_t i = 0; i < n; ++i) each(all.emplace_back());
  } else {
    for (T& one : all) each(one);
  }
}

template <class V>
void fields(V& v, Request& r) {
  v.bytes(r.plugin);
  v.bytes(r.provider);
  v.bytes(r.path);
  std::vector<std::pair<std::string, Parameter>> params(r.params.begin(), r.params.end());
  list(v, params, [&](auto& p) {
    v.bytes(p.first);
    v.plain(p.second.real);
    v.plain(p.second.integer);
    v.plain(p.second.boolean);
    v.bytes(p.second.text);
    v.numbers(p.second.reals);
    v.plain(p.second.pose);
  });
  if constexpr (V::is_reader) r.params = {params.begin(), params.end()};
}

template <class V>
void fields(V& v, Answer& a) {
  std::uint8_t is_ok = a.is_ok;
  v.plain(is_ok);
  a.is_ok = is_ok != 0;
  v.plain(a.fault.code);
  v.bytes(a.fault.message);
  v.bytes(a.fault.where);
  v.bytes(a.fault.hint);
  Imported& i = a.imported;
  list(v, i.records, [&](ImportedFile& f) {
    v.bytes(f.name);
    v.bytes(f.text);
  });
  list(v, i.geometries, [&](ImportedGeometry& g) {
    v.bytes(g.name);
    v.plain(g.geometry.form);
    v.bytes(g.geometry.brep);
    v.numbers(g.geometry.points);
    v.numbers(g.geometry.triangles);
    v.plain(g.geometry.digest);
    v.bytes(g.geometry.source);
    v.plain(g.geometry.deviation);
  });
  list(v, i.notes, [&](std::string& note) { v.bytes(note); });
  list(v, i.profile.loops, [&](CsgLoop& loop) {
    v.plain(loop.start);
    list(v, loop.curves, [&](CsgCurve& curve) {
      v.plain(curve.kind);
      v.numbers(curve.points);
    });
  });
  list(v, i.foreign, [&](ForeignGeometry& f) {
    v.bytes(f.name);
    v.bytes(f.path);
    v.plain(f.scale);
    v.bytes(f.unit);
  });
}

template <class T>
[[nodiscard]] std::string encode(T value) {
  std::string out(kMark);
  Writer writer(out);
  fields(writer, value);
  return out;
}
/// False if the bytes are incomplete or too many.
template <class T>
[[nodiscard]] bool decode(std::string_view in, T& value) {
  if (in.substr(0, kMark.size()) != kMark) return false;
  Reader reader(in.substr(kMark.size()));
  fields(reader, value);
  return reader.is_whole();
}

}  // namespace robomosp::import_wire
