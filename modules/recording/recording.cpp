// SPDX-License-Identifier: Apache-2.0
#include "recording/recording.h"

#include <algorithm>

#include "kernel/text.h"
#include "spatial/rotation.h"

namespace robomosp::recording {
namespace {

/// "tau3" belongs to the group "tau": letters (and underscores), then digits only.
bool is_member(std::string_view column, std::string_view group) {
  if (!column.starts_with(group) || column.size() == group.size()) return false;
  return std::all_of(column.begin() + static_cast<std::ptrdiff_t>(group.size()), column.end(),
                     [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

Pose pose_of_place(const std::array<double, 7>& v) {
  return {spatial::from_quaternion({v[3], v[4], v[5], v[6]}), {v[0], v[1], v[2]}};
}

const Column* Recording::find(std::string_view name) const {
  for (const auto& c : columns)
    if (c.name == name) return &c;
  return nullptr;
}

Result<std::vector<const Column*>> Recording::select(std::span<const std::string> names) const {
  std::vector<const Column*> chosen;
  for (const auto& name : names) {
    if (const Column* exact = find(name)) {
      chosen.push_back(exact);
      continue;
    }
    const std::size_t before = chosen.size();
    for (const auto& c : columns)
      if (is_member(c.name, name)) chosen.push_back(&c);
    if (chosen.size() == before) {
      std::vector<std::string> known;
      for (const auto& c : columns) known.push_back(c.name);
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty()) hint = "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name, "the recording has no column " + text::quote(name),
                   hint);
    }
  }
  return chosen;
}

std::uint64_t Recordings::add(RecordingPtr recording) {
  const std::lock_guard lock(mutex_);
  recordings_.emplace(next_, std::move(recording));
  return next_++;
}

RecordingPtr Recordings::find(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto it = recordings_.find(number);
  return it == recordings_.end() ? nullptr : it->second;
}

std::vector<std::pair<std::uint64_t, RecordingPtr>> Recordings::list() const {
  const std::lock_guard lock(mutex_);
  return {recordings_.begin(), recordings_.end()};
}

Result<void> Recordings::replace(std::uint64_t number, const RecordingPtr& was,
                                 RecordingPtr recording) {
  const std::lock_guard lock(mutex_);
  const auto it = recordings_.find(number);
  if (it == recordings_.end() || it->second != was)
    return error(ErrorCode::conflict,
                 std::string("the recording was ") +
                     (it == recordings_.end() ? "removed" : "changed") + " meanwhile",
                 "Nothing was changed. Run it again.", "recording#" + std::to_string(number));
  it->second = std::move(recording);
  return {};
}

bool Recordings::remove(std::uint64_t number) {
  RecordingPtr gone;  // a large table is let go without the lock
  const std::lock_guard lock(mutex_);
  const auto it = recordings_.find(number);
  if (it == recordings_.end()) return false;
  gone = std::move(it->second);
  recordings_.erase(it);
  return true;
}

}  // namespace robomosp::recording
