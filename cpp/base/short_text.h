// SPDX-License-Identifier: MIT
// A number as text for a sentence.
#pragma once

#include <charconv>
#include <string>

namespace sdftrack {

// At most six digits, as Python's format(value, "g"), in any locale.
inline std::string short_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

}  // namespace sdftrack
