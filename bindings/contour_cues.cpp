// SPDX-License-Identifier: MIT
// Cues for an outline in addition to its colours, and how little a box determines a first mask.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "contour/cues/box_start.h"
#include "contour/cues/evidence.h"
#include "contour_core.h"

namespace sdftrack::bindings {

namespace {

using EvidenceRow = std::array<double, 5>;  // in the order of contour::Evidence

const unsigned char* mask_of(const py::array& mask, int width, int height) {
  return reinterpret_cast<const unsigned char*>(borrow<bool>(mask, "mask", {height, width}));
}

EvidenceRow row_of(const contour::Evidence& e) {
  return {e.disagreement, e.mean_disagreement, e.strangeness, e.first_instability, e.shared};
}

contour::Evidence evidence_from(const EvidenceRow& row) { return {row[0], row[1], row[2], row[3], row[4]}; }

EvidenceRow gather(contour::EvidenceGatherer& self, const py::array& image, const py::array& mask,
                   double shared, const std::optional<py::array>& flow, int x0, int y0) {
  const contour::RgbView view = color_view(image);
  const std::optional<contour::FlowView> back = flow_view(flow, x0, y0, view);
  const unsigned char* inside = mask_of(mask, view.width, view.height);
  return row_of(unlocked([&] { return self.gather(view, inside, back ? &*back : nullptr, shared); }));
}

py::tuple verdict(const EvidenceRow& row, const std::string& status, const std::string& reason) {
  const auto* const at = std::find(kContourStatus.begin(), kContourStatus.end(), status);
  if (at == kContourStatus.end())
    throw std::invalid_argument("status: expected ok, weak or lost, got " + status);
  const contour::EvidenceVerdict out = contour::verdict(
      evidence_from(row), static_cast<contour::ContourStatus>(at - kContourStatus.begin()), reason);
  return py::make_tuple(kContourStatus[static_cast<std::size_t>(out.status)], out.reason, out.confidence);
}

double instability(const py::array& image, const std::array<int, 4>& box, const py::array& mask,
                   const contour::ContourOptions& options) {
  const contour::RgbView view = color_view(image);
  contour::Mask first(view.width, view.height);
  std::copy_n(mask_of(mask, view.width, view.height), first.size(), first.values.begin());
  return unlocked([&] {
    return contour::first_instability(view, {box[0], box[1], box[2], box[3]}, first, options);
  });
}

void bind_gatherer(py::module_& m) {
  py::class_<contour::EvidenceGatherer>(
      m, "EvidenceGatherer", "Compares each frame's mask with the first, and with the last one moved.")
      .def(py::init([](const py::array& image, const py::array& mask, double first_instability) {
             const contour::RgbView view = color_view(image);
             return contour::EvidenceGatherer(view, mask_of(mask, view.width, view.height),
                                              first_instability);
           }),
           "image"_a, "mask"_a, "first_instability"_a = 0.0)
      .def("gather", &gather, "image"_a, "mask"_a, "shared"_a = 0.0, "flow"_a = py::none(), "x0"_a = 0,
           "y0"_a = 0, "Evidence about the mask in the next image, given the flow back to the last.")
      .def(
          "skip",
          [](contour::EvidenceGatherer& self, const py::array& mask) {
            self.skip(mask_of(mask, self.width(), self.height()));
          },
          "mask"_a, "A frame without an outline.")
      .def(pickled<contour::EvidenceGatherer>());
}

}  // namespace

void bind_contour_cues(py::module_& m) {
  bind_gatherer(m);
  m.def("contour_first_instability", &instability, "image"_a, "box"_a, "mask"_a, "options"_a,
        "1 less the mean IoU of the first mask and those of the box shifted a little.");
  m.def("contour_verdict", &verdict, "evidence"_a, "status"_a, "reason"_a,
        "Status, reason and confidence by the evidence.");
  m.attr("EVIDENCE_BIAS") = contour::kEvidenceBias;
  m.attr("EVIDENCE_WEIGHTS") = py::cast(contour::kEvidenceWeights);
  m.attr("EVIDENCE_SURE") = contour::kSure;
  m.attr("EVIDENCE_MOST_SHARED") = contour::kMaxShared;
  m.attr("EVIDENCE_MOST_INSTABILITY") = contour::kMaxInstability;
}

}  // namespace sdftrack::bindings
