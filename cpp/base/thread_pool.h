// SPDX-License-Identifier: MIT
// Threads that help with loops. This is the only place that creates threads.
//
// A loop is offered, not handed over: the caller itself takes chunk after chunk, and idle threads of the pool
// take some of the others. At the end the caller waits only for chunks that have started, not for threads
// that have not joined. If other processes use the processors, a loop takes about as long as on one thread.
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
  // Up to `workers` threads; fewer, or none, if the system provides no more.
  explicit ThreadPool(int workers);
  // No loop may be running.
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int workers() const { return int(threads_.size()); }
  // 1, 2, ... on the threads of a pool, 0 on all others: tells which caches hold which data between loops.
  static int thread_number();
  // Runs body(0) to body(chunks - 1) on the caller's thread and at most `helpers` of the pool's threads.
  void run(std::size_t chunks, int helpers, const ChunkBody& body);

 private:
  // A loop on offer. Slots live as long as the pool, so a late thread finds a slot that is closed or serves
  // another loop, never freed memory.
  struct alignas(64) Slot {
    // Generation (32 bits), helpers that have joined (8), next chunk (24): one word, so that a thread that
    // changes it knows that the loop is still the one that it read. Next == chunks: closed.
    std::atomic<std::uint64_t> ticket{0};
    std::atomic<std::uint32_t> chunks{0}, helpers{0};
    std::atomic<const ChunkBody*> body{nullptr};
    alignas(64) std::atomic<std::uint32_t> done{0};  // chunks run or skipped
    std::atomic<bool> taken{false}, failed{false};
    std::exception_ptr error;
  };
  static constexpr int kSlots = 16;  // loops at once; another loop runs only on its caller's thread

  Slot* take_slot();
  void run_in(Slot* slot, std::size_t first, std::uint32_t chunks, int helpers, const ChunkBody& body);
  static bool help(Slot* slot);
  static bool claim(Slot* slot, std::uint64_t* ticket, bool joins, std::uint32_t* chunk);
  static void run_chunk(Slot* slot, const ChunkBody& body, std::uint32_t chunk, std::uint32_t chunks);
  static void close(Slot* slot, std::uint32_t chunks);
  bool help_anywhere();
  void work(int number);

  std::array<Slot, kSlots> slots_;
  std::atomic<std::uint32_t> offers_{0};  // changes with each offered loop; idle threads wait for it
  std::atomic<int> idle_{0};
  std::atomic<bool> stopped_{false};
  std::vector<std::thread> threads_;
};

}  // namespace sdftrack
