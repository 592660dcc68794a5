// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/navigator.h"

#include <algorithm>

#include <utility>

#include <QAction>
#include <QEvent>
#include <QLineEdit>
#include <QMenu>
#include <QPainter>
#include <QSortFilterProxyModel>
#include <QTreeView>
#include <QVBoxLayout>

#include "viewer/desktop/row_delegate.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kSearchAfterMs = 120;

/// Rows whose name has all words; "kind:robot" keeps rows of a kind.
class RowFilter : public QSortFilterProxyModel {
 public:
  explicit RowFilter(QObject* parent) : QSortFilterProxyModel(parent) {
    setRecursiveFilteringEnabled(true);
    setAutoAcceptChildRows(true);
  }
  void set_words(const QStringList& words) {
    words_ = words;
    invalidateFilter();
  }

 protected:
  bool filterAcceptsRow(int row, const QModelIndex& parent) const override {
    if (words_.isEmpty()) return true;
    const QModelIndex index = sourceModel()->index(row, 0, parent);
    const QString name = index.data(Qt::DisplayRole).toString();
    const QString kind = index.data(NavigatorModel::kKind).toString();
    return std::all_of(words_.begin(), words_.end(), [&](const QString& word) {
      if (word.startsWith("kind:")) return kind.startsWith(word.mid(5), Qt::CaseInsensitive);
      return name.contains(word, Qt::CaseInsensitive);
    });
  }

 private:
  QStringList words_;
};

/// The tree; its rows get the accent at their left edge when selected.
class RowTree : public QTreeView {
 public:
  using QTreeView::QTreeView;

 protected:
  void drawRow(QPainter* painter, const QStyleOptionViewItem& option,
               const QModelIndex& index) const override {
    const Theme& t = theme();
    const bool is_selected = selectionModel() && selectionModel()->isSelected(index);
    if (is_selected) painter->fillRect(option.rect, hasFocus() ? t.selection : t.selection_idle);
    QTreeView::drawRow(painter, option, index);
    if (is_selected && hasFocus())
      painter->fillRect(QRect(option.rect.left(), option.rect.top(), t.px(2), option.rect.height()),
                        t.accent);
  }
  void drawBranches(QPainter* painter, const QRect& rect, const QModelIndex& index) const override {
    if (!model()->hasChildren(index)) return;
    const Theme& t = theme();
    const double ratio = devicePixelRatioF();
    const int size = t.px(12);
    const QRect at(rect.right() - t.indent + (t.indent - size) / 2 + 1,
                   rect.top() + (rect.height() - size) / 2, size, size);
    painter->drawPixmap(at.topLeft(),
                        icon_pixmap(isExpanded(index) ? "chevron_down" : "chevron_right",
                                    t.text_quiet, size, ratio));
  }
};

}  // namespace

Navigator::Navigator(Desk& desk, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      model_(new NavigatorModel(desk, this)),
      filter_(new RowFilter(this)),
      search_(new QLineEdit),
      tree_(new RowTree) {
  setObjectName("navigator");
  setAccessibleName("Navigator");
  setProperty("ground", "panel");
  filter_->setSourceModel(model_);
  search_->setObjectName("navigator_search");
  search_->setAccessibleName("Search records");
  search_->setPlaceholderText("Search, or kind:robot");
  search_->setToolTip("Rows with all words in their names; kind:robot shows robots only (Ctrl+F)");
  search_->setClearButtonEnabled(false);
  search_->addAction(icon("search"), QLineEdit::LeadingPosition);
  tree_->setObjectName("navigator_tree");
  tree_->setAccessibleName("Records and their parts");
  tree_->setToolTip(QString());
  tree_->setModel(filter_);
  tree_->setItemDelegate(new RowDelegate(tree_));
  tree_->setHeaderHidden(true);
  tree_->setUniformRowHeights(true);
  tree_->setSelectionMode(QAbstractItemView::ExtendedSelection);
  tree_->setEditTriggers(QAbstractItemView::EditKeyPressed);
  tree_->setExpandsOnDoubleClick(false);
  tree_->setMouseTracking(true);
  tree_->setContextMenuPolicy(Qt::CustomContextMenu);
  tree_->setHorizontalScrollMode(QAbstractItemView::ScrollPerPixel);
  auto* column = new QVBoxLayout(this);
  column->addWidget(search_);
  column->addWidget(tree_, 1);
  setFocusProxy(tree_);

  search_timer_.setSingleShot(true);
  search_timer_.setInterval(kSearchAfterMs);
  connect(&search_timer_, &QTimer::timeout, this, [this] { search(search_->text()); });
  connect(search_, &QLineEdit::textChanged, this, [this] { search_timer_.start(); });
  connect(search_, &QLineEdit::returnPressed, this, [this] {
    search_timer_.stop();
    search(search_->text());
    tree_->setFocus();
  });
  connect(tree_, &QTreeView::doubleClicked, this, [this](const QModelIndex& i) { open_row(i); });
  connect(tree_, &QTreeView::activated, this, [this](const QModelIndex& i) {
    if (!tree_->underMouse()) open_row(i);
  });
  connect(tree_->selectionModel(), &QItemSelectionModel::selectionChanged, this, [this] {
    if (is_selecting_) return;
    Selection selection;
    for (const QModelIndex& row : tree_->selectionModel()->selectedIndexes())
      if (const auto s = model_->selected_of(filter_->mapToSource(row))) selection.push_back(*s);
    desk_.select(std::move(selection), this);
  });
  connect(tree_, &QTreeView::customContextMenuRequested, this, [this](const QPoint& at) {
    if (!on_menu) return;
    QMenu menu;
    menu.setObjectName("navigator_menu");
    on_menu(menu);
    menu.exec(tree_->viewport()->mapToGlobal(at));
  });
  desk_.selection_changed.add(this, [this](const QObject* from) {
    if (from != this) show_selection();
  });
  model_->loaded.add(this, [this] {
    if (!search_->text().isEmpty()) search_timer_.start();
    if (is_revealing_) show_selection();
    if (to_open_) open_parts_of(*to_open_);
  });
  apply_theme();
}

Navigator::~Navigator() = default;

void Navigator::apply_theme() {
  const Theme& t = theme();
  tree_->setIndentation(t.indent);
  layout()->setContentsMargins(0, t.gap / 2, 0, 0);
  layout()->setSpacing(t.gap / 2);
  search_->setFixedHeight(t.px(26));
}

void Navigator::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void Navigator::search(const QString& text) {
  const QStringList words = text.simplified().split(' ', Qt::SkipEmptyParts);
  if (!words.isEmpty()) model_->load_all();
  static_cast<RowFilter*>(filter_)->set_words(words);
  if (!words.isEmpty()) tree_->expandAll();
}

void Navigator::focus_search() {
  search_->setFocus(Qt::ShortcutFocusReason);
  search_->selectAll();
}

void Navigator::open_parts_of(const Handle& record) {
  const auto rows = model_->rows_of({record, {}});
  to_open_ = record;
  if (rows.isEmpty()) return;
  to_open_.reset();
  tree_->setExpanded(filter_->mapFromSource(rows.front()), true);
}

void Navigator::rename_selected() {
  const QModelIndex current = tree_->currentIndex();
  if (!current.isValid()) return;
  tree_->setFocus();
  tree_->edit(current);
}

void Navigator::open_row(const QModelIndex& index) {
  const QModelIndex row = filter_->mapToSource(index);
  if (const auto shipped = model_->shipped_of(row)) {
    if (on_open_shipped) on_open_shipped(shipped->kind, shipped->name);
    return;
  }
  const auto type = model_->type_of(row);
  if (type == NavigatorModel::RowType::record || type == NavigatorModel::RowType::other) {
    if (const auto s = model_->selected_of(row); s && on_open) on_open(s->record);
    return;
  }
  tree_->setExpanded(index, !tree_->isExpanded(index));
}

void Navigator::show_selection() {
  is_selecting_ = true;
  is_revealing_ = false;
  QItemSelection rows;
  QModelIndex first;
  for (const Selected& s : desk_.selection()) {
    const QModelIndexList found = model_->rows_of(s);
    if (found.isEmpty()) {
      is_revealing_ = true;  // shown when its row has arrived
      model_->load_parts(s.record);
      continue;
    }
    const QModelIndex row = filter_->mapFromSource(found.front());
    if (!row.isValid()) continue;
    rows.select(row, row);
    if (!first.isValid()) first = row;
  }
  tree_->selectionModel()->select(rows, QItemSelectionModel::ClearAndSelect);
  if (first.isValid()) {
    tree_->selectionModel()->setCurrentIndex(first, QItemSelectionModel::NoUpdate);
    tree_->scrollTo(first);
  }
  is_selecting_ = false;
}

}  // namespace robomosp::viewer
