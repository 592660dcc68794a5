// SPDX-License-Identifier: Apache-2.0
#include "remote/lua_thread.h"

#include <utility>

#include "lua/lua_state.h"
#include "remote/lua_child.h"
#include "remote/rpc.h"

namespace robomosp::remote {
namespace {

/// What a script may print at a time [bytes].
constexpr std::size_t kLongestOutput = std::size_t{8} << 20;

}  // namespace

LuaThread::~LuaThread() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Result<Map> LuaThread::eval(const std::string& code) {
  std::unique_lock lock(mutex_);
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  code_ = code;
  changed_.notify_all();
  changed_.wait(lock, [this] { return result_.has_value(); });
  return *std::exchange(result_, std::nullopt);
}

std::optional<std::string> LuaThread::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return code_ || is_called_ || is_ending_; });
  is_called_ = false;
  return std::exchange(code_, std::nullopt);
}

void LuaThread::done(Result<Map> result) {
  {
    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
  }
  changed_.notify_all();
}

void LuaThread::work() {
  if (is_trusted_) work_in_program();
  else work_in_process();
}

void LuaThread::work_in_program() {
  std::string printed;
  lua::LuaOptions options;
  options.input_name = session_.name();
  options.print = [&printed](std::string_view text) {
    if (printed.size() + text.size() <= kLongestOutput) printed += text;
    else if (!printed.ends_with("(more was printed)\n")) printed += "\n(more was printed)\n";
  };
  lua::LuaState lua(app_, session_, std::move(options));
  const auto waker = lua.wake_to_serve([this] {
    {
      const std::lock_guard lock(mutex_);
      is_called_ = true;
    }
    changed_.notify_all();
  });
  for (;;) {
    const auto code = next();
    if (!code) {
      const std::lock_guard lock(mutex_);
      if (is_ending_) return;
    }
    lua.serve();
    if (!code) continue;
    printed.clear();
    auto values = lua.eval_values(*code);
    if (values.ok()) done(script_answer(std::move(*values), std::exchange(printed, {})));
    else done(std::move(values).error());
  }
}

void LuaThread::work_in_process() {
  // The process ends with the thread that started it.
  LuaChild child(app_, {.input_name = session_.name()});
  for (;;) {
    std::string code;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return code_ || is_ending_; });
      if (is_ending_) return;
      code = *std::exchange(code_, std::nullopt);
    }
    done(child.eval(code, session_));
  }
}

}  // namespace robomosp::remote
