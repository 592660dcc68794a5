// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/messages.h"

#include <algorithm>
#include <functional>
#include <utility>

#include <QAction>
#include <QApplication>
#include <QClipboard>
#include <QComboBox>
#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QListView>
#include <QMenu>
#include <QMouseEvent>
#include <QPainter>
#include <QScrollBar>
#include <QSortFilterProxyModel>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostMessages = 2000;

/// Places of a row: icon, time, text, and links at the right.
struct RowPlaces {
  QRect icon, time, text, remedy, link;
};

RowPlaces places_of(const QRect& row, const QModelIndex& index) {
  const Theme& t = theme();
  const QFontMetrics small(t.mono), ui(t.ui);
  RowPlaces p;
  const int top = row.top() + t.gap / 2, line = ui.lineSpacing();
  p.icon = QRect(row.left() + t.gap, top + (line - t.icon) / 2, t.icon, t.icon);
  const int time_width = small.horizontalAdvance("00:00:00");
  p.time = QRect(p.icon.right() + t.gap, top, time_width, line);
  int right = row.right() - t.gap;
  const auto link = [&](int role) {
    const QString text = index.data(role).toString();
    if (text.isEmpty()) return QRect();
    const int width = ui.horizontalAdvance(text);
    const QRect at(right - width, top, width, line);
    right -= width + 2 * t.gap;
    return at;
  };
  p.link = link(MessageModel::kLink);
  p.remedy = link(MessageModel::kRemedy);
  p.text = QRect(p.time.right() + t.gap, top, right - p.time.right() - t.gap, row.height() - t.gap);
  return p;
}

class MessageDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;
  /// A click on a link; `mend` = on the remedy.
  std::function<void(const QModelIndex&, bool mend)> on_link;

  void paint(QPainter* painter, const QStyleOptionViewItem& option,
             const QModelIndex& index) const override {
    const Theme& t = theme();
    painter->save();
    if (option.state.testFlag(QStyle::State_Selected))
      painter->fillRect(
          option.rect, option.widget && option.widget->hasFocus() ? t.selection : t.selection_idle);
    else if (option.state.testFlag(QStyle::State_MouseOver))
      painter->fillRect(option.rect, t.hover);
    painter->setPen(t.line);
    painter->drawLine(option.rect.bottomLeft(), option.rect.bottomRight());
    const RowPlaces p = places_of(option.rect, index);
    const auto severity = static_cast<Severity>(index.data(MessageModel::kSeverity).toInt());
    const double ratio = painter->device()->devicePixelRatioF();
    const char* name = severity == Severity::error     ? "fault"
                       : severity == Severity::warning ? "warning"
                                                       : "info";
    const QColor colour = severity == Severity::error     ? t.fault
                          : severity == Severity::warning ? t.warn
                                                          : t.text_dim;
    painter->drawPixmap(p.icon.topLeft(), icon_pixmap(name, colour, t.icon, ratio));
    painter->setFont(t.mono);
    painter->setPen(t.text_quiet);
    painter->drawText(p.time, Qt::AlignVCenter, index.data(MessageModel::kTime).toString());
    painter->setFont(t.ui);
    painter->setPen(t.text);
    painter->drawText(p.text, Qt::TextWordWrap | Qt::AlignTop,
                      index.data(Qt::DisplayRole).toString());
    painter->setPen(t.accent);
    painter->drawText(p.link, Qt::AlignVCenter, index.data(MessageModel::kLink).toString());
    painter->drawText(p.remedy, Qt::AlignVCenter, index.data(MessageModel::kRemedy).toString());
    painter->restore();
  }
  QSize sizeHint(const QStyleOptionViewItem& option, const QModelIndex& index) const override {
    const int width = option.widget ? option.widget->width() - theme().px(12) : 400;
    const RowPlaces p = places_of(QRect(0, 0, width, 10000), index);
    const QRect needed =
        QFontMetrics(theme().ui)
            .boundingRect(QRect(0, 0, std::max(60, p.text.width()), 10000),
                          Qt::TextWordWrap | Qt::AlignTop, index.data(Qt::DisplayRole).toString());
    return {width, std::max(theme().row, needed.height() + theme().gap + 1)};
  }
  bool editorEvent(QEvent* event, QAbstractItemModel*, const QStyleOptionViewItem& option,
                   const QModelIndex& index) override {
    if (event->type() != QEvent::MouseButtonRelease) return false;
    const QPoint at = static_cast<QMouseEvent*>(event)->position().toPoint();
    const RowPlaces p = places_of(option.rect, index);
    if (on_link && p.remedy.contains(at)) on_link(index, true);
    else if (on_link && p.link.contains(at)) on_link(index, false);
    else return false;
    return true;
  }
};

/// Shows rows from a severity on.
class SeverityFilter : public QSortFilterProxyModel {
 public:
  using QSortFilterProxyModel::QSortFilterProxyModel;
  void set_least(int least) {
    least_ = least;
    invalidateFilter();
  }

 protected:
  bool filterAcceptsRow(int row, const QModelIndex& parent) const override {
    return sourceModel()->index(row, 0, parent).data(MessageModel::kSeverity).toInt() >= least_;
  }

 private:
  int least_ = 0;
};

}  // namespace

void MessageModel::add(Severity severity, const QString& text, std::shared_ptr<const Fault> fault) {
  if (!rows_.empty() && rows_.back().text == text && rows_.back().severity == severity) {
    ++rows_.back().repeated;
    rows_.back().time = QDateTime::currentDateTime();
    rows_.back().fault = std::move(fault);
    const QModelIndex last = index(static_cast<int>(rows_.size()) - 1);
    dataChanged(last, last);
    return;
  }
  if (rows_.size() >= kMostMessages) {
    beginRemoveRows({}, 0, 0);
    rows_.erase(rows_.begin());
    endRemoveRows();
  }
  const int row = static_cast<int>(rows_.size());
  beginInsertRows({}, row, row);
  rows_.push_back({severity, QDateTime::currentDateTime(), text, std::move(fault), 1});
  endInsertRows();
}

void MessageModel::clear() {
  beginResetModel();
  rows_.clear();
  endResetModel();
}

const Fault* MessageModel::fault_at(int row) const {
  const auto i = static_cast<std::size_t>(row);
  return row >= 0 && i < rows_.size() ? rows_[i].fault.get() : nullptr;
}

int MessageModel::rowCount(const QModelIndex& parent) const {
  return parent.isValid() ? 0 : static_cast<int>(rows_.size());
}

QVariant MessageModel::data(const QModelIndex& index, int role) const {
  if (!index.isValid() || static_cast<std::size_t>(index.row()) >= rows_.size()) return {};
  const Row& row = rows_[static_cast<std::size_t>(index.row())];
  switch (role) {
    case Qt::DisplayRole:
      return row.repeated > 1 ? row.text + QString(" (%1 times)").arg(row.repeated) : row.text;
    case Qt::ToolTipRole: return row.fault ? shown(row.fault->code) + "\n" + row.text : row.text;
    case kSeverity: return static_cast<int>(row.severity);
    case kTime: return row.time.toString("HH:mm:ss");
    case kLink:
      return row.fault && row.fault->subject.record.number != 0 ? QString("Show") : QString();
    case kRemedy:
      return row.fault && !row.fault->remedies.empty() &&
                     !row.fault->remedies.front().command.empty()
                 ? shown(row.fault->remedies.front().label)
                 : QString();
    default: return {};
  }
}

MessagesPanel::MessagesPanel(Desk& desk, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      model_(new MessageModel(this)),
      filter_(new SeverityFilter(this)),
      list_(new QListView),
      least_(new QComboBox) {
  setObjectName("messages");
  setAccessibleName("Messages");
  setProperty("ground", "panel");
  filter_->setSourceModel(model_);
  list_->setObjectName("messages_list");
  list_->setAccessibleName("Messages");
  list_->setToolTip("A click on Show selects what a message is about");
  list_->setModel(filter_);
  list_->setResizeMode(QListView::Adjust);
  list_->setWordWrap(true);
  list_->setMouseTracking(true);
  list_->setVerticalScrollMode(QAbstractItemView::ScrollPerPixel);
  list_->setContextMenuPolicy(Qt::CustomContextMenu);
  auto* delegate = new MessageDelegate(list_);
  delegate->on_link = [this](const QModelIndex& index, bool mend) { follow(index, mend); };
  list_->setItemDelegate(delegate);
  connect(list_, &QListView::activated, this, [this](const QModelIndex& i) { follow(i, false); });
  connect(list_, &QListView::customContextMenuRequested, this, [this](const QPoint& at) {
    const QModelIndex index = list_->indexAt(at);
    QMenu menu;
    menu.setObjectName("messages_menu");
    if (index.isValid()) {
      connect(menu.addAction("Copy"), &QAction::triggered, this, [index] {
        QApplication::clipboard()->setText(index.data(Qt::DisplayRole).toString());
      });
      const Fault* fault = model_->fault_at(filter_->mapToSource(index).row());
      for (std::size_t i = 0; fault && i < fault->remedies.size(); ++i) {
        const FaultRemedy remedy = fault->remedies[i];
        if (remedy.command.empty()) continue;
        connect(menu.addAction(shown(remedy.label)), &QAction::triggered, this,
                [this, remedy] { desk_.act(remedy.command, remedy.args); });
      }
      menu.addSeparator();
    }
    connect(menu.addAction("Clear"), &QAction::triggered, this, [this] { clear(); });
    menu.exec(list_->viewport()->mapToGlobal(at));
  });
  auto* bar = new QWidget;
  bar->setObjectName("messages_bar");
  bar->setAccessibleName("Filter of messages");
  auto* across = new QHBoxLayout(bar);
  across->setContentsMargins(8, 4, 8, 4);
  least_->setObjectName("messages_least");
  least_->setAccessibleName("Least severity shown");
  least_->setToolTip("Least severity shown");
  least_->addItem("All", static_cast<int>(Severity::debug));
  least_->addItem("Warnings and errors", static_cast<int>(Severity::warning));
  least_->addItem("Errors", static_cast<int>(Severity::error));
  connect(least_, &QComboBox::currentIndexChanged, this, [this] {
    static_cast<SeverityFilter*>(filter_)->set_least(least_->currentData().toInt());
  });
  auto* clear_button = new QToolButton;
  clear_button->setObjectName("messages_clear");
  clear_button->setAccessibleName("Clear messages");
  clear_button->setToolTip("Remove all messages from the list");
  clear_button->setIcon(icon("trash"));
  connect(clear_button, &QToolButton::clicked, this, [this] { clear(); });
  across->addWidget(least_);
  across->addStretch(1);
  across->addWidget(clear_button);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addWidget(bar);
  column->addWidget(list_, 1);
  setFocusProxy(list_);

  desk_.events.add(this, [this](const ioci::Event& e) {
    if (e.topic != ioci::Topic::message || !e.message) return;
    if (e.message->code == "audit") return;  // the console shows what was called
    add(e.message->severity, shown(e.message->text), e.message->fault);
  });
  desk_.failed.add(this, [this](const Error& e) {
    for (const Fault& fault : faults_of(e))
      add(fault.severity, shown(sentence(fault)), std::make_shared<const Fault>(fault));
  });
}

void MessagesPanel::add(Severity severity, const QString& text,
                        std::shared_ptr<const Fault> fault) {
  if (severity == Severity::debug) return;
  QScrollBar* bar = list_->verticalScrollBar();
  const bool is_at_end = bar->value() >= bar->maximum() - 4;
  model_->add(severity, text, std::move(fault));
  if (is_at_end) list_->scrollToBottom();
  if (severity >= Severity::warning && !isVisible()) {
    ++unseen_;
    unseen_changed();
  }
}

void MessagesPanel::clear() {
  model_->clear();
  mark_seen();
}

void MessagesPanel::mark_seen() {
  if (std::exchange(unseen_, 0) != 0) unseen_changed();
}

void MessagesPanel::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  mark_seen();
}

void MessagesPanel::follow(const QModelIndex& index, bool mend) {
  const Fault* fault = model_->fault_at(filter_->mapToSource(index).row());
  if (!fault) return;
  if (mend && !fault->remedies.empty()) {
    const FaultRemedy& remedy = fault->remedies.front();
    desk_.act(remedy.command, remedy.args);
    return;
  }
  if (fault->subject.record.number != 0) select_part(fault->subject.record, fault->subject.path);
}

void MessagesPanel::select_part(const Handle& record, const std::string& path) {
  const std::string list = path.substr(0, path.find_first_of(".["));
  if (path.empty() || list == path) return desk_.select({{record, {}}}, this);
  desk_.ask("record.outline", {{"id", record}, {"group", list}}, *this,
            [this, record, list, path](const Result<Value>& r) {
              // Faults name a part by its place in the list or by its name.
              std::string part;
              const auto is_in = [&](const std::string& whole) {
                return path == whole || path.starts_with(whole + ".") ||
                       path.starts_with(whole + "[");
              };
              if (r.ok())
                for (const Value& group : list_of(*r))
                  for (const Value& row : list_at(map_of(group), "rows")) {
                    const std::string name = text_at(map_of(row), "path");
                    const auto number = std::to_string(whole_at(map_of(row), "number"));
                    if (is_in(name) || is_in(list + "[" + number + "]")) part = name;
                  }
              desk_.select({{record, part}}, this);
            });
}

}  // namespace robomosp::viewer
