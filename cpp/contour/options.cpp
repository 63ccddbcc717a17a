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
  between("windows", windows, 1, 16);
  between("shrink", static_cast<double>(shrink), 1, 1e6);
  between("object_rate", static_cast<double>(object_rate), 0, 1);
  between("background_rate", static_cast<double>(background_rate), 0, 1);
  between("least_posterior", static_cast<double>(least_posterior), 1e-6, 0.4);
  between("ring", static_cast<double>(ring), 0.05, 2);
  between("most_cells", most_cells, 32, 2048);
  between("softness", static_cast<double>(softness), 0.3, 10);
  between("band", static_cast<double>(band), 2, 32);
  between("registration_steps", registration_steps, 0, 200);
  between("shape_steps", shape_steps, 0, 200);
  between("reach", static_cast<double>(reach), 0, 200);
  between("dt", static_cast<double>(dt), 1e-3, 10);
  between("mu", static_cast<double>(mu), 0, 10);
  between("mu dt (the product of both)", static_cast<double>(mu * dt), 0, 0.2001);
  between("tension", static_cast<double>(tension), 0, 4);
  between("least_part", static_cast<double>(least_part), 0, 1);
  between("box_rounds", box_rounds, 1, 100);
}

}  // namespace sdftrack
