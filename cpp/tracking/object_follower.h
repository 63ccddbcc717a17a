// SPDX-License-Identifier: MIT
// Follows one object to its next pose: attempts of a fit, their judgement, and what is remembered.
#pragma once

#include <memory>
#include <optional>

#include "energies/cuda_work.h"
#include "tracking/frame_context.h"
#include "tracking/result.h"
#include "tracking/search/finder.h"

namespace sdftrack::tracking {

struct TrackerSettings {
  int threads = 1;
  bool recover = true;  // search for lost objects in every frame
  int device = -1;      // the GPU for large sums; -1: none
  Collision collision = Collision::kContact;
  MotionModel motion = MotionModel::kAdaptive;
};

constexpr double kDepthBends_m = 0.015;  // sd of a pose by depth that misfits a whole surface

class ObjectFollower {
 public:
  ObjectFollower(const TrackerOptions& options, const TrackerSettings& settings);

  // Fits the object alone from its expected pose. The object takes over the fitted state.
  ObjectResult follow(FrameContext* context, TrackedObject* object);
  // Fits by the outline in the colour image alone, in a frame without depth (outline_follower.cpp). No result
  // where the options, the colours or the frame do not allow it.
  std::optional<ObjectResult> follow_outline(FrameContext* context, TrackedObject* object);
  Trust judge_followed(const Fitted& fitted, const TrackedObject& object) const;
  // A fit that is already judged: the object takes it over unless it is lost.
  ObjectResult accept(Fitted fitted, Trust trust, const FrameContext& context, TrackedObject* object) const;
  // Learns the object's colours, and those around it, at its pose in this frame.
  void learn_colors(FrameContext* context, TrackedObject* object);
  // Learns the colours inside and around the silhouette at the object's pose, whatever the depth is there.
  void learn_silhouette(const FrameContext& context, TrackedObject* object);
  // At a start: learns the colours in a mask of the depth image, which do not depend on the pose found by
  // depth; without a mask, the colours of the measurements near the surface.
  void learn_colors_at_start(const FrameContext& context, const std::vector<unsigned char>& mask,
                             const Rigidd& T_cam_obj, TrackedObject* object);
  // Fits the outline in the colour image near T_cam_obj (centred), a pose by depth that misfits. No result
  // where too little of the outline stands out.
  std::optional<Fitted> fit_outline(const FrameContext& context, const TrackedObject& object,
                                    const Rigidd& T_cam_obj);
  // Evaluates a given pose: nothing is fitted or remembered. No result where too few measurements are near.
  std::optional<Fitted> look(const frame::DepthFrame& frame, const Camera& camera, const frame::Shape& shape,
                             const Rigidd& T_cam_obj);

  // What other parts build on
  Rigidd expected_pose(const TrackedObject& object, double time_s) const;
  // How far surface points lay from the expected pose, lately.
  double step_m(const TrackedObject& object) const;
  // neighbors: of this object; nullptr: the object is fitted as if it were alone.
  FitTarget target_of(const FrameContext& context, const TrackedObject& object, const Rigidd& expected,
                      const Neighbors* neighbors) const;
  std::optional<Fitted> fit_near(const FrameContext& context, const frame::DepthFrame& frame,
                                 const TrackedObject& object, const Rigidd& expected,
                                 const Neighbors* neighbors);
  // Further attempts (fit_retries.cpp) while `best` does not match the object's usual share and cost.
  std::optional<Fitted> fit_further(FrameContext* context, const frame::DepthFrame& frame,
                                    const TrackedObject& object, const Rigidd& expected,
                                    const Neighbors* neighbors, std::optional<Fitted> best);
  // What a search finds in those measurements of `frame` that no other object explains.
  std::optional<Found> search(FrameContext* context, const frame::DepthFrame& frame,
                              const TrackedObject& object, SearchQuery query, double prior_log_odds);
  // Only a fine fit from a pose (centred), to compare that pose with others in the same frame.
  std::optional<Fitted> fit_finely(const FrameContext& context, const TrackedObject& object,
                                   const Rigidd& T_cam_obj);
  const TrackerOptions& options() const { return options_; }
  energies::CudaWork* device() const { return device_.get(); }
  // Memory for the records of trials is reused: given back, and taken by the next fit.
  std::vector<TrackStep> spare_steps() { return fitter_.spare_steps(); }
  void give_back(std::vector<TrackStep>&& steps) { fitter_.give_back(std::move(steps)); }

 private:
  void learn_outline(const FrameContext& context, TrackedObject* object);
  ObjectResult follow_depth(FrameContext* context, TrackedObject* object);
  // Follows by the outline where the frame has depth, but hardly any on the object; no result elsewhere.
  std::optional<ObjectResult> follow_unread(FrameContext* context, TrackedObject* object);
  std::optional<Fitted> fit(const FrameContext& context, const frame::DepthFrame& frame,
                            const FitTarget& target, const Attempt& attempt);
  Fitted polished(const FrameContext& context, const frame::DepthFrame& frame, const TrackedObject& object,
                  const Neighbors* neighbors, const Fitted& wide);
  bool expects_motion(const TrackedObject& object) const;
  std::optional<Fitted> settled(const FrameContext& context, const frame::DepthFrame& frame,
                                const TrackedObject& object, const Rigidd& given, const Neighbors* neighbors);
  Attempt fine_attempt(const TrackedObject& object, const Rigidd& T_cam_obj) const;
  Attempt narrow_attempt(const Rigidd& T_cam_obj) const;
  Attempt wide_attempt(const TrackedObject& object, const Rigidd& expected, double time_s) const;
  Matrix6d lag_covariance(const Fitted& fitted, double time_s, const TrackedObject& object) const;
  void move_on(double time_s, const TrackedObject& object, Fitted* fitted) const;
  void keep(const Fitted& fitted, const Trust& trust, double time_s, TrackedObject* object) const;

  TrackerOptions options_;
  TrackerSettings settings_;
  std::unique_ptr<energies::CudaWork> device_;  // nullptr without
  PoseFitter fitter_;
  ObjectFinder finder_;
  ColorReader color_reader_;
  appearance::ColorCounts color_counts_;
};

}  // namespace sdftrack::tracking
