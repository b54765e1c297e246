// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/coarse_pictures.h"

#include <algorithm>
#include <cmath>

#include "recon/hull/ray_list.h"

namespace emberlock::recon {
namespace {

Volume crop(const Volume& volume, const CroppedHull& to) {
  const Grid& g = to.hull.grid;
  Volume out{g, std::vector<float>(3 * g.size()), {}};
  if (!volume.extinction.empty()) out.extinction.resize(g.size());
  for (int k = 0; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      const std::size_t from = volume.grid.index(to.offset[0], to.offset[1] + j, to.offset[2] + k);
      const std::size_t at = g.index(0, j, k);
      const auto n = static_cast<std::size_t>(g.nx);
      std::copy_n(&volume.emission[3 * from], 3 * n, &out.emission[3 * at]);
      if (!volume.extinction.empty()) std::copy_n(&volume.extinction[from], n, &out.extinction[at]);
    }
  }
  return out;
}

int small(int pixels, int stride) { return std::max(1, pixels / stride); }

/// The camera of every stride-th pixel in a box: its pixel centres are centres of blocks of the full picture.
CameraModel small_camera(CameraModel camera, const PixelBox& box, int stride) {
  Intrinsics& i = camera.intrinsics;
  i.size = {small(box.x1 - box.x0, stride), small(box.y1 - box.y0, stride)};
  i.fx /= stride;
  i.fy /= stride;
  i.cx = (i.cx - box.x0) / stride;
  i.cy = (i.cy - box.y0) / stride;
  return camera;
}

RadianceImage small_picture(const RadianceImage& full, const PixelBox& box, int stride) {
  RadianceImage out(ImageSize{small(box.x1 - box.x0, stride), small(box.y1 - box.y0, stride)});
  float* to = out.rgb.data();
  for (int y = 0; y < out.size.height; ++y) {
    for (int x = 0; x < out.size.width; ++x, to += 3) {
      const int pixel =
          (box.y0 + y * stride + stride / 2) * full.size.width + box.x0 + x * stride + stride / 2;
      std::copy_n(&full.rgb[3 * static_cast<std::size_t>(pixel)], 3, to);
    }
  }
  return out;
}

}  // namespace

std::vector<PixelBox> flame_boxes(const Scene& scene, const std::vector<FlameMask>& masks) {
  std::vector<PixelBox> boxes;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const ImageSize size = scene.views[v].image->size;
    boxes.push_back(masks[v].box.empty() ? PixelBox{0, 0, size.width, size.height} : masks[v].box);
  }
  return boxes;
}

CoarsePictures::CoarsePictures(const CoarseFlame& flame, const ComputeOptions& compute, int wanted)
    : compute_(compute) {
  if (flame.medium.count > 0) {
    CroppedHull cropped = crop_to_medium(flame.medium);
    volume_ = crop(flame.volume, cropped);
    medium_ = std::move(cropped.hull);
  }
  const std::vector<PixelBox> boxes = flame_boxes(flame.scene, flame.masks);
  double pixels = 0;
  for (std::size_t v = 0; v < boxes.size(); ++v)
    if (flame.scene.views[v].role == ViewRole::input)
      pixels += static_cast<double>(boxes[v].x1 - boxes[v].x0) * (boxes[v].y1 - boxes[v].y0);
  stride_ = std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / wanted))));
  for (std::size_t v = 0; v < boxes.size(); ++v) {
    const View& view = flame.scene.views[v];
    if (view.role != ViewRole::input) continue;
    cameras_.push_back(small_camera(view.camera, boxes[v], stride_));
    backgrounds_.push_back(view.background ? small_picture(*view.background, boxes[v], stride_)
                                           : RadianceImage());
  }
}

std::vector<RadianceImage> CoarsePictures::operator()(const Effects& effects, RenderOptions options) const {
  options.compute = compute_;
  std::vector<const CameraModel*> cameras;
  std::vector<const RadianceImage*> backgrounds;
  for (std::size_t v = 0; v < cameras_.size(); ++v) {
    cameras.push_back(&cameras_[v]);
    backgrounds.push_back(backgrounds_[v].rgb.empty() ? nullptr : &backgrounds_[v]);
  }
  return render_views(volume_, medium_, effects, cameras, backgrounds, options);
}

double change(const std::vector<RadianceImage>& with, const std::vector<RadianceImage>& without) {
  double ww = 0;
  double wo = 0;
  double oo = 0;
  for (std::size_t v = 0; v < with.size(); ++v) {
    double products[3] = {};
    const std::size_t values = with[v].rgb.size();
    for (std::size_t i = 0; i < values; ++i) {
      const auto a = static_cast<double>(with[v].rgb[i]);
      const auto b = static_cast<double>(without[v].rgb[i]);
      products[0] += a * a;
      products[1] += a * b;
      products[2] += b * b;
    }
    const double weight = 1 / static_cast<double>(values * with.size());
    ww += weight * products[0];
    wo += weight * products[1];
    oo += weight * products[2];
  }
  if (oo <= 0) return 0;
  return std::sqrt(std::max(0.0, ww - wo * wo / oo));
}

}  // namespace emberlock::recon
