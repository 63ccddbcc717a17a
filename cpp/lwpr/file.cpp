// SPDX-License-Identifier: MIT
// A model in bytes: the mark, the version, the number of numbers, the numbers (float64 in this machine's byte
// order; the mark does not match in another), their checksum.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "lwpr/model.h"

namespace sdftrack::lwpr {

namespace {

constexpr std::uint64_t kMark = 0x3152505754464453ULL;  // "SDFTWPR1" from the low byte on
constexpr std::uint64_t kVersion = 1;
constexpr std::size_t kHeadBytes = 3 * sizeof(std::uint64_t);
constexpr double kMaxCount = 1e6;  // of inputs or outputs: a larger number is not a valid model

[[noreturn]] void refuse(const char* why) {
  throw std::invalid_argument(std::string("expected a model written by LWPR.save, got ") + why);
}

// FNV-1a on 64-bit words.
std::uint64_t checksum(const char* data, std::size_t size) {
  std::uint64_t hash = 0xcbf29ce484222325ULL, word = 0;
  for (std::size_t at = 0; at < size; at += sizeof(word)) {
    std::memcpy(&word, data + at, sizeof(word));
    hash = (hash ^ word) * 0x100000001b3ULL;
    hash ^= hash >> 32;
  }
  return hash;
}

void append(std::string* out, const void* data, std::size_t size) {
  out->append(static_cast<const char*>(data), size);
}

std::vector<double> numbers_of(const LwprOptions& o) {
  return {o.w_gen,
          o.w_prune,
          o.w_cutoff,
          double(o.diagonal),
          double(o.update_D),
          o.init_alpha,
          double(o.meta),
          o.meta_rate,
          o.penalty,
          o.add_threshold,
          o.init_lambda,
          o.final_lambda,
          o.tau_lambda,
          double(o.init_D.size())};
}

// Reads numbers in sequence.
class Reader {
 public:
  Reader(const double* begin, const double* end) : at(begin), end_(end) {}
  double next() {
    if (at == end_) refuse("a truncated model");
    return *at++;
  }
  std::size_t count() {
    const double value = next();
    if (!(value >= 0 && value <= kMaxCount * kMaxCount && value == std::floor(value)))
      refuse("a model with an invalid count");
    return std::size_t(value);
  }
  std::vector<double> numbers(std::size_t n) {
    if (n > std::size_t(end_ - at)) refuse("a truncated model");
    const double* const from = at;
    at += n;
    return {from, at};
  }
  const double* at;

 private:
  const double* end_;
};

LwprOptions read_options(Reader* in) {
  LwprOptions o;
  o.w_gen = in->next(), o.w_prune = in->next(), o.w_cutoff = in->next();
  o.diagonal = in->next() != 0, o.update_D = in->next() != 0, o.init_alpha = in->next();
  o.meta = in->next() != 0, o.meta_rate = in->next(), o.penalty = in->next(), o.add_threshold = in->next();
  o.init_lambda = in->next(), o.final_lambda = in->next(), o.tau_lambda = in->next();
  o.init_D = in->numbers(in->count());
  return o;
}

}  // namespace

std::string LwprModel::bytes() const {
  std::vector<double> numbers{double(n_in()), double(n_out()), samples_};
  const std::vector<double> options = numbers_of(options_);
  numbers.insert(numbers.end(), options.begin(), options.end());
  numbers.insert(numbers.end(), options_.init_D.begin(), options_.init_D.end());
  numbers.insert(numbers.end(), norm_in_.begin(), norm_in_.end());
  numbers.insert(numbers.end(), norm_out_.begin(), norm_out_.end());
  for (const LwprUnit& unit : units()) unit.append_to(&numbers);
  const std::uint64_t head[3] = {kMark, kVersion, numbers.size()};
  std::string out;
  append(&out, head, sizeof(head));
  append(&out, numbers.data(), numbers.size() * sizeof(double));
  const std::uint64_t sum = checksum(out.data(), out.size());
  append(&out, &sum, sizeof(sum));
  return out;
}

LwprModel LwprModel::from_bytes(const char* data, std::size_t size) {
  std::uint64_t head[3] = {}, sum = 0;
  if (size < kHeadBytes + sizeof(sum)) refuse("too few bytes");
  std::memcpy(head, data, sizeof(head));
  if (head[0] != kMark) refuse("another kind of file");
  if (head[1] != kVersion) refuse("an unknown version");
  const std::size_t rest = size - kHeadBytes - sizeof(sum);
  if (rest % sizeof(double) != 0 || head[2] != rest / sizeof(double)) refuse("a truncated model");
  std::memcpy(&sum, data + size - sizeof(sum), sizeof(sum));
  if (sum != checksum(data, size - sizeof(sum))) refuse("a model whose checksum is wrong");

  std::vector<double> numbers(rest / sizeof(double));
  std::memcpy(numbers.data(), data + kHeadBytes, rest);
  const double* const end = numbers.data() + numbers.size();
  Reader in(numbers.data(), end);
  const std::size_t n_in = in.count(), n_out = in.count();
  if (n_in > kMaxCount || n_out > kMaxCount) refuse("a model with an invalid count");
  const auto samples = double(in.count());
  const LwprOptions options = read_options(&in);
  std::vector<double> norm_in = in.numbers(n_in), norm_out = in.numbers(n_out);
  LwprModel model(int(n_in), int(n_out), options, std::move(norm_in), std::move(norm_out));
  model.samples_ = samples;
  for (LwprUnit& unit : model.units_)
    if (!unit.read_from(&in.at, end)) refuse("a model with inconsistent fields");
  if (in.at != end) refuse("a model with trailing data");
  return model;
}

}  // namespace sdftrack::lwpr
