// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace veduta {
namespace {

// E = x X + y Y + z Z + W, so its entries are polynomials in x, y and z. The monomials of each
// degree stand in this order: of degree 1 x, y, z, 1; of degree 3 those that are eliminated first.
using Linear = Eigen::Matrix<double, 4, 1>;
using Quadratic = Eigen::Matrix<double, 10, 1>;
using Cubic = Eigen::Matrix<double, 20, 1>;

struct Exponents {
  int x, y, z;
  constexpr bool operator==(const Exponents&) const = default;
  constexpr Exponents operator+(const Exponents& o) const { return {x + o.x, y + o.y, z + o.z}; }
};
constexpr std::array<Exponents, 4> kLinear = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::array<Exponents, 10> kQuadratic = {{{2, 0, 0},
                                                   {1, 1, 0},
                                                   {0, 2, 0},
                                                   {1, 0, 1},
                                                   {0, 1, 1},
                                                   {0, 0, 2},
                                                   {1, 0, 0},
                                                   {0, 1, 0},
                                                   {0, 0, 1},
                                                   {0, 0, 0}}};
constexpr std::array<Exponents, 20> kCubic = {
    {{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1}, {2, 0, 0}, {0, 2, 1},
     {0, 2, 0}, {1, 1, 1}, {1, 1, 0}, {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2},
     {0, 1, 1}, {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

// products[i][j]: where the product of monomial i of `left` and j of degree 1 stands in `of`.
template <size_t L, size_t N>
constexpr std::array<std::array<int, 4>, L> Products(const std::array<Exponents, L>& left,
                                                     const std::array<Exponents, N>& of) {
  std::array<std::array<int, 4>, L> products{};
  for (size_t i = 0; i < L; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      for (size_t k = 0; k < N; ++k) {
        if (of[k] == left[i] + kLinear[j]) products[i][j] = static_cast<int>(k);
      }
    }
  }
  return products;
}
constexpr auto kLinearProducts = Products(kLinear, kQuadratic);
constexpr auto kQuadraticProducts = Products(kQuadratic, kCubic);

void AddProduct(const Linear& p, const Linear& q, Quadratic* sum) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) (*sum)[kLinearProducts[i][j]] += p[i] * q[j];
  }
}

void AddProduct(const Quadratic& p, const Linear& q, Cubic* sum) {
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 4; ++j) (*sum)[kQuadraticProducts[i][j]] += p[i] * q[j];
  }
}

using Entries = std::array<std::array<Linear, 3>, 3>;  // of E

// The matrices that the five matches leave: four columns of nine entries, row by row.
Eigen::Matrix<double, 9, 4> NullSpace(const std::array<Eigen::Vector3d, 5>& a,
                                      const std::array<Eigen::Vector3d, 5>& b) {
  Eigen::Matrix<double, 9, 5> constraints;
  for (int k = 0; k < 5; ++k) {
    for (int r = 0; r < 3; ++r) constraints.block<3, 1>(3 * r, k) = b[k][r] * a[k];
  }
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>> qr(constraints);
  Eigen::Matrix<double, 9, 4> space = Eigen::Matrix<double, 9, 4>::Zero();
  space.bottomRows<4>().setIdentity();
  return qr.householderQ() * space;
}

// 2 E E^T E - trace(E E^T) E = 0, nine equations, and det E = 0.
Eigen::Matrix<double, 10, 20> CubicConstraints(const Entries& e) {
  std::array<std::array<Quadratic, 3>, 3> square;  // E E^T - trace / 2
  Quadratic half_trace = Quadratic::Zero();
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      square[i][j].setZero();
      for (int k = 0; k < 3; ++k) AddProduct(e[i][k], e[j][k], &square[i][j]);
    }
    half_trace += 0.5 * square[i][i];
  }
  for (int i = 0; i < 3; ++i) square[i][i] -= half_trace;
  Eigen::Matrix<double, 10, 20> constraints;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      Cubic sum = Cubic::Zero();
      for (int k = 0; k < 3; ++k) AddProduct(square[std::min(i, k)][std::max(i, k)], e[k][j], &sum);
      constraints.row(3 * i + j) = sum;
    }
  }
  Cubic determinant = Cubic::Zero();
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    Quadratic minor = Quadratic::Zero(), other = Quadratic::Zero();
    AddProduct(e[1][next], e[2][last], &minor);
    AddProduct(e[1][last], e[2][next], &other);
    AddProduct(minor - other, e[0][k], &determinant);
  }
  constraints.row(9) = determinant;
  return constraints;
}

// A polynomial in z; [k] belongs to z^k.
template <size_t N>
using Polynomial = std::array<double, N>;

template <size_t N, size_t M>
Polynomial<N + M - 1> Times(const Polynomial<N>& p, const Polynomial<M>& q) {
  Polynomial<N + M - 1> product{};
  for (size_t i = 0; i < N; ++i) {
    for (size_t j = 0; j < M; ++j) product[i + j] += p[i] * q[j];
  }
  return product;
}

template <size_t N>
Polynomial<N> Minus(Polynomial<N> p, const Polynomial<N>& q) {
  for (size_t i = 0; i < N; ++i) p[i] -= q[i];
  return p;
}

template <size_t N>
double At(const Polynomial<N>& p, double z) {
  double value = p[N - 1];
  for (size_t k = N - 1; k-- > 0;) value = value * z + p[k];
  return value;
}

// x p + y q + r = 0 with polynomials in z: one row of the paper's matrix B.
struct RowOfB {
  Polynomial<4> p, q;
  Polynomial<5> r;
};

// Of two eliminated equations, whose monomials differ by a factor z, the one less z times the
// other: both lose their monomial.
RowOfB MakeRow(const Eigen::Matrix<double, 10, 10>& eliminated, int with_z, int without_z) {
  const auto e = eliminated.row(with_z), f = eliminated.row(without_z);
  return {{e[2], e[1] - f[2], e[0] - f[1], -f[0]},
          {e[5], e[4] - f[5], e[3] - f[4], -f[3]},
          {e[9], e[8] - f[9], e[7] - f[8], e[6] - f[7], -f[6]}};
}

Polynomial<11> Determinant(const std::array<RowOfB, 3>& b) {
  const auto minor = [&](int i, int j) {
    return Minus(Times(b[i].p, b[j].q), Times(b[j].p, b[i].q));
  };
  const Polynomial<11> terms[3] = {Times(minor(1, 2), b[0].r), Times(minor(2, 0), b[1].r),
                                   Times(minor(0, 1), b[2].r)};
  Polynomial<11> sum{};
  for (const Polynomial<11>& term : terms) {
    for (size_t k = 0; k < sum.size(); ++k) sum[k] += term[k];
  }
  return sum;
}

double ValueAt(std::span<const double> p, double t) {
  double value = 0;
  for (size_t k = p.size(); k-- > 0;) value = value * t + p[k];
  return value;
}

// The place between `low` and `high`, where p has different signs, at which it changes its sign:
// Newton's method, kept within the two, until a step is shorter than `step_min`.
double RootBetween(std::span<const double> p, std::span<const double> derivative, double low,
                   double high, double step_min) {
  const bool rises = ValueAt(p, low) < 0;
  double t = 0.5 * (low + high);
  for (int i = 0; i < 60; ++i) {
    const double value = ValueAt(p, t);
    (value < 0) == rises ? low = t : high = t;
    double next = t - value / ValueAt(derivative, t);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - t) < step_min) return next;
    t = next;
  }
  return t;
}

void AddSolution(const std::array<RowOfB, 3>& b, const Eigen::Matrix<double, 9, 4>& space, double z,
                 EssentialMatrices* found) {
  Eigen::Matrix3d rows;
  for (int i = 0; i < 3; ++i) rows.row(i) << At(b[i].p, z), At(b[i].q, z), At(b[i].r, z);
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d cross = rows.row(i).cross(rows.row((i + 1) % 3));
    if (std::abs(cross.z()) > std::abs(best.z())) best = cross;
  }
  const Eigen::Matrix<double, 9, 1> e =
      space * Eigen::Vector4d(best.x() / best.z(), best.y() / best.z(), z, 1);
  if (!e.allFinite() || found->count == found->matrices.size()) return;
  found->matrices[found->count++] =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(e.data()) / e.norm();
}

}  // namespace

size_t FindRootsInUnit(std::span<const double> coefficients, std::array<double, 10>* roots) {
  constexpr size_t kDegreeMax = 10;
  // [d]: the derivative that has degree d.
  std::array<std::array<double, kDegreeMax + 1>, kDegreeMax + 1> derivatives{};
  const size_t degree = coefficients.size() - 1;
  std::copy(coefficients.begin(), coefficients.end(), derivatives[degree].begin());
  for (size_t d = degree; d > 0; --d) {
    for (size_t k = 0; k < d; ++k)
      derivatives[d - 1][k] = static_cast<double>(k + 1) * derivatives[d][k + 1];
  }
  // Between two roots of the derivative there is at most one.
  size_t count = 0;
  for (size_t d = 1; d <= degree; ++d) {
    const std::span<const double> p(derivatives[d].data(), d + 1);
    const std::span<const double> derivative(derivatives[d - 1].data(), d);
    // The places that part the roots need not be exact.
    const double step_min = d < degree ? 1e-4 : 1e-13;
    std::array<double, kDegreeMax> next;
    size_t next_count = 0;
    double low = -1, at_low = ValueAt(p, low);
    for (size_t i = 0; i <= count; ++i) {
      const double high = i < count ? (*roots)[i] : 1, at_high = ValueAt(p, high);
      if ((at_low < 0) != (at_high < 0))
        next[next_count++] = RootBetween(p, derivative, low, high, step_min);
      low = high, at_low = at_high;
    }
    *roots = next;
    count = next_count;
  }
  return count;
}

EssentialMatrices SolveFivePoint(const std::array<Eigen::Vector3d, 5>& a,
                                 const std::array<Eigen::Vector3d, 5>& b) {
  EssentialMatrices found;
  const Eigen::Matrix<double, 9, 4> space = NullSpace(a, b);
  Entries entries;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) entries[i][j] = space.row(3 * i + j);
  }
  const Eigen::Matrix<double, 10, 20> constraints = CubicConstraints(entries);
  const Eigen::Matrix<double, 10, 10> eliminated =
      constraints.leftCols<10>().partialPivLu().solve(constraints.rightCols<10>());
  if (!eliminated.allFinite()) return found;
  const std::array<RowOfB, 3> rows = {MakeRow(eliminated, 4, 5), MakeRow(eliminated, 6, 7),
                                      MakeRow(eliminated, 8, 9)};
  Polynomial<11> determinant = Determinant(rows);
  std::array<double, 10> roots;
  size_t count = FindRootsInUnit(determinant, &roots);
  for (size_t i = 0; i < count; ++i) AddSolution(rows, space, roots[i], &found);
  // The others are those of the polynomial in 1 / z.
  std::reverse(determinant.begin(), determinant.end());
  count = FindRootsInUnit(determinant, &roots);
  for (size_t i = 0; i < count; ++i) {
    if (std::abs(roots[i]) < 1) AddSolution(rows, space, 1 / roots[i], &found);
  }
  return found;
}

}  // namespace veduta
