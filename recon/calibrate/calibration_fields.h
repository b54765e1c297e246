// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "recon/calibrate/transforms_fields.h"

// What becomes of the keys of other programs' calibrations; docs/formats.md repeats these tables. A refused
// key is accepted where its value changes nothing, such as a skew of 0. Keys of no table are noted.
namespace emberlock::recon {

/// A key of OpenCV's and ROS' camera files, and the field that it means.
struct OpencvField {
  std::string_view key;
  const char* field;
  FieldUse use;
};
/// Numbers: one, or a matrix row by row. OpenCV 2.4's samples and Python's users write other names.
inline constexpr auto kOpencvNumbers = std::to_array<OpencvField>({
    {"image_width", "image_width", FieldUse::used},
    {"image_Width", "image_width", FieldUse::used},
    {"image_height", "image_height", FieldUse::used},
    {"image_Height", "image_height", FieldUse::used},
    {"camera_matrix", "camera_matrix", FieldUse::used},
    {"Camera_Matrix", "camera_matrix", FieldUse::used},
    {"cameraMatrix", "camera_matrix", FieldUse::used},
    {"distortion_coefficients", "distortion_coefficients", FieldUse::used},
    {"Distortion_Coefficients", "distortion_coefficients", FieldUse::used},
    {"distortionCoefficients", "distortion_coefficients", FieldUse::used},
    {"dist_coeffs", "distortion_coefficients", FieldUse::used},
    {"dist_coeff", "distortion_coefficients", FieldUse::used},
    {"distCoeffs", "distortion_coefficients", FieldUse::used},
    {"R", "R", FieldUse::used},
    {"T", "T", FieldUse::used},
    {"skew", "skew", FieldUse::refused},
    {"alpha_c", "skew", FieldUse::refused},
    {"square_size", "square_size", FieldUse::refused},
    {"square_Size", "square_size", FieldUse::refused},
    {"fisheye_model", "fisheye_model", FieldUse::refused},
    {"xi", "xi", FieldUse::refused},
    {"binning_x", "binning", FieldUse::refused},
    {"binning_y", "binning", FieldUse::refused},
});
/// Words: the lens model and the unit.
inline constexpr auto kOpencvWords = std::to_array<OpencvField>({
    {"distortion_model", "lens", FieldUse::refused},
    {"camera_model", "lens", FieldUse::refused},
    {"lens_model", "lens", FieldUse::refused},
    {"model_type", "lens", FieldUse::refused},
    {"projection_model", "lens", FieldUse::refused},
    {"unit", "unit", FieldUse::refused},
    {"units", "unit", FieldUse::refused},
});
/// None of these affects rays. The last two describe pictures that ROS has rectified.
inline constexpr auto kOpencvIgnored = std::to_array<std::string_view>({
    "calibration_time",
    "calibration_Time",
    "nframes",
    "nr_of_frames",
    "nrOfFrames",
    "board_width",
    "board_Width",
    "board_height",
    "board_Height",
    "board_size",
    "aspectRatio",
    "aspect_ratio",
    "fix_aspect_ratio",
    "FixAspectRatio",
    "flags",
    "flagValue",
    "camera_name",
    "avg_reprojection_error",
    "rms",
    "reprojection_error",
    "Avg_Reprojection_Error",
    "image_points",
    "Image_points",
    "per_view_reprojection_errors",
    "grid_points",
    "extrinsic_parameters",
    "Per_View_Reprojection_Errors",
    "Extrinsic_Parameters",
    "rectification_matrix",
    "projection_matrix",
});

/// A key of a camera in Kalibr's camchain.
struct KalibrField {
  std::string_view key;
  FieldUse use;
};
inline constexpr auto kKalibrFields = std::to_array<KalibrField>({
    {"camera_model", FieldUse::used},
    {"distortion_model", FieldUse::used},
    {"intrinsics", FieldUse::used},
    {"distortion_coeffs", FieldUse::used},
    {"resolution", FieldUse::used},
    {"T_cn_cnm1", FieldUse::used},
    {"line_delay", FieldUse::refused},
    {"cam_overlaps", FieldUse::ignored},
    {"rostopic", FieldUse::ignored},
    {"T_cam_imu", FieldUse::ignored},
    {"timeshift_cam_imu", FieldUse::ignored},
});

/// A lens model of COLMAP's.
struct ColmapLens {
  std::string_view name;
  std::size_t parameters;
  bool one_focal;  ///< for x and y
  FieldUse use;
};
/// By COLMAP's number of the model.
inline constexpr auto kColmapLenses = std::to_array<ColmapLens>({
    {"SIMPLE_PINHOLE", 3, true, FieldUse::used},
    {"PINHOLE", 4, false, FieldUse::used},
    {"SIMPLE_RADIAL", 4, true, FieldUse::used},
    {"RADIAL", 5, true, FieldUse::used},
    {"OPENCV", 8, false, FieldUse::used},
    {"OPENCV_FISHEYE", 8, false, FieldUse::refused},
    {"FULL_OPENCV", 12, false, FieldUse::used},
    {"FOV", 5, false, FieldUse::refused},
    {"SIMPLE_RADIAL_FISHEYE", 4, true, FieldUse::refused},
    {"RADIAL_FISHEYE", 5, true, FieldUse::refused},
    {"THIN_PRISM_FISHEYE", 12, false, FieldUse::refused},
    {"RAD_TAN_THIN_PRISM_FISHEYE", 16, false, FieldUse::refused},
});

}  // namespace emberlock::recon
