// SPDX-License-Identifier: Apache-2.0
// A plugin whose providers are those of another file (ROBOMOSP_APART), each in that plugin's own
// process: what a plugin's suites say of it there.
#include <array>
#include <cstddef>
#include <cstdlib>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/plugin.h>

#include "kernel/interface_adapters.h"
#include "kernel/plugin_entry.h"
#include "kernel/provider_process/doors.h"
#include "kernel/provider_process/provider_process.h"
#include "kernel/provider_process/proxies.h"

namespace {

using namespace robomosp;

/// What may be asked for by providers: those of the same file.
void* create_other(const char* interface_id, const char* name, char* error,
                   std::uint32_t error_size);
const rmp_host kHost{sizeof(rmp_host),
                     "conformance",
                     nullptr,
                     nullptr,
                     &create_other,
                     nullptr,
                     &conformance::detail::host_extension};

struct Door {
  Door()
      : process(std::getenv("ROBOMOSP_APART") ? std::getenv("ROBOMOSP_APART") : "", limits(),
                &kHost, {}) {
    auto read = process.describe();
    if (!read.ok()) {
      std::fprintf(stderr, "%s\n", read.error().sentence().c_str());
      std::exit(1);
    }
    wire = std::move(*read);
  }
  static ApartLimits limits() { return {}; }
  ProviderProcess process;
  apart::PluginWire wire;
};
Door& door() {
  static Door& d = *new Door();  // plugins are never unloaded
  return d;
}

std::vector<std::string> params_of(std::size_t row) {
  std::vector<std::string> out;
  for (const apart::RowWire& p : door().wire.providers[row].params) out.push_back(p.name);
  return out;
}
template <std::size_t I>
void* create(const rmp_host*, char* error, std::uint32_t error_size) {
  const apart::ProviderWire& w = door().wire.providers[I];
  auto made = door().process.create(I, current_interface(w.interface_id), w.name, params_of(I));
  if (made.ok()) return *made;
  if (error && error_size) std::snprintf(error, error_size, "%s", made.error().sentence().c_str());
  return nullptr;
}
using Create = void* (*)(const rmp_host*, char*, std::uint32_t);
constexpr auto kCreate = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array<Create, sizeof...(I)>{&create<I>...};
}
(std::make_index_sequence<64>());

void* create_other(const char* interface_id, const char* name, char* error,
                   std::uint32_t error_size) {
  for (std::size_t i = 0; i < door().wire.providers.size(); ++i)
    if (door().wire.providers[i].interface_id == interface_id &&
        (!name || !*name || door().wire.providers[i].name == name))
      return kCreate.at(i)(nullptr, error, error_size);
  if (error && error_size) std::snprintf(error, error_size, "%s", "there is no such provider");
  return nullptr;
}

}  // namespace

extern "C" RMP_EXPORT const rmp_plugin* rmp_plugin_entry_v1(void) {
  static std::deque<std::vector<rmp_param>> tables;
  static const std::vector<rmp_provider> rows = [] {
    std::vector<rmp_provider> out;
    for (const apart::ProviderWire& w : door().wire.providers) {
      std::vector<rmp_param>& table = tables.emplace_back();
      for (const apart::RowWire& r : w.params)
        table.push_back({r.name.c_str(), r.type.c_str(), r.unit.c_str(), r.doc.c_str(),
                         r.default_text ? r.default_text->c_str() : nullptr,
                         r.choices ? r.choices->c_str() : nullptr, r.min, r.max, r.flags,
                         r.label.c_str(), r.group.c_str()});
      out.push_back({w.interface_id.c_str(), w.name.c_str(), w.summary.c_str(), w.tags.c_str(),
                     table.data(), static_cast<std::uint32_t>(table.size()), sizeof(rmp_param),
                     kCreate.at(out.size())});
    }
    return out;
  }();
  static const rmp_plugin plugin = {sizeof(rmp_plugin),
                                    RMP_ABI_TAG,
                                    door().wire.id.c_str(),
                                    door().wire.version.c_str(),
                                    door().wire.license.c_str(),
                                    door().wire.summary.c_str(),
                                    rows.data(),
                                    static_cast<std::uint32_t>(rows.size()),
                                    sizeof(rmp_provider)};
  return &plugin;
}
