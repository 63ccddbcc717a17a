// SPDX-License-Identifier: MIT
#include "fault_message.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <mutex>

namespace cuda_on_cpu {

namespace {

thread_local const char* running = nullptr;
struct sigaction before;  // whoever is to hear of it next

// Comes back to the instruction, whose fault then is the earlier handler's.
void say(int, siginfo_t* info, void*) {
  if (running) {
    std::array<char, 300> text;
    const int length =
        std::snprintf(text.data(), text.size(),
                      "CUDA on the CPU: kernel '%s' uses %p, which is no memory of its device, "
                      "or more stack than there is\n",
                      running, info->si_addr);
    if (length > 0 && write(STDERR_FILENO, text.data(), static_cast<std::size_t>(length)) < 0) return;
  }
  sigaction(SIGSEGV, &before, nullptr);
}

// The handler has a stack of its own: that of the fiber may be what is full.
struct OwnStack {
  std::array<char, 64 << 10> bytes;
  stack_t earlier{};
  OwnStack() {
    stack_t own{};
    own.ss_sp = bytes.data(), own.ss_size = bytes.size();
    sigaltstack(&own, &earlier);
  }
  ~OwnStack() { sigaltstack(&earlier, nullptr); }
};

}  // namespace

FaultMessage::FaultMessage(const char* kernel) {
  static std::once_flag once;
  std::call_once(once, [] {
    struct sigaction own {};
    own.sa_sigaction = say;
    own.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigaction(SIGSEGV, &own, &before);
  });
  thread_local OwnStack stack;
  static_cast<void>(stack);
  running = kernel;
}
FaultMessage::~FaultMessage() { running = nullptr; }

}  // namespace cuda_on_cpu
