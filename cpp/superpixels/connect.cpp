// SPDX-License-Identifier: MIT
#include "superpixels/connect.h"

#include <algorithm>
#include <cstring>

namespace sdftrack {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void Connect::begin(int height, int width, const int* start, const int* center, std::vector<int> row,
                    std::span<int> spare) {
  height_ = height, width_ = width, start_ = start, center_ = center, row_ = std::move(row);
  const int runs = row_.back();
  parent_.resize(at(runs)), size_.resize(at(runs));
  if (spare.size() < 2 * at(runs)) own_.resize(2 * at(runs)), spare = own_;
  above_ = spare.data(), below_ = above_ + runs;
  for (int r = 0; r < runs; ++r) parent_[at(r)] = r;
}

std::size_t Connect::bytes() const {
  return sizeof(int) *
             (row_.capacity() + parent_.capacity() + size_.capacity() + own_.capacity() + small_.capacity()) +
         sizeof(Choice) * choices_.capacity();
}

int Connect::root(int run) {
  while (parent_[at(run)] != run) run = parent_[at(run)] = parent_[at(parent_[at(run)])];
  return run;
}

void Connect::join_rows(int y) {
  int above = first_run(y - 1), below = first_run(y);
  const int above_end = below, below_end = first_run(y + 1);
  above_[below] = above, below_[above] = below;
  while (true) {
    const int center = center_[above];
    if (center == center_[below] && center >= 0 && parent_[at(above)] != parent_[at(below)]) {
      const int a = root(above), b = root(below);
      parent_[at(std::max(a, b))] = std::min(a, b);
    }
    const int end_above = run_end(above) + width_, end_below = run_end(below);
    const bool next_above = end_above <= end_below, next_below = end_below <= end_above;
    above += next_above, below += next_below;
    if (above == above_end || below == below_end) return;  // at once: both rows are as wide
    if (next_above) below_[above] = below;
    if (next_below) above_[below] = above;
  }
}

int Connect::finish(std::int64_t min_size) {
  std::fill(size_.begin(), size_.end(), 0);
  for (int r = 0; r < runs(); ++r) {
    const int first = parent_[at(r)] =
        parent_[at(parent_[at(r)])];  // parents come first: they are roots by now
    size_[at(first)] += run_end(r) - start_[r];
  }
  absorb(min_size);
  int next = 0;
  for (int r = 0; r < runs(); ++r) {
    const int parent = parent_[at(r)];
    if (center_[r] < 0)
      parent_[at(r)] = -1;
    else  // a root is the first of its runs, and has its number when another comes
      parent_[at(r)] = parent == r ? next++ : parent_[at(parent)];
  }
  return next;
}

// visit(other) for the runs inside the mask that touch this one.
template <class Visit>
void Connect::each_neighbor(int run, const Visit& visit) const {
  const int y = start_[run] / width_, end = run_end(run);
  const auto tell = [&](int other) {
    if (center_[other] >= 0) visit(other);
  };
  if (run > first_run(y)) tell(run - 1);
  if (run + 1 < first_run(y + 1)) tell(run + 1);
  if (y > 0)
    for (int r = above_[run]; r < first_run(y) && start_[r] < end - width_; ++r) tell(r);
  if (y + 1 < height_)
    for (int r = below_[run]; r < first_run(y + 2) && start_[r] < end + width_; ++r) tell(r);
}

// The best neighbour of each small region. While this looks, the size of a small root is -1 - its place in
// choices_.
void Connect::choose(const std::vector<int>& small) {
  choices_.clear();
  for (const int r : small)
    if (parent_[at(r)] == r) {
      choices_.push_back({r, size_[at(r)], -1});
      size_[at(r)] = -static_cast<int>(choices_.size());
    }
  const auto size_of = [&](int root) {
    const int s = size_[at(root)];
    return s < 0 ? choices_[at(-1 - s)].size : s;
  };
  for (const int r : small) {
    const int own = parent_[at(r)];
    Choice& choice = choices_[at(-1 - size_[at(own)])];
    each_neighbor(r, [&](int other) {
      const int root = parent_[at(other)];
      if (root == own || root == choice.best) return;
      const int more = choice.best < 0 ? 1 : size_of(root) - size_of(choice.best);
      if (more > 0 || (more == 0 && root < choice.best)) choice.best = root;
    });
  }
  for (const Choice& c : choices_) size_[at(c.root)] = c.size;
}

bool Connect::join_choices() {
  bool joined = false;
  for (const Choice& c : choices_) {
    if (c.best < 0) continue;
    const int a = root(c.root), b = root(c.best);
    if (a == b) continue;  // the other has chosen this one
    joined = true;
    const int first = std::min(a, b), sum = size_[at(a)] + size_[at(b)];
    parent_[at(std::max(a, b))] = first, size_[at(first)] = sum;
  }
  return joined;
}

void Connect::absorb(std::int64_t min_size) {
  small_.clear();
  for (int r = 0; r < runs(); ++r)
    if (center_[r] >= 0 && size_[at(parent_[at(r)])] < min_size) small_.push_back(r);
  while (!small_.empty()) {
    choose(small_);
    if (!join_choices()) return;  // nothing but small regions without a neighbour
    for (int r = 0; r < runs(); ++r) parent_[at(r)] = parent_[at(parent_[at(r)])];
    std::erase_if(small_, [&](int r) { return size_[at(parent_[at(r)])] >= min_size; });
  }
}

int Connect::number_centers(int centers) {
  std::vector<int> number(at(centers), -1);
  for (int r = 0; r < runs(); ++r)
    if (center_[r] >= 0) number[at(center_[r])] = 0;
  int next = 0;
  for (int& n : number)
    if (n == 0) n = next++;
  for (int r = 0; r < runs(); ++r) parent_[at(r)] = center_[r] < 0 ? -1 : number[at(center_[r])];
  return next;
}

void Connect::write(int begin, int end, int first_label, int* labels) const {
  constexpr int kAtOnce = 8;  // most runs are short: eight at once, the next run writes over what is too many
  const int last = end * width_ - kAtOnce;
  for (int r = first_run(begin); r < first_run(end); ++r) {
    const int number = parent_[at(r)], label = number < 0 ? 0 : number + first_label;
    int i = start_[r];
    const int stop = run_end(r);
    int some[kAtOnce];
    std::fill_n(some, kAtOnce, label);
    for (; i < stop && i <= last; i += kAtOnce) std::memcpy(labels + i, some, sizeof some);
    for (; i < stop; ++i) labels[i] = label;
  }
}

}  // namespace sdftrack
