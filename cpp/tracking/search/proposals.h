// SPDX-License-Identifier: MIT
// Places at which a search looks: readings that may be the object's, and where it cannot be.
#pragma once

#include <vector>

#include "energies/distance_transform.h"
#include "tracking/search/search_scene.h"

namespace sdftrack::tracking {

struct Proposal {
  Vec3d centroid_cam;               // of the readings
  std::vector<Vec3f> coarse, fine;  // even subsets of the readings
  std::vector<Vec3f> solids;        // readings of other things near by
  energies::DistanceGrid free_space;
  // Where something nearer cuts the readings off: towards it (unit, camera axes, across the line of sight),
  // and how far the readings reach along it. Zero where nothing does.
  Vec3d hidden_cam{0, 0, 0};
  double seen_extent_m = 0;
};

struct ProposalScratch {
  SearchScene window;
  std::vector<int> nodes, stack, centres;
  std::vector<Vec3f> middles;
  std::vector<float> depths, nearest_m, nearest_px, apart;
  std::vector<unsigned char> free, ringed;
  energies::DistanceScratch transform;
};

// A mask is one place. A box, a sphere about a pose and a whole image are windows of about the object's size,
// centred on readings that lie apart; in a whole image connected parts come first.
void make_proposals(const SearchScene& scene, const Camera& camera, const frame::Shape& shape,
                    const SearchQuery& query, ProposalScratch* scratch, std::vector<Proposal>* out);

// An even subset of all readings that may be the object's: what poses of one scene are compared on.
void all_candidates(const SearchScene& scene, const Camera& camera, int wanted, std::vector<Vec3f>* out);

}  // namespace sdftrack::tracking
