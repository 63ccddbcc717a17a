// SPDX-License-Identifier: MIT
#include <memory>
#include <mutex>
#include <shared_mutex>

#include "array.h"
#include "device_array.h"
#include "lwpr/model.h"
#include "release_gil.h"

namespace sdftrack::bindings {

namespace {

// A model with its users: any number of readers, or one writer.
class SharedLwpr {
 public:
  explicit SharedLwpr(lwpr::LwprModel model) : model(std::move(model)) {}
  SharedLwpr(const SharedLwpr& other) : model(other.read_only()) {}

  std::shared_lock<std::shared_mutex> reading() const { return taken<std::shared_lock>(); }
  std::unique_lock<std::shared_mutex> writing() const { return taken<std::unique_lock>(); }

  lwpr::LwprModel model;

 private:
  template <template <class> class Lock>
  Lock<std::shared_mutex> taken() const {
    Lock<std::shared_mutex> lock(users_, std::try_to_lock);
    if (!lock)
      throw std::runtime_error(
          "this LWPR is in use by another thread: predictions may run concurrently, an update may not; take "
          "turns, or make one LWPR per thread");
    return lock;
  }
  lwpr::LwprModel read_only() const {
    const auto turn = reading();
    return model;
  }
  mutable std::shared_mutex users_;
};

std::size_t rows_of(const py::array& a) { return static_cast<std::size_t>(a.shape(0)); }

void update_model(SharedLwpr& self, const py::array& x, const py::array& y, int threads, int device) {
  const auto turn = self.writing();
  const double* const from = borrow<double>(x, "x", {-1, self.model.n_in()});
  const double* const to = borrow<double>(y, "y", {x.shape(0), self.model.n_out()});
  const ReleaseGilUntilSignal release;
  if (device >= 0)
    self.model.update_cuda(from, to, rows_of(x), device);
  else
    self.model.update(from, to, rows_of(x), threads);
}

py::object predict_model(const SharedLwpr& self, const py::array& x, bool with_sd, int threads, int device) {
  const auto turn = self.reading();
  const lwpr::LwprModel& model = self.model;
  const double* const from = borrow<double>(x, "x", {-1, model.n_in()});
  const py::ssize_t count = x.shape(0), m = model.n_out();
  std::vector<double> mean(static_cast<std::size_t>(count * m)), sd(with_sd ? mean.size() : 0);
  {
    const ReleaseGilUntilSignal release;
    if (device >= 0)
      model.predict_cuda(from, rows_of(x), device, mean.data());
    else
      model.predict(from, rows_of(x), threads, mean.data(), with_sd ? sd.data() : nullptr);
  }
  py::object means = to_numpy(std::move(mean), {count, m});
  if (!with_sd) return means;
  return py::make_tuple(means, to_numpy(std::move(sd), {count, m}));
}

// Predicts means for samples on the device; the means stay there.
std::shared_ptr<OnDevice> predict_there(const SharedLwpr& self, std::uintptr_t address, ForeignStream stream,
                                        std::size_t count, int device) {
  const auto turn = self.reading();
  const ForeignArray x{reinterpret_cast<const void*>(address), stream};
  DeviceArray mean = [&] {
    const ReleaseGil release;
    return self.model.predict_there(x, count, device);
  }();
  return std::make_shared<OnDevice>(OnDevice{
      std::move(mean), py::dtype::of<double>(), {static_cast<py::ssize_t>(count), self.model.n_out()}});
}

py::array_t<double> activations(const SharedLwpr& self, const py::array& x, int threads) {
  const auto turn = self.reading();
  const double* const from = borrow<double>(x, "x", {-1, self.model.n_in()});
  const py::ssize_t count = x.shape(0), m = self.model.n_out();
  std::vector<double> out(static_cast<std::size_t>(count * m));
  unlocked<ReleaseGilUntilSignal>([&] { self.model.activations(from, rows_of(x), threads, out.data()); });
  return to_numpy(std::move(out), {count, m});
}

// All values of a field, in the units of the inputs divided by norm_in and the output divided by norm_out.
py::dict field(const lwpr::LwprUnit& unit, int k) {
  const lwpr::FieldLayout& at = unit.layout();
  const double* const head = unit.record(k);
  const int R = static_cast<int>(head[lwpr::FieldLayout::kProjections]),
            T = static_cast<int>(head[lwpr::FieldLayout::kTrusted]);
  const auto n = static_cast<std::size_t>(at.n);
  std::vector<double> center, M(n * n, 0.0), slope, mse;
  for (int i = 0; i < at.n; ++i) {
    center.push_back(unit.lane(k, i));
    slope.push_back(unit.lane(k, at.slope() + i));
    for (int j = i; j < (at.diagonal ? i + 1 : at.n); ++j)
      M[static_cast<std::size_t>(i) * n + static_cast<std::size_t>(j)] =
          unit.lane(k, at.metric() + at.entry(i, j));
  }
  for (int r = 0; r < R; ++r) {
    const double* const pr = head + at.record_size(r);
    mse.push_back(pr[lwpr::FieldLayout::kMSE] / pr[lwpr::FieldLayout::kSumW]);
  }
  const auto ssize = static_cast<py::ssize_t>(n);
  return py::dict("center"_a = to_numpy(std::move(center), {ssize}),
                  "M"_a = to_numpy(std::move(M), {ssize, ssize}),
                  "slope"_a = to_numpy(std::move(slope), {ssize}), "value"_a = unit.lane(k, at.value()),
                  "mse"_a = to_numpy(std::move(mse), {R}),
                  "n_data"_a = static_cast<long>(head[lwpr::FieldLayout::kCount]), "n_projections"_a = R,
                  "n_trusted"_a = T, "forgetting"_a = head[lwpr::FieldLayout::kLambda],
                  "weight"_a = head[lwpr::FieldLayout::kW],
                  "loo_mse"_a = head[lwpr::FieldLayout::kLooE] / head[lwpr::FieldLayout::kLooW]);
}

py::list fields(const SharedLwpr& self, int output) {
  const auto turn = self.reading();
  if (output < 0 || output >= self.model.n_out())
    throw py::value_error("output: expected 0.." + std::to_string(self.model.n_out() - 1) + ", got " +
                          std::to_string(output));
  const lwpr::LwprUnit& unit = self.model.unit(output);
  py::list out;
  for (int k = 0; k < unit.size(); ++k) out.append(field(unit, k));
  return out;
}

std::vector<int> field_counts(const SharedLwpr& self) {
  const auto turn = self.reading();
  std::vector<int> out;
  for (int k = 0; k < self.model.n_out(); ++k) out.push_back(self.model.unit(k).size());
  return out;
}

py::bytes bytes_of(const SharedLwpr& self) {
  const auto turn = self.reading();
  return self.model.bytes();
}

SharedLwpr from_bytes(const py::bytes& data) {
  char* start = nullptr;
  py::ssize_t size = 0;
  if (PyBytes_AsStringAndSize(data.ptr(), &start, &size) != 0) throw py::error_already_set();
  return SharedLwpr(lwpr::LwprModel::from_bytes(start, static_cast<std::size_t>(size)));
}

}  // namespace

void bind_lwpr(py::module_& m) {
  py::class_<SharedLwpr>(m, "LwprModel")
      .def(py::init([](int n_in, int n_out, const lwpr::LwprOptions& options,
                       const std::vector<double>& norm_in, const std::vector<double>& norm_out) {
             return std::make_unique<SharedLwpr>(lwpr::LwprModel(n_in, n_out, options, norm_in, norm_out));
           }),
           "n_in"_a, "n_out"_a, "options"_a, "norm_in"_a, "norm_out"_a)
      .def_property_readonly("n_in", [](const SharedLwpr& s) { return s.model.n_in(); })
      .def_property_readonly("n_out", [](const SharedLwpr& s) { return s.model.n_out(); })
      .def_property_readonly("options", [](const SharedLwpr& s) { return s.model.options(); })
      .def_property_readonly("norm_in", [](const SharedLwpr& s) { return s.model.norm_in(); })
      .def_property_readonly("norm_out", [](const SharedLwpr& s) { return s.model.norm_out(); })
      .def_property_readonly("samples",
                             [](const SharedLwpr& s) {
                               const auto turn = s.reading();
                               return static_cast<long>(s.model.samples());
                             })
      .def("update", &update_model, "x"_a, "y"_a, "threads"_a = 0, "device"_a = -1)
      .def("predict", &predict_model, "x"_a, "with_sd"_a = false, "threads"_a = 0, "device"_a = -1)
      .def("predict_there", &predict_there, "address"_a, "stream"_a, "count"_a, "device"_a)
      .def("activations", &activations, "x"_a, "threads"_a = 0)
      .def("training_error",
           [](const SharedLwpr& s) {
             const auto turn = s.reading();
             return s.model.training_error();
           })
      .def("field_counts", &field_counts)
      .def("fields", &fields, "output"_a)
      .def("copy", [](const SharedLwpr& s) { return std::make_unique<SharedLwpr>(s); })
      .def("to_bytes", &bytes_of)
      .def_static(
          "from_bytes", [](const py::bytes& data) { return std::make_unique<SharedLwpr>(from_bytes(data)); },
          "data"_a);
}

}  // namespace sdftrack::bindings
