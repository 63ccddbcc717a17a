// SPDX-License-Identifier: MIT
// The shape of a rigid object: its signed distances on a grid.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace sdftrack {

struct ShapeOptions {
  int voxels = 200;          // along the longest side, with 10 % (at least 25 mm) of free space around it
  double unit_m = 0;         // of the mesh, such as 0.001; 0: metres, and an unlikely size is an error
  bool close_holes = false;  // by the generalised winding number; else an open mesh is an error
  int threads = 0;           // 0: all cores
};

// Copies share their volume, which does not change.
class Shape {
 public:
  using Vertices = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  using Faces = Eigen::Matrix<int, 3, Eigen::Dynamic>;  // counter-clockwise seen from outside

  // Throws std::invalid_argument for what has no volume: empty, open, flat, too thin for the voxels.
  static Shape from_mesh(const Vertices& vertices, const Faces& faces, const ShapeOptions& options = {});
  // .ply, .obj or .stl. Throws std::invalid_argument for a file that is not read, or that ends early.
  static Shape from_mesh_file(const std::filesystem::path& file, const ShapeOptions& options = {});

  // What was repaired in the mesh, and which parts are too thin for the voxels: one sentence each.
  const std::vector<std::string>& warnings() const;
  double voxel_m() const;
  // Signed distance (m) at a point of the object frame, negative inside.
  double distance_m(const Eigen::Vector3d& p_obj) const;

 private:
  friend class Tracker;
  friend class Reconstructor;
  struct Volume;
  explicit Shape(std::shared_ptr<const Volume> volume) : volume_(std::move(volume)) {}
  std::shared_ptr<const Volume> volume_;
};

}  // namespace sdftrack
