// SPDX-License-Identifier: MIT
// A frame as a search sees it: thinned out to nodes, and what is known of each.
#pragma once

#include <vector>

#include "tracking/search.h"

namespace sdftrack {

// Nodes every `step` pixels of the ideal pinhole image.
struct SearchScene {
  int x0 = 0, y0 = 0, step = 1, width = 0, height = 0;
  std::vector<float> depth_m;            // 0: no reading
  std::vector<unsigned char> candidate;  // the reading may be the object's
  std::vector<unsigned char> other;      // known to show something else

  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
  }
  Vec2f pixel(int i, int j) const {
    return {static_cast<float>(x0 + i * step), static_cast<float>(y0 + j * step)};
  }
};

void make_search_scene(const DepthFrame& frame, const Camera& camera, const Shape& shape,
                       const SearchQuery& query, SearchScene* scene);

// A place to look at: readings that may be the object's and where it cannot be.
struct Proposal {
  Vec3d centroid_cam;                      // of the readings
  std::vector<Vec3f> coarse, fine, dense;  // even subsets of the readings
  DistanceGrid free_space;
  // Where something nearer cuts the readings off: towards it (unit, camera axes, across the line of sight),
  // and how far the readings reach along it. Zero where nothing does.
  Vec3d hidden_cam{0, 0, 0};
  double seen_extent_m = 0;
};

struct ProposalScratch {
  std::vector<int> nodes;
  std::vector<float> depths, nearest_m, nearest_px;
  std::vector<unsigned char> free, ringed;
  DistanceScratch transform;
};

// All candidates are the object's.
bool propose_mask(const SearchScene& scene, const Camera& camera, const Shape& shape,
                  ProposalScratch* scratch, Proposal* out);

}  // namespace sdftrack
