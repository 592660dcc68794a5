// SPDX-License-Identifier: Apache-2.0
#include "kernel/component.h"

#include <algorithm>
#include <exception>
#include <map>
#include <utility>

#include "kernel/text.h"

namespace robomosp {
namespace {

using Indices = std::vector<std::size_t>;

std::string who(const ComponentInfo& info) { return "component " + text::quote(info.id); }

Result<void> guarded_start(Component& component) {
  try {
    return component.start();
  } catch (const std::exception& e) {
    return error(ErrorCode::internal, std::string("its start threw: ") + e.what());
  } catch (...) {
    return error(ErrorCode::internal, "its start threw an unknown exception");
  }
}

}  // namespace

std::string_view to_string(Layer layer) {
  switch (layer) {
    case Layer::core: return "core";
    case Layer::data_processing: return "data_processing";
    case Layer::application: return "application";
    case Layer::gui: return "gui";
  }
  return "core";
}

Components::~Components() { stop_all(); }

Result<void> Components::add(ComponentInfo info, std::unique_ptr<Component> component) {
  if (info.id.empty() || !component)
    return error(ErrorCode::invalid_argument, "a component needs an id and an object");
  for (const Entry& e : entries_)
    if (e.info.id == info.id)
      return error(ErrorCode::conflict, who(info) + " exists already",
                   "Give each component a unique id.");
  entries_.push_back({std::move(info), std::move(component)});
  return {};
}

Result<std::vector<std::vector<std::size_t>>> Components::edges() const {
  std::map<std::string_view, std::size_t> index;
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    index.emplace(entries_[i].info.id, i);
    ids.push_back(entries_[i].info.id);
  }
  std::vector<Indices> needs(entries_.size());
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const ComponentInfo& info = entries_[i].info;
    for (const std::string& id : info.requires_) {
      const auto it = index.find(id);
      if (it == index.end())
        return error(ErrorCode::unknown_name,
                     who(info) + " requires " + text::quote(id) + ", which does not exist",
                     text::did_you_mean(id, ids));
      const ComponentInfo& needed = entries_[it->second].info;
      if (needed.layer > info.layer)
        return error(ErrorCode::conflict,
                     who(info) + " of layer " + std::string(to_string(info.layer)) + " requires " +
                         text::quote(id) + " of the outer layer " +
                         std::string(to_string(needed.layer)),
                     "A component may require its own layer and inner ones.");
      needs[i].push_back(it->second);
    }
  }
  return needs;
}

Result<std::vector<std::size_t>> Components::start_order() const {
  RMP_TRY_ASSIGN(const auto needs, edges());
  // Depth first with an explicit stack; the components on it are the path that a cycle is known by.
  enum class Mark : std::uint8_t { unseen, open, done };
  std::vector<Mark> marks(entries_.size(), Mark::unseen);
  Indices order;
  for (std::size_t root = 0; root < entries_.size(); ++root) {
    if (marks[root] != Mark::unseen) continue;
    std::vector<std::pair<std::size_t, std::size_t>> stack{{root, 0}};  // component, next need
    marks[root] = Mark::open;
    while (!stack.empty()) {
      const std::size_t at = stack.back().first;
      if (stack.back().second == needs[at].size()) {
        marks[at] = Mark::done;
        order.push_back(at);
        stack.pop_back();
        continue;
      }
      const std::size_t need = needs[at][stack.back().second++];
      if (marks[need] == Mark::done) continue;
      if (marks[need] == Mark::unseen) {
        marks[need] = Mark::open;
        stack.emplace_back(need, 0);
        continue;
      }
      std::string path;
      auto it =
          std::find_if(stack.begin(), stack.end(), [&](const auto& s) { return s.first == need; });
      for (; it != stack.end(); ++it) path += entries_[it->first].info.id + " > ";
      return error(
          ErrorCode::conflict,
          "components require each other in a cycle (" + path + entries_[need].info.id + ")",
          "Remove one of these requirements.");
    }
  }
  return order;
}

Result<void> Components::start_all() {
  RMP_TRY_ASSIGN(const auto order, start_order());
  const std::size_t running_before = running_.size();
  for (const std::size_t i : order) {
    if (std::find(running_.begin(), running_.end(), i) != running_.end()) continue;
    Result<void> started = guarded_start(*entries_[i].component);
    if (!started.ok()) {
      stop_down_to(running_before);
      return std::move(started).in(who(entries_[i].info));
    }
    running_.push_back(i);
  }
  return {};
}

void Components::stop_down_to(std::size_t count) noexcept {
  while (running_.size() > count) {
    entries_[running_.back()].component->stop();
    running_.pop_back();
  }
}

void Components::stop_all() noexcept { stop_down_to(0); }

std::vector<ComponentInfo> Components::list() const {
  std::vector<ComponentInfo> infos;
  for (const std::size_t i : running_) infos.push_back(entries_[i].info);
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (std::find(running_.begin(), running_.end(), i) == running_.end())
      infos.push_back(entries_[i].info);
  return infos;
}

}  // namespace robomosp
