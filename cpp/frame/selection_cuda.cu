// SPDX-License-Identifier: MIT
// Compiled without fused multiply-add, so that a pixel on the border of a box is chosen as on the CPU.
#include "energies/cuda_work.cuh"
#include "frame/selection_cuda.h"

namespace sdftrack::frame {

namespace {

constexpr int kThreads_ = 256, kWarps = kThreads_ / 32;

// One object, with all addresses on the device.
struct Place {
  Lookout lookout;
  const unsigned char* mask;  // nullptr: all pixels
  int first;                  // first slot of its pixels
};

// One warp per row of an object's region.
struct Rows {
  const Place* places;
  int objects, most;  // rows of the largest region, at least one
  int* counts;        // candidates per row, object after object

  __device__ int row() const { return int(blockIdx.x) * kWarps + int(threadIdx.x) / 32; }
  __device__ bool exists(int row) const { return row < objects * most; }

  // Calls found(x, number of candidates to its left in the row); returns the number of candidates.
  template <class Found>
  __device__ int each_candidate(const Place& place, int y, const Found& found) const {
    const Rect& rect = place.lookout.rect;
    const int lane = int(threadIdx.x) % 32;
    int before = 0;
    if (y >= rect.y1) return 0;
    for (int x0 = rect.x0; x0 < rect.x1; x0 += 32) {
      const int x = x0 + lane;
      const bool is_one = x < rect.x1 && place.lookout.term.wants(x, y, 1) &&
                          (!place.mask || place.mask[y * place.lookout.term.width + x]);
      const unsigned ones = __ballot_sync(0xffffffffu, is_one);
      if (is_one) found(x, before + __popc(ones & ((1u << lane) - 1)));
      before += __popc(ones);
    }
    return before;
  }
};

struct CountRows {
  static constexpr const char* kName = "count candidates";
  static constexpr int kThreads = kThreads_;
  Rows rows;

  __device__ void operator()() const {
    const int row = rows.row();
    if (!rows.exists(row)) return;
    const Place& place = rows.places[row / rows.most];
    const int count = rows.each_candidate(place, place.lookout.rect.y0 + row % rows.most, [](int, int) {});
    if (threadIdx.x % 32 == 0) rows.counts[row] = count;
  }
};

struct PackRows {
  static constexpr const char* kName = "pack pixels";
  static constexpr int kThreads = kThreads_;
  Rows rows;
  int requested;
  int* packed;  // number for each object
  energies::PixelsView<float> out;
  float *u_px, *v_px, *depth_m, *per_noise, *foreground;

  __device__ void operator()() const {
    const int row = rows.row();
    if (!rows.exists(row)) return;
    const int object = row / rows.most, mine = row % rows.most;
    const Place& place = rows.places[object];
    int before = 0, all = 0;
    for (int k = int(threadIdx.x) % 32; k < rows.most; k += 32) {
      const int count = rows.counts[object * rows.most + k];
      before += k < mine ? count : 0, all += count;
    }
    for (int half = 16; half > 0; half /= 2) {
      before += __shfl_xor_sync(0xffffffffu, before, half);
      all += __shfl_xor_sync(0xffffffffu, all, half);
    }
    const Spread spread = Spread::of(requested, all);
    if (mine == 0 && threadIdx.x % 32 == 0) packed[object] = spread.requested;
    const int y = place.lookout.rect.y0 + mine;
    rows.each_candidate(place, y, [&](int x, int left) {
      const int k = spread.place_of(before + left);
      if (k >= 0) put(place, x, y, place.first + k);
    });
  }

 private:
  __device__ void put(const Place& place, int x, int y, int i) const {
    const SelectTerm<float>& term = place.lookout.term;
    const Vec2f u = ideal_pixel(term.rays, term.K, term.width, x, y);
    const float z = term.depth_m[y * term.width + x];
    u_px[i] = u.x, v_px[i] = u.y, depth_m[i] = z, per_noise[i] = place.lookout.noise.per_noise(z);
    foreground[i] = 0, out.hit_m[i] = z, out.gain[i] = 1;
  }
};

// The rows of an image that the regions cover.
struct Band {
  int y0 = 0, y1 = 0;
};

Band band_of(const std::vector<Lookout>& lookouts) {
  Band band;
  for (const Lookout& l : lookouts) {
    if (l.rect.empty()) continue;
    if (band.y1 == 0) band = {l.rect.y0, l.rect.y1};
    band = {std::min(band.y0, l.rect.y0), std::max(band.y1, l.rect.y1)};
  }
  return band;
}

// Uploads the rows of a band, `channels` numbers per pixel, to the same positions as in the image.
template <class T>
void send(const DeviceStream& stream, const T* image, int width, int channels, Band band, T* device) {
  const auto row = std::size_t(width) * channels;
  const std::size_t first = row * std::size_t(band.y0);
  stream.upload(image + first, row * std::size_t(band.y1 - band.y0), device + first);
}

}  // namespace

PixelsOnDevice choose_on_device(energies::CudaWork* work, const DepthFrame& frame,
                                const std::vector<Lookout>& lookouts, int requested) {
  energies::CudaWork::Impl& w = work->impl();
  const DeviceScope scope(w.device);
  const std::size_t n = lookouts.size();
  PixelsOnDevice out;
  int all = 0, most = 1;
  for (const Lookout& l : lookouts) {
    const int area = l.rect.empty() ? 0 : (l.rect.x1 - l.rect.x0) * (l.rect.y1 - l.rect.y0);
    out.first.push_back(all), out.room.push_back(std::clamp(requested, 0, area));
    all += out.room.back();
    if (area > 0) most = std::max(most, l.rect.y1 - l.rect.y0);
  }
  out.all = work->make_room(all);

  const int width = frame.depth_m.width;
  const auto pixels = std::size_t(width) * frame.depth_m.height;
  const Band band = band_of(lookouts);
  w.image.room(pixels * (frame.rays ? 3 : 1));
  float* const depth_m = w.image.data();
  float* const rays = frame.rays ? depth_m + pixels : nullptr;
  send(w.stream, frame.measured_m(), width, 1, band, depth_m);
  if (rays) send(w.stream, frame.rays, width, 2, band, rays);
  unsigned char* mask = nullptr;
  if (frame.mask) send(w.stream, frame.mask, width, 1, band, mask = w.mask.room(pixels));

  const std::size_t bytes = n * sizeof(Place);
  w.take_turn(energies::CudaWork::Impl::kPlaces);
  w.places_here.room(bytes), w.places.room(bytes);
  for (std::size_t k = 0; k < n; ++k) {
    Place place{lookouts[k], mask, out.first[k]};
    place.lookout.term.depth_m = depth_m, place.lookout.term.rays = rays;
    std::memcpy(w.places_here.data() + k * sizeof(Place), &place, sizeof(Place));
  }
  w.stream.upload(w.places_here.data(), bytes, w.places.data());

  w.chosen.room(n * std::size_t(most + 1));
  out.counts = w.chosen.data();
  const Rows rows{reinterpret_cast<const Place*>(w.places.data()), int(n), most, w.chosen.data() + n};
  const unsigned blocks = blocks_of(static_cast<std::int64_t>(n) * most, kWarps);
  launch(w.stream, blocks, CountRows{rows});
  launch(w.stream, blocks,
         PackRows{rows, requested, w.chosen.data(), out.all, w.column(0), w.column(1), w.column(2),
                  w.column(3), w.column(4)});
  return out;
}

}  // namespace sdftrack::frame
