// SPDX-License-Identifier: MIT
#include "memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <new>

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(address, size) static_cast<void>(0)
#define ASAN_UNPOISON_MEMORY_REGION(address, size) static_cast<void>(0)
#endif

namespace cuda_on_cpu {

namespace {

constexpr std::size_t kAlign = 256, kMark = 256;
constexpr std::size_t kWatched = 4096;                  // of what was freed
constexpr unsigned char kMarked = 0xa5, kUnset = 0xff;  // floats: NaN

// It reads what is kept from everyone else.
#if defined(__SANITIZE_ADDRESS__)
[[gnu::no_sanitize_address, gnu::noinline]]
#endif
bool filled(const char* from, const char* to, unsigned char with) {
  for (; from < to; ++from)
    if (static_cast<unsigned char>(*from) != with) return false;
  return true;
}

std::size_t rounded(std::size_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }

}  // namespace

DeviceMemory::DeviceMemory(std::size_t bytes) : bytes_(rounded(bytes)) {
  void* const at = mmap(nullptr, bytes_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) throw std::bad_alloc();
  base_ = static_cast<char*>(at);
  ASAN_POISON_MEMORY_REGION(base_, bytes_);
}
DeviceMemory::~DeviceMemory() {
  ASAN_UNPOISON_MEMORY_REGION(base_, bytes_);
  munmap(base_, bytes_);
}

// First fit, each with marked bytes on both sides.
void* DeviceMemory::allocate(std::size_t bytes) {
  const std::size_t room = rounded(bytes) + 2 * kMark;
  std::size_t at = 0;
  for (const auto& [offset, size] : allocated_) {
    if (offset - kMark >= at + room) break;
    at = offset + rounded(size) + kMark;
  }
  if (bytes > bytes_ || at + room > bytes_) return nullptr;
  open();
  high_ = std::max(high_, at + room);
  mprotect(base_, high_, PROT_READ | PROT_WRITE);
  ASAN_UNPOISON_MEMORY_REGION(base_ + at, room);
  std::memset(base_ + at, kMarked, room);
  std::memset(base_ + at + kMark, kUnset, bytes);
  ASAN_POISON_MEMORY_REGION(base_ + at, kMark);
  ASAN_POISON_MEMORY_REGION(base_ + at + kMark + bytes, room - kMark - bytes);
  std::erase_if(freed_,
                [&](const auto& one) { return one.first < at + room && one.first + one.second > at; });
  allocated_[at + kMark] = bytes, in_use_ += bytes;
  close();
  return base_ + at + kMark;
}

bool DeviceMemory::free(void* pointer) {
  const auto found = allocated_.find(static_cast<std::size_t>(static_cast<char*>(pointer) - base_));
  if (!owns(pointer) || found == allocated_.end()) return false;
  open();
  std::memset(pointer, kUnset, found->second);
  ASAN_POISON_MEMORY_REGION(pointer, found->second);
  in_use_ -= found->second;
  freed_[found->first] = std::min(found->second, kWatched);
  allocated_.erase(found);
  close();
  return true;
}

bool DeviceMemory::owns(const void* pointer) const {
  const auto* const p = static_cast<const char*>(pointer);
  return p >= base_ && p < base_ + bytes_;
}

bool DeviceMemory::holds(const void* pointer, std::size_t bytes) const {
  if (!owns(pointer)) return false;
  const auto at = static_cast<std::size_t>(static_cast<const char*>(pointer) - base_);
  auto next = allocated_.upper_bound(at);
  if (next == allocated_.begin()) return false;
  --next;
  return at + bytes <= next->first + next->second;
}

void DeviceMemory::open() {
  if (open_++ == 0 && high_ > 0) mprotect(base_, high_, PROT_READ | PROT_WRITE);
}

bool DeviceMemory::close() {
  if (--open_ > 0) return true;
  const bool hold = marks_hold();
  if (high_ > 0) mprotect(base_, high_, PROT_NONE);
  return hold;
}

bool DeviceMemory::marks_hold() const {
  const auto marked = [&](std::size_t from, std::size_t to) {
    return filled(base_ + from, base_ + to, kMarked);
  };
  if (!std::all_of(freed_.begin(), freed_.end(), [&](const auto& one) {
        return filled(base_ + one.first, base_ + one.first + one.second, kUnset);
      }))
    return false;
  return std::all_of(allocated_.begin(), allocated_.end(), [&](const auto& one) {
    const auto [offset, size] = one;
    return marked(offset - kMark, offset) && marked(offset + size, offset + rounded(size) + kMark);
  });
}

}  // namespace cuda_on_cpu
