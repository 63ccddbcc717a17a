// SPDX-License-Identifier: MIT
// The units of a model on a GPU, where they stay between updates.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "lwpr/unit.h"

namespace sdftrack::lwpr {

class UnitsOnDevice {
 public:
  virtual ~UnitsOnDevice() = default;
  virtual int device() const = 0;
  virtual bool ahead() const = 0;  // they have learnt what the host's have not

  // Samples in their order: rows of the layout, and `count` numbers of one output after the other. Begins
  // with the host's units unless those here are ahead. After an exception nothing is ahead.
  virtual void learn(const std::vector<LwprUnit>& units, const double* rows, const double* y,
                     std::size_t count) = 0;
  // Makes the host's units what these are, if these are ahead. From any thread.
  virtual void fetch(std::vector<LwprUnit>* units) = 0;
  // The host's have learnt something.
  virtual void forget() = 0;
};

// std::runtime_error in a build without CUDA.
std::unique_ptr<UnitsOnDevice> units_on_device(const FieldLayout& at, const LwprOptions& options, int device);

}  // namespace sdftrack::lwpr
