// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/display.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QCoreApplication>
#include <QGuiApplication>
#include <QImage>
#include <QMouseEvent>
#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <QOpenGLFunctions>
#include <QPainter>
#include <QWheelEvent>

#include "viewer/scene/linear.h"
#include "viewer/scene/offscreen.h"
#include "viewer/theme/theme.h"
#include "viewer/window/display_surface.h"
#include "viewer/window/refiner.h"
#include "viewer/window/window_opengl.h"

namespace robomosp::viewer {
namespace {

constexpr int kIdleMs = 300;
constexpr int kFlightMs = 250;
constexpr int kStillMs = 120;  ///< without a motion the view is at rest

/// Of the theme, for outlines of the selection.
Colour accent() {
  const QColor c = theme().accent;
  return {static_cast<float>(c.redF()), static_cast<float>(c.greenF()),
          static_cast<float>(c.blueF()), 1};
}

bool is_software(const QString& renderer) {
  return renderer.contains("llvmpipe") || renderer.contains("softpipe") ||
         renderer.contains("swrast");
}

}  // namespace

QSurfaceFormat format_with(int samples) {
  QSurfaceFormat format;
  format.setRenderableType(QSurfaceFormat::OpenGL);
  format.setProfile(QSurfaceFormat::CompatibilityProfile);
  format.setVersion(2, 1);
  format.setDepthBufferSize(24);
  format.setStencilBufferSize(8);  // outlines of the selection need it
  format.setSamples(samples);
  return format;
}

WindowOpenGl window_opengl() {
  const QString platform = QGuiApplication::platformName();
  if (platform != "xcb" && !platform.startsWith("wayland")) return {};
  QOpenGLContext context;
  context.setFormat(format_with(0));
  QOffscreenSurface surface;
  surface.setFormat(format_with(0));
  surface.create();
  if (!context.create() || !context.makeCurrent(&surface)) return {};
  const auto text = [&](GLenum which) {
    return QString::fromUtf8(
        reinterpret_cast<const char*>(context.functions()->glGetString(which)));
  };
  WindowOpenGl out{text(GL_RENDERER), text(GL_VERSION)};
  context.doneCurrent();
  return out;
}

Display::Display() : overlay_(new Overlay(this)) {
  flight_.setDuration(kFlightMs);
  flight_.setStartValue(0.0);
  flight_.setEndValue(1.0);
  flight_.setEasingCurve(QEasingCurve::InOutCubic);
  setObjectName("display");
  idle_.setSingleShot(true);
  connect(&idle_, &QTimer::timeout, this, [this] { refine(); });
  still_.setSingleShot(true);
  connect(&still_, &QTimer::timeout, this, [this] { come_to_rest(); });
  mixing_.setSingleShot(true);
  connect(&mixing_, &QTimer::timeout, this, [this] { show_mixed(); });
  setFocusPolicy(Qt::StrongFocus);
  setMinimumSize(320, 240);
  qApp->installEventFilter(this);
}

Display::~Display() = default;

Result<std::unique_ptr<Display>> Display::create(std::optional<Quality> quality,
                                                 DrawingMethod method) {
  std::unique_ptr<Display> display(new Display);
  std::unique_ptr<Surface>& surface = display->surface_;
  const QString renderer = method == DrawingMethod::image ? QString() : window_opengl().renderer;
  const bool is_slow = is_software(renderer);
  if (!renderer.isEmpty()) {
    if (method == DrawingMethod::automatic)
      method = is_slow ? DrawingMethod::copied : DrawingMethod::window;
    const Quality q = quality.value_or(is_slow ? Quality::fast : Quality::quality);
    if (method == DrawingMethod::copied) surface = CopiedSurface::create(display.get(), q);
    else surface = std::make_unique<GlSurface>(display.get(), q, is_slow ? 0 : 4);
  }
  if (surface) {
    surface->renderer = renderer;
    surface->is_software = is_slow;
  } else {
    method = DrawingMethod::image;
    auto offscreen = OffscreenRenderer::create(320, 240, quality.value_or(Quality::fast));
    if (!offscreen) {
      return std::move(offscreen).error().in("the 3-D display on the Qt platform \"" +
                                             QGuiApplication::platformName().toStdString() + "\"");
    }
    surface = std::make_unique<ImageSurface>(display.get(), std::move(offscreen).value());
  }
  display->drawing_method_ = method;
  display->surface_->draw = [d = display.get()](SceneView& scene, int only) {
    d->draw_shots(scene, only);
  };
  display->surface_->timed = [d = display.get()](double share, double seconds) {
    d->pace_.drawn(share, seconds);
  };
  display->surface_->shots = [d = display.get()] { return d->shots(); };
  QWidget* view = display->surface_->widget();
  view->setObjectName("display_surface");
  view->setAccessibleName("Picture");
  view->setAttribute(Qt::WA_TransparentForMouseEvents);
  // Above the surface, and below what is shown over both.
  display->overlay_->raise();
  return display;
}

SceneView& Display::scene() const { return surface_->scene(); }

/// A motion may be drawn with fewer pixels, until it comes to rest; so may what else changes
/// meanwhile.
void Display::changed(bool is_motion) {
  surface_->share = is_motion || still_.isActive() ? pace_.share() : 1;
  if (is_motion) still_.start(kStillMs);
  is_refined_ = false;
  if (refiner_) refiner_->cancel();
  if (is_refining_) idle_.start(kIdleMs);
  surface_->redraw();
  if (is_mixed(stereo_.mode) && drawing_method_ != DrawingMethod::image) mixing_.start(0);
  else overlay_->hide();
  redrawn();
}

void Display::come_to_rest() {
  if (!is_coarse()) return;
  surface_->share = 1;
  surface_->redraw();
  if (is_mixed(stereo_.mode) && drawing_method_ != DrawingMethod::image) mixing_.start(0);
}

bool Display::is_coarse() const { return surface_->share < 1; }

void Display::set_refining(bool on) {
  is_refining_ = on;
  if (!on) {
    idle_.stop();
    refiner_.reset();
  }
  changed();
}

void Display::refine() {
  if (!isVisible() || !is_refining_) return;
  if (!refiner_) {
    refiner_ = std::make_unique<Refiner>();
    refiner_->on_still = [this](const QImage& still, bool is_finished) {
      overlay_->put(still);
      is_refined_ = is_finished;
      redrawn();
    };
    refiner_->on_failure = [this] { is_refining_ = false; };  // the ordinary picture stays
  }
  refiner_->start({frame_, playback_, time_, selected_, shots(), stereo_.mode, pixels(), is_dark_,
                   accent(), theme().zoom});
}

bool Display::is_refined() const { return overlay_->isVisible() && is_refined_; }

void Display::set_frame(const Frame& frame) {
  frame_ = frame;
  resize_scene();
  const OrbitCamera kept = scene().camera();
  scene().sync(frame);
  if (!panes_.empty()) {
    scene().camera() = kept;  // each view has its own
    if (std::exchange(refits_panes_, false)) fit_panes();
  }
  selected_.clear();
  for (const Item& item : frame.items)
    if (item.selected) selected_.push_back(item.id);
  // Frames that follow each other show a motion.
  changed(since_frame_.isValid() && since_frame_.elapsed() < kStillMs);
  since_frame_.start();
}

void Display::set_playback(std::shared_ptr<const Playback> playback) {
  playback_ = playback;
  scene().set_playback(std::move(playback));
  changed();
}

void Display::set_time(double time) {
  time_ = time;
  scene().set_time(time);
  changed(true);
}

void Display::select(const std::vector<std::uint64_t>& ids) {
  selected_ = ids;
  scene().select(ids);
  changed();
}

void Display::look(Camera::View view) {
  scene().look(view);
  changed();
  camera_moved();
}

void Display::set_camera(const OrbitCamera& camera) {
  const int width = scene().camera().width(), height = scene().camera().height();
  scene().camera() = camera;
  scene().camera().set_viewport(width, height);
  changed();
  camera_moved();
}

void Display::fit() {
  scene().fit();
  changed();
  camera_moved();
}

void Display::camera_moved() {
  is_touched_ = true;
  if (on_camera) on_camera();
}

void Display::forget_camera() {
  if (panes_.empty()) scene().forget_camera();
  else refits_panes_ = true;
}

void Display::fly_to(const std::vector<std::uint64_t>& ids) {
  std::vector<Vec3> points;
  for (const Item& item : frame_.items) {
    if (!item.mesh || std::find(ids.begin(), ids.end(), item.id) == ids.end()) continue;
    const auto& p = item.mesh->positions;
    for (std::size_t i = 0; i + 2 < p.size(); i += 3)
      points.push_back(
          transform(item.pose, {static_cast<double>(p[i]), static_cast<double>(p[i + 1]),
                                static_cast<double>(p[i + 2])}));
  }
  if (points.empty()) return fit();
  OrbitCamera end = camera();
  end.fit(points, 0.25);
  const OrbitCamera begin = camera();
  flight_.stop();
  flight_.disconnect();
  connect(&flight_, &QVariantAnimation::valueChanged, this, [this, begin, end](const QVariant& v) {
    const double t = v.toDouble();
    const Vec3 target = begin.target() + t * (end.target() - begin.target());
    const double distance = begin.distance() * std::pow(end.distance() / begin.distance(), t);
    scene().camera().look_from(target + distance * begin.backward(), target);
    changed(true);
    camera_moved();
  });
  flight_.start();
}

void Display::set_dark(bool on) {
  is_dark_ = on;
  scene().set_dark(on);
  scene().set_accent(accent());
  scene().set_zoom(theme().zoom);
  mark_panes();
  changed();
}

void Display::set_perspective(bool on) {
  scene().camera().set_perspective(on);
  changed();
  camera_moved();
}

const OrbitCamera& Display::camera() const { return scene().camera(); }

std::optional<Pick> Display::pick(QPointF place) const {
  const double r = devicePixelRatioF();
  if (!panes_.empty()) {
    const View view = view_at(place);
    const QPointF at = place - view.place.topLeft();
    return scene().pick(view.camera, at.x() * r, at.y() * r);
  }
  const QPointF at = in_pane(place);
  return scene().pick(at.x() * r, at.y() * r);
}

Result<Image> Display::still(int width, int height) {
  surface_->let_go();
  RMP_TRY_ASSIGN(auto renderer, OffscreenRenderer::create(width, height, Quality::quality));
  SceneView& other = renderer.scene();
  other.set_dark(is_dark_);
  other.set_accent(accent());
  other.sync(frame_);
  other.set_playback(playback_);
  if (time_) other.set_time(*time_);
  other.select(selected_);
  other.camera() = camera();
  other.camera().set_viewport(width, height);
  while (renderer.step()) {
  }
  return renderer.image();
}

QImage Display::shown() {
  come_to_rest();
  return overlay_->isVisible() ? overlay_->image() : surface_->shown();
}
int Display::pictures_drawn() const { return surface_->drawn; }
const QString& Display::renderer_name() const { return surface_->renderer; }

void Display::mousePressEvent(QMouseEvent* event) {
  flight_.stop();
  activate_pane(pane_at(event->position()));
  pressed_ = last_ = event->position();
  pivot_.reset();
  is_click_ = event->button() == Qt::LeftButton;
}

void Display::mouseMoveEvent(QMouseEvent* event) {
  const QPointF at = event->position();
  if (is_click_ && (at - pressed_).manhattanLength() < kLeastDrag) return;
  if (std::exchange(is_click_, false))
    if (const auto hit = pick(pressed_)) pivot_ = hit->point;
  const QPointF moved = (at - last_) * devicePixelRatioF();
  last_ = at;
  const bool is_left = event->buttons().testFlag(Qt::LeftButton);
  const bool is_pan = event->buttons().testFlag(Qt::MiddleButton) ||
                      (is_left && event->modifiers().testFlag(Qt::ShiftModifier));
  OrbitCamera& c = scene().camera();
  if (is_pan) c.pan(moved.x(), moved.y());
  else if (is_left && pivot_) c.orbit_about(*pivot_, moved.x(), moved.y());
  else if (is_left) c.orbit(moved.x(), moved.y());
  else if (event->buttons().testFlag(Qt::RightButton))
    c.zoom_at(0.5 * c.width(), 0.5 * c.height(), std::exp(-0.006 * moved.y()));
  else return;
  changed(true);
  camera_moved();
}

void Display::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || !std::exchange(is_click_, false)) return;
  const auto hit = pick(event->position());
  select(hit ? std::vector<std::uint64_t>{hit->id} : std::vector<std::uint64_t>{});
  if (on_pick) on_pick(hit);
}

void Display::mouseDoubleClickEvent(QMouseEvent*) { fit(); }

void Display::wheelEvent(QWheelEvent* event) {
  flight_.stop();
  const double r = devicePixelRatioF();
  const double steps = event->angleDelta().y() / 120.0;
  activate_pane(pane_at(event->position()));
  const QPointF at = r * in_pane(event->position());
  scene().camera().zoom_at(at.x(), at.y(), std::pow(1.15, steps));
  event->accept();
  changed(true);
  camera_moved();
}

void Display::resizeEvent(QResizeEvent*) {
  surface_->widget()->setGeometry(rect());
  overlay_->setGeometry(rect());
  resize_scene();
  changed();
}

/// Passes of a still take long: whoever types or moves the mouse anywhere in the window comes
/// first.
bool Display::eventFilter(QObject*, QEvent* event) {
  switch (event->type()) {
    case QEvent::KeyPress:
    case QEvent::MouseButtonPress:
    case QEvent::MouseMove:
    case QEvent::Wheel:
      if (idle_.isActive()) idle_.start(kIdleMs);
      break;
    default: break;
  }
  return false;
}

void Display::resize_scene() {
  surface_->whole = pixels();
  if (!panes_.empty()) return lay_panes();
  const bool is_halved = stereo_.mode == Stereo::side_by_side;
  surface_->resize(is_halved ? pixels().width() / 2 : pixels().width(), pixels().height());
}

}  // namespace robomosp::viewer
