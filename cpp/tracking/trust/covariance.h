// SPDX-License-Identifier: MIT
// From the sums of an energy to the covariance that a user reads.
#pragma once

#include <Eigen/Core>

#include "base/rigid.h"
#include "energies/sdf_energy.h"
#include "frame/shape.h"

namespace sdftrack::tracking {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// In units of metres at the object's rim and of one diameter, directions of an increment may be compared:
// what a derivative by it is multiplied by.
Vector6d comparable_units(const frame::Shape& shape);

// The information of one observation of sd (diameter, pi) per direction.
Matrix6d weak_knowledge(const frame::Shape& shape);

constexpr double kBlindSlope = 0.03;  // root mean square

// Covariance of the increment (v, w) of T_obj_cam (m, rad): the sandwich A^-1 B A^-1, with one weak
// observation of sd (diameter, pi) per direction, so that a direction without data (symmetry, a flat view)
// gets that variance, never 0. A direction along which the inliers' residuals hardly change (rms slope below
// kBlindSlope, a turn taken at half the diameter) counts as one without data: what is left there is the grain
// of the voxels. To the rest comes what a common error of the voxels does to the pose, kGrain voxels over the
// squared slope (fitted on boxes and ellipsoids with hidden faces): little where the surface is seen from all
// sides, much along a direction that only a few rounded edges hold.
Matrix6d increment_covariance(const energies::EnergySummary& sums, const frame::Shape& shape,
                              double correlation_area_px);

// How the increment answers a pull (a gradient) of the pixels: A^-1, blind directions left out.
Matrix6d increment_response(const energies::EnergySummary& sums, const frame::Shape& shape);

// Information about the increment without what the shape's slips would have: an outline follows the grain of
// the voxels there.
Matrix6d without_slips(const Matrix6d& information, const frame::Shape& shape);

// The same uncertainty in camera axes about the caller's object origin: (x, y, z, rx, ry, rz), t = t^ + d,
// R = Exp(r) R^. T_cam_obj is the centred pose, origin_obj the caller's origin in the centred frame.
Matrix6d camera_covariance(const Matrix6d& increment, const Rigidd& T_cam_obj, Vec3d origin_obj);

// The way back, for a prior: information of the increment from a covariance in camera axes.
Matrix6d increment_information(const Matrix6d& camera, const Rigidd& T_cam_obj, Vec3d origin_obj);

}  // namespace sdftrack::tracking
