// SPDX-License-Identifier: Apache-2.0
#pragma once
// Text of strangers, before it is stored.

#include <string_view>

namespace veduta {

// Whether the text is UTF-8 as RFC 3629 has it (shortest forms, no surrogates) and without control
// characters (C0, C1, DEL), but for line feeds where it may have lines. O(size).
bool IsPlainText(std::string_view text, bool may_have_lines);

}  // namespace veduta
