// SPDX-License-Identifier: MIT
#include "track_results.h"

#include <pybind11/eigen.h>

#include <algorithm>
#include <cmath>

namespace sdftrack::bindings {

namespace {

constexpr const char* kStatus[] = {"ok", "weak", "lost", "bad_frame"};

}  // namespace

py::dict result_to_dict(const tracking::FrameResult& result, const Names& names) {
  const std::vector<tracking::ObjectResult>& results = result.objects;
  const auto n = static_cast<py::ssize_t>(results.size());
  py::array_t<double> poses({n, py::ssize_t{4}, py::ssize_t{4}}),
      covariances({n, py::ssize_t{6}, py::ssize_t{6}}), unstated({n, py::ssize_t{6}, py::ssize_t{6}}),
      twists({n, py::ssize_t{6}});
  py::list status, reason, steps, color_used;
  for (py::ssize_t k = 0; k < n; ++k) {
    const tracking::ObjectResult& r = results[static_cast<std::size_t>(k)];
    double* const pose = poses.mutable_data(k, 0, 0);
    write_matrix(r.T_cam_obj, pose);
    if (std::isnan(r.T_cam_obj.t.x)) std::fill_n(pose, 16, tracking::kUnknown);
    std::copy(r.twist.begin(), r.twist.end(), twists.mutable_data(k, 0));
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariances.mutable_data(k, 0, 0)) =
        r.covariance;
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(unstated.mutable_data(k, 0, 0)) = r.unstated;
    status.append(kStatus[static_cast<int>(r.trust.status)]);
    reason.append(tracking::sentence(r.trust.reason, names));
    color_used.append(r.color_used);
    py::array_t<double> trials({static_cast<py::ssize_t>(r.steps.size()), py::ssize_t{5}});
    double* row = trials.mutable_data();
    for (const tracking::TrackStep& s : r.steps)
      for (const double x : {s.step.cost, s.step.damping, s.step.accepted ? 1.0 : 0.0, s.scale_m,
                             static_cast<double>(s.pixels)})
        *row++ = x;
    steps.append(trials);
  }
  using Object = tracking::ObjectResult;
  return py::dict(
      "poses"_a = poses, "covariances"_a = covariances, "twists"_a = twists, "unstated"_a = unstated,
      "inliers"_a = gathered<double>(results, {}, [](const Object& r) { return r.trust.inliers; }),
      "confidence"_a = gathered<double>(results, {}, [](const Object& r) { return r.trust.confidence; }),
      "runner_up"_a = gathered<double>(results, {}, [](const Object& r) { return r.runner_up; }),
      "energy"_a = gathered<double>(results, {}, [](const Object& r) { return r.cost; }),
      "systematic"_a = gathered<double>(results, {}, [](const Object& r) { return r.systematic_m; }),
      "index"_a = result.index, "status"_a = status, "reason"_a = reason, "steps"_a = steps,
      "color_used"_a = color_used);
}

py::dict judgement_to_dict(const tracking::Fitted& f, const tracking::Trust& trust,
                           const tracking::TrackerOptions& options) {
  py::dict out;
  out["status"] = kStatus[static_cast<int>(trust.status)], out["reason"] = tracking::sentence(trust.reason);
  out["inliers"] = trust.inliers, out["confidence"] = trust.confidence;
  out["covariance"] = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>(f.covariance);
  out["expected"] = f.seen.expected, out["agree"] = f.seen.agree, out["farther"] = f.seen.farther;
  out["nearer"] = f.seen.nearer, out["missing"] = f.seen.missing, out["gap_m"] = f.seen.gap_m;
  out["ends"] = f.outline.ends, out["runs_on"] = f.outline.runs_on;
  out["roughness"] = f.roughness, out["systematic_m"] = f.memory.systematic_m,
  out["evidence"] = tracking::evidence_share(tracking::evidence_of(f, options), 0);
  return out;
}

}  // namespace sdftrack::bindings
