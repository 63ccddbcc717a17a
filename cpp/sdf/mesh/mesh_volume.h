// SPDX-License-Identifier: MIT
// From any mesh to a signed distance volume: checks, repairs, the grid, the distances, and what was repaired.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sdf/grid.h"
#include "sdf/mesh/mesh_report.h"

namespace sdftrack::sdf {

constexpr int kMinVoxels = 8, kMaxVoxels = 1200;  // along the longest side

// The grid around a box, centred on it: `voxels` along its longest side with the padding on both ends.
// padding: a fraction of the longest side; none: 0.1, at least 25 mm, which a hand at 1 m/s moves between two
// frames; always at least two voxels. Throws std::invalid_argument for numbers out of range.
Grid grid_around(Vec3d low, Vec3d high, int voxels, std::optional<double> padding);

struct MeshVolumeOptions {
  int voxels = 200;
  std::optional<double> padding;
  std::optional<double> unit_m;  // of the mesh; none: metres, and a size that no object has is an error
  bool close_holes = false;      // by the generalised winding number; else an open mesh is an error
  int threads = 0;               // 0: all cores
};

struct MeshVolume {
  std::vector<float> phi;
  Grid grid{};
  MeshReport report;
  std::vector<std::string> warnings;  // repairs, and parts that are too thin for the voxels

  SdfView view() const { return grid.view(phi.data()); }
};

// Throws std::invalid_argument "mesh: ..." or "voxels: ..." for what has no volume at this resolution.
MeshVolume mesh_volume(const MeshView& mesh, const MeshVolumeOptions& options);

}  // namespace sdftrack::sdf
