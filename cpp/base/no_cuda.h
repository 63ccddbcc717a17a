// SPDX-License-Identifier: MIT
// What a build without CUDA says, whatever it is asked to run on a GPU.
#pragma once

#include <stdexcept>

namespace sdftrack {

[[noreturn]] inline void no_cuda() {
  throw std::runtime_error("this build of sdftrack has no CUDA path; build with SDFTRACK_CUDA=ON");
}

}  // namespace sdftrack
