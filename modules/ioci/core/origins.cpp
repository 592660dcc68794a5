// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/origins.h"

#include <algorithm>
#include <set>

#include "ioci/core/application.h"
#include "ioci/core/commands.h"
#include "ioci/core/document_providers.h"
#include "ioci/core/modules.h"
#include "kernel/permit.h"
#include "model/data.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kPathsNamed = 3;
constexpr std::size_t kDeepestSearch = 64;  ///< tables within tables, as arguments may be

/// Handles and texts anywhere in a value.
template <class OnHandle, class OnText>
void walk(const Value& v, OnHandle&& on_handle, OnText&& on_text, std::size_t depth = 0) {
  if (depth > kDeepestSearch) return;
  if (const Handle* h = v.as_handle()) on_handle(*h);
  else if (const std::string* s = v.as_string()) on_text(*s);
  else if (const List* list = v.as_list())
    for (const Value& each : *list) walk(each, on_handle, on_text, depth + 1);
  else if (const Map* map = v.as_map())
    for (const auto& [key, each] : *map) walk(each, on_handle, on_text, depth + 1);
}

/// Settings and default providers, which count without being named.
std::vector<AnyId> choices_in(const document::Snapshot& s) {
  std::vector<AnyId> out = s.list(settings_kind());
  for (const AnyId id : s.list(default_provider_kind())) out.push_back(id);
  return out;
}

std::string change_of(const document::Snapshot& now, AnyId id, const document::RecordPtr& was) {
  const document::RecordPtr is = now.share(id);
  const std::string who = std::string(to_string(id.kind)) + " " + text::quote(was->name);
  if (is == was) return {};
  if (!is) return who + " is gone";
  std::vector<std::string> paths = model::differences(was->body, is->body);
  if (is->solvers != was->solvers) paths.emplace_back("its solvers in Lua");
  if (paths.empty()) return {};
  const std::size_t more = paths.size() > kPathsNamed ? paths.size() - kPathsNamed : 0;
  paths.resize(paths.size() - more);
  if (more > 0) paths.push_back(std::to_string(more) + " more");
  return who + ": " + text::enumerate(paths);
}

}  // namespace

Inputs inputs_of(const Application& app, const document::Snapshot& s, const Map& args) {
  Inputs out;
  std::set<AnyId> seen;
  std::vector<AnyId> ids;
  const auto add = [&](AnyId id) {
    if (s.find(id) && seen.insert(id).second) ids.push_back(id);
  };
  for (const auto& [name, value] : args)
    walk(
        value,
        [&](const Handle& h) {
          if (const auto kind = kind_from(h.kind)) add(AnyId{*kind, h.number});
          else if (h.kind == "recording")
            if (auto r = app.recordings.find(h.number))
              out.recordings.emplace_back(h.number, std::move(r));
        },
        [&](const std::string& word) {
          for (const Kind kind : all_kinds())
            if (const auto id = s.find(kind, word)) add(*id);
        });
  out.choices = choices_in(s);
  for (const AnyId id : out.choices) add(id);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    out.records.emplace_back(ids[i], s.share(ids[i]));
    model::for_each_reference(out.records.back().second->body,
                              [&](AnyId other, std::string_view) { add(other); });
  }
  return out;
}

std::vector<std::string> changes_since(const Application& app, const document::Snapshot& now,
                                       const Inputs& inputs) {
  std::vector<std::string> out;
  for (const auto& [id, was] : inputs.records)
    if (std::string change = change_of(now, id, was); !change.empty())
      out.push_back(std::move(change));
  for (const AnyId id : choices_in(now))
    if (std::find(inputs.choices.begin(), inputs.choices.end(), id) == inputs.choices.end())
      out.push_back(now.describe(id) + " is new");
  for (const auto& [number, was] : inputs.recordings) {
    const auto is = app.recordings.find(number);
    if (is != was)
      out.push_back("recording#" + std::to_string(number) + (is ? " is another one" : " is gone"));
  }
  return out;
}

std::uint64_t recording_in(const Value& result) {
  const auto number = [](const Value& v) -> std::uint64_t {
    const Handle* h = v.as_handle();
    return h && h->kind == "recording" ? h->number : 0;
  };
  if (const std::uint64_t n = number(result)) return n;
  if (const Map* map = result.as_map())
    for (const auto& [name, value] : *map)
      if (const std::uint64_t n = number(value)) return n;
  return 0;
}

OriginPtr RecordingOrigins::find(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  const auto it = origins_.find(number);
  return it == origins_.end() ? nullptr : it->second;
}

void RecordingOrigins::put(std::uint64_t number, RecordingOrigin origin) {
  auto made = std::make_shared<const RecordingOrigin>(std::move(origin));
  std::vector<OriginPtr> gone;  // let go without the mutex
  const std::lock_guard lock(mutex_);
  if (origins_.size() >= prune_at_) {
    std::erase_if(origins_, [&](const auto& each) {
      if (app_.recordings.find(each.first)) return false;
      gone.push_back(each.second);
      return true;
    });
    prune_at_ = 64 + 2 * origins_.size();
  }
  origins_[number] = std::move(made);
}

void RecordingOrigins::note(const document::Snapshot& snapshot, const std::string& command,
                            const Map& given, const Map& checked, const Value& result) {
  const std::uint64_t number = recording_in(result);
  if (number == 0 || find(number)) return;
  RecordingOrigin origin;
  origin.made.command = command;
  for (const auto& [name, value] : given) {
    if (name == "watch") continue;
    const Value* read = checked.find(name);
    origin.made.args.set(name, read && read->as_handle() ? *read : value);
  }
  origin.inputs = inputs_of(app_, snapshot, checked);
  if (const Permit* permit = current_permit()) origin.files = permit->files;
  put(number, std::move(origin));
}

void RecordingOrigins::note_fixed(std::uint64_t number, std::string why) {
  RecordingOrigin origin;
  origin.fixed = std::move(why);
  put(number, std::move(origin));
}

void RecordingOrigins::note_step(std::uint64_t number, const std::string& command,
                                 const Map& given) {
  const OriginPtr old = find(number);
  if (!old) return;
  RecordingOrigin origin = *old;
  Map args = given;
  args.erase("id");
  // The same column again takes the place of what it was.
  std::erase_if(origin.added, [&](const RecordingOrigin::Step& s) {
    return s.command == command && s.args.find("name") && args.find("name") &&
           s.args.find("name")->text() == args.find("name")->text();
  });
  origin.added.push_back({command, std::move(args)});
  put(number, std::move(origin));
}

void RecordingOrigins::move(std::uint64_t from, std::uint64_t to) {
  const std::lock_guard lock(mutex_);
  const auto it = origins_.find(from);
  if (it == origins_.end()) return;
  origins_[to] = it->second;
  origins_.erase(from);
}

void note_if_stale(Application& app, const document::Snapshot& snapshot, std::uint64_t number,
                   const std::string& work) {
  const OriginPtr origin = app.origins->find(number);
  if (!origin || !origin->fixed.empty()) return;
  const auto changes = changes_since(app, snapshot, origin->inputs);
  if (changes.empty()) return;
  app.messages.post(Severity::info, "stale_recording",
                    work + ": recording#" + std::to_string(number) + " is older than " +
                        text::enumerate(changes) + "; recording.refresh updates it.",
                    "recording");
}

}  // namespace robomosp::ioci
