// SPDX-License-Identifier: MIT
// A recorded sequence, read image by image: a scene folder in the layout of the BOP benchmark
// (scene_camera.json, depth/, rgb/ or gray/, scene_gt.json, mask_visib/, models/obj_*.ply).
// In the target sdftrack::io, which needs OpenCV; the other headers do not.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "sdftrack/camera.h"

namespace sdftrack {

// An object in an image, as scene_gt.json states it.
struct Instance {
  int object = 0;                                               // the number of its model
  Eigen::Isometry3d T_cam_obj = Eigen::Isometry3d::Identity();  // metres
};

// Used by one thread at a time. A file that is missing or that says something else than it should throws
// std::invalid_argument with its name.
class Sequence {
 public:
  explicit Sequence(const std::filesystem::path& scene_folder);
  Sequence(Sequence&&) noexcept;
  Sequence& operator=(Sequence&&) noexcept;
  ~Sequence();

  int size() const;                   // images
  const DepthCamera& camera() const;  // one for all images
  int id(int i) const;                // number of image i in the names of its files
  // The images belong to the sequence, until the next call. A depth image that cannot be read leaves a frame
  // without depth; colour of another size than the depth image is left out.
  Frame frame(int i);
  // The objects in image i, in the order of the file; none without scene_gt.json.
  const std::vector<Instance>& instances(int i) const;
  // The visible pixels of one of them, one byte for each depth pixel; empty where there is no such file.
  std::vector<std::uint8_t> mask(int i, int instance) const;
  // The mesh of an object, in millimetres. Throws std::invalid_argument where there is none.
  std::filesystem::path model_file(int object) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace sdftrack
