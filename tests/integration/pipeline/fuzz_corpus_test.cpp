// SPDX-License-Identifier: Apache-2.0
// The corpora of the fuzz targets that are whole verbs, without libFuzzer: what they find must not come back.
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/file.h"
#include "tests/support/fuzz_verbs.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;

using Target = int (*)(const std::uint8_t*, std::size_t);

void run_on(Target target, const std::string& bytes) {
  target(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

/// Each file as it is, cut short, and with a few of its bytes changed; EMBERLOCK_FUZZ_CHANGES times as often.
void run_over(const char* corpus, Target target, int changes) {
  const char* more = std::getenv("EMBERLOCK_FUZZ_CHANGES");
  changes *= more != nullptr ? std::atoi(more) : 1;
  std::mt19937 random(1);
  int files = 0;
  for (const auto& entry :
       fs::directory_iterator(fs::path(EMBERLOCK_SOURCE_DIR) / "tests/fuzz/corpus" / corpus)) {
    SCOPED_TRACE(entry.path().string());
    const std::string bytes = *read_file(entry.path());
    run_on(target, bytes);
    run_on(target, bytes.substr(0, bytes.size() / 2));
    for (int i = 0; i < changes; ++i) {
      std::string changed = bytes;
      for (int n = 0; n < 3; ++n)
        changed[random() % changed.size()] = "0123456789-.eE[]{}\",:\n <>"[random() % 24];
      run_on(target, changed);
    }
    ++files;
  }
  EXPECT_GE(files, 3);
}

TEST(FuzzCorpus, Reconstruct) { run_over("verb_reconstruct", test::fuzz_reconstruct, 10); }
TEST(FuzzCorpus, CalibrateConvert) { run_over("verb_calibrate_convert", test::fuzz_calibrate_convert, 50); }
TEST(FuzzCorpus, Import) { run_over("verb_import", test::fuzz_import, 10); }

}  // namespace
}  // namespace emberlock
