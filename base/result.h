// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace emberlock {

enum class ErrorKind {
  bad_input,      ///< a file, an option or a value that the user can correct (exit code 2)
  io,             ///< the operating system refused: disk, permissions, sockets
  device,         ///< a camera, strobe or accelerator failed or is absent
  out_of_data,    ///< the stream, file or recording has ended
  timed_out,      ///< a deadline passed
  refused,        ///< impossible in the present state; may succeed later
  not_converged,  ///< an iteration didn't converge: its result would be worse than none
};

/// What went wrong, where (file, field, device), and what to do about it.
struct Error {
  ErrorKind kind = ErrorKind::bad_input;
  std::string what;
  std::string where = {};
  std::string remedy = {};

  /// "where: what. remedy" on one line; the first two end in "..." beyond 2000 bytes each.
  [[nodiscard]] std::string message() const;
};

/// A value, or the error that explains why there is none. Reading the one that is absent throws (a logic
/// error).
template <class T>
class [[nodiscard]] Result {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): `return value;` and `return Error{...};` are the point.
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  [[nodiscard]] const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  [[nodiscard]] bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] const Error& error() const { return error_.value(); }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace emberlock

#define EMBERLOCK_CONCAT_INNER(a, b) a##b
#define EMBERLOCK_CONCAT(a, b) EMBERLOCK_CONCAT_INNER(a, b)

/// Returns the error of a Result<> from the enclosing function, if it has one.
#define EMBERLOCK_RETURN_IF_ERROR(expression)                         \
  if (auto emberlock_status = (expression); !emberlock_status.ok()) { \
    return emberlock_status.error();                                  \
  }                                                                   \
  static_assert(true)

/// EMBERLOCK_ASSIGN_OR_RETURN(auto x, f()): sets x to f()'s value, or returns its error from the enclosing
/// function.
#define EMBERLOCK_ASSIGN_OR_RETURN(declaration, expression)          \
  auto EMBERLOCK_CONCAT(emberlock_result_, __LINE__) = (expression); \
  if (!EMBERLOCK_CONCAT(emberlock_result_, __LINE__).ok())           \
    return EMBERLOCK_CONCAT(emberlock_result_, __LINE__).error();    \
  declaration = std::move(EMBERLOCK_CONCAT(emberlock_result_, __LINE__)).value()  // NOLINT(*-parentheses)
