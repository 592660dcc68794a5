// SPDX-License-Identifier: Apache-2.0
// Guard of renderers: pictures of the size that was asked for.
#include <memory>
#include <string>

#include <robomosp/sdk/render.h>

#include "kernel/interface_file.h"
#include "kernel/provider_guard.h"

namespace robomosp {
namespace {

using render::Image;
using render::Options;
using render::Renderer;
using render::Scene;

class GuardedRenderer final : public Renderer {
 public:
  GuardedRenderer(const ProviderInfo& info, Renderer* inner) : name_(info.name), inner_(inner) {}
  [[nodiscard]] const void* extension(const char* id) const override {
    return inner_->extension(id);
  }
  Result<Image> draw(const Scene& scene, const Options& options, Progress& told) const override {
    HeardProgress progress(told);
    RMP_TRY_ASSIGN(Image made,
                   asked(name_, [&] { return inner_->draw(scene, options, progress); }));
    const std::size_t pixels =
        static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
    if (made.width != options.width || made.height != options.height ||
        made.rgba.size() != 4 * pixels)
      return broken_answer(name_, "made a picture of another size");
    if (!all_finite(made.clip_T_world))
      return broken_answer(name_, "returned a projection that is not of numbers");
    return made;
  }
  Result<std::string> png(const Image& image) const override {
    auto made = asked(name_, [&] { return inner_->png(image); });
    if (made.ok() && !made->starts_with("\x89PNG\r\n\x1a\n"))
      return broken_answer(name_, "made bytes that are not a PNG file");
    return made;
  }

 private:
  std::string name_;
  std::unique_ptr<Renderer> inner_;
};

}  // namespace

RMP_INTERFACES(pictures, guarded_interface<Renderer, GuardedRenderer>("osg"));

}  // namespace robomosp
