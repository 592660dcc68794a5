// SPDX-License-Identifier: GPL-3.0-or-later
// Field: base of all widgets that show and change one value (layer: GUI).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <QPainter>
#include <QString>
#include <QWidget>

#include "kernel/value.h"

class QPushButton;

namespace robomosp::viewer {

/// A fault of a part of a value: its path as in place_fault(), and its sentence.
struct PartFault {
  std::string path;
  QString sentence;
};

/// A widget for one value of a command, record or provider. Values are those of commands: numbers
/// in SI units, texts with units or expressions, names of records. A value that was not edited is
/// returned as it was set. [GUI thread]
class Field : public QWidget {
 public:
  /// Steps of a change. A drag is one drag_begun, any number of dragged, and one of the last two;
  /// every other edit is `changed`.
  enum class Stage { changed, drag_begun, dragged, drag_ended, drag_cancelled };

  explicit Field(QWidget* parent = nullptr);

  /// Nothing = not given.
  [[nodiscard]] virtual std::optional<Value> value() const = 0;
  /// Does not call on_change.
  virtual void set_value(const std::optional<Value>& value) = 0;
  /// The value that counts while none is given; shown in quiet text.
  virtual void set_default(const std::optional<Value>& value);
  /// Several records are shown, and their values differ.
  virtual void set_mixed(bool on);
  /// The sentence of a fault; empty = none. It is the first line of the tool tip.
  void set_fault(const QString& sentence);
  /// Shows a fault of the value or of the part at `path` ("[2].alpha", ".x"; empty = the value).
  /// False = the field has no such part; then the fault is shown at the whole.
  virtual bool place_fault(std::string_view path, const QString& sentence);
  virtual void clear_faults();
  /// Whether it writes the sentence of a fault of that part itself, such as below an inner row.
  [[nodiscard]] virtual bool shows_sentence(std::string_view path) const {
    (void)path;
    return false;
  }
  /// The faults that it shows, at the value or at parts of it.
  [[nodiscard]] virtual std::vector<PartFault> shown_faults() const;
  [[nodiscard]] const QString& fault() const { return fault_; }
  [[nodiscard]] bool is_mixed() const { return is_mixed_; }
  [[nodiscard]] const std::optional<Value>& default_value() const { return default_; }

  /// Names the field for people, assistive technology and tests: label, sentence, the command line
  /// it belongs to, and the object name.
  void describe(const QString& label, const QString& doc, const QString& command,
                const QString& object_name);
  /// A note on where the value comes from, such as "from the selection"; shown in quiet text where
  /// it fits.
  virtual void set_source(const QString& note);
  [[nodiscard]] const QString& source() const { return source_; }
  /// The part that the last change was about, as the end of a path: "[2].alpha", ".x"; empty = the
  /// whole value. changed_value() is its value; nothing = it was removed.
  [[nodiscard]] virtual std::string changed_path() const { return {}; }
  [[nodiscard]] virtual std::optional<Value> changed_value() const { return value(); }
  /// The unit of all its parts where these have no space for it; empty otherwise. Forms show it
  /// beside the label.
  [[nodiscard]] virtual QString unit_beside() const { return {}; }
  /// Looks as under the mouse or with the focus, for pictures of all states.
  void hold_look(bool is_hovered, bool has_focus);
  /// Whether it needs more than one line of a form.
  [[nodiscard]] virtual bool is_tall() const { return false; }

  /// Called when is_tall() may have changed.
  std::function<void()> on_height;
  /// Called after each change by the user.
  std::function<void(Stage)> on_change;

 protected:
  void notify(Stage stage);
  void show_tip();
  void enterEvent(QEnterEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void focusInEvent(QFocusEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
  void changeEvent(QEvent* event) override;
  [[nodiscard]] bool is_hovered() const { return is_hovered_ || holds_hover_; }
  [[nodiscard]] bool looks_focused() const { return hasFocus() || holds_focus_; }
  /// Called after the theme changed.
  virtual void take_theme() {}

  std::optional<Value> default_;

 private:
  QString fault_, doc_, command_, source_;
  bool is_mixed_ = false, is_hovered_ = false;
  bool holds_hover_ = false, holds_focus_ = false;
};

/// States in which the frame of a field is painted.
struct FieldLook {
  bool is_hovered = false, has_focus = false, has_fault = false, is_enabled = true;
  bool is_pressed = false;  ///< while it is dragged
};
/// Ground and border. The focus ring is 2 px wide and lies within `rect`.
void paint_field(QPainter& painter, const QRect& rect, const FieldLook& look);
/// A short vertical line, such as the mark of an axis at the left of a field.
void paint_axis_mark(QPainter& painter, const QRect& field, int axis);
/// Text that is cut with an ellipsis at its end.
void paint_text(QPainter& painter, const QRect& rect, int flags, const QString& text);

/// Makes a button one of several side by side of which one is checked.
void style_as_segment(QPushButton* button);

/// Number with at most 6 significant digits, or with a fixed number of `decimals`, and U+2212 as
/// minus; "-0" is "0". "∞" and "not a number" for values that are not finite.
[[nodiscard]] QString number_text(double value, int decimals = -1);
/// A unit as shown behind a number: "mm/s²", "°", "N m".
[[nodiscard]] QString unit_text(std::string_view unit);

[[nodiscard]] inline QString qt(std::string_view s) {
  return QString::fromUtf8(s.data(), static_cast<qsizetype>(s.size()));
}

}  // namespace robomosp::viewer
