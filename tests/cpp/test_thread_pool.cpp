// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <string>

#include "base/thread_pool.h"

#ifdef __GLIBC__
#include <dlfcn.h>
#include <pthread.h>

namespace {
bool no_threads = false;  // what a container's limit does
}

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* how, void* (*start)(void*),
                              void* with) {
  if (no_threads) return EAGAIN;
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  return create(thread, how, start, with);
}
#endif

namespace sdftrack {
namespace {

using std::chrono::milliseconds;

// How often each chunk was run, by a pool of its own.
std::vector<int> runs_of(ThreadPool* pool, std::size_t chunks, int helpers) {
  std::vector<std::atomic<int>> runs(chunks);
  const auto body = [&](std::size_t i) { runs[i].fetch_add(1); };
  pool->run(chunks, helpers, ChunkBody(body));
  return {runs.begin(), runs.end()};
}

TEST(ThreadPool, every_chunk_is_run_once_whatever_the_number_of_threads) {
  for (const int workers : {0, 1, 3, 7}) {
    ThreadPool pool(workers);
    for (const std::size_t chunks : {0u, 1u, 2u, 5u, 64u, 1000u})
      for (const int helpers : {0, 1, 2, 20})
        EXPECT_EQ(runs_of(&pool, chunks, helpers), std::vector<int>(chunks, 1))
            << workers << " workers, " << chunks << " chunks, " << helpers << " helpers";
  }
}

TEST(ThreadPool, many_loops_in_succession_leave_none_out) {
  ThreadPool pool(3);
  std::atomic<int> sum{0};
  const auto body = [&](std::size_t) { sum.fetch_add(1, std::memory_order_relaxed); };
  for (int i = 0; i < 20000; ++i) pool.run(7, 3, ChunkBody(body));
  EXPECT_EQ(sum, 140000);
}

TEST(ThreadPool, no_more_threads_take_part_than_were_asked_for) {
  ThreadPool pool(6);
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> inside{0}, most{0};
    const auto body = [&](std::size_t) {
      const int now = ++inside;
      for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
      }
      std::this_thread::sleep_for(milliseconds(1));
      --inside;
    };
    pool.run(12, 2, ChunkBody(body));
    ASSERT_LE(most, 3);
  }
}

TEST(ThreadPool, a_helper_that_is_at_work_elsewhere_is_not_waited_for) {
  ThreadPool pool(1);
  std::atomic<bool> held{false}, release{false};
  std::thread other([&] {  // keeps the only worker, or itself, inside a chunk
    const auto hold = [&](std::size_t) {
      held = true;
      while (!release) std::this_thread::yield();
    };
    pool.run(2, 1, ChunkBody(hold));
  });
  while (!held) std::this_thread::yield();
  std::this_thread::sleep_for(milliseconds(5));
  EXPECT_EQ(runs_of(&pool, 100, 1), std::vector<int>(100, 1));  // would not end if it waited
  release = true;
  other.join();
}

TEST(ThreadPool, several_callers_and_loops_within_loops_get_all_of_their_chunks) {
  ThreadPool pool(3);
  std::atomic<int> sum{0};
  const auto inner = [&](std::size_t) { ++sum; };
  const auto outer = [&](std::size_t) { pool.run(9, 3, ChunkBody(inner)); };
  std::vector<std::thread> callers;
  for (int i = 0; i < 20; ++i) callers.emplace_back([&] { pool.run(11, 3, ChunkBody(outer)); });
  for (std::thread& t : callers) t.join();
  EXPECT_EQ(sum, 20 * 11 * 9);
}

TEST(ThreadPool, an_exception_reaches_the_caller_ends_the_loop_and_leaves_the_pool_usable) {
  ThreadPool pool(3);
  for (int round = 0; round < 200; ++round) {
    std::atomic<int> runs{0};
    const auto body = [&](std::size_t i) {
      ++runs;
      if (i == 5) throw std::runtime_error("chunk " + std::to_string(i));
      if (i > 5)
        std::this_thread::sleep_for(std::chrono::microseconds(1));  // all of them: longer than a throw
    };
    try {
      pool.run(100000, 3, ChunkBody(body));
      FAIL() << "expected an exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "chunk 5");
    }
    ASSERT_LT(runs, 100000);
    ASSERT_EQ(runs_of(&pool, 50, 3), std::vector<int>(50, 1));
  }
}

TEST(ThreadPool, idle_threads_sleep) {
  ThreadPool pool(4);
  runs_of(&pool, 100, 4);
  std::this_thread::sleep_for(milliseconds(50));
  const std::clock_t begin = std::clock();
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 0.05);
}

#ifdef __GLIBC__
TEST(ThreadPool, where_no_thread_can_be_started_the_caller_does_the_work) {
  no_threads = true;
  ThreadPool pool(3);
  no_threads = false;
  EXPECT_EQ(pool.workers(), 0);
  EXPECT_EQ(runs_of(&pool, 20, 3), std::vector<int>(20, 1));
}

#endif

}  // namespace
}  // namespace sdftrack
