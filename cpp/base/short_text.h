// SPDX-License-Identifier: MIT
// A number for a sentence.
#pragma once

#include <charconv>
#include <string>

namespace sdftrack {

// Six digits at most, as Python's format(value, "g"), whatever the locale.
inline std::string short_text(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

}  // namespace sdftrack
