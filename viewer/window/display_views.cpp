// SPDX-License-Identifier: GPL-3.0-or-later
// Several views of the scene in one display: four beside each other, or one for each eye.
#include <algorithm>
#include <array>
#include <cmath>

#include <QLabel>

#include "viewer/theme/theme.h"
#include "viewer/window/display.h"
#include "viewer/window/display_surface.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kPanes = 4, kPerspectivePane = 1;

struct PaneKind {
  const char *name, *title;
  Camera::View view;
};
/// From the upper left to the lower right.
constexpr std::array<PaneKind, kPanes> kPaneKinds{
    {{"top", "Top", Camera::View::top},
     {"perspective", "Perspective", Camera::View::custom},
     {"front", "Front", Camera::View::front},
     {"right", "Right", Camera::View::right}}};

}  // namespace

/// Names of the four views, lines between them and a frame around the active one.
class Display::PaneMarks : public QObject {
 public:
  explicit PaneMarks(QWidget* parent) : QObject(parent) {
    for (std::size_t i = 0; i < kPanes; ++i) {
      titles_[i] = add(parent, QString("pane_") + kPaneKinds[i].name,
                       QString("View ") + kPaneKinds[i].title);
      titles_[i]->setText(kPaneKinds[i].title);
    }
    for (std::size_t i = 0; i < lines_.size(); ++i)
      lines_[i] = add(parent, QString("pane_line_%1").arg(i),
                      i < 2 ? "Line between views" : "Frame of the active view");
  }
  ~PaneMarks() override {
    for (QLabel* each : titles_) delete each;
    for (QLabel* each : lines_) delete each;
  }
  void place(const std::array<QRectF, kPanes>& panes, std::size_t active) {
    const Theme& t = theme();
    const int inset = t.px(6), width = std::max(1, t.px(2));
    for (std::size_t i = 0; i < kPanes; ++i) {
      titles_[i]->setFont(t.small);
      titles_[i]->setStyleSheet(
          QString("QLabel { background: %1; color: %2; border-radius: %3px; padding: 1px %4px; }")
              .arg(t.label_ground.name(QColor::HexArgb), t.label.name())
              .arg(t.radius)
              .arg(t.px(5)));
      titles_[i]->adjustSize();
      titles_[i]->move(panes[i].topLeft().toPoint() + QPoint(inset, inset));
    }
    const QRect r = panes[active].toAlignedRect();
    const QRect all = panes[0].toAlignedRect() | panes[kPanes - 1].toAlignedRect();
    const QPoint middle = panes[kPanes - 1].topLeft().toPoint();
    const std::array<QRect, 6> sides{QRect(middle.x() - 1, all.top(), 2, all.height()),
                                     QRect(all.left(), middle.y() - 1, all.width(), 2),
                                     QRect(r.left(), r.top(), r.width(), width),
                                     QRect(r.left(), r.bottom() + 1 - width, r.width(), width),
                                     QRect(r.left(), r.top(), width, r.height()),
                                     QRect(r.right() + 1 - width, r.top(), width, r.height())};
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      lines_[i]->setStyleSheet(
          QString("background: %1;").arg(i < 2 ? t.line.name() : t.accent.name()));
      lines_[i]->setGeometry(sides[i]);
    }
    for (QLabel* each : titles_) show(*each);
    for (QLabel* each : lines_) show(*each);
  }

 private:
  static QLabel* add(QWidget* parent, const QString& name, const QString& accessible) {
    auto* label = new QLabel(parent);
    label->setObjectName(name);
    label->setAccessibleName(accessible);
    label->setToolTip(accessible);
    label->setAttribute(Qt::WA_TransparentForMouseEvents);
    return label;
  }
  static void show(QWidget& each) {
    each.show();
    each.raise();
  }
  std::array<QLabel*, kPanes> titles_{};
  std::array<QLabel*, 6> lines_{};
};

QSize Display::pixels() const {
  const double r = devicePixelRatioF();
  return {std::max(1, static_cast<int>(std::lround(width() * r))),
          std::max(1, static_cast<int>(std::lround(height() * r)))};
}

std::vector<SceneShot> Display::shots() const {
  if (panes_.empty()) {
    if (stereo_.mode != Stereo::none) return stereo_pair(camera(), stereo_, pixels());
    return {{camera(), 0, QRect(QPoint(), pixels())}};
  }
  std::vector<SceneShot> out;
  for (std::size_t i = 0; i < panes_.size(); ++i)
    out.push_back({i == active_ ? camera() : panes_[i].camera, 0, panes_[i].rect});
  return out;
}

void Display::draw_shots(SceneView& scene, int only) const {
  std::vector<SceneShot> wanted = shots();
  // Without `only` the mixed picture of both eyes is drawn by the overlay.
  if (is_mixed(stereo_.mode) && panes_.empty()) wanted = {wanted[only == 1 ? 1 : 0]};
  const OrbitCamera kept = scene.camera();
  const double share = surface_->share;
  const auto scaled = [share](int px) { return static_cast<int>(share * px); };
  const int height = pixels().height();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const SceneShot& shot = wanted[i];
    scene.camera() = shot.camera;
    const int low = height - shot.rect.top() - shot.rect.height();
    if (share < 1) {
      const QSize size = shrunk(shot.rect.size(), share);
      scene.camera().set_viewport(size.width(), size.height());
    }
    scene.set_shift(share * shot.shift);
    scene.set_origin(scaled(shot.rect.left()), scaled(low));
    Pass pass;
    pass.all_shadows = wanted.size() > 1;
    pass.keeps_shadows = i > 0;
    scene.draw(pass);
  }
  scene.camera() = kept;
  scene.set_shift(0);
  scene.set_origin(0, 0);
}

/// The window draws one eye after the other, and the overlay shows the two as one.
void Display::show_mixed() {
  if (!isVisible()) return;
  const std::vector<SceneShot> pair = shots();
  std::vector<QImage> images;
  for (int eye = 0; eye < 2; ++eye) {
    surface_->only = eye;
    images.push_back(surface_->shown());
  }
  surface_->only = -1;
  overlay_->put(composed(pair, images, stereo_.mode, pixels()));
}

void Display::set_stereo(const StereoSettings& settings) {
  stereo_ = settings;
  surface_->stereo = settings.mode;
  if (settings.mode != Stereo::none) set_four_view(false);
  resize_scene();
  changed();
}

void Display::set_four_view(bool on) {
  if (on == has_four_view()) return;
  flight_.stop();
  if (on) {
    stereo_ = {};
    surface_->stereo = Stereo::none;
    panes_.assign(kPanes, Pane{camera(), camera(), {}});
    active_ = kPerspectivePane;
    marks_ = new PaneMarks(this);
    lay_panes();
    const OrbitCamera own = camera();
    for (std::size_t i = 0; i < kPanes; ++i) {
      if (i == kPerspectivePane) continue;
      scene().camera() = own;
      scene().camera().set_perspective(false);
      scene().look(kPaneKinds[i].view);
      panes_[i].camera = panes_[i].fitted = camera();
    }
    scene().camera() = own;
    fit_pane(kPerspectivePane);
  } else {
    panes_.clear();
    delete marks_;
    marks_ = nullptr;
    resize_scene();
  }
  changed();
}

void Display::activate_pane(std::size_t pane) {
  if (pane >= panes_.size() || pane == active_) return;
  panes_[active_].camera = camera();
  active_ = pane;
  scene().camera() = panes_[active_].camera;
  mark_panes();
  if (on_camera) on_camera();
  redrawn();
}

void Display::fit_pane(std::size_t pane) {
  const OrbitCamera kept = camera();
  if (pane != active_) scene().camera() = panes_[pane].camera;
  scene().fit();
  panes_[pane].camera = panes_[pane].fitted = camera();
  if (pane != active_) scene().camera() = kept;
}

void Display::fit_panes() {
  for (std::size_t i = 0; i < panes_.size(); ++i) fit_pane(i);
}

void Display::lay_panes() {
  const QSize all = pixels();
  const int left = std::max(1, all.width() / 2), top = std::max(1, all.height() / 2);
  const int right = std::max(1, all.width() - left), bottom = std::max(1, all.height() - top);
  panes_[active_].camera = camera();
  for (std::size_t i = 0; i < panes_.size(); ++i) {
    Pane& pane = panes_[i];
    const bool is_right = i % 2 == 1, is_low = i >= 2;
    pane.rect = QRect(is_right ? left : 0, is_low ? top : 0, is_right ? right : left,
                      is_low ? bottom : top);
    OrbitCamera was = pane.fitted;
    was.set_viewport(pane.camera.width(), pane.camera.height());
    const bool is_untouched = was == pane.camera;
    pane.camera.set_viewport(pane.rect.width(), pane.rect.height());
    if (i == active_) scene().camera() = pane.camera;
    if (is_untouched) fit_pane(i);
  }
  mark_panes();
}

void Display::mark_panes() {
  if (!marks_) return;
  const double r = devicePixelRatioF();
  std::array<QRectF, kPanes> places;
  for (std::size_t i = 0; i < kPanes; ++i)
    places[i] = QRectF(panes_[i].rect.x() / r, panes_[i].rect.y() / r, panes_[i].rect.width() / r,
                       panes_[i].rect.height() / r);
  marks_->place(places, active_);
}

std::size_t Display::pane_at(QPointF place) const {
  const QPoint at = (place * devicePixelRatioF()).toPoint();
  for (std::size_t i = 0; i < panes_.size(); ++i)
    if (panes_[i].rect.contains(at)) return i;
  return active_;
}

QPointF Display::pane_origin() const {
  if (panes_.empty()) return {};
  return QPointF(panes_[active_].rect.topLeft()) / devicePixelRatioF();
}

Display::View Display::pane_view(std::size_t pane) const {
  const double r = devicePixelRatioF();
  const QRect& px = panes_[pane].rect;
  return {pane == active_ ? camera() : panes_[pane].camera,
          QRectF(px.x() / r, px.y() / r, px.width() / r, px.height() / r)};
}

std::vector<Display::View> Display::views() const {
  if (panes_.empty()) return {{camera(), QRectF(rect())}};
  std::vector<View> out;
  for (std::size_t i = 0; i < panes_.size(); ++i) out.push_back(pane_view(i));
  return out;
}

Display::View Display::active_view() const {
  return panes_.empty() ? View{camera(), QRectF(rect())} : pane_view(active_);
}

Display::View Display::view_at(QPointF place) const {
  return panes_.empty() ? View{camera(), QRectF(rect())} : pane_view(pane_at(place));
}

bool Display::activate_at(QPointF place) {
  const std::size_t pane = pane_at(place);
  if (pane == active_) return false;
  activate_pane(pane);
  return true;
}

QPointF Display::in_pane(QPointF place) const {
  if (!panes_.empty()) return place - pane_origin();
  // Both halves show the same scene.
  const double half = 0.5 * width();
  if (stereo_.mode == Stereo::side_by_side && place.x() >= half) return place - QPointF(half, 0);
  return place;
}

}  // namespace robomosp::viewer
