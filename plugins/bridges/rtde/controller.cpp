// SPDX-License-Identifier: Apache-2.0
#include "controller.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <thread>

namespace robomosp::bridges::rtde {
namespace {

using namespace std::chrono_literals;
constexpr auto kAnswerTime = 5s;  ///< for an answer
constexpr auto kSilentTime = 2s;  ///< without data, then it is not there any more
constexpr int kFirstPause = 250, kLongestPause = 10000;  // [ms]

}  // namespace

void Controller::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void Controller::run() {
  const std::string where = wish_.host + ":" + std::to_string(wish_.port);
  int pause = kFirstPause;
  while (!*stop_) {
    bool worked = false;
    const std::string why = session(worked);
    if (fd_ >= 0 && worked) (void)send(package(Package::pause));
    close();
    if (*stop_) return;
    if (worked) log_.say("The controller at " + where + " was lost: " + why + ". Retrying.");
    else log_.often(why, "The controller at " + where + ": " + why + ". Retrying.");
    if (worked) pause = kFirstPause;
    for (int passed = 0; passed < pause && !*stop_; passed += 50) std::this_thread::sleep_for(50ms);
    pause = std::min(2 * pause, kLongestPause);
  }
}

std::string Controller::connect() {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int failed =
          ::getaddrinfo(wish_.host.c_str(), std::to_string(wish_.port).c_str(), &hints, &found))
    return std::string("its address is unknown: ") + ::gai_strerror(failed);
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> all(found, ::freeaddrinfo);
  std::string why = "it has no address";
  for (const addrinfo* a = found; a && fd_ < 0; a = a->ai_next) {
    fd_ = ::socket(a->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0) continue;
    int failed = ::connect(fd_, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (failed == EINPROGRESS) {
      failed = ETIMEDOUT;
      const auto until = Clock::now() + kAnswerTime;
      while (!*stop_ && Clock::now() < until) {
        pollfd ready{fd_, POLLOUT, 0};
        if (::poll(&ready, 1, 50) <= 0) continue;
        socklen_t size = sizeof failed;
        ::getsockopt(fd_, SOL_SOCKET, SO_ERROR, &failed, &size);
        break;
      }
    }
    if (failed == 0) {
      const int on = 1;
      ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      return {};
    }
    why = std::string("it cannot be reached: ") + std::strerror(failed);
    close();
  }
  return why;
}

bool Controller::send(std::string_view bytes) {
  const auto until = Clock::now() + kAnswerTime;
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    if (Clock::now() > until) return false;
    pollfd ready{fd_, POLLOUT, 0};
    ::poll(&ready, 1, 50);
  }
  return true;
}

std::string Controller::receive(Clock::time_point until) {
  std::array<char, 16384> bytes;
  while (!*stop_) {
    const ssize_t got = ::recv(fd_, bytes.data(), bytes.size(), 0);
    if (got > 0) {
      reader_.add({bytes.data(), static_cast<std::size_t>(got)});
      return {};
    }
    if (got == 0) return "it closed the connection";
    if (errno != EAGAIN && errno != EINTR) return std::strerror(errno);
    if (Clock::now() > until) return "it sends no data";
    pollfd ready{fd_, POLLIN, 0};
    ::poll(&ready, 1, 50);
  }
  return "stopped";
}

void Controller::say_message(std::string_view content) {
  if (const auto text = text_message(content))
    log_.often("message", "Message of the controller: " + *text);
}

std::string Controller::answer(Package kind, std::string& content) {
  const auto until = Clock::now() + kAnswerTime;
  for (;;) {
    while (const auto found = reader_.next()) {
      if (found->kind == static_cast<std::uint8_t>(kind)) {
        content = found->content;
        return {};
      }
      if (found->kind == static_cast<std::uint8_t>(Package::text_message))
        say_message(found->content);
    }
    if (reader_.is_broken()) return "it does not speak RTDE";
    if (std::string why = receive(until); !why.empty()) return why;
  }
}

std::string Controller::negotiate(Recipe& found, std::vector<Type>& types) {
  std::string content;
  const auto ask = [&](const std::string& request, Package kind) -> std::string {
    return send(request) ? answer(kind, content) : "it closed the connection";
  };
  if (std::string why = ask(request_version(), Package::protocol_version); !why.empty()) return why;
  if (!accepted(content).value_or(false)) return "it does not speak version 2 of RTDE";
  if (std::string why = ask(package(Package::controller_version), Package::controller_version);
      !why.empty())
    return why;
  const auto version = controller_version(content);
  if (std::string why =
          ask(request_outputs(wish_.frequency, wish_.variables), Package::setup_outputs);
      !why.empty())
    return why;
  const auto recipe_given = recipe(content);
  if (!recipe_given || recipe_given->types.size() != wish_.variables.size())
    return "its reply to the requested variables is invalid";
  found = *recipe_given;
  for (std::size_t i = 0; i < found.types.size(); ++i) {
    const auto type = type_named(found.types[i]);
    if (!type)
      return found.types[i] == "NOT_FOUND"
                 ? "it has no variable \"" + wish_.variables[i] + "\""
                 : "the type of \"" + wish_.variables[i] + "\" is unknown";
    if (wish_.entries[i] != 0 && entries_of(*type) != wish_.entries[i])
      return "\"" + wish_.variables[i] + "\" has " + std::to_string(entries_of(*type)) +
             " entries, not " + std::to_string(wish_.entries[i]);
    types.push_back(*type);
  }
  if (std::string why = ask(package(Package::start), Package::start); !why.empty()) return why;
  if (!accepted(content).value_or(false)) return "it does not start sending";
  log_.say("The controller at " + wish_.host + ", version " + version.value_or("unknown") +
           ", sends its states.");
  return {};
}

std::string Controller::session(bool& worked) {
  reader_ = {};
  if (std::string why = connect(); !why.empty()) return why;
  Recipe with;
  std::vector<Type> types;
  if (std::string why = negotiate(with, types); !why.empty()) return why;
  auto silent = Clock::now() + kSilentTime;
  while (!*stop_) {
    while (const auto found = reader_.next()) {
      if (found->kind == static_cast<std::uint8_t>(Package::text_message))
        say_message(found->content);
      if (found->kind != static_cast<std::uint8_t>(Package::data)) continue;
      auto values = data(found->content, with.number, types);
      if (!values) {
        log_.often("data", "The length of a data package differs from its recipe.");
        continue;
      }
      worked = true;
      silent = Clock::now() + kSilentTime;
      on_state_(std::move(*values));
    }
    if (reader_.is_broken()) return "it sends data that are not RTDE packages";
    if (std::string why = receive(silent); !why.empty()) return why;
  }
  return {};
}

}  // namespace robomosp::bridges::rtde
