// SPDX-License-Identifier: MIT
// Rotations spread evenly over SO(3): where a search without a pose starts.
#pragma once

#include "base/rigid.h"

namespace sdftrack::tracking {

// Rotation i of n of the super-Fibonacci spiral (Alexa, CVPR 2022): nearly optimal covering for any n.
Mat3d super_fibonacci(int i, int n);

// The same n rotations, ordered so that any run of consecutive ones is spread over all of SO(3). This allows
// a search to be split into slices. k is taken modulo n.
Mat3d seed_rotation(int k, int n);

}  // namespace sdftrack::tracking
