// SPDX-License-Identifier: GPL-3.0-or-later
// NavigatorModel: the tree of everything there is: records with their parts, recordings, live runs
// and the library (layer: GUI). Rows are loaded when they are opened, and follow events.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <QAbstractItemModel>
#include <QTimer>

#include "viewer/desktop/desk.h"

namespace robomosp::viewer {

class Thumbnails;

/// [GUI thread]
class NavigatorModel : public QAbstractItemModel {
 public:
  enum Role {
    kDetail = Qt::UserRole,  ///< QString, shown at the right
    kIcon,                   ///< QString, name of an icon
    kKind,                   ///< QString: "world", "link", "recording", "library", "section"
    kIsUnsaved,              ///< bool
    kFault,                  ///< QString, the sentences; empty = none
    kFaultBelow,             ///< bool: a row below has a fault
    kIsHeavy,                ///< bool: it holds much of the machine's memory
    kIsQuiet,                ///< bool: drawn dim, as a record of the library
    kEye,                    ///< int, an Eye
    kPicture                 ///< QPixmap in place of the icon; null = the icon
  };
  /// Of a member of the world in the present view.
  enum class Eye : std::uint8_t { none, shown, hidden };
  enum class RowType : std::uint8_t { root, section, record, group, part, other, library };

  explicit NavigatorModel(Desk& desk, QObject* parent = nullptr);
  ~NavigatorModel() override;

  /// The record or part of a row; none = of a section or group.
  [[nodiscard]] std::optional<Selected> selected_of(const QModelIndex& index) const;
  /// Rows of a record or part that are loaded; the first is the one to show.
  [[nodiscard]] QModelIndexList rows_of(const Selected& what) const;
  [[nodiscard]] RowType type_of(const QModelIndex& index) const;
  /// Of a row of the library: the kind and the name of its record.
  struct Shipped {
    std::string kind, name;
  };
  [[nodiscard]] std::optional<Shipped> shipped_of(const QModelIndex& index) const;
  /// Asks for the rows below all records of the document, for a search.
  void load_all();
  /// Asks for the parts of a record wherever they have a place in the tree.
  void load_parts(const Handle& record);
  /// True while rows are asked for.
  [[nodiscard]] bool is_loading() const { return asked_ > 0; }
  /// Recordings from this share of the machine's memory on have a mark.
  double heavy_share = 0.02;
  /// Memory of all recordings [bytes].
  [[nodiscard]] qint64 recording_bytes() const { return recording_bytes_; }

  [[nodiscard]] QModelIndex index(int row, int column, const QModelIndex& parent) const override;
  [[nodiscard]] QModelIndex parent(const QModelIndex& index) const override;
  [[nodiscard]] int rowCount(const QModelIndex& parent) const override;
  [[nodiscard]] int columnCount(const QModelIndex&) const override { return 1; }
  [[nodiscard]] bool hasChildren(const QModelIndex& parent) const override;
  [[nodiscard]] bool canFetchMore(const QModelIndex& parent) const override;
  void fetchMore(const QModelIndex& parent) override;
  [[nodiscard]] QVariant data(const QModelIndex& index, int role) const override;
  bool setData(const QModelIndex& index, const QVariant& value, int role) override;
  [[nodiscard]] Qt::ItemFlags flags(const QModelIndex& index) const override;
  // Dragging: rows go to pictures, plots, editors and worlds; steps, segments and nodes to another
  // place in their record (navigator_drag.cpp).
  [[nodiscard]] QStringList mimeTypes() const override;
  [[nodiscard]] QMimeData* mimeData(const QModelIndexList& indexes) const override;
  [[nodiscard]] Qt::DropActions supportedDragActions() const override { return Qt::CopyAction; }
  [[nodiscard]] Qt::DropActions supportedDropActions() const override { return Qt::CopyAction; }
  [[nodiscard]] bool canDropMimeData(const QMimeData* data, Qt::DropAction action, int row,
                                     int column, const QModelIndex& parent) const override;
  bool dropMimeData(const QMimeData* data, Qt::DropAction action, int row, int column,
                    const QModelIndex& parent) override;

  /// Pictures of the rows of the library; set by the window before rows are shown.
  void set_thumbnails(Thumbnails* thumbnails);

  Listeners<> loaded;                               ///< rows have arrived
  std::function<Eye(const Selected& part)> eye_of;  ///< of a part; set by the window
  double picture_ratio = 1;                         ///< device pixels of pictures

 private:
  struct Node;
  using NodePtr = std::unique_ptr<Node>;
  /// What a drop would do: a command, or rows put into a world; none = nothing.
  struct Drop;

  [[nodiscard]] Node* node_of(const QModelIndex& index) const;
  [[nodiscard]] QModelIndex index_of(const Node& node) const;
  void ask_records();
  void take_records(const List& rows);
  void ask_others();
  void take_recordings(const List& rows);
  void take_runs(const List& rows);
  /// A recording or run, with its title.
  [[nodiscard]] static NodePtr other_row(const Handle& id, const char* kind, const Map& row,
                                         const QString& detail);
  /// Shows rows in a section above the library; without rows no section is made.
  void show_section(const char* key, const char* name, const char* icon,
                    std::vector<NodePtr> wanted);
  void ask_library(Node& section);
  /// The picture of a record of the library, with its name and description.
  [[nodiscard]] QString library_tip(const Node& node) const;
  void ask_columns(Node& recording);
  void ask_outline(Node& node, std::size_t at_least);
  void take_outline(Node& node, const List& groups);
  void ask_group(Node& group);
  void ask_faults();
  void take_faults(const Handle& record, const List& faults);
  void take(const ioci::Event& event);
  /// Makes the children of a node those of `wanted`, keeping the nodes with equal keys.
  void merge(Node& node, std::vector<NodePtr> wanted);
  void changed(const Node& node);
  [[nodiscard]] std::vector<Node*> nodes_of_record(const Handle& record) const;
  void each_node(const std::function<void(Node&)>& see) const;
  [[nodiscard]] Node* section(const std::string& key) const;
  /// Number of unsaved records that a row is or, of a section, has.
  [[nodiscard]] std::size_t unsaved_below(const Node& node) const;
  NodePtr row_node(const Map& row, const std::string& kind, const Handle& record) const;
  [[nodiscard]] std::optional<Drop> drop_of(const QMimeData* data, int row,
                                            const QModelIndex& parent) const;
  [[nodiscard]] static bool may_drag(const Node& node);

  Desk& desk_;
  Thumbnails* thumbnails_ = nullptr;
  NodePtr root_;
  std::map<std::string, std::set<Node*>> by_record_;  ///< rows with the outline of a record
  std::map<std::string, std::map<std::string, QString>> faults_;  ///< by record and path
  std::vector<Handle> to_check_;
  bool is_checking_ = false, records_wanted_ = false, others_wanted_ = false;
  QTimer check_timer_, record_timer_;
  int asked_ = 0;
  qint64 recording_bytes_ = 0;
};

/// "12 MB", of bytes; "" below a tenth of that unit.
[[nodiscard]] QString memory_text(qint64 bytes);

}  // namespace robomosp::viewer
