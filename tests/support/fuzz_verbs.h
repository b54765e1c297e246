// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#if defined(__clang__)
#include <sanitizer/common_interface_defs.h>
#endif
#include <sys/mman.h>
#include <unistd.h>

#include "cli/commands.h"
#include "recon/calibrate/rig_formats.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "session/reader.h"

// Whole verbs on any bytes: libFuzzer's targets, and a plain test over their corpora, call the same. Each
// takes what the verb does apart: an error that says something, or a result that can be read back and is
// finite. All else aborts.
namespace emberlock::test {

/// A folder of this process in memory, and a stderr that can be asked what was said.
class VerbBench {
 public:
  static VerbBench& one() {
    static VerbBench bench;
    return bench;
  }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// A verb with no memory of the one before.
  int run(void (*add)(const cli::Verb&), std::vector<std::string> words) {
    std::filesystem::remove_all(folder_ / "out");
    const cli::CommandLine line;
    add(line.program());
    const int out = redirect(STDOUT_FILENO);
    const int err = redirect(STDERR_FILENO);
    int code = 0;
    std::string escaped;  // what no verb may let out
    try {
      line.parse(std::move(words));
    } catch (const cli::Exit& e) {
      code = e.code;
    } catch (const std::exception& e) {
      escaped = std::string("an exception: ") + e.what();
    }
    std::fflush(nullptr);
    const bool silent = ::lseek(STDERR_FILENO, 0, SEEK_CUR) == 0;
    restore(STDOUT_FILENO, out);
    restore(STDERR_FILENO, err);
    if (!escaped.empty()) die(escaped);
    if (code != 0 && silent) die("an error without a word");
    if (code != 0 && std::filesystem::exists(folder_ / "out")) die("a result of what failed");
    return code;
  }
  [[noreturn]] static void die(const std::string& why) {
    std::fprintf(stderr, "%s\n", why.c_str());
    std::abort();
  }
  void write(const std::string& name, std::string_view bytes) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }

 private:
  VerbBench() {
    const std::filesystem::path memory = "/dev/shm";
    const bool usable = ::access(memory.c_str(), W_OK) == 0;
    folder_ = (usable ? memory : std::filesystem::temp_directory_path()) /
              ("emberlock-fuzz-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
#if defined(__clang__)
#if __has_feature(address_sanitizer)
    // What a sanitizer finds is said even while the verb's own stderr is caught.
    __sanitizer_set_report_fd(reinterpret_cast<void*>(static_cast<std::intptr_t>(::dup(STDERR_FILENO))));
#endif
#endif
  }
  ~VerbBench() {
    std::error_code ec;
    std::filesystem::remove_all(folder_, ec);
  }
  static int redirect(int fd) {
    std::fflush(nullptr);
    const int kept = ::dup(fd);
    const int file = ::memfd_create("said", 0);
    ::dup2(file, fd);
    ::close(file);
    return kept;
  }
  static void restore(int fd, int kept) {
    ::dup2(kept, fd);
    ::close(kept);
  }
  std::filesystem::path folder_;
};

/// `emberlock reconstruct`: the bytes are a transforms.json beside three small pictures, a.png to c.png.
inline int fuzz_reconstruct(const std::uint8_t* data, std::size_t size) {
  VerbBench& bench = VerbBench::one();
  if (!std::filesystem::exists(bench.folder() / "c.png")) {
    for (const char* name : {"a.png", "b.png", "c.png"}) {
      Image picture(ImageLayout{{16, 12}, PixelFormat::rgb8, 8});
      for (int y = 3; y < 9; ++y)
        for (int i = 3 * 5; i < 3 * 11; ++i) picture.row_as<std::uint8_t>(y)[i] = 200;
      if (!recon::write_png(picture.view(), bench.folder() / name).ok()) std::abort();
    }
  }
  bench.write("transforms.json", {reinterpret_cast<const char*>(data), size});
  const std::string out = (bench.folder() / "out").string();
  const int code = bench.run(cli::add_reconstruct,
                             {"reconstruct", (bench.folder() / "transforms.json").string(), "--out", out,
                              "--voxels", "6", "--iterations", "1", "--device", "cpu", "--threads", "1"});
  if (code != 0) return 0;
  const auto volume = recon::read_volume(out + "/volume.vdb");
  if (!volume) std::abort();
  for (const float v : volume->emission)
    if (!std::isfinite(v)) std::abort();
  for (const float v : volume->extinction)
    if (!std::isfinite(v)) std::abort();
  return 0;
}

/// `emberlock calibrate convert`: the first byte says under which name the rest is read.
inline int fuzz_calibrate_convert(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  VerbBench& bench = VerbBench::one();
  static constexpr const char* kNames[] = {"in.json", "in.yml", "in.xml"};
  const std::string name = kNames[data[0] % 3];
  bench.write(name, {reinterpret_cast<const char*>(data) + 1, size - 1});
  const std::string out = (bench.folder() / "out").string();
  const int code =
      bench.run(cli::add_calibrate, {"calibrate", "convert", (bench.folder() / name).string(), "--out", out});
  if (code == 0 && !recon::import_rig(out + "/rig.json")) std::abort();
  return 0;
}

/// `emberlock import` of a film of any bytes, whose first says under which name: what isn't refused is a
/// session that opens.
inline int fuzz_import(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  VerbBench& bench = VerbBench::one();
  static constexpr const char* kNames[] = {"mp4", "avi", "mkv", "nut"};
  std::filesystem::remove_all(bench.folder() / "films");
  bench.write(std::string("films/a.") + kNames[data[0] % 4],
              {reinterpret_cast<const char*>(data) + 1, size - 1});
  const std::string out = (bench.folder() / "out").string();
  const int code = bench.run(cli::add_import, {"import", (bench.folder() / "films").string(), "--out", out,
                                               "--unsynchronised", "--partial"});
  if (code == 0 && !session::SessionReader::open(out)) std::abort();
  std::filesystem::remove_all(out + ".importing");
  return 0;
}

}  // namespace emberlock::test
