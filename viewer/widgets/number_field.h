// SPDX-License-Identifier: GPL-3.0-or-later
// NumberField: a number with its unit, dragged, stepped or typed (layer: GUI).
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>

#include <QStringList>

#include "kernel/units.h"
#include "viewer/widgets/field.h"

class QCompleter;
class QLineEdit;

namespace robomosp::viewer {

/// What a NumberField takes and how it shows it.
struct NumberFormat {
  std::string unit{};   ///< SI; "" = dimensionless
  std::string shown{};  ///< unit in which it is shown; "" = `unit`
  double min = -std::numeric_limits<double>::infinity();  ///< SI
  double max = std::numeric_limits<double>::infinity();   ///< SI
  double step = 0;                       ///< sensible change [SI]; 0 = from the value
  bool is_whole = false;                 ///< integers only
  bool is_logarithmic = false;           ///< dragging multiplies
  bool takes_infinity = false;           ///< `inf` may be typed
  bool takes_expressions = false;        ///< texts such as "bore/2" are values
  std::function<QStringList()> names{};  ///< that are offered while an expression is typed
};

/// Dragging sideways changes the value; Shift makes it ten times finer, Ctrl snaps to round
/// values, Escape returns. A click, Enter, F2 or a digit starts typing; a number without a unit is
/// in the shown unit, and expressions without names are computed. Up, Down, Page Up and Page Down
/// step; Delete takes the default.
class NumberField : public Field {
 public:
  explicit NumberField(NumberFormat format, QWidget* parent = nullptr);

  [[nodiscard]] std::optional<Value> value() const override { return value_; }
  void set_value(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void set_mixed(bool on) override;

  /// The number that an expression gives now [SI]; it is shown behind it.
  void set_computed(std::optional<double> si);
  /// Text in front of the number: "x", "A".
  void set_prefix(const QString& prefix, int axis = -1);
  /// Range over which the fill is drawn [SI]; by default that of the format.
  void set_fill_range(double from, double to);
  /// Where it is false, the owner shows the unit.
  void set_shows_unit(bool on);
  /// The least width in which a number of seven digits and the unit have space.
  [[nodiscard]] int width_with_unit() const;
  /// False: Delete and an empty text are ignored.
  void set_may_be_empty(bool on) { may_be_empty_ = on; }

  /// The number [SI], given or by default; nothing for expressions that were not computed.
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] const NumberFormat& format() const { return format_; }
  /// As it is drawn, with unit: "200 mm/s", "bore/2 = 21 mm".
  [[nodiscard]] QString shown_text() const;
  [[nodiscard]] bool is_editing() const { return edit_ != nullptr; }
  void begin_edit(const QString& typed = {});

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  bool event(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void contextMenuEvent(QContextMenuEvent* event) override;

 private:
  /// Whether a key does something in the field while it shows its value.
  [[nodiscard]] bool uses(const QKeyEvent& key) const;
  /// What a typed text means.
  struct Reading {
    std::optional<Value> value;    ///< nothing = empty
    std::optional<double> number;  ///< SI; nothing for expressions with names
    QString fault;                 ///< why it is rejected
  };
  [[nodiscard]] Reading read(const QString& text) const;
  [[nodiscard]] const std::optional<Value>& effective() const;
  [[nodiscard]] bool is_expression() const;
  [[nodiscard]] double to_shown(double si) const;
  [[nodiscard]] double from_shown(double shown) const;
  [[nodiscard]] double step_size() const;  ///< in the shown unit
  [[nodiscard]] QString edit_text() const;
  [[nodiscard]] double clamped(double si) const;
  void set_number(double si, Stage stage);
  void step_by(double steps);
  void end_edit(bool keep);
  void place_edit();
  void offer_names();
  void take_name(const QString& name);
  void show_value();
  void copy() const;
  void take_default();

  NumberFormat format_;
  units::Unit shown_unit_{};
  std::optional<Value> value_;
  std::optional<double> computed_;
  QString prefix_, note_;
  int axis_ = -1;
  double fill_from_ = 0, fill_to_ = 0;
  bool may_be_empty_ = true, shows_unit_ = true;
  QLineEdit* edit_ = nullptr;
  QCompleter* completer_ = nullptr;  ///< of names, while one is typed
  bool is_ending_ = false;
  // A drag.
  bool is_pressed_ = false, is_dragged_ = false;
  QPoint press_;
  double drag_start_ = 0, drag_step_ = 1;  ///< in the shown unit
  double drag_px_ = 0;
  int last_x_ = 0;
  int decimals_ = -1;  ///< while dragged
  std::optional<Value> before_drag_;
};

}  // namespace robomosp::viewer
