// SPDX-License-Identifier: Apache-2.0
#include "lua/sandbox/child_host.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

#include <unistd.h>

#include "kernel/text.h"

namespace robomosp::lua {
namespace {

constexpr int kDescriptor = 0;
/// What is printed is sent when it is this long, and before every request [bytes].
constexpr std::size_t kFlushAt = 16384;

// Set by a handler of signals, which carries no context.
volatile std::sig_atomic_t g_stop = 0;

void on_stop(int) { g_stop = 1; }

void read_exactly(char* to, std::size_t count) {
  while (count > 0) {
    const ssize_t n = ::read(kDescriptor, to, count);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(0);  // nobody is left who would read an answer
    to += n;
    count -= static_cast<std::size_t>(n);
  }
}

std::string text_at(const Value& v) { return v.as_string() ? *v.as_string() : std::string(); }

/// Entry `i` of a list; nil when there is none.
const Value& entry_of(const Value& list, std::size_t i) {
  static const Value none;
  const List* l = list.as_list();
  return l && i < l->size() ? (*l)[i] : none;
}

std::vector<ParamSpec> params_from(const Value& list) {
  std::vector<ParamSpec> out;
  for (const Value& row : list.as_list() ? *list.as_list() : List{}) {
    ParamSpec p;
    p.name = text_at(entry_of(row, 0));
    p.type = text_at(entry_of(row, 1));
    p.unit = text_at(entry_of(row, 2));
    out.push_back(std::move(p));
  }
  return out;
}

}  // namespace

bool Link::send(wire::Kind kind, const Value& value) {
  const auto frame = wire::frame(kind, value, wire::kLongestRequest);
  if (!frame) return false;
  std::string_view rest = *frame;
  while (!rest.empty()) {
    const ssize_t n = ::write(kDescriptor, rest.data(), rest.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) ::_exit(0);
    rest.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

wire::Frame Link::receive() {
  std::array<char, wire::kHeader> header{};
  read_exactly(header.data(), header.size());
  std::uint32_t length = 0;
  std::memcpy(&length, header.data(), sizeof length);
  std::string bytes;
  try {
    bytes.resize(length);
  } catch (const std::bad_alloc&) {
    std::array<char, 4096> rest;
    for (std::size_t left = length; left > 0;) {
      const std::size_t n = std::min(left, rest.size());
      read_exactly(rest.data(), n);
      left -= n;
    }
    throw;
  }
  read_exactly(bytes.data(), bytes.size());
  auto value = wire::read_value(bytes);
  if (!value) ::_exit(1);
  return {static_cast<wire::Kind>(header.back()), std::move(*value)};
}

void catch_stop() {
  struct sigaction action {};
  action.sa_handler = on_stop;  // no SA_RESTART is needed: reads and writes go on by themselves
  ::sigaction(SIGINT, &action, nullptr);
}

ChildHost::ChildHost(Link& link, const Map& setup) : link_(link) {
  if (const Value* n = setup.find("output"); n && n->as_int())
    most_output_ = static_cast<std::size_t>(*n->as_int());
  if (const Value* nouns = setup.find("nouns"); nouns && nouns->as_list())
    for (const Value& noun : *nouns->as_list()) nouns_.insert(text_at(noun));
  if (const Value* commands = setup.find("commands")) add_commands(*commands);
}

void ChildHost::add_commands(const Value& list) const {
  for (const Value& row : list.as_list() ? *list.as_list() : List{}) {
    auto spec = std::make_unique<ioci::CommandSpec>();
    spec->name = text_at(entry_of(row, 0));
    spec->summary = text_at(entry_of(row, 1));
    spec->plugin = text_at(entry_of(row, 2));
    spec->params = params_from(entry_of(row, 3));
    spec->returns.type = text_at(entry_of(row, 4));
    spec->returns.unit = text_at(entry_of(row, 5));
    spec->returns.fields = params_from(entry_of(row, 6));
    std::string name = spec->name;
    commands_.emplace(std::move(name), std::move(spec));
  }
}

Error ChildHost::unknown(std::string_view name) const {
  const auto answer = ask(wire::Ask::unknown, name, {});
  return answer.ok() ? error(ErrorCode::unknown_name, "there is no command " + text::quote(name))
                     : answer.error();
}

Result<Value> ChildHost::ask(wire::Ask what, std::string_view name, Value args) const {
  flush();
  Map request{{"ask", static_cast<std::int64_t>(what)}, {"name", name}};
  request.append("args", std::move(args));
  if (!link_.send(wire::Kind::request, std::move(request)))
    return error(ErrorCode::invalid_argument,
                 "what is given to " + std::string(name) + " is more than " +
                     std::to_string(wire::kLongestRequest >> 20) + " MiB or " +
                     std::to_string(wire::kMostValues) + " values",
                 "Pass it in parts, or pass numbers as an array.");
  wire::Frame frame = link_.receive();
  Map* m = frame.kind == wire::Kind::answer ? frame.value.as_map() : nullptr;
  if (!m) ::_exit(1);
  if (const Value* commands = m->find("commands")) {
    add_commands(*commands);
    ++revision_;
  }
  if (m->find("stop")) was_told_to_stop_ = true;
  if (const Value* failed = m->find("error")) return wire::error_from(*failed);
  Value* value = m->find("value");
  return value ? std::move(*value) : Value();
}

Result<Value> ChildHost::dispatch(const ioci::CommandSpec& spec, const Map& args) {
  return ask(wire::Ask::dispatch, spec.name, args);
}

Result<Handle> ChildHost::dispatch_async(const ioci::CommandSpec& spec, Map args) {
  RMP_TRY_ASSIGN(const Value job, ask(wire::Ask::start, spec.name, std::move(args)));
  if (!job.as_handle()) return error(ErrorCode::internal, "the job has no handle");
  return *job.as_handle();
}

Result<Value> ChildHost::dispatch_classic(std::string_view line) {
  return ask(wire::Ask::classic, "ioci.classic", line);
}

Result<void> ChildHost::transaction(const std::string& label,
                                    const std::function<Result<void>()>& body) {
  if (auto begun = ask(wire::Ask::begin, label, {}); !begun.ok()) return std::move(begun).error();
  const auto done = body();
  auto ended = ask(wire::Ask::end, label, done.ok() ? Value() : wire::error_value(done.error()));
  if (!done.ok()) return done.error();
  if (!ended.ok()) return std::move(ended).error();
  return {};
}

std::optional<std::string> ChildHost::name_of(const Handle& h) const {
  const auto name = ask(wire::Ask::name_of, h.kind, h);
  if (!name.ok() || !name->as_string()) return std::nullopt;
  return *name->as_string();
}

std::string ChildHost::describe(const Handle& h) const {
  const auto text = ask(wire::Ask::describe, h.kind, h);
  return text.ok() && text->as_string() ? *text->as_string()
                                        : h.kind + "#" + std::to_string(h.number);
}

bool ChildHost::interrupted() const { return was_told_to_stop_ || g_stop != 0; }

void ChildHost::clear_interrupt() {
  was_told_to_stop_ = false;
  g_stop = 0;
}

Result<void> ChildHost::may(Effect effect, std::string_view what) const {
  return error(ErrorCode::permission, "an untrusted script may not call " + std::string(what) +
                                          ", which " + std::string(phrase(effect)));
}

void ChildHost::warn(std::string_view, const std::string& sentence) {
  print("warning: " + sentence + "\n");
}

void ChildHost::begin() { printed_ = 0; }

Result<void> ChildHost::may_print(std::size_t bytes) {
  if (bytes <= most_output_ - printed_) return {};
  return error(ErrorCode::script_failed,
               "the script prints more than the " + std::to_string(most_output_ >> 10) +
                   " KiB that one call may",
               "Print less, or return the result.");
}

void ChildHost::print(std::string_view text) {
  text = text.substr(0, most_output_ - printed_);
  waiting_ += text;
  printed_ += text.size();
  if (waiting_.size() >= kFlushAt) flush();
}

void ChildHost::flush() const {
  if (waiting_.empty()) return;
  for (std::string_view rest = waiting_; !rest.empty();) {
    const std::string_view piece = rest.substr(0, wire::kLongestRequest / 2);
    (void)link_.send(wire::Kind::print, piece);
    rest.remove_prefix(piece.size());
  }
  waiting_.clear();
}

}  // namespace robomosp::lua
