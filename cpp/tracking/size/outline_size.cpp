// SPDX-License-Identifier: MIT
#include "tracking/size/outline_size.h"

#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kMinLines = 30;
constexpr double kDistanceShare = 0.01;  // relative sd of the distance at which an outline is evaluated
constexpr double kCommon_px = 0.5;       // sd of the offset that all lines share

constexpr int kPoseAndSize = 8, kOutlineScale = 6, kOffset = 7;  // unknowns; the strains come after them
constexpr int kUnknownsOfOutline = kPoseAndSize + kStrainModes;

}  // namespace

std::optional<OutlineLook> look_by_outline(const energies::OutlineLines& lines, const OutlineRows& given) {
  if (given.rows.size() < kMinLines || given.rows.size() != lines.lines.size()) return std::nullopt;
  Eigen::Matrix<double, kUnknownsOfOutline, kUnknownsOfOutline> H = decltype(H)::Zero();
  Eigen::Matrix<double, kUnknownsOfOutline, 1> g = decltype(g)::Zero();
  for (std::size_t i = 0; i < given.rows.size(); ++i) {
    const energies::OutlineLine& line = lines.lines[i];
    const energies::OutlineResidual& r = given.rows[i];
    Eigen::Matrix<double, kUnknownsOfOutline, 1> row;
    row.head<6>() = r.J;
    row[kOutlineScale] = -(row[0] * line.p_obj.x + row[1] * line.p_obj.y + row[2] * line.p_obj.z);
    row[kOffset] = 1 / (given.noise * line.sd_px);
    const Vec3d arm = line.p_obj - given.middle_obj;
    row.tail<kStrainModes>() = -strains(row.head<3>(), {arm.x, arm.y, arm.z});
    const double weight = 1 / (1 + 0.5 * r.off * r.off) / given.shared_lines;
    H.noalias() += (weight * row) * row.transpose();
    g -= (weight * r.off) * row;
  }
  const Vec3d along = given.T_obj_cam.R * Vec3d{0, 0, 1};
  const Eigen::Vector3d e(along.x, along.y, along.z);
  const double sd_m = kDistanceShare * inverse(given.T_obj_cam).t.z;
  H.topLeftCorner<3, 3>() += e * e.transpose() / (sd_m * sd_m);
  g.head<3>() += e.dot(given.to_depth.head<3>()) / (sd_m * sd_m) * e;
  H.topLeftCorner<6, 6>().diagonal().array() += 1e-3;
  H(kOutlineScale, kOutlineScale) += 1;
  H(kOffset, kOffset) += 1 / (kCommon_px * kCommon_px);
  const Eigen::Matrix<double, kPoseAndSize, kPoseAndSize> C =
      optim::inverse_symmetric<kPoseAndSize>(H.topLeftCorner<kPoseAndSize, kPoseAndSize>());
  const Eigen::Matrix<double, kStrainModes, kPoseAndSize> beside =
      H.bottomLeftCorner<kStrainModes, kPoseAndSize>();
  const Eigen::Matrix<double, kPoseAndSize, 1> x = C * g.head<kPoseAndSize>();
  return OutlineLook{size_look<kPoseAndSize>(kOutlineScale, x, C, 0, C(kOutlineScale, kOutlineScale)),
                     {H.bottomRightCorner<kStrainModes, kStrainModes>() - beside * C * beside.transpose(),
                      g.tail<kStrainModes>() - beside * x}};
}

}  // namespace sdftrack::tracking
