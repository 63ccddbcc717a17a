// SPDX-License-Identifier: MIT
#include "sdftrack/shape.h"

#include <stdexcept>

#include "sdf/mesh/mesh_file.h"
#include "sdftrack/shape_volume.h"

namespace sdftrack {

namespace {

sdf::MeshVolume volume_of(const sdf::MeshView& mesh, const ShapeOptions& options) {
  sdf::MeshVolumeOptions requested;
  requested.voxels = options.voxels;
  if (options.unit_m != 0) requested.unit_m = options.unit_m;
  requested.close_holes = options.close_holes, requested.threads = options.threads;
  return sdf::mesh_volume(mesh, requested);
}

}  // namespace

Shape Shape::from_mesh(const Vertices& vertices, const Faces& faces, const ShapeOptions& options) {
  if (faces.size() > 0 && (faces.minCoeff() < 0 || faces.maxCoeff() >= vertices.cols()))
    throw std::invalid_argument("faces: expected vertices 0.." + std::to_string(vertices.cols() - 1));
  // Both matrices hold one column of three numbers after the other, as the lists do.
  const sdf::MeshView mesh{reinterpret_cast<const Vec3d*>(vertices.data()), std::size_t(vertices.cols()),
                           reinterpret_cast<const sdf::Face*>(faces.data()), std::size_t(faces.cols())};
  return Shape(std::make_shared<const Volume>(Volume{volume_of(mesh, options)}));
}

Shape Shape::from_mesh_file(const std::filesystem::path& file, const ShapeOptions& options) {
  return Shape(
      std::make_shared<const Volume>(Volume{volume_of(sdf::read_mesh_file(file.string()).view(), options)}));
}

const std::vector<std::string>& Shape::warnings() const { return volume_->mesh.warnings; }

double Shape::voxel_m() const { return volume_->mesh.grid.voxel_m; }

double Shape::distance_m(const Eigen::Vector3d& p_obj) const {
  double phi;
  Vec3d gradient;
  sample(volume_->mesh.view(), Vec3d{p_obj.x(), p_obj.y(), p_obj.z()}, &phi, &gradient);
  return phi;
}

}  // namespace sdftrack
