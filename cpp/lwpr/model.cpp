// SPDX-License-Identifier: MIT
#include "lwpr/model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/interrupt.h"
#include "base/parallel.h"
#include "base/short_text.h"

namespace sdftrack::lwpr {

namespace {

constexpr std::size_t kChunk = 256;        // samples of a prediction that a thread takes at a time
constexpr std::size_t kWorthThreads = 64;  // with fewer samples, starting threads costs more than it saves

constexpr std::size_t kPart = 1 << 14, kLeastPart = 16;  // numbers, and samples, learnt in one part
constexpr std::size_t kMaxKept = 1 << 17;            // numbers of a batch that are kept room for: a megabyte
constexpr int kMaxFull = 1000, kMaxInputs = 100000;  // inputs: the memory of a field

void check_norm(const char* name, const std::vector<double>& norm, int expected) {
  if (norm.size() != std::size_t(expected))
    throw std::invalid_argument(std::string(name) + ": expected " + std::to_string(expected) +
                                " numbers, got " + std::to_string(norm.size()));
  for (const double value : norm)
    if (!(std::isfinite(value) && value > 0))
      throw std::invalid_argument(std::string(name) + ": expected numbers above 0, got " +
                                  std::to_string(value));
}

void check_count(const char* name, int value) {
  if (value < 1)
    throw std::invalid_argument(std::string(name) + ": expected at least 1, got " + std::to_string(value));
}

std::string text_of(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return "inf";
  return short_text(value);
}

void check_finite(const char* name, const double* values, std::size_t count,
                  const std::vector<double>& norm) {
  const std::size_t columns = norm.size();
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      const double value = values[i * columns + j];
      // The bound itself is infinite for a norm above 1e283.
      if (std::isfinite(value) && std::abs(value) <= kMaxSize * norm[j]) continue;
      throw std::invalid_argument(std::string(name) + ": expected finite numbers, at most 1e25 times norm_" +
                                  (name[0] == 'x' ? "in" : "out") + ", got " + text_of(value) +
                                  " in sample " + std::to_string(i) +
                                  "; omit such samples (the model is unchanged)");
    }
}

}  // namespace

LwprModel::LwprModel(int n_in, int n_out, const LwprOptions& options, std::vector<double> norm_in,
                     std::vector<double> norm_out)
    : options_(options), norm_in_(std::move(norm_in)), norm_out_(std::move(norm_out)) {
  check_count("n_in", n_in);
  check_count("n_out", n_out);
  if (n_in > (options.diagonal ? kMaxInputs : kMaxFull))
    throw std::invalid_argument("n_in: expected at most " + std::to_string(kMaxFull) +
                                " with a full metric, " + std::to_string(kMaxInputs) +
                                " with diagonal=True, got " + std::to_string(n_in));
  options.check();
  check_norm("norm_in", norm_in_, n_in);
  check_norm("norm_out", norm_out_, n_out);
  at_ = FieldLayout(n_in, options.diagonal, options.meta);
  units_.assign(n_out, LwprUnit(at_, options));
}

LwprModel::LwprModel(const LwprModel& other)
    : options_(other.options_),
      at_(other.at_),
      norm_in_(other.norm_in_),
      norm_out_(other.norm_out_),
      units_(other.units()),
      samples_(other.samples_) {}

void LwprModel::update(const double* x, const double* y, std::size_t count, int threads) {
  const auto n = std::size_t(n_in()), m = std::size_t(n_out());
  const auto row = std::size_t(at_.row);
  check_finite("x", x, count, norm_in_);
  check_finite("y", y, count, norm_out_);
  if (rows_.size() < count * row) rows_.assign(count * row, 0.0);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < n; ++j) rows_[i * row + j] = x[i * n + j] / norm_in_[j];
  units();
  if (on_device_) on_device_->forget();
  // In parts, after each of which the model is valid: it has learnt from the samples so far.
  const std::size_t part = std::max<std::size_t>(kLeastPart, kPart / row);
  std::size_t done = 0;
  const auto settle = [&] {
    for (LwprUnit& unit : units_) unit.settle();
    samples_ += double(done);
    if (rows_.size() > kMaxKept) rows_ = {};
  };
  try {
    while (done < count) {
      check_interrupt();
      const std::size_t end = std::min(count, done + part);
      parallel_for(m, count < kWorthThreads ? 1 : threads, [&](std::size_t output) {
        for (std::size_t i = done; i < end; ++i)
          units_[output].update(rows_.data() + i * row, y[i * m + output] / norm_out_[output]);
      });
      done = end;
    }
  } catch (...) {
    settle();
    throw;
  }
  settle();
}

void LwprModel::update_cuda(const double* x, const double* y, std::size_t count, int device) {
  const std::vector<double> rows = scaled_rows(x, count, "x");
  check_finite("y", y, count, norm_out_);
  const auto m = std::size_t(n_out());
  std::vector<double> outputs(m * count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < m; ++k) outputs[k * count + i] = y[i * m + k] / norm_out_[k];
  if (!on_device_ || on_device_->device() != device) {
    units();
    on_device_ = units_on_device(at_, options_, device);
  }
  if (!on_device_->ahead()) samples_fetched_ = samples_;
  try {
    on_device_->learn(units_, rows.data(), outputs.data(), count);
  } catch (...) {
    samples_ = samples_fetched_;
    throw;
  }
  samples_ += double(count);
}

std::vector<double> LwprModel::scaled_rows(const double* x, std::size_t count, const char* name) const {
  const auto n = std::size_t(n_in()), row = std::size_t(at_.row);
  check_finite(name, x, count, norm_in_);
  std::vector<double> rows(count * row, 0.0);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < n; ++j) rows[i * row + j] = x[i * n + j] / norm_in_[j];
  return rows;
}

void LwprModel::predict(const double* x, std::size_t count, int threads, double* mean, double* sd) const {
  const std::vector<double> rows = scaled_rows(x, count, "x");
  const auto m = std::size_t(n_out()), row = std::size_t(at_.row);
  const std::vector<LwprUnit>& now = units();
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
    check_interrupt();
    LwprScratch scratch;
    for (std::size_t output = 0; output < m; ++output) {
      const LwprUnit& unit = now[output];
      for (std::size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
        const double* const at = rows.data() + i * row;
        if (sd) {
          const LwprPrediction predicted = unit.predict_with_sd(at, &scratch);
          mean[i * m + output] = predicted.mean * norm_out_[output];
          sd[i * m + output] = predicted.sd * norm_out_[output];
        } else {
          mean[i * m + output] = unit.predict(at, &scratch) * norm_out_[output];
        }
      }
    }
  });
}

void LwprModel::activations(const double* x, std::size_t count, int threads, double* out) const {
  const std::vector<double> rows = scaled_rows(x, count, "x");
  const auto m = std::size_t(n_out()), row = std::size_t(at_.row);
  const std::vector<LwprUnit>& now = units();
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](std::size_t chunk) {
    check_interrupt();
    LwprScratch scratch;
    for (std::size_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i)
      for (std::size_t output = 0; output < m; ++output)
        out[i * m + output] = now[output].largest_activation(rows.data() + i * row, &scratch);
  });
}

std::vector<double> LwprModel::training_error() const {
  std::vector<double> out;
  for (std::size_t k = 0; k < units_.size(); ++k) out.push_back(units()[k].training_error() * norm_out_[k]);
  return out;
}

}  // namespace sdftrack::lwpr
