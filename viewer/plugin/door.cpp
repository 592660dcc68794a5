// SPDX-License-Identifier: GPL-3.0-or-later
// Plugin render_osg: the door to the renderer. OpenSceneGraph is a heavy library that most runs
// never need, so this file names it nowhere: the first picture loads render_osg_engine.so from the
// folder above the plugins.
#include <dlfcn.h>

#include <cstring>
#include <memory>
#include <mutex>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/render.h>

namespace robomosp {
namespace {

constexpr const char* kEngine = "render_osg_engine.so";

/// Path of the engine, from the path of this very library.
std::string engine_path() {
  static const char here = 0;
  Dl_info info{};
  const std::string own = dladdr(&here, &info) != 0 && info.dli_fname ? info.dli_fname : "";
  const auto slash = own.rfind('/');
  return (slash == std::string::npos ? std::string() : own.substr(0, slash + 1)) + "../" + kEngine;
}

using Create = render::Renderer* (*)();

Result<std::unique_ptr<render::Renderer>> load_engine() {
  const std::string path = engine_path();
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!library) {
    const char* reason = dlerror();
    return error(ErrorCode::unsupported,
                 std::string("cannot draw a picture, because the drawing library cannot be "
                             "loaded (") +
                     (reason ? reason : "no reason given") + ")",
                 "Install the desktop package of this program.");
  }
  void* symbol = dlsym(library, "robomosp_render_osg_create");
  Create create = nullptr;
  std::memcpy(&create, &symbol, sizeof create);
  if (!create)
    return error(
        ErrorCode::unsupported,
        std::string("cannot draw a picture, because ") + kEngine + " is of another version",
        "Install the desktop package of this program again.");
  return std::unique_ptr<render::Renderer>(create());
}

class Door final : public render::Renderer {
 public:
  Result<render::Image> draw(const render::Scene& scene, const render::Options& options,
                             Progress& progress) const override {
    RMP_TRY_ASSIGN(const render::Renderer* engine, loaded());
    return engine->draw(scene, options, progress);
  }
  Result<std::string> png(const render::Image& image) const override {
    RMP_TRY_ASSIGN(const render::Renderer* engine, loaded());
    return engine->png(image);
  }

 private:
  Result<const render::Renderer*> loaded() const {
    const std::lock_guard lock(mutex_);
    if (!engine_) {
      RMP_TRY_ASSIGN(engine_, load_engine());
    }
    return engine_.get();
  }
  mutable std::mutex mutex_;
  mutable std::unique_ptr<render::Renderer> engine_;  // guarded by mutex_
};

}  // namespace
}  // namespace robomosp

RMP_PLUGIN("org.robomosp.render_osg", "1.0", "GPL-3.0-or-later",
           "Pictures by OpenSceneGraph and EGL, without a window.",
           RMP_PROVIDER_NO_PARAMS(robomosp::Door, "osg",
                                  "Shaded pictures and line drawings by OpenGL, in software or by "
                                  "a graphics card.",
                                  "offscreen,section,hidden_line"))
