// SPDX-License-Identifier: MIT
#include "contour/registration.h"

#include <Eigen/Core>
#include <cmath>

#include "base/portable_math.h"
#include "base/to_int.h"
#include "optim/dense.h"
#include "optim/lm_loop.h"

namespace sdftrack::contour {

namespace {

constexpr double kSettled_cells = 1e-2;  // a step that moves every cell by less than this ends the search

// The System for run_lm: a warp in place of a pose.
template <int P>
class WarpSystem {
 public:
  using Matrix = Eigen::Matrix<double, P, P>;
  using Vector = Eigen::Matrix<double, P, 1>;

  WarpSystem(const ContourOptions& options, const RegistrationWork& work, ContourGrid* grid)
      : options_(options), work_(work), grid_(grid), reach_(0.5 * hypotenuse(grid->nx, grid->ny)) {
    here_ = sums();
  }
  double cost() const { return here_.cost; }
  double count() const { return here_.count; }
  bool has_data() const { return here_.count > P && here_.hessian[0] > 0; }
  bool find_step(double damping) {
    Matrix A = hessian();
    optim::damp(damping, &A);
    step_ = optim::solve_symmetric<P, 1>(A, -gradient());
    return step_.allFinite();
  }
  optim::Promise promised() const {
    const double all = -(gradient().dot(step_) + 0.5 * step_.dot(hessian() * step_));
    return {all, all};
  }
  double look() {
    before_ = grid_->warp;
    grid_->warp = moved<P>(before_, step_.data());
    next_ = sums();
    after_ = grid_->warp, grid_->warp = before_;
    return next_.cost;
  }
  void accept(bool) { grid_->warp = after_, here_ = next_; }
  bool step_is_small() const {
    double cells = 0;
    for (int k = 0; k < P; ++k) cells = std::max(cells, std::abs(step_[k]) * (k < P - 2 ? reach_ : 1));
    return cells < kSettled_cells;
  }

 private:
  energies::Sums<double, P> sums() const {
    return registration_sums<P>(*grid_, work_, double(options_.softness));
  }
  Vector gradient() const { return Eigen::Map<const Vector>(here_.gradient); }
  Matrix hessian() const {
    Matrix H;
    for (int a = 0, k = 0; a < P; ++a)
      for (int b = 0; b <= a; ++b, ++k) H(a, b) = H(b, a) = here_.hessian[k];
    return H;
  }

  const ContourOptions& options_;
  const RegistrationWork& work_;
  ContourGrid* grid_;
  double reach_;  // distance in cells that a unit of scale or angle moves the farthest cell
  energies::Sums<double, P> here_, next_;
  Vector step_;
  GridWarp before_, after_;
};

template <int P>
void run(const ContourOptions& options, RegistrationWork* work, ContourGrid* grid) {
  optim::LmOptions lm;
  lm.max_steps = options.registration_steps;
  lm.damping_max = 1e3;
  lm.cost_relative = 1e-4;
  WarpSystem<P> system(options, *work, grid);
  optim::run_lm(system, lm, &work->record);
}

}  // namespace

void choose_pixels(const ContourGrid& grid, const PosteriorImage& posterior, float band,
                   const unsigned char* hidden, RegistrationWork* work) {
  const auto room = std::size_t(posterior.rect.width()) * posterior.rect.height();
  work->u.resize(room), work->v.resize(room), work->foreground.resize(room);
  std::size_t n = 0;
  each_row_on(grid, grid.inside.grown(to_int(band) + 1, grid.nx, grid.ny), posterior.rect,
              [&](int y, int xa, int xb, double gx, double gy, double dx, double dy) {
                const float* const p = posterior.row(y) - posterior.rect.x0;
                for (int x = xa; x < xb; ++x, gx += dx, gy += dy) {
                  const int ix = to_int(gx + 0.5), iy = to_int(gy + 0.5);
                  // Always written, but kept only if it is near.
                  work->u[n] = float(x), work->v[n] = float(y), work->foreground[n] = p[x];
                  const auto cell = std::size_t(iy * grid.nx + ix);
                  n += std::abs(grid.phi[cell]) < band && !(hidden && hidden[cell]) ? 1 : 0;
                }
              });
  work->u.resize(n), work->v.resize(n), work->foreground.resize(n);
}

template <int P>
energies::Sums<double, P> registration_sums(const ContourGrid& grid, const RegistrationWork& work,
                                            double softness) {
  const GridWarp b = grid.warp.inverse();
  RegistrationTerm<float, P> term{
      {grid.phi.data(), grid.nx, grid.ny},
      {int(work.u.size()), work.u.data(), work.v.data(), work.foreground.data()},
      {float(b.a[0]), float(b.a[1]), float(b.t[0]), float(b.a[2]), float(b.a[3]), float(b.t[1])},
      float(grid.mid_x()),
      float(grid.mid_y()),
      float(1 / softness)};
  const ContourOps& ops = for_isa<ContourOps>(used_isa());
  if constexpr (P == 4)
    return ops.similarity(term);
  else
    return ops.affinity(term);
}
template energies::Sums<double, 4> registration_sums<4>(const ContourGrid&, const RegistrationWork&, double);
template energies::Sums<double, 6> registration_sums<6>(const ContourGrid&, const RegistrationWork&, double);

void register_grid(const ContourOptions& options, RegistrationWork* work, ContourGrid* grid) {
  if (options.affine)
    run<6>(options, work, grid);
  else
    run<4>(options, work, grid);
}

}  // namespace sdftrack::contour
