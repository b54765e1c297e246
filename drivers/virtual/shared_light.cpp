// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/shared_light.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "drivers/virtual/virtual_strobe.h"

namespace emberlock::drivers {
namespace {

constexpr std::string_view kLightMagic = "emberlock-light";
constexpr std::string_view kLightVersion = "1";
constexpr std::array<std::string_view, 3> kOutputNames{"off", "flashing", "steady"};
constexpr std::size_t kLongestLightLine = 8192;
constexpr std::int64_t kLatestWall = 4'102'444'800'000'000'000;  // the year 2100
constexpr Seconds kNotice{0.02};  // from a line to the instant at which it takes effect

/// How far the wall clock is ahead, from the tightest of several brackets.
std::int64_t wall_ahead_ns(const Clock& clock) {
  constexpr int kTries = 32;
  std::int64_t ahead = 0;
  std::int64_t tightest = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < kTries; ++i) {
    const TimePoint before = clock.now();
    const TimePoint wall = wall_clock();
    const std::int64_t width = clock.now().ns - before.ns;
    if (width >= tightest) continue;
    tightest = width;
    ahead = wall.ns - before.ns - width / 2;
  }
  return ahead;
}

std::vector<std::string_view> words_of_light(std::string_view line) {
  std::vector<std::string_view> words;
  for (;;) {
    const std::size_t space = line.find(' ');
    words.push_back(line.substr(0, space));
    if (space == std::string_view::npos) return words;
    line.remove_prefix(space + 1);
  }
}

/// Whether all of `word` is a number.
template <class T>
bool read_light_number(std::string_view word, T& number) {
  const char* const end = word.data() + word.size();
  const auto [stop, failure] = std::from_chars(word.data(), end, number);
  return failure == std::errc{} && stop == end;
}

std::optional<std::vector<bool>> read_light_code(std::string_view word) {
  std::vector<bool> code;
  if (word == "-") return code;
  if (word.empty() || word.find_first_not_of("01") != std::string_view::npos) return std::nullopt;
  for (const char flash : word) code.push_back(flash == '1');
  return code;
}

}  // namespace

std::string first_light_line(PartsPerMillion rate_error) {
  return fmt::format("{} {} {}\n", kLightMagic, kLightVersion, rate_error.value());
}

std::string light_line(const LightSetting& setting) {
  const StrobeSettings& s = setting.settings;
  std::string code;
  for (const bool flash : s.code) code += flash ? '1' : '0';
  return fmt::format("{} {} {} {} {} {}\n", setting.at.ns,
                     kOutputNames.at(static_cast<std::size_t>(s.output)), s.rate.value(), s.phase.value(),
                     s.width.value(), code.empty() ? "-" : code);
}

Error LightText::refuse(std::string what, std::string remedy) const {
  return {ErrorKind::bad_input, std::move(what), fmt::format("{}:{}", where_, line_), std::move(remedy)};
}

Result<PartsPerMillion> LightText::read_first(std::string_view line) const {
  const auto words = words_of_light(line);
  if (words.front() != kLightMagic) {
    return refuse("this is no file of a shared strobe", "name the file that the strobe's daemon writes");
  }
  if (words.size() < 2 || words[1] != kLightVersion) {
    return refuse("the version of the shared strobe's file is unknown", "run daemons of one version");
  }
  double ppm = 0;
  if (words.size() != 3 || !read_light_number(words[2], ppm) || !(ppm >= -1000 && ppm <= 1000)) {
    return refuse("the error of the strobe's rate is not -1000 to 1000 ppm",
                  "start the strobe's daemon anew");
  }
  return PartsPerMillion(ppm);
}

Result<LightSetting> LightText::read_setting(std::string_view line) const {
  const std::string anew = "start the strobe's daemon anew";
  const auto words = words_of_light(line);
  if (words.size() != 6) return refuse(fmt::format("a setting has {} words", words.size()), anew);
  LightSetting next;
  if (!read_light_number(words[0], next.at.ns) || next.at.ns < 0 || next.at.ns > kLatestWall) {
    return refuse("a setting's instant is not from 1970 to 2100", anew);
  }
  if (next.at < last_) return refuse("a setting is older than the one before", anew);
  const auto* const output = std::find(kOutputNames.begin(), kOutputNames.end(), words[1]);
  if (output == kOutputNames.end()) return refuse("there is no such output of a strobe", anew);
  next.settings.output = static_cast<StrobeOutput>(output - kOutputNames.begin());
  std::array<double, 3> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!read_light_number(words[2 + i], numbers[i])) return refuse("a setting lacks a number", anew);
  }
  next.settings.rate = Hertz(numbers[0]);
  next.settings.phase = Seconds(numbers[1]);
  next.settings.width = Seconds(numbers[2]);
  auto code = read_light_code(words[5]);
  if (!code) return refuse("a code holds something else than 0 and 1", anew);
  next.settings.code = std::move(*code);
  EMBERLOCK_RETURN_IF_ERROR(check_settings(next.settings, fmt::format("{}:{}", where_, line_)));
  return next;
}

Result<std::vector<LightSetting>> LightText::take(std::string_view bytes) {
  pending_ += bytes;
  std::vector<LightSetting> settings;
  std::size_t begin = 0;
  for (std::size_t end = 0; (end = pending_.find('\n', begin)) != std::string::npos; begin = end + 1) {
    ++line_;
    const std::string_view line = std::string_view(pending_).substr(begin, end - begin);
    if (!rate_error_) {
      EMBERLOCK_ASSIGN_OR_RETURN(rate_error_, read_first(line));
      continue;
    }
    EMBERLOCK_ASSIGN_OR_RETURN(LightSetting next, read_setting(line));
    last_ = next.at;
    settings.push_back(std::move(next));
  }
  pending_.erase(0, begin);
  if (pending_.size() > kLongestLightLine) {
    ++line_;
    return refuse("a line has no end", "name the file that the strobe's daemon writes");
  }
  return settings;
}

LightWriter::LightWriter(std::filesystem::path file, std::shared_ptr<Clock> clock)
    : file_(std::move(file)), clock_(std::move(clock)), to_wall_ns_(wall_ahead_ns(*clock_)) {}

Error LightWriter::failed(const char* what) const {
  return {ErrorKind::io, fmt::format("can't {}: {}", what, std::strerror(errno)), file_.string(),
          "make its folder, with room and the right to write in it"};
}

Result<std::unique_ptr<LightWriter>> LightWriter::create(std::filesystem::path file,
                                                         PartsPerMillion rate_error,
                                                         std::shared_ptr<Clock> clock) {
  std::error_code unknown;
  if (std::filesystem::exists(file, unknown)) {
    std::string start(kLightMagic.size(), '\0');
    const bool regular = std::filesystem::is_regular_file(file, unknown);
    if (regular) start.resize(std::ifstream(file).read(start.data(), std::ssize(start)).gcount());
    if (!regular || (!start.empty() && start != kLightMagic)) {
      return Error{ErrorKind::bad_input, "something else than a shared strobe has this name", file.string(),
                   "give another name, or take it away"};
    }
  }
  std::unique_ptr<LightWriter> writer(new LightWriter(std::move(file), std::move(clock)));
  // A new file, and not the old one emptied: followers notice, however much has been written since.
  const char* const name = writer->file_.c_str();
  ::unlink(name);
  writer->fd_ = UniqueFd(::open(name, O_WRONLY | O_APPEND | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!writer->fd_) return writer->failed("make the file");
  EMBERLOCK_RETURN_IF_ERROR(writer->write(first_light_line(rate_error)));
  return writer;
}

Result<TimePoint> LightWriter::announce(const StrobeSettings& settings) {
  const TimePoint at = clock_->now() + kNotice;
  EMBERLOCK_RETURN_IF_ERROR(write(light_line({{at.ns + to_wall_ns_}, settings})));
  return at;
}

Status LightWriter::write(const std::string& line) {
  const ssize_t written = ::write(fd_.get(), line.data(), line.size());
  if (written == std::ssize(line)) {
    size_ += written;
    return {};
  }
  if (written >= 0) errno = ENOSPC;
  Error error = failed("write to it");
  // A line's beginning would spoil the next line.
  if (written > 0 && ::ftruncate(fd_.get(), size_) != 0) error.remedy += ", and start anew";
  return error;
}

LightFollower::LightFollower(std::filesystem::path file, std::shared_ptr<Clock> clock,
                             std::shared_ptr<StrobeTimeline> timeline)
    : file_(std::move(file)), clock_(std::move(clock)), timeline_(std::move(timeline)) {}

Error LightFollower::failed(const char* what) const {
  return {ErrorKind::io, fmt::format("can't {}: {}", what, std::strerror(errno)), file_.string(),
          "start the daemon that has the strobe, and let this one read what it writes"};
}

void LightFollower::look() {
  const std::lock_guard lock(mutex_);
  Status status;
  if (!is_open_still()) status = open();
  if (status.ok() && !refused_) status = read_on();
  if (status.ok()) return;
  refused_ = true;
  timeline_->restart({});
  if (std::string message = status.error().message(); message != told_) {
    log(LogCategory::drivers).warn("no light: {}", message);
    told_ = std::move(message);
  }
}

/// Whether the file that is open is that of the name, and no shorter than what was read of it. A leader that
/// takes the name away between two files changes nothing.
bool LightFollower::is_open_still() const {
  struct stat held {};
  struct stat named {};
  if (!fd_ || ::fstat(fd_.get(), &held) != 0 || held.st_size < read_) return false;
  return ::stat(file_.c_str(), &named) != 0 || (named.st_dev == held.st_dev && named.st_ino == held.st_ino);
}

Status LightFollower::open() {
  timeline_->restart({});
  fd_ = UniqueFd(::open(file_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd_) return failed("open the file");
  to_wall_ns_ = wall_ahead_ns(*clock_);
  read_ = 0;
  text_ = LightText(file_.string());
  refused_ = false;
  told_.clear();
  return {};
}

Status LightFollower::read_on() {
  std::array<char, 4096> bytes{};
  for (;;) {
    const ssize_t got = ::pread(fd_.get(), bytes.data(), bytes.size(), read_);
    if (got < 0) return failed("read it");
    if (got == 0) return {};
    read_ += got;
    const bool first = !text_.rate_error();
    EMBERLOCK_ASSIGN_OR_RETURN(const auto settings,
                               text_.take({bytes.data(), static_cast<std::size_t>(got)}));
    if (first && text_.rate_error()) timeline_->restart(*text_.rate_error());
    for (const LightSetting& next : settings) {
      timeline_->apply(next.settings, {next.at.ns - to_wall_ns_});
    }
  }
}

}  // namespace emberlock::drivers
