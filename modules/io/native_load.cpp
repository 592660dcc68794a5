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
#include "io/file_names.h"
#include "io/legacy.h"
#include "io/syntax.h"
#include "kernel/text.h"

namespace robomosp::io {

namespace {

namespace fs = std::filesystem;
using document::Snapshot;
using document::Transaction;
using text::quote;

/// One file of a load, from its text to its id.
struct File {
  std::string shown;  ///< in messages
  std::string key;    ///< canonical path; "" for a text without file
  fs::path folder;    ///< references are relative to it
  std::string text;
  Syntax syntax;
  Bound bound;
  std::vector<std::size_t> targets;  ///< of the references: index in Loader::nodes_
  AnyId again;                       ///< the record that it is read for again; none = a new one
};

/// Reads files and what they refer to, depth first with an explicit stack; the document is
/// touched only when all is known to be right.
class Loader {
 public:
  Loader(Transaction& transaction, const std::vector<fs::path>& library,
         const MemoryFiles* memory = nullptr, Reload reload = Reload::no)
      : tx_(transaction), library_(library), memory_(memory), reload_(reload) {
    const Snapshot& now = tx_.now();
    for (const AnyId id : now.list())
      if (const auto& file = now.find(id)->file; !file.empty()) known_.emplace(file, id);
  }

  Result<Loaded> load_file(const fs::path& file) {
    std::vector<fs::path> tried{file};
    // In a confined session all names are absolute; those below its folder were relative.
    const FileRoot* root_folder = current_file_root();
    const fs::path given = root_folder ? fs::path(root_folder->shown_name(file.string())) : file;
    if (given.is_relative())
      for (const auto& folder : library_) tried.push_back(folder / given);
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

  void keep_added() { keeps_added_ = true; }
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
    if (const auto it = known_.find(key); it != known_.end()) return open_known(path, shown, *it);
    RMP_TRY_ASSIGN(std::string content, read_file(path));
    return add_file(std::move(content), shown, key, path.parent_path());
  }

  /// A file whose record is in the document: that record, or what the file holds now.
  Result<std::size_t> open_known(const fs::path& path, const std::string& shown,
                                 const std::pair<const std::string, AnyId>& known) {
    const auto& [key, id] = known;
    const bool is_asked_for = nodes_.empty();
    const model::Record& record = *tx_.now().find(id);
    auto content = read_file(path);
    if (!content.ok() && is_asked_for && reload_ == Reload::yes) return content.error();
    const bool is_changed =
        content.ok() && record.disk != Fingerprint() && record.disk != file_fingerprint(*content);
    if (content.ok() &&
        ((is_changed && reload_ != Reload::no) || (is_asked_for && reload_ == Reload::yes))) {
      RMP_TRY_ASSIGN(const std::size_t node,
                     add_file(std::move(*content), shown, key, path.parent_path()));
      File& file = *nodes_[node].file;
      if (const Kind kind = file.bound.record.kind(); kind != id.kind)
        return file.syntax.at(file.syntax.kind_offset, ErrorCode::conflict,
                              "the file holds " + document::with_article(to_string(kind)) +
                                  " now, and " + tx_.now().describe(id) + " came from it",
                              "Remove that one first.");
      file.again = id;
      return node;
    }
    if (is_changed)
      warnings_.push_back("The file " + quote(shown) + " was changed on the disk since " +
                          tx_.now().describe(id) +
                          " was read from it or saved to it; the record is used unchanged. Load "
                          "with reload = true to read it again.");
    else if (!content.ok() && content.error().code == ErrorCode::not_found)
      warnings_.push_back("The file " + quote(shown) + " no longer exists; " +
                          tx_.now().describe(id) + " is used unchanged.");
    nodes_.push_back({nullptr, id});
    opened_.emplace(key, nodes_.size() - 1);
    return nodes_.size() - 1;
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
    if (!key.empty()) file->bound.record.disk = file_fingerprint(file->text);
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
    if (const auto permitted = permitted_path(tried.front(), Effect::files_read);
        !permitted.ok() && permitted.error().code == ErrorCode::permission)
      return from.syntax.at(offset, ErrorCode::permission,
                            quote(name) + ", which " + owner + " of " + quote(from.shown) +
                                " refers to, is outside the folder of this session's files",
                            permitted.error().hint);
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
      // Worlds name the same few files very often: the disk is asked for each of them once.
      const std::string asked = from.folder.native() + "\n" + r.path;
      const auto known = followed_.find(asked);
      if (known != followed_.end()) {
        node = known->second;
      } else {
        RMP_TRY_ASSIGN(const fs::path found, find(from, r.path, r.offset, r.owner));
        RMP_TRY_ASSIGN(node, open(found, found.lexically_normal().generic_string()));
        followed_.emplace(asked, node);
      }
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
      if (file && next == 0) file->targets.clear();  // of an attempt that failed
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
            "An object cannot contain itself.");
      }
      if (done.contains(target)) continue;
      open_nodes.insert(target);
      path.push_back({target});
    }
    return add_records(order);
  }

  Result<Loaded> add_records(const std::vector<std::size_t>& order) {
    Loaded loaded;
    loaded.warnings = std::move(warnings_);
    std::vector<AnyId> added;
    std::vector<std::pair<AnyId, model::Record>> again;  // as they were
    for (const std::size_t i : order) {
      Node& node = nodes_[i];
      if (node.file) {
        const AnyId old = node.file->again;
        if (old) again.emplace_back(old, *tx_.now().find(old));
        auto id = old ? replace_record(*node.file, loaded.notes)
                      : add_record(*node.file, added, loaded.notes);
        if (!id.ok()) {
          take_back(added, again);
          return std::move(id).error().in(node.file->shown);
        }
        node.id = *id;
        node.file.reset();  // from now on it is a record like others
        if (!old) added.push_back(*id);
      } else if (i == order.back() && !memory_) {
        loaded.notes.push_back(tx_.now().describe(node.id) +
                               " was loaded before and is used unchanged.");
      }
      loaded.all.push_back(node.id);
    }
    loaded.id = loaded.all.back();
    for (const AnyId id : added) note_absent_worlds(id, loaded.notes);
    return loaded;
  }

  void take_back(const std::vector<AnyId>& added,
                 const std::vector<std::pair<AnyId, model::Record>>& again) {
    if (keeps_added_) return;
    for (auto it = again.rbegin(); it != again.rend(); ++it)
      (void)tx_.edit(it->first, [&](model::Record& r) -> Result<void> {
        r = it->second;
        return {};
      });
    for (auto it = added.rbegin(); it != added.rend(); ++it) (void)tx_.remove(*it).ok();
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

  /// Of two solvers of one name with different texts the one that comes later gets a free name, and
  /// the choices of its record follow. `self` is the record that it replaces, if any.
  void rename_solvers(model::Record& record, AnyId self, std::vector<std::string>& notes) const {
    const Snapshot& now = tx_.now();
    const auto clashes = [&](const model::KeptSolver& s, const std::string& name) {
      for (const AnyId id : now.list())
        if (id != self)
          for (const model::KeptSolver& other : now.find(id)->solvers)
            if (other.interface == s.interface && other.name == name &&
                (other.text != s.text || name != s.name))
              return true;
      return false;
    };
    for (model::KeptSolver& s : record.solvers) {
      if (!clashes(s, s.name)) continue;
      const std::string old = s.name;
      const auto is_own = [&](const std::string& name) {
        return std::any_of(record.solvers.begin(), record.solvers.end(), [&](const auto& own) {
          return own.interface == s.interface && own.name == name;
        });
      };
      std::string name;
      int count = 1;
      do name = old + "_" + std::to_string(++count);
      while (clashes(s, name) || is_own(name));
      if (s.provides.empty()) s.provides = old;
      s.name = name;
      model::rename_choices(record.body, s.interface, old, name);
      notes.push_back("The solver " + quote(old) + " of " + s.interface + " that the " +
                      std::string(to_string(record.kind())) + " " + quote(record.name) +
                      " keeps is named " + quote(name) +
                      " here, since the document keeps another " + quote(old) + " already.");
    }
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
    rename_solvers(record, {}, notes);
    return tx_.add(std::move(record));
  }

  /// Gives the record that came from a file what the file holds now.
  Result<AnyId> replace_record(File& file, std::vector<std::string>& notes) {
    model::Record record = std::move(file.bound.record);
    for (std::size_t k = 0; k < file.targets.size(); ++k)
      file.bound.references[k].set(record.body, nodes_[file.targets[k]].id);
    const std::string old = tx_.now().find(file.again)->name;
    if (record.name != old && tx_.now().find(record.kind(), record.name)) {
      notes.push_back("The " + std::string(to_string(record.kind())) + " of " + quote(file.shown) +
                      " is still named " + quote(old) + " here, since there is a " +
                      quote(record.name) + " already.");
      record.name = old;
    }
    rename_solvers(record, file.again, notes);
    RMP_TRY(tx_.edit(file.again, [&](model::Record& r) -> Result<void> {
      r = std::move(record);
      return {};
    }));
    notes.push_back(tx_.now().describe(file.again) + " was read again from its file.");
    return file.again;
  }

  Transaction& tx_;
  const std::vector<fs::path>& library_;
  const MemoryFiles* memory_;  ///< may be none
  Reload reload_;
  std::vector<std::string> warnings_;
  bool keeps_added_ = false;  ///< what was added before a fault stays
  std::string memory_shown_;
  fs::path memory_folder_;
  std::unordered_map<std::string, GeometryPtr> geometries_;  ///< file and source -> what it holds
  std::unordered_map<std::string, AnyId> known_;             ///< file -> record of the document
  std::unordered_map<std::string, std::size_t> opened_;      ///< file -> node
  std::unordered_map<std::string, std::size_t> followed_;    ///< folder and path in a file -> node
  std::deque<Node> nodes_;  ///< stable: references into it are kept
};

}  // namespace

std::string_view extension(Kind kind) { return model::info(kind).extension; }

Result<Loaded> load(Transaction& tx, const fs::path& file, const std::vector<fs::path>& library,
                    std::optional<Kind> wanted, Reload reload) {
  if (is_legacy_file(file)) return load_legacy(tx, file, wanted);
  return Loader(tx, library, nullptr, reload).load_file(file);
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

std::vector<Result<Loaded>> load_memory(Transaction& tx, const MemoryFiles& files,
                                        const std::vector<std::string>& names,
                                        const std::string& shown, const fs::path& folder,
                                        const std::vector<fs::path>& library) {
  Loader loader(tx, library, &files);
  loader.keep_added();
  std::vector<Result<Loaded>> out;
  out.reserve(names.size());
  for (const std::string& name : names) out.push_back(loader.load_memory(name, shown, folder));
  return out;
}

}  // namespace robomosp::io
