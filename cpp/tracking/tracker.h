// SPDX-License-Identifier: MIT
// The per-frame recipe: fit from the last pose, wider where that does not convince, and judge.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/fit.h"
#include "tracking/plane.h"

namespace sdftrack {

struct ObjectResult {
  Rigidd T_cam_obj;     // of the caller's object frame; the last good one when lost
  Matrix6d covariance;  // NaN when lost
  Trust trust;
  double cost = 0;  // mean per pixel of the last stage
  std::vector<TrackStep> steps;
};

// Tracks shapes one by one, each from its own last pose.
class Tracker {
 public:
  // The volumes behind the shapes' views belong to the caller and outlive the tracker.
  Tracker(const std::vector<SdfView>& shapes, const Camera& camera, const TrackerOptions& options,
          int threads);

  int object_count() const { return static_cast<int>(objects_.size()); }
  const Camera& camera() const { return camera_; }
  void set_camera(const Camera& camera);  // of the frames to come

  // Forgets all history and fits from the given poses (caller's object frames).
  std::vector<ObjectResult> start(const ImageView<float>& depth_m, const unsigned char* mask,
                                  const std::vector<Rigidd>& T_cam_obj);
  std::vector<ObjectResult> track(const ImageView<float>& depth_m, const unsigned char* mask);
  void set_pose(int k, const Rigidd& T_cam_obj);

 private:
  struct Object {
    std::shared_ptr<const Shape> shape;  // objects of the same volume share it
    Rigidd T_cam_obj;                    // centred frame
    FitMemory memory;
    Rigidd last_motion;      // of the last two accepted poses: T_cam_obj <- last_motion T_cam_obj
    double usual_share = 0;  // of agreeing surface points, lately
  };

  std::vector<ObjectResult> track_all(const DepthFrame& frame);
  void follow_plane(const DepthFrame& frame);
  ObjectResult track_one(const DepthFrame& frame, Object* object);
  std::optional<Fitted> fit(const DepthFrame& frame, const Object& object, const Attempt& attempt,
                            const Rigidd& expected);
  Fitted polished(const DepthFrame& frame, const Object& object, const Fitted& wide);
  ObjectResult judged(Fitted fitted, Object* object);
  static void keep(const Fitted& fitted, Object* object);
  Attempt narrow_attempt(const Rigidd& T_cam_obj) const;
  Attempt wide_attempt(const Object& object) const;
  ObjectResult lost(const Object& object, std::string reason, Status status) const;
  DepthFrame make_frame(const ImageView<float>& depth_m, const unsigned char* mask) const;

  std::vector<Object> objects_;
  Camera camera_;
  TrackerOptions options_;
  std::vector<float> rays_;  // empty without distortion
  PlaneFollower plane_;
  PoseFitter fitter_;
};

}  // namespace sdftrack
