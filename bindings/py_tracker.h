// SPDX-License-Identifier: MIT
// The tracker as Python holds it: it keeps the volumes alive, and refuses use by two threads at once.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "array.h"
#include "tracking/tracker.h"

namespace sdftrack {

using PyVolume = std::tuple<py::array, double, std::array<double, 3>>;  // values, voxel (m), origin (m)

class PyTracker {
 public:
  PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera, const TrackerOptions& options,
            int threads, bool recover, MotionModel motion, bool cuda, Collision collision);
  py::dict start(const py::array& depth, const py::object& mask, double time_s, const py::list& places,
                 const py::object& color, const py::object& color_map);
  py::dict track(const py::array& depth, const py::object& mask, double time_s, const py::object& color,
                 const py::object& color_map);
  py::dict recover(const py::array& depth, const py::object& mask, double time_s,
                   const std::vector<int>& objects, const py::list& places, const py::object& color,
                   const py::object& color_map);
  // What the tracker would say of object k at a pose as it is, and what it says it by; None: too few
  // readings.
  py::object judge(const py::array& depth, const py::object& mask, int k, const py::array& T);
  // Where object k, padded, may be seen at a pose: x0, y0, x1, y1, half open.
  std::array<int, 4> region(int k, const py::array& T, double padding_m);
  // P_f (h, w) of a region by object k's colours (NaN: not known), and the region's colours (h, w, 3).
  py::tuple look_at(const py::array& depth, const py::object& color, const py::object& color_map, int k,
                    const std::array<int, 4>& region);
  // Soft weights (H, W, M) and P_f (H, W) of the last poses in this frame.
  py::tuple membership(const py::array& depth, const py::object& color, const py::object& color_map);

  int add(const PyVolume& shape, const py::object& place);
  void remove(int k);
  // seen: uint16 [z, y, x], how much of the surface was seen near each voxel; less than `least` is unknown.
  // boxes: int32 (n, 6), voxels x0 y0 z0 x1 y1 z1 that hold the surface.
  void reshape(int k, const PyVolume& shape, const py::array& seen, int least, const py::array& boxes,
               const std::optional<py::array>& colors);
  // colors: uint16 (z, y, x, 4) beside object k's volume.
  void paint(int k, const py::array& colors);
  void set_camera(const Camera& camera);
  void set_pose(int k, const py::array& T, const std::optional<Matrix6d>& covariance);
  std::vector<std::pair<int, int>> overlaps(const std::vector<int>& of);

 private:
  void check_object(int k) const;
  // None: anywhere; (4, 4) float64: a pose; H x W uint8: a mask; (x, y, w, h): a box.
  Whereabouts place_from(const py::object& place) const;
  std::vector<Whereabouts> places_from(const py::list& places) const;
  template <class Work>
  py::dict run(const py::array& depth, const py::object& mask, double time_s, const ColorImage& image,
               const Work& work);

  std::vector<py::array> volumes_;
  std::unique_ptr<Tracker> tracker_;
  std::atomic<bool> busy_{false};
};

}  // namespace sdftrack
