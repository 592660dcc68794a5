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
#include <QOpenGLWidget>
#include <QPainter>
#include <QPointer>
#include <QWheelEvent>

#include "viewer/scene/linear.h"
#include "viewer/scene/offscreen.h"

namespace robomosp::viewer {
namespace {

constexpr int kIdleMs = 300;
constexpr int kFlightMs = 250;

/// Debian's OpenSceneGraph needs the compatibility profile.
QSurfaceFormat format_with(int samples) {
  QSurfaceFormat format;
  format.setRenderableType(QSurfaceFormat::OpenGL);
  format.setProfile(QSurfaceFormat::CompatibilityProfile);
  format.setVersion(2, 1);
  format.setDepthBufferSize(24);
  format.setSamples(samples);
  return format;
}

/// Name of the OpenGL renderer that windows get; empty if they get none.
QString window_renderer() {
  const QString platform = QGuiApplication::platformName();
  if (platform != "xcb" && !platform.startsWith("wayland")) return {};
  QOpenGLContext context;
  context.setFormat(format_with(0));
  QOffscreenSurface surface;
  surface.setFormat(format_with(0));
  surface.create();
  if (!context.create() || !context.makeCurrent(&surface)) return {};
  const auto* name = context.functions()->glGetString(GL_RENDERER);
  const QString result = QString::fromUtf8(reinterpret_cast<const char*>(name));
  context.doneCurrent();
  return result;
}

bool is_software(const QString& renderer) {
  return renderer.contains("llvmpipe") || renderer.contains("softpipe") ||
         renderer.contains("swrast");
}

QImage image_of(const Image& image) {
  return QImage(image.rgb.data(), image.width, image.height, 3 * image.width, QImage::Format_RGB888)
      .copy();
}

}  // namespace

/// The child that fills the display.
class Display::Surface {
 public:
  virtual ~Surface() = default;
  virtual QWidget* widget() = 0;
  virtual SceneView& scene() = 0;
  virtual void redraw() = 0;
  virtual void resize(int width_px, int height_px) = 0;
  virtual QImage shown() = 0;
  /// Lets other code use OpenGL in this thread.
  virtual void let_go() {}
  int drawn = 0;
  QString renderer;
};

class Display::GlSurface : public Display::Surface {
 public:
  GlSurface(QWidget* parent, Quality quality, int samples)
      : scene_(quality, Target::window), view_(new View(*this, parent)) {
    view_->setFormat(format_with(samples));
  }
  ~GlSurface() override {
    release();
    delete view_;  // it refers to this object
  }
  QWidget* widget() override { return view_; }
  SceneView& scene() override { return scene_; }
  void redraw() override { view_->update(); }
  void resize(int width, int height) override { scene_.resize(width, height); }
  QImage shown() override { return view_->grabFramebuffer(); }
  void let_go() override {
    // Qt draws the window itself in a context of its own.
    if (QOpenGLContext* context = QOpenGLContext::currentContext()) context->doneCurrent();
  }

 private:
  class View : public QOpenGLWidget {
   public:
    View(GlSurface& owner, QWidget* parent) : QOpenGLWidget(parent), owner_(owner) {}

   protected:
    void initializeGL() override {
      connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, [this] { owner_.release(); });
    }
    void paintGL() override {
      // Qt may have made a new framebuffer, for example after a resize.
      owner_.scene_.set_framebuffer(defaultFramebufferObject());
      owner_.scene_.draw();
      ++owner_.drawn;
    }

   private:
    GlSurface& owner_;
  };

  void release() {
    if (!view_ || !view_->context()) return;
    view_->makeCurrent();
    scene_.release();
    view_->doneCurrent();
  }

  SceneView scene_;
  QPointer<View> view_;
};

class Display::ImageSurface : public Display::Surface {
 public:
  ImageSurface(QWidget* parent, OffscreenRenderer r)
      : renderer_(std::move(r)), view_(new View(*this, parent)) {
    renderer = QString::fromStdString(renderer_.renderer_name());
  }
  ~ImageSurface() override { delete view_; }
  QWidget* widget() override { return view_; }
  SceneView& scene() override { return renderer_.scene(); }
  void redraw() override {
    is_old_ = true;
    view_->update();
  }
  void resize(int width, int height) override { renderer_.resize(width, height); }
  QImage shown() override {
    refresh();
    return image_;
  }

 private:
  class View : public QWidget {
   public:
    View(ImageSurface& owner, QWidget* parent) : QWidget(parent), owner_(owner) {}

   protected:
    void paintEvent(QPaintEvent*) override {
      owner_.refresh();
      QPainter(this).drawImage(rect(), owner_.image_);
    }

   private:
    ImageSurface& owner_;
  };

  void refresh() {
    if (!std::exchange(is_old_, false)) return;
    renderer_.restart();
    renderer_.step();
    image_ = image_of(renderer_.image());
    ++drawn;
  }

  OffscreenRenderer renderer_;
  QPointer<View> view_;
  QImage image_;
  bool is_old_ = true;
};

/// Shows the still over the surface.
class Display::Overlay : public QWidget {
 public:
  explicit Overlay(QWidget* parent) : QWidget(parent) {
    setObjectName("display_overlay");
    setAccessibleName("Fine picture");
    setAttribute(Qt::WA_TransparentForMouseEvents);
    hide();
  }
  void put(QImage image) {
    image_ = std::move(image);
    show();
    raise();
    update();
  }
  [[nodiscard]] const QImage& image() const { return image_; }

 protected:
  void paintEvent(QPaintEvent*) override { QPainter(this).drawImage(rect(), image_); }

 private:
  QImage image_;
};

Display::Display() : overlay_(new Overlay(this)) {
  flight_.setDuration(kFlightMs);
  flight_.setStartValue(0.0);
  flight_.setEndValue(1.0);
  flight_.setEasingCurve(QEasingCurve::InOutCubic);
  setObjectName("display");
  idle_.setSingleShot(true);
  connect(&idle_, &QTimer::timeout, this, [this] { refine(); });
  setFocusPolicy(Qt::StrongFocus);
  setMinimumSize(320, 240);
  qApp->installEventFilter(this);
}

Display::~Display() { forget_refiner(); }

void Display::forget_refiner() {
  // Its end makes an EGL context current, as refine() does.
  if (refiner_) surface_->let_go();
  refiner_.reset();
}

Result<std::unique_ptr<Display>> Display::create(std::optional<Quality> quality,
                                                 bool software_view) {
  std::unique_ptr<Display> display(new Display);
  const QString renderer = software_view ? QString() : window_renderer();
  if (!renderer.isEmpty()) {
    const bool is_slow = is_software(renderer);
    const Quality q = quality.value_or(is_slow ? Quality::fast : Quality::quality);
    display->surface_ = std::make_unique<GlSurface>(display.get(), q, is_slow ? 0 : 4);
    display->surface_->renderer = renderer;
  } else {
    auto offscreen = OffscreenRenderer::create(320, 240, quality.value_or(Quality::fast));
    if (!offscreen) {
      return std::move(offscreen).error().in("the 3-D display on the Qt platform \"" +
                                             QGuiApplication::platformName().toStdString() + "\"");
    }
    display->surface_ = std::make_unique<ImageSurface>(display.get(), std::move(offscreen).value());
  }
  QWidget* view = display->surface_->widget();
  view->setObjectName("display_surface");
  view->setAccessibleName("Picture");
  view->setAttribute(Qt::WA_TransparentForMouseEvents);
  return display;
}

SceneView& Display::scene() const { return surface_->scene(); }

void Display::changed() {
  overlay_->hide();
  is_started_ = false;
  if (is_refining_) idle_.start(kIdleMs);
  surface_->redraw();
}

void Display::set_refining(bool on) {
  is_refining_ = on;
  if (!on) {
    idle_.stop();
    forget_refiner();
  }
  changed();
}

void Display::prepare_still(OffscreenRenderer& renderer) const {
  const int width = renderer.scene().camera().width(), height = renderer.scene().camera().height();
  renderer.scene().set_dark(is_dark_);
  renderer.scene().sync(frame_);
  renderer.scene().set_playback(playback_);
  if (time_) renderer.scene().set_time(*time_);
  renderer.scene().select(selected_);
  renderer.scene().camera() = camera();
  renderer.scene().camera().set_viewport(width, height);
}

void Display::refine() {
  if (!isVisible()) return;
  // An EGL context cannot become current beside one of another window system.
  surface_->let_go();
  const int width = camera().width(), height = camera().height();
  if (!refiner_) {
    auto renderer = OffscreenRenderer::create(width, height, Quality::quality);
    if (!renderer) {  // the ordinary picture stays
      is_refining_ = false;
      return;
    }
    refiner_ = std::make_unique<OffscreenRenderer>(std::move(renderer).value());
  }
  if (!std::exchange(is_started_, true)) {
    refiner_->resize(width, height);
    prepare_still(*refiner_);
  }
  refiner_->step();
  const int done = refiner_->passes_done(), wanted = refiner_->passes_wanted();
  if (done == wanted || done == wanted / 4) overlay_->put(image_of(refiner_->image()));
  // Back to the event loop between passes: a mouse movement ends it all.
  if (done < wanted) idle_.start(0);
}

bool Display::is_refined() const {
  return overlay_->isVisible() && refiner_ && refiner_->passes_done() == refiner_->passes_wanted();
}

void Display::set_frame(const Frame& frame) {
  frame_ = frame;
  resize_scene();
  scene().sync(frame);
  selected_.clear();
  for (const Item& item : frame.items)
    if (item.selected) selected_.push_back(item.id);
  changed();
}

void Display::set_playback(std::shared_ptr<const Playback> playback) {
  playback_ = playback;
  scene().set_playback(std::move(playback));
  changed();
}

void Display::set_time(double time) {
  time_ = time;
  scene().set_time(time);
  changed();
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

void Display::fit() {
  scene().fit();
  changed();
  camera_moved();
}

void Display::camera_moved() {
  is_touched_ = true;
  if (on_camera) on_camera();
}

void Display::forget_camera() { scene().forget_camera(); }

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
    changed();
    camera_moved();
  });
  flight_.start();
}

void Display::set_dark(bool on) {
  is_dark_ = on;
  scene().set_dark(on);
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
  return scene().pick(place.x() * r, place.y() * r);
}

Result<Image> Display::still(int width, int height) {
  surface_->let_go();
  RMP_TRY_ASSIGN(auto renderer, OffscreenRenderer::create(width, height, Quality::quality));
  prepare_still(renderer);
  while (renderer.step()) {
  }
  return renderer.image();
}

QImage Display::shown() { return overlay_->isVisible() ? overlay_->image() : surface_->shown(); }
int Display::pictures_drawn() const { return surface_->drawn; }
bool Display::uses_window_opengl() const {
  return dynamic_cast<const GlSurface*>(surface_.get()) != nullptr;
}
const QString& Display::renderer_name() const { return surface_->renderer; }

void Display::mousePressEvent(QMouseEvent* event) {
  flight_.stop();
  pressed_ = last_ = event->position();
  pivot_.reset();
  is_click_ = event->button() == Qt::LeftButton;
}

void Display::mouseMoveEvent(QMouseEvent* event) {
  const QPointF at = event->position();
  // A hand trembles: less than this is still a click.
  if (is_click_ && (at - pressed_).manhattanLength() < 4) return;
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
  changed();
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
  scene().camera().zoom_at(event->position().x() * r, event->position().y() * r,
                           std::pow(1.15, steps));
  event->accept();
  changed();
  camera_moved();
}

void Display::resizeEvent(QResizeEvent*) {
  surface_->widget()->setGeometry(rect());
  overlay_->setGeometry(rect());
  resize_scene();
  changed();
}

/// Passes of a still take long: whoever types or moves the mouse anywhere in the window comes first.
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
  const double r = devicePixelRatioF();
  surface_->resize(static_cast<int>(std::lround(width() * r)),
                   static_cast<int>(std::lround(height() * r)));
}

}  // namespace robomosp::viewer
