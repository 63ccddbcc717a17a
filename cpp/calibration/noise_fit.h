// SPDX-License-Identifier: MIT
// Noise and bias of a depth camera as functions of distance and incidence, from samples of single images.
#pragma once

#include <vector>

namespace sdftrack::calibration {

// Noise of measurements at one distance and incidence.
struct NoiseSample {
  double depth_m, tangent, sd_m;  // tangent of the angle of incidence
  int readings;
};

// sd = hypot(noise_m + noise_per_m Z^2, noise_incidence Z tan(incidence)), each at least 0.
struct NoiseModel {
  double noise_m = 0, noise_per_m = 0, noise_incidence = 0;
};
// Least squares of ln sd; at least one sample.
NoiseModel fit_noise(const std::vector<NoiseSample>& samples);

// value = constant + per_m2 Z^2.
struct Growth {
  double constant = 0, per_m2 = 0;
};
// Robust fit, without growth if the distances are too similar. Unless `is_signed`, both are at least 0.
Growth fit_growth(const std::vector<double>& depth_m, const std::vector<double>& value, bool is_signed);

// Whether distances differ enough to estimate the growth.
bool span_is_wide(const std::vector<double>& depth_m);

// The length (px) of noise with correlation exp(-d^2 / (2 length^2)) at a distance d, from that of
// neighbours.
double correlation_length(double neighbours);

}  // namespace sdftrack::calibration
