// SPDX-License-Identifier: MIT
// Finds an object without a pose: the search's best hypotheses are fitted at full resolution and judged.
#pragma once

#include <memory>
#include <optional>

#include "frame/points_cuda.h"
#include "tracking/fit/fit.h"
#include "tracking/search/search.h"

namespace sdftrack::tracking {

struct Found {
  Fitted fitted;
  Trust trust;
  double runner_up = 0;  // score of the best other pose over this one's; near 1: the view does not decide
  std::vector<Rigidd> alternatives;  // motions to the poses that score nearly as well, in the centred frame
};

// Whether two poses are distinct results, for an object with these symmetries.
bool looks_distinct(const Rigidd& a, const Rigidd& b, const std::vector<Rigidd>* symmetries);

class ObjectFinder {
 public:
  // device nullptr: the search's fits run on the CPU.
  ObjectFinder(const TrackerOptions& options, int threads, energies::CudaWork* device);

  // No result where nothing in the frame could be the object. An alternative close to query.near's rotation
  // is preferred to an equally good one: of the turns of a symmetric body, the one last seen.
  std::optional<Found> find(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                            const FitMemory& memory, const appearance::ColorModel* colors,
                            const SearchQuery& query, double prior_log_odds, PoseFitter* fitter);

 private:
  TrackerOptions options_;
  int threads_;
  SearchScratch scratch_;
  std::unique_ptr<frame::PointsOnDevice> device_;
};

}  // namespace sdftrack::tracking
