// SPDX-License-Identifier: GPL-3.0-or-later
// BandsView: the bands of a recording below the ruler: segments, limits, faults, grips, signals
// (layer: GUI). It draws what recording.bands lists.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

#include "viewer/plots/time_axis.h"
#include "viewer/timeline/recording_data.h"

namespace robomosp::viewer {

/// A click chooses a span; Up, Down, Left and Right move over the spans, Enter chooses. [GUI
/// thread]
class BandsView : public QWidget {
 public:
  explicit BandsView(TimeAxis& axis, QWidget* parent = nullptr);

  void show_bands(std::vector<Band> bands);
  [[nodiscard]] const std::vector<Band>& bands() const { return bands_; }
  void set_cursor(std::optional<double> time);
  void set_dimmed(bool on);
  /// Marks the spans of a record's part.
  void set_selected(const std::optional<Handle>& record, const std::string& path);
  /// Where a span is drawn; empty if it is outside the shown range.
  [[nodiscard]] QRect span_rect(std::size_t band, std::size_t span) const;
  [[nodiscard]] QRect band_rect(std::size_t band) const;
  /// The sentence of what is at a point: a span, why a band is unknown, a signal's value.
  [[nodiscard]] QString text_at(QPoint at) const;
  [[nodiscard]] QSize sizeHint() const override;
  [[nodiscard]] QSize minimumSizeHint() const override { return sizeHint(); }

  /// Null span = the band itself, such as one that is unknown.
  std::function<void(const Band& band, const BandSpan* span)> on_pick;
  std::function<void(double time)> on_scrub;

 protected:
  bool event(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void focusInEvent(QFocusEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  struct Place {
    std::size_t band = 0;
    std::optional<std::size_t> span{};
  };
  [[nodiscard]] std::optional<Place> place_at(QPoint at) const;
  [[nodiscard]] int height_of(const Band& band) const;
  [[nodiscard]] QString value_of(const Band& signal, double time) const;
  [[nodiscard]] QString sentence_of(const Place& place) const;
  void paint_spans(QPainter& p, std::size_t band, const QRect& area) const;
  void paint_signal(QPainter& p, const Band& band, const QRect& area) const;
  void pick(const Place& place);

  TimeAxis& axis_;
  std::vector<Band> bands_;
  std::optional<double> cursor_;
  std::optional<Handle> selected_;
  std::string selected_path_;
  Place current_;
  bool is_dimmed_ = false;
};

}  // namespace robomosp::viewer
