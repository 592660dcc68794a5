// SPDX-License-Identifier: Apache-2.0
// The program robomosp-lua MEMORY [--without-seccomp]: runs scripts of strangers for the program
// that started it, which is at the other end of descriptor 0 (remote/lua_child.h).
#include <charconv>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <unistd.h>

#include "lua/lua_state.h"
#include "lua/sandbox/child_host.h"
#include "lua/sandbox/lock_down.h"
#include "lua/sandbox/wire.h"

namespace robomosp::lua {
namespace {

/// Of the memory of the process, what is not for values of scripts: the program, its stack, and
/// messages on their way [bytes].
constexpr std::uint64_t kOwnMemory = std::uint64_t{96} << 20;
static_assert(kOwnMemory < kLeastMemory);

/// What opens files or takes memory when it is used first is used before the doors are closed.
void warm_up() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  (void)::localtime_r(&now, &local);
  try {
    throw std::runtime_error("once");
  } catch (const std::exception&) {  // NOLINT: the unwinder reads its tables now
  }
}

const std::string* text_under(const Map& m, std::string_view key) {
  const Value* v = m.find(key);
  return v ? v->as_string() : nullptr;
}

/// Runs the text of one call.
Result<List> run(LuaState& lua, ChildHost& host, const Map& call) {
  host.begin();
  const std::string* code = text_under(call, "code");
  const std::string* file = text_under(call, "file");
  if (!code) return error(ErrorCode::internal, "a call has no text");
  if (!file) return lua.eval_values(*code);
  std::vector<std::string> args;
  if (const Value* given = call.find("args"); given && given->as_list())
    for (const Value& a : *given->as_list()) args.push_back(a.as_string() ? *a.as_string() : "");
  return lua.run_text_values(*code, *file, args);
}

Map answer_of(LuaState& lua, ChildHost& host, const Map& call) {
  Map out;
  try {
    auto values = run(lua, host, call);
    if (values.ok()) {
      out.set("values", std::move(*values));
    } else {
      out.set("error", wire::error_value(values.error()));
      if (!lua.traceback().empty()) out.set("trace", lua.traceback().substr(0, 65536));
    }
  } catch (const std::bad_alloc&) {
    out = {};
    out.set("error", wire::error_value(error(ErrorCode::script_failed, "there is not enough memory",
                                             "Process less data at once.")));
  }
  return out;
}

int serve(Link& link, const Locked& locked, std::uint64_t memory) {
  wire::Frame first = link.receive();
  const Map* setup = first.kind == wire::Kind::setup ? first.value.as_map() : nullptr;
  if (!setup) return 1;
  auto made = std::make_unique<ChildHost>(link, *setup);
  ChildHost& host = *made;
  LuaOptions options;
  if (const std::string* name = text_under(*setup, "name")) options.input_name = *name;
  options.memory_limit = static_cast<std::size_t>(memory - kOwnMemory);
  options.print = [&host](std::string_view text) { host.print(text); };
  // Never closed: at the end there is nothing to finalize.
  auto* lua = new LuaState(std::move(made), std::move(options));  // NOLINT
  first = {};
  if (!link.send(wire::Kind::ready,
                 Map{{"seccomp", locked.seccomp}, {"namespaces", locked.namespaces}}))
    return 1;
  for (;;) {
    wire::Frame frame;
    Map answer;
    try {
      frame = link.receive();
    } catch (const std::bad_alloc&) {
      answer.set("error", wire::error_value(error(ErrorCode::script_failed,
                                                  "there is not enough memory for the text")));
    }
    if (answer.empty()) {
      const Map* call = frame.kind == wire::Kind::eval ? frame.value.as_map() : nullptr;
      if (!call) return 1;
      answer = answer_of(*lua, host, *call);
    }
    host.flush();
    bool is_sent = false;
    try {
      const Value done(std::move(answer));
      is_sent = link.send(wire::Kind::done, done);
    } catch (const std::bad_alloc&) {  // NOLINT: for the copy of it; nothing was sent
    }
    if (!is_sent)
      (void)link.send(
          wire::Kind::done,
          Map{{"error",
               wire::error_value(error(
                   ErrorCode::script_failed,
                   "the results are more than " + std::to_string(wire::kLongestRequest >> 20) +
                       " MiB or " + std::to_string(wire::kMostValues) + " values",
                   "Return less, or numbers as an array."))}});
  }
}

}  // namespace
}  // namespace robomosp::lua

int main(int argc, char** argv) {
  using namespace robomosp;
  using namespace robomosp::lua;
  LockDown wanted;
  const std::string_view memory = argc > 1 ? argv[1] : "";
  const auto read = std::from_chars(memory.data(), memory.data() + memory.size(), wanted.memory);
  wanted.without_seccomp = argc == 3 && std::string_view(argv[2]) == "--without-seccomp";
  if (read.ec != std::errc() || read.ptr != memory.data() + memory.size() || argc > 3 ||
      wanted.memory < kLeastMemory || (argc == 3 && !wanted.without_seccomp)) {
    constexpr char kUsage[] = "usage: robomosp-lua MEMORY [--without-seccomp]\n";
    (void)!::write(STDERR_FILENO, kUsage, sizeof kUsage - 1);
    return 2;
  }
  warm_up();
  catch_stop();
  Link link;
  const auto locked = lock_down(wanted);
  if (!locked.ok()) {
    // Whoever still writes the setup would find the socket closed before it has read why.
    (void)link.receive();
    (void)link.send(wire::Kind::ready, Map{{"error", wire::error_value(locked.error())}});
    ::_exit(1);
  }
  try {
    ::_exit(serve(link, *locked, wanted.memory));
  } catch (...) {  // NOLINT: whatever it was, the other end sees that it ended
    ::_exit(1);
  }
}
