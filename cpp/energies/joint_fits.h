// SPDX-License-Identifier: MIT
// Objects that share pixels or touch, fitted together on the GPU: the host waits only for the result. No CUDA
// header is needed to include this; only builds with SDFTRACK_CUDA define it.
#pragma once

#include <vector>

#include "energies/beside.h"
#include "energies/contact_term.h"
#include "energies/cuda_work.h"
#include "energies/energy_options.h"

namespace sdftrack::energies {

// Pixels that may show the same few objects of a group.
struct JointPart {
  int of[kMaxJoined] = {};  // ascending
  int objects = 0, pixels = 0;
};

struct JointTask {
  static constexpr int kParts = (1 << kMaxJoined) - 1;  // sets of objects

  int objects = 0, parts = 0;
  SdfView sdf[kMaxJoined] = {};
  Rigidd T_obj_cam[kMaxJoined] = {};  // where the search starts
  JointPart part[kParts] = {};
  const PixelSet* pixels = nullptr;  // of all parts, in their order
  Intrinsics<double> K{};
  SdfEnergyOptions options{};
  int settle_steps = 0;  // of the rays before the first evaluation
  optim::LmRules rules{};
  Beside beside[kMaxJoined] = {};
  Contacts contacts{};
};

struct JointFound {
  Rigidd T_obj_cam[kMaxJoined];
  double cost = 0, count = 0, damping = 0;
  optim::Stop stop = optim::Stop::kNoData;
  std::vector<optim::LmStep> steps;
};

// Fits two to kMaxJoined objects.
void fit_together(CudaWork* work, const JointTask& task, JointFound* found);

}  // namespace sdftrack::energies
