// SPDX-License-Identifier: MIT
// The tracker for Python: it keeps the volumes alive and rejects use by two threads at once.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "appearance.h"
#include "array.h"
#include "release_gil.h"
#include "tracking/start/start.h"
#include "tracking/tracker.h"
#include "volume.h"

namespace sdftrack::bindings {

using PyVolume = std::tuple<py::array, double, std::array<double, 3>>;  // values, voxel (m), origin (m)

using Names = std::vector<std::string>;

// A frame from Python. depth, mask and colour may be None; without depth, `error` may give the reason.
struct PyFrame {
  py::object depth, mask, color, color_map;
  double time_s;
  std::string error;
};

class PyTracker {
 public:
  PyTracker(const std::vector<PyVolume>& shapes, const Camera& camera,
            const tracking::TrackerOptions& options, int threads, bool recover, tracking::MotionModel motion,
            int device, tracking::Collision collision);
  // names: of the objects, for the texts of the reasons. A place may also be a click.
  py::dict start(const PyFrame& frame, const py::list& places, const Names& names);
  py::dict track(const PyFrame& frame, const Names& names);
  py::dict recover(const PyFrame& frame, const std::vector<int>& objects, const py::list& places,
                   const Names& names);
  // The places with masks or boxes in place of clicks; masks of another size than the shape are refused.
  py::list located(const PyFrame& frame, const py::list& places);
  // The region (H, W) bool of a click on object k, and the box to search in its place or None.
  py::tuple place_of_click(const PyFrame& frame, int k, const std::array<double, 2>& px);
  // ValueError, a sentence about `name`, if a mask is of another size than object k.
  void check_mask_size(const PyFrame& frame, int k, const py::object& mask, const std::string& name);
  // Poses (M, 4, 4) in a frame outside the sequence, and whether each pose is sure.
  py::tuple revisit(const PyFrame& frame);
  // The tracker's judgement of object k at an unchanged pose, with its grounds; None: too few measurements.
  py::object judge(const PyFrame& frame, int k, const py::array& T);
  // Soft weights (H, W, M) and P_f (H, W) of the last poses in this frame.
  py::tuple membership(const PyFrame& frame);

  int add(const PyVolume& shape, const py::object& place);
  void remove(int k);
  // poses: (M, 4, 4), NaN: not known; tracking continues from the others.
  void replace_shapes(const std::vector<PyVolume>& shapes, const py::array& poses);
  // seen: uint16 [z, y, x], how much of the surface was seen near each voxel; less than `least` is unknown.
  // boxes: int32 (n, 6), voxels x0 y0 z0 x1 y1 z1 that contain the surface.
  void reshape(int k, const PyVolume& shape, const py::array& seen, int least, const py::array& boxes,
               const std::optional<py::array>& colors);
  // colors: uint16 (z, y, x, 4) of object k's volume.
  void paint(int k, const py::array& colors);
  void set_camera(const Camera& camera);
  void set_pose(int k, const py::array& T, const std::optional<tracking::Matrix6d>& covariance);
  void set_symmetry(int k, const py::array& discrete, const py::array& axes);
  void mark_unfound(int k, const std::string& kind);
  // For a model with estimated scale (tracker.h).
  void free_scale(int k);
  // Values, voxel size and origin of object k as it is enlarged; None: its voxels still have this size.
  py::object enlarged_volume(int k, double voxel_m);
  std::pair<double, double> scale(int k);  // log scale and its sd
  // Whether in the last frame only open directions count against the pose.
  bool is_sure(int k);
  py::array_t<double> alternative_poses(int k);
  double evidence(int k);

  // Records of the sequence. best: (M, 4, 4), NaN: no good pose yet.
  int index() const { return tracker_->last_result().index; }
  // Delay in seconds, its sd, and the number of frames that measured it; 0 frames: not known.
  std::tuple<double, double, int> color_delay();
  py::array_t<double> best();
  void resume(int index, double time_s, const std::vector<bool>& followed, const py::array& best);
  void interrupt(int index);
  // All data that later frames depend on, except shapes, camera and settings (base/state_archive.h).
  py::bytes state();
  bool set_state(const py::bytes& state);

  // Calls work(frame) on the core's form of the frame, without the interpreter's lock.
  template <class Release = ReleaseGil, class Work>
  void run(const PyFrame& frame, const Work& work) {
    const appearance::ColorImage image = color_view(frame.color, frame.color_map);
    const appearance::ColorImage* const color = image.rgb ? &image : nullptr;
    if (frame.depth.is_none()) {
      const Release release;
      work(tracker_->make_unreadable_frame(frame.error, frame.time_s, color));
      return;
    }
    const ImageView<float> view = image_view(frame.depth.cast<py::array>(), "depth", tracker_->camera());
    const unsigned char* mask_data = mask_view(frame.mask, tracker_->camera());
    const Release release;
    work(tracker_->make_frame(view, mask_data, frame.time_s, color));
  }
  tracking::Tracker& core() { return *tracker_; }
  // Warns if the depth of a frame seems to be along each pixel's ray; without the interpreter's lock it may
  // only be found out.
  static void warn_of_ray_length();

 private:
  void check_object(int k) const;
  // As pose_hint_from; or (x, y): a click.
  std::vector<tracking::StartHint> start_hints_from(const py::list& places) const;
  std::vector<tracking::PoseHint> hints_from(const py::list& places) const;
  tracking::Poses poses_from(const py::array& poses) const;
  // The arrays of an object's shape, released with the object.
  struct Held {
    py::array values, seen, colors;
  };
  static std::vector<SdfView> views_of(const std::vector<PyVolume>& shapes, std::vector<Held>* held);

  std::vector<Held> held_;  // per object
  std::unique_ptr<tracking::Tracker> tracker_;
  std::atomic<bool> busy_{false};
};

}  // namespace sdftrack::bindings
