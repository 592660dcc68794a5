// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/automation.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <QAbstractButton>
#include <QAbstractItemView>
#include <QApplication>
#include <QBuffer>
#include <QComboBox>
#include <QImage>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QMouseEvent>
#include <QPainter>
#include <QPlainTextEdit>
#include <QProgressBar>
#include <QSlider>
#include <QTabBar>
#include <QTextEdit>
#include <QTreeView>

#include "viewer/desktop/console_output.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/navigator.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

using Clock = std::chrono::steady_clock;

Error unknown_widget(const std::string& name) {
  return error(ErrorCode::unknown_name, "the window has no widget \"" + name + "\"",
               "window.widgets{} lists its widgets.", "widget");
}

Qt::KeyboardModifiers modifiers_of(const std::string& text) {
  Qt::KeyboardModifiers out;
  for (const QString& word : shown(text).split('+', Qt::SkipEmptyParts)) {
    const QString w = word.trimmed().toLower();
    if (w == "ctrl") out |= Qt::ControlModifier;
    if (w == "shift") out |= Qt::ShiftModifier;
    if (w == "alt") out |= Qt::AltModifier;
    if (w == "meta") out |= Qt::MetaModifier;
  }
  return out;
}

Qt::MouseButton button_of(const std::string& word) {
  return word == "middle" ? Qt::MiddleButton : word == "right" ? Qt::RightButton : Qt::LeftButton;
}

/// The texts of a row and of those that are visible below it.
void add_rows(const QAbstractItemView& view, const QModelIndex& parent, List& rows, int depth) {
  constexpr int kMostRows = 2000;
  const QAbstractItemModel* model = view.model();
  const auto* tree = qobject_cast<const QTreeView*>(&view);
  for (int i = 0; i < model->rowCount(parent) && static_cast<int>(rows.size()) < kMostRows; ++i) {
    List texts;
    for (int c = 0; c < model->columnCount(parent); ++c)
      texts.emplace_back(
          utf8(QString(2 * depth * (c == 0), ' ') + model->index(i, c, parent).data().toString()));
    rows.emplace_back(std::move(texts));
    const QModelIndex index = model->index(i, 0, parent);
    if (tree && tree->isExpanded(index)) add_rows(view, index, rows, depth + 1);
  }
}

/// The first visible row with a text, in order from above.
QModelIndex row_with(const QAbstractItemView& view, const QModelIndex& parent,
                     const QString& text) {
  const QAbstractItemModel* model = view.model();
  for (int i = 0; i < model->rowCount(parent); ++i) {
    const QModelIndex index = model->index(i, 0, parent);
    if (index.data().toString() == text) return index;
    if (const auto* tree = qobject_cast<const QTreeView*>(&view); tree && tree->isExpanded(index))
      if (const QModelIndex below = row_with(view, index, text); below.isValid()) return below;
  }
  return {};
}

void send_mouse(QWidget& widget, QEvent::Type type, QPointF at, Qt::MouseButton button,
                Qt::MouseButtons buttons, Qt::KeyboardModifiers keys) {
  QMouseEvent event(type, at, widget.mapToGlobal(at), button, buttons, keys);
  QApplication::sendEvent(&widget, &event);
}

/// The widget that gets the mouse at a place: pictures and lists have children for that.
QWidget& mouse_target(QWidget& widget, QPointF& at) {
  if (auto* view = qobject_cast<QAbstractScrollArea*>(&widget)) {
    at = view->viewport()->mapFrom(&widget, at.toPoint());
    return *view->viewport();
  }
  return widget;
}

void send_key(QWidget& widget, const QKeyCombination& key, const QString& text) {
  const auto modifiers = key.keyboardModifiers();
  // Shortcuts first, as Qt does.
  QKeyEvent override_event(QEvent::ShortcutOverride, key.key(), modifiers, text);
  override_event.ignore();
  QApplication::sendEvent(&widget, &override_event);
  if (!override_event.isAccepted()) {
    const QKeySequence wanted(key);
    for (QAction* action : widget.window()->findChildren<QAction*>())
      if (action->isEnabled() && action->shortcuts().contains(wanted)) return action->trigger();
  }
  QKeyEvent press(QEvent::KeyPress, key.key(), modifiers, text);
  QApplication::sendEvent(&widget, &press);
  QKeyEvent release(QEvent::KeyRelease, key.key(), modifiers, text);
  QApplication::sendEvent(&widget, &release);
}

}  // namespace

Result<std::string> photograph_of(QWidget& widget) {
  const double ratio = widget.devicePixelRatioF();
  QImage image(widget.size() * ratio, QImage::Format_RGB32);
  image.setDevicePixelRatio(ratio);
  image.fill(theme().window);
  widget.render(&image);
  // A picture drawn by OpenGL is not among what the widget renders.
  QPainter painter(&image);
  std::vector<Display*> displays;
  if (auto* self = dynamic_cast<Display*>(&widget)) displays.push_back(self);
  for (QWidget* child : widget.findChildren<QWidget*>("display"))
    if (auto* display = dynamic_cast<Display*>(child)) displays.push_back(display);
  for (Display* display : displays) {
    if (!display->isVisible()) continue;
    const QImage picture = display->shown();
    if (picture.isNull()) continue;
    painter.drawImage(QRect(display->mapTo(&widget, QPoint()), display->size()), picture);
    // What is over the picture, such as the names of four views.
    for (QWidget* child : display->findChildren<QWidget*>(QString(), Qt::FindDirectChildrenOnly))
      if (child->isVisible() && child->objectName() != "display_surface" &&
          child->objectName() != "display_overlay")
        child->render(&painter, child->mapTo(&widget, QPoint()), QRegion(), QWidget::DrawChildren);
    // What is over the view, such as the palette.
    const QRect place(display->mapTo(&widget, QPoint()), display->size());
    for (QWidget* child : widget.findChildren<QWidget*>(QString(), Qt::FindDirectChildrenOnly))
      if (child->isVisible() && !child->isWindow() && !child->isAncestorOf(display) &&
          child != display && child->geometry().intersects(place))
        child->render(&painter, child->pos());
  }
  painter.end();
  QByteArray bytes;
  QBuffer buffer(&bytes);
  buffer.open(QIODevice::WriteOnly);
  if (!image.save(&buffer, "PNG"))
    return error(ErrorCode::internal, "the picture could not be encoded", "Report this.");
  return std::string(bytes.constData(), static_cast<std::size_t>(bytes.size()));
}

Automation::Automation(MainWindow& window) : window_(&window) {}

std::shared_ptr<Automation> Automation::install(MainWindow& window) {
  std::shared_ptr<Automation> made(new Automation(window));
  ioci::Windows::of(window.desk().application()).set(made);
  return made;
}

void Automation::remove(Automation& automation, ioci::Application& app) {
  {
    const std::lock_guard lock(automation.gate_);
    automation.is_gone_ = true;
  }
  ioci::Windows::of(app).set(nullptr);
}

MainWindow& Automation::window() const { return *static_cast<MainWindow*>(window_.data()); }

Result<Value> Automation::on_window(const std::function<Result<Value>()>& call,
                                    Progress& progress) {
  struct Wait {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<Value>> result;
    bool is_left = false;
  };
  const auto wait = std::make_shared<Wait>();
  std::unique_lock gate(gate_);
  if (is_gone_) return error(ErrorCode::cancelled, "the window has closed");
  QMetaObject::invokeMethod(
      window_.data(),
      [wait, call] {
        {
          const std::lock_guard lock(wait->mutex);
          if (wait->is_left) return;
        }
        Result<Value> result = call();
        const std::lock_guard lock(wait->mutex);
        wait->result = std::move(result);
        wait->changed.notify_all();
      },
      Qt::QueuedConnection);
  gate.unlock();
  std::unique_lock lock(wait->mutex);
  while (!wait->result) {
    wait->changed.wait_for(lock, std::chrono::milliseconds(50));
    if (wait->result) break;
    if (is_gone_ || progress.cancelled()) {
      wait->is_left = true;
      return error(ErrorCode::cancelled,
                   is_gone_ ? "the window has closed" : "the call was cancelled");
    }
  }
  return std::move(*wait->result);
}

Result<Value> Automation::wait_settled(double at_most, Progress& progress) {
  const auto end = Clock::now() + std::chrono::duration<double>(at_most);
  // Twice in a row: what arrived may have begun something else.
  int settled = 0;
  for (;;) {
    RMP_TRY_ASSIGN(
        const Value now,
        on_window([this]() -> Result<Value> { return Value(window().is_settled()); }, progress));
    settled = now.as_bool() && *now.as_bool() ? settled + 1 : 0;
    if (settled >= 2) return Value(true);
    if (Clock::now() >= end) return Value(false);
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable().wait_for(lock, std::chrono::milliseconds(30));
  }
}

Result<Value> Automation::act(std::string_view what, const Map& args, Progress& progress) {
  if (what == "settle") return wait_settled(number_at(args, "at_most"), progress);
  if (what == "photograph") RMP_TRY(wait_settled(30, progress));
  return on_window([this, what = std::string(what), args] { return act_here(what, args); },
                   progress);
}

Result<Value> Automation::act_here(std::string_view what, const Map& args) {
  const Desk::Quiet quiet(window().desk());
  if (what == "actions") return actions();
  if (what == "trigger") return trigger(args);
  if (what == "open") return open(args);
  if (what == "set") return set(args);
  if (what == "set_keys") return set_keys(args);
  if (what == "widgets") return widgets(args);
  if (what == "click") return click(args);
  if (what == "drag") return drag(args);
  if (what == "type") return type(args);
  if (what == "read") return read(args);
  if (what == "select") return select(args);
  if (what == "show_member") return show_member(args);
  if (what == "fade_member") return fade_member(args);
  if (what == "settle") return Value(window().is_settled());
  if (what == "photograph") return photograph(args);
  return error(ErrorCode::internal, "the window does not know window." + std::string(what),
               "Report this.");
}

Result<QWidget*> Automation::find(const std::string& path) const {
  QWidget* at = &window();
  for (const QString& name : shown(path).split('/', Qt::SkipEmptyParts)) {
    QWidget* found = nullptr;
    if (at == &window() && name == window().objectName()) continue;
    for (QWidget* each : at->findChildren<QWidget*>(name))
      if (!found || (each->isVisible() && !found->isVisible())) found = each;
    // Menus and popups are windows of their own.
    if (!found && at == &window())
      for (QWidget* top : QApplication::topLevelWidgets())
        if (top->objectName() == name && top->isVisible()) found = top;
    if (!found) return unknown_widget(path);
    at = found;
  }
  return at;
}

Result<Value> Automation::actions() const {
  List out;
  for (const QAction* a : window().actions().all())
    out.emplace_back(Map{{"name", utf8(a->objectName())},
                         {"text", utf8(QString(a->text()).remove('&'))},
                         {"keys", utf8(a->shortcut().toString())},
                         {"command", utf8(command_of(*a))},
                         {"is_enabled", a->isEnabled()},
                         {"is_checked", a->isChecked()}});
  return Value(std::move(out));
}

Result<Value> Automation::trigger(const Map& args) {
  const std::string name = text_at(args, "action");
  QAction* action = window().actions().find(name);
  if (!action)
    return error(ErrorCode::unknown_name, "the menus have no entry \"" + name + "\"",
                 "window.actions{} lists them.", "action");
  if (!action->isEnabled())
    return error(ErrorCode::invalid_argument,
                 "the entry \"" + name + "\" of the menus cannot be used now",
                 "Select or open what it works on first.", "action");
  action->trigger();
  return Value();
}

Result<Value> Automation::open(const Map& args) {
  if (const auto record = handle_at(args, "record")) {
    if (record->kind == "recording" || record->kind == "run") {
      window().open_handle(*record);
      return Value();
    }
    const auto rows = window().navigator().model().rows_of({*record, {}});
    const QString name =
        rows.isEmpty() ? shown(record->kind) : rows.front().data(Qt::DisplayRole).toString();
    if (!window().open_view(*record, name))
      return error(ErrorCode::unsupported, "this system can draw no picture in a window",
                   "robomosp-desktop --graphics reports why.");
    window().desk().select({{*record, {}}});
    return Value();
  }
  const std::string panel = text_at(args, "panel");
  if (!window().panels().contains(shown(panel)))
    return error(ErrorCode::unknown_name, "there is no panel \"" + panel + "\"",
                 "Panels are " + utf8(window().panels().join(", ")) + ".", "panel");
  const std::string page = text_at(args, "page");
  if (panel == "help" && !page.empty()) window().show_page(shown(page));
  else window().show_panel(shown(panel));
  return Value();
}

Result<Value> Automation::set_keys(const Map& args) {
  const Value* keys = args.find("keys");
  const std::string* text = keys ? keys->as_string() : nullptr;
  RMP_TRY(window().set_keys(text_at(args, "action"),
                            text ? std::optional(shown(*text)) : std::nullopt));
  return Value();
}

Result<Value> Automation::set(const Map& args) {
  const std::string space = text_at(args, "workspace"), look = text_at(args, "theme");
  for (std::size_t i = 0; i < 4; ++i)
    if (space == kWorkspaceNames[i]) window().set_workspace(static_cast<Workspace>(i));
  const double zoom = number_at(args, "zoom");
  if (!look.empty() || zoom > 0)
    window().set_theme_and_zoom(look.empty() ? theme().is_dark : look == "dark",
                                zoom > 0 ? zoom : theme().zoom);
  if (const auto size = pair_at(args, "size"))
    window().resize(std::clamp(static_cast<int>(size->first), 480, 16000),
                    std::clamp(static_cast<int>(size->second), 320, 16000));
  return Value(Map{{"workspace", kWorkspaceNames[static_cast<std::size_t>(window().workspace())]},
                   {"theme", theme().is_dark ? "dark" : "light"},
                   {"zoom", theme().zoom},
                   {"size", List{window().width(), window().height()}}});
}

Result<Value> Automation::widgets(const Map& args) const {
  QWidget* from = &window();
  if (const std::string inside = text_at(args, "inside"); !inside.empty()) {
    RMP_TRY_ASSIGN(from, find(inside));
  }
  List out;
  for (QWidget* each : from->findChildren<QWidget*>()) {
    if (each->objectName().isEmpty() || each->objectName().startsWith("qt_")) continue;
    if (!each->isVisible() && !flag_at(args, "hidden")) continue;
    const QWidget* around = each->parentWidget();
    while (around && around->objectName().isEmpty()) around = around->parentWidget();
    const QPoint at = each->mapTo(&window(), QPoint());
    out.emplace_back(Map{{"widget", utf8(each->objectName())},
                         {"inside", around ? utf8(around->objectName()) : std::string()},
                         {"class", each->metaObject()->className()},
                         {"name", utf8(each->accessibleName())},
                         {"tip", utf8(each->toolTip())},
                         {"place", List{at.x(), at.y(), each->width(), each->height()}},
                         {"is_visible", each->isVisible()},
                         {"is_enabled", each->isEnabled()}});
  }
  return Value(std::move(out));
}

Result<Value> Automation::click(const Map& args) {
  RMP_TRY_ASSIGN(QWidget * widget, find(text_at(args, "widget")));
  if (!widget->isVisible() || !widget->isEnabled())
    return error(ErrorCode::invalid_argument,
                 "the widget \"" + text_at(args, "widget") + "\" is " +
                     (widget->isVisible() ? "disabled" : "not visible"),
                 "Open its panel first.", "widget");
  QPointF at(widget->width() / 2.0, widget->height() / 2.0);
  if (const auto place = pair_at(args, "at")) at = QPointF(place->first, place->second);
  if (const std::string row = text_at(args, "row"); !row.empty()) {
    auto* view = qobject_cast<QAbstractItemView*>(widget);
    const QModelIndex index = view ? row_with(*view, {}, shown(row)) : QModelIndex();
    if (!index.isValid())
      return error(ErrorCode::unknown_name, "the widget shows no row \"" + row + "\"",
                   "window.read lists its rows.", "row");
    view->scrollTo(index);
    const QPoint middle = view->visualRect(index).center();
    at = view->viewport()->mapTo(view, middle);
  }
  QWidget& target = mouse_target(*widget, at);
  const Qt::MouseButton button = button_of(text_at(args, "button"));
  const Qt::KeyboardModifiers keys = modifiers_of(text_at(args, "keys"));
  if (widget->focusPolicy() & Qt::ClickFocus) widget->setFocus(Qt::MouseFocusReason);
  send_mouse(target, QEvent::MouseButtonPress, at, button, button, keys);
  send_mouse(target, QEvent::MouseButtonRelease, at, button, {}, keys);
  if (flag_at(args, "twice")) {
    send_mouse(target, QEvent::MouseButtonDblClick, at, button, button, keys);
    send_mouse(target, QEvent::MouseButtonRelease, at, button, {}, keys);
  }
  return Value();
}

Result<Value> Automation::drag(const Map& args) {
  RMP_TRY_ASSIGN(QWidget * widget, find(text_at(args, "widget")));
  const auto from = pair_at(args, "from"), to = pair_at(args, "to");
  if (!from || !to) return error(ErrorCode::invalid_argument, "give two places", {}, "from");
  const Qt::MouseButton button = button_of(text_at(args, "button"));
  const Qt::KeyboardModifiers keys = modifiers_of(text_at(args, "keys"));
  constexpr int kSteps = 10;
  QPointF at(from->first, from->second);
  const QPointF by = (QPointF(to->first, to->second) - at) / kSteps;
  QPointF moved = at;
  QWidget& target = mouse_target(*widget, moved);
  send_mouse(target, QEvent::MouseButtonPress, moved, button, button, keys);
  for (int i = 0; i < kSteps; ++i) {
    moved += by;
    send_mouse(target, QEvent::MouseMove, moved, Qt::NoButton, button, keys);
  }
  send_mouse(target, QEvent::MouseButtonRelease, moved, button, {}, keys);
  return Value();
}

Result<Value> Automation::type(const Map& args) {
  RMP_TRY_ASSIGN(QWidget * widget, find(text_at(args, "widget")));
  if (!widget->isVisible() || !widget->isEnabled())
    return error(ErrorCode::invalid_argument,
                 "the widget \"" + text_at(args, "widget") + "\" cannot be typed into now",
                 "Open its panel first.", "widget");
  QWidget* target = widget->focusProxy() ? widget->focusProxy() : widget;
  target->setFocus(Qt::OtherFocusReason);
  for (const QChar c : shown(text_at(args, "text"))) {
    if (c == '\n') send_key(*target, QKeyCombination(Qt::ShiftModifier, Qt::Key_Return), "\n");
    else send_key(*target, QKeyCombination(Qt::Key(c.toUpper().unicode())), QString(c));
  }
  const std::string keys = text_at(args, "keys");
  if (keys.empty()) return Value();
  const QKeySequence sequence(shown(keys));
  for (int i = 0; i < sequence.count(); ++i) {
    const QKeyCombination key = sequence[static_cast<uint>(i)];
    if (key.key() == Qt::Key_unknown)
      return error(ErrorCode::invalid_argument, "\"" + keys + "\" is no key",
                   "Write such as Ctrl+Z or Return.", "keys");
    QWidget* now = QApplication::focusWidget() ? QApplication::focusWidget() : target;
    send_key(*now, key, key.key() == Qt::Key_Return ? "\r" : QString());
  }
  return Value();
}

Result<Value> Automation::read(const Map& args) const {
  RMP_TRY_ASSIGN(QWidget * widget, find(text_at(args, "widget")));
  Map out;
  QString text;
  if (const auto* label = qobject_cast<QLabel*>(widget)) text = label->text();
  else if (const auto* line = qobject_cast<QLineEdit*>(widget)) text = line->text();
  else if (const auto* lines = dynamic_cast<ConsoleOutput*>(widget)) text = lines->text();
  else if (const auto* plain = qobject_cast<QPlainTextEdit*>(widget)) text = plain->toPlainText();
  else if (const auto* rich = qobject_cast<QTextEdit*>(widget)) text = rich->toPlainText();
  else if (const auto* button = qobject_cast<QAbstractButton*>(widget)) text = button->text();
  else if (const auto* combo = qobject_cast<QComboBox*>(widget)) text = combo->currentText();
  else text = widget->windowTitle();
  out.set("text", utf8(text));
  if (const auto* button = qobject_cast<QAbstractButton*>(widget); button && button->isCheckable())
    out.set("is_checked", button->isChecked());
  out.set("is_enabled", widget->isEnabled());
  out.set("is_visible", widget->isVisible());
  out.set("has_focus", widget->hasFocus());
  if (const auto* slider = qobject_cast<QSlider*>(widget))
    out.set("value", static_cast<double>(slider->value()));
  if (const auto* bar = qobject_cast<QProgressBar*>(widget))
    out.set("value", static_cast<double>(bar->value()));
  if (const auto* view = qobject_cast<QAbstractItemView*>(widget); view && view->model()) {
    List rows;
    add_rows(*view, {}, rows, 0);
    out.set("rows", std::move(rows));
  }
  if (const auto* tabs = qobject_cast<QTabBar*>(widget)) {
    List rows;
    for (int i = 0; i < tabs->count(); ++i) rows.emplace_back(List{utf8(tabs->tabText(i))});
    out.set("rows", std::move(rows));
    out.set("text", utf8(tabs->tabText(tabs->currentIndex())));
  }
  return Value(std::move(out));
}

Result<Value> Automation::select(const Map& args) {
  const auto record = handle_at(args, "record");
  window().desk().select(record ? Selection{{*record, text_at(args, "path")}} : Selection());
  return Value();
}

Result<Value> Automation::show_member(const Map& args) {
  const auto world = handle_at(args, "record");
  const std::string member = text_at(args, "member");
  for (ViewTab* view : window().views()) {
    if (view->what() != world) continue;
    if (!view->has_member(member))
      return error(ErrorCode::unknown_name,
                   "the world \"" + utf8(view->name()) + "\" has no member \"" + member + "\"",
                   "Name it with its list, as record.outline does: \"objects.table\".", "member");
    view->show_member(member, flag_at(args, "shown"));
    return Value();
  }
  return error(ErrorCode::not_found, "no view shows the world",
               "Open it with window.open{record = ...}.", "record");
}

Result<Value> Automation::fade_member(const Map& args) {
  const auto record = handle_at(args, "record");
  if (!record) return error(ErrorCode::invalid_argument, "no record is given", {}, "record");
  const std::string member = text_at(args, "member");
  if (record->kind == "world" && member.empty())
    return error(ErrorCode::invalid_argument, "no member of the world is given",
                 "Name it with its list, as record.outline does: \"objects.table\".", "member");
  std::vector<ViewTab*> views = window().views();
  // The view that is seen first.
  std::stable_partition(views.begin(), views.end(),
                        [this](ViewTab* view) { return view == window().current_view(); });
  for (ViewTab* view : views)
    if (view->fade({{*record, member}}, number_at(args, "opacity"))) return Value();
  return error(ErrorCode::not_found,
               "no view draws " + (member.empty() ? "the " + record->kind
                                                  : "\"" + member + "\" of the " + record->kind),
               "Open a record that shows it with window.open{record = ...}, and name members and "
               "parts as record.outline does: \"objects.table\", \"links.forearm\".",
               "member");
}

Result<Value> Automation::photograph(const Map& args) const {
  QWidget* widget = &window();
  if (const std::string name = text_at(args, "widget"); !name.empty()) {
    RMP_TRY_ASSIGN(widget, find(name));
  }
  RMP_TRY_ASSIGN(std::string png, photograph_of(*widget));
  return Value(std::move(png));
}

}  // namespace robomosp::viewer
