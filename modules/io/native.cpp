// SPDX-License-Identifier: Apache-2.0
#include "io/native.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "document/validate.h"
#include "io/bind.h"
#include "io/legacy.h"
#include "io/print.h"
#include "io/syntax.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using document::Snapshot;
using document::Transaction;
using text::quote;

std::string canonical_name(const fs::path& file) {
  std::error_code ec;
  const fs::path p = fs::weakly_canonical(fs::absolute(file, ec), ec);
  return (ec ? file.lexically_normal() : p).generic_string();
}

bool is_file(const fs::path& p) {
  std::error_code ec;
  return fs::exists(p, ec) && !fs::is_directory(p, ec);
}

/// One file of a load, from its text to its id.
struct File {
  std::string shown;  ///< in messages
  std::string key;    ///< canonical path; "" for a text without file
  fs::path folder;    ///< references are relative to it
  std::string text;
  Syntax syntax;
  Bound bound;
  std::vector<std::size_t> targets;  ///< of the references: index in Loader::nodes_
};

/// Reads files and what they refer to, depth first with an explicit stack; the document is
/// touched only when all is known to be right.
class Loader {
 public:
  Loader(Transaction& transaction, const std::vector<fs::path>& library,
         const MemoryFiles* memory = nullptr)
      : tx_(transaction), library_(library), memory_(memory) {
    const Snapshot& now = tx_.now();
    for (const AnyId id : now.list())
      if (const auto& file = now.find(id)->file; !file.empty()) known_.emplace(file, id);
  }

  Result<Loaded> load_file(const fs::path& file) {
    std::vector<fs::path> tried{file};
    if (file.is_relative())
      for (const auto& folder : library_) tried.push_back(folder / file);
    const auto found = std::find_if(tried.begin(), tried.end(), is_file);
    const fs::path& path = found == tried.end() ? file : *found;
    RMP_TRY_ASSIGN(const std::size_t root, open(path, path.generic_string()));
    return run(root);
  }

  Result<Loaded> load_text(std::string_view content, const std::string& shown,
                           const fs::path& folder) {
    RMP_TRY_ASSIGN(const std::size_t root, add_file(std::string(content), shown, "", folder));
    return run(root);
  }

  Result<Loaded> load_memory(const std::string& main, const std::string& shown,
                             const fs::path& folder) {
    memory_shown_ = shown;
    memory_folder_ = folder;
    if (!memory_->texts.contains(main))
      return error(ErrorCode::not_found, "there is no " + quote(main) + " in " + quote(shown));
    RMP_TRY_ASSIGN(const std::size_t root, open_memory(main));
    return run(root);
  }

 private:
  /// A file read now, or a record that was in the document before.
  struct Node {
    std::unique_ptr<File> file;
    AnyId id;
  };

  Result<std::size_t> open(const fs::path& path, const std::string& shown) {
    const std::string key = canonical_name(path);
    if (const auto it = opened_.find(key); it != opened_.end()) return it->second;
    if (const auto it = known_.find(key); it != known_.end()) {
      nodes_.push_back({nullptr, it->second});
      opened_.emplace(key, nodes_.size() - 1);
      return nodes_.size() - 1;
    }
    RMP_TRY_ASSIGN(std::string content, read_file(path));
    return add_file(std::move(content), shown, key, path.parent_path());
  }

  Result<std::size_t> open_memory(const std::string& name) {
    const std::string key = "\n" + name;  // no path has a line end in front
    if (const auto it = opened_.find(key); it != opened_.end()) return it->second;
    RMP_TRY_ASSIGN(const std::size_t node,
                   add_file(memory_->texts.find(name)->second, memory_shown_ + "/" + name, "",
                            memory_folder_));
    opened_.emplace(key, node);
    return node;
  }

  Result<std::size_t> add_file(std::string content, const std::string& shown,
                               const std::string& key, const fs::path& folder) {
    auto file = std::make_unique<File>();
    file->shown = shown;
    file->key = key;
    file->folder = folder;
    file->text = std::move(content);
    RMP_TRY_ASSIGN(file->syntax, parse(shown, file->text));
    RMP_TRY_ASSIGN(file->bound, bind(file->syntax));
    file->bound.record.file = key;
    for (const GeometryReference& g : file->bound.geometries) {
      RMP_TRY_ASSIGN(std::get<model::Solid>(file->bound.record.body).nodes[g.node].geometry,
                     geometry(*file, g));
    }
    RMP_TRY(check(*file));
    nodes_.push_back({std::move(file), {}});
    if (!key.empty()) opened_.emplace(key, nodes_.size() - 1);
    return nodes_.size() - 1;
  }

  /// Checks the record as the document would, with a stand-in for each reference.
  static Result<void> check(const File& file) {
    model::Record record = file.bound.record;
    for (const Reference& r : file.bound.references) r.set(record.body, {r.kinds.front(), 1});
    document::Subject subject;
    auto checked = document::check_record(record, &subject);
    if (checked.ok()) return {};
    const auto place = file.bound.places.find({subject.list, subject.index});
    const std::uint32_t offset =
        place == file.bound.places.end() ? file.syntax.kind_offset : place->second;
    return file.syntax.at(offset, checked.error().code, checked.error().message,
                          checked.error().hint);
  }

  /// The file that a path in another file means.
  Result<fs::path> find(const File& from, const std::string& name, std::uint32_t offset,
                        const std::string& owner) {
    const fs::path path(name);
    std::vector<fs::path> tried{path.is_absolute() ? path : from.folder / path};
    if (path.is_relative())
      for (const auto& folder : library_) tried.push_back(folder / path);
    const auto found = std::find_if(tried.begin(), tried.end(), is_file);
    if (found != tried.end()) return *found;
    std::vector<std::string> folders;
    for (const auto& t : tried) folders.push_back(quote(folder_name(t)));
    folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
    return from.syntax.at(offset, ErrorCode::not_found,
                          "there is no file " + quote(name) + ", which " + owner + " of " +
                              quote(from.shown) + " refers to",
                          "Looked in " + text::enumerate(folders) + ".");
  }

  /// What an imported node holds; a file is read once, however many nodes share it.
  Result<GeometryPtr> geometry(const File& from, const GeometryReference& g) {
    const auto with_source = [&g](const GeometryPtr& same) {
      if (g.source.empty() || same->source == g.source) return same;
      auto copy = std::make_shared<CsgGeometry>(*same);
      copy->source = g.source;
      return GeometryPtr(std::move(copy));
    };
    if (memory_ && from.key.empty())
      if (const auto it = memory_->geometries.find(g.path); it != memory_->geometries.end())
        return with_source(it->second);
    const auto& node = std::get<model::Solid>(from.bound.record.body).nodes[g.node];
    RMP_TRY_ASSIGN(const fs::path path, find(from, g.path, g.offset, "node " + quote(node.name)));
    GeometryPtr& known = geometries_[canonical_name(path) + "\n" + g.source];
    if (known) return known;
    auto read = read_geometry(path, g.source);
    if (!read.ok()) {
      const Error& e = read.error();
      const std::string what = e.where.empty() ? std::string() : quote(g.path) + ": ";
      return from.syntax.at(g.offset, e.code, what + e.message, e.hint);
    }
    return known = *read;
  }

  Result<std::size_t> follow(const File& from, const Reference& r) {
    const bool in_memory = memory_ && from.key.empty() && memory_->texts.contains(r.path);
    std::size_t node = 0;
    if (in_memory) {
      RMP_TRY_ASSIGN(node, open_memory(r.path));
    } else {
      RMP_TRY_ASSIGN(const fs::path found, find(from, r.path, r.offset, r.owner));
      RMP_TRY_ASSIGN(node, open(found, found.lexically_normal().generic_string()));
    }
    const Kind kind =
        nodes_[node].file ? nodes_[node].file->bound.record.kind() : nodes_[node].id.kind;
    if (std::find(r.kinds.begin(), r.kinds.end(), kind) == r.kinds.end())
      return from.syntax.at(r.offset, ErrorCode::invalid_argument,
                            "the file " + quote(r.path) + " holds " +
                                document::with_article(to_string(kind)) + ", but " + r.owner +
                                " needs " + document::with_article(to_string(r.kinds.front())));
    return node;
  }
  static std::string folder_name(const fs::path& file) {
    const fs::path folder = file.parent_path().lexically_normal();
    return folder.empty() ? "." : folder.generic_string();
  }

  Result<Loaded> run(std::size_t root) {
    struct Step {
      std::size_t node, next = 0;
    };
    std::vector<std::size_t> order;  // dependencies first
    std::unordered_set<std::size_t> open_nodes, done;
    std::vector<Step> path{{root}};
    open_nodes.insert(root);
    while (!path.empty()) {
      const std::size_t node = path.back().node;
      const std::size_t next = path.back().next++;
      File* file = nodes_[node].file.get();
      if (!file || next == file->bound.references.size()) {
        open_nodes.erase(node);
        done.insert(node);
        order.push_back(node);
        path.pop_back();
        continue;
      }
      const Reference& r = file->bound.references[next];
      RMP_TRY_ASSIGN(const std::size_t target, follow(*file, r));
      file->targets.push_back(target);
      if (open_nodes.contains(target)) {
        std::string circle;
        bool is_inside = false;
        for (const Step& s : path) {
          is_inside = is_inside || s.node == target;
          if (is_inside) circle += nodes_[s.node].file->shown + " > ";
        }
        return file->syntax.at(
            r.offset, ErrorCode::conflict,
            "these files refer to each other in a circle: " + circle + nodes_[target].file->shown,
            "An object cannot be a part of itself.");
      }
      if (done.contains(target)) continue;
      open_nodes.insert(target);
      path.push_back({target});
    }
    return add_records(order);
  }

  Result<Loaded> add_records(const std::vector<std::size_t>& order) {
    Loaded loaded;
    std::vector<AnyId> added;
    for (const std::size_t i : order) {
      Node& node = nodes_[i];
      if (node.file) {
        auto id = add_record(*node.file, added, loaded.notes);
        if (!id.ok()) {
          for (auto it = added.rbegin(); it != added.rend(); ++it) (void)tx_.remove(*it).ok();
          return std::move(id).error().in(node.file->shown);
        }
        node.id = *id;
        added.push_back(*id);
      } else if (i == order.back()) {
        loaded.notes.push_back(tx_.now().describe(node.id) +
                               " was loaded before and is used as it is.");
      }
      loaded.all.push_back(node.id);
    }
    loaded.id = loaded.all.back();
    for (const AnyId id : added) note_absent_worlds(id, loaded.notes);
    return loaded;
  }

  /// Which worlds the expressions of a record use that are not there, so that old values stay.
  void note_absent_worlds(AnyId id, std::vector<std::string>& notes) const {
    const auto worlds = tx_.now().world_parameters();
    std::vector<std::string> absent;
    for (const auto& n : model::world_mentions(tx_.now().find(id)->body))
      if (!worlds(n)) absent.push_back(Expression::spell(n));
    if (absent.empty()) return;
    notes.push_back(
        "The expressions of " + tx_.now().describe(id) + " use " + text::enumerate(absent) +
        " of a world that is not loaded; " +
        (absent.size() == 1 ? "its last value is kept." : "their last values are kept."));
  }

  /// A world that gets another name takes those with it that were loaded for it.
  Result<void> follow_world(const std::vector<AnyId>& added, const std::string& from,
                            model::Record& world) {
    const auto follow = [&](const Expression::Name& n) {
      return n.scope == from ? Expression::Name{world.name, n.name} : n;
    };
    model::rename_in(world.body, follow);
    for (const AnyId id : added) {
      const auto mentions = model::world_mentions(tx_.now().find(id)->body);
      if (std::any_of(mentions.begin(), mentions.end(),
                      [&](const auto& n) { return n.scope == from; }))
        RMP_TRY(tx_.edit(id, [&](model::Record& r) -> Result<void> {
          model::rename_in(r.body, follow);
          return {};
        }));
    }
    return {};
  }

  Result<AnyId> add_record(File& file, const std::vector<AnyId>& added,
                           std::vector<std::string>& notes) {
    model::Record record = std::move(file.bound.record);
    for (std::size_t k = 0; k < file.targets.size(); ++k)
      file.bound.references[k].set(record.body, nodes_[file.targets[k]].id);
    const std::string wanted = record.name;
    record.name = tx_.free_name(record.kind(), wanted);
    if (record.name != wanted)
      notes.push_back("The " + std::string(to_string(record.kind())) + " of " + quote(file.shown) +
                      " is named " + quote(record.name) + " here, since there is a " +
                      quote(wanted) + " already.");
    if (record.name != wanted && record.kind() == Kind::world)
      RMP_TRY(follow_world(added, wanted, record));
    return tx_.add(std::move(record));
  }

  Transaction& tx_;
  const std::vector<fs::path>& library_;
  const MemoryFiles* memory_;  ///< may be none
  std::string memory_shown_;
  fs::path memory_folder_;
  std::unordered_map<std::string, GeometryPtr> geometries_;  ///< file and source -> what it holds
  std::unordered_map<std::string, AnyId> known_;             ///< file -> record of the document
  std::unordered_map<std::string, std::size_t> opened_;      ///< file -> node
  std::deque<Node> nodes_;  ///< stable: references into it are kept
};

bool starts_with(const fs::path& path, const fs::path& folder) {
  const auto [p, f] = std::mismatch(path.begin(), path.end(), folder.begin(), folder.end());
  return f == folder.end() && p != path.end();
}

/// How `from` (a file) refers to `target` (canonical): through a library folder when the target
/// lies in one that `from` does not lie in, else relative to the folder of `from`.
std::string relative_path(const fs::path& target, const fs::path& from,
                          const std::vector<fs::path>& library) {
  const fs::path relative = target.lexically_relative(from.parent_path());
  for (const auto& entry : library) {
    const fs::path folder = canonical_name(entry);
    if (!starts_with(target, folder) || starts_with(from, folder)) continue;
    const fs::path inside = target.lexically_relative(folder);
    if (!is_file(from.parent_path() / inside))
      return inside.generic_string();  // else it would be hidden
  }
  return (relative.empty() ? target : relative).generic_string();
}

Result<std::string> print_with(const Snapshot& snapshot, AnyId id, const fs::path& file,
                               const std::vector<fs::path>& library,
                               const std::unordered_map<AnyId, std::string>& planned) {
  const model::Record* record = snapshot.find(id);
  if (!record)
    return error(ErrorCode::stale_handle, snapshot.describe(id) + " cannot be saved",
                 "Look it up again by its name.");
  const fs::path from = canonical_name(file);
  const auto file_of = [&](AnyId target) {
    const auto it = planned.find(target);
    return it != planned.end() ? it->second : snapshot.find(target)->file;
  };
  RMP_TRY_ASSIGN(std::string text, print_record(snapshot, *record, from, [&](AnyId target) {
                   return relative_path(file_of(target), from, library);
                 }));
  // What is written must be readable: a description may hold bytes that are no text.
  if (const auto again = parse(file.filename().generic_string(), text); !again.ok())
    return error(
        ErrorCode::invalid_argument,
        snapshot.describe(id) +
            " cannot be saved, for its file could not be read again: " + again.error().message,
        "Correct its texts: they must be UTF-8.", again.error().where);
  return text;
}

/// Where each record goes: the wanted one, and those never saved that it needs.
struct Plan {
  std::unordered_map<AnyId, std::string> files;
  std::vector<AnyId> order;  ///< dependencies first
};

Result<Plan> plan_files(const Snapshot& now, AnyId id, const fs::path& file) {
  if (!now.find(id))
    return error(ErrorCode::stale_handle, now.describe(id) + " cannot be saved",
                 "Look it up again by its name.");
  std::unordered_map<std::string, AnyId> owners;
  for (const AnyId other : now.list())
    if (const auto& f = now.find(other)->file; !f.empty()) owners.emplace(f, other);
  const std::string main = canonical_name(file);
  Plan plan{{{id, main}}, {}};
  std::unordered_set<std::string> taken{main};
  std::vector<std::pair<AnyId, std::size_t>> path{{id, 0}};
  std::unordered_set<AnyId> seen{id};
  while (!path.empty()) {
    const AnyId current = path.back().first;
    std::vector<AnyId> targets;
    model::for_each_reference(now.find(current)->body,
                              [&](AnyId t, std::string_view) { targets.push_back(t); });
    if (path.back().second == targets.size()) {
      plan.order.push_back(current);
      path.pop_back();
      continue;
    }
    const AnyId target = targets[path.back().second++];
    const model::Record* record = now.find(target);
    if (!record)
      return error(ErrorCode::stale_handle,
                   now.describe(current) + " refers to " + now.describe(target));
    if (!record->file.empty() || !seen.insert(target).second) continue;
    std::string beside;
    for (int k = 1;; ++k) {
      const std::string stem = record->name + (k > 1 ? "_" + std::to_string(k) : std::string());
      beside = canonical_name(file.parent_path() / (stem + std::string(extension(target.kind))));
      if (!taken.contains(beside) && !owners.contains(beside) && !is_file(beside)) break;
    }
    taken.insert(beside);
    plan.files.emplace(target, beside);
    path.emplace_back(target, 0);
  }
  return plan;
}

/// The geometry files of a solid that is saved at `file`, each once.
Result<void> add_geometries(const model::Record& record, const fs::path& file,
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

}  // namespace

std::string_view extension(Kind kind) {
  switch (kind) {
    case Kind::material: return ".mtr";
    case Kind::solid: return ".csg";
    case Kind::object: return ".part";
    case Kind::robot: return ".rbt";
    case Kind::trajectory: return ".tjc";
    case Kind::world: return ".wld";
    case Kind::task: return ".tsk";
  }
  return "";
}

Result<Loaded> load(Transaction& tx, const fs::path& file, const std::vector<fs::path>& library,
                    std::optional<Kind> wanted) {
  if (is_legacy_file(file)) return load_legacy(tx, file, wanted);
  return Loader(tx, library).load_file(file);
}

Result<Loaded> load_text(Transaction& tx, std::string_view text, const std::string& shown,
                         const fs::path& folder, const std::vector<fs::path>& library) {
  return Loader(tx, library).load_text(text, shown, folder);
}

Result<Loaded> load_memory(Transaction& tx, const MemoryFiles& files, const std::string& main,
                           const std::string& shown, const fs::path& folder,
                           const std::vector<fs::path>& library) {
  return Loader(tx, library, &files).load_memory(main, shown, folder);
}

Result<std::string> print(const Snapshot& snapshot, AnyId id, const fs::path& file,
                          const std::vector<fs::path>& library) {
  RMP_TRY_ASSIGN(const Plan plan, plan_files(snapshot, id, file));
  return print_with(snapshot, id, file, library, plan.files);
}

Result<std::vector<fs::path>> save(Transaction& tx, AnyId id, const fs::path& wanted,
                                   const std::vector<fs::path>& library) {
  const Snapshot& now = tx.now();
  fs::path file = wanted;
  if (file.filename().empty())
    return error(ErrorCode::invalid_argument,
                 quote(wanted.generic_string()) + " is a folder, not a file to save to",
                 "Add a file name.");
  if (!file.has_extension()) file += extension(id.kind);

  RMP_TRY_ASSIGN(const Plan plan, plan_files(now, id, file));
  for (const AnyId other : now.list())
    if (other != id && now.find(other)->file == plan.files.at(id))
      return error(
          ErrorCode::conflict,
          "the file " + quote(file.generic_string()) + " belongs to " + now.describe(other),
          "Choose another file.");
  std::vector<std::pair<fs::path, std::string>> texts;
  std::vector<std::pair<fs::path, std::string>> geometries;
  for (const AnyId each : plan.order) {
    const std::string& target = plan.files.at(each);
    RMP_TRY_ASSIGN(std::string text, print_with(now, each, target, library, plan.files));
    texts.emplace_back(each == id ? file : fs::path(target), std::move(text));
    RMP_TRY(add_geometries(*now.find(each), target, geometries));
  }
  std::vector<fs::path> written;
  for (const auto& [target, bytes] : geometries) {
    // The name tells the content: what stands there already is the same, unless it was damaged.
    const auto there = read_file(target, bytes.size());
    if (!there.ok() || *there != bytes) RMP_TRY(write_file(target, bytes));
    written.push_back(target);
  }
  for (const auto& [target, text] : texts) {
    RMP_TRY(write_file(target, text));
    written.push_back(target);
  }
  for (const AnyId each : plan.order)
    RMP_TRY(tx.edit(each, [&](model::Record& r) -> Result<void> {
      r.file = plan.files.at(each);
      return {};
    }));
  return written;
}

}  // namespace robomosp::io
