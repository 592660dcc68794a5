// SPDX-License-Identifier: GPL-3.0-or-later
// ViewerWindow: main window with the 3-D display, a list of objects and a timeline (layer: GUI).
// A larger program derives from it or adds docks to it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <QElapsedTimer>
#include <QMainWindow>
#include <QTimer>

#include "viewer/frame.h"
#include "viewer/window/display.h"

class QAction;
class QActionGroup;
class QComboBox;
class QLabel;
class QMenu;
class QSlider;
class QTreeWidget;

namespace robomosp::viewer {

class ViewerWindow : public QMainWindow {
 public:
  /// Takes ownership of a display made by `Display::create`.
  explicit ViewerWindow(std::unique_ptr<Display> display);
  ~ViewerWindow() override;

  void set_frame(const Frame& frame);
  /// Replaces only what is drawn, as a live scene changes: look, camera and selection stay.
  /// `only_moved` = the same items in other poses.
  void update_scene(const render::Scene& scene, bool only_moved);
  /// An unusable playback is rejected with a message in the status bar.
  void set_playback(const Playback& playback);
  /// Enables the menu entries of the layers "velocity_ellipsoids" and "force_ellipsoids", which
  /// `show` turns on or off; the scene with them comes by update_scene(). Null disables them.
  void set_layers(std::function<void(const std::string& layer, bool is_shown)> show);
  void check_layer(const std::string& layer);  ///< as the user does in the menu
  void set_time(double time);                  ///< [s], clamped to the range of the playback
  void play(bool on);
  void set_speed(double speed);  ///< playback seconds per second

  [[nodiscard]] double time() const { return time_; }  ///< [s]
  [[nodiscard]] bool is_playing() const { return ticker_.isActive(); }
  [[nodiscard]] Display& display() const { return *display_; }
  /// Name of the selected item, empty if there is none.
  [[nodiscard]] QString selected_name() const;

  std::function<void(std::optional<Pick>)> on_pick;  ///< after each click in the picture
  /// After each change of the time [s], for a scene that moves by update_scene().
  std::function<void(double time)> on_time;

 private:
  void make_actions();
  void make_objects_dock();
  void make_timeline();
  void make_view_actions(QMenu* menu, QToolBar* bar);
  QAction* add_toggle(QMenu* menu, const QString& name, const QString& text, bool Frame::*flag);
  void make_style_menu(QMenu* menu);
  void make_section_menu(QMenu* menu);
  void make_ellipsoid_actions(QMenu* menu);
  void show_frame();
  void list_objects();
  /// Checks the menu entries that match the frame.
  void show_style_and_section();
  /// Cuts with the plane selected by the checked actions of the section menu.
  void choose_section();
  void move_section(double share);
  void show_pick(const std::optional<Pick>& hit);
  void show_time();
  void tick();
  void save_picture();

  Display* display_;  // owned by the window as its central widget
  Frame frame_;
  std::shared_ptr<const Playback> playback_;
  double time_ = 0, speed_ = 1;
  QTimer ticker_;
  QElapsedTimer clock_;
  QTreeWidget* objects_ = nullptr;
  QSlider* slider_ = nullptr;
  QLabel* readout_ = nullptr;
  QLabel* renderer_ = nullptr;
  QComboBox* speeds_ = nullptr;
  QAction* play_ = nullptr;
  QAction* loop_ = nullptr;
  QAction* to_start_ = nullptr;
  QAction* perspective_ = nullptr;
  QActionGroup* styles_ = nullptr;
  QActionGroup* sections_ = nullptr;
  QAction* turn_section_ = nullptr;
  QAction* hidden_edges_ = nullptr;
  QAction* velocity_ellipsoid_ = nullptr;
  QAction* force_ellipsoid_ = nullptr;
  std::function<void(const std::string& layer, bool is_shown)> show_layer_;
  bool is_style_chosen_ = false, is_section_chosen_ = false;  ///< in this window's menus
  double section_share_ = 0.5;  ///< position of the plane along the box of all items, as a fraction
  QToolBar* bar_ = nullptr;
};

}  // namespace robomosp::viewer
