// SPDX-License-Identifier: Apache-2.0
#pragma once
// Failures as exceptions that travel: cli/rpc/veduta.capnp says what their text is.

#include <kj/exception.h>

#include <cstdint>
#include <string>

#include "cli/service/http_message.h"
#include "storage/base/status.h"

namespace veduta {

// Of a problem that HTTP would answer by.
kj::Exception FailureOf(const HttpAnswer& problem);
kj::Exception FailureOf(const Status& status);
// Of a code of HTTP; 429 and 503 are told to come again in a while.
kj::Exception Failure(uint32_t code, const std::string& detail);

// The value, or its failure is thrown.
template <typename T>
T ValueOrThrow(Result<T> result) {
  if (!result.ok()) kj::throwFatalException(FailureOf(result.status()));
  return std::move(result).value();
}

}  // namespace veduta
