// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/actions.h"

#include <utility>

#include <QMenu>

#include "viewer/theme/icons.h"

namespace robomosp::viewer {
namespace {

constexpr const char* kCommand = "command";

}  // namespace

QAction* Actions::add(QMenu* menu, const ActionSpec& spec, std::function<void(bool)> run) {
  auto* action = new QAction(QString::fromUtf8(spec.text), owner_);
  action->setObjectName(spec.name);
  if (*spec.icon) action->setIcon(icon(spec.icon));
  if (*spec.keys) action->setShortcut(QKeySequence(spec.keys));
  action->setCheckable(spec.is_checkable);
  action->setProperty(kCommand, QString::fromUtf8(spec.command));
  QString words = action->text();
  words.remove('&').remove(QStringLiteral("..."));
  const QString keys = action->shortcut().toString(QKeySequence::NativeText);
  action->setToolTip(words + (keys.isEmpty() ? QString() : " (" + keys + ")") +
                     (*spec.command ? "\n" + QString::fromUtf8(spec.command) : QString()));
  action->setStatusTip(QString());
  if (run)
    QObject::connect(action, &QAction::triggered, owner_,
                     [run = std::move(run)](bool on) { run(on); });
  if (menu) menu->addAction(action);
  all_.push_back(action);
  by_name_.emplace(spec.name, action);
  return action;
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

QString command_of(const QAction& action) { return action.property(kCommand).toString(); }

}  // namespace robomosp::viewer
