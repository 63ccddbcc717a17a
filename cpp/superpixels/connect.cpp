// SPDX-License-Identifier: MIT
#include "superpixels/connect.h"

#include <algorithm>
#include <cstddef>

namespace sdftrack {

namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void Connect::clear(int height, int width) {
  height_ = height, width_ = width;
  start_.clear(), center_.clear(), row_.clear();
  row_.push_back(0);
}

std::size_t Connect::bytes() const {
  return sizeof(int) * (start_.capacity() + center_.capacity() + row_.capacity() + parent_.capacity() +
                        size_.capacity());
}

int Connect::root(int run) {
  while (parent_[at(run)] != run) run = parent_[at(run)] = parent_[at(parent_[at(run)])];
  return run;
}

void Connect::unite(int a, int b) {
  a = root(a), b = root(b);
  parent_[at(std::max(a, b))] = std::min(a, b);
}

// What touches across the line above row y.
void Connect::join_rows(int y) {
  int above = row_[at(y) - 1], below = row_[at(y)];
  const int above_end = below, below_end = row_[at(y) + 1];
  while (above < above_end && below < below_end) {
    if (center_[at(above)] == center_[at(below)] && center_[at(below)] >= 0) unite(above, below);
    const int end_above = run_end(above) + width_, end_below = run_end(below);
    above += end_above <= end_below, below += end_below <= end_above;
  }
}

int Connect::join(std::int64_t min_size) {
  const int runs = static_cast<int>(center_.size());
  start_.push_back(height_ * width_);
  parent_.resize(at(runs)), size_.assign(at(runs), 0);
  for (int r = 0; r < runs; ++r) parent_[at(r)] = r;
  for (int y = 1; y < height_; ++y) join_rows(y);
  for (int r = 0; r < runs; ++r) {
    parent_[at(r)] = parent_[at(parent_[at(r)])];  // parents come first: they are roots by now
    size_[at(parent_[at(r)])] += run_end(r) - start_[at(r)];
  }
  absorb(min_size);
  int next = 0;
  for (int r = 0; r < runs; ++r) {
    if (center_[at(r)] < 0) continue;
    // A root has its number already when one of its runs comes: it is the first of them.
    const int parent = parent_[at(r)];
    parent_[at(r)] = parent == r ? next++ : parent_[at(parent)];
  }
  return next;
}

// visit(other) for the runs inside the mask that touch this one.
template <class Visit>
void Connect::each_neighbor(int run, const Visit& visit) const {
  const int y = start_[at(run)] / width_, begin = start_[at(run)], end = run_end(run);
  const auto tell = [&](int other) {
    if (center_[at(other)] >= 0) visit(other);
  };
  if (run > row_[at(y)]) tell(run - 1);
  if (run + 1 < row_[at(y) + 1]) tell(run + 1);
  for (const int dy : {-1, 1}) {
    if (y + dy < 0 || y + dy >= height_) continue;
    const int from = begin + dy * width_, to = end + dy * width_;
    const auto first = start_.begin() + row_[at(y + dy)], last = start_.begin() + row_[at(y + dy) + 1];
    int other = static_cast<int>(std::upper_bound(first, last, from) - start_.begin()) - 1;
    for (; other < row_[at(y + dy) + 1] && start_[at(other)] < to; ++other) tell(other);
  }
}

void Connect::absorb(std::int64_t min_size) {
  struct Choice {
    int root, best = -1;
  };
  std::vector<int> small;  // runs of small regions
  std::vector<Choice> choices;
  for (int r = 0; r < static_cast<int>(center_.size()); ++r)
    if (center_[at(r)] >= 0 && size_[at(parent_[at(r)])] < min_size) small.push_back(r);
  std::vector<int> choice_of;
  while (!small.empty()) {
    choices.clear(), choice_of.assign(small.size(), -1);
    // The root is the first run of its region, so it comes before the others; its place in `choices` is kept in
    // its size, negative, only while this round looks.
    std::vector<int> sizes;
    for (const int r : small)
      if (parent_[at(r)] == r) {
        sizes.push_back(size_[at(r)]);
        size_[at(r)] = -1 - static_cast<int>(choices.size());
        choices.push_back({r});
      }
    const auto size_of = [&](int root) {
      const int s = size_[at(root)];
      return s < 0 ? sizes[at(-1 - s)] : s;
    };
    for (const int r : small) {
      const int own = parent_[at(r)];
      Choice& choice = choices[at(-1 - size_[at(own)])];
      each_neighbor(r, [&](int other) {
        const int root = parent_[at(other)];
        if (root == own) return;
        const int more = choice.best < 0 ? 1 : size_of(root) - size_of(choice.best);
        if (more > 0 || (more == 0 && root < choice.best)) choice.best = root;
      });
    }
    for (const Choice& c : choices) size_[at(c.root)] = sizes[at(-1 - size_[at(c.root)])];
    bool joined = false;
    for (const Choice& c : choices) {
      if (c.best < 0) continue;
      const int a = root(c.root), b = root(c.best);
      if (a == b) continue;
      joined = true;
      const int first = std::min(a, b), sum = size_[at(a)] + size_[at(b)];
      parent_[at(std::max(a, b))] = first, size_[at(first)] = sum;
    }
    if (!joined) break;
    for (std::size_t r = 0; r < parent_.size(); ++r) parent_[r] = parent_[at(parent_[r])];
    std::erase_if(small, [&](int r) { return size_[at(parent_[at(r)])] >= min_size; });
  }
}

int Connect::number_centers(int centers) {
  start_.push_back(height_ * width_);
  size_.assign(at(centers), 0);
  for (const int c : center_)
    if (c >= 0) size_[at(c)] = 1;
  int next = 0;
  for (int& used : size_) used = used ? next++ : -1;
  parent_.resize(center_.size());
  for (std::size_t r = 0; r < center_.size(); ++r) parent_[r] = center_[r] < 0 ? 0 : size_[at(center_[r])];
  return next;
}

void Connect::write(int begin, int end, int first_label, int* labels) const {
  for (int r = row_[at(begin)]; r < row_[at(end)]; ++r) {
    const int label = center_[at(r)] < 0 ? 0 : parent_[at(r)] + first_label;
    std::fill(labels + start_[at(r)], labels + run_end(r), label);
  }
}

}  // namespace sdftrack
