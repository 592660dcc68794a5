// SPDX-License-Identifier: Apache-2.0
#include "kernel/registry.h"

#include <algorithm>

#include "kernel/interface_file.h"
#include "kernel/known_provider.h"
#include "kernel/permit.h"
#include "kernel/provider_guard.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

/// `ik` of "robomosp.ik/1": what users call the interface.
std::string short_name(std::string_view interface_id) {
  if (interface_id.starts_with("robomosp.")) interface_id.remove_prefix(9);
  return std::string(interface_id.substr(0, interface_id.find('/')));
}

Error disabled(const ProviderInfo& info) {
  const std::string what = short_name(info.interface_id);
  return error(ErrorCode::unsupported,
               "provider " + text::quote(what + " " + info.name) + " is disabled",
               "provider.enable(" + text::quote(what) + ", " + text::quote(info.name) +
                   ") enables it again; or choose another one.");
}

}  // namespace

Result<void> Registry::add(ProviderInfo info, Create create, bool replace) {
  RMP_TRY(require(Effect::providers));
  if (info.interface_id.empty() || info.name.empty() || !create)
    return error(ErrorCode::invalid_argument,
                 "a provider needs an interface id, a name and a create function");
  const std::lock_guard lock(mutex_);
  const auto it = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.info.interface_id == info.interface_id && e.info.name == info.name;
  });
  if (it != entries_.end() && !replace)
    return error(ErrorCode::conflict,
                 short_name(info.interface_id) + " provider " + text::quote(info.name) +
                     " exists already, from " + text::quote(it->info.origin),
                 "Give one of the two another name.");
  if (it != entries_.end()) *it = {std::move(info), std::move(create)};
  else entries_.push_back({std::move(info), std::move(create)});
  ++revision_;
  return {};
}

bool Registry::remove(std::string_view interface_id, std::string_view name) {
  if (!require(Effect::providers).ok()) return false;
  const std::lock_guard lock(mutex_);
  const auto removed = std::erase_if(entries_, [&](const Entry& e) {
    return e.info.interface_id == interface_id && e.info.name == name;
  });
  if (removed) ++revision_;
  return removed != 0;
}

std::string_view standard_provider(std::string_view interface_id) {
  const InterfaceEntry* entry = InterfaceFile::find(interface_id);
  return entry ? std::string_view(entry->standard) : std::string_view();
}

const Registry::Entry* Registry::locate(std::string_view interface_id,
                                        std::string_view name) const {
  const auto enabled = [&](const Entry& e) {
    return e.info.interface_id == interface_id && e.info.enabled;
  };
  if (!name.empty()) {
    for (const Entry& e : entries_)
      if (e.info.interface_id == interface_id && e.info.name == name) return &e;
    return nullptr;
  }
  for (const auto* choices : {&session_, &document_, &user_}) {
    const auto chosen = choices->find(interface_id);
    if (chosen == choices->end()) continue;
    for (const Entry& e : entries_)
      if (enabled(e) && e.info.name == chosen->second) return &e;
    if (choices == &document_) return nullptr;  // no other one in its place unseen
  }
  // One that answers roughly, or refuses part of what its interface knows, is no default while
  // there is another.
  const auto is_full = [](const Entry& e) {
    return std::none_of(e.info.tags.begin(), e.info.tags.end(), [](const std::string& tag) {
      return tag == "approximate" || tag == "partial";
    });
  };
  const std::string_view standard = standard_provider(interface_id);
  const Entry *shipped = nullptr, *found = nullptr;
  std::size_t count = 0;
  for (const Entry& e : entries_) {
    if (!enabled(e)) continue;
    ++count;
    found = &e;
    if (!e.info.shipped) continue;
    if (e.info.name == standard) return &e;
    if (!shipped || (!is_full(*shipped) && is_full(e))) shipped = &e;
  }
  return shipped ? shipped : count == 1 ? found : nullptr;
}

Error Registry::absent(std::string_view interface_id, std::string_view name) const {
  const std::string what = short_name(interface_id);
  const auto kept = document_.find(interface_id);
  if (const auto why = reasons_.find(
          {std::string(interface_id),
           name.empty() && kept != document_.end() ? kept->second : std::string(name)});
      why != reasons_.end())
    return error(ErrorCode::permission, why->second.first, why->second.second);
  std::vector<std::string> names;
  for (const Entry& e : entries_)
    if (e.info.interface_id == interface_id && e.info.enabled) names.push_back(e.info.name);
  if (names.empty())
    return error(ErrorCode::unknown_name,
                 "there is no provider of " + what +
                     (name.empty() ? "" : ", so none named " + text::quote(name)),
                 "Load a plugin that offers " + text::quote(interface_id) +
                     "; plugin.list lists those found. In the source tree ./bootstrap build makes "
                     "all shipped plugins.");
  if (name.empty() && kept != document_.end())
    return error(ErrorCode::unknown_name,
                 "the document chooses the " + what + " provider " + text::quote(kept->second) +
                     ", which is missing or disabled",
                 "Load its plugin, choose another for this run with provider.default, or withdraw "
                 "the choice: provider.default{interface = " +
                     text::quote(what) + ", name = \"\", keep = \"document\"}. There are " +
                     text::enumerate(names) + ".");
  if (name.empty())
    return error(ErrorCode::unknown_name, "no " + what + " provider is the default",
                 "Choose one with provider.default: " + text::enumerate(names) + ".");
  std::string hint = text::did_you_mean(name, names);
  if (!hint.empty()) hint += " ";
  return error(ErrorCode::unknown_name, "there is no " + what + " provider " + text::quote(name),
               hint + "Available: " + text::enumerate(names) + ".");
}

Result<void> Registry::set_enabled(std::string_view interface_id, std::string_view name,
                                   bool enabled) {
  RMP_TRY(require(Effect::providers));
  const std::lock_guard lock(mutex_);
  for (Entry& e : entries_) {
    if (e.info.interface_id != interface_id || e.info.name != name) continue;
    if (e.info.enabled != enabled) ++revision_;
    e.info.enabled = enabled;
    return {};
  }
  return absent(interface_id, name);
}

Result<ProviderInfo> Registry::find(std::string_view interface_id, std::string_view name) const {
  const std::lock_guard lock(mutex_);
  const Entry* e = locate(interface_id, name);
  if (!e) return absent(interface_id, name);
  if (!e->info.enabled) return disabled(e->info);
  return e->info;
}

Result<ProviderInfo> known_provider(const Registry& registry, std::string_view interface_id,
                                    std::string_view name) {
  auto found = registry.find(interface_id, name);
  if (found.ok() || name.empty()) return found;
  for (ProviderInfo& info : registry.list(interface_id))
    if (info.name == name) return std::move(info);
  return found;
}

std::vector<ProviderInfo> Registry::list(std::string_view interface_id) const {
  const std::lock_guard lock(mutex_);
  std::vector<ProviderInfo> infos;
  for (const Entry& e : entries_)
    if (interface_id.empty() || e.info.interface_id == interface_id) infos.push_back(e.info);
  std::stable_partition(infos.begin(), infos.end(),
                        [](const ProviderInfo& info) { return info.shipped; });
  return infos;
}

Result<void> Registry::set_default(std::string_view interface_id, std::string_view name) {
  return choose(session_, interface_id, name);
}

Result<void> Registry::set_user_default(std::string_view interface_id, std::string_view name) {
  return choose(user_, interface_id, name);
}

Result<void> Registry::choose(Choices& choices, std::string_view interface_id,
                              std::string_view name) {
  RMP_TRY(require(Effect::providers));
  const std::lock_guard lock(mutex_);
  if (name.empty()) {
    choices.erase(std::string(interface_id));
  } else {
    const Entry* e = locate(interface_id, name);
    if (!e) return absent(interface_id, name);
    if (!e->info.enabled) return disabled(e->info);
    choices[std::string(interface_id)] = name;
  }
  ++revision_;
  return {};
}

void Registry::set_document_defaults(std::map<std::string, std::string> chosen) {
  const std::lock_guard lock(mutex_);
  Choices now(chosen.begin(), chosen.end());
  if (now == document_) return;
  document_ = std::move(now);
  ++revision_;
}

void Registry::set_absent_reasons(Reasons reasons) {
  const std::lock_guard lock(mutex_);
  reasons_ = std::move(reasons);
}

std::map<std::string, Registry::Choice> Registry::chosen() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, Choice> out;
  const std::pair<const Choices*, const char*> all[] = {
      {&session_, "session"}, {&document_, "document"}, {&user_, "user"}};
  for (const auto& [choices, by] : all)
    for (const auto& [id, name] : *choices) out.insert({id, {name, by}});
  return out;
}

std::uint64_t Registry::revision() const {
  const std::lock_guard lock(mutex_);
  return revision_;
}

Result<void*> Registry::create_raw(std::string_view interface_id, std::string_view name) const {
  Create create;
  ProviderInfo info;
  std::string label;
  {
    const std::lock_guard lock(mutex_);
    const Entry* e = locate(interface_id, name);
    if (!e) return absent(interface_id, name);
    if (!e->info.enabled) return disabled(e->info);
    label = short_name(interface_id) + " " + e->info.name;
    create = e->create;
    info.interface_id = e->info.interface_id;
    info.name = e->info.name;
    info.tags = e->info.tags;
  }
  Result<void*> made = guarded(label, create);
  if (made.ok() && *made == nullptr)
    return error(ErrorCode::plugin_failed,
                 "provider \"" + label + "\" could not be made and gave no reason",
                 "Report it to the provider's author or choose another provider.");
  if (!made.ok()) return made;
  return guarded(label, [&]() -> Result<void*> { return guard_provider(info, *made); });
}

}  // namespace robomosp
