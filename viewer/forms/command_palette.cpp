// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/command_palette.h"

#include <algorithm>
#include <utility>

#include <QAbstractListModel>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QListView>
#include <QPainter>
#include <QScrollArea>
#include <QScrollBar>
#include <QStyledItemDelegate>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/form_context.h"
#include "viewer/forms/result_view.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

constexpr int kPlaces = Qt::UserRole + 1, kSummary = Qt::UserRole + 2, kClassic = Qt::UserRole + 3,
              kShortcut = Qt::UserRole + 4;
constexpr int kWidth = 860;    // of the design [px]
constexpr int kShownRows = 4;  // while a form is open
constexpr int kMostRows = 14;
constexpr std::size_t kMostRecent = 24;
constexpr int kTwoColumns = 620;  // least width of a form with two columns, of the design [px]

std::string text_entry(const Map& m, const char* name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

class CommandDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;
  void paint(QPainter* p, const QStyleOptionViewItem& option,
             const QModelIndex& index) const override {
    const Theme& t = theme();
    const QRect r = option.rect;
    if (option.state & QStyle::State_Selected) {
      p->fillRect(r, t.selection);
      p->fillRect(QRect(r.left(), r.top(), t.px(2), r.height()), t.accent);
    } else if (option.state & QStyle::State_MouseOver) {
      p->fillRect(r, t.hover);
    }
    QRect room = r.adjusted(t.px(12), 0, -t.px(12), 0);
    // Name, with the letters that matched in the accent.
    const QString name = index.data(Qt::DisplayRole).toString();
    const QVariantList places = index.data(kPlaces).toList();
    p->setFont(t.mono);
    int x = room.left();
    const int baseline =
        r.top() + (r.height() + p->fontMetrics().ascent() - p->fontMetrics().descent()) / 2;
    for (qsizetype i = 0; i < name.size(); ++i) {
      p->setPen(places.contains(QVariant(static_cast<int>(i))) ? t.accent : t.text);
      p->drawText(x, baseline, QString(name[i]));
      x += p->fontMetrics().horizontalAdvance(name[i]);
    }
    p->setFont(t.small);
    const QString key = index.data(kShortcut).toString();
    if (!key.isEmpty()) {
      const int w = p->fontMetrics().horizontalAdvance(key) + t.px(10);
      const QRect box(room.right() - w, r.center().y() - t.px(9), w, t.px(18));
      p->setPen(t.field_line);
      p->setBrush(Qt::NoBrush);
      p->drawRoundedRect(box, t.radius, t.radius);
      p->setPen(t.text_dim);
      p->drawText(box, Qt::AlignCenter, key);
      room.setRight(box.left() - t.px(8));
    }
    const QString classic = index.data(kClassic).toString();
    if (!classic.isEmpty()) {
      p->setFont(t.mono);
      // Rounded widths of letters may add up to a little more.
      const int w =
          std::min(p->fontMetrics().horizontalAdvance(classic) + t.px(4), room.width() / 4);
      p->setPen(t.text_quiet);
      paint_text(*p, QRect(room.right() - w, r.top(), w, r.height()),
                 Qt::AlignVCenter | Qt::AlignRight, classic);
      room.setRight(room.right() - w - t.px(12));
    }
    const int left = std::max(x + t.px(16), r.left() + t.px(240));
    p->setFont(t.ui);
    p->setPen(t.text_dim);
    paint_text(*p, QRect(left, r.top(), room.right() - left, r.height()),
               Qt::AlignVCenter | Qt::AlignLeft, index.data(kSummary).toString());
  }
  QSize sizeHint(const QStyleOptionViewItem&, const QModelIndex&) const override {
    return {theme().px(400), theme().px(32)};
  }
};

}  // namespace

class CommandPalette::Model : public QAbstractListModel {
 public:
  explicit Model(QObject* parent) : QAbstractListModel(parent) {}
  void show_rows(std::vector<FoundCommand> rows, const std::vector<SearchedCommand>* commands) {
    beginResetModel();
    rows_ = std::move(rows);
    commands_ = commands;
    endResetModel();
  }
  int rowCount(const QModelIndex& parent) const override {
    return parent.isValid() ? 0 : static_cast<int>(rows_.size());
  }
  QVariant data(const QModelIndex& index, int role) const override {
    const FoundCommand& row = rows_[static_cast<std::size_t>(index.row())];
    const SearchedCommand& c = (*commands_)[row.index];
    switch (role) {
      case Qt::DisplayRole: return qt(c.name);
      case Qt::ToolTipRole: return qt(c.summary);
      case Qt::AccessibleTextRole: return qt(c.name + ": " + c.summary);
      case kSummary: {
        QString s = qt(c.summary);
        if (s.endsWith('.')) s.chop(1);
        return s;
      }
      case kClassic: return qt(c.classic.substr(0, c.classic.find_first_of("|(")));
      case kShortcut: {
        const auto it = shortcuts.find(c.name);
        return it == shortcuts.end() ? QString() : it->second;
      }
      case kPlaces: {
        QVariantList out;
        for (const std::size_t i : row.name_places) out << static_cast<int>(i);
        return out;
      }
      default: return {};
    }
  }
  [[nodiscard]] const std::vector<FoundCommand>& rows() const { return rows_; }
  std::map<std::string, QString> shortcuts;

 private:
  std::vector<FoundCommand> rows_;
  const std::vector<SearchedCommand>* commands_ = nullptr;
};

CommandPalette::CommandPalette(ioci::Client& client, QWidget* parent)
    : QFrame(parent), client_(client), model_(new Model(this)) {
  const Theme& t = theme();
  setObjectName("palette");
  setAccessibleName("Command palette");
  setToolTip({});
  setAutoFillBackground(true);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(1, 1, 1, 1);
  column->setSpacing(0);
  auto* head = new QHBoxLayout;
  head->setContentsMargins(t.px(12), t.px(8), t.px(12), t.px(8));
  head->setSpacing(t.px(8));
  auto* lens = new QLabel(this);
  lens->setObjectName("palette.lens");
  lens->setAccessibleName("Search");
  lens->setToolTip("Search");
  lens->setPixmap(icon_pixmap("search", t.text_dim, t.icon, devicePixelRatioF()));
  line_ = new QLineEdit(this);
  line_->setObjectName("palette.search");
  line_->setAccessibleName("Find a command");
  line_->setToolTip("Letters of a name, a classic spelling, or words of a summary");
  line_->setPlaceholderText("Find a command");
  line_->setFrame(false);
  use_font(*line_, &Theme::menu);
  line_->setStyleSheet("border: 0px; background: transparent;");
  line_->installEventFilter(this);
  count_ = new QLabel(this);
  count_->setObjectName("palette.count");
  count_->setAccessibleName("Number of commands found");
  count_->setToolTip("Commands found of all");
  count_->setProperty("quiet", true);
  escape_ = new QLabel("Esc", this);
  escape_->setObjectName("palette.escape");
  escape_->setAccessibleName("Escape closes");
  escape_->setToolTip("Escape closes");
  escape_->setProperty("quiet", true);
  dock_ = new QToolButton(this);
  dock_->setObjectName("palette.dock");
  dock_->setIcon(icon("panel_left"));
  QObject::connect(dock_, &QToolButton::clicked, this, [this] {
    if (on_dock) on_dock(!is_docked_);
  });
  head->addWidget(lens);
  head->addWidget(line_, 1);
  head->addWidget(count_);
  head->addWidget(escape_);
  head->addWidget(dock_);
  column->addLayout(head);
  list_ = new QListView(this);
  list_->setObjectName("palette.commands");
  list_->setAccessibleName("Commands found");
  list_->setToolTip("Click to open the form of a command.");
  list_->setModel(model_);
  list_->setItemDelegate(new CommandDelegate(list_));
  list_->setUniformItemSizes(true);
  list_->setMouseTracking(true);
  list_->setFocusPolicy(Qt::NoFocus);
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  column->addWidget(list_, 1);
  form_ = new CommandForm(client_, this);
  form_->on_run = [this](const std::string& command, const Map& args, const Result<Value>& r) {
    if (r.ok()) {
      last_use_[command] = args;
      std::erase(recent_, command);
      recent_.insert(recent_.begin(), command);
      if (recent_.size() > kMostRecent) recent_.resize(kMostRecent);
      if (on_recent) on_recent();
    }
    place();
  };
  form_->on_ready = [this] {
    show_form(true);
    // The first field that is still needed gets the cursor.
    QWidget* first = nullptr;
    if (SchemaForm* f = form_->form()) {
      const Map values = f->values();
      for (const std::string& name : f->shown_names()) {
        if (!first) first = f->field(name);
        const ParamSpec* p = find_param(f->schema(), name);
        if (p && p->required && !values.find(name)) {
          first = f->field(name);
          break;
        }
      }
    }
    if (first) first->setFocus(Qt::OtherFocusReason);
    else form_->setFocus();
  };
  form_->on_grown = [this] { place(); };
  form_->setFocusPolicy(Qt::StrongFocus);
  scroll_ = new QScrollArea(this);
  scroll_->setObjectName("palette.form_area");
  scroll_->setAccessibleName("Form");
  scroll_->setToolTip("Arguments of the command");
  scroll_->setWidgetResizable(true);
  scroll_->setFrameShape(QFrame::NoFrame);
  scroll_->setWidget(form_);
  scroll_->hide();
  column->addWidget(scroll_, 4);
  QObject::connect(line_, &QLineEdit::textChanged, this, [this](const QString& s) { search(s); });
  QObject::connect(list_, &QListView::clicked, this,
                   [this](const QModelIndex& index) { choose(index.row()); });
  hide();
  set_docked(false);
}

CommandPalette::~CommandPalette() = default;

/// At each opening, as plugins bring commands; not before the first one, as the descriptions of all
/// commands take 8 MB.
void CommandPalette::ask_for_commands() {
  if (std::exchange(is_asking_, true)) return;
  ask(client_, "ioci.describe", {}, this, [this](const Result<Value>& r) {
    is_asking_ = false;
    if (!r.ok() || !r->as_list()) {
      count_->setText(r.ok() ? QString() : qt(r.error().sentence()));
      return;
    }
    model_->show_rows({}, &commands_);
    commands_.clear();
    descriptions_.clear();
    for (const Value& each : *r->as_list()) {
      const Map* m = each.as_map();
      if (!m) continue;
      commands_.push_back(
          {text_entry(*m, "name"), text_entry(*m, "classic"), text_entry(*m, "summary")});
      descriptions_.push_back(each);
    }
    search(line_->text());
    if (const auto wanted = std::exchange(wanted_, std::nullopt))
      open_command(wanted->first, wanted->second);
  });
}

void CommandPalette::set_shortcuts(std::map<std::string, QString> shortcuts) {
  model_->shortcuts = std::move(shortcuts);
  list_->viewport()->update();
}

void CommandPalette::search(const QString& typed) {
  auto rows = find_commands(typed.toStdString(), commands_);
  if (typed.isEmpty()) {  // those that were used come first
    std::map<std::string_view, std::size_t> age;
    for (std::size_t i = 0; i < recent_.size(); ++i) age.emplace(recent_[i], i);
    const auto age_of = [&](const FoundCommand& row) {
      const auto at = age.find(commands_[row.index].name);
      return at == age.end() ? recent_.size() : at->second;
    };
    std::stable_sort(rows.begin(), rows.end(), [&](const FoundCommand& a, const FoundCommand& b) {
      return age_of(a) < age_of(b);
    });
  }
  const std::size_t count = rows.size();
  model_->show_rows(std::move(rows), &commands_);
  count_->setText(QString("%1 of %2 commands").arg(count).arg(commands_.size()));
  if (count > 0) list_->setCurrentIndex(model_->index(0));
  place();
}

std::vector<std::string> CommandPalette::found() const {
  std::vector<std::string> out;
  for (const FoundCommand& row : model_->rows()) out.push_back(commands_[row.index].name);
  return out;
}

void CommandPalette::set_docked(bool on) {
  is_docked_ = on;
  escape_->setVisible(!on);
  dock_->setToolTip(on ? "Show it above the views" : "Keep it as a panel, which hides no view");
  dock_->setAccessibleName(dock_->toolTip());
  list_->setMinimumHeight(0);
  place();
}

void CommandPalette::step_aside() {
  if (!is_docked_) hide();
}

void CommandPalette::set_recent(std::vector<std::string> names) {
  recent_ = std::move(names);
  if (line_->text().isEmpty()) search({});
}

void CommandPalette::open(const QString& typed) {
  ask_for_commands();
  show_form(false);
  line_->setText(typed);
  search(typed);
  show();
  raise();
  if (is_docked_ && on_open) on_open();
  line_->setFocus(Qt::ShortcutFocusReason);
  line_->selectAll();
}

void CommandPalette::open_command(const std::string& command, const Map& values) {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    if (commands_[i].name != command) continue;
    show();
    raise();
    if (is_docked_ && on_open) on_open();
    Map all = values;
    std::map<std::string, QString> sources;
    const Map& description = *std::as_const(descriptions_[i]).as_map();
    prefill(description, all, sources);
    form_->open_described(description, all, sources);
    return;
  }
  wanted_ = std::pair(command, values);
  ask_for_commands();
}

void CommandPalette::showEvent(QShowEvent* event) {
  QFrame::showEvent(event);
  if (commands_.empty()) ask_for_commands();
}

void CommandPalette::choose(int row) {
  if (row < 0 || row >= static_cast<int>(model_->rows().size())) return;
  const std::size_t index = model_->rows()[static_cast<std::size_t>(row)].index;
  list_->setCurrentIndex(model_->index(row));
  const auto open_it = [this, index] {
    if (index >= descriptions_.size()) return;
    Map values;
    std::map<std::string, QString> sources;
    const Map& description = *std::as_const(descriptions_[index]).as_map();
    prefill(description, values, sources);
    form_->open_described(description, values, sources);
  };
  const bool has_names = std::all_of(selection_.begin(), selection_.end(), [this](const auto& s) {
    return s.record.number == 0 || names_.contains(s.record.number);
  });
  if (has_names) return open_it();
  // The names were asked for when these records were selected; calls are answered in their order.
  ask(client_, "version", {}, this, [open_it](const Result<Value>&) { open_it(); });
}

void CommandPalette::prefill(const Map& description, Map& values,
                             std::map<std::string, QString>& sources) const {
  const Value* params = description.find("params");
  const auto schema = schema_from_values(params ? *params : Value());
  if (!schema.ok()) return;
  std::vector<bool> is_used(selection_.size(), false);
  for (const ParamSpec& p : *schema) {
    if (values.find(p.name)) continue;
    const TypeTree* t = &type_tree(p.type);
    if (t->kind == TypeKind::one_of)
      for (const auto& option : t->options)
        if (option->kind == TypeKind::reference) {
          t = option.get();
          break;
        }
    // Only what the command needs, or what decides about other arguments.
    if (t->kind != TypeKind::reference ||
        !(p.required || p.name == "id" || p.name == "world" || p.name == "robot"))
      continue;
    for (std::size_t i = 0; i < selection_.size(); ++i) {
      const Handle& h = selection_[i].record;
      const bool fits = std::any_of(t->words.begin(), t->words.end(), [&](const std::string& kind) {
        return kind == h.kind || kind == "any";
      });
      if (!fits || is_used[i]) continue;
      const auto name = names_.find(h.number);
      values.set(p.name, name != names_.end() ? Value(name->second) : Value(h));
      sources[p.name] = "from the selection";
      is_used[i] = true;
      break;
    }
  }
  if (const auto it = last_use_.find(text_entry(description, "name")); it != last_use_.end())
    for (const auto& [name, value] : it->second)
      if (!values.find(name)) {
        values.set(name, value);
        sources[name] = "as last time";
      }
}

void CommandPalette::set_selection(const SelectedPaths& selection) {
  selection_ = selection;
  for (const SelectedPath& s : selection_) {
    if (s.record.number == 0 || names_.contains(s.record.number)) continue;
    const std::uint64_t number = s.record.number;
    ask(client_, "record.describe", Map{{"id", s.record}}, this,
        [this, number](const Result<Value>& r) {
          const Value* name = r.ok() && r->as_map() ? r->as_map()->find("name") : nullptr;
          if (name && name->as_string()) names_[number] = *name->as_string();
        });
  }
}

bool CommandPalette::has_form() const { return scroll_->isVisibleTo(this); }

void CommandPalette::show_form(bool on) {
  scroll_->setVisible(on);
  if (on) scroll_->verticalScrollBar()->setValue(0);
  place();
}

void CommandPalette::place() {
  const Theme& t = theme();
  const bool is_open = has_form();
  const int rows =
      std::min(static_cast<int>(model_->rows().size()), is_open ? kShownRows : kMostRows);
  list_->setFixedHeight(std::max(1, rows) * t.px(32));
  if (is_docked_ && !is_open) {
    list_->setMinimumHeight(t.px(64));
    list_->setMaximumHeight(QWIDGETSIZE_MAX);
  }
  if (QWidget* p = parentWidget(); p && !is_docked_) {
    const int w = std::min(t.px(kWidth), p->width() - t.px(24));
    int h = list_->height() + line_->sizeHint().height() + t.px(20);
    if (is_open) h += form_->sizeHint().height() + t.px(8);
    if (is_open && form_->result()->isVisibleTo(form_)) h = std::max(h, t.px(720));
    h = std::min(h, p->height() - t.px(60));
    setGeometry((p->width() - w) / 2, t.px(40), w, h);
  }
  if (const QModelIndex at = list_->currentIndex(); at.isValid()) list_->scrollTo(at);
}

bool CommandPalette::eventFilter(QObject* object, QEvent* event) {
  if (object == line_ && event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<QKeyEvent*>(event);
    const int row = list_->currentIndex().row(), last = model_->rowCount({}) - 1;
    const auto go = [&](int to) {
      list_->setCurrentIndex(model_->index(std::clamp(to, 0, std::max(0, last))));
    };
    switch (key->key()) {
      case Qt::Key_Down: go(row + 1); return true;
      case Qt::Key_Up: go(row - 1); return true;
      case Qt::Key_PageDown: go(row + 10); return true;
      case Qt::Key_PageUp: go(row - 10); return true;
      case Qt::Key_Return:
      case Qt::Key_Enter:
        if (key->modifiers() & Qt::ControlModifier && has_form()) form_->run();
        else choose(row);
        return true;
      default: break;
    }
  }
  return QFrame::eventFilter(object, event);
}

void CommandPalette::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Escape) {
    if (form_->is_running()) {
      form_->cancel();
    } else if (has_form() && !line_->hasFocus()) {
      show_form(false);
      line_->setFocus(Qt::OtherFocusReason);
    } else if (!is_docked_) {
      hide();
      if (on_close) on_close();
    } else if (has_form()) {
      show_form(false);
    } else {
      line_->clear();
    }
    return;
  }
  QFrame::keyPressEvent(event);
}

void CommandPalette::resizeEvent(QResizeEvent* event) {
  QFrame::resizeEvent(event);
  form_->set_columns(width() < theme().px(kTwoColumns) ? 1 : 2);
}

void CommandPalette::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(rect(), t.panel);
  if (is_docked_) return;
  p.setPen(t.accent);
  p.drawRect(rect().adjusted(0, 0, -1, -1));
}

}  // namespace robomosp::viewer
