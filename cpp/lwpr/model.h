// SPDX-License-Identifier: MIT
// Locally weighted projection regression (Vijayakumar, D'Souza, Schaal 2005; thesis 6.3.2), learnt sample by
// sample: one unit per output; the units share only the scaling of the inputs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/device_array.h"
#include "lwpr/options.h"
#include "lwpr/unit.h"
#include "lwpr/units_on_device.h"

namespace sdftrack::lwpr {

// Limit for inputs and outputs relative to their norms: squares of their squares must stay finite.
constexpr double kMaxSize = 1e25;

class LwprModel {
 public:
  // norm_in, norm_out: divisors of inputs and outputs. std::invalid_argument for values out of range.
  LwprModel(int n_in, int n_out, const LwprOptions& options, std::vector<double> norm_in,
            std::vector<double> norm_out);
  LwprModel(const LwprModel& other);  // on the host
  LwprModel(LwprModel&&) = default;

  int n_in() const { return at_.n; }
  int n_out() const { return int(units_.size()); }
  const LwprOptions& options() const { return options_; }
  const std::vector<double>& norm_in() const { return norm_in_; }
  const std::vector<double>& norm_out() const { return norm_out_; }
  const LwprUnit& unit(int output) const { return units()[output]; }
  double samples() const { return samples_; }

  // x: count x n_in, y: count x n_out, row by row. Outputs are learnt in parallel on `threads` threads (0:
  // all cores); the number of threads does not change a bit. Throws std::invalid_argument, and leaves the
  // model unchanged, if a number is not finite.
  void update(const double* x, const double* y, std::size_t count, int threads);

  // As update, on the GPU, where the units stay until the host needs them and fetches them. After a CUDA
  // exception the model is as it was at the last fetch.
  void update_cuda(const double* x, const double* y, std::size_t count, int device);

  // mean, sd: count x n_out; sd may be nullptr. Many threads may predict at once, while none updates.
  void predict(const double* x, std::size_t count, int threads, double* mean, double* sd) const;
  // The largest activation of each output's fields, 0 where all are below the cutoff: count x n_out.
  void activations(const double* x, std::size_t count, int threads, double* out) const;
  // As predict (no sd) on the GPU, `at_once` samples at a time. std::runtime_error in a build without CUDA.
  void predict_cuda(const double* x, std::size_t count, int device, double* mean,
                    std::size_t at_once = std::size_t{1} << 17) const;
  // Predicts from samples on the device; the means stay there.
  DeviceArray predict_there(const ForeignArray& x, std::size_t count, int device) const;

  // In units of the outputs; see LwprUnit.
  std::vector<double> training_error() const;

  // The whole model in bytes, with version and checksum, and back. std::invalid_argument for invalid bytes.
  std::string bytes() const;
  static LwprModel from_bytes(const char* data, std::size_t size);

 private:
  // The units after all updates.
  const std::vector<LwprUnit>& units() const {
    if (on_device_) on_device_->fetch(&units_);
    return units_;
  }
  void predict_the_rest(const double* x, std::size_t count, double* mean) const;
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
