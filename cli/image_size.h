// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::cli {

/// "1280x720", as given to `option`.
inline Result<ImageSize> parse_image_size(const std::string& text, const char* option = "--image") {
  ImageSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) == 2)  // NOLINT(cert-err34-c)
    return size;
  return Error{ErrorKind::bad_input, "\"" + text + "\" is not WIDTHxHEIGHT", option,
               "Give for example 1280x720"};
}

}  // namespace emberlock::cli
