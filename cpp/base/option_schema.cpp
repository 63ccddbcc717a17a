// SPDX-License-Identifier: MIT
#include "base/option_schema.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "base/short_text.h"

namespace sdftrack {

namespace {

// A value with all its digits, as Python's repr.
std::string full_text(double value) {
  const double size = std::abs(value);
  if (!std::isfinite(value)) return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
  char text[64];
  const bool fixed = size == 0 || (size >= 1e-4 && size < 1e16);
  const auto [end, error] = std::to_chars(text, text + sizeof text, value,
                                          fixed ? std::chars_format::fixed : std::chars_format::scientific);
  const std::string digits(text, error == std::errc() ? end : text);
  return fixed && digits.find('.') == std::string::npos ? digits + ".0" : digits;
}

std::string quoted(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "'" : ", '") + name + "'";
  return "[" + out + "]";
}

std::string expected_number(const char* kind, const OptionRange& r) {
  const std::string none = r.may_be_none ? ", or None" : "";
  const std::string min = short_text(r.min), max = short_text(r.max);
  if (r.ends_only) return min + " or " + max + none;
  const bool has_min = std::isfinite(r.min), has_max = std::isfinite(r.max);
  if (has_min && has_max && !r.min_open && !r.max_open) return min + " to " + max + none;
  std::string out = kind;
  if (has_min) out += (r.min_open ? " > " : " >= ") + min;
  if (has_max) out += (has_min ? " and" : "") + std::string(r.max_open ? " < " : " <= ") + max;
  return out + none;
}

[[noreturn]] void refuse(const OptionDescription& option, const std::string& got) {
  throw std::invalid_argument(option.name + ": expected " +
                              expected_of(option.kind, option.range, option.choices) + ", got " + got);
}

}  // namespace

double decimal_of(float value) {
  if (!std::isfinite(value)) return static_cast<double>(value);
  char text[64];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  double out = static_cast<double>(value);
  if (error == std::errc()) std::from_chars(text, end, out);
  return out;
}

std::string expected_of(OptionKind kind, const OptionRange& range, const std::vector<std::string>& choices) {
  switch (kind) {
    case OptionKind::kBool:
      return "True or False";
    case OptionKind::kInt:
      return expected_number("a whole number", range);
    case OptionKind::kNumber:
      return expected_number("a number", range);
    case OptionKind::kChoice:
      return "one of " + quoted(choices);
    case OptionKind::kNumbers:
      return "an array of numbers";
  }
  return {};
}

bool lies_in(const OptionRange& r, double value) {
  if (r.ends_only) return value == r.min || value == r.max;
  return (r.min_open ? value > r.min : value >= r.min) && (r.max_open ? value < r.max : value <= r.max);
}

void check_option(const OptionDescription& option) {
  if (const int* whole = std::get_if<int>(&option.value); whole && !lies_in(option.range, *whole))
    refuse(option, std::to_string(*whole));
  if (const double* number = std::get_if<double>(&option.value); number && !lies_in(option.range, *number))
    refuse(option, full_text(*number));
  if (const auto* name = std::get_if<std::string>(&option.value))
    if (std::find(option.choices.begin(), option.choices.end(), *name) == option.choices.end())
      refuse(option, "'" + *name + "'");
}

}  // namespace sdftrack
