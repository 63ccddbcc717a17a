// SPDX-License-Identifier: MIT
// Where an object that shows the given measurements cannot be, and on which side something may hide it.
#pragma once

#include "tracking/search/proposals.h"

namespace sdftrack::tracking {

// The distance of every node to the nearest node that might show the object, from the nodes of its
// measurements, whether all are its own (a mask), and the depth beyond which nothing of the object can be.
void free_region(const SearchScene& scene, const std::vector<int>& nodes, bool all_object, double beyond_m,
                 ProposalScratch* scratch, energies::DistanceGrid* grid);

// The mean outward direction of the border where something nearer stands; after free_region().
void find_hidden_side(const SearchScene& scene, const Camera& camera, const ProposalScratch& scratch,
                      Proposal* out);

}  // namespace sdftrack::tracking
