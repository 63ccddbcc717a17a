// SPDX-License-Identifier: MIT
#include "contour/options.h"

#include "contour/option_schema.h"

namespace sdftrack::contour {

void ContourOptions::check() const {
  check_options(*this);
  check_option({.name = "mu dt (the product of both)",
                .kind = OptionKind::kNumber,
                .value = decimal_of(mu * dt),
                .range = from_to(0, 0.2001)});
}

}  // namespace sdftrack::contour
