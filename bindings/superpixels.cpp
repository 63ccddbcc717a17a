// SPDX-License-Identifier: MIT
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "array.h"
#include "busy.h"
#include "device_array.h"
#include "release_gil.h"
#include "superpixels/slic.h"

namespace sdftrack::bindings {

namespace {

superpixels::ColorSpace space_of(const std::string& name) {
  return name == "lab" ? superpixels::ColorSpace::kLab
                       : (name == "xyz" ? superpixels::ColorSpace::kXyz : superpixels::ColorSpace::kRgb);
}

// The image in the core's form; the arrays must outlive it.
superpixels::SlicImage image_of(const py::array& image, const std::optional<py::array>& mask,
                                const std::optional<py::array>& depth) {
  superpixels::SlicImage out;
  const bool color = image.ndim() == 3;
  const std::vector<py::ssize_t> shape =
      color ? std::vector<py::ssize_t>{-1, -1, 3} : std::vector<py::ssize_t>{-1, -1};
  if (image.dtype().kind() == 'f')
    out.floats = borrow<float>(image, "image", shape);
  else
    out.bytes = borrow<std::uint8_t>(image, "image", shape);
  out.height = static_cast<int>(image.shape(0)), out.width = static_cast<int>(image.shape(1));
  out.channels = color ? 3 : 1;
  if (mask) out.mask = borrow<std::uint8_t>(*mask, "mask", {image.shape(0), image.shape(1)});
  if (depth) out.depth_m = borrow<float>(*depth, "depth", {image.shape(0), image.shape(1)});
  return out;
}

// Working memory that is kept between calls, unless it is large.
class SlicWork {
 public:
  static constexpr std::size_t kKept = std::size_t{1} << 27;

  superpixels::SlicResult run(const superpixels::SlicImage& image, const superpixels::SlicOptions& options,
                              bool resume, int threads, int device, int* labels) {
    const Busy turn(&busy_, "superpixel segmenter");
    if (device >= 0) return superpixels::slic_cuda(image, options, device, labels);
    return slic_.run(image, options, resume, threads, labels);
  }
  std::size_t bytes() const { return slic_.bytes(); }

 private:
  superpixels::Slic slic_;
  std::atomic<bool> busy_{false};
};

py::tuple run_slic(SlicWork* work, const py::array& image, const superpixels::SlicOptions& options,
                   const std::optional<py::array>& mask, const std::optional<py::array>& depth, bool resume,
                   int threads, int device) {
  const superpixels::SlicImage given = image_of(image, mask, depth);
  superpixels::check_slic(given, options);
  py::array_t<std::int32_t> labels({image.shape(0), image.shape(1)});
  int* const out = labels.mutable_data();
  superpixels::SlicResult result =
      unlocked([&] { return work->run(given, options, resume, threads, device, out); });
  return py::make_tuple(labels, result.segments, result.iterations, result.residual, result.connect_s);
}

// Labels of an image on the device; the labels stay there.
std::shared_ptr<OnDevice> slic_there(std::uintptr_t address, ForeignStream stream, int height, int width,
                                     int channels, const superpixels::SlicOptions& options, int device) {
  const ForeignArray there{reinterpret_cast<const void*>(address), stream};
  superpixels::SlicImage image;
  image.there = &there, image.height = height, image.width = width, image.channels = channels;
  superpixels::check_slic(image, options);
  DeviceArray labels = [&] {
    const ReleaseGil release;
    DeviceArray made(device,
                     sizeof(int) * static_cast<std::size_t>(height) * static_cast<std::size_t>(width));
    superpixels::slic_cuda(image, options, device, nullptr, &made);
    return made;
  }();
  return std::make_shared<OnDevice>(
      OnDevice{std::move(labels), py::dtype::of<std::int32_t>(), {height, width}});
}

// One call; it uses the memory of the last one unless another thread has it.
py::tuple slic_once(const py::array& image, const superpixels::SlicOptions& options,
                    const std::optional<py::array>& mask, const std::optional<py::array>& depth, int threads,
                    int device) {
  static std::mutex mutex;
  static std::unique_ptr<SlicWork> spare;
  std::unique_ptr<SlicWork> work;
  {
    const std::lock_guard lock(mutex);
    work = std::move(spare);
  }
  if (!work) work = std::make_unique<SlicWork>();
  py::tuple made = run_slic(work.get(), image, options, mask, depth, false, threads, device);
  if (work->bytes() <= SlicWork::kKept) {
    const std::lock_guard lock(mutex);
    spare = std::move(work);
  }
  return made;
}

}  // namespace

void bind_superpixels(py::module_& m) {
  py::class_<superpixels::SlicOptions>(m, "SlicOptions")
      .def(py::init<>())
      .def_readwrite("n_segments", &superpixels::SlicOptions::n_segments)
      .def_readwrite("compactness", &superpixels::SlicOptions::compactness)
      .def_readwrite("max_iterations", &superpixels::SlicOptions::max_iterations)
      .def_readwrite("connected", &superpixels::SlicOptions::connected)
      .def_readwrite("min_size", &superpixels::SlicOptions::min_size)
      .def_readwrite("first_label", &superpixels::SlicOptions::first_label)
      .def_readwrite("depth_weight", &superpixels::SlicOptions::depth_weight)
      .def_property(
          "space", [](const superpixels::SlicOptions& o) { return static_cast<int>(o.space); },
          [](superpixels::SlicOptions& o, const std::string& name) { o.space = space_of(name); })
      .def_property(
          "distance", [](const superpixels::SlicOptions& o) { return static_cast<int>(o.distance); },
          [](superpixels::SlicOptions& o, const std::string& name) {
            o.distance =
                name == "thesis" ? superpixels::SlicDistance::kThesis : superpixels::SlicDistance::kSquared;
          });
  py::class_<SlicWork>(m, "SlicWork")
      .def(py::init<>())
      .def_property_readonly("bytes", &SlicWork::bytes)
      .def("run", &run_slic, "image"_a, "options"_a, "mask"_a, "depth"_a, "resume"_a, "threads"_a,
           "device"_a);
  m.def("slic_there", &slic_there, "address"_a, "stream"_a, "height"_a, "width"_a, "channels"_a, "options"_a,
        "device"_a);
  m.def("slic", &slic_once, "image"_a, "options"_a, "mask"_a, "depth"_a, "threads"_a, "device"_a);
}

}  // namespace sdftrack::bindings
