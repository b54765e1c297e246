// SPDX-License-Identifier: Apache-2.0
// Streams over gRPC, from a real server to real clients: what changes is told, the newest alone, and nobody
// who vanishes or stalls costs the others anything.
#include <array>
#include <atomic>
#include <chrono>
#include <thread>

#include <poll.h>
#include <sys/socket.h>

#include "tests/support/grpc_server.h"
#include "tests/support/unix_socket.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using test::wait_until;

/// A line between one client and the server that can be cut without either hearing of it, as when a machine
/// loses its power.
class Line {
 public:
  Line(const std::filesystem::path& for_client, const std::filesystem::path& to_server)
      : listener_(test::unix_socket(for_client, ::bind)) {
    EXPECT_EQ(::listen(listener_.get(), 1), 0);
    thread_ = std::thread([this, to_server] { carry(to_server); });
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() {
    ending_ = true;
    thread_.join();
  }
  void cut() { cut_ = true; }

 private:
  void carry(const std::filesystem::path& to_server) {
    const UniqueFd client(::accept(listener_.get(), nullptr, nullptr));
    const UniqueFd server = test::unix_socket(to_server, ::connect);
    std::array<char, 65536> bytes{};
    while (!ending_) {
      std::array<pollfd, 2> ends{pollfd{client.get(), POLLIN, 0}, pollfd{server.get(), POLLIN, 0}};
      if (cut_ || ::poll(ends.data(), ends.size(), 10) <= 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      for (std::size_t i = 0; i < ends.size(); ++i) {
        if (ends[i].revents == 0) continue;
        const ssize_t got = ::read(ends[i].fd, bytes.data(), bytes.size());
        if (got <= 0) return;
        EXPECT_EQ(::send(ends[1 - i].fd, bytes.data(), static_cast<std::size_t>(got), MSG_NOSIGNAL), got);
      }
    }
  }
  UniqueFd listener_;
  std::atomic<bool> cut_ = false;
  std::atomic<bool> ending_ = false;
  std::thread thread_;
};
using ServerGrpcWatch = test::GrpcServerTest;

TEST_F(ServerGrpcWatch, StatusIsToldNowAndAfterChangesTheNewestAlone) {
  show(v1::IDLE);
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Daemon::NewStub(channel())->WatchStatus(&context, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(reader->Read(&status));
  EXPECT_EQ(status.phase(), v1::IDLE);
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) show(v1::ALIGNING);
  show(v1::LOCKED);
  int told = 0;
  while (status.phase() != v1::LOCKED && reader->Read(&status)) ++told;
  EXPECT_EQ(status.revision(), 102U);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  EXPECT_LE(told, 2 + 10 * seconds.count()) << "ten a second at most";
}

TEST_F(ServerGrpcWatch, TheHistoryOfRoundsIsForWhoAsksForTheStatus) {
  v1::DaemonStatus shown;
  shown.mutable_alignment()->set_round(7);
  shown.mutable_alignment()->add_history()->set_round(7);
  api.board().show(shown);
  serve();
  const auto daemon = v1::Daemon::NewStub(channel());
  grpc::ClientContext watching;
  v1::DaemonStatus status;
  ASSERT_TRUE(daemon->WatchStatus(&watching, {})->Read(&status));
  EXPECT_EQ(status.alignment().round(), 7U);
  EXPECT_EQ(status.alignment().history_size(), 0);
  grpc::ClientContext asking;
  ASSERT_TRUE(daemon->GetStatus(&asking, {}, &status).ok());
  EXPECT_EQ(status.alignment().history_size(), 1);
}

TEST_F(ServerGrpcWatch, EveryNoticeIsToldOnceInOrder) {
  for (int i = 1; i <= 20; ++i) api.board().notice(v1::GREEN, std::to_string(i));
  serve();
  grpc::ClientContext context;
  v1::WatchNoticesRequest request;
  request.set_after(5);
  const auto reader = v1::Daemon::NewStub(channel())->WatchNotices(&context, request);
  v1::Notice notice;
  for (std::uint64_t id = 6; id <= 20; ++id) {
    ASSERT_TRUE(reader->Read(&notice));
    EXPECT_EQ(notice.id(), id);
  }
  api.board().notice(v1::RED, "Now.");
  ASSERT_TRUE(reader->Read(&notice));
  EXPECT_EQ(notice.text(), "Now.");
}

TEST_F(ServerGrpcWatch, PicturesAreMadeWhileAClientWatchesAndNoLonger) {
  serve();
  EXPECT_FALSE(api.board().pictures_wanted());
  {
    grpc::ClientContext context;
    const auto reader = v1::Capture::NewStub(channel())->WatchPictures(&context, {});
    ASSERT_TRUE(wait_until([&] { return api.board().pictures_wanted(); }));
    auto picture = std::make_shared<v1::Picture>();
    picture->set_camera_id("a");
    picture->set_jpeg(std::string(30000, 'j'));
    api.board().show(picture);
    v1::Picture shown;
    ASSERT_TRUE(reader->Read(&shown));
    EXPECT_EQ(shown.jpeg().size(), 30000U);
    context.TryCancel();
  }
  EXPECT_TRUE(wait_until([&] { return !api.board().pictures_wanted() && server->watchers() == 0; }));
}

TEST_F(ServerGrpcWatch, ALateWatcherOfAReconstructionGetsEveryIteration) {
  serve();
  for (unsigned i = 1; i <= 3; ++i) {
    auto preview = std::make_shared<v1::IterationPreview>();
    preview->set_reconstruction("r");
    preview->mutable_iteration()->set_iteration(i);
    preview->set_captured_jpeg("jpeg");
    api.board().show(preview);
  }
  grpc::ClientContext context;
  const auto reader = v1::Reconstruct::NewStub(channel())->Watch(&context, {});
  v1::IterationPreview preview;
  for (unsigned i = 1; i <= 3; ++i) {
    ASSERT_TRUE(reader->Read(&preview));
    EXPECT_EQ(preview.iteration().iteration(), i);
    EXPECT_EQ(preview.captured_jpeg(), i == 3 ? "jpeg" : "");
  }
}

TEST_F(ServerGrpcWatch, TheServerGoesWhileClientsWatchAndJobsRun) {
  test::EndlessJob endless;
  api.on_job = std::ref(endless);
  show(v1::IDLE);
  serve();
  grpc::ClientContext watching;
  const auto watcher = v1::Daemon::NewStub(channel())->WatchStatus(&watching, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(watcher->Read(&status));
  grpc::ClientContext repairing;
  const auto job = v1::Sessions::NewStub(channel())->Repair(&repairing, {});
  v1::Job progress;
  ASSERT_TRUE(job->Read(&progress));
  ASSERT_TRUE(wait_until([&] { return endless.begun(); }));
  server.reset();
  EXPECT_FALSE(watcher->Read(&status));
  while (job->Read(&progress)) continue;
  EXPECT_FALSE(std::filesystem::exists(socket));
  EXPECT_TRUE(wait_until([&] { return endless.ended(); }));
}

TEST_F(ServerGrpcWatch, AWatcherThatNeverReadsHoldsNobodyUp) {
  serve();
  grpc::ClientContext stalled_context;
  const auto stalled = v1::Capture::NewStub(channel())->WatchPictures(&stalled_context, {});
  grpc::ClientContext context;
  v1::WatchPicturesRequest request;
  request.set_rate_hz(1000);
  const auto reader = v1::Capture::NewStub(channel())->WatchPictures(&context, request);
  ASSERT_TRUE(wait_until([&] { return server->watchers() == 2; }));
  v1::Picture shown;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    auto picture = std::make_shared<v1::Picture>();
    picture->set_camera_id("a");
    picture->set_frame_id(i);
    picture->set_jpeg(std::string(100'000, 'j'));
    api.board().show(picture);
    ASSERT_TRUE(reader->Read(&shown));
    EXPECT_EQ(shown.frame_id(), i);
  }
}

TEST_F(ServerGrpcWatch, AClientWhoseMachineLostItsPowerIsGoneSoonAfter) {
  show(v1::IDLE);
  serve({.socket = socket, .keepalive = milliseconds(200)});
  Line line(folder / "line.sock", socket);
  const auto channel =
      grpc::CreateChannel("unix:" + (folder / "line.sock").string(), grpc::InsecureChannelCredentials());
  grpc::ClientContext context;
  const auto reader = v1::Daemon::NewStub(channel)->WatchStatus(&context, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(reader->Read(&status)) << "it watches";
  line.cut();
  show(v1::ALIGNING);  // a write that nobody will ever take
  EXPECT_TRUE(wait_until([&] { return server->watchers() == 0; }));
  context.TryCancel();
}

TEST_F(ServerGrpcWatch, TooManyWatchersAreRefused) {
  show(v1::IDLE);
  serve({.socket = socket, .watchers = 1});
  const auto daemon = v1::Daemon::NewStub(channel());
  grpc::ClientContext first_context;
  const auto first = daemon->WatchStatus(&first_context, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(first->Read(&status));
  grpc::ClientContext second_context;
  const auto second = daemon->WatchStatus(&second_context, {});
  EXPECT_FALSE(second->Read(&status));
  EXPECT_EQ(second->Finish().error_code(), grpc::RESOURCE_EXHAUSTED);
}

}  // namespace
}  // namespace emberlock::daemon
