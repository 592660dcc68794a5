// SPDX-License-Identifier: GPL-3.0-or-later
// ViewTab: the picture of a world, robot, object or solid in a tab of the window; it follows the
// document and the time of a recording (layer: GUI).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <QWidget>

#include "ioci/client/live_view.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/player.h"
#include "viewer/theme/theme.h"
#include "viewer/window/display.h"

class QLabel;
class QToolBar;

namespace robomosp::viewer {

class Actions;

/// How a view is drawn, as the menus and the bar of the view set it.
struct ViewLook {
  Style style = Style::smooth;
  bool has_edges = true, has_hidden_edges = false, has_grid = true, has_axes = true;
  bool is_perspective = true, is_refined_at_rest = true;
  int section_axis = -1;  ///< 0 x, 1 y, 2 z; -1 = no section
  bool is_section_turned = false;
  double section_share = 0.5;         ///< position along the box of all items, 0..1
  std::vector<std::string> layers{};  ///< that are shown, see scene::layer_names()
  Camera::View view = Camera::View::isometric;
  bool operator==(const ViewLook&) const = default;
};

/// [GUI thread]
class ViewTab : public QWidget {
 public:
  /// Fails if the system can draw no picture.
  static Result<std::unique_ptr<ViewTab>> create(Desk& desk, const Actions& actions,
                                                 bool software_view);
  ~ViewTab() override;

  /// Shows a record instead of the present one.
  void show_record(const Handle& what, const QString& name);
  /// Moves the members of the world by a recording over these times [s].
  void show_recording(const Handle& recording, double from, double to);
  /// Moves them by a live run from now on.
  void show_run(const Handle& run);
  /// Moves them back to where the document has them.
  void rest();

  [[nodiscard]] const Handle& what() const { return what_; }
  [[nodiscard]] const std::optional<Handle>& recording() const { return recording_; }
  [[nodiscard]] const QString& name() const { return name_; }
  void set_name(const QString& name) { name_ = name; }
  [[nodiscard]] Display& display() const { return *display_; }
  [[nodiscard]] ioci::LiveView& live() const { return *live_; }
  [[nodiscard]] Player& player() { return player_; }
  [[nodiscard]] const ViewLook& look() const { return look_; }
  void set_look(const ViewLook& look);
  void view_from(Camera::View view);
  void fit();
  /// The camera of the first picture: a custom one, or the zoom of a named view.
  void start_from(const Camera& camera);
  /// Turns and moves the camera to the selected items, or to all if none is selected.
  void fly_to_selection();
  /// True if the newest picture is exact and on the screen.
  [[nodiscard]] bool is_settled() const;
  /// Arguments of <kind>.render for what is shown now.
  [[nodiscard]] Map render_arguments() const;
  /// Place and orientation of the only selected member: "x 1 y 2 z 3 mm ..."; "" = none.
  [[nodiscard]] QString selection_pose() const;
  /// Whether the record still exists in the document.
  [[nodiscard]] bool is_there() const { return is_there_; }

  Listeners<> changed;  ///< name, look, or whether it exists

 protected:
  void changeEvent(QEvent* event) override;

 private:
  ViewTab(Desk& desk, const Actions& actions, std::unique_ptr<Display> display);
  void make_bar(const Actions& actions);
  void apply_look();
  void take(const ioci::LiveView::PicturePtr& picture);
  void show_selection();
  void picked(const std::optional<Pick>& hit);
  [[nodiscard]] std::vector<std::uint64_t> selected_items() const;
  void apply_theme();

  Desk& desk_;
  std::unique_ptr<ioci::LiveView> live_;
  QToolBar* bar_ = nullptr;
  Display* display_ = nullptr;
  QLabel* note_ = nullptr;
  Player player_;
  Handle what_;
  std::optional<Handle> recording_;
  QString name_;
  ViewLook look_;
  std::optional<Camera> first_camera_;
  viewer::Frame frame_;
  ioci::LiveView::PicturePtr picture_;
  std::vector<std::uint64_t> highlighted_;
  bool is_there_ = true, is_first_ = true, is_fitted_ = false;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
