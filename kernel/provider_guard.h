// SPDX-License-Identifier: Apache-2.0
// Guards: the registry wraps every provider in one, whatever its origin. A guard rejects requests
// that the provider's tags do not cover, names the provider in its exceptions, and checks its
// results before they are used (layer: core).
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <robomosp/sdk/progress.h>

#include "kernel/app_lock.h"
#include "kernel/registry.h"

namespace robomosp {

/// Wraps a created provider in the guard of its interface; takes ownership and returns the object
/// to use instead, of the same interface. Returns the provider itself if the interface has no
/// guard.
[[nodiscard]] void* guard_provider(const ProviderInfo& info, void* made);

/// The error for an unusable result; `what` the provider did.
[[nodiscard]] Error broken_answer(const std::string& provider, const std::string& what);
/// A provider's error made fit to show: of limited length, without control characters. An error
/// without a message or with an unknown code is reported as the provider's fault.
[[nodiscard]] Error heard(const std::string& provider, Error e);
/// The error for the exception that is being handled.
[[nodiscard]] Error thrown_by(const std::string& provider);
/// A provider's text made fit to show.
[[nodiscard]] std::string heard(std::string_view words);

/// Calls a provider: its exceptions become errors that name it, and its own errors pass through
/// heard().
template <class Fn>
auto asked(const std::string& provider, Fn&& fn) -> decltype(fn()) {
  AppLock::expect_free();
  try {
    auto answer = fn();
    if (answer.ok()) return answer;
    return heard(provider, std::move(answer).error());
  } catch (...) {
    return thrown_by(provider);
  }
}

/// Most doubles that a provider may request as scratch or state.
inline constexpr std::size_t kMostScratch = std::size_t{1} << 26;
/// Reads a size that a provider requests; `what` it is the size of ("scratch").
template <class Fn>
Result<std::size_t> asked_size(const std::string& provider, const char* what, Fn&& fn) {
  RMP_TRY_ASSIGN(const std::size_t size,
                 asked(provider, [&]() -> Result<std::size_t> { return fn(); }));
  if (size <= kMostScratch) return size;
  return broken_answer(provider, "asks for " + std::to_string(size) + " numbers as " + what +
                                     "; there may be " + std::to_string(kMostScratch));
}

/// The Progress passed to a provider: clamps fractions to 0..1 and makes texts fit to show.
class HeardProgress final : public Progress {
 public:
  explicit HeardProgress(Progress& to) : to_(to) {}
  [[nodiscard]] const void* extension(const char* id) const override { return to_.extension(id); }
  void report(double fraction, std::string_view what) override {
    if (std::isnan(fraction)) return;
    constexpr std::size_t kMostWords = 200;
    to_.report(fraction < 0   ? 0.0
               : fraction > 1 ? 1.0
                              : fraction,
               heard(what.substr(0, kMostWords)));
  }
  [[nodiscard]] bool cancelled() const override { return to_.cancelled(); }

 private:
  Progress& to_;
};

/// True if all numbers of a sequence are finite.
template <class Numbers>
[[nodiscard]] bool all_finite(const Numbers& numbers) {
  for (const double x : numbers)
    if (!std::isfinite(x)) return false;
  return true;
}
/// True if nine numbers are a rotation matrix, up to rounding.
[[nodiscard]] bool is_rotation_matrix(const std::array<double, 9>& R);
/// True if a provider may use this file name: beside the other files, or in folders below if
/// `in_folders`.
[[nodiscard]] bool is_file_name(std::string_view name, bool in_folders);

}  // namespace robomosp
