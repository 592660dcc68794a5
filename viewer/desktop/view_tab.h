// SPDX-License-Identifier: GPL-3.0-or-later
// ViewTab: the picture of a world, robot, object or solid in a tab of the window; it follows the
// document and the time of a recording (layer: GUI).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <QRectF>
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
class HiddenMembers;
struct Hovered;
class ViewInfo;
class ViewTools;

/// How a view is drawn, as the menus and the bar of the view set it.
struct ViewLook {
  Style style = Style::smooth;
  bool has_edges = true, has_hidden_edges = false, has_grid = true, has_axes = true;
  bool has_lights = true;  ///< symbols of the lights of a world
  bool is_perspective = true, is_refined_at_rest = true;
  int section_axis = -1;  ///< 0 x, 1 y, 2 z; -1 = no section
  bool is_section_turned = false;
  double section_share = 0.5;         ///< position along the box of all items, 0..1
  std::vector<std::string> layers{};  ///< that are shown, see scene::layer_names()
  Camera::View view = Camera::View::isometric;
  bool has_four_views = false;  ///< instead of one
  StereoSettings stereo{};
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
  [[nodiscard]] const std::optional<Handle>& run() const { return run_; }
  [[nodiscard]] const QString& name() const { return name_; }
  /// What the display shows; null before the first picture.
  [[nodiscard]] const ioci::LiveView::PicturePtr& picture() const { return picture_; }
  void set_name(const QString& name) { name_ = name; }
  [[nodiscard]] Display& display() const { return *display_; }
  [[nodiscard]] ViewInfo& info() const { return *info_; }
  [[nodiscard]] ioci::LiveView& live() const { return *live_; }
  [[nodiscard]] Player& player() { return player_; }
  [[nodiscard]] ViewTools& tools() const { return *tools_; }
  /// What the display shows: the scene without what is hidden, and its look.
  [[nodiscard]] const viewer::Frame& drawn() const { return frame_; }
  /// Members that this view does not draw.
  [[nodiscard]] const HiddenMembers& hidden() const { return *hidden_; }
  void hide_selection();
  /// Hides all members but the selected ones.
  void isolate_selection();
  void show_all();
  /// Whether a path such as "objects.table" is a member that this view draws or hides.
  [[nodiscard]] bool has_member(const std::string& path) const { return members_.contains(path); }
  void show_member(const std::string& path, bool on);
  /// Draws what is given with a share of its opacity, above 0 to 1; 1 = as the records have it.
  /// False if the view draws none of it.
  bool fade(const Selection& what, double opacity);
  void fade_selection(double opacity);
  /// The share of its opacity that a member or part is drawn with.
  [[nodiscard]] double opacity_of(const Selected& what) const;
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
  /// Frame of the only selected member in the world; nothing = none.
  [[nodiscard]] std::optional<Pose> selected_pose() const;
  /// Place and orientation of the only selected member: "x 1 y 2 z 3 mm ..."; "" = none.
  [[nodiscard]] QString selection_pose() const;
  /// Whether the record still exists in the document.
  [[nodiscard]] bool is_there() const { return is_there_; }

  Listeners<> changed;  ///< name, look, or whether it exists

 protected:
  void changeEvent(QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  ViewTab(Desk& desk, const Actions& actions, std::unique_ptr<Display> display);
  void make_bar(const Actions& actions);
  /// What moves the members from now on; none of both = the document. Times of a recording [s].
  void move_by(const std::optional<Handle>& recording, const std::optional<Handle>& run,
               double from = 0, double to = 0);
  void apply_look();
  void take(const ioci::LiveView::PicturePtr& picture);
  void show_selection();
  void show_placed();
  void picked(const std::optional<Pick>& hit);
  void boxed(QRectF box, bool is_touching, Qt::KeyboardModifiers keys);
  void hidden_changed(const std::string& line);
  void apply_fading();
  [[nodiscard]] std::vector<std::uint64_t> items_of(const Selection& what) const;
  [[nodiscard]] Hovered hovered_at(QPointF at) const;
  void apply_theme();
  void place_info();
  void fit_bar();

  Desk& desk_;
  std::unique_ptr<ioci::LiveView> live_;
  QToolBar* bar_ = nullptr;
  Display* display_ = nullptr;
  std::unique_ptr<ViewTools> tools_;
  std::unique_ptr<HiddenMembers> hidden_;
  struct Faded {
    Selected what;
    double opacity = 1;
  };
  std::vector<Faded> faded_;
  std::map<std::uint64_t, double> shares_;  ///< opacity of the items of faded_
  bool has_new_fading_ = false;
  std::set<std::uint64_t> hidden_items_;
  std::set<std::string> members_;  ///< paths of all members of the world shown
  QLabel* note_ = nullptr;
  ViewInfo* info_ = nullptr;
  Player player_;
  Handle what_;
  std::optional<Handle> recording_, run_;
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
