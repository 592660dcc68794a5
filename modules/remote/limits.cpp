// SPDX-License-Identifier: Apache-2.0
#include "remote/limits.h"

#include <cmath>
#include <string>
#include <vector>

#include "ioci/core/commands.h"

namespace robomosp::remote {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kYear = 365 * 86'400;

constexpr LimitSpec kSpecs[] = {
    {"line", &Limits::line, 1024, 256 * kMiB, "bytes", "A message, with all that it holds."},
    {"batch", &Limits::batch, 1, 1'000'000, "requests", "Requests of one batch."},
    {"answer", &Limits::answer, 1024, 1024 * kMiB, "bytes",
     "An answer; a longer one is replaced by an error."},
    {"waiting", &Limits::waiting, 1, 1'000'000, "requests",
     "Requests of a client that wait their turn; no more are read until some are answered."},
    {"waiting_bytes", &Limits::waiting_bytes, 1024, 1024 * kMiB, "bytes",
     "What these requests take; no more are read until some are answered."},
    {"unread", &Limits::unread, 1024, 1024 * kMiB, "bytes",
     "Answers and events that a client has not read; until it reads, its requests wait, its "
     "changes are merged and its oldest messages left out."},
    {"rate", &Limits::rate, 1, 10'000'000, "1/s",
     "Requests of a client, with a reserve of one second; one beyond is refused.", true},
    {"jobs", &Limits::jobs, 1, 10'000, "jobs", "Jobs of a client that run or wait.", true},
    {"waits", &Limits::waits, 1, 1'000, "requests",
     "job.wait and server.wait of a client that wait."},
    {"subscriptions", &Limits::subscriptions, 1, 1'000, "subscriptions", "Those of a client."},
    {"seconds", &Limits::seconds, 1, kYear, "s",
     "What one command may take; then it is cancelled. Jobs are not meant.", true},
    {"clients", &Limits::clients, 1, 100'000, "clients", "Connections at a time."},
    {"clients_of_address", &Limits::clients_of_address, 1, 100'000, "clients",
     "Connections from one address at a time."},
    {"hello_seconds", &Limits::hello_seconds, 1, 3600, "s",
     "From the connection to the end of its first line."},
    {"line_seconds", &Limits::line_seconds, 1, kYear, "s", "From the begin of a line to its end."},
    {"unread_seconds", &Limits::unread_seconds, 1, kYear, "s",
     "How long a client may read nothing of what waits for it."},
    {"idle_seconds", &Limits::idle_seconds, 1, kYear, "s",
     "How long a client may send nothing and be sent nothing.", true},
    {"scripts", &Limits::scripts, 1, 1'000, "clients",
     "Clients that have run a script and are there, each with a process of up to 256 MiB."},
    {"threads", &Limits::threads, 2, 1'024, "threads", "Commands that run at a time; others wait."},
    {"memory", &Limits::memory, 64, 1 << 24, "MiB",
     "Of the program. Beyond it clients may only read, and the command of theirs that has run "
     "longest is cancelled, then their jobs.",
     true},
};

}  // namespace

std::span<const LimitSpec> limit_specs() { return kSpecs; }

Result<Limits> limits_from(const Map& given) {
  Limits out;
  for (const auto& [name, value] : given) {
    const LimitSpec* spec = nullptr;
    for (const LimitSpec& s : kSpecs)
      if (s.name == name) spec = &s;
    if (!spec) {
      std::vector<std::string> known;
      for (const LimitSpec& s : kSpecs) known.emplace_back(s.name);
      return ioci::unknown_name("limit", name, known);
    }
    const double number = value.number();
    const bool is_none = value.is_number() && number == 0 && spec->can_be_none;
    const bool is_within = value.is_number() && number >= static_cast<double>(spec->least) &&
                           number <= static_cast<double>(spec->most) &&
                           number == std::floor(number);
    if (!is_none && !is_within)
      return error(ErrorCode::invalid_argument,
                   "the limit " + name + " is a whole number from " + std::to_string(spec->least) +
                       " to " + std::to_string(spec->most) + " (" + std::string(spec->unit) + ")" +
                       (spec->can_be_none ? ", or 0 for none" : ""),
                   "", "limits");
    out.*spec->value = static_cast<std::uint64_t>(number);
  }
  return out;
}

Map limits_value(const Limits& limits) {
  Map out;
  for (const LimitSpec& s : kSpecs)
    out.set(std::string(s.name), static_cast<std::int64_t>(limits.*s.value));
  return out;
}

}  // namespace robomosp::remote
