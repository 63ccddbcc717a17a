// SPDX-License-Identifier: MIT
// Rough fits of all poses of a stage at once: on threads of the CPU, or on a GPU with bit-identical results.
#pragma once

#include <vector>

#include "frame/points_cuda.h"
#include "tracking/search/quick_fit.h"

namespace sdftrack::tracking {

struct QuickRun {
  int data;  // index of the search's place
  Rigidf T_obj_cam;
  float cost = 0;
};

struct QuickPlan {
  std::vector<QuickStage> stages;  // one fit after another
  const QuickStage* rank;          // of the costs at the end; nullptr: no costs are needed
};

// device nullptr: the CPU.
void quick_runs(const std::vector<QuickData>& data, const QuickPlan& plan, int threads,
                frame::PointsOnDevice* device, std::vector<QuickRun>* runs);

}  // namespace sdftrack::tracking
