// SPDX-License-Identifier: MIT
// The memory of silhouettes and its harmonics.
#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "contour/memory/mask_ops.h"
#include "contour/memory/occlusion_handler.h"
#include "contour/memory/options.h"
#include "contour_core.h"

namespace sdftrack::bindings {

namespace {

constexpr const char* kJudgements[] = {"unoccluded", "occluded", "novel"};

contour::Mask mask_from(const py::array& given, const char* name, const std::vector<py::ssize_t>& shape) {
  const bool* inside = borrow<bool>(given, name, shape);
  contour::Mask out(static_cast<int>(given.shape(1)), static_cast<int>(given.shape(0)));
  std::copy_n(inside, given.size(), out.values.begin());
  return out;
}

py::array_t<bool> array_of(const contour::Mask& mask) {
  py::array_t<bool> out({mask.height, mask.width});
  std::copy(mask.values.begin(), mask.values.end(), out.mutable_data());
  return out;
}

template <class T>
py::array_t<T> row_of(std::vector<T> values) {
  const auto n = static_cast<py::ssize_t>(values.size());
  return to_numpy(std::move(values), {n});
}

contour::HarmonicOrder order_from(const std::string& name) {
  if (name != "max" && name != "sum")
    throw std::invalid_argument("order: expected \"max\" or \"sum\", got \"" + name + "\"");
  return name == "max" ? contour::HarmonicOrder::kMax : contour::HarmonicOrder::kSum;
}

py::array_t<double> harmonics(const py::array& inside, int n, const std::string& order) {
  const float* values = borrow<float>(inside, "inside", {-1, inside.shape(0)});
  const auto size = static_cast<int>(inside.shape(0));
  contour::Picture picture(size, size);
  std::copy_n(values, inside.size(), picture.values.begin());
  return row_of(
      unlocked([&] { return contour::CosineSeries(n, order_from(order), size).coefficients(picture); }));
}

py::array_t<double> series(const py::array& coefficients, int n, const std::string& order, int height,
                           int width, int size) {
  const contour::CosineSeries of(n, order_from(order), size);
  const auto m = static_cast<py::ssize_t>(of.layout().size());
  const double* values = borrow<double>(coefficients, "coefficients", {m});
  contour::Plane<double> out = unlocked([&] {
    return of.sampled({values, of.layout().size()}, width, height);
  });
  return to_numpy(std::move(out.values), {height, width});
}

std::vector<int> harmonic_numbers(int n, const std::string& order) {
  const contour::CosineSeries of(n, order_from(order), n);
  std::vector<int> out;
  for (const contour::Frequency& f : of.layout()) out.push_back(f.harmonic);
  return out;
}

py::dict assess(const contour::SilhouetteMemory& self, const py::array& given) {
  const py::ssize_t size = self.library().size();
  const contour::Mask mask = mask_from(given, "mask", {size, size});
  contour::SilhouetteAssessment found = unlocked([&] { return self.assess(mask); });
  const contour::Explanation& explained = found.explanation;
  return py::dict(
      "judgement"_a = kJudgements[static_cast<int>(found.judgement)], "accepted"_a = found.accepted,
      "hidden"_a = array_of(explained.hidden), "coefficients"_a = row_of(std::move(found.coefficients)),
      "std"_a = row_of(std::move(found.std)), "error"_a = explained.missing, "threshold"_a = found.threshold,
      "known"_a = std::min(1.0, explained.explained), "doubt"_a = explained.doubt());
}

// All data except the options, as in files; masks as bits.
py::dict state_of_memory(const contour::SilhouetteMemory& self) {
  contour::SilhouetteMemory::State state = self.state();
  const auto n = static_cast<py::ssize_t>(state.library.masks.size());
  const py::ssize_t pixels = self.library().size() * self.library().size();
  std::vector<unsigned char> bits;
  for (const contour::Mask& mask : state.library.masks)
    for (std::size_t i = 0; i < mask.size(); i += 8) {
      unsigned char byte = 0;
      for (std::size_t k = i; k < i + 8; ++k)
        byte = static_cast<unsigned char>(2 * byte + (k < mask.size() ? mask.values[k] : 0));
      bits.push_back(byte);
    }
  return py::dict("learnt"_a = state.learnt, "calibrated"_a = state.calibrated, "squares"_a = state.squares,
                  "kept"_a = to_numpy(std::move(bits), {n, (pixels + 7) / 8}),
                  "unlike"_a = to_numpy(std::move(state.library.unlike), {n, n}),
                  "ages"_a = row_of(std::move(state.library.ages)), "clock"_a = state.library.clock);
}

void restore_memory(contour::SilhouetteMemory& self, int learnt, int calibrated, double squares,
                    const py::array& kept, const py::array& unlike, const py::array& ages,
                    std::int64_t clock) {
  const int size = self.library().size();
  const unsigned char* bits = borrow<unsigned char>(kept, "kept", {-1, (size * size + 7) / 8});
  const py::ssize_t n = kept.shape(0);
  const float* each = borrow<float>(unlike, "unlike", {n, n});
  const std::int64_t* when = borrow<std::int64_t>(ages, "ages", {n});
  contour::SilhouetteMemory::State state{
      learnt, calibrated, squares, {{}, {each, each + n * n}, {when, when + n}, clock}};
  for (py::ssize_t k = 0; k < n; ++k, bits += kept.shape(1)) {
    contour::Mask& mask = state.library.masks.emplace_back(size, size);
    for (std::size_t i = 0; i < mask.size(); ++i) mask.values[i] = bits[i / 8] >> (7 - i % 8) & 1;
  }
  unlocked([&] { self.restore(state); });
}

void bind_memory(py::module_& m) {
  py::class_<contour::SilhouetteMemory>(m, "SilhouetteMemory",
                                        "Silhouettes that explain others; use contour.ShapeMemory.")
      .def(py::init([](const contour::MemoryOptions& o) { return contour::SilhouetteMemory(o.remembered); }),
           "options"_a)
      .def(
          "learn",
          [](contour::SilhouetteMemory& self, const py::array& given) {
            const py::ssize_t size = self.library().size();
            const contour::Mask mask = mask_from(given, "mask", {size, size});
            unlocked([&] { self.learn(mask); });
          },
          "mask"_a)
      .def("assess", &assess, "mask"_a)
      .def_property_readonly("learnt", &contour::SilhouetteMemory::learnt)
      .def_property_readonly("threshold", &contour::SilhouetteMemory::threshold)
      .def_property_readonly("count",
                             [](const contour::SilhouetteMemory& self) { return self.library().count(); })
      .def("state", &state_of_memory, "All but the options.")
      .def("restore", &restore_memory, "learnt"_a, "calibrated"_a, "squares"_a, "kept"_a, "unlike"_a,
           "ages"_a, "clock"_a, "What `state` returned.");
}

py::tuple judge_frame(contour::OcclusionHandler& self, contour::ContourTracker& core, const py::array& image,
                      bool burn_in, contour::SilhouetteMemory& memory) {
  const contour::RgbView view = color_view(image);
  const contour::OcclusionHandler::Judged found =
      unlocked([&] { return self.judge(&core, view, burn_in, &memory); });
  if (found.judgement == contour::ShapeJudgement::kOccluded)
    return py::make_tuple(found.judgement, array_of(found.recovered));
  return py::make_tuple(found.judgement, py::none());
}

void bind_handler(py::module_& m) {
  py::class_<contour::OcclusionHandler>(m, "OcclusionHandler",
                                        "Occlusions of a tracked contour, by a memory.")
      .def(py::init<>())
      .def(
          "begin",
          [](contour::OcclusionHandler& self, contour::ContourTracker& core,
             const contour::SilhouetteMemory& memory) { unlocked([&] { self.begin(core, memory); }); },
          "tracker"_a, "memory"_a, "After a start, in which the object is seen as a whole.")
      .def("judge", &judge_frame, "tracker"_a, "image"_a, "burn_in"_a, "memory"_a,
           "Between observe and finish: the judgement, and the whole silhouette where one is recovered.")
      .def(pickled<contour::OcclusionHandler>());
}

}  // namespace

void bind_contour_memory(py::module_& m) {
  m.def("contour_harmonics", &harmonics, "inside"_a, "n"_a, "order"_a,
        "Coefficients of a square picture, 1 inside and 0 outside.");
  m.def("contour_series", &series, "coefficients"_a, "n"_a, "order"_a, "height"_a, "width"_a, "size"_a,
        "The cosine series at the pixels of an image.");
  m.def("contour_harmonic_numbers", &harmonic_numbers, "n"_a, "order"_a, "The harmonic of each coefficient.");
  m.def(
      "contour_with_hidden",
      [](const py::array& seen, const py::array& expected) {
        const contour::Mask visible = mask_from(seen, "seen", {-1, -1});
        const contour::Mask whole = mask_from(expected, "expected", {seen.shape(0), seen.shape(1)});
        return array_of(contour::with_hidden(visible, whole).completed);
      },
      "seen"_a, "expected"_a, "The seen part and what an occluder hides of the expected silhouette.");
  bind_memory(m);
  bind_handler(m);
}

}  // namespace sdftrack::bindings
