// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/offscreen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>

namespace robomosp::viewer {
namespace {

constexpr int kMinSize = 16, kMaxSize = 8192;
constexpr int kFastPasses = 8, kQualityPasses = 16;

/// What is current in this thread, to be put back.
struct CurrentContext {
  EGLDisplay display = eglGetCurrentDisplay();
  EGLContext context = eglGetCurrentContext();
  EGLSurface draw = eglGetCurrentSurface(EGL_DRAW), read = eglGetCurrentSurface(EGL_READ);
  EGLenum api = eglQueryAPI();
};

/// An OpenGL context with a tiny surface of its own; pictures go to framebuffer objects.
class EglContext {
 public:
  static Result<std::unique_ptr<EglContext>> create();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  ~EglContext() {
    // The display stays initialised: EGL gives every caller in the process the same one.
    eglDestroyContext(display_, context_);
    eglDestroySurface(display_, surface_);
  }

  /// Makes the context current until the end of the scope.
  class Scope {
   public:
    explicit Scope(const EglContext& c) : display_(c.display_) {
      eglBindAPI(EGL_OPENGL_API);
      eglMakeCurrent(c.display_, c.surface_, c.surface_, c.context_);
    }
    ~Scope() {
      eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      eglBindAPI(before_.api);
      if (before_.context != EGL_NO_CONTEXT)
        eglMakeCurrent(before_.display, before_.draw, before_.read, before_.context);
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    CurrentContext before_;
    EGLDisplay display_;
  };

 private:
  EglContext(EGLDisplay d, EGLSurface s, EGLContext c) : display_(d), surface_(s), context_(c) {}
  static std::unique_ptr<EglContext> on(EGLDisplay display);
  EGLDisplay display_;
  EGLSurface surface_;
  EGLContext context_;
};

std::vector<EGLDisplay> displays() {
  std::vector<EGLDisplay> found;
  const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  const auto query_devices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  if (platform_display != nullptr) {
    found.push_back(platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    std::array<EGLDeviceEXT, 8> devices{};
    EGLint count = 0;
    if (query_devices != nullptr &&
        query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE) {
      for (EGLint i = 0; i < count; ++i)
        found.push_back(platform_display(EGL_PLATFORM_DEVICE_EXT,
                                         devices[static_cast<std::size_t>(i)], nullptr));
    }
  }
  found.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return found;
}

std::unique_ptr<EglContext> EglContext::on(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return {};
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return {};
  const std::array<EGLint, 15> wanted{EGL_SURFACE_TYPE,
                                      EGL_PBUFFER_BIT,
                                      EGL_RENDERABLE_TYPE,
                                      EGL_OPENGL_BIT,
                                      EGL_RED_SIZE,
                                      8,
                                      EGL_GREEN_SIZE,
                                      8,
                                      EGL_BLUE_SIZE,
                                      8,
                                      EGL_DEPTH_SIZE,
                                      24,
                                      EGL_NONE,
                                      EGL_NONE,
                                      EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1)
    return {};
  const std::array<EGLint, 5> size{EGL_WIDTH, 16, EGL_HEIGHT, 16, EGL_NONE};
  const EGLSurface surface = eglCreatePbufferSurface(display, config, size.data());
  if (surface == EGL_NO_SURFACE) return {};
  // No attributes: the compatibility profile, which Debian's OpenSceneGraph needs.
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, nullptr);
  if (context == EGL_NO_CONTEXT) {
    eglDestroySurface(display, surface);
    return {};
  }
  return std::unique_ptr<EglContext>(new EglContext(display, surface, context));
}

Result<std::unique_ptr<EglContext>> EglContext::create() {
  const EGLenum api = eglQueryAPI();
  std::unique_ptr<EglContext> context;
  for (const EGLDisplay display : displays()) {
    context = on(display);
    if (context) break;
  }
  eglBindAPI(api);
  if (context) return context;
  return error(ErrorCode::unsupported,
               "cannot draw a picture, because this system offers no OpenGL through EGL",
               "Install the packages libegl1 and libgl1-mesa-dri.");
}

/// Element i of the van der Corput sequence to a base: evenly filling 0..1.
double radical_inverse(int i, int base) {
  double result = 0, share = 1.0 / base;
  for (; i > 0; i /= base, share /= base) result += share * (i % base);
  return result;
}

/// Passes of one light, where lights take turns: few, or shadows show as steps.
int passes_of_light(int wanted, int lights) {
  constexpr int kLeast = 5;
  return std::max(kLeast, (wanted + lights - 1) / lights);
}

/// `lights` take turns.
Pass pass_number(int i, int count, int lights, Quality quality) {
  // Every coordinate has its own low-discrepancy sequence, so that any number of first passes
  // samples pixel, lamp and sky evenly; a picture can be shown before all are drawn.
  const int own = i / lights;  // among those of its light
  const auto halton = [&](int base) { return radical_inverse(own + 1, base); };
  const auto turn = [&](int at, double rate) {
    return 2 * std::numbers::pi * std::fmod(at * rate, 1.0);
  };
  const double half_step = 0.25 / count;  // of the samples, of which a pass has two
  Pass pass;
  pass.number = i;
  pass.count = count;
  pass.shift_x = halton(2) - 0.5;
  pass.shift_y = halton(3) - 0.5;
  // Few passes need a smaller lamp, or its shadows would show as steps.
  const double lamp_size = quality == Quality::quality ? 1.0 : 0.6;
  for (int k = 0; k < 2; ++k) {
    Pass::Sample& sample = pass.samples[static_cast<std::size_t>(k)];
    const int at = 2 * own + k, of_all = 2 * i + k;
    const double lamp_radius = lamp_size * std::sqrt(radical_inverse(at, 2) + lights * half_step);
    const double lamp_angle = turn(at, 0.6180339887498949);  // golden section
    sample.lamp = {lamp_radius * std::cos(lamp_angle), lamp_radius * std::sin(lamp_angle)};
    sample.glass_shadow = radical_inverse(at + 1, 5);
    if (quality != Quality::quality) continue;
    // Uniform over the hemisphere: equal steps in height.
    const double z = std::max(radical_inverse(of_all, 3) + half_step, 0.03);
    const double angle = turn(of_all, 0.7548776662466927);  // inverse of the plastic number
    const double r = std::sqrt(1 - std::min(z * z, 1.0));
    sample.sky = Vec3{r * std::cos(angle), r * std::sin(angle), std::min(z, 1.0)};
  }
  return pass;
}

/// Interleaved gradient noise as in the shaders, -0.5 .. 0.5.
float gradient_noise(std::size_t x, std::size_t y) {
  const double a = 0.06711056 * static_cast<double>(x) + 0.00583715 * static_cast<double>(y);
  const double b = 52.9829189 * (a - std::floor(a));
  return static_cast<float>(b - std::floor(b) - 0.5);
}

float linear(float srgb) {
  const float c = std::clamp(srgb, 0.0F, 1.0F);
  return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
}

/// From light times opacity to sRGB and opacity.
class Developer {
 public:
  explicit Developer(const render::Look& look) {
    const bool is_drawing = look.style == Style::wireframe || look.style == Style::hidden_line;
    is_drawing_ = is_drawing;
    if (look.background == Background::transparent) ground_ = Ground::none;
    else if (look.background == Background::plain ||
             (look.background == Background::automatic && is_drawing))
      ground_ = Ground::plain;
    if (look.background == Background::plain) {
      const Colour& c = look.background_colour;
      paper_ = {c.r, c.g, c.b};
      if (!is_drawing_)
        for (float& x : paper_) x = linear(x);
    }
  }
  /// `dither` in -0.5 .. 0.5 steps of the result hides the bands of slow gradients.
  void operator()(const float* rgba, float share, float dither, std::uint8_t* out) const {
    std::array<float, 3> c{rgba[0] * share, rgba[1] * share, rgba[2] * share};
    const float opacity =
        ground_ == Ground::studio ? 1.0F : std::clamp(rgba[3] * share, 0.0F, 1.0F);
    if (opacity > 0 && opacity < 1)
      for (float& x : c) x /= opacity;
    if (!is_drawing_) tone(c);
    if (ground_ == Ground::plain)
      for (std::size_t i = 0; i < 3; ++i) c[i] = c[i] * opacity + paper_[i] * (1 - opacity);
    // One flat colour has no bands to hide.
    if (is_drawing_ || (ground_ != Ground::studio && opacity <= 0)) dither = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const float x = std::clamp(c[i], 0.0F, 1.0F);
      const float shown =
          is_drawing_
              ? 255 * x
              : table()[static_cast<std::size_t>(x * static_cast<float>(kSteps - 1) + 0.5F)];
      out[i] = static_cast<std::uint8_t>(std::clamp(shown + dither + 0.5F, 0.0F, 255.0F));
    }
    out[3] = ground_ == Ground::none ? static_cast<std::uint8_t>(255 * opacity + 0.5F) : 255;
  }

 private:
  enum class Ground { studio, plain, none };
  static constexpr std::size_t kSteps = 16384;
  /// Shoulder of the Khronos PBR Neutral tone mapper, as in the shaders.
  static void tone(std::array<float, 3>& c) {
    const float peak = std::max({c[0], c[1], c[2]});
    if (peak <= 0.76F) return;
    const float squeezed = 1.0F - 0.24F * 0.24F / (peak + 0.24F - 0.76F);
    const float grey = 1.0F - 1.0F / (0.15F * (peak - squeezed) + 1.0F);
    for (float& x : c) x = x * (squeezed / peak) * (1 - grey) + squeezed * grey;
  }
  /// Linear 0..1 to sRGB 0..255.
  static const std::vector<float>& table() {
    static const std::vector<float> values = [] {
      std::vector<float> t(kSteps);
      for (std::size_t i = 0; i < kSteps; ++i) {
        const double c = static_cast<double>(i) / static_cast<double>(kSteps - 1);
        const double s = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
        t[i] = static_cast<float>(255 * s);
      }
      return t;
    }();
    return values;
  }
  bool is_drawing_ = false;  // such pictures come encoded from the shaders
  Ground ground_ = Ground::studio;
  std::array<float, 3> paper_{1, 1, 1};
};

}  // namespace

struct OffscreenRenderer::Impl {
  Impl(std::unique_ptr<EglContext> c, Quality q, int w, int h)
      : context(std::move(c)),
        quality(q),
        width(w),
        height(h),
        scene(std::make_unique<SceneView>(q, Target::memory)) {
    scene->resize(w, h);
    sum.resize(4 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    const EglContext::Scope current(*context);
    if (const auto* text = reinterpret_cast<const char*>(glGetString(GL_RENDERER))) name = text;
  }
  ~Impl() {
    const EglContext::Scope current(*context);
    scene->release();
    scene.reset();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  [[nodiscard]] render::Image developed(float share) const {
    const Developer develop(scene->look());
    render::Image image;
    image.width = width;
    image.height = height;
    image.rgba.resize(sum.size());
    const std::size_t row = 4 * static_cast<std::size_t>(width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
      const std::size_t from = (static_cast<std::size_t>(height) - 1 - y) * row;
      for (std::size_t x = 0; x < row; x += 4)
        develop(&sum[from + x], share, gradient_noise(x / 4, y), &image.rgba[y * row + x]);
    }
    return image;
  }

  [[nodiscard]] int lights() const { return std::max(1, static_cast<int>(scene->light_count())); }
  void add_pixels() {
    const auto& from = scene->pixels();
    // A glint brighter than this would stay visible as a dot in the mean.
    const float brightest = 8.0F * static_cast<float>(lights());
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += std::clamp(from[i], 0.0F, brightest);
  }

  std::unique_ptr<EglContext> context;
  Quality quality;
  int width, height, done = 0;
  int wanted = quality == Quality::quality ? kQualityPasses : kFastPasses;
  std::unique_ptr<SceneView> scene;
  std::vector<float> sum;  // of the passes, linear RGBA, rows from bottom to top
  std::string name;
};

OffscreenRenderer::OffscreenRenderer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
OffscreenRenderer::OffscreenRenderer(OffscreenRenderer&&) noexcept = default;
OffscreenRenderer& OffscreenRenderer::operator=(OffscreenRenderer&&) noexcept = default;
OffscreenRenderer::~OffscreenRenderer() = default;

Result<void> check_size(int width, int height) {
  if (std::min(width, height) >= kMinSize && std::max(width, height) <= kMaxSize) return {};
  return error(ErrorCode::invalid_argument,
               "a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels cannot be drawn",
               "Give a width and a height from 16 to 8192 pixels.");
}

Result<OffscreenRenderer> OffscreenRenderer::create(int width, int height, Quality quality) {
  RMP_TRY(check_size(width, height));
  RMP_TRY_ASSIGN(auto context, EglContext::create());
  return OffscreenRenderer(std::make_unique<Impl>(std::move(context), quality, width, height));
}

SceneView& OffscreenRenderer::scene() { return *impl_->scene; }

void OffscreenRenderer::resize(int width, int height) {
  impl_->width = std::clamp(width, kMinSize, kMaxSize);
  impl_->height = std::clamp(height, kMinSize, kMaxSize);
  impl_->scene->resize(impl_->width, impl_->height);
  impl_->sum.resize(4 * static_cast<std::size_t>(impl_->width) *
                    static_cast<std::size_t>(impl_->height));
  restart();
}

void OffscreenRenderer::restart() {
  impl_->done = 0;
  std::fill(impl_->sum.begin(), impl_->sum.end(), 0.0F);
}

int OffscreenRenderer::passes_done() const { return impl_->done; }
int OffscreenRenderer::passes_wanted() const {
  const int n = impl_->lights();
  return n == 1 ? impl_->wanted : n * passes_of_light(impl_->wanted, n);
}
void OffscreenRenderer::set_passes(int count) {
  impl_->wanted = std::clamp(count, 1, 1024);
  restart();
}

bool OffscreenRenderer::step() {
  if (impl_->done >= passes_wanted()) return false;
  const EglContext::Scope current(*impl_->context);
  impl_->scene->draw(pass_number(impl_->done, passes_wanted(), impl_->lights(), impl_->quality));
  impl_->add_pixels();
  ++impl_->done;
  return true;
}

render::Image OffscreenRenderer::picture() const {
  render::Image image = impl_->developed(1.0F / static_cast<float>(std::max(impl_->done, 1)));
  const OrbitCamera& camera = impl_->scene->camera();
  const double d = camera.distance();
  const Matrix4 view = camera.view(), projection = camera.projection(0.01 * d, 100 * d);
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t k = 0; k < 4; ++k)
        image.clip_T_world[4 * r + c] += projection[4 * r + k] * view[4 * k + c];
  return image;
}

Image OffscreenRenderer::image() const {
  const render::Image from = impl_->developed(1.0F / static_cast<float>(std::max(impl_->done, 1)));
  Image image{from.width, from.height, {}};
  image.rgb.reserve(from.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < from.rgba.size(); i += 4)
    image.rgb.insert(image.rgb.end(), from.rgba.begin() + static_cast<std::ptrdiff_t>(i),
                     from.rgba.begin() + static_cast<std::ptrdiff_t>(i + 3));
  return image;
}

const std::string& OffscreenRenderer::renderer_name() const { return impl_->name; }

Result<Image> render_image(const Frame& frame, int width, int height, Quality quality) {
  RMP_TRY_ASSIGN(auto renderer, OffscreenRenderer::create(width, height, quality));
  renderer.scene().sync(frame);
  while (renderer.step()) {
  }
  return renderer.image();
}

Result<void> render_png(const Frame& frame, int width, int height, Quality quality,
                        const std::string& path) {
  RMP_TRY_ASSIGN(const Image image, render_image(frame, width, height, quality));
  return write_png(image, path);
}

}  // namespace robomosp::viewer
