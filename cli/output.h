// SPDX-License-Identifier: Apache-2.0
#pragma once
// Standard output: it carries results and nothing else. What the process prints in any other way
// (a library's warning) goes to standard error.

#include "cli/wire/json.h"
#include "storage/base/status.h"

namespace veduta {

// To be called once, before anything is printed. From then on only the functions below reach
// standard output; what others print there goes to standard error.
void KeepOutputForResults();

// As printf, without the line's end that every call adds. Each call reaches the reader at once.
[[gnu::format(printf, 1, 2)]] void PrintLine(const char* format, ...);
// The value on one line.
void PrintJson(const Json& value);
// The bytes as they are.
void PrintBytes(std::string_view bytes);

// kIoError with the operating system's word if anything could not be written. A command goes on
// after such a failure, because what it does to the database is worth finishing; main asks here at
// the end.
Status OutputStatus();

}  // namespace veduta
