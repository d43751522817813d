// SPDX-License-Identifier: Apache-2.0
#pragma once
// Text that is safe to print on a terminal.

#include <string>
#include <string_view>

namespace veduta {

// The text with everything escaped that a terminal could act on: control characters as \n, \t, \r
// or \x1b, and bytes that are not UTF-8 as \xe9. All names, and all text that may quote one, go
// through it on their way to a person: a file's name may hold any byte but '/' and 0. JSON has
// escapes of its own.
std::string Printable(std::string_view text);
// The same for text of several lines, whose line ends stay.
std::string PrintableLines(std::string_view text);

}  // namespace veduta
