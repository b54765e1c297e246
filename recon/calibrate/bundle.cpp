// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/bundle.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <glog/logging.h>

#include "recon/calibrate/corner_cost.h"

namespace emberlock::recon {
namespace {

/// The parameters of the bundle in the form for Ceres.
struct Blocks {
  std::vector<LensBlock> lenses;
  std::vector<PoseBlock> cameras;  ///< the position is the camera's centre
  std::vector<PoseBlock> boards;

  explicit Blocks(const Bundle& bundle) {
    for (const BundleCamera& camera : bundle.cameras) {
      const Intrinsics& in = camera.model.intrinsics;
      const Distortion& d = in.distortion;
      lenses.push_back({in.fx, in.fy, in.cx, in.cy, d.k1, d.k2, d.p1, d.p2, d.k3});
      const Eigen::Vector3d center = camera.model.center();
      cameras.push_back({0, 0, 0, center.x(), center.y(), center.z()});
    }
    for (const BundleBoard& board : bundle.boards) {
      const Eigen::Vector3d& t = board.world_from_board.translation;
      boards.push_back({0, 0, 0, t.x(), t.y(), t.z()});
    }
  }

  void write_to(Bundle& bundle) const {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      CameraModel& model = bundle.cameras[i].model;
      const LensBlock& l = lenses[i];
      model.intrinsics = {model.intrinsics.size, l[0], l[1], l[2], l[3], {l[4], l[5], l[6], l[7], l[8]}};
      const Eigen::Quaterniond rotation(rotation_by(cameras[i].data()) * model.camera_from_world.rotation);
      model.camera_from_world.rotation = rotation.normalized().toRotationMatrix();
      const Eigen::Vector3d center(cameras[i][3], cameras[i][4], cameras[i][5]);
      model.camera_from_world.translation = -(model.camera_from_world.rotation * center);
    }
    for (std::size_t i = 0; i < boards.size(); ++i) {
      Rigid3& pose = bundle.boards[i].world_from_board;
      const Eigen::Quaterniond rotation(rotation_by(boards[i].data()) * pose.rotation);
      pose = {rotation.normalized().toRotationMatrix(), {boards[i][3], boards[i][4], boards[i][5]}};
    }
  }
};

enum class Weigh { by_noise, by_inflated_noise };

bool holds_lens(Held held) { return held == Held::lens || held == Held::both; }
bool holds_pose(Held held) { return held == Held::pose || held == Held::both; }

/// The lens's unknowns that are fixed.
std::vector<int> fixed_unknowns(const BundleCamera& camera) {
  return {kRadialUnknowns.begin() + camera.radial_terms, kRadialUnknowns.end()};
}

CornerEquations corner_equations(const Bundle& bundle, const BundleView& view, std::size_t i, double weight) {
  return {&bundle.cameras[view.camera].model.camera_from_world.rotation,
          &bundle.boards[view.board].world_from_board.rotation, bundle.board.point(view.corners[i].id),
          view.corners[i].pixel, weight};
}

/// The cost function in the form for Ceres.
class CornerCost final : public ceres::SizedCostFunction<2, kLensUnknowns, kPoseUnknowns, kPoseUnknowns> {
 public:
  explicit CornerCost(const CornerEquations& equations) : equations_(equations) {}

  bool Evaluate(double const* const* at, double* residuals, double** by) const override {
    CornerEquations::Slopes slopes;
    if (!equations_(at[0], at[1], at[2], residuals, by == nullptr ? nullptr : &slopes)) return false;
    if (by == nullptr) return true;
    if (by[0] != nullptr) std::copy_n(slopes.lens.data(), slopes.lens.size(), by[0]);
    if (by[1] != nullptr) std::copy_n(slopes.camera.data(), slopes.camera.size(), by[1]);
    if (by[2] != nullptr) std::copy_n(slopes.board.data(), slopes.board.size(), by[2]);
    return true;
  }

 private:
  CornerEquations equations_;
};

/// The deviation of a pose from its prior, in standard deviations.
struct PriorCost {
  Eigen::Matrix3d start_from_known;  ///< rotation in camera axes from the prior to the linearisation point
  Eigen::Vector3d center;
  Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns> root;  ///< of the inverse covariance

  template <class T>
  bool operator()(const T* camera, T* out) const {
    Eigen::Matrix<T, 3, 3> turn;
    ceres::AngleAxisToRotationMatrix(camera, turn.data());
    const Eigen::Matrix<T, 3, 3> whole = turn * start_from_known.cast<T>();
    Eigen::Matrix<T, kPoseUnknowns, 1> off;
    ceres::RotationMatrixToAngleAxis(whole.data(), off.data() + 3);
    for (int i = 0; i < 3; ++i) off[i] = camera[3 + i] - center[i];
    Eigen::Map<Eigen::Matrix<T, kPoseUnknowns, 1>> residuals(out);
    residuals = root.cast<T>() * off;
    return true;
  }
};

void add_prior(const BundleCamera& camera, PoseBlock& block, ceres::Problem& problem) {
  const Rigid3& known = camera.prior->camera_from_world;
  using Cost = ceres::AutoDiffCostFunction<PriorCost, kPoseUnknowns, kPoseUnknowns>;
  using Square = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;
  const Square root = camera.prior->covariance.llt().matrixL().solve(Square::Identity());
  problem.AddResidualBlock(
      new Cost(new PriorCost{camera.model.camera_from_world.rotation * known.rotation.transpose(),
                             known.inverse().translation, root}),
      nullptr, block.data());
}

/// The problem over `blocks`, which must outlive it. Cameras and boards without used corners are omitted.
std::unique_ptr<ceres::Problem> problem_of(const Bundle& bundle, Blocks& blocks, BundleLoss loss,
                                           Weigh weigh = Weigh::by_noise) {
  auto problem = std::make_unique<ceres::Problem>();
  for (const BundleView& view : bundle.views) {
    const BundleCamera& camera = bundle.cameras[view.camera];
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.use[i] != CornerUse::used) continue;
      const double noise = camera.noise * (weigh == Weigh::by_noise ? 1 : camera.inflation);
      problem->AddResidualBlock(new CornerCost(corner_equations(bundle, view, i, 1 / noise)),
                                loss == BundleLoss::cauchy ? new ceres::CauchyLoss(2) : nullptr,
                                blocks.lenses[view.camera].data(), blocks.cameras[view.camera].data(),
                                blocks.boards[view.board].data());
    }
  }
  for (std::size_t i = 0; i < bundle.cameras.size(); ++i) {
    if (!problem->HasParameterBlock(blocks.lenses[i].data())) continue;
    const Held held = bundle.cameras[i].held;
    if (holds_pose(held)) {
      problem->SetParameterBlockConstant(blocks.cameras[i].data());
    } else if (bundle.cameras[i].prior) {
      add_prior(bundle.cameras[i], blocks.cameras[i], *problem);
    }
    if (holds_lens(held)) {
      problem->SetParameterBlockConstant(blocks.lenses[i].data());
    } else if (const std::vector<int> fixed = fixed_unknowns(bundle.cameras[i]); !fixed.empty()) {
      problem->SetManifold(blocks.lenses[i].data(), new ceres::SubsetManifold(kLensUnknowns, fixed));
    }
  }
  for (std::size_t i = 0; i < bundle.boards.size(); ++i) {
    if (!problem->HasParameterBlock(blocks.boards[i].data())) continue;
    if (holds_pose(bundle.boards[i].held)) {
      problem->SetParameterBlockConstant(blocks.boards[i].data());
    } else if (bundle.board.kind == BoardKind::lamp) {
      problem->SetManifold(blocks.boards[i].data(), new ceres::SubsetManifold(kPoseUnknowns, {0, 1, 2}));
    }
  }
  return problem;
}

/// Silences Ceres's log, since the results contain the same information.
void quieten_ceres() { FLAGS_minloglevel = google::GLOG_FATAL; }

constexpr std::size_t kFewestForPose = 4;       // corners
constexpr std::size_t kFewestForJackknife = 6;  // views
constexpr double kChance = 3;                   // standard deviations

/// A view's residuals, and their derivatives by the lens and by the board's pose.
struct ViewEquations {
  Eigen::VectorXd residuals;
  Eigen::MatrixXd lens;
  Eigen::MatrixXd board;
};

ViewEquations equations_of(const Bundle& bundle, const BundleView& view, const Blocks& blocks) {
  const auto rows = static_cast<Eigen::Index>(2 * view.used());
  ViewEquations result{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, kLensUnknowns),
                       Eigen::MatrixXd(rows, kPoseUnknowns)};
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    if (view.use[i] != CornerUse::used) continue;
    CornerEquations::Slopes slopes;
    Eigen::Vector2d residuals = Eigen::Vector2d::Zero();
    const auto equations = corner_equations(bundle, view, i, 1 / bundle.cameras[view.camera].noise);
    // A used corner is always in front of its camera.
    (void)equations(blocks.lenses[view.camera].data(), blocks.cameras[view.camera].data(),
                    blocks.boards[view.board].data(), residuals.data(), &slopes);
    result.residuals.segment<2>(row) = residuals;
    result.lens.middleRows<2>(row) = slopes.lens;
    result.board.middleRows<2>(row) = slopes.board;
    row += 2;
  }
  return result;
}

bool is_free(const ceres::Problem& problem, const double* block) {
  return problem.HasParameterBlock(block) && !problem.IsParameterBlockConstant(block);
}

}  // namespace

std::size_t BundleView::used() const {
  return static_cast<std::size_t>(std::count(use.begin(), use.end(), CornerUse::used));
}

Status adjust(Bundle& bundle, BundleLoss loss) {
  quieten_ceres();
  Blocks blocks(bundle);
  const auto problem = problem_of(bundle, blocks, loss);
  if (problem->NumResidualBlocks() == 0)
    return Error{ErrorKind::bad_input, "no corner is left", "bundle adjustment", "Take more pictures"};
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& board : blocks.boards)
    if (problem->HasParameterBlock(board.data())) ordering->AddElementToGroup(board.data(), 0);
  for (std::size_t i = 0; i < blocks.cameras.size(); ++i) {
    if (!problem->HasParameterBlock(blocks.cameras[i].data())) continue;
    ordering->AddElementToGroup(blocks.cameras[i].data(), 1);
    ordering->AddElementToGroup(blocks.lenses[i].data(), 1);
  }
  options.linear_solver_ordering = ordering;
  options.max_num_iterations = 60;
  options.function_tolerance = loss == BundleLoss::squares ? 1e-10 : 1e-6;
  options.num_threads = 1;  // several would add in a varying order
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem.get(), &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost)) {
    return Error{ErrorKind::bad_input, "no cameras and boards fit the corners: " + summary.message,
                 "bundle adjustment", "Look at the corners in the report; take the pictures anew"};
  }
  blocks.write_to(bundle);
  return {};
}

Eigen::Vector2d residual(const Bundle& bundle, const BundleView& view, std::size_t i) {
  const CameraModel& camera = bundle.cameras[view.camera].model;
  const Eigen::Vector3d world =
      bundle.boards[view.board].world_from_board * bundle.board.point(view.corners[i].id);
  if (!((camera.camera_from_world * world).z() > kNearest)) return Eigen::Vector2d::Constant(INFINITY);
  return camera.project(world) - view.corners[i].pixel;
}

std::optional<Eigen::MatrixXd> covariance(const Bundle& bundle) {
  quieten_ceres();
  Blocks blocks(bundle);
  const auto problem = problem_of(bundle, blocks, BundleLoss::squares, Weigh::by_inflated_noise);
  std::vector<const double*> free;
  std::vector<Eigen::Index> rows;  // index of each free unknown in the result
  const auto add = [&](const double* block, Eigen::Index at, std::initializer_list<int> order) {
    if (!is_free(*problem, block)) return;
    free.push_back(block);
    for (const int i : order) rows.push_back(at + i);
  };
  for (std::size_t i = 0; i < bundle.cameras.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i) * kCameraUnknowns;
    add(blocks.lenses[i].data(), at, {0, 1, 2, 3, 4, 5, 6, 7, 8});
    add(blocks.cameras[i].data(), at, {12, 13, 14, 9, 10, 11});  // in the block the rotation comes first
  }
  const auto size = static_cast<Eigen::Index>(bundle.cameras.size()) * kCameraUnknowns;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  if (free.empty()) return result;
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.num_threads = 1;
  ceres::Covariance estimate(options);
  if (!estimate.Compute(free, problem.get())) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> dense(n, n);
  if (!estimate.GetCovarianceMatrix(free, dense.data())) return std::nullopt;
  for (Eigen::Index r = 0; r < n; ++r)
    for (Eigen::Index c = 0; c < n; ++c)
      result(rows[static_cast<std::size_t>(r)], rows[static_cast<std::size_t>(c)]) = dense(r, c);
  if (!result.allFinite() || result.diagonal().minCoeff() < 0) return std::nullopt;
  return result;
}

double jackknife_inflation(const Bundle& bundle) {
  const BundleCamera& camera = bundle.cameras.front();
  const Blocks blocks(bundle);
  const std::vector<int> fixed = fixed_unknowns(camera);
  std::vector<Eigen::Index> free;
  for (int i = 0; i < kLensUnknowns; ++i)
    if (std::find(fixed.begin(), fixed.end(), i) == fixed.end()) free.push_back(i);
  const auto unknowns = static_cast<Eigen::Index>(free.size());
  std::vector<Eigen::MatrixXd> normals;  // of each view, with its board's pose eliminated
  std::vector<Eigen::VectorXd> gradients;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (const BundleView& view : bundle.views) {
    if (view.used() < kFewestForPose) continue;
    const ViewEquations equations = equations_of(bundle, view, blocks);
    const Eigen::MatrixXd lens = equations.lens(Eigen::all, free);
    const Eigen::HouseholderQR<Eigen::MatrixXd> pose(equations.board);
    const Eigen::MatrixXd kept = pose.householderQ() * Eigen::MatrixXd::Identity(lens.rows(), kPoseUnknowns);
    const Eigen::MatrixXd across = lens - kept * (kept.transpose() * lens);
    normals.emplace_back(across.transpose() * across);
    gradients.emplace_back(across.transpose() * equations.residuals);
    all += normals.back();
  }
  if (normals.size() < kFewestForJackknife) return 1;
  const auto views = static_cast<double>(normals.size());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(unknowns);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const Eigen::VectorXd moved = (all - normals[v]).ldlt().solve(gradients[v]);
    variance += (views - 1) / views * moved.cwiseAbs2();
  }
  const Eigen::VectorXd independent =
      all.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns)).diagonal();
  const double ratio = variance.cwiseQuotient(independent).mean();
  return ratio > 1 + kChance * std::sqrt(2 / views) ? std::sqrt(ratio) : 1;
}

double rms_of(const Bundle& bundle, std::optional<std::size_t> camera) {
  double sum = 0;
  std::size_t count = 0;
  for (const BundleView& view : bundle.views) {
    if (camera && view.camera != *camera) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.use[i] != CornerUse::used) continue;
      sum += residual(bundle, view, i).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

}  // namespace emberlock::recon
