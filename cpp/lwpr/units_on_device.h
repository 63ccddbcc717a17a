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
  virtual bool ahead() const = 0;  // they have learnt samples that the host's units have not

  // Samples in order: rows of the layout, and `count` numbers of one output after the other. Begins with the
  // host's units unless the device's units are ahead. After an exception they are not ahead.
  virtual void learn(const std::vector<LwprUnit>& units, const double* rows, const double* y,
                     std::size_t count) = 0;
  // Copies these units to the host's units, if these are ahead. From any thread.
  virtual void fetch(std::vector<LwprUnit>* units) = 0;
  // The host's units have learnt something.
  virtual void forget() = 0;
};

// std::runtime_error in a build without CUDA.
std::unique_ptr<UnitsOnDevice> units_on_device(const FieldLayout& at, const LwprOptions& options, int device);

}  // namespace sdftrack::lwpr
