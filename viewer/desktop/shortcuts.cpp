// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/shortcuts.h"

#include <algorithm>
#include <utility>

#include <QAction>
#include <QEvent>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QKeySequenceEdit>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QTreeWidget>
#include <QVBoxLayout>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/restyle.h"

namespace robomosp::viewer {
namespace {

QString words_of(const QAction& action) {
  QString text = action.text();
  return text.remove('&').remove("...");
}

QString shown_keys(const QKeySequence& keys) { return keys.toString(QKeySequence::NativeText); }

}  // namespace

Shortcuts::Shortcuts(const Actions& actions, Settings& settings)
    : actions_(actions), settings_(settings) {}

void Shortcuts::load() {
  for (const auto& [name, keys] : settings_.shortcuts())
    if (QAction* action = actions_.find(utf8(name)))
      Actions::set_keys(*action, QKeySequence(keys, QKeySequence::PortableText));
  changed();
}

QAction* Shortcuts::holder(const QKeySequence& keys, const QAction* except) const {
  if (keys.isEmpty()) return nullptr;
  for (QAction* each : actions_.all()) {
    const QKeySequence other = each->shortcut();
    if (each == except || other.isEmpty()) continue;
    // "Ctrl+K" would never come to "Ctrl+K, F".
    if (other.matches(keys) != QKeySequence::NoMatch ||
        keys.matches(other) != QKeySequence::NoMatch)
      return each;
  }
  return nullptr;
}

Result<void> Shortcuts::set(const std::string& name, const QKeySequence& keys) {
  QAction* action = actions_.find(name);
  if (!action)
    return error(ErrorCode::unknown_name, "the menus have no entry \"" + name + "\"",
                 "window.actions{} lists them.", "action");
  if (const QAction* other = holder(keys, action))
    return error(ErrorCode::invalid_argument,
                 utf8(shown_keys(keys)) + " is the shortcut of \"" + utf8(words_of(*other)) +
                     "\", so it cannot be that of \"" + utf8(words_of(*action)) + "\", too",
                 "Choose other keys, or take them from \"" + utf8(words_of(*other)) + "\" first.",
                 "keys");
  Actions::set_keys(*action, keys);
  if (keys == Actions::default_keys(*action)) settings_.forget_shortcut(shown(name));
  else settings_.set_shortcut(shown(name), keys.toString(QKeySequence::PortableText));
  changed();
  return {};
}

Result<void> Shortcuts::reset(const std::string& name) {
  const QAction* action = actions_.find(name);
  return set(name, action ? Actions::default_keys(*action) : QKeySequence());
}

void Shortcuts::reset_all() {
  for (QAction* action : actions_.all()) Actions::set_keys(*action, Actions::default_keys(*action));
  settings_.forget_shortcuts();
  changed();
}

ShortcutsPanel::ShortcutsPanel(Desk& desk, Shortcuts& shortcuts, QWidget* parent)
    : QWidget(parent),
      desk_(desk),
      shortcuts_(shortcuts),
      list_(new QTreeWidget),
      search_(new QLineEdit),
      name_(new QLabel),
      note_(new QLabel),
      keys_(new QKeySequenceEdit),
      set_(new QPushButton("Set")),
      clear_(new QPushButton("No key")),
      reset_(new QPushButton("Reset")),
      take_(new QPushButton) {
  setObjectName("shortcuts");
  setAccessibleName("Shortcuts");
  setProperty("ground", "panel");
  search_->setObjectName("shortcuts_search");
  search_->setAccessibleName("Search shortcuts");
  search_->setPlaceholderText("Search by name, keys or command");
  search_->setToolTip("Words of names, keys or commands");
  search_->addAction(icon("search"), QLineEdit::LeadingPosition);
  connect(search_, &QLineEdit::textChanged, this, [this](const QString& t) { filter(t); });
  list_->setObjectName("shortcuts_list");
  list_->setAccessibleName("Entries of the menus and their keys");
  list_->setToolTip("Entries of the menus with their keys");
  list_->setColumnCount(3);
  list_->setHeaderLabels({"Entry", "Keys", "Command"});
  list_->header()->setObjectName("shortcuts_header");
  list_->header()->setAccessibleName("Columns");
  list_->header()->setToolTip("Columns of the list");
  list_->setRootIsDecorated(false);
  list_->setUniformRowHeights(true);
  list_->setColumnWidth(0, theme().px(200));
  list_->setColumnWidth(1, theme().px(140));
  list_->setSelectionMode(QAbstractItemView::SingleSelection);
  connect(list_, &QTreeWidget::currentItemChanged, this, [this] { show_chosen(); });
  connect(list_, &QTreeWidget::itemActivated, this, [this] { keys_->setFocus(); });

  auto* foot = new QWidget;
  foot->setObjectName("shortcuts_foot");
  foot->setAccessibleName("Change the shortcut");
  auto* across = new QHBoxLayout(foot);
  across->setContentsMargins(8, 4, 8, 4);
  const auto set_up = [&](QWidget* widget, const char* name, const QString& words,
                          const QString& tip) {
    widget->setObjectName(name);
    widget->setAccessibleName(words);
    widget->setToolTip(tip);
    across->addWidget(widget);
  };
  set_up(name_, "shortcuts_name", "Chosen entry", "The entry whose keys are changed");
  set_up(keys_, "shortcuts_keys", "New keys", "Press the new keys here, then Set");
  if (auto* edit = keys_->findChild<QLineEdit*>()) {
    edit->setObjectName("shortcuts_keys_line");
    edit->setAccessibleName("New keys");
    edit->setToolTip("Press the new keys here, then Set");
  }
  set_up(set_, "shortcuts_set", "Set",
         "Give the entry these keys\nwindow.set_keys{action = ..., keys = ...}");
  set_up(take_, "shortcuts_take", "Take the keys from the other entry",
         "Remove the keys from the other entry and give them to this one");
  set_up(clear_, "shortcuts_clear", "No key",
         "Leave the entry without keys\nwindow.set_keys{action = ..., keys = \"\"}");
  set_up(reset_, "shortcuts_reset", "Reset",
         "The keys that the program gives the entry\nwindow.set_keys{action = ...}");
  across->addStretch(1);
  auto* all = new QPushButton("Reset all");
  set_up(all, "shortcuts_reset_all", "Reset all",
         "The keys that the program gives all entries\nwindow.set_keys{}");
  take_->hide();
  connect(set_, &QPushButton::clicked, this, [this] { apply(keys_->keySequence()); });
  connect(clear_, &QPushButton::clicked, this, [this] { apply({}); });
  connect(reset_, &QPushButton::clicked, this, [this] {
    if (const QAction* a = chosen()) apply(Actions::default_keys(*a));
  });
  connect(take_, &QPushButton::clicked, this, [this] {
    const QKeySequence keys = keys_->keySequence();
    if (const QAction* other = shortcuts_.holder(keys, chosen())) {
      (void)shortcuts_.set(utf8(other->objectName()), {});
      desk_.echo("window.set_keys{action = \"" + utf8(other->objectName()) + "\", keys = \"\"}");
    }
    apply(keys);
  });
  connect(all, &QPushButton::clicked, this, [this] {
    shortcuts_.reset_all();
    desk_.echo("window.set_keys{}");
    show_note(*note_, "All entries have the keys that the program gives them.");
  });
  connect(keys_, &QKeySequenceEdit::keySequenceChanged, this, [this](const QKeySequence& keys) {
    const QAction* other = chosen() ? shortcuts_.holder(keys, chosen()) : nullptr;
    take_->setVisible(other != nullptr);
    if (!other) return show_note(*note_, {});
    take_->setText("Take from \"" + words_of(*other) + "\"");
    show_note(*note_, shown_keys(keys) + " is the shortcut of \"" + words_of(*other) + "\".", true);
  });
  note_->setObjectName("shortcuts_note");
  note_->setAccessibleName("What hinders the change");
  note_->setToolTip("What hinders the change");
  note_->setWordWrap(true);
  note_->setContentsMargins(8, 0, 8, 4);
  note_->hide();
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 4, 0, 0);
  column->setSpacing(0);
  column->addWidget(search_);
  column->addWidget(list_, 1);
  column->addWidget(foot);
  column->addWidget(note_);
  setFocusProxy(search_);
  shortcuts_.changed.add(this, [this] { show_rows(); });
  show_chosen();
}

void ShortcutsPanel::fill() {
  list_->clear();
  for (const QAction* action : shortcuts_.actions().all()) {
    auto* row = new QTreeWidgetItem(list_);
    row->setData(0, Qt::UserRole, action->objectName());
  }
  show_rows();
  list_->setCurrentItem(list_->topLevelItem(0));
  list_->resizeColumnToContents(0);
  list_->resizeColumnToContents(1);
}

void ShortcutsPanel::show_rows() {
  const Theme& t = theme();
  for (int i = 0; i < list_->topLevelItemCount(); ++i) {
    QTreeWidgetItem* row = list_->topLevelItem(i);
    const QAction* action = shortcuts_.actions().find(utf8(row->data(0, Qt::UserRole).toString()));
    if (!action) continue;
    row->setText(0, words_of(*action));
    row->setIcon(0, action->icon());
    const bool is_changed = action->shortcut() != Actions::default_keys(*action);
    row->setText(1, shown_keys(action->shortcut()) + (is_changed ? "  (changed)" : ""));
    row->setText(2, command_of(*action));
    row->setForeground(2, t.text_dim);
    row->setForeground(1, is_changed ? t.accent : t.text);
  }
  filter(search_->text());
  show_chosen();
}

void ShortcutsPanel::filter(const QString& text) {
  const QStringList words = text.simplified().split(' ', Qt::SkipEmptyParts);
  for (int i = 0; i < list_->topLevelItemCount(); ++i) {
    QTreeWidgetItem* row = list_->topLevelItem(i);
    const QString all = row->text(0) + '\n' + row->text(1) + '\n' + row->text(2);
    row->setHidden(!std::all_of(words.begin(), words.end(), [&](const QString& w) {
      return all.contains(w, Qt::CaseInsensitive);
    }));
  }
}

QAction* ShortcutsPanel::chosen() const {
  const QTreeWidgetItem* row = list_->currentItem();
  return row ? shortcuts_.actions().find(utf8(row->data(0, Qt::UserRole).toString())) : nullptr;
}

void ShortcutsPanel::show_chosen() {
  const QAction* action = chosen();
  name_->setText(action ? words_of(*action) : QString("Choose an entry"));
  for (QWidget* each : {static_cast<QWidget*>(keys_), static_cast<QWidget*>(set_),
                        static_cast<QWidget*>(clear_), static_cast<QWidget*>(reset_)})
    each->setEnabled(action != nullptr);
  if (action) reset_->setEnabled(action->shortcut() != Actions::default_keys(*action));
  keys_->setKeySequence(action ? action->shortcut() : QKeySequence());
  take_->hide();
  show_note(*note_, {});
}

void ShortcutsPanel::apply(const QKeySequence& keys) {
  const QAction* action = chosen();
  if (!action) return;
  const std::string name = utf8(action->objectName());
  if (const auto r = shortcuts_.set(name, keys); !r.ok()) {
    show_note(*note_, shown(r.error().sentence()), true);
    return;
  }
  desk_.echo("window.set_keys{action = \"" + name + "\", keys = \"" +
             utf8(keys.toString(QKeySequence::PortableText)) + "\"}");
  show_note(*note_, keys.isEmpty() ? words_of(*action) + " has no keys now."
                                   : words_of(*action) + " has " + shown_keys(keys) + " now.");
}

void ShortcutsPanel::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) show_rows();
  QWidget::changeEvent(event);
}

}  // namespace robomosp::viewer
