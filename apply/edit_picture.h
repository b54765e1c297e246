// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apply/edit_file.h"
#include "base/result.h"
#include "recon/views/radiance_image.h"

namespace emberlock::apply {

/// An object's picture: grey levels, and how much of the flame's picture each pixel replaces.
struct ObjectPicture {
  ImageSize size;
  std::vector<float> grey;     ///< 0..255, row-major: 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601)
  std::vector<float> opacity;  ///< 0..1; empty: 1 everywhere
  std::string hash;            ///< as ObjectEdit has it
};
/// Errors: read_image()'s; a mask of another size; another hash than the edit tells.
Result<ObjectPicture> load_object(const ObjectEdit& object);

/// Pictures of the objects among the operations, which were loaded before.
using FindObject = std::function<const ObjectPicture&(const ObjectEdit&)>;

/// The view whose picture an operation changes; null where it changes none.
const std::string* view_of(const Operation& operation);

/// What operations, in their order, make of a view's captured picture: a function of these alone, and the
/// captured picture itself where none is about this view. No pixel becomes negative that wasn't.
recon::SharedImage edited_picture(const recon::SharedImage& captured, const std::string& view,
                                  const std::vector<const Operation*>& operations, const FindObject& object);

}  // namespace emberlock::apply
