// SPDX-License-Identifier: GPL-3.0-or-later
// ViewTools: what the mouse and keys do in the picture of a view besides turning it: a gizmo at the
// selection, inverse kinematics at tools, control points, snapping, boxes of selection
// (layer: GUI). Every edit is a command; a drag is one gesture.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <QColor>
#include <QEvent>
#include <QObject>
#include <QPointF>
#include <QPointer>
#include <QRectF>
#include <QString>

#include "scene/movable.h"
#include "viewer/desktop/desk.h"
#include "viewer/gizmo/gizmo.h"
#include "viewer/gizmo/hover.h"
#include "viewer/gizmo/snapping.h"
#include "viewer/gizmo/tool_settings.h"
#include "viewer/window/display.h"

class QKeyEvent;
class QMouseEvent;
class QPainter;

namespace robomosp::viewer {

class Measuring;
class RunPull;

/// [GUI thread]
class ViewTools : public QObject {
 public:
  /// `has_motion`: whether a recording or run moves the picture; `is_playing`: whether it plays.
  /// Display and desk outlive it.
  ViewTools(Desk& desk, Display& display, std::function<bool()> has_motion,
            std::function<bool()> is_playing);
  ~ViewTools() override;

  /// The picture shown and the items highlighted in it.
  void set_picture(const ioci::LiveView::PicturePtr& picture, const viewer::Frame& frame);
  /// The live run that moves the picture: its bodies can be pulled; none = no run does.
  void set_run(const std::optional<Handle>& run);
  void set_highlighted(const std::vector<std::uint64_t>& items);
  /// Members that the view does not draw, named at the edge of the picture.
  void set_hidden(const std::set<std::string>& members);
  /// Whether lights of a world have symbols.
  void show_lights(bool on);
  /// Looks again at selection, settings and playback.
  void refresh();

  /// Begins moving or turning the selection with the mouse, as the keys G and R do.
  void begin_by_key(GizmoMode mode);
  /// Ends a drag and takes it back.
  void cancel();

  /// The camera of the active view, in pixels of the display.
  [[nodiscard]] ScreenCamera screen() const;
  [[nodiscard]] const Gizmo& gizmo() const { return gizmo_; }
  [[nodiscard]] bool is_dragging() const { return drag_.has_value(); }
  /// True while edits of a drag wait for their end.
  [[nodiscard]] bool is_busy() const { return drag_ || is_solving_ || ends_open_ > 0; }
  /// What the gizmo is at and where the picture has it; none if it is at nothing, or at several.
  struct Placed {
    QString name;
    Pose world_T_own;
    bool is_point = false;  ///< without an orientation
  };
  [[nodiscard]] std::optional<Placed> placed() const;
  /// What the drag has done so far: "X 50.0 mm".
  [[nodiscard]] QString readout() const;
  /// Why the selection cannot be moved, or the last edit was refused; "" = it can.
  [[nodiscard]] const QString& hint() const { return hint_; }
  /// What the edge of the picture says about hidden members; "" = none is hidden.
  [[nodiscard]] const QString& hidden_text() const { return hidden_; }
  [[nodiscard]] const std::optional<SnapTarget>& snapped() const { return snapped_; }
  /// Places of the marks that a click takes hold of: control points, tools [px].
  struct Mark {
    QPointF at;
    QString name;
    std::string path;  ///< of the control point; "" = the tool of `member`
    std::string member{};
    bool is_current = false;
  };
  [[nodiscard]] const std::vector<Mark>& handles() const { return handles_; }
  /// The symbol of a light of the world in one of the views.
  struct LightMark {
    QPointF at;                      ///< [px]
    std::optional<QPointF> ahead{};  ///< where a sun or spot shines [px]
    QColor colour;
    std::string path;  ///< "lights.lamp"
    QString name;
    scene::MemberPtr member;
    QRectF view;  ///< that it is in [px]
    bool is_sun = false, is_selected = false;
  };
  [[nodiscard]] const std::vector<LightMark>& lights() const { return lights_; }
  void paint(QPainter& painter);

  /// Called with the rectangle of a box of selection [px]; `is_touching`: items that it touches,
  /// else those inside it.
  std::function<void(QRectF box, bool is_touching, Qt::KeyboardModifiers keys)> on_box;
  std::function<void()> on_refreshed;  ///< after what is selected, or where it is, may be another
  std::function<void()> on_show_all;   ///< by Alt+H in the picture
  [[nodiscard]] Measuring& measuring() const { return *measuring_; }
  [[nodiscard]] RunPull& pull() const { return *pull_; }
  [[nodiscard]] Hover& hover() const { return *hover_; }
  /// What a click at a place of the picture would select; set by the view.
  std::function<Hovered(QPointF at)> find_hovered;

  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  class Overlay;
  struct Target {
    scene::Movable movable;
    Pose start;
  };
  struct Drag {
    GizmoMotion motion;
    QPointF from, at;
    std::optional<Vec3> grip_point;
    double last_angle = 0, swept = 0;
    bool is_by_key = false, is_begun = false;
    bool is_ending = false;  ///< released; the solver still looks for the last pose
    std::string label;
    QString typed;
    Qt::KeyboardModifiers keys{};
    std::vector<Target> targets;
    std::map<std::string, Value> sent;  ///< by record and path
  };

  void find_targets();
  void place_gizmo();
  void place_handles();
  void place_lights();
  [[nodiscard]] const LightMark* light_at(QPointF at) const;
  [[nodiscard]] Hovered hovered_at(QPointF at) const;
  void begin(Grip grip, QPointF at, bool is_by_key);
  void drag_to(QPointF at, Qt::KeyboardModifiers keys);
  void set_grip(Grip grip);
  void apply();
  void snap(const ScreenCamera& camera);
  [[nodiscard]] std::optional<double> typed_value() const;
  void send();
  void solve();
  void end(bool keep);
  void end_solved();
  void close_gesture(bool keep);
  [[nodiscard]] bool mouse(QMouseEvent& event, QEvent::Type type);
  [[nodiscard]] bool key(QKeyEvent& event, bool is_override);
  [[nodiscard]] bool take_handle(QPointF at);
  [[nodiscard]] bool take_light(QPointF at);
  void redraw();
  /// Gives the overlay the text of what is dragged or pulled, as its accessible description.
  void describe();
  void paint_lights(QPainter& painter) const;
  void paint_readout(QPainter& painter, const ScreenCamera& camera) const;

  Desk& desk_;
  Display& display_;
  std::function<bool()> has_motion_, is_playing_;
  Overlay* overlay_ = nullptr;
  ioci::LiveView::PicturePtr picture_;
  const viewer::Frame* frame_ = nullptr;
  std::vector<std::uint64_t> highlighted_;
  std::vector<Target> targets_;
  std::optional<scene::ElementRef> seen_;
  Selection seen_for_;
  std::string tool_of_;  ///< robot with the tool that a click took hold of
  Gizmo gizmo_;
  std::vector<Mark> handles_;
  std::vector<LightMark> lights_;
  std::set<std::string> hidden_members_;
  bool has_lights_ = true;
  int hovered_handle_ = -1;
  std::optional<Drag> drag_;
  ioci::Client::Edits gesture_;
  std::optional<Pose> wanted_tool_;  ///< that is not solved for yet
  bool is_solving_ = false;
  std::vector<double> q_;  ///< last joint values found
  int ends_open_ = 0;
  QString hint_, refusal_, hidden_;
  std::optional<SnapTarget> snapped_;
  Snapper snapper_;
  std::unique_ptr<Hover> hover_;
  std::unique_ptr<Measuring> measuring_;
  std::unique_ptr<RunPull> pull_;
  QPointF mouse_at_;
  std::optional<QRectF> box_;
  QPointF box_from_;
  bool awaits_box_ = false;
};

/// Draws a text on the ground of labels; its rectangle.
QRectF paint_label(QPainter& painter, QPointF at, const QString& text, const QColor& ground,
                   const QColor& colour);
/// Numbers with the minus of texts: "-1.5" becomes U+2212 "1.5".
[[nodiscard]] QString shown_number(double value, int digits);

}  // namespace robomosp::viewer
