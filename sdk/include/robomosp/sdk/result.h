// SPDX-License-Identifier: Apache-2.0
// Result<T> and Error: how every failure that a user, file, plugin or peer can cause is reported
// (layer: contract, std only). No exception is needed to use it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace robomosp {

/// Stable failure classes; `to_string` gives the word that scripts and remote peers see.
enum class ErrorCode : std::int32_t {
  invalid_argument = 1,  ///< a value has the wrong type, unit, range or length
  usage,                 ///< the command line or call shape is wrong
  unknown_name,          ///< no command, record, provider, parameter or field of that name
  not_found,             ///< a file or folder is missing
  syntax,                ///< text does not follow its grammar
  io,                    ///< the operating system refused to read or write
  conflict,        ///< the edit contradicts the document (cycle, duplicate name, still referred to)
  stale_handle,    ///< a handle names a record that no longer exists
  unreachable,     ///< no solution exists for the given target
  plugin_refused,  ///< a plugin file could not be accepted
  plugin_failed,   ///< a provider threw, returned NaN or broke its contract
  permission,      ///< this session may not do that
  cancelled,       ///< stopped by the user
  unsupported,     ///< meaningful, but this provider or version cannot do it
  internal,        ///< a defect of this program
  script_failed    ///< a script raised an error
};

[[nodiscard]] constexpr std::string_view to_string(ErrorCode c) {
  switch (c) {
    case ErrorCode::invalid_argument: return "invalid_argument";
    case ErrorCode::usage: return "usage";
    case ErrorCode::unknown_name: return "unknown_name";
    case ErrorCode::not_found: return "not_found";
    case ErrorCode::syntax: return "syntax";
    case ErrorCode::io: return "io";
    case ErrorCode::conflict: return "conflict";
    case ErrorCode::stale_handle: return "stale_handle";
    case ErrorCode::unreachable: return "unreachable";
    case ErrorCode::plugin_refused: return "plugin_refused";
    case ErrorCode::plugin_failed: return "plugin_failed";
    case ErrorCode::permission: return "permission";
    case ErrorCode::cancelled: return "cancelled";
    case ErrorCode::unsupported: return "unsupported";
    case ErrorCode::internal: return "internal";
    case ErrorCode::script_failed: return "script_failed";
  }
  return "internal";
}

/// A failure given as what happened (`message`), where (`where`), and what to do (`hint`).
struct Error {
  Error() = default;
  Error(ErrorCode code_, std::string message_, std::string where_ = {}, std::string hint_ = {})
      : code(code_),
        message(std::move(message_)),
        where(std::move(where_)),
        hint(std::move(hint_)) {}

  ErrorCode code = ErrorCode::internal;
  /// The host's number of the faults that the text is about; 0 = none. Leave it as it is. Plugins
  /// built for an older SDK have padding here, so any number may come from them.
  std::uint32_t fault_set = 0;
  std::string message;  ///< what happened, without the place and without a trailing period
  std::string where;    ///< outermost context first: `robot "pa10", link 3`
  std::string hint;     ///< what to do, a full sentence with its period; may be empty

  /// Adds an outer context: err.in("robot \"pa10\"").
  [[nodiscard, gnu::cold, gnu::noinline]] Error in(std::string_view context) && {
    where = where.empty() ? std::string(context) : std::string(context) + ", " + where;
    return std::move(*this);
  }
  /// The one sentence a user reads: `where: message. hint`
  [[nodiscard, gnu::cold, gnu::noinline]] std::string sentence() const {
    std::string s = where.empty() ? message : where + ": " + message;
    if (!s.empty() && s.back() != '.' && s.back() != '?' && s.back() != '!') s += '.';
    if (!hint.empty()) s += " " + hint;
    return s;
  }
};

/// Builds an Error: `return error(ErrorCode::not_found, "there is no file \"a.rbt\"", "Check the
/// path.");`
[[nodiscard, gnu::cold, gnu::noinline]] inline Error error(ErrorCode code, std::string message,
                                                           std::string hint = {},
                                                           std::string where = {}) {
  return Error{code, std::move(message), std::move(where), std::move(hint)};
}

/// Thrown where a Result is read without a check: the host names the provider that let it
/// out and continues.
class ResultMisread : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

namespace detail {
[[noreturn]] inline void misread(const std::string& sentence) {
#if defined(__cpp_exceptions)
  throw ResultMisread(sentence);
#else
  std::fprintf(stderr, "robomosp: %s\n", sentence.c_str());
  std::abort();
#endif
}
}  // namespace detail

/// Either a value or an Error. Reading the wrong one throws ResultMisread with the error's sentence
/// (a plugin built without exceptions aborts instead).
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT: implicit by design
  Result(Error err)
      : state_(std::in_place_index<1>, std::move(err)) {}  // NOLINT: implicit by design

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] T& value() & {
    check(true);
    return *std::get_if<0>(&state_);
  }
  [[nodiscard]] const T& value() const& {
    check(true);
    return *std::get_if<0>(&state_);
  }
  [[nodiscard]] T&& value() && {
    check(true);
    return std::move(*std::get_if<0>(&state_));
  }
  [[nodiscard]] T& operator*() & { return value(); }
  [[nodiscard]] const T& operator*() const& { return value(); }
  [[nodiscard]] T&& operator*() && { return std::move(*this).value(); }
  [[nodiscard]] T* operator->() { return &value(); }
  [[nodiscard]] const T* operator->() const { return &value(); }
  [[nodiscard]] T value_or(T other) && {
    return ok() ? std::move(*this).value() : std::move(other);
  }

  [[nodiscard]] Error& error() & {
    check(false);
    return *std::get_if<1>(&state_);
  }
  [[nodiscard]] const Error& error() const& {
    check(false);
    return *std::get_if<1>(&state_);
  }
  [[nodiscard]] Error&& error() && {
    check(false);
    return std::move(*std::get_if<1>(&state_));
  }

  /// Adds an outer context to the error, if there is one.
  [[nodiscard]] Result in(std::string_view context) && {
    if (!ok()) return std::move(*std::get_if<1>(&state_)).in(context);
    return std::move(*this);
  }

 private:
  void check(bool want_value) const {
    if (ok() == want_value) return;
    detail::misread(want_value ? "a failed result was read: " + std::get_if<1>(&state_)->sentence()
                               : "the error of a result was read that holds a value");
  }
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error err) : error_(std::move(err)) {}  // NOLINT: implicit by design

  [[nodiscard]] bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] Error& error() & {
    check();
    return *error_;
  }
  [[nodiscard]] const Error& error() const& {
    check();
    return *error_;
  }
  [[nodiscard]] Error&& error() && {
    check();
    return std::move(*error_);
  }
  [[nodiscard]] Result in(std::string_view context) && {
    if (error_) return std::move(*error_).in(context);
    return {};
  }

 private:
  void check() const {
    if (!error_) detail::misread("the error of a result was read that holds none");
  }
  std::optional<Error> error_;
};

}  // namespace robomosp

// Hands an error up: RMP_TRY(do_this()); RMP_TRY_ASSIGN(auto x, make_x());
#define RMP_CONCAT_(a, b) a##b
#define RMP_CONCAT(a, b) RMP_CONCAT_(a, b)
#define RMP_TRY(...)                                                                             \
  do {                                                                                           \
    if (auto rmp_result = (__VA_ARGS__); !rmp_result.ok()) return std::move(rmp_result).error(); \
  } while (false)
#define RMP_TRY_ASSIGN(decl, ...)                                \
  auto RMP_CONCAT(rmp_result_, __LINE__) = (__VA_ARGS__);        \
  if (!RMP_CONCAT(rmp_result_, __LINE__).ok())                   \
    return std::move(RMP_CONCAT(rmp_result_, __LINE__)).error(); \
  decl = std::move(RMP_CONCAT(rmp_result_, __LINE__)).value()
