// SPDX-License-Identifier: MIT
#include "base/large_array.h"

#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace sdftrack {

namespace {

#if defined(__linux__)
constexpr std::size_t kPage = std::size_t{2} << 20, kLeast = 4 * kPage;

std::size_t whole_pages(std::size_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }
#endif

// States the size, because the caller requests a volume in voxels and does not know its bytes.
class NoRoom : public std::bad_alloc {
 public:
  explicit NoRoom(std::size_t bytes)
      : text_("expected " + std::to_string((bytes >> 20) + 1) +
              " MB of free memory for a volume; fewer voxels need less") {}
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

}  // namespace

void* zeroed_pages(std::size_t bytes) {
#if defined(__linux__)
  if (bytes >= kLeast) {
    const std::size_t needed = whole_pages(bytes);
    void* const all =
        mmap(nullptr, needed + kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (all == MAP_FAILED) throw NoRoom(bytes);
    // Huge pages start at multiples of their size; the rest is returned to the system.
    char* const first = static_cast<char*>(all);
    const std::size_t before = (kPage - reinterpret_cast<std::uintptr_t>(all) % kPage) % kPage;
    if (before) munmap(first, before);
    munmap(first + before + needed, kPage - before);
    madvise(first + before, needed, MADV_HUGEPAGE);  // no harm if the system ignores it
    return first + before;
  }
#endif
  void* const p = std::calloc(bytes ? bytes : 1, 1);
  if (!p) throw NoRoom(bytes);
  return p;
}

void free_pages(void* p, [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__)
  if (p && bytes >= kLeast) {
    munmap(p, whole_pages(bytes));
    return;
  }
#endif
  std::free(p);
}

}  // namespace sdftrack
