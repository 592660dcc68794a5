// SPDX-License-Identifier: Apache-2.0
#include "log.h"

#include <cstdio>

namespace robomosp::bridges {

void Log::say(const std::string& sentence) {
  std::string line;
  // What strangers sent may be part of it.
  for (const char c : sentence) line += (c >= 0 && c < ' ') || c == 127 ? '?' : c;
  std::fprintf(stderr, "%s\n", line.c_str());
}

void Log::often(const std::string& kind, const std::string& sentence) {
  constexpr std::chrono::seconds kPause{10};
  const auto now = std::chrono::steady_clock::now();
  std::uint64_t more = 0;
  {
    const std::lock_guard lock(mutex_);
    const auto [at, is_new] = kinds_.try_emplace(kind, Kind{now, 0});
    if (!is_new && now - at->second.said < kPause) {
      ++at->second.since;
      return;
    }
    more = at->second.since;
    at->second = {now, 0};
  }
  say(more == 0
          ? sentence
          : sentence + " (" + std::to_string(more) + " more of this kind since the last one.)");
}

}  // namespace robomosp::bridges
