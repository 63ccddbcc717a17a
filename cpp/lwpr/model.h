// SPDX-License-Identifier: MIT
// Locally weighted projection regression (Vijayakumar, D'Souza, Schaal 2005; thesis 6.3.2): numbers in,
// numbers out, learnt sample by sample. One unit for each output; they share the scaling of the inputs and
// nothing else.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/device_array.h"
#include "lwpr/options.h"
#include "lwpr/unit.h"
#include "lwpr/units_on_device.h"

namespace sdftrack::lwpr {

// Of inputs and outputs beside their norms: squares of squares of them must stay finite.
constexpr double kMaxSize = 1e25;

class LwprModel {
 public:
  // norm_in, norm_out: inputs and outputs are divided by them, one for each. std::invalid_argument for what
  // is out of range.
  LwprModel(int n_in, int n_out, const LwprOptions& options, std::vector<double> norm_in,
            std::vector<double> norm_out);
  LwprModel(const LwprModel& other);  // on the host
  LwprModel(LwprModel&&) = default;

  int n_in() const { return at_.n; }
  int n_out() const { return static_cast<int>(units_.size()); }
  const LwprOptions& options() const { return options_; }
  const std::vector<double>& norm_in() const { return norm_in_; }
  const std::vector<double>& norm_out() const { return norm_out_; }
  const LwprUnit& unit(int output) const { return units()[static_cast<std::size_t>(output)]; }
  double samples() const { return samples_; }

  // x: count x n_in, y: count x n_out, row by row. Outputs are learnt side by side on `threads` threads (0:
  // all cores); their number does not change a bit. std::invalid_argument, and the model as it was, where a
  // number is not finite.
  void update(const double* x, const double* y, std::size_t count, int threads);

  // The same on the GPU, where the units stay: what asks for them fetches them. After an exception of CUDA
  // the model is what it was when they were last fetched.
  void update_cuda(const double* x, const double* y, std::size_t count, int device);

  // mean, sd: count x n_out; sd may be nullptr. Any number of threads may ask at once, while none updates.
  void predict(const double* x, std::size_t count, int threads, double* mean, double* sd) const;
  // The largest activation of each output's fields, 0 where all are below the cutoff: count x n_out.
  void activations(const double* x, std::size_t count, int threads, double* out) const;
  // The same as predict (no sd) on the GPU, `at_once` samples of them. std::runtime_error in a build without
  // CUDA.
  void predict_cuda(const double* x, std::size_t count, int device, double* mean,
                    std::size_t at_once = std::size_t{1} << 17) const;
  // Of samples that lie on the device, to means that stay there.
  DeviceArray predict_there(const ForeignArray& x, std::size_t count, int device) const;

  // In units of the outputs; see LwprUnit.
  std::vector<double> training_error() const;

  // The whole model in bytes, with a version and a checksum, and back. std::invalid_argument for bytes that
  // are no such thing.
  std::string bytes() const;
  static LwprModel from_bytes(const char* data, std::size_t size);

 private:
  // As they are after all updates.
  const std::vector<LwprUnit>& units() const {
    if (on_device_) on_device_->fetch(&units_);
    return units_;
  }
  void say_the_rest(const double* x, std::size_t count, double* mean) const;
  std::vector<double> scaled_rows(const double* x, std::size_t count, const char* name) const;

  LwprOptions options_;
  FieldLayout at_;
  std::vector<double> norm_in_, norm_out_;
  mutable std::vector<LwprUnit> units_;
  double samples_ = 0, samples_fetched_ = 0;
  std::unique_ptr<UnitsOnDevice> on_device_;
  std::vector<double> rows_;  // the scaled inputs of an update
};

}  // namespace sdftrack::lwpr
