// SPDX-License-Identifier: MIT
// The error of a build without CUDA for all requests to use a GPU.
#pragma once

#include <stdexcept>

namespace sdftrack {

[[noreturn]] inline void no_cuda() {
  throw std::runtime_error("this build of sdftrack has no CUDA path; build with SDFTRACK_CUDA=ON");
}

}  // namespace sdftrack
