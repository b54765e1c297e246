// SPDX-License-Identifier: Apache-2.0
#include "recon/export/exr_file.h"

#include <algorithm>
#include <exception>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>

#include "base/kind_of_file.h"

namespace emberlock::recon {
namespace {

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return all;
}

}  // namespace

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

Result<ExrValues> read_exr(const std::filesystem::path& path, const std::vector<std::string>& names) try {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(path));
  Imf::InputFile file(path.c_str());
  const Imath::Box2i& window = file.header().dataWindow();
  ExrValues picture;
  picture.size = {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
  constexpr int kMost = 16384;
  if (picture.size.width < 1 || picture.size.height < 1 || picture.size.width > kMost ||
      picture.size.height > kMost)
    return Error{ErrorKind::bad_input, "has sides beyond 16384 pixels", path.string(), "Give a smaller one"};
  const auto name = std::find_if(names.begin(), names.end(), [&](const std::string& n) {
    return file.header().channels().findChannel(n) != nullptr;
  });
  if (name == names.end())
    return Error{ErrorKind::bad_input, "has none of the channels " + joined(names), path.string(),
                 "Name the channel so"};
  picture.values.resize(static_cast<std::size_t>(picture.size.width) *
                        static_cast<std::size_t>(picture.size.height));
  Imf::FrameBuffer frame;
  frame.insert(*name, Imf::Slice::Make(Imf::FLOAT, picture.values.data(), window));
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return picture;
} catch (const std::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), path.string(), "Give an OpenEXR file that isn't damaged"};
}

}  // namespace emberlock::recon
