// SPDX-License-Identifier: MIT
#include <pybind11/eigen.h>

#include <array>

#include "appearance.h"
#include "array.h"
#include "base/to_int.h"
#include "energies/outline_offset.h"
#include "release_gil.h"
#include "tracking/fit/outline_lines.h"
#include "tracking/size/outline_size.h"
#include "tracking/trust/color_projection.h"
#include "volume.h"

namespace sdftrack::bindings {

namespace {

using energies::OutlineLines;

OutlineLines lines_from(const py::array& lines, const Camera& camera, const appearance::ColorMap& map) {
  const py::ssize_t n = lines.ndim() > 0 ? lines.shape(0) : 0;
  const double* row = borrow<double>(lines, "lines", {n, 9});
  OutlineLines out;
  out.view = tracking::color_projection(camera, map);
  for (py::ssize_t i = 0; i < n; ++i, row += 9)
    out.lines.push_back({{row[0], row[1], row[2]}, {row[3], row[4]}, {row[5], row[6]}, row[7], row[8]});
  return out;
}

py::tuple outline_energy(const py::array& lines, const Camera& camera, const appearance::ColorMap& map,
                         const py::array& T_obj_cam, double noise, double common_sd_px, double shared_lines) {
  OutlineLines made = lines_from(lines, camera, map);
  optim::State x;
  x.K = camera.K;
  x.T_obj_cam.assign(1, rigid_from(T_obj_cam, "T_obj_cam"));
  energies::OutlineEnergy energy(&made, {noise, common_sd_px, shared_lines});
  optim::NormalEquations at;
  at.reset(6);
  energy.linearize(x, &at);
  std::vector<energies::OutlineResidual> rows;
  energy.residuals(x.T_obj_cam[0], &rows);
  std::vector<double> off;
  for (const energies::OutlineResidual& row : rows) off.push_back(row.off);
  return py::make_tuple(energy.cost(x), at.gradient, at.hessian, off);
}

py::object outline_size(const py::array& lines, const Camera& camera, const appearance::ColorMap& map,
                        const py::array& T_obj_cam, double noise, const tracking::Vector6d& to_depth,
                        double shared_lines, const Vec3d& middle) {
  OutlineLines made = lines_from(lines, camera, map);
  const Rigidd T = rigid_from(T_obj_cam, "T_obj_cam");
  std::vector<energies::OutlineResidual> rows;
  energies::OutlineEnergy(&made, {noise, 0, shared_lines}).residuals(T, &rows);
  const auto look = tracking::look_by_outline(made, {rows, noise, T, to_depth, shared_lines, middle});
  if (!look) return py::none();
  return py::make_tuple(look->size.log_scale, look->size.own_var, look->size.shared_var, look->size.pull,
                        look->form.information, look->form.pull);
}

void check_reach(int reach) {
  if (reach < 1 || reach > energies::kMaxReach)
    throw py::value_error("reach: expected 1.." + std::to_string(energies::kMaxReach) + ", got " +
                          std::to_string(reach));
}

py::tuple offset_of(const py::array& chance, int reach) {
  check_reach(reach);
  const energies::OutlineOffset found = energies::outline_offset(
      borrow<float>(chance, "chance", {2 * (reach + energies::kBeyondReach) + 1}), reach);
  return py::make_tuple(found.mean, found.sd, found.contrast);
}

appearance::ColorModel model_of(const std::tuple<py::array, py::array>& counts) {
  appearance::ColorCounts seen;
  const float* f = borrow<float>(std::get<0>(counts), "object", {appearance::kColorBins});
  const float* b = borrow<float>(std::get<1>(counts), "background", {appearance::kColorBins});
  for (int i = 0; i < appearance::kColorBins; ++i) {
    const auto k = static_cast<std::size_t>(i);
    seen.object[k] = f[i], seen.background[k] = b[i];
    seen.object_pixels += to_int(f[i]), seen.object_weight += static_cast<double>(f[i]);
    seen.background_pixels += to_int(b[i]);
  }
  appearance::ColorModel model;
  model.update(seen, 1, 1);
  if (!model.known()) throw py::value_error("counts: expected at least 30 pixels of the object");
  return model;
}

// Probabilities after these pixels were seen: frames in ascending order; the memory opens once per frame.
std::vector<float> local_chances(const std::tuple<py::array, py::array>& counts, const py::array& points,
                                 const std::vector<bool>& object, const std::vector<int>& bins,
                                 const std::vector<int>& frames, float rate, const py::array& asked,
                                 const std::vector<int>& asked_bins) {
  const auto n = static_cast<py::ssize_t>(frames.size()), m = static_cast<py::ssize_t>(asked_bins.size());
  if (object.size() != frames.size() || bins.size() != frames.size())
    throw py::value_error("object, bins, frames: expected the same lengths");
  const appearance::ColorModel whole = model_of(counts);
  const double* p = borrow<double>(points, "points", {n, 3});
  appearance::LocalColors local;
  for (std::size_t i = 0; i < frames.size(); ++i, p += 3) {
    if (i == 0 || frames[i] != frames[i - 1]) local.open(rate);
    local.add(appearance::LocalColors::place_of({p[0], p[1], p[2]}), object[i], bins[i]);
  }
  const double* q = borrow<double>(asked, "asked", {m, 3});
  std::vector<float> found;
  for (const int bin : asked_bins) {
    found.push_back(local.chance(whole, appearance::LocalColors::place_of({q[0], q[1], q[2]}), bin));
    q += 3;
  }
  return found;
}

// Rows of (X, Y, Z, c_u, c_v, n_u, n_v, offset, sd).
py::array_t<double> outline_lines(const PyVolume& shape, const Camera& camera, const py::object& depth_m,
                                  const py::array& color, const appearance::ColorMap& map,
                                  const std::tuple<py::array, py::array>& counts, const py::array& T_cam_obj,
                                  int points, int reach_px) {
  check_reach(reach_px);
  if (points < 1) throw py::value_error("points: expected 1 or more, got " + std::to_string(points));
  const frame::Shape made = frame::make_shape(volume_view(shape), 960, 120);
  const Rigidd T = rigid_from(T_cam_obj, "T_cam_obj");
  const appearance::ColorImage image = color_view(color, py::cast(map));
  const appearance::ColorModel model = model_of(counts);
  frame::DepthFrame frame{};
  frame.depth_m = {nullptr, camera.width, camera.height};
  if (!depth_m.is_none()) frame.depth_m = image_view(depth_m.cast<py::array>(), "depth", camera);
  frame.color = &image;
  tracking::ContourLibrary contours;
  OutlineLines found;
  tracking::find_outline_lines(frame, camera, made, {&model}, {T.R, T * made.centre_obj}, {points, reach_px},
                               &contours, &found);
  std::vector<double> rows;
  for (const energies::OutlineLine& l : found.lines) {
    const Vec3d p = l.p_obj + made.centre_obj;
    for (const double v :
         {p.x, p.y, p.z, l.centre_px.x, l.centre_px.y, l.normal.x, l.normal.y, l.offset_px, l.sd_px})
      rows.push_back(v);
  }
  return to_numpy(std::move(rows), {static_cast<py::ssize_t>(found.lines.size()), 9});
}

}  // namespace

void bind_outline(py::module_& m) {
  m.def("outline_offset", &offset_of, "chance"_a, "reach"_a,
        "Mean, sd (steps) and contrast of where along a line the outline is.");
  m.def("outline_lines", &outline_lines, "shape"_a, "camera"_a, "depth"_a, "color"_a, "color_map"_a,
        "counts"_a, "T_cam_obj"_a, "points"_a = 200, "reach_px"_a = 8,
        "Lines across the outline: (n, 9) rows of X, Y, Z (m, object), centre and normal (px), offset, sd.");
  m.def("local_color_chances", &local_chances, "counts"_a, "points"_a, "object"_a, "bins"_a, "frames"_a,
        "rate"_a, "asked"_a, "asked_bins"_a,
        "Chances of colours to be the object's at places, after pixels of both sides were seen there.");
  m.def("outline_energy", &outline_energy, "lines"_a, "camera"_a, "color_map"_a, "T_obj_cam"_a,
        "noise"_a = 1.0, "common_sd_px"_a = 0.0, "shared_lines"_a = 1.0,
        "Cost, gradient, Hessian and residuals (over their sd).");
  m.def("outline_size", &outline_size, "lines"_a, "camera"_a, "color_map"_a, "T_obj_cam"_a, "noise"_a,
        "to_depth"_a, "shared_lines"_a, "middle"_a = Vec3d{},
        "Log scale, own and shared variance, pull; information and pull of a strain about `middle`.\n\n"
        "None of too few lines.");
}

}  // namespace sdftrack::bindings
