// SPDX-License-Identifier: Apache-2.0
// Saving: where each record goes, and the text of its file.
#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "io/file_names.h"
#include "io/native.h"
#include "io/native_print.h"
#include "io/syntax.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using document::Snapshot;
using document::Transaction;
using text::quote;

bool starts_with(const fs::path& path, const fs::path& folder) {
  const auto [p, f] = std::mismatch(path.begin(), path.end(), folder.begin(), folder.end());
  return f == folder.end() && p != path.end();
}

/// Where each record goes: the wanted one, and those never saved that it needs.
struct Plan {
  std::unordered_map<AnyId, std::string> files;
  std::vector<AnyId> order;  ///< dependencies first
};

/// Saves and prints records of one document; what it knows of files serves all of them.
class Saver {
 public:
  Saver(const Snapshot& now, const std::vector<fs::path>& library, SaveOptions options = {})
      : options_(options) {
    for (const AnyId id : now.list())
      if (const auto& file = now.find(id)->file; !file.empty()) owners_.emplace(file, id);
    for (const auto& folder : library) library_.emplace_back(canonical_name(folder));
  }

  Result<std::string> print(const Snapshot& now, AnyId id, const fs::path& file) {
    RMP_TRY_ASSIGN(const Plan plan, plan_files(now, id, file));
    return print_with(now, id, file, plan.files);
  }

  /// The files that stand there after write().
  Result<std::vector<fs::path>> save(Transaction& tx, AnyId id, const fs::path& wanted) {
    const Snapshot& now = tx.now();
    fs::path file = wanted;
    if (file.filename().empty())
      return error(ErrorCode::invalid_argument,
                   quote(wanted.generic_string()) + " is a folder, not a file to save to",
                   "Add a file name.");
    if (!file.has_extension()) file += extension(id.kind);

    RMP_TRY_ASSIGN(const Plan plan, plan_files(now, id, file));
    if (const auto owner = owners_.find(plan.files.at(id));
        owner != owners_.end() && owner->second != id)
      return error(
          ErrorCode::conflict,
          "the file " + quote(file.generic_string()) + " belongs to " + now.describe(owner->second),
          "Choose another file.");
    std::vector<std::pair<fs::path, std::string>> texts;
    std::vector<std::pair<fs::path, std::string>> geometries;
    for (const AnyId each : plan.order) {
      const std::string& target = plan.files.at(each);
      RMP_TRY_ASSIGN(std::string text, print_with(now, each, target, plan.files));
      texts.emplace_back(each == id ? file : fs::path(target), std::move(text));
      RMP_TRY(add_geometries(*now.find(each), target, geometries));
    }
    std::vector<fs::path> written;
    for (auto& [target, bytes] : geometries) {
      written.push_back(target);
      // The name is that of the content: what stands there already is the same, unless it was
      // damaged.
      if (!geometries_.insert(target.string()).second || file_holds(target, bytes)) continue;
      RMP_TRY(files_.add(target, bytes));
    }
    for (std::size_t i = 0; i < texts.size(); ++i) {
      const auto& [target, text] = texts[i];
      const AnyId each = plan.order[i];
      written.push_back(target);
      FileBefore before{true, {}};
      if (const model::Record& r = *now.find(each);
          r.file == plan.files.at(each) && r.disk != Fingerprint() && !options_.overwrite)
        before.seen = r.disk;
      RMP_TRY(files_.add(target, text, before));
      saved_.insert(each);
    }
    for (std::size_t i = 0; i < texts.size(); ++i) {
      const AnyId each = plan.order[i];
      const std::string& target = plan.files.at(each);
      waiting_.insert(target);
      const std::string old = now.find(each)->file;
      const Fingerprint disk = file_fingerprint(texts[i].second);
      if (old == target && now.find(each)->disk == disk) continue;
      RMP_TRY(tx.edit(each, [&](model::Record& r) -> Result<void> {
        r.file = target;
        r.disk = disk;
        return {};
      }));
      if (old == target) continue;
      if (const auto owner = owners_.find(old); owner != owners_.end() && owner->second == each)
        owners_.erase(owner);
      owners_.insert_or_assign(target, each);
    }
    return written;
  }

  /// Puts what was saved in its places: all of it, or nothing.
  Result<void> write() {
    RMP_TRY(files_.finish());
    if (options_.replaced) *options_.replaced = files_.replaced();
    return {};
  }

  [[nodiscard]] bool has_saved(AnyId id) const { return saved_.contains(id); }

 private:
  Result<Plan> plan_files(const Snapshot& now, AnyId id, const fs::path& file) const {
    if (!now.find(id))
      return error(ErrorCode::stale_handle, now.describe(id) + " cannot be saved",
                   "Look it up again by its name.");
    struct Step {
      AnyId id;
      std::vector<AnyId> targets;
      std::size_t next = 0;
    };
    const auto targets_of = [&now](AnyId record) {
      std::vector<AnyId> targets;
      model::for_each_reference(now.find(record)->body,
                                [&](AnyId t, std::string_view) { targets.push_back(t); });
      return targets;
    };
    const std::string main = canonical_name(file);
    Plan plan{{{id, main}}, {}};
    std::unordered_set<std::string> taken{main};
    std::vector<Step> path;
    path.push_back({id, targets_of(id)});
    std::unordered_set<AnyId> seen{id};
    while (!path.empty()) {
      Step& top = path.back();
      if (top.next == top.targets.size()) {
        plan.order.push_back(top.id);
        path.pop_back();
        continue;
      }
      const AnyId target = top.targets[top.next++];
      const model::Record* record = now.find(target);
      if (!record)
        return error(ErrorCode::stale_handle,
                     now.describe(top.id) + " refers to " + now.describe(target));
      if (!record->file.empty() || !seen.insert(target).second) continue;
      std::string beside;
      for (int k = 1;; ++k) {
        const std::string stem = record->name + (k > 1 ? "_" + std::to_string(k) : std::string());
        beside = canonical_name(file.parent_path() / (stem + std::string(extension(target.kind))));
        if (!taken.contains(beside) && !owners_.contains(beside) && !is_file(beside)) break;
      }
      taken.insert(beside);
      plan.files.emplace(target, beside);
      path.push_back({target, targets_of(target)});
    }
    return plan;
  }

  Result<std::string> print_with(const Snapshot& now, AnyId id, const fs::path& file,
                                 const std::unordered_map<AnyId, std::string>& planned) const {
    const model::Record* record = now.find(id);
    if (!record)
      return error(ErrorCode::stale_handle, now.describe(id) + " cannot be saved",
                   "Look it up again by its name.");
    const fs::path from = canonical_name(file);
    std::unordered_map<AnyId, std::string> paths;  // of what it refers to, each found once
    const auto path_of = [&](AnyId target) -> std::string {
      const auto [it, is_new] = paths.try_emplace(target);
      if (is_new) {
        const auto plan = planned.find(target);
        it->second =
            relative_path(plan != planned.end() ? plan->second : now.find(target)->file, from);
      }
      return it->second;
    };
    RMP_TRY_ASSIGN(std::string text, print_record(now, *record, from, path_of));
    // What is written must be readable: a description may hold bytes that are no text.
    if (const auto again = parse(file.filename().generic_string(), text); !again.ok())
      return error(ErrorCode::invalid_argument,
                   now.describe(id) + " cannot be saved, since its file could not be read back: " +
                       again.error().message,
                   "Correct its texts: they must be UTF-8.", again.error().where);
    return text;
  }

  /// How `from` (a file) refers to `target` (canonical): through a library folder when the target
  /// lies in one that `from` does not lie in, else relative to the folder of `from`.
  [[nodiscard]] std::string relative_path(const fs::path& target, const fs::path& from) const {
    const fs::path relative = target.lexically_relative(from.parent_path());
    for (const fs::path& folder : library_) {
      if (!starts_with(target, folder) || starts_with(from, folder)) continue;
      const fs::path inside = target.lexically_relative(folder);
      const fs::path beside = from.parent_path() / inside;
      if (!is_file(beside) && !waiting_.contains(beside.generic_string()))
        return inside.generic_string();  // else it would be hidden
    }
    return (relative.empty() ? target : relative).generic_string();
  }

  /// The geometry files of a solid that is saved at `file`, each once.
  static Result<void> add_geometries(const model::Record& record, const fs::path& file,
                                     std::vector<std::pair<fs::path, std::string>>& out) {
    const auto* solid = std::get_if<model::Solid>(&record.body);
    if (!solid) return {};
    for (const auto& node : solid->nodes) {
      if (!node.geometry) continue;
      const fs::path target = file.parent_path() / geometry_file_name(file, *node.geometry);
      if (std::any_of(out.begin(), out.end(), [&](const auto& o) { return o.first == target; }))
        continue;
      RMP_TRY_ASSIGN(std::string bytes, geometry_bytes(*node.geometry));
      out.emplace_back(target, std::move(bytes));
    }
    return {};
  }

  SaveOptions options_;
  FileBatch files_;
  std::unordered_set<std::string> geometries_;  ///< files of them that were looked after
  std::unordered_set<std::string> waiting_;     ///< files that write() makes, canonical
  std::unordered_set<AnyId> saved_;
  std::unordered_map<std::string, AnyId> owners_;  ///< of files
  std::vector<fs::path> library_;                  ///< canonical
};

}  // namespace

Result<std::string> print(const Snapshot& snapshot, AnyId id, const fs::path& file,
                          const std::vector<fs::path>& library) {
  return Saver(snapshot, library).print(snapshot, id, file);
}

Result<std::vector<fs::path>> save(Transaction& tx, AnyId id, const fs::path& file,
                                   const std::vector<fs::path>& library,
                                   const SaveOptions& options) {
  Saver saver(tx.now(), library, options);
  RMP_TRY_ASSIGN(auto written, saver.save(tx, id, file));
  RMP_TRY(saver.write());
  return written;
}

Result<std::vector<fs::path>> save_all(Transaction& tx,
                                       const std::vector<std::pair<AnyId, fs::path>>& wanted,
                                       const std::vector<fs::path>& library,
                                       const SaveOptions& options) {
  Saver saver(tx.now(), library, options);
  std::vector<fs::path> written;
  for (const auto& [id, file] : wanted) {
    if (saver.has_saved(id)) continue;  // beside one that refers to it
    RMP_TRY_ASSIGN(auto files, saver.save(tx, id, file));
    written.insert(written.end(), files.begin(), files.end());
  }
  RMP_TRY(saver.write());
  return written;
}

}  // namespace robomosp::io
