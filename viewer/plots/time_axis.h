// SPDX-License-Identifier: GPL-3.0-or-later
// TimeAxis: the range of time that ruler, bands and plots show together, and where it lies in them
// (layer: GUI).
#pragma once

#include <QObject>

#include "viewer/desktop/listeners.h"

namespace robomosp::viewer {

/// [GUI thread]
class TimeAxis : public QObject {
 public:
  explicit TimeAxis(QObject* parent = nullptr) : QObject(parent) {}

  /// The whole range [s]. The shown one stays if it lies in it and was zoomed, else it is all.
  void set_range(double from, double to);
  void show(double low, double high);  ///< clamped to the whole range
  void fit() { show(from_, to_); }
  /// factor < 1 shows less; `about` stays where it is.
  void zoom(double factor, double about);
  void pan(double by);  ///< [s]
  /// Where the range lies: margins and width of the widgets [px].
  void set_place(double left, double width, double right);

  [[nodiscard]] double from() const { return from_; }
  [[nodiscard]] double to() const { return to_; }
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }
  [[nodiscard]] bool is_empty() const { return !(to_ > from_); }
  [[nodiscard]] bool is_zoomed() const { return low_ > from_ || high_ < to_; }
  [[nodiscard]] double left() const { return left_; }
  [[nodiscard]] double right() const { return right_; }  ///< margin
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] double x_of(double time) const;
  [[nodiscard]] double time_at(double x) const;  ///< clamped to the whole range
  /// A distance between ticks of 1, 2 or 5 times a power of ten, at least `px` apart [s].
  [[nodiscard]] double tick(double px) const;

  Listeners<> changed;

 private:
  double from_ = 0, to_ = 0, low_ = 0, high_ = 0;
  double left_ = 0, length_ = 1, right_ = 0;
};

}  // namespace robomosp::viewer
