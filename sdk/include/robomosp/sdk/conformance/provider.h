// SPDX-License-Identifier: Apache-2.0
// Loads one plugin file for a test and fills its parameter tables with their defaults
// (layer: contract helper for tests, header-only, POSIX). The program's own loader does far more
// checks; a conformance test only needs the provider.
#pragma once

#include <dlfcn.h>
#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/threads.h>

namespace robomosp::conformance {

/// Params with the defaults of a provider's table; values may be set as text.
class TableParams final : public Params {
 public:
  TableParams() = default;
  explicit TableParams(const rmp_provider& provider) {
    for (std::uint32_t i = 0; i < provider.param_count; ++i) {
      const rmp_param row = rmp_param_at(provider, i);
      if (!row.default_text) continue;
      const std::string_view type = row.type ? row.type : "";
      const bool is_number = type == "real" || type == "real[]" || type == "int";
      set(row.name, is_number ? si_text(row.default_text) : std::string(row.default_text));
    }
  }
  /// "5 mm" as the host reads it: "0.005". Units of length, angle, time, mass, force and what is
  /// made of them by / and ^; what is none of them stays as it is.
  static std::string si_text(const std::string& text);
  TableParams& set(std::string name, std::string text) {
    Entry& e = values_[std::move(name)];
    e.text = std::move(text);
    e.number = 0;
    std::from_chars(e.text.data(), e.text.data() + e.text.size(), e.number);
    e.list.clear();  // "{0, 0, 1}"
    for (const char *at = e.text.data() + 1, *end = at + e.text.size() - 1;
         e.text.starts_with('{') && at < end; ++at) {
      double value = 0;
      const auto read = std::from_chars(at, end, value);
      if (read.ec != std::errc()) continue;
      e.list.push_back(value);
      at = read.ptr - 1;
    }
    return *this;
  }
  TableParams& set(std::string name, double value) {
    char text[64];
    return set(std::move(name),
               std::string(text, std::to_chars(text, text + sizeof text, value).ptr));
  }
  bool has(std::string_view name) const override { return find(name) != nullptr; }
  double real(std::string_view name) const override {
    const Entry* e = find(name);
    return e ? e->number : 0.0;
  }
  long long integer(std::string_view name) const override {
    return static_cast<long long>(real(name));
  }
  bool boolean(std::string_view name) const override { return text(name) == "true"; }
  std::string_view text(std::string_view name) const override {
    const Entry* e = find(name);
    return e ? std::string_view(e->text) : std::string_view();
  }
  std::span<const double> reals(std::string_view name) const override {
    const Entry* e = find(name);
    return e ? std::span<const double>(e->list) : std::span<const double>();
  }
  Pose pose(std::string_view) const override { return {}; }

 private:
  struct Entry {
    std::string text;
    double number = 0;
    std::vector<double> list;
  };
  const Entry* find(std::string_view name) const {
    const auto it = values_.find(name);
    return it == values_.end() ? nullptr : &it->second;
  }
  std::map<std::string, Entry, std::less<>> values_;
};

namespace detail {
/// The factor of a unit such as "mm", "deg/s" or "kg/m^3" to SI; NaN = not known here.
inline double unit_factor(std::string_view unit) {
  struct Row {
    std::string_view name;
    double factor;
  };
  constexpr double kDegree = 0.017453292519943295;
  static constexpr Row kUnits[] = {{"", 1},
                                   {"1", 1},
                                   {"m", 1},
                                   {"mm", 1e-3},
                                   {"cm", 1e-2},
                                   {"km", 1e3},
                                   {"um", 1e-6},
                                   {"in", 0.0254},
                                   {"ft", 0.3048},
                                   {"rad", 1},
                                   {"deg", kDegree},
                                   {"turn", 360 * kDegree},
                                   {"s", 1},
                                   {"ms", 1e-3},
                                   {"us", 1e-6},
                                   {"min", 60},
                                   {"h", 3600},
                                   {"kg", 1},
                                   {"g", 1e-3},
                                   {"t", 1e3},
                                   {"N", 1},
                                   {"kN", 1e3},
                                   {"Nm", 1},
                                   {"J", 1},
                                   {"W", 1},
                                   {"Pa", 1},
                                   {"kPa", 1e3},
                                   {"MPa", 1e6},
                                   {"Hz", 1},
                                   {"kHz", 1e3},
                                   {"rpm", 6 * kDegree},
                                   {"%", 1e-2}};
  double product = 1;
  bool divides = false;
  for (std::size_t at = 0; at <= unit.size();) {
    std::size_t end = unit.find_first_of("/ *", at);
    if (end == std::string_view::npos) end = unit.size();
    std::string_view word = unit.substr(at, end - at);
    int power = 1;
    if (const std::size_t hat = word.find('^'); hat != std::string_view::npos) {
      power = word.size() > hat + 1 ? word[hat + 1] - '0' : 0;
      word = word.substr(0, hat);
      if (power < 1 || power > 9) return std::nan("");
    }
    double factor = std::nan("");
    for (const Row& row : kUnits)
      if (row.name == word) factor = row.factor;
    for (int i = 0; i < power; ++i) product = divides ? product / factor : product * factor;
    if (end < unit.size()) divides = unit[end] == '/';
    at = end + 1;
  }
  return product;
}
}  // namespace detail

inline std::string TableParams::si_text(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {  // numbers of a list, each with its unit
    const std::size_t number = text.find_first_of("+-.0123456789", at);
    double value = 0;
    const char* from = text.data() + std::min(number, text.size());
    const auto read =
        std::from_chars(from + (*from == '+' ? 1 : 0), text.data() + text.size(), value);
    if (number == std::string::npos || read.ec != std::errc()) return out + text.substr(at);
    out += text.substr(at, number - at);
    std::size_t end = static_cast<std::size_t>(read.ptr - text.data());
    const std::size_t unit_end = std::min(text.find_first_of(",}", end), text.size());
    std::string_view unit = std::string_view(text).substr(end, unit_end - end);
    while (!unit.empty() && unit.front() == ' ') unit.remove_prefix(1);
    while (!unit.empty() && unit.back() == ' ') unit.remove_suffix(1);
    const double factor = detail::unit_factor(unit);
    if (std::isnan(factor)) return text;  // the host would refuse the table
    char shown[64];
    out += std::string(shown, std::to_chars(shown, shown + sizeof shown, value * factor).ptr);
    at = unit_end;
  }
  return out;
}

/// The provider `name` of `Interface` in a plugin file; an error names what is missing.
template <class Interface>
Result<const rmp_provider*> find_provider(const std::string& file, const std::string& name) {
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!library) return error(ErrorCode::plugin_refused, dlerror());
  void* symbol = dlsym(library, "rmp_plugin_entry_v1");
  if (!symbol)
    return error(ErrorCode::plugin_refused, "it has no entry rmp_plugin_entry_v1", {}, file);
  rmp_plugin_entry_fn entry;
  std::memcpy(&entry, &symbol, sizeof entry);
  const rmp_plugin* plugin = entry();
  if (std::string_view(plugin->abi_tag) != RMP_ABI_TAG)
    return error(ErrorCode::plugin_refused, std::string("its ABI tag is ") + plugin->abi_tag, {},
                 file);
  for (std::uint32_t i = 0; i < plugin->provider_count; ++i) {
    const rmp_provider& p = rmp_provider_at(*plugin, i);
    if (std::string_view(p.interface_id) == Interface::kInterfaceId && name == p.name) return &p;
  }
  return error(ErrorCode::unknown_name, "it has no provider \"" + name + "\"", {}, file);
}

namespace detail {
/// Spread over as many threads as are asked for, whatever cores there are, so that a provider which
/// divides its work is tested so.
inline void spread(std::size_t parts, std::size_t threads, void (*part)(void*, std::size_t),
                   void* context) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < parts; i = next++) part(context, i);
  };
  std::vector<std::jthread> others;
  for (std::size_t t = 1; t < std::min({parts, threads, std::size_t{16}}); ++t)
    others.emplace_back(work);
  work();
}
inline const void* host_extension(const char* id) {
  static const rmp_threads threads{sizeof(rmp_threads), 4, &spread};
  return std::string_view(id) == RMP_THREADS ? &threads : nullptr;
}
}  // namespace detail

/// The host that providers are made with. It runs no programs unless a test gives it `run`.
inline rmp_host& host() {
  static rmp_host h{sizeof(rmp_host), "conformance",          nullptr, nullptr, nullptr,
                    nullptr,          &detail::host_extension};
  return h;
}

/// A new instance of a provider.
template <class Interface>
std::unique_ptr<Interface> create(const rmp_provider& provider) {
  char message[256] = "";
  return std::unique_ptr<Interface>(
      static_cast<Interface*>(provider.create(&host(), message, sizeof message)));
}

}  // namespace robomosp::conformance
