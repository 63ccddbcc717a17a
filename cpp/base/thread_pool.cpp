// SPDX-License-Identifier: MIT
#include "base/thread_pool.h"

#include <algorithm>
#include <utility>

namespace sdftrack {

namespace {

constexpr std::uint32_t kMaxChunks = (1u << 24) - 2;  // of one ticket; longer loops are split
constexpr int kMaxHelpers = 255;
// Checks for work before a thread sleeps, each followed by a yield: in all about the time of a wake-up.
// Longer loops come in quick succession.
constexpr int kLooks = 200;

constexpr std::uint32_t next_of(std::uint64_t ticket) {
  return static_cast<std::uint32_t>(ticket & 0xffffff);
}
constexpr std::uint32_t joined_of(std::uint64_t ticket) {
  return static_cast<std::uint32_t>(ticket >> 24 & 0xff);
}
constexpr std::uint64_t kClosed = 0xffffff;  // not the number of a chunk of any loop
constexpr std::uint64_t kOneChunk = 1, kOneHelper = 1u << 24, kOneGeneration = std::uint64_t{1} << 32;

thread_local int own_number = 0;

}  // namespace

int ThreadPool::thread_number() { return own_number; }

ThreadPool::ThreadPool(int workers) {
  threads_.reserve(std::clamp(workers, 0, kMaxHelpers));
  try {
    while (threads_.size() < threads_.capacity())
      threads_.emplace_back([this, number = int(threads_.size()) + 1] { work(number); });
  } catch (const std::exception&) {
    // The system provides no more threads or no memory for them: the callers work without them.
  }
}

ThreadPool::~ThreadPool() {
  stopped_ = true;
  ++offers_;
  offers_.notify_all();
  for (std::thread& t : threads_) t.join();
}

void ThreadPool::run(std::size_t chunks, int helpers, const ChunkBody& body) {
  Slot* const slot = helpers > 0 && chunks > 1 ? take_slot() : nullptr;
  if (!slot) {
    for (std::size_t i = 0; i < chunks; ++i) body(i);
    return;
  }
  for (std::size_t first = 0; first < chunks; first += kMaxChunks) {
    const auto part = static_cast<std::uint32_t>(std::min<std::size_t>(kMaxChunks, chunks - first));
    run_in(slot, first, part, std::min(helpers, kMaxHelpers), body);
    if (slot->failed.load(std::memory_order_acquire)) break;
  }
  const std::exception_ptr error = std::exchange(slot->error, nullptr);
  slot->failed.store(false, std::memory_order_relaxed);
  slot->taken.store(false, std::memory_order_release);
  if (error) std::rethrow_exception(error);
}

ThreadPool::Slot* ThreadPool::take_slot() {
  for (Slot& slot : slots_)
    if (!slot.taken.load(std::memory_order_relaxed) && !slot.taken.exchange(true, std::memory_order_acquire))
      return &slot;
  return nullptr;
}

void ThreadPool::run_in(Slot* slot, std::size_t first, std::uint32_t chunks, int helpers,
                        const ChunkBody& whole) {
  const auto part = [&](std::size_t i) { whole(first + i); };
  const ChunkBody body(part);
  // A new generation, closed while its values are written: a thread that reads these values and then finds
  // the ticket unchanged has read all of them from the same loop.
  std::uint64_t ticket = slot->ticket.load(std::memory_order_relaxed);
  ticket = (ticket & ~(kOneGeneration - 1)) + kOneGeneration;
  slot->ticket.store(ticket | kClosed, std::memory_order_relaxed);
  slot->done.store(0, std::memory_order_relaxed);
  slot->chunks.store(chunks, std::memory_order_release);
  slot->helpers.store(static_cast<std::uint32_t>(helpers), std::memory_order_release);
  slot->body.store(&body, std::memory_order_release);
  slot->ticket.store(ticket, std::memory_order_release);
  offers_.fetch_add(1, std::memory_order_seq_cst);
  if (const int idle = idle_.load(std::memory_order_seq_cst); idle > 0) {
    if (helpers >= workers() && idle > 1)
      offers_.notify_all();
    else
      for (int i = 0; i < std::min(helpers, idle); ++i) offers_.notify_one();
  }
  for (std::uint32_t chunk; claim(slot, &ticket, false, &chunk);) run_chunk(slot, body, chunk, chunks);
  for (std::uint32_t done; (done = slot->done.load(std::memory_order_acquire)) < chunks;)
    slot->done.wait(done, std::memory_order_acquire);
}

// Takes the next chunk of the loop from which *ticket was read; false: no chunk is left, or the loop is over.
bool ThreadPool::claim(Slot* slot, std::uint64_t* ticket, bool joins, std::uint32_t* chunk) {
  const std::uint64_t generation = *ticket >> 32;
  for (;;) {
    const std::uint32_t next = next_of(*ticket);
    if (next >= slot->chunks.load(std::memory_order_acquire)) return false;
    if (joins && joined_of(*ticket) >= slot->helpers.load(std::memory_order_acquire)) return false;
    const std::uint64_t taken = *ticket + kOneChunk + (joins ? kOneHelper : 0);
    // Succeeds only if nothing has changed. Then the chunk, and with it the loop, waits for this thread.
    if (slot->ticket.compare_exchange_weak(*ticket, taken, std::memory_order_acq_rel,
                                           std::memory_order_acquire)) {
      *ticket = taken;
      *chunk = next;
      return true;
    }
    if (*ticket >> 32 != generation) return false;
  }
}

void ThreadPool::run_chunk(Slot* slot, const ChunkBody& body, std::uint32_t chunk, std::uint32_t chunks) {
  try {
    body(chunk);
  } catch (...) {
    if (!slot->failed.exchange(true, std::memory_order_acq_rel)) slot->error = std::current_exception();
    close(slot, chunks);
  }
  // After the last chunk is counted, only the slot may be used, not the loop's other data.
  if (slot->done.fetch_add(1, std::memory_order_acq_rel) + 1 == chunks) slot->done.notify_all();
}

// Counts the chunks that have not started as done; this thread's own is counted later.
void ThreadPool::close(Slot* slot, std::uint32_t chunks) {
  std::uint64_t ticket = slot->ticket.load(std::memory_order_relaxed);
  while (next_of(ticket) < chunks)
    if (slot->ticket.compare_exchange_weak(ticket, ticket + (chunks - next_of(ticket)),
                                           std::memory_order_acq_rel, std::memory_order_relaxed)) {
      slot->done.fetch_add(chunks - next_of(ticket), std::memory_order_acq_rel);
      return;
    }
}

// Returns whether a chunk was run.
bool ThreadPool::help(Slot* slot) {
  std::uint64_t ticket = slot->ticket.load(std::memory_order_acquire);
  const ChunkBody* const body = slot->body.load(std::memory_order_acquire);
  const std::uint32_t chunks = slot->chunks.load(std::memory_order_acquire);
  std::uint32_t chunk;
  // If the claim succeeds, the values read above belong to the loop of the chunk.
  if (next_of(ticket) >= chunks || !claim(slot, &ticket, true, &chunk)) return false;
  do run_chunk(slot, *body, chunk, chunks);
  while (claim(slot, &ticket, false, &chunk));
  return true;
}

bool ThreadPool::help_anywhere() {
  bool any = false;
  for (Slot& slot : slots_) any |= help(&slot);
  return any;
}

void ThreadPool::work(int number) {
  own_number = number;
  while (!stopped_.load(std::memory_order_relaxed)) {
    for (int look = 0; look < kLooks; ++look) {
      if (help_anywhere()) look = 0;
      std::this_thread::yield();
    }
    // A loop that is offered after this sees an idle thread; an earlier loop is found by one more check.
    idle_.fetch_add(1, std::memory_order_seq_cst);
    const std::uint32_t seen = offers_.load(std::memory_order_seq_cst);
    if (!help_anywhere() && !stopped_) offers_.wait(seen, std::memory_order_relaxed);
    idle_.fetch_sub(1, std::memory_order_relaxed);
  }
}

}  // namespace sdftrack
