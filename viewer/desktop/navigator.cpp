// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/navigator.h"

#include <algorithm>

#include <utility>

#include <QAction>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMouseEvent>
#include <QPainter>
#include <QSignalBlocker>
#include <QToolButton>
#include <QTreeView>
#include <QVBoxLayout>

#include "viewer/desktop/row_delegate.h"
#include "viewer/desktop/row_filter.h"
#include "viewer/desktop/status_line.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kSearchAfterMs = 120;
constexpr int kMemoryAfterMs = 1000;

/// The tree; its rows get the accent at their left edge when selected.
class RowTree : public QTreeView {
 public:
  using QTreeView::QTreeView;
  std::function<void(const QModelIndex&)> on_eye;
  std::function<void()> on_leave;
  /// Draws this row as the mouse over it would; none = no row.
  void light(const QModelIndex& row) {
    if (row == lit_) return;
    const QModelIndex before = lit_;
    lit_ = row;
    for (const QModelIndex& each : {before, row})
      if (each.isValid()) {
        const QRect r = visualRect(each);  // without the indentation
        viewport()->update(0, r.top(), viewport()->width(), r.height());
      }
  }
  [[nodiscard]] QModelIndex lit() const { return lit_; }

 protected:
  bool viewportEvent(QEvent* event) override {
    if (event->type() == QEvent::Leave && on_leave) on_leave();
    return QTreeView::viewportEvent(event);
  }
  /// A click on an eye leaves the selection as it is.
  void mousePressEvent(QMouseEvent* event) override {
    if (event->button() != Qt::LeftButton || !press_eye(event->position().toPoint()))
      QTreeView::mousePressEvent(event);
  }
  void mouseDoubleClickEvent(QMouseEvent* event) override {
    if (event->button() != Qt::LeftButton || !press_eye(event->position().toPoint()))
      QTreeView::mouseDoubleClickEvent(event);
  }
  void drawRow(QPainter* painter, const QStyleOptionViewItem& option,
               const QModelIndex& index) const override {
    const Theme& t = theme();
    const bool is_selected = selectionModel() && selectionModel()->isSelected(index);
    if (is_selected) painter->fillRect(option.rect, hasFocus() ? t.selection : t.selection_idle);
    else if (lit_ == index) painter->fillRect(option.rect, t.hover);
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

 private:
  bool press_eye(const QPoint& at) const {
    const QModelIndex index = indexAt(at);
    if (!index.isValid() || index.data(NavigatorModel::kEye).toInt() == 0 ||
        !RowDelegate::eye_place(visualRect(index)).contains(at))
      return false;
    if (on_eye) on_eye(index);
    return true;
  }
  QPersistentModelIndex lit_;
};

}  // namespace

Navigator::Navigator(Desk& desk, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      model_(new NavigatorModel(desk, this)),
      filter_(new RowFilter(NavigatorModel::kKind, this)),
      search_(new QLineEdit),
      tree_(new RowTree),
      kinds_(new QToolButton),
      users_(new QLabel),
      memory_(new ShortLabel) {
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
  tree_->setToolTip("Records and their parts; Enter opens one, F2 renames it");
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
  tree_->setDragEnabled(true);
  tree_->setAcceptDrops(true);
  tree_->setDragDropMode(QAbstractItemView::DragDrop);
  tree_->setDefaultDropAction(Qt::CopyAction);
  tree_->setDropIndicatorShown(true);
  static_cast<RowTree*>(tree_)->on_eye = [this](const QModelIndex& index) {
    if (const auto s = model_->selected_of(filter_->mapToSource(index)); s && on_eye) on_eye(*s);
  };
  static_cast<RowTree*>(tree_)->on_leave = [this] { desk_.hover({}, this); };
  connect(tree_, &QTreeView::entered, this, [this](const QModelIndex& index) {
    const auto s = model_->selected_of(filter_->mapToSource(index));
    desk_.hover(s ? Selection{*s} : Selection(), this);
  });
  connect(tree_, &QTreeView::viewportEntered, this, [this] { desk_.hover({}, this); });
  desk_.hover_changed.add(this, [this](const QObject* from) { show_hovered(from != this); });
  make_kinds_menu();
  users_->setObjectName("navigator_users");
  users_->setAccessibleName("Records that use the record");
  users_->setToolTip("Why the record was not deleted");
  users_->setWordWrap(true);
  users_->setMargin(theme().gap);
  users_->setTextInteractionFlags(Qt::LinksAccessibleByMouse | Qt::LinksAccessibleByKeyboard);
  users_->hide();
  connect(users_, &QLabel::linkActivated, this, [this](const QString& link) {
    if (link == "close") return users_->hide();
    desk_.select({{Handle{utf8(link.section('#', 0, 0)), link.section('#', 1).toULongLong()}, {}}});
  });
  auto* column = new QVBoxLayout(this);
  auto* head = new QHBoxLayout;
  head->setSpacing(2);
  head->addWidget(search_, 1);
  head->addWidget(kinds_);
  column->addLayout(head);
  column->addWidget(tree_, 1);
  column->addWidget(users_);
  memory_->setObjectName("navigator_memory");
  memory_->setAccessibleName("Memory of recordings and computed results");
  memory_->setToolTip("Memory of recordings and computed results");
  memory_->setProperty("dim", true);
  memory_->hide();
  column->addWidget(memory_);
  setFocusProxy(tree_);
  memory_timer_.setSingleShot(true);
  memory_timer_.setInterval(kMemoryAfterMs);
  connect(&memory_timer_, &QTimer::timeout, this, [this] { ask_memory(); });
  desk_.events.add(this, [this](const ioci::Event& e) {
    const bool may_change = e.topic == ioci::Topic::recording || e.topic == ioci::Topic::change ||
                            e.topic == ioci::Topic::memory || e.topic == ioci::Topic::job;
    if (may_change && !memory_timer_.isActive()) memory_timer_.start();
  });
  memory_timer_.start();

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
  model_->picture_ratio = devicePixelRatioF();
  tree_->setIndentation(t.indent);
  layout()->setContentsMargins(0, t.gap / 2, 0, 0);
  layout()->setSpacing(t.gap / 2);
  if (QLayout* head = layout()->itemAt(0)->layout())
    head->setContentsMargins(t.gap, 0, t.gap / 2, 0);
  search_->setFixedHeight(t.px(26));
  memory_->setContentsMargins(t.gap, 0, t.gap, t.gap / 2);
}

void Navigator::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void Navigator::showEvent(QShowEvent* event) {
  memory_timer_.start();
  QWidget::showEvent(event);
}

void Navigator::ask_memory() {
  if (!isVisible()) return;
  desk_.ask("cache.stats", {}, *this, [this](const Result<Value>& stats) {
    if (!stats.ok()) return;
    const qint64 computed = whole_at(map_of(*stats), "bytes");
    desk_.ask("cache.kept", {}, *this, [this, computed](const Result<Value>& kept) {
      if (!kept.ok()) return;
      QStringList parts, lines;
      const auto add = [&](const char* name, qint64 bytes, const char* about) {
        const QString size = memory_text(bytes);
        if (size.isEmpty()) return;
        parts += QString(name) + " " + size;
        lines += QString(name) + " " + size + ": " + about;
      };
      add("Recordings", model_->recording_bytes(), "in memory; recording.remove frees one");
      add("Computed", computed, "meshes, masses and models in memory; cache.clear() frees them");
      add("On disk", whole_at(map_of(*kept), "bytes"),
          "geometry kept for the next start; cache.clear_kept() removes it");
      memory_->setText(parts.join(QString(" %1 ").arg(QChar(0x00B7))));
      memory_->setToolTip(lines.join('\n'));
      memory_->setVisible(!parts.isEmpty());
    });
  });
}

void Navigator::search(const QString& text) {
  const QStringList words = text.simplified().split(' ', Qt::SkipEmptyParts);
  if (!words.isEmpty()) model_->load_all();
  change_filter([&] { filter_->set_words(words); });
}

void Navigator::change_filter(const std::function<void()>& change) {
  const bool was_active = filter_->is_active();
  if (!was_active) keep_open_rows({});
  change();
  if (filter_->is_active()) return tree_->expandAll();
  if (was_active) {
    tree_->collapseAll();
    for (const QPersistentModelIndex& row : open_before_)
      if (row.isValid()) tree_->expand(filter_->mapFromSource(row));
    show_selection();
  }
  open_before_.clear();
}

void Navigator::keep_open_rows(const QModelIndex& parent) {
  for (int i = 0; i < filter_->rowCount(parent); ++i) {
    const QModelIndex row = filter_->index(i, 0, parent);
    if (!tree_->isExpanded(row)) continue;
    open_before_.append(QPersistentModelIndex(filter_->mapToSource(row)));
    keep_open_rows(row);
  }
}

void Navigator::make_kinds_menu() {
  kinds_->setObjectName("navigator_kinds");
  kinds_->setAccessibleName("Kinds shown");
  kinds_->setPopupMode(QToolButton::InstantPopup);
  kinds_->setFocusPolicy(Qt::TabFocus);
  auto* menu = new QMenu(kinds_);
  menu->setObjectName("navigator_kinds_menu");
  menu->setAccessibleName("Kinds shown");
  QAction* all = menu->addAction("All kinds");
  all->setObjectName("kind_all");
  menu->addSeparator();
  for (const char* kind : {"world", "robot", "object", "solid", "trajectory", "task", "program",
                           "controller", "material", "recording", "run", "", "link", "tool",
                           "frame", "signal", "step", "segment", "node"}) {
    if (*kind == 0) {
      menu->addSeparator();
      continue;
    }
    QString words = kind;
    words[0] = words[0].toUpper();
    QAction* each = menu->addAction(icon(icon_of_kind(kind)), words + "s");
    each->setObjectName(QString("kind_") + kind);
    each->setData(kind);
    each->setCheckable(true);
    connect(each, &QAction::toggled, this, [this, menu] {
      QStringList kinds;
      for (const QAction* a : menu->actions())
        if (a->isChecked()) kinds += a->data().toString();
      show_kinds(kinds);
    });
  }
  connect(all, &QAction::triggered, this, [this] { show_all_kinds(); });
  kinds_->setMenu(menu);
  show_kinds({});
}

void Navigator::show_all_kinds() {
  for (QAction* a : kinds_->menu()->actions()) {
    const QSignalBlocker quiet(a);  // the rows are filtered once, below
    a->setChecked(false);
  }
  show_kinds({});
}

void Navigator::open_library() {
  const QModelIndex row = model_->index(model_->rowCount({}) - 1, 0, {});
  QModelIndex library = filter_->mapFromSource(row);
  if (row.isValid() && !library.isValid()) {  // the filters hide it
    search_->clear();
    search_timer_.stop();
    search({});
    show_all_kinds();
    library = filter_->mapFromSource(row);
  }
  if (!library.isValid()) return;
  tree_->expand(library);
  for (int i = 0; i < filter_->rowCount(library); ++i) tree_->expand(filter_->index(i, 0, library));
  tree_->scrollTo(library, QAbstractItemView::PositionAtTop);
  tree_->setCurrentIndex(library);
}

void Navigator::show_kinds(const QStringList& kinds) {
  if (!kinds.isEmpty()) model_->load_all();
  change_filter([&] { filter_->set_kinds(kinds); });
  kinds_->setIcon(icon(kinds.isEmpty() ? "filter" : "close"));
  kinds_->setToolTip(kinds.isEmpty() ? QString("Show rows of some kinds only")
                                     : "Shown: " + kinds.join(", "));
}

void Navigator::show_users(const Handle& record, const Error& refusal) {
  const auto name_of = [this](const Handle& h) {
    const auto rows = model_->rows_of({h, {}});
    return rows.isEmpty() ? shown(h.kind) : rows.front().data(Qt::DisplayRole).toString();
  };
  users_->setText(shown(refusal.sentence()).toHtmlEscaped() + " <a href=\"close\">Close</a>");
  users_->show();
  desk_.ask("document.referrers", {{"record", record}}, *this,
            [this, record, name_of](const Result<Value>& r) {
              if (!r.ok() || list_of(*r).empty() || !users_->isVisible()) return;
              QStringList links;
              for (const Value& v : list_of(*r))
                if (const Handle* h = v.as_handle())
                  links += QString("<a href=\"%1#%2\">%3</a>")
                               .arg(shown(h->kind))
                               .arg(h->number)
                               .arg(name_of(*h).toHtmlEscaped());
              constexpr int kMostLinks = 12;
              const auto more = links.size() - kMostLinks;
              users_->setText(QString("<b>%1</b> is used by %2%3. <a href=\"close\">Close</a>")
                                  .arg(name_of(record).toHtmlEscaped(),
                                       links.mid(0, kMostLinks).join(", "),
                                       more > 0 ? QString(" and %1 more").arg(more) : QString()));
            });
}

/// Lights the row of what the mouse is over in a picture, or the row that it is folded into.
void Navigator::show_hovered(bool is_elsewhere) {
  const Selection& what = desk_.hovered();
  const QModelIndexList rows =
      what.empty() || !is_elsewhere ? QModelIndexList() : model_->rows_of(what.front());
  QModelIndex row = rows.isEmpty() ? QModelIndex() : filter_->mapFromSource(rows.front());
  for (QModelIndex above = row.parent(); above.isValid(); above = above.parent())
    if (!tree_->isExpanded(above)) row = above;
  static_cast<RowTree*>(tree_)->light(row);
}

QModelIndex Navigator::hovered_row() const { return static_cast<RowTree*>(tree_)->lit(); }

void Navigator::refresh_eyes() { tree_->viewport()->update(); }

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
  if (!current.flags().testFlag(Qt::ItemIsEditable)) {
    desk_.failed(error(ErrorCode::unsupported,
                       "\"" + utf8(current.data().toString()) + "\" has no name to change",
                       "Select a record or a part with a name."));
    return;
  }
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
