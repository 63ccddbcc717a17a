// SPDX-License-Identifier: MIT
// Stacks of their own within one thread of the system: changing between two takes nanoseconds.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace cuda_on_cpu {

class Fiber {
 public:
  Fiber();
  ~Fiber();
  Fiber(const Fiber&) = delete;
  Fiber& operator=(const Fiber&) = delete;

  // The next resume() calls `body`, from its beginning. What ran before and has not ended is forgotten.
  void start(std::function<void()> body);
  void resume();  // until it yields or ends
  void yield();   // called within
  bool ended() const { return ended_; }

 private:
  struct Machine;
  static void run(Fiber* self);

  std::function<void()> body_;
  std::unique_ptr<Machine> machine_;
  bool ended_ = true;
};

}  // namespace cuda_on_cpu
