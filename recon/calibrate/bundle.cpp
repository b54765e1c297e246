#include "recon/calibrate/bundle.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Geometry>
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <glog/logging.h>

namespace emberlock {
namespace {

/// A pose's block: a turn (angle times axis) on top of where it was linearised, and a place.
using PoseBlock = std::array<double, kPoseUnknowns>;
using LensBlock = std::array<double, kLensUnknowns>;

constexpr double kNearest = 1e-6;  // metres in front of a camera

/// One corner: residuals in standard deviations of its noise. Poses turn about where they were linearised, so
/// their three angles are small and have no singularity.
struct CornerCost {
  const Eigen::Matrix3d* camera_rotation;  ///< camera_from_world
  const Eigen::Matrix3d* board_rotation;   ///< world_from_board
  Eigen::Vector3d corner;                  ///< board
  Eigen::Vector2d pixel;
  double weight;

  template <class T>
  bool operator()(const T* lens, const T* camera, const T* board, T* out) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Vector turned = (*board_rotation * corner).template cast<T>();
    Vector world;
    ceres::AngleAxisRotatePoint(board, turned.data(), world.data());
    for (int a = 0; a < 3; ++a) world[a] += board[3 + a] - camera[3 + a];
    const Vector straight = camera_rotation->template cast<T>() * world;
    Vector p;
    ceres::AngleAxisRotatePoint(camera, straight.data(), p.data());
    if (!(p[2] > T(kNearest))) return false;
    T x;
    T y;
    brown_conrady(lens[4], lens[5], lens[6], lens[7], lens[8], T(p[0] / p[2]), T(p[1] / p[2]), x, y);
    out[0] = weight * (lens[0] * x + lens[2] - pixel.x());
    out[1] = weight * (lens[1] * y + lens[3] - pixel.y());
    return true;
  }
};

/// The bundle's numbers as Ceres moves them.
struct Blocks {
  std::vector<LensBlock> lenses;
  std::vector<PoseBlock> cameras;  ///< place: the camera's centre
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

  static Eigen::Matrix3d turn(const PoseBlock& block) {
    const Eigen::Vector3d w(block[0], block[1], block[2]);
    const double angle = w.norm();
    if (angle == 0) return Eigen::Matrix3d::Identity();
    return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  }

  void write_to(Bundle& bundle) const {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      CameraModel& model = bundle.cameras[i].model;
      const LensBlock& l = lenses[i];
      model.intrinsics = {model.intrinsics.size, l[0], l[1], l[2], l[3], {l[4], l[5], l[6], l[7], l[8]}};
      const Eigen::Quaterniond rotation(turn(cameras[i]) * model.camera_from_world.rotation);
      model.camera_from_world.rotation = rotation.normalized().toRotationMatrix();
      const Eigen::Vector3d center(cameras[i][3], cameras[i][4], cameras[i][5]);
      model.camera_from_world.translation = -(model.camera_from_world.rotation * center);
    }
    for (std::size_t i = 0; i < boards.size(); ++i) {
      Rigid3& pose = bundle.boards[i].world_from_board;
      const Eigen::Quaterniond rotation(turn(boards[i]) * pose.rotation);
      pose = {rotation.normalized().toRotationMatrix(), {boards[i][3], boards[i][4], boards[i][5]}};
    }
  }
};

bool holds_lens(Held held) { return held == Held::lens || held == Held::both; }
bool holds_pose(Held held) { return held == Held::pose || held == Held::both; }

/// The problem over `blocks`, which must outlive it. Cameras and boards that no used corner shows are left
/// out.
std::unique_ptr<ceres::Problem> problem_of(const Bundle& bundle, Blocks& blocks, BundleLoss loss) {
  auto problem = std::make_unique<ceres::Problem>();
  for (const BundleView& view : bundle.views) {
    const BundleCamera& camera = bundle.cameras[view.camera];
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.use[i] != CornerUse::used) continue;
      auto* cost =
          new ceres::AutoDiffCostFunction<CornerCost, 2, kLensUnknowns, kPoseUnknowns, kPoseUnknowns>(
              new CornerCost{&camera.model.camera_from_world.rotation,
                             &bundle.boards[view.board].world_from_board.rotation,
                             bundle.board.point(view.corners[i].id), view.corners[i].pixel,
                             1 / camera.noise});
      problem->AddResidualBlock(cost, loss == BundleLoss::cauchy ? new ceres::CauchyLoss(2) : nullptr,
                                blocks.lenses[view.camera].data(), blocks.cameras[view.camera].data(),
                                blocks.boards[view.board].data());
    }
  }
  for (std::size_t i = 0; i < bundle.cameras.size(); ++i) {
    if (!problem->HasParameterBlock(blocks.lenses[i].data())) continue;
    const Held held = bundle.cameras[i].held;
    if (holds_pose(held)) problem->SetParameterBlockConstant(blocks.cameras[i].data());
    if (holds_lens(held)) {
      problem->SetParameterBlockConstant(blocks.lenses[i].data());
    } else if (bundle.cameras[i].k3 == ThirdRadial::held) {
      problem->SetManifold(blocks.lenses[i].data(), new ceres::SubsetManifold(kLensUnknowns, {8}));
    }
  }
  for (std::size_t i = 0; i < bundle.boards.size(); ++i)
    if (holds_pose(bundle.boards[i].held) && problem->HasParameterBlock(blocks.boards[i].data()))
      problem->SetParameterBlockConstant(blocks.boards[i].data());
  return problem;
}

/// Ceres tells its log what the results tell their callers.
void quieten_ceres() { FLAGS_minloglevel = google::GLOG_FATAL; }

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
  options.function_tolerance = 1e-10;
  options.num_threads = 2;
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
  const auto problem = problem_of(bundle, blocks, BundleLoss::squares);
  std::vector<const double*> free;
  std::vector<Eigen::Index> rows;  // of each free unknown, in the answer
  const auto add = [&](const double* block, Eigen::Index at, std::initializer_list<int> order) {
    if (!is_free(*problem, block)) return;
    free.push_back(block);
    for (const int i : order) rows.push_back(at + i);
  };
  for (std::size_t i = 0; i < bundle.cameras.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i) * kCameraUnknowns;
    add(blocks.lenses[i].data(), at, {0, 1, 2, 3, 4, 5, 6, 7, 8});
    add(blocks.cameras[i].data(), at, {12, 13, 14, 9, 10, 11});  // its block turns first
  }
  const auto size = static_cast<Eigen::Index>(bundle.cameras.size()) * kCameraUnknowns;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  if (free.empty()) return result;
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.num_threads = 2;
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

}  // namespace emberlock
