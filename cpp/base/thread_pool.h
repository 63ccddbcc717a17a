// SPDX-License-Identifier: MIT
// Threads that help with loops. The one place that makes threads.
//
// A loop is offered, never handed over: the caller takes chunk after chunk itself, threads of the pool that
// happen to be free take some of the others, and in the end the caller waits for chunks that have been begun,
// not for threads that have not come. Where other processes keep the processors busy a loop takes about as
// long as it would on one thread.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

namespace sdftrack {

// A reference to a callable body(chunk), which must outlive it.
class ChunkBody {
 public:
  template <class Body>
  explicit ChunkBody(const Body& body)
      : body_(&body), call_([](const void* b, std::size_t i) { (*static_cast<const Body*>(b))(i); }) {}
  void operator()(std::size_t chunk) const { call_(body_, chunk); }

 private:
  const void* body_;
  void (*call_)(const void*, std::size_t);
};

class ThreadPool {
 public:
  // Up to `workers` threads; fewer, or none, where the system lends no more.
  explicit ThreadPool(int workers);
  // No loop may be running.
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int workers() const { return static_cast<int>(threads_.size()); }
  // 1, 2, ... on the threads of a pool, 0 on all others: whose caches hold what, from loop to loop.
  static int thread_number();
  // body(0) to body(chunks - 1), by the caller and at most `helpers` of the threads.
  void run(std::size_t chunks, int helpers, const ChunkBody& body);

 private:
  // A loop on offer. Slots live as long as the pool, so a thread that comes late looks at one that is closed
  // or serves another loop, never at memory that is gone.
  struct alignas(64) Slot {
    // Generation (32 bits), helpers that have joined (8), next chunk (24): one word, so that whoever changes
    // it knows that the loop is still the one that was looked at. Next == chunks: closed.
    std::atomic<std::uint64_t> ticket{0};
    std::atomic<std::uint32_t> chunks{0}, helpers{0};
    std::atomic<const ChunkBody*> body{nullptr};
    alignas(64) std::atomic<std::uint32_t> done{0};  // chunks run or skipped
    std::atomic<bool> taken{false}, failed{false};
    std::exception_ptr error;
  };
  static constexpr int kSlots = 16;  // loops at once; one more runs on its caller's thread alone

  Slot* take_slot();
  void run_in(Slot* slot, std::size_t first, std::uint32_t chunks, int helpers, const ChunkBody& body);
  static bool help(Slot* slot);
  static bool claim(Slot* slot, std::uint64_t* ticket, bool joins, std::uint32_t* chunk);
  static void run_chunk(Slot* slot, const ChunkBody& body, std::uint32_t chunk, std::uint32_t chunks);
  static void close(Slot* slot, std::uint32_t chunks);
  bool help_anywhere();
  void work(int number);

  std::array<Slot, kSlots> slots_;
  std::atomic<std::uint32_t> offers_{
      0};  // changes with each loop that is offered; what idle threads wait for
  std::atomic<int> idle_{0};
  std::atomic<bool> stopped_{false};
  std::vector<std::thread> threads_;
};

}  // namespace sdftrack
