// SPDX-License-Identifier: GPL-3.0-or-later
// The children of a display that draw: in the window by OpenGL, by OpenGL into memory, or through
// EGL into an image (layer: GUI). Internal to viewer/window/display*.cpp.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <QElapsedTimer>
#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <QOpenGLExtraFunctions>
#include <QOpenGLFramebufferObject>
#include <QOpenGLWidget>
#include <QPainter>
#include <QPointer>
#include <QSurfaceFormat>

#include "viewer/scene/offscreen.h"
#include "viewer/window/display.h"

namespace robomosp::viewer {

/// Debian's OpenSceneGraph needs the compatibility profile.
[[nodiscard]] QSurfaceFormat format_with(int samples);

[[nodiscard]] inline QImage picture_of(const Image& image) {
  return QImage(image.rgb.data(), image.width, image.height, 3 * image.width, QImage::Format_RGB888)
      .copy();
}

/// A size in pixels at a share of its sides.
[[nodiscard]] inline QSize shrunk(QSize size, double share) {
  return {std::max(16, static_cast<int>(share * size.width())),
          std::max(16, static_cast<int>(share * size.height()))};
}

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
  /// Draws one of the views of the display, or all (-1), into the current context.
  std::function<void(SceneView&, int)> draw;
  /// The views that it shows, of the widget's size.
  std::function<std::vector<SceneShot>()> shots;
  /// Called after each picture with its share and the time that it took [s].
  std::function<void(double share, double seconds)> timed;
  /// Of the sides of the picture: less than 1 = fewer pixels are drawn and enlarged.
  double share = 1;
  bool is_software = false;
  int drawn = 0;
  int only = -1;  ///< of the views
  Stereo stereo = Stereo::none;
  QSize whole;  ///< of the widget [px]
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
  QImage shown() override {
    const QImage image = view_->grabFramebuffer();
    drawn_with_.reset();  // this picture is not put on the screen
    return image;
  }
  void let_go() override {
    // Qt draws the window itself in its own context.
    if (QOpenGLContext* context = QOpenGLContext::currentContext()) context->doneCurrent();
  }

 private:
  class View : public QOpenGLWidget {
   public:
    View(GlSurface& owner, QWidget* parent) : QOpenGLWidget(parent), owner_(owner) {
      connect(this, &QOpenGLWidget::frameSwapped, this, [this] { owner_.swapped(); });
    }
    void free_small() { small_.reset(); }

   protected:
    void initializeGL() override {
      connect(context(), &QOpenGLContext::aboutToBeDestroyed, this, [this] { owner_.release(); });
    }
    void paintGL() override {
      owner_.clock_.start();
      owner_.drawn_with_ = owner_.share;
      if (owner_.share < 1) {
        draw_small(owner_.share);
      } else {
        small_.reset();  // the next motion may need another size
        // Qt may have made a new framebuffer, for example after a resize.
        owner_.scene_.set_framebuffer(defaultFramebufferObject());
        owner_.draw(owner_.scene_, owner_.only);
      }
      ++owner_.drawn;
    }

   private:
    /// Into a smaller framebuffer, then enlarged.
    void draw_small(double share) {
      const QSize size = shrunk(owner_.whole, share);
      if (!small_ || small_->size() != size)
        small_ = std::make_unique<QOpenGLFramebufferObject>(
            size, QOpenGLFramebufferObject::CombinedDepthStencil);
      // OpenSceneGraph binds it only after it has drawn into another one.
      small_->bind();
      owner_.scene_.set_framebuffer(small_->handle());
      owner_.draw(owner_.scene_, owner_.only);
      small_->release();
      QOpenGLFramebufferObject::blitFramebuffer(nullptr, QRect(QPoint(), owner_.whole),
                                                small_.get(), QRect(QPoint(), size),
                                                GL_COLOR_BUFFER_BIT, GL_LINEAR);
    }
    GlSurface& owner_;
    std::unique_ptr<QOpenGLFramebufferObject> small_;
  };

  /// The window with the last picture is on the screen. Software OpenGL has computed it by then.
  void swapped() {
    if (const auto with = std::exchange(drawn_with_, std::nullopt); with && is_software && timed)
      timed(*with, 1e-9 * static_cast<double>(clock_.nsecsElapsed()));
  }
  void release() {
    if (!view_ || !view_->context()) return;
    view_->makeCurrent();
    view_->free_small();
    scene_.release();
    view_->doneCurrent();
  }

  SceneView scene_;
  QPointer<View> view_;
  QElapsedTimer clock_;               ///< since the last picture was begun
  std::optional<double> drawn_with_;  ///< share of the picture that is not on the screen yet
};

/// Paints the image that its owner has drawn.
class Display::Painted : public QWidget {
 public:
  Painted(QWidget* parent, std::function<const QImage&()> image)
      : QWidget(parent), image_(std::move(image)) {
    setAttribute(Qt::WA_OpaquePaintEvent);
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    const QImage& image = image_();
    QPainter painter(this);
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    painter.drawImage(rect(), image);
  }

 private:
  std::function<const QImage&()> image_;
};

/// For software OpenGL. With an OpenGL widget among its children, Qt composes the whole window by
/// OpenGL, which takes software longer than many a scene.
class Display::CopiedSurface : public Display::Surface {
 public:
  /// Null if the platform gives no OpenGL without a window.
  static std::unique_ptr<CopiedSurface> create(QWidget* parent, Quality quality) {
    std::unique_ptr<CopiedSurface> made(new CopiedSurface(parent, quality));
    return made->context_.create() ? std::move(made) : nullptr;
  }
  ~CopiedSurface() override {
    delete view_;
    if (!context_.makeCurrent(&target_)) return;
    drawn_.reset();
    enlarged_.reset();
    scene_.release();
    context_.doneCurrent();
  }
  QWidget* widget() override { return view_; }
  SceneView& scene() override { return scene_; }
  void redraw() override {
    is_old_ = true;
    view_->update();
  }
  void resize(int width, int height) override { scene_.resize(width, height); }
  QImage shown() override {
    if (only >= 0) is_old_ = true;  // the other eye
    refresh();
    if (only >= 0) is_old_ = true;
    return image_;
  }

 private:
  CopiedSurface(QWidget* parent, Quality quality)
      : scene_(quality, Target::window), view_(new Painted(parent, [this]() -> const QImage& {
          refresh();
          return image_;
        })) {
    context_.setFormat(format_with(0));
    target_.setFormat(format_with(0));
    target_.create();
  }
  static void fit(std::unique_ptr<QOpenGLFramebufferObject>& buffer, QSize size,
                  QOpenGLFramebufferObject::Attachment attachment) {
    if (!buffer || buffer->size() != size)
      buffer = std::make_unique<QOpenGLFramebufferObject>(size, attachment);
  }
  void refresh() {
    if (!std::exchange(is_old_, false) || whole.isEmpty() || !context_.makeCurrent(&target_))
      return;
    QElapsedTimer clock;
    clock.start();
    const QSize size = share < 1 ? shrunk(whole, share) : whole;
    fit(drawn_, size, QOpenGLFramebufferObject::CombinedDepthStencil);
    fit(enlarged_, whole, QOpenGLFramebufferObject::NoAttachment);
    // OpenSceneGraph binds it only after it has drawn into another one.
    drawn_->bind();
    scene_.set_framebuffer(drawn_->handle());
    draw(scene_, only);
    // The rows of images begin at the top.
    QOpenGLExtraFunctions& gl = *context_.extraFunctions();
    gl.glBindFramebuffer(GL_READ_FRAMEBUFFER, drawn_->handle());
    gl.glBindFramebuffer(GL_DRAW_FRAMEBUFFER, enlarged_->handle());
    gl.glBlitFramebuffer(0, size.height(), size.width(), 0, 0, 0, whole.width(), whole.height(),
                         GL_COLOR_BUFFER_BIT, size == whole ? GL_NEAREST : GL_LINEAR);
    enlarged_->bind();
    if (image_.size() != whole) image_ = QImage(whole, QImage::Format_RGB32);
    gl.glReadPixels(0, 0, whole.width(), whole.height(), GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV,
                    image_.bits());
    enlarged_->release();
    context_.doneCurrent();
    ++drawn;
    if (timed) timed(share, 1e-9 * static_cast<double>(clock.nsecsElapsed()));
  }

  QOpenGLContext context_;
  QOffscreenSurface target_;
  std::unique_ptr<QOpenGLFramebufferObject> drawn_, enlarged_;
  SceneView scene_;
  QPointer<Painted> view_;
  QImage image_;
  bool is_old_ = true;
};

class Display::ImageSurface : public Display::Surface {
 public:
  ImageSurface(QWidget* parent, OffscreenRenderer r)
      : renderer_(std::move(r)), view_(new Painted(parent, [this]() -> const QImage& {
          refresh();
          return image_;
        })) {
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
  void refresh() {
    if (!std::exchange(is_old_, false)) return;
    QElapsedTimer clock;
    clock.start();
    const OrbitCamera kept = scene().camera();
    const std::vector<SceneShot> views = shots();
    std::vector<QImage> images;
    for (const SceneShot& view : views) {
      // Only one picture is enlarged; several are composed pixel by pixel.
      const QSize size =
          share < 1 && views.size() == 1 ? shrunk(view.rect.size(), share) : view.rect.size();
      // Otherwise a view that nobody has moved is fitted into the smaller picture.
      if (size != view.rect.size()) scene().camera().orbit(1, 0);
      renderer_.resize(size.width(), size.height());
      scene().camera() = view.camera;
      scene().camera().set_viewport(size.width(), size.height());
      scene().set_shift(view.shift);
      renderer_.restart();
      renderer_.step();
      images.push_back(picture_of(renderer_.image()));
    }
    scene().camera() = kept;
    scene().set_shift(0);
    image_ = composed(views, images, stereo, whole);
    ++drawn;
    if (timed)
      timed(views.size() == 1 ? share : 1, 1e-9 * static_cast<double>(clock.nsecsElapsed()));
  }

  OffscreenRenderer renderer_;
  QPointer<Painted> view_;
  QImage image_;
  bool is_old_ = true;
};

/// Shows the still, or the picture of both eyes, over the surface.
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
    update();
  }
  [[nodiscard]] const QImage& image() const { return image_; }

 protected:
  void paintEvent(QPaintEvent*) override { QPainter(this).drawImage(rect(), image_); }

 private:
  QImage image_;
};

}  // namespace robomosp::viewer
