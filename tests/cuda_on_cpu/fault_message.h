// SPDX-License-Identifier: MIT
// What is said before a segmentation fault ends the process: which kernel it was, and at what address.
#pragma once

namespace cuda_on_cpu {

// While it lives the calling thread runs this kernel; nullptr: none.
class FaultMessage {
 public:
  explicit FaultMessage(const char* kernel);
  ~FaultMessage();
  FaultMessage(const FaultMessage&) = delete;
  FaultMessage& operator=(const FaultMessage&) = delete;
};

}  // namespace cuda_on_cpu
