// SPDX-License-Identifier: Apache-2.0
// What the subcommands of `robomosp` share: the program with its session and
// Lua, its notes, Ctrl-C (layer: application, shell only).
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "ioci/core/application.h"
#include "kernel/messages.h"
#include "kernel/value.h"
#include "lua/lua_state.h"
#include "remote/rpc.h"
#include "shell/voice.h"

#ifndef ROBOMOSP_VERSION
#define ROBOMOSP_VERSION "0"
#endif

namespace robomosp::shell {

// --- Ctrl-C ---

/// The first Ctrl-C asks the script to stop; the fourth without effect ends the program, for the
/// few C functions that cannot be asked. [signal handler]
void on_interrupt(int);
/// From here on Ctrl-C asks what this session runs to stop.
void catch_interrupts(ioci::Session&);
/// Four more until the program ends.
void count_interrupts_anew();

/// Notes of the commands that are typed here, such as that 90 was taken as radians: once each, and
/// of many at once the first few.
class Notes {
 public:
  /// Of what is posted by the thread that makes this.
  void take(const Message& m) {
    if (m.severity == Severity::info && std::this_thread::get_id() == thread_) add(m.code, m.text);
  }
  void add(std::string_view code, const std::string& text) {
    // Not shown: messages that only report what a command did, or that no command caused.
    constexpr std::string_view kQuiet[] = {"audit",         "history_forgets", "ik_choice",
                                           "kept_geometry", "plugin_hidden",   "recovery"};
    if (std::find(std::begin(kQuiet), std::end(kQuiet), code) == std::end(kQuiet)) add(text);
  }
  void add(const std::string& text) {
    if (!told_.insert(text).second) return;
    if (fresh_.size() < kMost) fresh_.push_back(text);
    else ++more_;
  }
  /// Those since the last time.
  [[nodiscard]] std::vector<std::string> fresh() {
    if (more_ > 0)
      fresh_.push_back(std::to_string(more_) + (more_ == 1 ? " more note" : " more notes") +
                       ": message.list() lists all messages.");
    more_ = 0;
    return std::exchange(fresh_, {});
  }

 private:
  static constexpr std::size_t kMost = 5;
  const std::thread::id thread_ = std::this_thread::get_id();
  // Of that thread:
  std::set<std::string> told_;
  std::vector<std::string> fresh_;
  std::size_t more_ = 0;
};

/// The application with its session and Lua, as every subcommand but the light ones needs it.
struct Program {
  std::unique_ptr<ioci::Application> app;
  std::unique_ptr<ioci::Session> session;
  std::unique_ptr<lua::LuaState> lua;
  remote::RpcServer* rpc = nullptr;               ///< takes what scripts print while it serves
  std::function<void(std::string_view)> printed;  ///< the same, where it is set
  std::uint64_t subscription = 0;
  std::unique_ptr<Notes> notes;  ///< of a console

  [[nodiscard]] NameOf names() const {
    return [this](const Handle& h) { return app->name_of(h).value_or(""); };
  }
  ~Program();
};

/// A descriptor that can be read while something is to be served.
class Wake {
 public:
  explicit Wake(lua::LuaState& lua)
      : waker_(lua.wake_to_serve([fd = fd_] {
          const std::uint64_t one = 1;
          (void)!::write(fd, &one, sizeof one);
        })) {}
  ~Wake() {
    waker_.reset();
    ::close(fd_);
  }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;
  [[nodiscard]] int fd() const { return fd_; }
  void rest() const {
    std::uint64_t count = 0;
    (void)!::read(fd_, &count, sizeof count);
  }

 private:
  const int fd_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::shared_ptr<void> waker_;
};

/// What journals of consoles say that read their input from a file or a pipe.
inline constexpr const char* kPiped = "robomosp, input from a file";

/// Whether a person types, on a terminal.
[[nodiscard]] bool is_interactive(const Settings&);

/// Makes the program of a subcommand, with a session of that name.
[[nodiscard]] Result<void> start(Program&, const Settings&, const Voice&, std::string session_name);

/// Files that follow edits are as the last edit left them when the program ends; Ctrl-C ends the
/// wait.
void settle(Program&);

/// One input; prints its result. Returns the exit code.
int evaluate(lua::LuaState&, const NameOf& names, const Voice&, const std::string& input);
int evaluate(Program&, const Voice&, const std::string& input);

}  // namespace robomosp::shell
