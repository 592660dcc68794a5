// SPDX-License-Identifier: Apache-2.0
#include "kernel/provider_guard.h"

#include "kernel/interface_file.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

constexpr const char* kReport = "Report it to the provider's author or choose another provider.";
/// Of a provider's own sentence.
constexpr std::size_t kMostBytes = 1500;
constexpr std::size_t kLongestName = 255;

bool is_known(ErrorCode c) {
  return c >= ErrorCode::invalid_argument && c <= ErrorCode::script_failed;
}

}  // namespace

void* guard_provider(const ProviderInfo& info, void* made) {
  const InterfaceEntry* entry = InterfaceFile::find(info.interface_id);
  return entry && entry->guard ? entry->guard(info, made) : made;
}

Error broken_answer(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider " + text::quote(provider) + " " + what, kReport);
}

std::string heard(std::string_view words) {
  // Cut first: it may be very much.
  return text::visible(text::shortened(std::string(words), kMostBytes));
}

Error heard(const std::string& provider, Error e) {
  e.message = heard(e.message);
  e.where = heard(e.where);
  e.hint = heard(e.hint);
  if (text::trim(e.message).empty())
    return error(ErrorCode::plugin_failed,
                 "provider " + text::quote(provider) + " failed and gave no reason",
                 e.hint.empty() ? kReport : std::move(e.hint), std::move(e.where));
  if (is_known(e.code) && e.code != ErrorCode::internal) return e;
  e.code = ErrorCode::plugin_failed;
  e.message = "provider " + text::quote(provider) + " failed: " + e.message;
  if (e.hint.empty()) e.hint = kReport;
  return e;
}

Error thrown_by(const std::string& provider) {
  std::string what = "threw an unknown exception";
  try {
    throw;
  } catch (const std::exception& e) {
    what = "threw: " + heard(e.what());
  } catch (...) {  // NOLINT: it has no words
  }
  return broken_answer(provider, what);
}

bool is_rotation_matrix(const std::array<double, 9>& R) {
  constexpr double kSlack = 1e-6;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += R[3 * i + k] * R[3 * j + k];
      if (!(std::fabs(dot - (i == j ? 1 : 0)) < kSlack)) return false;  // NaN too
    }
  return R[0] * (R[4] * R[8] - R[5] * R[7]) - R[1] * (R[3] * R[8] - R[5] * R[6]) +
             R[2] * (R[3] * R[7] - R[4] * R[6]) >
         0;
}

bool is_file_name(std::string_view name, bool in_folders) {
  for (const char c : name)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) return false;
  for (const std::string_view part : text::split(name, '/')) {
    if (part.empty() || part == "." || part == ".." || part.size() > kLongestName) return false;
    if (!in_folders && part.size() != name.size()) return false;
  }
  return !name.empty();
}

}  // namespace robomosp
