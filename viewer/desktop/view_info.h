// SPDX-License-Identifier: GPL-3.0-or-later
// ViewInfo: text over the picture of a view: time, speed, place and orientation of the tool while a
// recording moves it, else place and orientation of what is selected (layer: GUI).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

#include "viewer/desktop/desk.h"

namespace robomosp::viewer {

/// Angles A, B, C about z, y, x [rad] in degrees; aligned, they are as wide for every value, so
/// that decimals do not jump.
[[nodiscard]] QString angles_text(const Vec3& abc, bool is_aligned);

/// [GUI thread]
class ViewInfo : public QWidget {
 public:
  ViewInfo(Desk& desk, QWidget* parent);

  /// Reads the recording by commands, and shows its tool from now on.
  void show_recording(const Handle& recording);
  void set_time(double time);  ///< [s]
  /// Where the selection is in the world, shown without a recording; none = nothing is.
  struct Placed {
    QString name;
    Pose world_T_own;
    bool has_angles = true;
  };
  void show_placed(const std::optional<Placed>& placed);
  /// Shows no recording.
  void clear();
  /// The lines that are shown.
  [[nodiscard]] const QStringList& lines() const { return lines_; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void take(const List& columns);
  void refresh();
  /// The row at or before the present time, and how far the next one is, 0..1.
  [[nodiscard]] std::pair<std::size_t, double> row() const;
  [[nodiscard]] std::optional<double> at(const std::string& column) const;

  Desk& desk_;
  std::optional<Handle> recording_;
  std::uint64_t version_ = 0;  ///< counts up with each recording
  std::optional<Placed> placed_;
  QString title_, shown_title_;
  std::vector<std::string> columns_;
  std::size_t rows_ = 0;
  std::vector<double> values_;  ///< row after row, in the order of columns_
  double time_ = 0;
  QStringList lines_;
};

}  // namespace robomosp::viewer
