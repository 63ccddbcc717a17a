// SPDX-License-Identifier: MIT
#include "fiber.h"

#include <sys/mman.h>
#include <ucontext.h>

#include <new>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#endif

// Registers that a function must keep go to its stack, and the stack changes.
#if defined(__x86_64__)
#define CUDA_ON_CPU_SWITCH 1
extern "C" void cuda_on_cpu_switch(void** save, void* load);
asm(R"(
.text
.globl cuda_on_cpu_switch
.hidden cuda_on_cpu_switch
.type cuda_on_cpu_switch, @function
cuda_on_cpu_switch:
  pushq %rbp
  pushq %rbx
  pushq %r12
  pushq %r13
  pushq %r14
  pushq %r15
  movq %rsp, (%rdi)
  movq %rsi, %rsp
  popq %r15
  popq %r14
  popq %r13
  popq %r12
  popq %rbx
  popq %rbp
  ret
.size cuda_on_cpu_switch, .-cuda_on_cpu_switch
)");
#else
#define CUDA_ON_CPU_SWITCH 0
#endif

namespace cuda_on_cpu {

namespace {

constexpr std::size_t kStackBytes = 128 << 10;

}  // namespace

struct Fiber::Machine {
  char* stack = nullptr;
#if CUDA_ON_CPU_SWITCH
  void *inside = nullptr, *outside = nullptr;
#else
  ucontext_t inside, outside;
#endif
#if defined(__SANITIZE_ADDRESS__)
  void *fake_inside = nullptr, *fake_outside = nullptr;
  const void* outer_stack = nullptr;
  std::size_t outer_bytes = 0;
#endif

  Machine() {
    void* const at = mmap(nullptr, kStackBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    stack = static_cast<char*>(at);
    mprotect(stack, 4096, PROT_NONE);  // an overflow is seen
  }
  ~Machine() { munmap(stack, kStackBytes); }
};

Fiber::Fiber() : machine_(std::make_unique<Machine>()) {}
Fiber::~Fiber() = default;

namespace {
thread_local Fiber* starting = nullptr;
}

void Fiber::run(Fiber* self) {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(nullptr, &self->machine_->outer_stack, &self->machine_->outer_bytes);
#endif
  self->body_();
  self->ended_ = true;
  Machine& m = *self->machine_;
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(nullptr, m.outer_stack, m.outer_bytes);
#endif
#if CUDA_ON_CPU_SWITCH
  cuda_on_cpu_switch(&m.inside, m.outside);
#else
  setcontext(&m.outside);
#endif
  __builtin_unreachable();
}

void Fiber::start(std::function<void()> body) {
  Machine& m = *machine_;
#if defined(__SANITIZE_ADDRESS__)
  if (!ended_) __asan_unpoison_memory_region(m.stack, kStackBytes);  // frames that were never left
#endif
  body_ = std::move(body);
  ended_ = false;
  void (*const entry)() = [] { run(starting); };
#if CUDA_ON_CPU_SWITCH
  // As after a call: six registers, the address to go to, and a stack that is 8 off a multiple of 16 there.
  auto top = reinterpret_cast<void**>(m.stack + kStackBytes - 64);
  *--top = nullptr;
  *--top = reinterpret_cast<void*>(entry);
  for (int k = 0; k < 6; ++k) *--top = nullptr;
  m.inside = top;
#else
  getcontext(&m.inside);
  m.inside.uc_stack.ss_sp = m.stack, m.inside.uc_stack.ss_size = kStackBytes, m.inside.uc_link = nullptr;
  makecontext(&m.inside, entry, 0);
#endif
}

void Fiber::resume() {
  Machine& m = *machine_;
  starting = this;
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(&m.fake_outside, m.stack, kStackBytes);
#endif
#if CUDA_ON_CPU_SWITCH
  cuda_on_cpu_switch(&m.outside, m.inside);
#else
  swapcontext(&m.outside, &m.inside);
#endif
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(m.fake_outside, nullptr, nullptr);
#endif
}

void Fiber::yield() {
  Machine& m = *machine_;
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(&m.fake_inside, m.outer_stack, m.outer_bytes);
#endif
#if CUDA_ON_CPU_SWITCH
  cuda_on_cpu_switch(&m.inside, m.outside);
#else
  swapcontext(&m.inside, &m.outside);
#endif
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(m.fake_inside, &m.outer_stack, &m.outer_bytes);
#endif
}

}  // namespace cuda_on_cpu
