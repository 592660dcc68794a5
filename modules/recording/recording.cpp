// SPDX-License-Identifier: Apache-2.0
#include "recording/recording.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "kernel/text.h"
#include "spatial/rotation.h"

namespace robomosp::recording {
namespace {

/// "tau3" belongs to the group "tau": letters (and underscores), then digits only. The group
/// "axes", or "arm.axes", is that of the maker's axes: "axis_A1", "arm.axis_A1".
bool is_member(std::string_view column, std::string_view group) {
  constexpr std::string_view kAxes = "axes", kAxis = "axis_";
  if (group.ends_with(kAxes)) {
    const std::string_view robot = group.substr(0, group.size() - kAxes.size());
    if ((robot.empty() || robot.ends_with('.')) && column.starts_with(robot) &&
        column.substr(robot.size()).starts_with(kAxis))
      return true;
  }
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

/// One number's table: either as it was given, or one that grows.
struct Recordings::Slot {
  /// A table that grows, and how many have it as it is.
  struct Growing {
    Recording table;
    std::atomic<std::size_t> lent{0};
  };
  std::mutex mutex;
  RecordingPtr given;                        // guarded by mutex; none once it grows
  std::shared_ptr<Growing> growing;          // guarded by mutex
  std::vector<std::vector<double>> waiting;  // guarded by mutex; rows that no reader has seen
  std::size_t replaced = 0;                  // guarded by mutex

  [[nodiscard]] const Recording& table() const { return given ? *given : growing->table; }
  [[nodiscard]] std::size_t rows_waiting() const {
    return waiting.empty() ? 0 : waiting.front().size();
  }

  /// The table with all rows. With `mutex` held.
  RecordingPtr now() {
    if (rows_waiting() > 0) {
      // Who gave it back has done so before the count is seen as zero.
      if (!growing || growing->lent.load(std::memory_order_acquire) > 0) {
        auto copy = std::make_shared<Growing>();
        copy->table = table();
        growing = std::move(copy);
        given.reset();
      }
      for (std::size_t c = 0; c < waiting.size(); ++c) {
        auto& values = growing->table.columns[c].values;
        values.insert(values.end(), waiting[c].begin(), waiting[c].end());
        waiting[c].clear();
      }
    }
    if (given) return given;
    growing->lent.fetch_add(1, std::memory_order_relaxed);
    return {&growing->table, [keep = growing](const Recording*) {
              keep->lent.fetch_sub(1, std::memory_order_release);
            }};
  }
};

std::shared_ptr<Recordings::Slot> Recordings::slot(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto it = recordings_.find(number);
  return it == recordings_.end() ? nullptr : it->second;
}

std::uint64_t Recordings::add(RecordingPtr recording) {
  RecordingChange change{0, RecordingChange::What::added, recording->rows(), recording->title};
  auto made = std::make_shared<Slot>();
  made->given = std::move(recording);
  {
    const std::lock_guard lock(mutex_);
    change.number = next_++;
    recordings_.emplace(change.number, std::move(made));
  }
  const std::uint64_t number = change.number;
  tell(std::move(change));
  return number;
}

RecordingPtr Recordings::find(std::uint64_t number) const {
  const auto found = slot(number);
  if (!found) return nullptr;
  const std::lock_guard lock(found->mutex);
  return found->now();
}

std::vector<std::pair<std::uint64_t, RecordingPtr>> Recordings::list() const {
  std::vector<std::pair<std::uint64_t, std::shared_ptr<Slot>>> slots;
  {
    const std::lock_guard lock(mutex_);
    slots.assign(recordings_.begin(), recordings_.end());
  }
  std::vector<std::pair<std::uint64_t, RecordingPtr>> out;
  for (const auto& [number, each] : slots) {
    const std::lock_guard lock(each->mutex);
    out.emplace_back(number, each->now());
  }
  return out;
}

Result<void> Recordings::replace(std::uint64_t number, const RecordingPtr& was,
                                 RecordingPtr recording) {
  const auto found = slot(number);
  const auto refused = [&](const char* what) {
    return error(ErrorCode::conflict, std::string("the recording was ") + what + " meanwhile",
                 "Nothing was changed. Run it again.", "recording#" + std::to_string(number));
  };
  if (!found) return refused("removed");
  RecordingChange change{number, RecordingChange::What::replaced, recording->rows(),
                         recording->title};
  {
    const std::lock_guard lock(found->mutex);
    if (&found->table() != was.get() || found->rows_waiting() > 0) return refused("changed");
    found->given = std::move(recording);
    found->growing.reset();
    found->waiting.clear();
    ++found->replaced;
  }
  tell(std::move(change));
  return {};
}

Result<std::size_t> Recordings::append(std::uint64_t number,
                                       std::span<const std::vector<double>> columns) {
  const std::string where = "recording#" + std::to_string(number);
  const auto found = slot(number);
  if (!found)
    return error(ErrorCode::not_found, "there is no " + where,
                 "recording.list lists the existing ones.");
  std::unique_lock lock(found->mutex);
  const Recording& table = found->table();
  if (columns.size() != table.columns.size())
    return error(ErrorCode::conflict,
                 "the recording has " + std::to_string(table.columns.size()) +
                     " columns and the rows have " + std::to_string(columns.size()),
                 "Give a value for each column in every row.", where);
  if (columns.empty())
    return error(ErrorCode::invalid_argument, "the recording has no columns", "", where);
  const std::size_t count = columns.front().size();
  for (const auto& c : columns)
    if (c.size() != count)
      return error(ErrorCode::invalid_argument, "the columns have different numbers of values",
                   "Give the same number to each.", where);
  const std::size_t rows = table.rows() + found->rows_waiting();
  if (count > kMostValues / columns.size() - std::min(rows, kMostValues / columns.size()))
    return error(ErrorCode::unsupported,
                 "the recording would have " + std::to_string(rows + count) + " rows of " +
                     std::to_string(columns.size()) + " columns, more than " +
                     std::to_string(kMostValues) + " numbers",
                 "Start another recording, and save or remove this one.", where);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (table.columns[c].name != "time") continue;
    const auto& before = found->rows_waiting() > 0 ? found->waiting[c] : table.columns[c].values;
    double last = before.empty() ? -std::numeric_limits<double>::infinity() : before.back();
    for (std::size_t i = 0; i < count; ++i) {
      if (!(columns[c][i] > last) || std::isinf(columns[c][i]))
        return error(
            ErrorCode::invalid_argument,
            "the time does not increase from " +
                (rows + i == 0 ? std::string("the beginning") : text::print_rounded(last) + " s") +
                " to " + text::print_rounded(columns[c][i]) + " s, row " + std::to_string(i + 1) +
                " of those to append",
            "Give rows that are later than the existing ones, in order.", where);
      last = columns[c][i];
    }
  }
  found->waiting.resize(columns.size());
  for (std::size_t c = 0; c < columns.size(); ++c)
    found->waiting[c].insert(found->waiting[c].end(), columns[c].begin(), columns[c].end());
  RecordingChange change{number, RecordingChange::What::appended, rows + count, table.title};
  lock.unlock();
  tell(std::move(change));
  return rows + count;
}

Result<RecordingRows> Recordings::rows(std::uint64_t number, std::size_t from,
                                       std::optional<std::size_t> replaced, std::size_t most,
                                       std::span<const std::string> columns) const {
  const std::string where = "recording#" + std::to_string(number);
  const auto found = slot(number);
  if (!found)
    return error(ErrorCode::not_found, "there is no " + where,
                 "recording.list lists the existing ones.");
  const std::lock_guard lock(found->mutex);
  const Recording& table = found->table();
  std::vector<const Column*> chosen;
  if (columns.empty()) {
    for (const Column& c : table.columns) chosen.push_back(&c);
  } else {
    auto named = table.select(columns);
    if (!named.ok()) return std::move(named).error().in(where);
    chosen = std::move(*named);
  }
  const std::size_t known = table.rows();
  RecordingRows out;
  out.rows = known + found->rows_waiting();
  out.replaced = found->replaced;
  out.from = replaced.value_or(out.replaced) == out.replaced ? std::min(from, out.rows) : 0;
  const std::size_t at_once =
      std::max<std::size_t>(1, most / std::max<std::size_t>(1, chosen.size()));
  const std::size_t end = out.from + std::min(at_once, out.rows - out.from);
  for (const Column* c : chosen) {
    auto& [name, values] = out.columns.emplace_back(c->name, std::vector<double>());
    values.reserve(end - out.from);
    const auto add = [&values = values](const std::vector<double>& all, std::size_t a,
                                        std::size_t b) {
      if (a < b)
        values.insert(values.end(), all.begin() + static_cast<std::ptrdiff_t>(a),
                      all.begin() + static_cast<std::ptrdiff_t>(b));
    };
    add(c->values, out.from, std::min(end, known));
    if (end > known)
      add(found->waiting[static_cast<std::size_t>(c - table.columns.data())],
          std::max(out.from, known) - known, end - known);
  }
  return out;
}

bool Recordings::remove(std::uint64_t number) {
  std::shared_ptr<Slot> gone;  // a large table is let go without the lock
  {
    const std::lock_guard lock(mutex_);
    const auto it = recordings_.find(number);
    if (it == recordings_.end()) return false;
    gone = std::move(it->second);
    recordings_.erase(it);
  }
  RecordingChange change{number, RecordingChange::What::removed, 0, {}};
  {
    const std::lock_guard lock(gone->mutex);
    change.title = gone->table().title;
  }
  tell(std::move(change));
  return true;
}

}  // namespace robomosp::recording
