// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/clips.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <fstream>
#include <memory>
#include <set>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
extern "C" {
#include <libavutil/mem.h>
#include <libavutil/sha.h>
}

#include "base/file.h"
#include "base/log.h"
#include "base/unique_fd.h"

namespace emberlock::drivers {
namespace fs = std::filesystem;
namespace {

constexpr std::uint32_t kPart = 1u << 20;
constexpr std::uint32_t kCompared =
    1u << 16;  // bytes of an interrupted download that are compared before it continues
constexpr Seconds kPartDeadline{10};
constexpr Seconds kChangePause = milliseconds(20);
constexpr double kSlowestBytesPerSecond = 200e3;
constexpr std::uint32_t kTooLarge = 0xffffffff;
constexpr std::uint16_t kFolder = 0x3001;

Error io_error(const fs::path& file, const std::string& what) {
  return {ErrorKind::io, fmt::format("{}: {}", what, std::strerror(errno)), file.string(),
          "see to the disk's space and permissions"};
}

class Sha256 {
 public:
  Sha256() : context_(av_sha_alloc()) { av_sha_init(context_.get(), 256); }
  void add(std::span<const std::byte> bytes) {
    av_sha_update(context_.get(), reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  std::string hex() {
    std::array<std::uint8_t, 32> digest{};
    av_sha_final(context_.get(), digest.data());
    std::string text;
    for (const std::uint8_t byte : digest) text += fmt::format("{:02x}", byte);
    return text;
  }

 private:
  struct Free {
    void operator()(AVSHA* context) const { av_free(context); }
  };
  std::unique_ptr<AVSHA, Free> context_;
};

/// Hash of the file's first `size` bytes.
Result<Sha256> hash_of(const fs::path& file, std::uint64_t size) {
  std::ifstream in(file, std::ios::binary);
  Sha256 hash;
  std::vector<char> buffer(kPart);
  while (size > 0) {
    const auto wanted = static_cast<std::streamsize>(std::min<std::uint64_t>(size, buffer.size()));
    if (!in.read(buffer.data(), wanted)) return io_error(file, "it can't be read");
    hash.add(std::as_bytes(std::span(buffer.data(), static_cast<std::size_t>(wanted))));
    size -= static_cast<std::uint64_t>(wanted);
  }
  return hash;
}

fs::path beside(const fs::path& target, const char* suffix) { return target.string() + suffix; }

bool is_movie(const PtpObjectInfo& info) {
  // AVI, MPEG, ASF, QuickTime by the PTP standard; MP4 by MTP. Other films are recognised by name.
  constexpr std::uint16_t kFormats[] = {0x300a, 0x300b, 0x300c, 0x300d, 0xb982};
  if (std::find(std::begin(kFormats), std::end(kFormats), info.format) != std::end(kFormats)) return true;
  std::string extension = fs::path(info.name).extension();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".avi" || extension == ".mov" || extension == ".mp4";
}

Status wait_for(Chdk& chdk, Clock& clock, ChdkMovie wanted, Seconds deadline) {
  const TimePoint until = clock.now() + deadline;
  for (;;) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMovie now, chdk.movie());
    if (now == wanted) return {};
    if (clock.now() >= until) {
      return Error{ErrorKind::timed_out,
                   fmt::format("its movie didn't {} within {:.1f} s",
                               wanted == ChdkMovie::recording ? "start" : "end", deadline.value()),
                   {},
                   "see what its screen says: its card may be full or locked"};
    }
    clock.sleep_until(clock.now() + kChangePause);
  }
}

/// One download.
class Download {
 public:
  Download(PtpSession& session, const Clip& clip, fs::path part)
      : session_(session), clip_(clip), part_(std::move(part)) {}

  Status run(const Progress& progress);
  Result<std::string> verified_hash();

 private:
  /// How many of the existing bytes belong to the clip.
  Result<std::uint32_t> usable();
  Status append(std::span<const std::byte> bytes);
  Result<std::uint64_t> next_part();
  Status whole();

  PtpSession& session_;
  const Clip& clip_;
  fs::path part_;
  UniqueFd file_;
  Sha256 hash_;
  std::uint32_t done_ = 0;
};

Result<std::uint32_t> Download::usable() {
  std::error_code error;
  const std::uint64_t there = fs::file_size(part_, error);
  if (error || there == 0 || there > clip_.bytes) return 0u;
  const auto size = static_cast<std::uint32_t>(there);
  const std::uint32_t compared = std::min(size, kCompared);
  std::vector<char> mine(compared);
  std::ifstream in(part_, std::ios::binary);
  in.seekg(size - compared);
  if (!in.read(mine.data(), compared)) return io_error(part_, "it can't be read");
  std::vector<std::byte> theirs;
  const auto came = session_.partial_object(
      clip_.handle, size - compared, compared,
      [&](std::span<const std::byte> bytes) {
        theirs.insert(theirs.end(), bytes.begin(), bytes.end());
        return Status();
      },
      kPartDeadline);
  if (!came.ok()) return came.error();
  const auto mine_bytes = std::as_bytes(std::span(mine));
  return std::equal(theirs.begin(), theirs.end(), mine_bytes.begin(), mine_bytes.end()) ? size : 0u;
}

Status Download::append(std::span<const std::byte> bytes) {
  if (bytes.size() > clip_.bytes - done_) {
    return Error{ErrorKind::device, "it sends more of " + clip_.name + " than there is", session_.where()};
  }
  hash_.add(bytes);
  done_ += static_cast<std::uint32_t>(bytes.size());
  while (!bytes.empty()) {
    const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return io_error(part_, "it can't be written");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Result<std::uint64_t> Download::next_part() {
  return session_.partial_object(
      clip_.handle, done_, std::min(kPart, clip_.bytes - done_),
      [this](std::span<const std::byte> bytes) { return append(bytes); }, kPartDeadline);
}

Status Download::whole() {
  const Seconds deadline = kPartDeadline + Seconds(clip_.bytes / kSlowestBytesPerSecond);
  return session_.object(
      clip_.handle, clip_.bytes, [this](std::span<const std::byte> bytes) { return append(bytes); },
      deadline);
}

Status Download::run(const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpDeviceInfo info, session_.device_info());
  const bool by_parts = info.has(kPtpGetPartialObject);
  if (by_parts) {
    EMBERLOCK_ASSIGN_OR_RETURN(done_, usable());
  }
  EMBERLOCK_ASSIGN_OR_RETURN(hash_, hash_of(part_, done_));
  file_ = UniqueFd(::open(part_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
  if (!file_ || ::ftruncate(file_.get(), done_) != 0 || ::lseek(file_.get(), done_, SEEK_SET) < 0) {
    return io_error(part_, "it can't be opened for writing");
  }
  if (!by_parts && clip_.bytes > 0) EMBERLOCK_RETURN_IF_ERROR(whole());
  while (by_parts && done_ < clip_.bytes) {
    tell(progress, static_cast<double>(done_) / clip_.bytes, clip_.name);
    EMBERLOCK_ASSIGN_OR_RETURN(const std::uint64_t came, next_part());
    if (came == 0) break;
  }
  if (done_ < clip_.bytes) {
    return Error{ErrorKind::device,
                 fmt::format("{} ends after {} of {} bytes", clip_.name, done_, clip_.bytes),
                 session_.where(), "see whether it still films, then try again"};
  }
  if (::fsync(file_.get()) != 0) return io_error(part_, "it can't be written to the disk");
  tell(progress, 1, clip_.name);
  return {};
}

Result<std::string> Download::verified_hash() {
  const std::string sent = hash_.hex();
  EMBERLOCK_ASSIGN_OR_RETURN(Sha256 read_back, hash_of(part_, clip_.bytes));
  if (read_back.hex() == sent) return sent;
  return Error{ErrorKind::io, "it doesn't read as it was written", part_.string(), "see to the disk"};
}

}  // namespace

Status start_movie(Chdk& chdk, Clock& clock, Seconds deadline) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMovie now, chdk.movie());
  if (now != ChdkMovie::stopped) {
    return Error{ErrorKind::device, "it films a movie already", {}, "stop it first"};
  }
  EMBERLOCK_RETURN_IF_ERROR(chdk.press_movie_button());
  return wait_for(chdk, clock, ChdkMovie::recording, deadline);
}

Status stop_movie(Chdk& chdk, Clock& clock, Seconds deadline) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMovie now, chdk.movie());
  if (now == ChdkMovie::stopped) return {};
  if (now != ChdkMovie::saving) EMBERLOCK_RETURN_IF_ERROR(chdk.press_movie_button());
  return wait_for(chdk, clock, ChdkMovie::stopped, deadline);
}

Result<std::vector<Clip>> list_clips(PtpSession& session) {
  // One folder after another: some cameras list the objects of all folders at once, others only pretend to.
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<std::uint32_t> left, session.objects());
  std::set<std::uint32_t> seen;
  std::vector<Clip> clips;
  while (!left.empty()) {
    const std::uint32_t handle = left.back();
    left.pop_back();
    if (!seen.insert(handle).second) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(const PtpObjectInfo info, session.object_info(handle));
    if (info.format == kFolder) {
      EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::uint32_t> inside, session.objects(handle));
      left.insert(left.end(), inside.begin(), inside.end());
    }
    if (!is_movie(info)) continue;
    if (info.bytes == kTooLarge) {
      log(LogCategory::drivers)
          .warn("{}: {} has 4 GiB or more: copy it with a card reader", session.where(), info.name);
      continue;
    }
    clips.push_back({handle, info.name, info.bytes, info.captured});
  }
  std::sort(clips.begin(), clips.end(), [](const Clip& a, const Clip& b) { return a.name < b.name; });
  return clips;
}

Status download_clip(PtpSession& session, const Clip& clip, const fs::path& target,
                     const Progress& progress) {
  std::error_code error;
  if (fs::exists(target, error)) {
    return Error{ErrorKind::bad_input, "it is there already", target.string(),
                 "choose another name, or remove it"};
  }
  fs::create_directories(target.parent_path(), error);
  if (error)
    return Error{ErrorKind::io, "cannot create the folder: " + error.message(),
                 target.parent_path().string()};
  const fs::path part = beside(target, ".part");
  Download download(session, clip, part);
  EMBERLOCK_RETURN_IF_ERROR(download.run(progress));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string hash, download.verified_hash());
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(beside(target, ".sha256"), hash + "  " + target.filename().string() + "\n"));
  fs::rename(part, target, error);
  if (error) return Error{ErrorKind::io, "it can't be renamed: " + error.message(), part.string()};
  return {};
}

Status verify_clip(const fs::path& target) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string line, read_file(beside(target, ".sha256"), 4096));
  std::error_code error;
  const std::uint64_t size = fs::file_size(target, error);
  if (error) return Error{ErrorKind::io, error.message(), target.string()};
  EMBERLOCK_ASSIGN_OR_RETURN(Sha256 hash, hash_of(target, size));
  if (line.substr(0, 64) == hash.hex()) return {};
  return Error{ErrorKind::bad_input, "it isn't what was downloaded", target.string(), "download it again"};
}

}  // namespace emberlock::drivers
