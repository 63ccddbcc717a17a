// SPDX-License-Identifier: MIT
// From the sums of an energy to the reported covariance.
#pragma once

#include <Eigen/Core>

#include "base/rigid.h"
#include "energies/sdf_energy.h"
#include "frame/shape.h"

namespace sdftrack::tracking {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Factors on a derivative by an increment. In units of metres at the object's rim and of one diameter, the
// directions of the increment become comparable.
Vector6d comparable_units(const frame::Shape& shape);

// The information of one observation of sd (diameter, pi) per direction.
Matrix6d weak_knowledge(const frame::Shape& shape);

constexpr double kBlindSlope = 0.03;  // root mean square

// Covariance of the increment (v, w) of T_obj_cam (m, rad): the sandwich A^-1 B A^-1, with one weak
// observation of sd (diameter, pi) per direction. A direction without data (symmetry, a flat view) thus gets
// that variance, never 0. A direction along which the inliers' residuals hardly change (rms slope below
// kBlindSlope, a turn taken at half the diameter) counts as one without data: its remaining slope is the
// grain of the voxels. The other directions get the effect of a common error of the voxels on the pose,
// kGrain voxels over the squared slope (fitted on boxes and ellipsoids with hidden faces): small where the
// surface is seen from all sides, large along a direction that only a few rounded edges hold.
Matrix6d increment_covariance(const energies::EnergySummary& sums, const frame::Shape& shape,
                              double correlation_area_px);

// The response of the increment to a pull (a gradient) of the pixels: A^-1 without the blind directions.
Matrix6d increment_response(const energies::EnergySummary& sums, const frame::Shape& shape);

// Information about the increment without that along the slips, where an outline follows the voxels.
Matrix6d without_slips(const Matrix6d& information, const frame::Shape& shape);

// The same uncertainty in camera axes about the caller's object origin: (x, y, z, rx, ry, rz), t = t^ + d,
// R = Exp(r) R^. T_cam_obj is the centred pose, origin_obj the caller's origin in the centred frame.
Matrix6d camera_covariance(const Matrix6d& increment, const Rigidd& T_cam_obj, Vec3d origin_obj);

// The inverse, for a prior: information of the increment from a covariance in camera axes.
Matrix6d increment_information(const Matrix6d& camera, const Rigidd& T_cam_obj, Vec3d origin_obj);

}  // namespace sdftrack::tracking
