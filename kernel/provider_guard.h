// SPDX-License-Identifier: Apache-2.0
// Guards: every provider that the registry hands out stands behind one, whoever wrote it. A guard
// refuses what the provider's tags do not say that it serves, names the provider in what it throws,
// and looks at what it returns before anybody uses it (layer: core).
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <robomosp/sdk/progress.h>

#include "kernel/app_lock.h"
#include "kernel/registry.h"

namespace robomosp {

/// Puts a made provider behind the guard of its interface; takes it over and gives what is to be
/// used in its place, an object of the same interface. What has no guard comes back itself.
[[nodiscard]] void* guard_provider(const ProviderInfo& info, void* made);

/// What a guard says of an answer that cannot be used: `what` the provider did.
[[nodiscard]] Error broken_answer(const std::string& provider, const std::string& what);
/// A provider's error as it can be shown: not too long, without control characters. One without
/// words or of no known code is the provider's fault, and says so.
[[nodiscard]] Error heard(const std::string& provider, Error e);
/// What is said of the exception that is being handled.
[[nodiscard]] Error thrown_by(const std::string& provider);
/// Words of a provider as they can be shown.
[[nodiscard]] std::string heard(std::string_view words);

/// Asks a provider: what it throws becomes an error that names it, and its own errors are heard().
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

/// Doubles that a provider may ask for as scratch or state.
inline constexpr std::size_t kMostScratch = std::size_t{1} << 26;
/// A size that a provider asks for; `what` it is of ("scratch").
template <class Fn>
Result<std::size_t> asked_size(const std::string& provider, const char* what, Fn&& fn) {
  RMP_TRY_ASSIGN(const std::size_t size,
                 asked(provider, [&]() -> Result<std::size_t> { return fn(); }));
  if (size <= kMostScratch) return size;
  return broken_answer(provider, "asks for " + std::to_string(size) + " numbers as " + what +
                                     "; there may be " + std::to_string(kMostScratch));
}

/// What a provider is given to report to: shares are within 0..1, words can be shown.
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

/// Whether all of a sequence are finite.
template <class Numbers>
[[nodiscard]] bool all_finite(const Numbers& numbers) {
  for (const double x : numbers)
    if (!std::isfinite(x)) return false;
  return true;
}
/// Whether nine numbers are a rotation matrix, to rounding.
[[nodiscard]] bool is_rotation_matrix(const std::array<double, 9>& R);
/// Whether a provider may name a file so: beside the others, in folders below if `in_folders`.
[[nodiscard]] bool is_file_name(std::string_view name, bool in_folders);

}  // namespace robomosp
