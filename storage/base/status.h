// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an operation failed, in a few codes and one sentence a person can act on.

#include <optional>
#include <string>
#include <utility>

namespace veduta {

enum class StatusCode {
  kOk,
  kInvalidArgument,  // the caller's input is wrong; the message names it
  kNotFound,         // no such thing in the database
  kAlreadyExists,    // the name or the content is there already
  kCorruption,       // stored data breaks its format or an invariant
  kIoError,          // the operating system refused; includes a full disk
  kBusy,             // another process holds the database
  kCancelled,        // the user asked to stop
  kNoMemory,         // the machine has too little memory; the input may be sound
};

class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

  static Status Ok() { return {}; }
  static Status InvalidArgument(std::string message) {
    return {StatusCode::kInvalidArgument, std::move(message)};
  }
  static Status NotFound(std::string message) {
    return {StatusCode::kNotFound, std::move(message)};
  }
  static Status AlreadyExists(std::string message) {
    return {StatusCode::kAlreadyExists, std::move(message)};
  }
  static Status Corruption(std::string message) {
    return {StatusCode::kCorruption, std::move(message)};
  }
  static Status IoError(std::string message) { return {StatusCode::kIoError, std::move(message)}; }
  static Status Busy(std::string message) { return {StatusCode::kBusy, std::move(message)}; }
  static Status Cancelled(std::string message) {
    return {StatusCode::kCancelled, std::move(message)};
  }

  static Status NoMemory(std::string message) {
    return {StatusCode::kNoMemory, std::move(message)};
  }

  bool ok() const { return code_ == StatusCode::kOk; }
  StatusCode code() const { return code_; }
  const std::string& message() const { return message_; }

  // For a failure that the caller has a stated reason to ignore.
  void IgnoreBecause(const char* /*reason*/) const {}

 private:
  StatusCode code_ = StatusCode::kOk;
  std::string message_;
};

// Prints the sentence to standard error and aborts; for broken invariants only, in release builds
// too.
[[noreturn]] void AbortWithMessage(const char* file, int line, const std::string& message);

// A value, or why there is none.
template <typename T>
class [[nodiscard]] Result {
 public:
  // Both are implicit, so that `return value;` and `return status;` read well.
  Result(T value) : value_(std::move(value)) {}         // NOLINT
  Result(Status status) : status_(std::move(status)) {  // NOLINT
    if (status_.ok())
      AbortWithMessage(__FILE__, __LINE__, "Result built from an Ok status without a value");
  }

  bool ok() const { return value_.has_value(); }
  const Status& status() const { return status_; }
  T& value() & { return Checked(); }
  const T& value() const& { return const_cast<Result*>(this)->Checked(); }
  T value() && {
    return std::move(Checked());
  }  // by value: `for (x : F().value())` must not dangle
  T& operator*() & { return Checked(); }
  const T& operator*() const& { return value(); }
  T operator*() && { return std::move(Checked()); }
  T* operator->() { return &Checked(); }
  const T* operator->() const { return &value(); }

 private:
  T& Checked() {
    if (!value_)
      AbortWithMessage(__FILE__, __LINE__, "value() of a failed Result: " + status_.message());
    return *value_;
  }

  std::optional<T> value_;
  Status status_;
};

}  // namespace veduta

#define VEDUTA_CONCAT_INNER(a, b) a##b
#define VEDUTA_CONCAT(a, b) VEDUTA_CONCAT_INNER(a, b)
// Returns the failure of `expression` from the enclosing function.
#define VEDUTA_RETURN_IF_ERROR(expression)                                            \
  do {                                                                                \
    if (auto veduta_status = (expression); !veduta_status.ok()) return veduta_status; \
  } while (false)
// Declares `target` from a Result, or returns its failure.
#define VEDUTA_ASSIGN_OR_RETURN(target, expression)            \
  auto VEDUTA_CONCAT(veduta_result_, __LINE__) = (expression); \
  if (!VEDUTA_CONCAT(veduta_result_, __LINE__).ok())           \
    return VEDUTA_CONCAT(veduta_result_, __LINE__).status();   \
  target = std::move(VEDUTA_CONCAT(veduta_result_, __LINE__)).value()
// Aborts with `message` (which names the operands) when a condition that our own code guarantees
// does not hold.
#define VEDUTA_CHECK(condition, message)                                             \
  do {                                                                               \
    if (!(condition))                                                                \
      ::veduta::AbortWithMessage(__FILE__, __LINE__,                                 \
                                 std::string(#condition " is false: ") + (message)); \
  } while (false)
