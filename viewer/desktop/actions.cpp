// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/actions.h"

#include <utility>

#include <QMenu>

#include "viewer/theme/icons.h"

namespace robomosp::viewer {
namespace {

constexpr const char* kCommand = "command";
constexpr const char* kDefaultKeys = "default_keys";

void show_tip(QAction& action) {
  QString words = action.text();
  words.remove('&').remove(QStringLiteral("..."));
  const QString keys = action.shortcut().toString(QKeySequence::NativeText);
  const QString command = action.property(kCommand).toString();
  action.setToolTip(words + (keys.isEmpty() ? QString() : " (" + keys + ")") +
                    (command.isEmpty() ? QString() : "\n" + command));
}

}  // namespace

QAction* Actions::add(QMenu* menu, const ActionSpec& spec, std::function<void(bool)> run) {
  auto* action = new QAction(QString::fromUtf8(spec.text), owner_);
  action->setObjectName(spec.name);
  if (*spec.icon) action->setIcon(icon(spec.icon));
  if (*spec.keys) action->setShortcut(QKeySequence(spec.keys));
  action->setCheckable(spec.is_checkable);
  action->setStatusTip(QString());
  const std::string command = *spec.command ? spec.command : trigger_line(spec.name);
  const bool echoes = spec.echoes && command == trigger_line(spec.name);
  if (run)
    QObject::connect(action, &QAction::triggered, owner_,
                     [this, run = std::move(run), line = echoes ? command : ""](bool on) {
                       run(on);
                       if (!line.empty() && echo) echo(line);
                     });
  if (menu) menu->addAction(action);
  adopt(*action, QString::fromStdString(command));
  return action;
}

void Actions::adopt(QAction& action, const QString& command) {
  action.setProperty(kDefaultKeys, QVariant::fromValue(action.shortcut()));
  action.setProperty(kCommand, command);
  show_tip(action);
  all_.push_back(&action);
  by_name_.emplace(action.objectName().toStdString(), &action);
}

void Actions::set_keys(QAction& action, const QKeySequence& keys) {
  action.setShortcut(keys);
  show_tip(action);
}

QKeySequence Actions::default_keys(const QAction& action) {
  return action.property(kDefaultKeys).value<QKeySequence>();
}

QAction* Actions::find(std::string_view name) const {
  const auto at = by_name_.find(name);
  return at == by_name_.end() ? nullptr : at->second;
}

void Actions::enable(std::string_view name, bool on) const {
  if (QAction* action = find(name)) action->setEnabled(on);
}

void Actions::check(std::string_view name, bool on) const {
  if (QAction* action = find(name)) action->setChecked(on);
}

std::string trigger_line(std::string_view action) {
  return "window.trigger{action = \"" + std::string(action) + "\"}";
}

QString command_of(const QAction& action) { return action.property(kCommand).toString(); }

}  // namespace robomosp::viewer
