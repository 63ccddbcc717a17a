// SPDX-License-Identifier: MIT
#include "tracking/size/outline_size.h"

#include "optim/dense.h"

namespace sdftrack::tracking {

namespace {

constexpr std::size_t kMinLines = 30;
constexpr double kDistanceShare = 0.01;  // sd of the distance at which an outline is judged, over itself
constexpr double kCommon_px = 0.5;       // sd of the offset that all lines share

}  // namespace

std::optional<SizeLook> size_by_outline(const energies::OutlineLines& lines,
                                        const std::vector<energies::OutlineResidual>& rows, double noise,
                                        const Rigidd& T_obj_cam, const Vector6d& to_depth,
                                        double shared_lines) {
  if (rows.size() < kMinLines || rows.size() != lines.lines.size()) return std::nullopt;
  Eigen::Matrix<double, 8, 8> H = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> g = Eigen::Matrix<double, 8, 1>::Zero();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const energies::OutlineLine& line = lines.lines[i];
    Eigen::Matrix<double, 8, 1> row;
    row.head<6>() = rows[i].J;
    row[6] = -(row[0] * line.p_obj.x + row[1] * line.p_obj.y + row[2] * line.p_obj.z);
    row[7] = 1 / (noise * line.sd_px);
    const double weight = 1 / (1 + 0.5 * rows[i].off * rows[i].off) / shared_lines;
    H.noalias() += (weight * row) * row.transpose();
    g -= (weight * rows[i].off) * row;
  }
  const Vec3d along = T_obj_cam.R * Vec3d{0, 0, 1};
  const Eigen::Vector3d e(along.x, along.y, along.z);
  const double sd_m = kDistanceShare * inverse(T_obj_cam).t.z;
  H.topLeftCorner<3, 3>() += e * e.transpose() / (sd_m * sd_m);
  g.head<3>() += e.dot(to_depth.head<3>()) / (sd_m * sd_m) * e;
  H.topLeftCorner<6, 6>().diagonal().array() += 1e-3;
  H(6, 6) += 1;
  H(7, 7) += 1 / (kCommon_px * kCommon_px);
  const Eigen::Matrix<double, 8, 8> C = optim::inverse_symmetric<8>(H);
  return size_look<8>(6, C * g, C, 0, C(6, 6));
}

}  // namespace sdftrack::tracking
