// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/navigator_model.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "viewer/desktop/navigator_node.h"
#include "viewer/desktop/thumbnails.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

using ioci::Topic;

/// Parts that are asked for together.
constexpr std::size_t kPage = 500;
/// Lists of up to so many robots, trajectories, tasks and programs have no row of their own.
constexpr std::size_t kFewMembers = 20;
constexpr int kCheckAfterMs = 600;

std::string key_of(const Handle& h) { return h.kind + "#" + std::to_string(h.number); }

/// Sections of kinds, in the order of the tree. Worlds stand above without a section.
struct SectionOf {
  const char* kind;
  const char* title;
};
constexpr std::array kSections{SectionOf{"robot", "Robots"},
                               SectionOf{"object", "Objects"},
                               SectionOf{"solid", "Solids"},
                               SectionOf{"trajectory", "Trajectories"},
                               SectionOf{"task", "Tasks"},
                               SectionOf{"program", "Programs"},
                               SectionOf{"controller", "Controllers"},
                               SectionOf{"material", "Materials"}};
constexpr std::array kLibrary{SectionOf{"world", "Worlds"}, SectionOf{"robot", "Robots"},
                              SectionOf{"object", "Objects"}, SectionOf{"solid", "Solids"},
                              SectionOf{"material", "Materials"}};

/// Rows of the columns of a recording.
constexpr const char* kColumnKind = "column";

bool has_outline(std::string_view kind) { return kind != "material" && kind != "controller"; }

bool is_inline_in_world(std::string_view group) {
  return group == "robots" || group == "trajectories" || group == "tasks" || group == "programs";
}

std::string_view icon_of_part(const std::string& kind, const std::string& detail) {
  if (kind == "segment")
    return detail == "line"     ? "segment_line"
           : detail == "circle" ? "segment_circle"
           : detail == "arc"    ? "segment_arc"
                                : "trajectory";
  if (kind == "node") {
    for (const char* known : {"box", "cylinder", "union", "difference", "fillet", "pattern"})
      if (detail.find(known) != std::string::npos) return known;
    return "solid";
  }
  if (kind == "step") return detail == "wait" ? "wait" : detail == "set" ? "set_signal" : "action";
  if (kind == "link") return "link";
  return icon_of_kind(kind);
}

}  // namespace

NavigatorModel::NavigatorModel(Desk& desk, QObject* parent)
    : QAbstractItemModel(parent), desk_(desk), root_(std::make_unique<Node>()) {
  record_timer_.setSingleShot(true);
  check_timer_.setSingleShot(true);
  connect(&record_timer_, &QTimer::timeout, this, [this] {
    if (std::exchange(records_wanted_, false)) ask_records();
    if (std::exchange(others_wanted_, false)) ask_others();
  });
  connect(&check_timer_, &QTimer::timeout, this, [this] { ask_faults(); });
  std::vector<NodePtr> wanted;
  auto library = std::make_unique<Node>();
  library->type = RowType::section;
  library->key = "library";
  library->name = "Library";
  library->kind = "section";
  library->icon = "library";
  library->load = Node::Load::done;
  wanted.push_back(std::move(library));
  merge(*root_, std::move(wanted));
  std::vector<NodePtr> shelves;
  for (const SectionOf& s : kLibrary) {
    auto shelf = std::make_unique<Node>();
    shelf->type = RowType::section;
    shelf->key = s.kind;
    shelf->name = s.title;
    shelf->kind = s.kind;
    shelf->icon = s.kind;
    shelf->load = Node::Load::wanted;
    shelves.push_back(std::move(shelf));
  }
  merge(*root_->children.front(), std::move(shelves));
  desk_.events.add(this, [this](const ioci::Event& e) { take(e); });
  desk_.unsaved_changed.add(this, [this] {
    for (const NodePtr& top : root_->children) {
      changed(*top);
      if (top->type != RowType::section || top->children.empty()) continue;
      const Node &first = *top->children.front(), &last = *top->children.back();
      if (first.type == RowType::record) dataChanged(index_of(first), index_of(last));
    }
  });
  ask_records();
  ask_others();
}

NavigatorModel::~NavigatorModel() = default;

// --- rows ------------------------------------------------------------------------------------

NavigatorModel::Node* NavigatorModel::node_of(const QModelIndex& index) const {
  return index.isValid() ? static_cast<Node*>(index.internalPointer()) : root_.get();
}

QModelIndex NavigatorModel::index_of(const Node& node) const {
  return &node == root_.get() ? QModelIndex() : createIndex(node.row, 0, const_cast<Node*>(&node));
}

QModelIndex NavigatorModel::index(int row, int column, const QModelIndex& parent) const {
  const Node* above = node_of(parent);
  if (column != 0 || row < 0 || static_cast<std::size_t>(row) >= above->children.size()) return {};
  return createIndex(row, 0, above->children[static_cast<std::size_t>(row)].get());
}

QModelIndex NavigatorModel::parent(const QModelIndex& index) const {
  const Node* node = node_of(index);
  return node->parent ? index_of(*node->parent) : QModelIndex();
}

int NavigatorModel::rowCount(const QModelIndex& parent) const {
  return static_cast<int>(node_of(parent)->children.size());
}

bool NavigatorModel::hasChildren(const QModelIndex& parent) const {
  const Node* node = node_of(parent);
  return !node->children.empty() || node->load == Node::Load::wanted;
}

bool NavigatorModel::canFetchMore(const QModelIndex& parent) const {
  const Node* node = node_of(parent);
  if (node->load == Node::Load::asked) return false;
  return node->load == Node::Load::wanted ||
         (node->type == RowType::group && node->children.size() < node->count);
}

void NavigatorModel::fetchMore(const QModelIndex& parent) {
  Node* node = node_of(parent);
  if (!canFetchMore(parent)) return;
  if (node->type == RowType::section) ask_library(*node);
  else if (node->type == RowType::group) ask_group(*node);
  else if (node->type == RowType::other) ask_columns(*node);
  else ask_outline(*node, 0);
}

std::size_t NavigatorModel::unsaved_below(const Node& node) const {
  if (node.type == RowType::record) return desk_.is_unsaved(node.record) ? 1 : 0;
  std::size_t count = 0;
  if (node.type == RowType::section)
    for (const NodePtr& child : node.children)
      count += child->type == RowType::record && desk_.is_unsaved(child->record);
  return count;
}

QVariant NavigatorModel::data(const QModelIndex& index, int role) const {
  if (!index.isValid()) return {};
  const Node& n = *node_of(index);
  const auto faults_here = [&]() -> QString {
    const auto of = faults_.find(key_of(n.record));
    if (of == faults_.end() || (n.type != RowType::record && n.type != RowType::part)) return {};
    if (n.type == RowType::part) {
      const auto at = of->second.find(n.path);
      return at == of->second.end() ? QString() : at->second;
    }
    QStringList all;
    for (const auto& [path, sentence] : of->second) all += sentence;
    return all.join('\n');
  };
  const auto unsaved_text = [&]() -> QString {
    const std::size_t count = unsaved_below(n);
    if (count == 0) return {};
    return n.type == RowType::record ? QString("not saved") : QString("%1 not saved").arg(count);
  };
  switch (role) {
    case Qt::DisplayRole: return n.name;
    case Qt::EditRole: return n.name;
    case kPicture: {
      const Theme& t = theme();
      if (n.type != RowType::library || !thumbnails_) return {};
      return thumbnails_->small(n.kind, utf8(n.name), t.row - 2, picture_ratio);
    }
    case Qt::ToolTipRole: {
      if (n.type == RowType::library && thumbnails_) return library_tip(n);
      QString tip = n.name + (n.detail.isEmpty() ? QString() : "  " + n.detail);
      if (!memory_text(n.bytes).isEmpty())
        tip += QString("\nHolds %1 of memory, %2 % of the machine's; recording.remove frees it")
                   .arg(memory_text(n.bytes))
                   .arg(100 * n.share, 0, 'f', 1);
      if (const QString faults = faults_here(); !faults.isEmpty()) tip += '\n' + faults;
      if (const QString mark = unsaved_text(); !mark.isEmpty()) tip += '\n' + mark;
      return tip;
    }
    case Qt::AccessibleTextRole: {
      const QString mark = unsaved_text();
      return n.name + ' ' + n.detail + (mark.isEmpty() ? QString() : ", " + mark);
    }
    case kDetail: return n.detail;
    case kIcon: return shown(n.icon);
    case kKind: return shown(n.kind);
    case kIsUnsaved: return unsaved_below(n) > 0;
    case kFault: return faults_here();
    case kFaultBelow: {
      if (n.type != RowType::part || n.refers.number == 0) return false;
      return faults_.contains(key_of(n.refers));
    }
    case kIsHeavy: return n.bytes > 0 && n.share >= heavy_share;
    case kIsQuiet: return n.is_quiet;
    case kEye:
      return static_cast<int>(n.type == RowType::part && eye_of ? eye_of({n.record, n.path})
                                                                : Eye::none);
    default: return {};
  }
}

bool NavigatorModel::setData(const QModelIndex& index, const QVariant& value, int role) {
  const Node& n = *node_of(index);
  const std::string name = utf8(value.toString().trimmed());
  if (role != Qt::EditRole || name.empty() || shown(name) == n.name) return false;
  if (n.type == RowType::record) {
    desk_.act(n.record.kind + ".rename", {{"id", n.record}, {"name", name}});
  } else if (n.type == RowType::part) {
    desk_.act("record.set", {{"id", n.record}, {"path", n.path + ".name"}, {"value", name}});
  }
  return false;  // The row follows the document.
}

Qt::ItemFlags NavigatorModel::flags(const QModelIndex& index) const {
  if (!index.isValid()) return Qt::NoItemFlags;
  const Node& n = *node_of(index);
  Qt::ItemFlags flags = Qt::ItemIsEnabled | Qt::ItemIsSelectable;
  const bool may_rename = n.type == RowType::record || (n.type == RowType::part && n.is_named);
  if (may_rename) flags |= Qt::ItemIsEditable;
  if (may_drag(n)) flags |= Qt::ItemIsDragEnabled;
  if (n.type == RowType::record || n.type == RowType::part || n.type == RowType::group)
    flags |= Qt::ItemIsDropEnabled;
  return flags;
}

NavigatorModel::RowType NavigatorModel::type_of(const QModelIndex& index) const {
  return node_of(index)->type;
}

std::optional<Selected> NavigatorModel::selected_of(const QModelIndex& index) const {
  if (!index.isValid()) return std::nullopt;
  const Node& n = *node_of(index);
  switch (n.type) {
    case RowType::record:
    case RowType::other: return Selected{n.record, {}};
    case RowType::part: return Selected{n.record, n.kind == kColumnKind ? "" : n.path};
    case RowType::root:
    case RowType::section:
    case RowType::group:
    case RowType::library: break;
  }
  return std::nullopt;
}

std::optional<NavigatorModel::Shipped> NavigatorModel::shipped_of(const QModelIndex& index) const {
  const Node& n = *node_of(index);
  if (n.type != RowType::library) return std::nullopt;
  return Shipped{n.kind, utf8(n.name)};
}

void NavigatorModel::each_node(const std::function<void(Node&)>& see) const {
  std::vector<Node*> stack{root_.get()};
  while (!stack.empty()) {
    Node* node = stack.back();
    stack.pop_back();
    see(*node);
    for (auto child = node->children.rbegin(); child != node->children.rend(); ++child)
      stack.push_back(child->get());
  }
}

QModelIndexList NavigatorModel::rows_of(const Selected& what) const {
  QModelIndexList out;
  each_node([&](Node& n) {
    const bool is_it =
        (n.type == RowType::part && n.record == what.record && n.path == what.path) ||
        ((n.type == RowType::record || n.type == RowType::other) && n.record == what.record &&
         what.path.empty());
    if (is_it) out.push_back(index_of(n));
  });
  return out;
}

void NavigatorModel::load_all() {
  std::vector<Node*> wanted;
  each_node([&](Node& n) {
    if (n.load == Node::Load::wanted && n.type != RowType::other) wanted.push_back(&n);
  });
  for (Node* n : wanted) fetchMore(index_of(*n));
}

void NavigatorModel::load_parts(const Handle& record) {
  std::vector<Node*> wanted;
  each_node([&](Node& n) {
    const bool has_parts = n.type == RowType::record || n.type == RowType::part;
    if (has_parts && n.load == Node::Load::wanted && n.outlined() == record) wanted.push_back(&n);
  });
  for (Node* n : wanted) fetchMore(index_of(*n));
}

void NavigatorModel::changed(const Node& node) {
  const QModelIndex at = index_of(node);
  if (at.isValid()) dataChanged(at, at);
}

void NavigatorModel::merge(Node& node, std::vector<NodePtr> wanted) {
  const auto renumber = [&] {
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      node.children[i]->row = static_cast<int>(i);
      node.children[i]->parent = &node;
    }
  };
  const auto forget = [this](Node& gone) {
    std::vector<Node*> stack{&gone};
    while (!stack.empty()) {
      Node* n = stack.back();
      stack.pop_back();
      for (auto& [key, nodes] : by_record_) nodes.erase(n);
      for (const NodePtr& child : n->children) stack.push_back(child.get());
    }
  };
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < wanted.size(); ++i) places.emplace(wanted[i]->key, i);
  // Rows that are gone, in runs.
  for (std::size_t i = node.children.size(); i-- > 0;) {
    if (places.contains(node.children[i]->key)) continue;
    std::size_t first = i;
    while (first > 0 && !places.contains(node.children[first - 1]->key)) --first;
    beginRemoveRows(index_of(node), static_cast<int>(first), static_cast<int>(i));
    for (std::size_t k = first; k <= i; ++k) forget(*node.children[k]);
    node.children.erase(node.children.begin() + static_cast<std::ptrdiff_t>(first),
                        node.children.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    renumber();
    endRemoveRows();
    i = first;
  }
  // Rows in another order are replaced; those that stay are updated.
  std::size_t done = 0;
  while (done < wanted.size()) {
    const bool is_here =
        done < node.children.size() && node.children[done]->key == wanted[done]->key;
    if (is_here) {
      Node& old = *node.children[done];
      Node& fresh = *wanted[done];
      const bool is_other = old.name != fresh.name || old.detail != fresh.detail ||
                            old.icon != fresh.icon || old.is_quiet != fresh.is_quiet;
      old.name = fresh.name;
      old.detail = fresh.detail;
      old.icon = fresh.icon;
      old.is_quiet = fresh.is_quiet;
      old.bytes = fresh.bytes;
      old.share = fresh.share;
      old.count = fresh.count;
      if (old.refers != fresh.refers) {
        old.refers = fresh.refers;
        old.load = fresh.load;
        if (!old.children.empty()) merge(old, {});
      }
      if (is_other) changed(old);
      // Groups bring their rows along; so do rows of trees.
      if (!fresh.children.empty() || (old.type == RowType::group && fresh.count == 0) ||
          (old.type == RowType::part && old.refers.number == 0 && !old.children.empty()))
        merge(old, std::move(fresh.children));
      ++done;
      continue;
    }
    const auto elsewhere =
        std::find_if(node.children.begin() + static_cast<std::ptrdiff_t>(done), node.children.end(),
                     [&](const NodePtr& n) { return n->key == wanted[done]->key; });
    if (elsewhere != node.children.end()) {
      const auto from = static_cast<std::size_t>(elsewhere - node.children.begin());
      beginMoveRows(index_of(node), static_cast<int>(from), static_cast<int>(from), index_of(node),
                    static_cast<int>(done));
      NodePtr moved = std::move(*elsewhere);
      node.children.erase(elsewhere);
      node.children.insert(node.children.begin() + static_cast<std::ptrdiff_t>(done),
                           std::move(moved));
      renumber();
      endMoveRows();
      continue;
    }
    std::size_t last = done;
    while (last + 1 < wanted.size() &&
           std::none_of(node.children.begin(), node.children.end(),
                        [&](const NodePtr& n) { return n->key == wanted[last + 1]->key; }))
      ++last;
    beginInsertRows(index_of(node), static_cast<int>(done), static_cast<int>(last));
    for (std::size_t k = done; k <= last; ++k)
      node.children.insert(node.children.begin() + static_cast<std::ptrdiff_t>(k),
                           std::move(wanted[k]));
    renumber();
    for (std::size_t k = done; k <= last; ++k) {
      std::vector<Node*> stack{node.children[k].get()};
      while (!stack.empty()) {
        Node* n = stack.back();
        stack.pop_back();
        int row = 0;
        for (const NodePtr& child : n->children) {
          child->parent = n;
          child->row = row++;
          stack.push_back(child.get());
        }
      }
    }
    endInsertRows();
    done = last + 1;
  }
}

NavigatorModel::Node* NavigatorModel::section(const std::string& key) const {
  for (const NodePtr& n : root_->children)
    if (n->key == key) return n.get();
  return nullptr;
}

// --- records ---------------------------------------------------------------------------------

void NavigatorModel::ask_records() {
  ++asked_;
  desk_.ask("document.outline", {}, *this, [this](const Result<Value>& r) {
    --asked_;
    if (r.ok()) take_records(list_of(*r));
    loaded();
  });
}

void NavigatorModel::take_records(const List& rows) {
  std::map<std::string, std::vector<NodePtr>> by_kind;
  for (const Value& value : rows) {
    const Map& row = map_of(value);
    const auto id = handle_at(row, "id");
    if (!id) continue;
    auto node = std::make_unique<Node>();
    node->type = RowType::record;
    node->key = key_of(*id);
    node->record = *id;
    node->kind = text_at(row, "kind");
    node->icon = icon_of_kind(node->kind);
    node->name = shown(text_at(row, "name"));
    node->is_quiet = flag_at(row, "is_library");
    node->load = has_outline(node->kind) ? Node::Load::wanted : Node::Load::done;
    by_kind[node->kind].push_back(std::move(node));
  }
  std::vector<NodePtr> top = std::move(by_kind["world"]);
  const auto keep = [&](const std::string& key) {
    if (Node* old = section(key)) {
      auto same = std::make_unique<Node>();
      same->type = old->type;
      same->key = key;
      same->name = old->name;
      same->detail = old->detail;
      same->icon = old->icon;
      same->kind = old->kind;
      same->count = old->count;
      return same;
    }
    return NodePtr();
  };
  for (const SectionOf& s : kSections) {
    std::vector<NodePtr>& records = by_kind[s.kind];
    if (records.empty()) continue;
    auto node = std::make_unique<Node>();
    node->type = RowType::section;
    node->key = std::string("section ") + s.kind;
    node->name = s.title;
    node->detail = QString::number(records.size());
    node->kind = "section";
    node->icon = icon_of_kind(s.kind);
    node->load = Node::Load::done;
    node->children = std::move(records);
    top.push_back(std::move(node));
  }
  for (const char* key : {"recordings", "runs", "library"})
    if (auto same = keep(key)) top.push_back(std::move(same));  // with its rows
  merge(*root_, std::move(top));
}

void NavigatorModel::ask_outline(Node& node, std::size_t at_least) {
  const Handle record = node.outlined();
  if (record.number == 0 || node.load == Node::Load::asked) return;
  node.load = Node::Load::asked;
  by_record_[key_of(record)].insert(&node);
  ++asked_;
  desk_.ask("record.outline", {{"id", record}, {"at_most", std::max(kPage, at_least)}}, *this,
            [this, &node, record](const Result<Value>& r) {
              --asked_;
              const auto known = by_record_.find(key_of(record));
              if (known == by_record_.end() || !known->second.contains(&node)) return;
              node.load = Node::Load::done;
              if (r.ok()) take_outline(node, list_of(*r));
              loaded();
            });
}

NavigatorModel::NodePtr NavigatorModel::row_node(const Map& row, const std::string& kind,
                                                 const Handle& record) const {
  auto node = std::make_unique<Node>();
  node->type = RowType::part;
  node->kind = kind;
  node->record = record;
  node->path = text_at(row, "path");
  const std::string name = text_at(row, "name");
  const std::string detail = text_at(row, "detail");
  node->is_named = !name.empty();
  node->name = node->is_named ? shown(name)
                              : QString::number(whole_at(row, "number")) + ' ' +
                                    shown(detail.empty() ? kind : detail);
  if (node->is_named) node->detail = shown(detail);
  node->key = node->path;
  node->icon = icon_of_part(kind, detail);
  if (const auto refers = handle_at(row, "refers")) {
    node->refers = *refers;
    node->load = has_outline(refers->kind) ? Node::Load::wanted : Node::Load::done;
  } else {
    node->load = Node::Load::done;
  }
  return node;
}

void NavigatorModel::take_outline(Node& node, const List& groups) {
  std::vector<NodePtr> wanted;
  const Handle record = node.outlined();
  const bool is_world = record.kind == "world";
  const bool is_flat = groups.size() == 1 && !is_world;
  for (const Value& value : groups) {
    const Map& group = map_of(value);
    const std::string list = text_at(group, "group"), kind = text_at(group, "kind");
    const auto count = static_cast<std::size_t>(whole_at(group, "count"));
    std::vector<NodePtr> rows;
    std::map<std::int64_t, Node*> by_number;
    for (const Value& each : list_at(group, "rows")) {
      const Map& row = map_of(each);
      NodePtr part = row_node(row, kind, record);
      Node* const made = part.get();
      const auto above = by_number.find(whole_at(row, "parent"));
      by_number[whole_at(row, "number")] = made;
      // Links are shown in a row: nested, a long arm would be a staircase.
      if (above != by_number.end() && kind != "link")
        above->second->children.push_back(std::move(part));
      else rows.push_back(std::move(part));
    }
    const bool is_inline = (is_flat || (is_world && is_inline_in_world(list))) &&
                           count <= (is_flat ? kPage : kFewMembers);
    if (is_inline) {
      std::move(rows.begin(), rows.end(), std::back_inserter(wanted));
      continue;
    }
    auto head = std::make_unique<Node>();
    head->type = RowType::group;
    head->key = "group " + list;
    head->name = capitalized(shown(text_at(group, "label")));
    head->detail = QString::number(count);
    head->kind = "group";
    head->icon = icon_of_kind(kind);
    head->record = record;
    head->path = list;
    head->count = count;
    head->load = Node::Load::done;
    head->children = std::move(rows);
    wanted.push_back(std::move(head));
  }
  // What moves comes first.
  std::stable_partition(wanted.begin(), wanted.end(),
                        [](const NodePtr& n) { return n->type != RowType::group; });
  merge(node, std::move(wanted));
}

void NavigatorModel::ask_group(Node& group) {
  group.load = Node::Load::asked;
  const Handle record = group.record;
  by_record_[key_of(record)].insert(&group);
  ++asked_;
  const std::size_t from = group.children.size() + 1;
  desk_.ask("record.outline",
            {{"id", record}, {"group", group.path}, {"from", from}, {"at_most", kPage}}, *this,
            [this, &group, record, from](const Result<Value>& r) {
              --asked_;
              const auto known = by_record_.find(key_of(record));
              if (known == by_record_.end() || !known->second.contains(&group)) return;
              group.load = Node::Load::done;
              if (!r.ok() || list_of(*r).empty() || from != group.children.size() + 1) return;
              const Map& page = map_of(list_of(*r).front());
              const std::string kind = text_at(page, "kind");
              std::vector<NodePtr> more;
              for (const Value& each : list_at(page, "rows"))
                more.push_back(row_node(map_of(each), kind, record));
              if (more.empty()) return;
              const auto first = static_cast<int>(group.children.size());
              beginInsertRows(index_of(group), first, first + static_cast<int>(more.size()) - 1);
              for (NodePtr& each : more) {
                each->parent = &group;
                each->row = static_cast<int>(group.children.size());
                group.children.push_back(std::move(each));
              }
              endInsertRows();
              loaded();
            });
}

std::vector<NavigatorModel::Node*> NavigatorModel::nodes_of_record(const Handle& record) const {
  const auto at = by_record_.find(key_of(record));
  if (at == by_record_.end()) return {};
  return {at->second.begin(), at->second.end()};
}

// --- recordings, runs, library ---------------------------------------------------------------

void NavigatorModel::ask_others() {
  asked_ += 2;
  desk_.ask("recording.list", {}, *this, [this](const Result<Value>& r) {
    --asked_;
    if (r.ok()) take_recordings(list_of(*r));
    loaded();
  });
  desk_.ask("run.list", {}, *this, [this](const Result<Value>& r) {
    --asked_;
    if (r.ok()) take_runs(list_of(*r));
    loaded();
  });
}

QString memory_text(qint64 bytes) {
  constexpr double kMega = 1e6, kGiga = 1e9;
  const auto number = static_cast<double>(bytes);
  if (number >= kGiga) return QString::number(number / kGiga, 'f', 1) + " GB";
  if (number >= 10 * kMega) return QString::number(number / kMega, 'f', 0) + " MB";
  return number >= 0.1 * kMega ? QString::number(number / kMega, 'f', 1) + " MB" : QString();
}

void NavigatorModel::take_recordings(const List& rows) {
  recording_bytes_ = 0;
  std::vector<NodePtr> wanted;
  for (const Value& value : rows) {
    const Map& row = map_of(value);
    if (const auto id = handle_at(row, "recording")) {
      const qint64 bytes = whole_at(row, "bytes");
      const QString memory = memory_text(bytes);
      wanted.push_back(other_row(*id, "recording", row,
                                 QString::number(whole_at(row, "samples")) + " rows" +
                                     (memory.isEmpty() ? QString() : ", " + memory) +
                                     (flag_at(row, "stale") ? ", out of date" : "")));
      wanted.back()->bytes = bytes;
      wanted.back()->share = number_at(row, "share");
      recording_bytes_ += bytes;
    }
  }
  show_section("recordings", "Recordings", "recording", std::move(wanted));
  if (Node* at = section("recordings"); at && !memory_text(recording_bytes_).isEmpty()) {
    at->detail += ", " + memory_text(recording_bytes_);
    changed(*at);
  }
  // Columns may have been added.
  if (Node* at = section("recordings"))
    for (const NodePtr& row : at->children)
      if (row->load == Node::Load::done) ask_columns(*row);
}

void NavigatorModel::ask_columns(Node& recording) {
  recording.load = Node::Load::asked;
  const Handle record = recording.record;
  by_record_[key_of(record)].insert(&recording);
  ++asked_;
  desk_.ask("recording.columns", {{"id", record}}, *this,
            [this, &recording, record](const Result<Value>& r) {
              --asked_;
              const auto known = by_record_.find(key_of(record));
              if (known == by_record_.end() || !known->second.contains(&recording)) return;
              recording.load = Node::Load::done;
              if (!r.ok()) return;
              std::vector<NodePtr> wanted;
              for (const Value& v : list_of(*r)) {
                const Map& row = map_of(v);
                auto node = std::make_unique<Node>();
                node->type = RowType::part;
                node->kind = kColumnKind;
                node->icon = "plot";
                node->record = record;
                node->path = text_at(row, "name");
                node->key = node->path;
                node->name = shown(node->path);
                node->detail = shown(text_at(row, "unit"));
                node->is_named = false;
                node->load = Node::Load::done;
                wanted.push_back(std::move(node));
              }
              merge(recording, std::move(wanted));
              loaded();
            });
}

void NavigatorModel::take_runs(const List& rows) {
  std::vector<NodePtr> wanted;
  for (const Value& value : rows) {
    const Map& row = map_of(value);
    if (const auto id = handle_at(row, "id"))
      wanted.push_back(other_row(*id, "run", row,
                                 flag_at(row, "is_over")      ? "over"
                                 : flag_at(row, "is_playing") ? "playing"
                                                              : "paused"));
  }
  show_section("runs", "Live runs", "run", std::move(wanted));
}

NavigatorModel::NodePtr NavigatorModel::other_row(const Handle& id, const char* kind,
                                                  const Map& row, const QString& detail) {
  auto node = std::make_unique<Node>();
  node->type = RowType::other;
  node->key = key_of(id);
  node->record = id;
  node->kind = node->icon = kind;
  node->name = shown(text_at(row, "title"));
  node->detail = detail;
  node->load = id.kind == "recording" ? Node::Load::wanted : Node::Load::done;
  return node;
}

void NavigatorModel::show_section(const char* key, const char* name, const char* icon,
                                  std::vector<NodePtr> wanted) {
  Node* at = section(key);
  if (!at && wanted.empty()) return;
  if (!at) {
    const int row = static_cast<int>(root_->children.size()) - 1;
    beginInsertRows({}, row, row);
    auto node = std::make_unique<Node>();
    node->type = RowType::section;
    node->key = key;
    node->name = name;
    node->kind = "section";
    node->icon = icon;
    node->load = Node::Load::done;
    node->parent = root_.get();
    at = node.get();
    root_->children.insert(root_->children.end() - 1, std::move(node));
    for (std::size_t i = 0; i < root_->children.size(); ++i)
      root_->children[i]->row = static_cast<int>(i);
    endInsertRows();
  }
  at->detail = QString::number(wanted.size());
  merge(*at, std::move(wanted));
  changed(*at);
}

void NavigatorModel::ask_library(Node& shelf) {
  shelf.load = Node::Load::asked;
  ++asked_;
  // Shelves live as long as the model.
  const Map args{{"kind", shelf.kind}, {"digests", true}};
  desk_.ask("library.describe", args, *this, [this, &shelf](const Result<Value>& r) {
    --asked_;
    shelf.load = Node::Load::done;
    if (!r.ok()) return;
    if (thumbnails_) thumbnails_->know(shelf.kind, list_of(*r));
    std::vector<NodePtr> wanted;
    for (const Value& value : list_of(*r)) {
      const std::string name = text_at(map_of(value), "name");
      if (name.empty()) continue;
      auto node = std::make_unique<Node>();
      node->type = RowType::library;
      node->key = name;
      node->name = shown(name);
      node->kind = shelf.kind;
      node->icon = icon_of_kind(shelf.kind);
      node->load = Node::Load::done;
      wanted.push_back(std::move(node));
    }
    shelf.detail = QString::number(wanted.size());
    merge(shelf, std::move(wanted));
    changed(shelf);
    loaded();
  });
}

void NavigatorModel::set_thumbnails(Thumbnails* thumbnails) {
  thumbnails_ = thumbnails;
  if (!thumbnails_) return;
  thumbnails_->drawn.add(this, [this](const std::string& kind, const std::string& name) {
    each_node([&](Node& n) {
      if (n.type == RowType::library && n.kind == kind && n.key == name) changed(n);
    });
  });
}

QString NavigatorModel::library_tip(const Node& node) const {
  const QString about = thumbnails_->description(node.kind, node.key);
  const QString file = thumbnails_->file(node.kind, node.key);
  const QString text = "<b>" + node.name.toHtmlEscaped() + "</b><br>" + about.toHtmlEscaped();
  if (file.isEmpty()) return "<qt>" + text + "</qt>";
  return QString("<qt><img src=\"%1\" width=\"%2\"><br>%3</qt>")
      .arg(file.toHtmlEscaped())
      .arg(theme().px(240))
      .arg(text);
}

// --- events ----------------------------------------------------------------------------------

void NavigatorModel::take(const ioci::Event& event) {
  switch (event.topic) {
    case Topic::change: {
      if (!event.change) return;
      for (const auto& each : event.change->records) {
        const Handle id{std::string(to_string(each.id.kind)), each.id.number};
        if (!each.before || !each.after || each.before->name != each.after->name ||
            each.before->file != each.after->file)
          records_wanted_ = true;
        if (!each.after) {
          faults_.erase(key_of(id));
          continue;
        }
        if (std::find(to_check_.begin(), to_check_.end(), id) == to_check_.end())
          to_check_.push_back(id);
        for (Node* node : nodes_of_record(id)) {
          if (node->load != Node::Load::done) continue;
          std::size_t most = 0;
          if (node->type == RowType::group) continue;  // comes with the record's row
          for (const NodePtr& child : node->children) most = std::max(most, child->children.size());
          ask_outline(*node, most);
        }
      }
      check_timer_.start(kCheckAfterMs);
      break;
    }
    case Topic::recording:
    case Topic::run: others_wanted_ = !event.run || !event.run->is_pulse || others_wanted_; break;
    default: break;
  }
  if ((records_wanted_ || others_wanted_) && !record_timer_.isActive()) record_timer_.start(30);
}

void NavigatorModel::ask_faults() {
  if (is_checking_ || to_check_.empty()) return;
  is_checking_ = true;
  const Handle record = to_check_.front();
  to_check_.erase(to_check_.begin());
  (void)desk_.client().start("fault.list",
                             {{"record", record}, {"try_remedies", false}, {"at_most", 100}},
                             [this, record](const Result<Value>& r) {
                               is_checking_ = false;
                               if (r.ok()) take_faults(record, list_at(map_of(*r), "faults"));
                               if (!to_check_.empty()) check_timer_.start(0);
                             });
}

void NavigatorModel::take_faults(const Handle& record, const List& faults) {
  std::map<std::string, QString> by_path;
  for (const Value& value : faults) {
    const Map& fault = map_of(value);
    if (text_at(fault, "severity") != "error") continue;
    const Value* subject = fault.find("subject");
    std::string path = subject ? text_at(map_of(*subject), "path") : std::string();
    // To the part that has a row: "links[2].given" belongs to "links.2".
    QString& all = by_path[path];
    if (!all.isEmpty()) all += '\n';
    all += shown(text_at(fault, "text"));
  }
  const std::string key = key_of(record);
  if (by_path.empty() && !faults_.contains(key)) return;
  if (by_path.empty()) faults_.erase(key);
  else faults_[key] = std::move(by_path);
  each_node([&](Node& n) {
    if (n.record == record || n.refers == record) changed(n);
  });
}

}  // namespace robomosp::viewer
