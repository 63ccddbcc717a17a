// SPDX-License-Identifier: MIT
#include "contour/memory/options.h"

namespace sdftrack::contour {

void MemoryOptions::check() const {
  check_options(*this);
  const int harmonics = remembered.library.n_harmonics, size = remembered.library.size;
  if (n_inputs >= harmonics)
    throw std::invalid_argument("n_inputs: expected 1 to " + std::to_string(harmonics - 1) +
                                " (n_harmonics - 1), got " + std::to_string(n_inputs));
  if (harmonics > size)
    throw std::invalid_argument("n_harmonics: a grid of " + std::to_string(size) +
                                " pixels has no more than " + std::to_string(size) + ", got " +
                                std::to_string(harmonics));
}

}  // namespace sdftrack::contour
