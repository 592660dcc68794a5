// SPDX-License-Identifier: Apache-2.0
// Loads one plugin file for a test and fills its parameter tables with their defaults
// (layer: contract helper for tests, header-only, POSIX). The program's own loader does far more
// checks; a conformance test only needs the provider.
#pragma once

#include <dlfcn.h>
#include <charconv>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

namespace robomosp::conformance {

/// Params with the defaults of a provider's table; values may be set as text.
class TableParams final : public Params {
 public:
  TableParams() = default;
  explicit TableParams(const rmp_provider& provider) {
    for (std::uint32_t i = 0; i < provider.param_count; ++i)
      if (provider.params[i].default_text)
        set(provider.params[i].name, provider.params[i].default_text);
  }
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

/// The provider `name` of `Interface` in a plugin file; an error says what is missing.
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
    const rmp_provider& p = plugin->providers[i];
    if (std::string_view(p.interface_id) == Interface::kInterfaceId && name == p.name) return &p;
  }
  return error(ErrorCode::unknown_name, "it has no provider \"" + name + "\"", {}, file);
}

/// The host that providers are made with. It runs no programs unless a test gives it `run`.
inline rmp_host& host() {
  static rmp_host h{sizeof(rmp_host), "conformance", nullptr, nullptr};
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
