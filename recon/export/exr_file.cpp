// SPDX-License-Identifier: Apache-2.0
#include "recon/export/exr_file.h"

#include <exception>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

namespace emberlock::recon {

Status write_exr(ImageSize size, const std::vector<ExrChannel>& channels,
                 const std::filesystem::path& path) try {
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  for (const ExrChannel& channel : channels)
    if (channel.values.size() != pixels)
      return Error{ErrorKind::bad_input, "channel " + channel.name + " isn't one value a pixel",
                   path.string()};
  Imf::Header header(size.width, size.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  for (const ExrChannel& channel : channels) {
    header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
    // It takes mutable pixels, but writing doesn't change them.
    auto* values = reinterpret_cast<char*>(const_cast<float*>(channel.values.data()));
    frame.insert(channel.name, Imf::Slice(Imf::FLOAT, values, sizeof(float),
                                          sizeof(float) * static_cast<std::size_t>(size.width)));
  }
  {
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(size.height);
  }  // writes the rest, and keeps silent about what fails
  if (!Imf::InputFile(path.c_str()).isComplete())
    return Error{ErrorKind::io, "was cut short", path.string(), "Check the disk's space and health"};
  return {};
} catch (const std::exception& e) {
  return Error{ErrorKind::io, e.what(), path.string(), "Check the disk's space and health"};
}

}  // namespace emberlock::recon
