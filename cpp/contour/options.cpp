// SPDX-License-Identifier: MIT
#include "contour/options.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace sdftrack {

namespace {

void between(const char* name, double value, double least, double most) {
  if (std::isfinite(value) && value >= least && value <= most) return;
  std::ostringstream text;
  text << name << ": expected " << least << " to " << most << ", got " << value;
  throw std::invalid_argument(text.str());
}

}  // namespace

void ContourOptions::check() const {
  if (bins != 16 && bins != 32)
    throw std::invalid_argument("bins: expected 16 or 32 per channel, got " + std::to_string(bins));
  each_number(*this, [](const char* name, auto value, double least, double most) {
    between(name, static_cast<double>(value), least, most);
  });
  between("mu dt (the product of both)", static_cast<double>(mu * dt), 0, 0.2001);
}

}  // namespace sdftrack
