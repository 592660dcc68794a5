// SPDX-License-Identifier: Apache-2.0
#include "shell/scripts.h"

#include <algorithm>

#include "kernel/text.h"
#include "remote/lua_child.h"

namespace robomosp::shell {

namespace {

Result<Effects> effects_from(std::string_view words) {
  Effects out;
  for (const std::string_view part : text::split(words, ',')) {
    const std::string_view word = text::trim(part);
    std::vector<std::string> known;
    bool is_known = false;
    for (const Effect e : kAllEffects) {
      known.emplace_back(to_string(e));
      if (known.back() != word) continue;
      out = out | e;
      is_known = true;
    }
    if (!is_known)
      return error(ErrorCode::usage, "there is no effect " + text::quote(std::string(word)),
                   "Effects: " + text::enumerate(known) + ".", "--allow");
  }
  return out;
}

}  // namespace

int run_script(const Settings& s, const Voice& voice, const std::string& file,
               const std::vector<std::string>& args) {
  Program p;
  if (auto started = start(p, s, voice, "script"); !started.ok())
    return voice.fail(started.error());
  const auto done = p.lua->run_file(file, args);
  settle(p);
  if (const auto code = p.lua->exit_requested()) return *code;
  if (!done.ok()) return voice.fail(done.error(), p.lua->traceback());
  voice.result({}, {});
  return 0;
}

int run_sandboxed(const Settings& s, const Voice& voice, const std::string& file,
                  const std::vector<std::string>& args, const Sandbox& sandbox) {
  const auto allowed = effects_from(sandbox.allow);
  if (!allowed.ok()) return voice.fail(allowed.error());
  remote::LuaChildOptions options;
  if (!sandbox.limits.empty()) {
    const auto limits = remote::lua_limits(sandbox.limits);
    if (!limits.ok()) return voice.fail(limits.error());
    options.limits = *limits;
  }
  options.without_seccomp = sandbox.without_seccomp;
  options.print = [&s](std::string_view text) {
    // With --json standard output carries JSON only, and this is standard error.
    std::FILE* const to = s.json ? stderr : stdout;
    std::fwrite(text.data(), 1, text.size(), to);
    std::fflush(to);
  };
  Program p;
  if (auto started = start(p, s, voice, "script"); !started.ok())
    return voice.fail(started.error());
  for (const Effect e : Effects::all().without(*allowed).list()) p.session->deny(e);
  remote::LuaChild child(*p.app, std::move(options));
  const auto done = child.run_file(file, args, *p.session);
  settle(p);
  if (!done.ok()) return voice.fail(done.error(), child.traceback());
  voice.result({}, {});
  return 0;
}

int run_eval(const Settings& s, const Voice& voice, const std::string& code) {
  Program p;
  if (auto started = start(p, s, voice, "eval"); !started.ok()) return voice.fail(started.error());
  const int exit = evaluate(p, voice, code);
  settle(p);
  return exit;
}

std::vector<std::string> classic_lines(const std::vector<std::string>& arguments) {
  const bool all_lines = std::all_of(arguments.begin(), arguments.end(), [](const std::string& a) {
    return a.find(' ') != std::string::npos;
  });
  return all_lines ? arguments : std::vector<std::string>{text::join(arguments, " ")};
}

int run_classic(const Settings& s, const Voice& voice, const std::vector<std::string>& lines) {
  Program p;
  if (auto started = start(p, s, voice, "classic"); !started.ok())
    return voice.fail(started.error());
  for (const std::string& line : lines) {
    // Through Lua, so that the result is printed as the console prints it.
    const int status = evaluate(p, voice, "ioci.classic(" + text::quote(line) + ")");
    if (status != 0) return status;
  }
  return 0;
}

}  // namespace robomosp::shell
