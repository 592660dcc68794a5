// SPDX-License-Identifier: Apache-2.0
// Lua as the scripting language of clients' sessions (layer: application, lua).
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "ioci/client/scripts.h"
#include "ioci/core/lua_plugins.h"
#include "kernel/plugin_loader.h"
#include "lua/lua_state.h"

namespace robomosp::lua {
namespace {

class ClientScripts final : public ioci::Scripts {
 public:
  ClientScripts(ioci::Application& app, ioci::Session& session,
                std::span<const std::filesystem::path> plugin_path, std::function<void()> wake)
      : state_(app, session, options()), waking_(state_.wake_to_serve(std::move(wake))) {
    state_.load_plugins(
        ioci::lua_plugins(PluginLoader::search_path({plugin_path.begin(), plugin_path.end()})));
  }
  Result<List> run_file(const std::filesystem::path& file,
                        std::span<const std::string> arguments) override {
    return state_.run_file_values(file, arguments);
  }
  Result<std::string> evaluate(std::string_view input, List* shown) override {
    return state_.eval(input, shown);
  }
  bool is_incomplete(std::string_view input) const override { return state_.is_incomplete(input); }
  ioci::ScriptCompletion complete(std::string_view input, std::size_t cursor) const override {
    Completion found = state_.complete(input, cursor);
    return {found.start, std::move(found.words)};
  }
  std::string traceback() const override { return state_.traceback(); }
  void print_to(std::function<void(std::string_view)> print) override { print_ = std::move(print); }
  void serve() override { state_.serve(); }

 private:
  LuaOptions options() {
    LuaOptions o;
    o.print = [this](std::string_view text) {
      if (print_) print_(text);
      else (void)std::fwrite(text.data(), 1, text.size(), stdout);
    };
    return o;
  }

  std::function<void(std::string_view)> print_;
  LuaState state_;
  std::shared_ptr<void> waking_;  ///< while it lives, calls wake the client
};

std::unique_ptr<ioci::Scripts> make_client_scripts(
    ioci::Application& app, ioci::Session& session,
    std::span<const std::filesystem::path> plugin_path, std::function<void()> wake) {
  return std::make_unique<ClientScripts>(app, session, plugin_path, std::move(wake));
}

const ioci::ScriptLanguage kClientLanguage(&make_client_scripts);

}  // namespace
}  // namespace robomosp::lua
