// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/earth_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

namespace veduta {
namespace {

// What is fitted: (log scale, omega, d) as in EarthPlace, and by how much open heights are off.
using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using Jacobian = Eigen::Matrix<double, 3, 8>;

// An error of so many standard deviations, over the three axes, has half of its weight, and one
// beyond the second agrees with nothing. Chosen by hand: 97 and 99.3 of 100 errors are below.
constexpr double kHalfWeight = 3, kAgreeing = 3.5;
constexpr size_t kPairsMax = 500, kScoredMax = 1000;  // chosen by hand; not measured
// Up is known to some degrees, so a first fit may be off by this share of the extent.
constexpr double kTiltShare = 0.05;
constexpr int kRoundsMax = 60;
constexpr double kStepMin = 1e-10;
// As if so many more errors had been as large as they say, so that three anchors that happen to
// agree well or badly do not decide how exact the fit is.
constexpr double kPriorErrors = 4;
// Standard deviation of open heights, metres: the sea lies so far from the ellipsoid, over the
// earth.
constexpr double kOpenHeightDeviation = 30,
                 kOpenHeightInformation = 1 / (kOpenHeightDeviation * kOpenHeightDeviation);
// Deviations above this tell nothing of the common error of a group, metres.
constexpr double kToldDeviationMax = 300;
// Standard deviations of what compasses of a group have in common, and of each photo besides; and
// how level a camera must look to have a heading. Chosen by hand; not measured.
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kCompassDeviation = 10 * kDegree, kHeadingDeviation = 15 * kDegree;
constexpr double kLevelShareMin = 0.3;
// Headings of one group that are looked at for each of many first similarities, and how well those
// of one group must agree to tell anything. Chosen by hand; not measured.
constexpr size_t kHeadingsScoredMax = 50;
constexpr double kResultantMin = 0.3;
// The median of a squared standard normal error.
constexpr double kMedianSquare = 0.4549;

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Vector3d InformationOf(const EarthAnchor& anchor) {
  return anchor.deviation_m.cwiseProduct(anchor.deviation_m).cwiseInverse();
}

double SquaredError(const EarthAnchor& anchor, const Eigen::Vector3d& error) {
  return InformationOf(anchor).dot(error.cwiseProduct(error));
}

// Of what is left without the common error of its group, whose the other half of the variance is.
double OwnInformationTimes(const EarthAnchor& anchor) {
  return anchor.group == 0 ? 1 : 2;
}

double SquaredOwnError(const EarthAnchor& anchor, const Eigen::Vector3d& error) {
  return OwnInformationTimes(anchor) * SquaredError(anchor, error);
}

// How what is told of points changes with what is fitted.
Jacobian JacobianAt(const Eigen::Vector3d& from_pivot, bool has_open_height) {
  Jacobian j;
  j.col(0) = from_pivot;
  j.middleCols<3>(1) = -Cross(from_pivot);
  j.middleCols<3>(4) = Eigen::Matrix3d::Identity();
  j.col(7) = Eigen::Vector3d(0, 0, has_open_height ? 1 : 0);
  return j;
}

Sim3 Moved(const Sim3& s, const Eigen::Vector3d& pivot, const Vector8& step) {
  const double scale = std::exp(step[0]);
  const Eigen::Vector3d omega = step.segment<3>(1);
  const double angle = omega.norm();
  const Eigen::Quaterniond turn = angle > 0
                                      ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, omega / angle))
                                      : Eigen::Quaterniond::Identity();
  const Eigen::Vector3d d = step.segment<3>(4);
  return {s.scale * scale, (turn * s.rotation).normalized(),
          pivot + scale * (turn * (s.translation - pivot)) + d};
}

// How much anchors of one kind miss the fit by.
struct Misfit {
  // Of errors in standard deviations, one along each axis, each as far as it counts.
  double squares = 0, count = 0;

  // By how much their variance is larger than they say; 1 where it is not.
  double Excess() const {
    const double freedom = std::max(0.0, count - 7);
    return std::max(1.0, (squares + kPriorErrors) / (freedom + kPriorErrors));
  }
};

// The similarity is fitted together with the errors that anchors have in common.
class Fitter {
 public:
  Fitter(std::span<const EarthAnchor> anchors, std::span<const EarthHeading> headings,
         const UpDirection& up)
      : anchors_(anchors), up_(up) {
    for (const EarthHeading& heading : headings) compasses_[heading.group].push_back(heading);
    for (const EarthAnchor& anchor : anchors) {
      if (anchor.group == 0) continue;
      Group& group = groups_[anchor.group];
      group.told += InformationOf(anchor);
      ++group.count;
    }
    // Half of the mean variance is the common error's.
    for (auto& [id, group] : groups_) group.told *= 2 / static_cast<double>(group.count);
  }

  // A first similarity of two anchors: level, by their distance and direction on the plan.
  std::optional<Sim3> FromPair(const EarthAnchor& a, const EarthAnchor& b) const {
    const Eigen::Quaterniond level =
        Eigen::Quaterniond::FromTwoVectors(up_.up, Eigen::Vector3d::UnitZ());
    const Eigen::Vector2d here = (level * (b.world - a.world)).head<2>(),
                          there = (b.enu_m - a.enu_m).head<2>();
    if (!(here.norm() > 0 && there.norm() > 0)) return std::nullopt;
    const double yaw = std::atan2(there.y(), there.x()) - std::atan2(here.y(), here.x());
    Sim3 s;
    s.scale = there.norm() / here.norm();
    s.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * level;
    s.translation = (a.enu_m + b.enu_m) / 2 - s.scale * (s.rotation * (a.world + b.world) / 2);
    return std::isfinite(s.scale) && s.scale > 0 ? std::optional(s) : std::nullopt;
  }

  // Smaller is better. Heights do not count yet.
  double ScoreOf(const Sim3& s, double slack_m) const {
    double sum = 0;
    const size_t stride = 1 + anchors_.size() / kScoredMax;
    for (size_t i = 0; i < anchors_.size(); i += stride) {
      const EarthAnchor& anchor = anchors_[i];
      const Eigen::Vector2d error = (anchor.enu_m - s * anchor.world).head<2>();
      const double deviation = std::hypot(anchor.deviation_m.head<2>().maxCoeff(), slack_m);
      sum += std::log1p(error.squaredNorm() / (deviation * deviation));
    }
    for (const auto& [group, headings] : compasses_)
      sum += std::log1p(Read(headings, s, kHeadingsScoredMax).squared());
    return sum;
  }

  // Moves to the next minimum, from afar: errors are judged by their median first. Twice more where
  // the groups turn out to be farther off than they say. The cost there, or nothing where the
  // similarity is left open.
  std::optional<double> Refine(Sim3* s) {
    for (int pass = 0; pass < 3; ++pass) {
      if (!Descend(s)) return std::nullopt;
      const double variance = GroupVariance();
      if (variance <= group_variance_) break;
      group_variance_ = variance;
    }
    if (!(std::isfinite(s->scale) && s->scale > 0 && s->translation.allFinite()))
      return std::nullopt;
    return CostOf(*s);
  }

  // The covariance is that of the similarity which Refine has left.
  std::optional<EarthFit> Finish(const Sim3& s) {
    if (!Step(s, 1)) return std::nullopt;
    EarthFit fit;
    fit.enu_from_world = s;
    fit.pivot = pivot_;
    const Eigen::LLT<Matrix8> solver(normal_);
    if (solver.info() != Eigen::Success) return std::nullopt;
    Misfit alone, in_groups;  // of anchors that err by themselves, and of the others
    for (const EarthAnchor& anchor : anchors_) {
      const Eigen::Vector3d error = anchor.enu_m - s * anchor.world;
      const double squared = SquaredOwnError(anchor, error - CommonErrorOf(anchor));
      const double of_group = anchor.group == 0 ? 0 : SquaredErrorOf(groups_.at(anchor.group));
      fit.error_m.push_back(error);
      fit.agrees.push_back(std::max(squared, of_group) <= kAgreeing * kAgreeing);
      Misfit& misfit = anchor.group == 0 ? alone : in_groups;
      const double weight = 1 / (1 + squared / (kHalfWeight * kHalfWeight));
      misfit.squares += weight * squared;
      misfit.count += 3 * weight;
    }
    // Few surveyed points decide a fit beside many positions that are far less exact, so each kind
    // answers for itself.
    const double excess = std::max(alone.Excess(), in_groups.Excess());
    fit.covariance = excess * Matrix8(solver.solve(Matrix8::Identity())).topLeftCorner<7, 7>();
    if (!fit.covariance.allFinite()) return std::nullopt;
    const auto& c = fit.covariance;
    fit.scale_deviation = std::sqrt(c(0, 0));
    fit.tilt_deviation_deg = std::sqrt(c(1, 1) + c(2, 2)) / kDegree;
    fit.heading_deviation_deg = std::sqrt(c(3, 3)) / kDegree;
    fit.position_deviation_m = std::sqrt(c(4, 4) + c(5, 5) + c(6, 6));
    return fit;
  }

 private:
  struct Group {
    Eigen::Vector3d told = Eigen::Vector3d::Zero();  // information on its common error
    size_t count = 0;
    Eigen::Vector3d error = Eigen::Vector3d::Zero();  // common to its anchors
    // Of the current step.
    Eigen::Vector3d information, gradient;
    Eigen::Matrix<double, 8, 3> mixed;
  };

  // By how much headings of a group are told farther to the right than a similarity has them, rad,
  // and how exactly they tell it, per rad^2; 0 where no camera looks level enough.
  struct Compass {
    double error = 0, information = 0;
    double squared() const { return error * error * information; }
  };

  // Of up to so many of them, evenly.
  static Compass Read(std::span<const EarthHeading> headings, const Sim3& s,
                      size_t count_max = std::numeric_limits<size_t>::max()) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    size_t count = 0;
    const size_t stride = 1 + (headings.size() - 1) / count_max;
    for (size_t i = 0; i < headings.size(); i += stride) {
      const Eigen::Vector3d forward = s.rotation * headings[i].forward;
      if (forward.head<2>().norm() < kLevelShareMin) continue;
      const double error = kDegree * headings[i].heading_deg - std::atan2(forward.x(), forward.y());
      sum += Eigen::Vector2d(std::cos(error), std::sin(error));
      ++count;
    }
    if (count == 0) return {};
    // By how much they differ from each other: 1 where they agree (the mean resultant length;
    // Mardia and Jupp, Directional Statistics, 2000).
    const double number = static_cast<double>(count);
    const double length = std::max(sum.norm() / number, kResultantMin);
    const double own = std::max(kHeadingDeviation * kHeadingDeviation, -2 * std::log(length));
    const double variance = kCompassDeviation * kCompassDeviation + own / number;
    return {std::atan2(sum.y(), sum.x()), length > kResultantMin ? 1 / variance : 0};
  }

  Eigen::Vector3d CommonErrorOf(const EarthAnchor& anchor) const {
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    if (anchor.group != 0) error = groups_.at(anchor.group).error;
    if (anchor.has_open_height) error.z() += open_height_;
    return error;
  }

  // In standard deviations, as far as these turned out, squared.
  double SquaredErrorOf(const Group& group) const {
    return group.told.dot(group.error.cwiseProduct(group.error)) / group_variance_;
  }

  // By how much the variance of the groups' common errors is larger than they say; 1 where it is
  // not. By their median along all axes, for one that is far off says nothing of the others. The
  // similarity takes what they have in common, by three degrees of freedom.
  double GroupVariance() const {
    std::vector<double> squares;
    for (const auto& [id, group] : groups_) {
      for (int axis = 0; axis < 3; ++axis) {
        if (group.told[axis] * kToldDeviationMax * kToldDeviationMax < 1) continue;
        squares.push_back(group.told[axis] * group.error[axis] * group.error[axis]);
      }
    }
    if (squares.empty()) return 1;
    const double freedom = std::max(0.0, static_cast<double>(squares.size()) - 3);
    const auto middle = squares.begin() + static_cast<ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    const double sum = static_cast<double>(squares.size()) * *middle / kMedianSquare;
    return std::max(1.0, (sum + 1) / (freedom + 1));
  }

  // To the next minimum; whether there is one.
  bool Descend(Sim3* s) {
    double widening = std::max(1.0, MedianError(*s));
    for (int round = 0; round < kRoundsMax; ++round) {
      const auto step = Step(*s, widening);
      if (!step) return false;
      *s = Moved(*s, pivot_, *step);
      if (widening == 1 && step->norm() < kStepMin * (1 + pivot_.norm())) break;
      if (round % 3 == 2) widening = std::max(1.0, widening / 2);
    }
    return true;
  }

  double MedianError(const Sim3& s) const {
    std::vector<double> errors;
    for (const EarthAnchor& anchor : anchors_)
      errors.push_back(std::sqrt(SquaredError(anchor, anchor.enu_m - s * anchor.world)));
    const auto middle = errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
  }

  // Of up, in standard deviations, squared.
  double SquaredTilt(const Sim3& s) const {
    const Eigen::Vector3d error =
        s.rotation.conjugate() * (s.rotation * up_.up - Eigen::Vector3d::UnitZ());
    return error.dot(up_.information * error);
  }

  double CostOf(const Sim3& s) const {
    constexpr double kSquare = kHalfWeight * kHalfWeight;
    double cost = kSquare * std::log1p(SquaredTilt(s) / kSquare);
    for (const EarthAnchor& anchor : anchors_) {
      const Eigen::Vector3d error = anchor.enu_m - s * anchor.world - CommonErrorOf(anchor);
      cost += kSquare * std::log1p(SquaredOwnError(anchor, error) / kSquare);
    }
    for (const auto& [id, group] : groups_) {
      cost += kSquare * std::log1p(SquaredErrorOf(group) / kSquare) + 3 * std::log(group_variance_);
    }
    for (const auto& [group, headings] : compasses_)
      cost += kSquare * std::log1p(Read(headings, s).squared() / kSquare);
    return cost + open_height_ * open_height_ * kOpenHeightInformation;
  }

  // One weighted Gauss-Newton step about the middle of the anchors; leaves its normal equations.
  std::optional<Vector8> Step(const Sim3& s, double widening) {
    pivot_.setZero();
    for (const EarthAnchor& anchor : anchors_) pivot_ += s * anchor.world;
    pivot_ /= static_cast<double>(anchors_.size());
    normal_.setZero();
    gradient_.setZero();
    normal_(7, 7) = kOpenHeightInformation;
    gradient_[7] = -open_height_ * kOpenHeightInformation;
    for (auto& [id, group] : groups_) {
      const double weight = WeightOf(SquaredErrorOf(group), widening);
      group.information = weight / group_variance_ * group.told;
      group.gradient = -group.information.cwiseProduct(group.error);
      group.mixed.setZero();
    }
    for (const EarthAnchor& anchor : anchors_) AddAnchor(anchor, s, widening);
    AddUp(s, widening);
    AddHeadings(s, widening);
    for (auto& [id, group] : groups_) {
      const Eigen::Vector3d inverse = InverseOf(group.information);
      normal_ -= group.mixed * inverse.asDiagonal() * group.mixed.transpose();
      gradient_ -= group.mixed * inverse.cwiseProduct(group.gradient);
    }
    const Eigen::LLT<Matrix8> solver(normal_);
    if (solver.info() != Eigen::Success) return std::nullopt;
    const Vector8 step = solver.solve(gradient_);
    if (!step.allFinite()) return std::nullopt;
    for (auto& [id, group] : groups_) {
      group.error += InverseOf(group.information)
                         .cwiseProduct(group.gradient - group.mixed.transpose() * step);
    }
    open_height_ += step[7];
    return step;
  }

  // Of the robust loss, where an error has so many squared standard deviations.
  static double WeightOf(double squared, double widening) {
    const double half = kHalfWeight * widening;
    return 1 / (1 + squared / (half * half));
  }

  static Eigen::Vector3d InverseOf(const Eigen::Vector3d& information) {
    return information.unaryExpr([](double x) { return x > 0 ? 1 / x : 0; });
  }

  void AddAnchor(const EarthAnchor& anchor, const Sim3& s, double widening) {
    const Eigen::Vector3d place = s * anchor.world;
    const Eigen::Vector3d error = anchor.enu_m - place - CommonErrorOf(anchor);
    const double weight = WeightOf(SquaredOwnError(anchor, error), widening);
    const Eigen::Vector3d information =
        weight * OwnInformationTimes(anchor) * InformationOf(anchor);
    const Jacobian j = JacobianAt(place - pivot_, anchor.has_open_height);
    const Eigen::Matrix<double, 8, 3> weighted = j.transpose() * information.asDiagonal();
    normal_ += weighted * j;
    gradient_ += weighted * error;
    if (anchor.group == 0) return;
    Group& group = groups_.at(anchor.group);
    group.information += information;
    group.gradient += information.cwiseProduct(error);
    group.mixed += weighted;
  }

  void AddUp(const Sim3& s, double widening) {
    const Eigen::Matrix3d r = s.rotation.toRotationMatrix();
    const Eigen::Matrix3d information =
        WeightOf(SquaredTilt(s), widening) * r * up_.information * r.transpose();
    const Eigen::Vector3d told = r * up_.up, error = Eigen::Vector3d::UnitZ() - told;
    const Eigen::Matrix3d j = -Cross(told);
    normal_.block<3, 3>(1, 1) += j.transpose() * information * j;
    gradient_.segment<3>(1) += j.transpose() * information * error;
  }

  // Turning all to the left makes headings smaller.
  void AddHeadings(const Sim3& s, double widening) {
    for (const auto& [group, headings] : compasses_) {
      const Compass compass = Read(headings, s);
      const double information = WeightOf(compass.squared(), widening) * compass.information;
      normal_(3, 3) += information;
      gradient_[3] -= information * compass.error;
    }
  }

  const std::span<const EarthAnchor> anchors_;
  std::map<uint32_t, std::vector<EarthHeading>> compasses_;  // by group
  const UpDirection up_;
  std::map<uint32_t, Group> groups_;
  double group_variance_ = 1;  // over what the groups say
  double open_height_ = 0;     // error of all open heights
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero();
  Matrix8 normal_;
  Vector8 gradient_;
};

std::vector<std::pair<size_t, size_t>> PairsOf(size_t count) {
  std::vector<std::pair<size_t, size_t>> pairs;
  if (count * (count - 1) / 2 <= kPairsMax) {
    for (size_t a = 0; a < count; ++a) {
      for (size_t b = a + 1; b < count; ++b) pairs.emplace_back(a, b);
    }
    return pairs;
  }
  std::mt19937_64 random(count);
  while (pairs.size() < kPairsMax) {
    const size_t a = random() % count, b = random() % count;
    if (a != b) pairs.emplace_back(a, b);
  }
  return pairs;
}

// The extent of what is told, on the plan.
double ExtentOf(std::span<const EarthAnchor> anchors) {
  Eigen::AlignedBox2d box;
  for (const EarthAnchor& anchor : anchors) box.extend(Eigen::Vector2d(anchor.enu_m.head<2>()));
  return box.diagonal().norm();
}

}  // namespace

std::optional<EarthFit> FitEarth(std::span<const EarthAnchor> anchors,
                                 std::span<const EarthHeading> headings,
                                 std::span<const UpDirection> up) {
  if (anchors.size() < 3) return std::nullopt;
  const double slack_m = kTiltShare * ExtentOf(anchors);
  const auto pairs = PairsOf(anchors.size());
  std::optional<EarthFit> best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (const UpDirection& direction : up) {
    Fitter fitter(anchors, headings, direction);
    std::optional<Sim3> first;
    double first_score = std::numeric_limits<double>::infinity();
    for (const auto& [a, b] : pairs) {
      const std::optional<Sim3> guess = fitter.FromPair(anchors[a], anchors[b]);
      if (!guess) continue;
      const double score = fitter.ScoreOf(*guess, slack_m);
      if (!(score < first_score)) continue;
      first = guess;
      first_score = score;
    }
    if (!first) continue;
    const std::optional<double> cost = fitter.Refine(&*first);
    if (!cost || !(*cost + direction.doubt < best_cost)) continue;
    std::optional<EarthFit> fit = fitter.Finish(*first);
    if (!fit) continue;
    best = std::move(fit);
    best_cost = *cost + direction.doubt;
  }
  return best;
}

}  // namespace veduta
