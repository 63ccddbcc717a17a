// SPDX-License-Identifier: MIT
// Places that a search examines: measurements that may be the object's, and where the object cannot be.
#pragma once

#include <vector>

#include "energies/distance_transform.h"
#include "tracking/search/search_scene.h"

namespace sdftrack::tracking {

struct Proposal {
  Vec3d centroid_cam;               // of the measurements
  std::vector<Vec3f> coarse, fine;  // even subsets of the measurements
  std::vector<Vec3f> solids;        // measurements of other things near by
  energies::DistanceGrid free_space;
  // Where something nearer cuts the measurements off: the direction towards it (unit, camera axes, across the
  // line of sight), and the extent of the measurements along it. Zero where nothing does.
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

// A mask is one place. In a box, a sphere about a pose or a whole image, the places are windows of about the
// object's size, centred on measurements that lie apart; in a whole image connected parts come first.
void make_proposals(const SearchScene& scene, const Camera& camera, const frame::Shape& shape,
                    const SearchQuery& query, ProposalScratch* scratch, std::vector<Proposal>* out);

// An even subset of all measurements that may be the object's, on which the poses of one scene are compared.
void all_candidates(const SearchScene& scene, const Camera& camera, int requested, std::vector<Vec3f>* out);

}  // namespace sdftrack::tracking
