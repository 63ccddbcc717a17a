// SPDX-License-Identifier: MIT
#include "tracking/search/quick_runs.h"

#include <algorithm>

#include "base/parallel.h"
#include "frame/points_cuda.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kChunks = 90, kMostPerChunk = 40;

// Calls body(k) for each run on the threads.
template <class Body>
void each_run(std::size_t count, int threads, const Body& body) {
  const std::size_t size = std::clamp<std::size_t>(count / kChunks, 1, kMostPerChunk);
  parallel_for((count + size - 1) / size, threads, [&](std::size_t chunk) {
    for (std::size_t k = chunk * size; k < std::min(count, (chunk + 1) * size); ++k) body(k);
  });
}

std::vector<frame::QuickTerms> terms_of(const std::vector<QuickData>& data, const QuickStage& stage) {
  std::vector<frame::QuickTerms> terms;
  terms.reserve(data.size());
  for (const QuickData& d : data) terms.push_back(quick_terms(d, stage));
  return terms;
}

std::vector<frame::PoseOf> poses_of(const std::vector<QuickRun>& runs) {
  std::vector<frame::PoseOf> poses;
  poses.reserve(runs.size());
  for (const QuickRun& run : runs) poses.push_back({run.T_obj_cam, run.data});
  return poses;
}

}  // namespace

void quick_runs(const std::vector<QuickData>& data, const QuickPlan& plan, int threads,
                frame::PointsOnDevice* device, std::vector<QuickRun>* runs) {
  const auto at = [&](const QuickRun& run) -> const QuickData& {
    return data[static_cast<std::size_t>(run.data)];
  };
  if (!device) {
    each_run(runs->size(), threads, [&](std::size_t k) {
      QuickRun& run = (*runs)[k];
      for (const QuickStage& stage : plan.stages) quick_fit(at(run), stage, &run.T_obj_cam);
      if (plan.rank) run.cost = quick_cost(at(run), *plan.rank, run.T_obj_cam);
    });
    return;
  }
  std::vector<energies::Sums<double, 6>> sums;
  for (const QuickStage& stage : plan.stages) {
    const std::vector<frame::QuickTerms> terms = terms_of(data, stage);
    for (int step = 0; step < stage.steps; ++step) {
      device->linearize(terms, poses_of(*runs), &sums);
      each_run(runs->size(), threads, [&](std::size_t k) { quick_step(sums[k], &(*runs)[k].T_obj_cam); });
    }
  }
  if (!plan.rank) return;
  std::vector<frame::QuickCost> costs;
  std::vector<frame::QuickTerms> terms = terms_of(data, *plan.rank);
  for (frame::QuickTerms& t : terms) t.outline.weight = 1;
  device->cost(terms, poses_of(*runs), &costs);
  for (std::size_t k = 0; k < runs->size(); ++k) (*runs)[k].cost = quick_total(at((*runs)[k]), costs[k]);
}

}  // namespace sdftrack::tracking
