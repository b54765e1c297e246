// SPDX-License-Identifier: Apache-2.0
#include "session/sync_ledger.h"

#include <cerrno>
#include <functional>
#include <set>
#include <utility>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using ::testing::Contains;

/// A disk that refuses once, as the kernel tells of it: the next flush of the same file succeeds.
struct Disk {
  static inline std::set<ino_t> refuses;
  static inline std::set<ino_t> flushed;
  static inline std::function<void()> meanwhile;  ///< a refused flush takes its time
  static ino_t inode(int descriptor) {
    struct stat info {};
    EXPECT_EQ(::fstat(descriptor, &info), 0);
    return info.st_ino;
  }
  static int flush(int descriptor) {
    const ino_t file = inode(descriptor);
    if (refuses.erase(file) > 0) {
      if (meanwhile) std::exchange(meanwhile, nullptr)();
      errno = EIO;
      return -1;
    }
    flushed.insert(file);
    return 0;
  }
};

class SyncLedgerThreads : public ::testing::Test {
 protected:
  SyncLedgerThreads()
      : ledger_(create("index.bin"), temp_ / "index.bin", {temp_ / "."}, &Disk::flush),
        segment_(create("a.nut")) {
    Disk::refuses.clear();
    Disk::flushed.clear();
    EXPECT_TRUE(ledger_.begun(segment_.get(), temp_ / "a.nut").ok());
  }
  [[nodiscard]] UniqueFd create(const std::string& name) const {
    return UniqueFd(::open((temp_ / name).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  }
  void refuse_the_segment() const { Disk::refuses.insert(Disk::inode(segment_.get())); }

  test::TempFolder temp_;
  SyncLedger ledger_;
  UniqueFd segment_;
};

TEST_F(SyncLedgerThreads, WhatWasHandedOnIsSafeAfterASync) {
  ledger_.handed(5);
  EXPECT_EQ(ledger_.safe(), 0);
  ASSERT_TRUE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 5);
}

TEST_F(SyncLedgerThreads, FramesThatACutLeavesAreSafeOnlyWhenTheirSegmentIsOnTheDisk) {
  ledger_.handed(5);
  ASSERT_TRUE(ledger_.sync().ok());
  ledger_.handed(9);
  ledger_.cut(8);  // the write of the ninth failed
  EXPECT_EQ(ledger_.safe(), 5);
  Disk::flushed.clear();
  ASSERT_TRUE(ledger_.sync().ok());
  EXPECT_THAT(Disk::flushed, Contains(Disk::inode(segment_.get())));
  EXPECT_EQ(ledger_.safe(), 8);
  EXPECT_EQ(ledger_.waiting(), 0);
}

TEST_F(SyncLedgerThreads, FramesThatACutLeavesArentSafeWhereTheDiskRefusesThem) {
  ledger_.handed(9);
  ledger_.cut(8);
  refuse_the_segment();
  EXPECT_FALSE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 0);
}

TEST_F(SyncLedgerThreads, ASecondTryAfterAFailedSyncProvesNothing) {
  ledger_.handed(5);
  ASSERT_TRUE(ledger_.sync().ok());
  ledger_.handed(9);
  refuse_the_segment();
  EXPECT_FALSE(ledger_.sync().ok());
  EXPECT_FALSE(ledger_.sync().ok()) << "the kernel would say now that all is well";
  EXPECT_FALSE(ledger_.failure().ok());
  EXPECT_FALSE(ledger_.failure().ok()) << "to ask doesn't forget it";
  EXPECT_EQ(ledger_.safe(), 5);
  ledger_.cut(7);  // more than is safe
  EXPECT_FALSE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 5);
  ledger_.cut(5);
  EXPECT_TRUE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 5);
  EXPECT_EQ(ledger_.handed(), 5);
}

TEST_F(SyncLedgerThreads, TheErrorOfASegmentThatWasCutOffMeanwhileIsForgotten) {
  ledger_.handed(5);
  refuse_the_segment();
  const UniqueFd next = create("b.nut");
  Disk::meanwhile = [&] {
    ledger_.cut(0);
    EXPECT_TRUE(ledger_.begun(next.get(), temp_ / "b.nut").ok());
    ledger_.handed(2);
  };
  EXPECT_TRUE(ledger_.sync().ok());
  EXPECT_TRUE(ledger_.failure().ok());
  EXPECT_TRUE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 2);
}

TEST_F(SyncLedgerThreads, AnIndexThatTheDiskRefusesMakesNothingSafe) {
  ledger_.handed(5);
  Disk::refuses.insert([&] {
    struct stat info {};
    EXPECT_EQ(::stat((temp_ / "index.bin").c_str(), &info), 0);
    return info.st_ino;
  }());
  EXPECT_FALSE(ledger_.sync().ok());
  EXPECT_EQ(ledger_.safe(), 0);
}

}  // namespace
}  // namespace emberlock::session
