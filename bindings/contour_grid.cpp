// SPDX-License-Identifier: MIT
// Steps of the contour tracker by themselves, on arrays: for the self test, experiments and tests.
#include <algorithm>

#include "contour_core.h"

namespace sdftrack::bindings {

namespace {

py::array_t<float> phi_of(const contour::ContourGrid& grid) { return to_numpy(grid.phi, {grid.ny, grid.nx}); }

contour::ContourGrid contour_grid_from(const py::array& phi, const std::array<double, 6>& warp) {
  const float* values = borrow<float>(phi, "phi", {-1, -1});
  contour::ContourGrid grid;
  grid.ny = static_cast<int>(phi.shape(0)), grid.nx = static_cast<int>(phi.shape(1));
  if (grid.nx < 3 || grid.ny < 3) throw std::invalid_argument("phi: expected at least 3 x 3 cells");
  grid.phi.assign(values, values + phi.size());
  grid.inside = grid.all();
  grid.warp = {{warp[0], warp[1], warp[2], warp[3]}, {warp[4], warp[5]}};
  return grid;
}

py::array_t<float> contour_steps(const py::array& phi, const py::array& foreground, int steps,
                                 const contour::ContourOptions& options, int device) {
  contour::ContourGrid grid = contour_grid_from(phi, {1, 0, 0, 1, 0, 0});
  const float* p = borrow<float>(foreground, "foreground", {phi.shape(0), phi.shape(1)});
  contour::EvolutionWork work;
  work.device = device;
  work.foreground.assign(p, p + grid.phi.size());
  contour::find_band(grid, options.band, &work.band);
  contour::evolve_contour(options, steps, &work, &grid);
  return phi_of(grid);
}

// The posterior at the pixels of `image`, by a model that was learned from `learned` and then pooled with
// each of `pooled`. phi is placed by warp.
py::array_t<float> contour_posterior(const py::array& learned, const py::array& image, const py::array& phi,
                                     const std::array<double, 6>& warp,
                                     const contour::ContourOptions& options,
                                     const std::vector<py::array>& pooled) {
  const contour::ContourGrid grid = contour_grid_from(phi, warp);
  contour::RegionModel model(options);
  if (!model.learn(color_view(learned), grid, 1, 1))
    throw std::invalid_argument("phi: expected pixels inside and outside on the image, got none of a kind");
  for (const py::array& more : pooled)
    model.learn(color_view(more), grid, static_cast<double>(options.object_rate),
                static_cast<double>(options.background_rate));
  const contour::RgbView view = color_view(image);
  contour::PosteriorImage posterior;
  model.posterior(view, grid, grid.all(), &posterior);
  std::vector<float> all(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height), 0.5f);
  for (int y = posterior.rect.y0; y < posterior.rect.y1; ++y)
    std::copy_n(posterior.row(y), posterior.rect.width(),
                all.data() + static_cast<std::ptrdiff_t>(y) * view.width + posterior.rect.x0);
  return to_numpy(std::move(all), {view.height, view.width});
}

}  // namespace

void bind_contour_grid(py::module_& m) {
  m.def("contour_steps", &contour_steps, "phi"_a, "foreground"_a, "steps"_a, "options"_a, "device"_a = -1,
        "phi after steps of the evolution.");
  m.def("contour_posterior", &contour_posterior, "learned"_a, "image"_a, "phi"_a, "warp"_a, "options"_a,
        "pooled"_a = std::vector<py::array>{});
}

}  // namespace sdftrack::bindings
