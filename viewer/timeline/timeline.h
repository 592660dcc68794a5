// SPDX-License-Identifier: GPL-3.0-or-later
// Timeline: the panel of the recording or live run that the current view shows: transport, ruler,
// bands, and plots under one cursor (layer: GUI).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QPointer>
#include <QTimer>
#include <QWidget>

#include "viewer/desktop/desk.h"
#include "viewer/desktop/player.h"
#include "viewer/plots/plot_lanes.h"
#include "viewer/plots/time_axis.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/bands_view.h"
#include "viewer/timeline/recording_data.h"
#include "viewer/timeline/run_driver.h"
#include "viewer/timeline/time_ruler.h"

class QComboBox;
class QLabel;
class QMenu;
class QPushButton;
class QScrollArea;
class QToolButton;

namespace robomosp::viewer {

class Actions;
class Settings;
class VariablePicker;

/// [GUI thread]
class Timeline : public QWidget {
 public:
  Timeline(Desk& desk, Settings& settings, const Actions& actions, QWidget* parent = nullptr);
  ~Timeline() override;

  /// Follows another player; null = of no view.
  void set_player(Player* player);
  /// What the view shows, and the recording or live run that moves it.
  void set_subject(const Handle& what, const std::optional<Handle>& recording,
                   const std::optional<Handle>& run);

  [[nodiscard]] TimeRuler& ruler() const { return *ruler_; }
  [[nodiscard]] TimeAxis& axis() { return axis_; }
  [[nodiscard]] PlotLanes& lanes() const { return *lanes_; }
  [[nodiscard]] BandsView& bands() const { return *bands_; }
  /// Null without a recording or run.
  [[nodiscard]] RecordingData* data() const { return data_.get(); }
  [[nodiscard]] VariablePicker& picker() const { return *picker_; }
  [[nodiscard]] bool is_settled() const;

  /// Plots columns in a new lane, or in the present one.
  void add_columns(const std::vector<std::string>& columns, bool into_present_lane);
  void remove_lane(int lane);
  void move_lane(int lane, int by);
  /// One lane for each column of a lane, and back.
  void split_lane(int lane);
  /// Draws another recording over this one, or no longer.
  void compare(const Handle& recording, bool on);
  [[nodiscard]] std::size_t compared_count() const { return compared_.size(); }
  /// Makes the recording again from the present records, as a job.
  void refresh_recording();
  /// Makes it again with each edit, also while a value is dragged.
  void set_following(bool on);
  [[nodiscard]] bool is_following() const { return is_following_; }
  /// Writes what is shown: *.csv, *.svg, *.png or *.pdf.
  void write_file(const QString& file);

  /// Shows another recording in the view.
  std::function<void(const Handle&)> on_open;
  std::function<void()> on_film;  ///< the user wants a film of what moves the view

 protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  bool eventFilter(QObject* watched, QEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;

 private:
  using LaneSpecs = std::vector<std::vector<std::string>>;
  void make_header(const Actions& actions);
  void make_notice();
  void show_state();
  void show_time();
  void show_notice();
  void fit_header();
  void place();
  void apply_theme();
  void follow_data();
  void take(const ioci::Event& event);
  void pick(const Band& band, const BandSpan* span);
  void fill_recordings();
  void fill_compare_menu(QMenu& menu);
  void fill_more_menu(QMenu& menu);
  void open_lane_menu(int lane, QPoint global);
  void show_selected();
  void refresh_if_following();
  void end_refresh();
  void drive(const std::optional<Handle>& run);
  // lanes (timeline_lanes.cpp)
  [[nodiscard]] LaneSpecs default_lanes() const;
  [[nodiscard]] QString lanes_key() const;
  void load_specs();
  void keep_specs();
  void want_columns();
  void show_lanes();
  void watch_expression(const QString& expression, QString name, const QString& unit);

  Desk& desk_;
  Settings& settings_;
  TimeAxis axis_;
  QPointer<Player> player_;
  TimeRuler* ruler_;
  BandsView* bands_;
  PlotLanes* lanes_;
  TimeCursor* cursor_ = nullptr;
  QWidget *header_ = nullptr, *notice_ = nullptr, *body_ = nullptr;
  QScrollArea* scroll_ = nullptr;
  QLabel *readout_, *notice_text_ = nullptr;
  QPushButton* refresh_ = nullptr;
  QComboBox *speeds_, *recordings_;
  QToolButton *stop_ = nullptr, *compare_ = nullptr, *variable_ = nullptr, *more_ = nullptr;
  VariablePicker* picker_;
  Handle what_;
  std::unique_ptr<RecordingData> data_;
  std::vector<std::unique_ptr<RecordingData>> compared_;
  std::unique_ptr<RunDriver> driver_;
  LaneSpecs specs_;
  bool has_specs_ = false;    ///< of this recording's kind
  bool is_starting_ = false;  ///< a driver: its player reports that here
  bool is_following_ = false, is_refreshing_ = false, is_refresh_wanted_ = false;
  QTimer lanes_timer_, recordings_timer_;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
