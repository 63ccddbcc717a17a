// SPDX-License-Identifier: MIT
// One output of a locally weighted projection regression: its receptive fields, which grow in number with the
// data (Table 6.2 of the thesis).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "lwpr/field_life.h"
#include "lwpr/layout.h"
#include "lwpr/options.h"
#include "lwpr/search.h"
#include "lwpr/unit_ops.h"

namespace sdftrack::lwpr {

struct LwprPrediction {
  double mean = 0, sd = 0;
};

// Working memory for evaluating the fields: one per thread.
struct LwprScratch {
  std::vector<int> index;
  std::vector<double> w, row;
};

struct UnitSettings {
  explicit UnitSettings(const LwprOptions& options);
  FieldSettings field;
  FieldStart start;
  double w_gen, w_prune, q_max;  // q_max: -2 log of the cutoff
};

// The outputs of a unit's samples.
struct OutputsSeen {
  double count = 0, mean = 0;
  void add(double y) {
    count += 1;
    mean += (y - mean) / count;
  }
};

class LwprUnit {
 public:
  LwprUnit(const FieldLayout& at, const LwprOptions& options);

  // `x` is a whole row of the layout: zeros at the end. Call settle() after the last.
  void update(const double* x, double y);
  // Updates the local linear functions of the fields that have changed.
  void settle();

  double predict(const double* x, LwprScratch* scratch) const;
  LwprPrediction predict_with_sd(const double* x, LwprScratch* scratch) const;
  double largest_activation(const double* x, LwprScratch* scratch) const;
  // Root of the weighted mean of the squared residuals after the last projection (e of eq. 6.12).
  double training_error() const;

  int size() const { return int(changed_.size()); }
  const double* record(int k) const { return records_.data() + k * record_stride_; }
  double lane(int k, int row) const { return *(lane_of(k) + row * kFieldLanes); }
  const FieldLayout& layout() const { return at_; }
  const std::vector<double>& blocks() const { return blocks_; }  // the numbers that predictions read
  double q_max() const { return settings_.q_max; }
  const OutputsSeen& seen() const { return seen_; }
  std::ptrdiff_t record_stride() const { return record_stride_; }

  // The whole state as numbers, and back; read_from leaves the unit unchanged if they do not fit.
  void append_to(std::vector<double>* out) const;
  bool read_from(const double** from, const double* end);
  // Takes over a GPU's result: `fields` fields, their blocks, and a record every `stride` numbers.
  void take(const OutputsSeen& seen, int fields, const double* blocks, const double* records,
            std::ptrdiff_t stride);

 private:
  double* lane_of(int k) {
    return blocks_.data() + std::ptrdiff_t(k / kFieldLanes) * at_.block_size() + k % kFieldLanes;
  }
  const double* lane_of(int k) const { return const_cast<LwprUnit*>(this)->lane_of(k); }
  double* record_of(int k) { return records_.data() + k * record_stride_; }
  FieldList fields_near(const double* x) const;
  ActiveFields room_in(LwprScratch* scratch) const;
  int active(const double* x, LwprScratch* scratch) const;
  void learn(const double* x, double y, int active);
  void add_field(const double* x);
  void add_projection(int k);
  void remove_field(int k);
  void prune(int active);
  void reserve_fields(int fields);
  void reserve_projections(int count);
  void settle_field(int k);
  void build_search();
  void reach_of(int k, double* half);
  void follow(int k);

  FieldLayout at_;
  UnitSettings settings_;
  std::shared_ptr<const std::vector<double>> init_M_;  // of a new field; a unit's copies share it
  const UnitOps* ops_;
  std::vector<double> blocks_;         // lanes
  std::vector<double> records_;        // one for each field, all with room for the same number of projections
  std::ptrdiff_t record_stride_;       // numbers from one record to the next
  std::vector<std::uint8_t> changed_;  // of each field, since the last settle()
  OutputsSeen seen_;
  LwprScratch own_;
  LwprSearch search_;
  std::vector<double> known_M_,
      known_drift2_;                    // of each field in the search: its metric, how far it may move
  std::vector<double> inverse_, half_;  // scratch of the search
  int search_size_ = 0;                 // fields when it was built
  int since_build_ = 0;                 // samples
};

}  // namespace sdftrack::lwpr
