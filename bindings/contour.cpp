// SPDX-License-Identifier: MIT
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <optional>

#include "array.h"
#include "busy.h"
#include "contour/option_schema.h"
#include "contour/steps_cuda.h"
#include "contour/template_scores.h"
#include "contour/tracker.h"
#include "option_binding.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

contour::RgbView color_view(const py::array& image) {
  const unsigned char* rgb = borrow<unsigned char>(image, "image", {-1, -1, 3});
  return {rgb, static_cast<int>(image.shape(1)), static_cast<int>(image.shape(0))};
}

contour::ContourOptions options_from(const py::dict& given) {
  const py::object options = py::cast(contour::ContourOptions{});
  for (const auto& [name, value] : given) {
    if (!py::hasattr(options, name))
      throw std::invalid_argument("options: expected options of ContourTracker, got \"" +
                                  py::cast<std::string>(name) + "\"");
    py::setattr(options, name, value);
  }
  const auto out = py::cast<contour::ContourOptions>(options);
  out.check();
  return out;
}

py::dict options_of(const contour::ContourOptions& o) {
  py::dict out;
  for (const OptionDescription& option : describe_options(o)) out[option.name.c_str()] = option.value;
  return out;
}

// What `call` returns, without the interpreter's lock.
template <class Call>
auto unlocked(const Call& call) {
  const ReleaseGil release;
  return call();
}

struct ContourCore {
  contour::ContourTracker tracker;
  std::atomic<bool> busy{false};
  explicit ContourCore(const py::dict& options) : tracker(options_from(options)) {}
};

py::array_t<float> phi_of(const contour::ContourGrid& grid) { return to_numpy(grid.phi, {grid.ny, grid.nx}); }

constexpr const char* kStatus[] = {"ok", "weak", "lost"};

// A copy that cannot be written.
template <class T, class Values>
py::array_t<T> frozen(const Values& values, std::vector<py::ssize_t> shape) {
  py::array_t<T> out(std::move(shape));
  std::copy(values.begin(), values.end(), out.mutable_data());
  out.attr("setflags")(py::arg("write") = false);
  return out;
}

// The results of the phases, in numpy's arrays.
struct Observation {
  contour::ContourReport report;
  py::array_t<float> phi;
  py::array_t<double> warp;

  Observation(const contour::ContourReport& r, const contour::ContourShape& shape)
      : report(r),
        phi(frozen<float>(shape.phi, {shape.ny, shape.nx})),
        warp(frozen<double>(shape.warp, {3, 3})) {}
  explicit Observation(const contour::ContourObservation& of) : Observation(of.report, of.shape) {}
};

struct Frame : Observation {
  py::array_t<bool> mask;

  explicit Frame(const contour::ContourFrame& of)
      : Observation(of.report, of.shape), mask(frozen<bool>(of.mask, {of.height, of.width})) {}
};

void bind_phases(py::module_& m) {
  py::enum_<contour::ShapeJudgement>(m, "ShapeJudgement", "What a memory says of a frame's shape.")
      .value("none", contour::ShapeJudgement::kNone)
      .value("unoccluded", contour::ShapeJudgement::kUnoccluded)
      .value("occluded", contour::ShapeJudgement::kOccluded)
      .value("novel", contour::ShapeJudgement::kNovel);
  py::class_<Observation>(m, "ContourObservation", "Where the object is in an image; nothing is learned yet.")
      .def_property_readonly("status",
                             [](const Observation& o) { return kStatus[static_cast<int>(o.report.status)]; })
      .def_property_readonly("reason", [](const Observation& o) { return o.report.reason; })
      .def_property_readonly("confidence", [](const Observation& o) { return o.report.confidence; })
      .def_property_readonly("contrast", [](const Observation& o) { return o.report.contrast; })
      .def_property_readonly("likeness", [](const Observation& o) { return o.report.likeness; })
      .def_property_readonly("overlap", [](const Observation& o) { return o.report.overlap; })
      .def_property_readonly("mean_log", [](const Observation& o) { return o.report.mean_log; })
      .def_property_readonly("phi", [](const Observation& o) { return o.phi; })
      .def_property_readonly("warp", [](const Observation& o) { return o.warp; });
  py::class_<Frame, Observation>(m, "ContourFrame", "A frame's result, once it is finished.")
      .def_property_readonly("mask", [](const Frame& f) { return f.mask; });
}

contour::ContourGrid grid_from(const py::array& phi, const std::array<double, 6>& warp) {
  const float* values = borrow<float>(phi, "phi", {-1, -1});
  contour::ContourGrid grid;
  grid.ny = static_cast<int>(phi.shape(0)), grid.nx = static_cast<int>(phi.shape(1));
  if (grid.nx < 3 || grid.ny < 3) throw std::invalid_argument("phi: expected at least 3 x 3 cells");
  grid.phi.assign(values, values + phi.size());
  grid.inside = grid.all();
  grid.warp = {{warp[0], warp[1], warp[2], warp[3]}, {warp[4], warp[5]}};
  return grid;
}

template <int P>
py::tuple sums_of(const contour::ContourGrid& grid, const contour::RegistrationWork& work, double softness) {
  const energies::Sums<double, P> sums = contour::registration_sums<P>(grid, work, softness);
  std::vector<double> gradient(sums.gradient, sums.gradient + P), hessian(P * P);
  for (int a = 0, k = 0; a < P; ++a)
    for (int b = 0; b <= a; ++b, ++k)
      hessian[static_cast<std::size_t>(a * P + b)] = hessian[static_cast<std::size_t>(b * P + a)] =
          sums.hessian[k];
  return py::make_tuple(sums.cost, to_numpy(std::move(gradient), {P}), to_numpy(std::move(hessian), {P, P}));
}

py::tuple contour_registration(const py::array& phi, const std::array<double, 6>& warp,
                               const py::array& pixels, const py::array& foreground, double softness,
                               bool affine) {
  const contour::ContourGrid grid = grid_from(phi, warp);
  const float* uv = borrow<float>(pixels, "pixels", {2, -1});
  const py::ssize_t n = pixels.shape(1);
  const float* p = borrow<float>(foreground, "foreground", {n});
  contour::RegistrationWork work;
  work.u.assign(uv, uv + n), work.v.assign(uv + n, uv + 2 * n), work.foreground.assign(p, p + n);
  return affine ? sums_of<6>(grid, work, softness) : sums_of<4>(grid, work, softness);
}

py::array_t<float> contour_steps(const py::array& phi, const py::array& foreground, int steps,
                                 const py::dict& given, const std::string& device) {
  const contour::ContourOptions options = options_from(given);
  contour::ContourGrid grid = grid_from(phi, {1, 0, 0, 1, 0, 0});
  const float* p = borrow<float>(foreground, "foreground", {phi.shape(0), phi.shape(1)});
  if (device != "cpu" && device != "cuda")
    throw std::invalid_argument("device: expected \"cpu\" or \"cuda\", got \"" + device + "\"");
  if (device == "cuda")
    return to_numpy(contour::contour_steps_cuda(options, steps, grid.nx, grid.ny, grid.phi.data(), p),
                    {grid.ny, grid.nx});
  contour::EvolutionWork work;
  work.foreground.assign(p, p + grid.phi.size());
  contour::find_band(grid, options.band, &work.band);
  contour::evolve_contour(options, steps, &work, &grid);
  return phi_of(grid);
}

py::array_t<float> contour_distance(const py::array& phi, int radius) {
  contour::ContourGrid grid = grid_from(phi, {1, 0, 0, 1, 0, 0});
  contour::FlatDistanceWork work;
  contour::redistance(radius, &work, &grid);
  return phi_of(grid);
}

// The posterior at the pixels of `image` of a model learned from `learned`, with the images of `pooled`
// pooled in one after the other, phi where warp puts it.
py::array_t<float> contour_posterior(const py::array& learned, const py::array& image, const py::array& phi,
                                     const std::array<double, 6>& warp, const py::dict& given,
                                     const std::vector<py::array>& pooled) {
  const contour::ContourOptions options = options_from(given);
  const contour::ContourGrid grid = grid_from(phi, warp);
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

py::array_t<float> template_scores(const py::array& pictures, const py::array& templates) {
  const float* a = borrow<float>(pictures, "pictures", {-1, -1});
  const float* b = borrow<float>(templates, "templates", {-1, pictures.shape(1)});
  py::array_t<float> out({pictures.shape(0), templates.shape(0)});
  contour::template_scores(a, static_cast<int>(pictures.shape(0)), b, static_cast<int>(templates.shape(0)),
                           static_cast<int>(pictures.shape(1)), out.mutable_data());
  return out;
}

}  // namespace

void bind_contour(py::module_& m) {
  bind_options<contour::ContourOptions>(m, "ContourOptions",
                                        "Options of the contour tracker; see st.contour.ContourTracker.");
  bind_phases(m);
  py::class_<ContourCore>(m, "ContourCore", "A contour tracker; use contour.ContourTracker.")
      .def(py::init<const py::dict&>(), py::arg("options"))
      .def(
          "start_mask",
          [](ContourCore& self, const py::array& image, const py::array& mask) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const auto* values =
                reinterpret_cast<const unsigned char*>(borrow<bool>(mask, "mask", {view.height, view.width}));
            return Frame(unlocked([&] { return self.tracker.start(view, values); }));
          },
          py::arg("image"), py::arg("mask"))
      .def(
          "start_box",
          [](ContourCore& self, const py::array& image, int x0, int y0, int x1, int y1) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const contour::ImagePart box{x0, y0, x1, y1};
            return Frame(unlocked([&] { return self.tracker.start(view, box); }));
          },
          py::arg("image"), py::arg("x0"), py::arg("y0"), py::arg("x1"), py::arg("y1"))
      .def(
          "track",
          [](ContourCore& self, const py::array& image) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            return Frame(unlocked([&] { return self.tracker.track(view); }));
          },
          py::arg("image"), "A frame without a memory.")
      .def(
          "observe",
          [](ContourCore& self, const py::array& image) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            return Observation(unlocked([&] { return self.tracker.observe(view); }));
          },
          py::arg("image"), "Where the object is in the next image; nothing is learned yet.")
      .def(
          "posterior_on_grid",
          [](ContourCore& self, const py::array& image) {
            const Busy turn(&self.busy, "tracker");
            const contour::RgbView view = color_view(image);
            const contour::ContourGrid& grid = self.tracker.grid();
            return frozen<float>(unlocked([&] { return self.tracker.posterior_on_grid(view); }),
                                 {grid.ny, grid.nx});
          },
          py::arg("image"), "The posterior at every cell of the grid, between observe and finish.")
      .def(
          "finish",
          [](ContourCore& self, contour::ShapeJudgement judgement,
             const std::optional<py::array>& recovered) {
            const Busy turn(&self.busy, "tracker");
            const contour::ContourGrid& grid = self.tracker.grid();
            const auto* inside = recovered ? reinterpret_cast<const unsigned char*>(
                                                 borrow<bool>(*recovered, "recovered", {grid.ny, grid.nx}))
                                           : nullptr;
            return Frame(unlocked([&] { return self.tracker.finish(judgement, inside); }));
          },
          py::arg("judgement"), py::arg("recovered") = py::none(),
          "The frame with a memory's judgement, and the whole silhouette where it recovered one.")
      .def("options", [](const ContourCore& self) { return options_of(self.tracker.options()); });
  m.def(
      "contour_options", [] { return options_of(contour::ContourOptions{}); },
      "The defaults of ContourTracker.");
  m.def("contour_registration", &contour_registration, py::arg("phi"), py::arg("warp"), py::arg("pixels"),
        py::arg("foreground"), py::arg("softness"), py::arg("affine"),
        "Cost, gradient and Gauss-Newton Hessian of a registration.");
  m.def("contour_steps", &contour_steps, py::arg("phi"), py::arg("foreground"), py::arg("steps"),
        py::arg("options"), py::arg("device") = "cpu", "phi after steps of the evolution.");
  m.def("contour_template_scores", &template_scores, py::arg("pictures"), py::arg("templates"),
        "(n, m): the sum of products of each of n pictures with each of m templates.");
  m.def("contour_distance", &contour_distance, py::arg("phi"), py::arg("radius"));
  m.def("contour_posterior", &contour_posterior, py::arg("learned"), py::arg("image"), py::arg("phi"),
        py::arg("warp"), py::arg("options"), py::arg("pooled") = std::vector<py::array>{});
}

}  // namespace sdftrack::bindings
