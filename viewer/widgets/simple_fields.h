// SPDX-License-Identifier: GPL-3.0-or-later
// Fields for switches, texts, files, colours, scripts and values written as Lua (layer: GUI).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <QColor>

#include "viewer/widgets/field.h"

class QLineEdit;
class QPlainTextEdit;
class QToolButton;

namespace robomosp::viewer {

/// A box to tick, with a note beside it. Space and a click toggle; Delete takes the default.
class BoolField : public Field {
 public:
  explicit BoolField(QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  void set_note(const QString& note);
  [[nodiscard]] bool is_on() const;
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void toggle();
  std::optional<Value> value_;
  QString note_;
};

/// A line of text.
class TextField : public Field {
 public:
  explicit TextField(QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  void set_default(const std::optional<Value>& value) override;
  void set_mixed(bool on) override;
  void set_source(const QString& note) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] QLineEdit* line() const { return line_; }
  void set_secret(bool on);
  QSize sizeHint() const override;

 protected:
  void take_theme() override;
  virtual void take_text(const QString& text);
  void show_placeholder();
  std::optional<Value> value_;
  QLineEdit* line_;
};

/// A file or folder: typed, or chosen in a window that does not block others.
class PathField : public TextField {
 public:
  enum class For { open, save, folder };
  PathField(For purpose, std::vector<std::string> patterns, QWidget* parent = nullptr);

 private:
  void browse();
  For for_;
  std::vector<std::string> patterns_;
  QToolButton* button_;
};

/// A value written as Lua: `{1, 2}`, `"text"`, `true`. For types that have no other field.
class LiteralField : public TextField {
 public:
  explicit LiteralField(QWidget* parent = nullptr);
  void set_value(const std::optional<Value>& value) override;

 protected:
  void take_text(const QString& text) override;
};

/// Several lines of text, such as a script. Ctrl+Enter is left to the form.
class ScriptField : public Field {
 public:
  explicit ScriptField(QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  [[nodiscard]] bool is_tall() const override { return true; }
  [[nodiscard]] QPlainTextEdit* editor() const { return edit_; }
  QSize sizeHint() const override;

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  std::optional<Value> value_;
  QPlainTextEdit* edit_;
  bool is_setting_ = false;
};

/// A colour as commands take it: "#rrggbb", "#rrggbbaa", a name, or three or four numbers 0..1.
[[nodiscard]] std::optional<QColor> colour_of(const Value& value);

/// A colour: `#rrggbb` or `#rrggbbaa` typed, or chosen by hue, saturation and value. Dragging in
/// the chooser is a drag of the field.
class ColourField : public Field {
 public:
  explicit ColourField(QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  void set_default(const std::optional<Value>& value) override;
  /// Of the value or the default; invalid if there is none.
  [[nodiscard]] QColor colour() const;
  void open_chooser();
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  void choose(const QColor& colour, Stage stage);
  void show_value();
  [[nodiscard]] QRect swatch() const;
  std::optional<Value> value_;
  QLineEdit* line_;
  bool is_setting_ = false;
};

}  // namespace robomosp::viewer
