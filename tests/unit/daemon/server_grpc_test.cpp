// gRPC between a real client and a real server, on a socket: what is asked arrives, what changes is told, and
// nobody who vanishes, stalls or has no business here costs the others anything.
#include <array>
#include <atomic>
#include <chrono>
#include <fstream>
#include <future>
#include <thread>

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "daemon/server/grpc_server.h"
#include "emberlock/v1/services.grpc.pb.h"
#include "tests/support/certificate.h"
#include "tests/support/fake_api.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

using test::FakeApi;
using test::wait_until;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A socket that `join`, ::bind or ::connect, ties to a path.
template <class Join>
UniqueFd unix_socket(const std::filesystem::path& path, Join join) {
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.native().copy(address.sun_path, sizeof(address.sun_path) - 1);
  EXPECT_EQ(join(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  return fd;
}

/// A line between one client and the server that can be cut without either hearing of it, as when a machine
/// loses its power.
class Line {
 public:
  Line(const std::filesystem::path& for_client, const std::filesystem::path& to_server)
      : listener_(unix_socket(for_client, ::bind)) {
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
    const UniqueFd server = unix_socket(to_server, ::connect);
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

class ServerGrpcTest : public testing::Test {
 protected:
  void serve(GrpcServerOptions options = {}) {
    if (options.socket.empty() && options.tcp_address.empty()) options.socket = socket;
    auto started = GrpcServer::start(api, std::move(options));
    ASSERT_TRUE(started.ok()) << started.error().message();
    server = std::move(started).value();
  }
  std::shared_ptr<grpc::Channel> channel() const {
    return grpc::CreateChannel("unix:" + socket.string(), grpc::InsecureChannelCredentials());
  }

  void show(v1::Phase phase) {
    v1::DaemonStatus status;
    status.set_phase(phase);
    api.board().show(status);
  }

  test::TempFolder folder;
  std::filesystem::path socket = folder / "emberlockd.sock";
  FakeApi api;
  std::unique_ptr<GrpcServer> server;
};

TEST_F(ServerGrpcTest, CallsAreAskedOfTheApiAndAnsweredByIt) {
  api.on_record = [](const v1::RecordRequest& request) {
    v1::RecordingStatus status;
    status.set_session(request.name());
    return status;
  };
  serve();
  const auto capture = v1::Capture::NewStub(channel());
  v1::RecordRequest request;
  request.set_name("flame 1");
  v1::RecordingStatus answer;
  grpc::ClientContext context;
  EXPECT_TRUE(capture->Record(&context, request, &answer).ok());
  EXPECT_EQ(answer.session(), "flame 1");
  EXPECT_THAT(api.calls(), ElementsAre("record name: \"flame 1\""));
}

TEST_F(ServerGrpcTest, EachKindOfErrorHasItsCodeAndTheWholeMessage) {
  struct Case {
    ErrorKind kind;
    grpc::StatusCode code;
  };
  ErrorKind kind{};
  api.on_stop_sync = [&kind] { return Error{kind, "nothing is aligned", "sync", "align first"}; };
  serve();
  const auto sync = v1::Sync::NewStub(channel());
  for (const Case& c :
       {Case{ErrorKind::bad_input, grpc::INVALID_ARGUMENT}, Case{ErrorKind::io, grpc::INTERNAL},
        Case{ErrorKind::device, grpc::UNAVAILABLE}, Case{ErrorKind::out_of_data, grpc::OUT_OF_RANGE},
        Case{ErrorKind::timed_out, grpc::DEADLINE_EXCEEDED},
        Case{ErrorKind::refused, grpc::FAILED_PRECONDITION}}) {
    kind = c.kind;
    grpc::ClientContext context;
    v1::Empty answer;
    const grpc::Status status = sync->Stop(&context, {}, &answer);
    EXPECT_EQ(status.error_code(), c.code);
    EXPECT_EQ(status.error_message(), "sync: nothing is aligned. Align first");
  }
}

TEST_F(ServerGrpcTest, BeyondTheQueueCallsAreRefusedAndStatusIsStillAnswered) {
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  std::atomic<int> running = 0;
  api.on_stop_sync = [&] {
    ++running;
    gone.wait();
    return Status();
  };
  serve({.socket = socket, .workers = 1, .waiting = 1});
  const auto sync = v1::Sync::NewStub(channel());
  const auto stop = [&] {
    grpc::ClientContext context;
    v1::Empty answer;
    return sync->Stop(&context, {}, &answer).error_code();
  };
  auto first = std::async(std::launch::async, stop);
  ASSERT_TRUE(wait_until([&] { return running == 1; }));
  auto others = {std::async(std::launch::async, stop), std::async(std::launch::async, stop)};
  // One of the two waits, the other was refused.
  ASSERT_TRUE(wait_until([&] {
    return std::any_of(others.begin(), others.end(), [](const auto& call) {
      return call.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
  }));
  EXPECT_EQ(stop(), grpc::RESOURCE_EXHAUSTED);
  v1::DaemonStatus status;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::Daemon::NewStub(channel())->GetStatus(&context, {}, &status).ok());
  go.set_value();
  EXPECT_EQ(first.get(), grpc::OK);
}

TEST_F(ServerGrpcTest, StatusIsToldNowAndAfterChangesTheNewestAlone) {
  show(v1::IDLE);
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Daemon::NewStub(channel())->WatchStatus(&context, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(reader->Read(&status));
  EXPECT_EQ(status.phase(), v1::IDLE);
  for (int i = 0; i < 100; ++i) show(v1::ALIGNING);
  show(v1::LOCKED);
  int told = 0;
  while (status.phase() != v1::LOCKED && reader->Read(&status)) ++told;
  EXPECT_EQ(status.revision(), 102U);
  EXPECT_LE(told, 5);  // ten a second at most, however slow the machine made these 101
}

TEST_F(ServerGrpcTest, EveryNoticeIsToldOnceInOrder) {
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
  api.board().notice(v1::RED, "now");
  ASSERT_TRUE(reader->Read(&notice));
  EXPECT_EQ(notice.text(), "now");
}

TEST_F(ServerGrpcTest, PicturesAreMadeWhileAClientWatchesAndNoLonger) {
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

TEST_F(ServerGrpcTest, ALateWatcherOfAReconstructionGetsEveryIteration) {
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

TEST_F(ServerGrpcTest, AJobsLastProgressArrivesWhateverItOvertook) {
  api.on_job = [](const JobObserver& observer) {
    v1::JobProgress progress;
    for (int i = 0; i < 1000; ++i) observer(progress);
    progress.set_done(true);
    progress.set_report("{}");
    observer(progress);
    return Status();
  };
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Sessions::NewStub(channel())->Verify(&context, {});
  v1::JobProgress progress;
  while (reader->Read(&progress)) continue;
  EXPECT_TRUE(progress.done());
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(ServerGrpcTest, AJobThatCannotBeginSaysWhy) {
  api.on_job = [](const JobObserver&) { return Error{ErrorKind::bad_input, "no such session", "x"}; };
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Sessions::NewStub(channel())->Export(&context, {});
  v1::JobProgress progress;
  EXPECT_FALSE(reader->Read(&progress));
  EXPECT_EQ(reader->Finish().error_code(), grpc::INVALID_ARGUMENT);
}

TEST_F(ServerGrpcTest, AJobEndsWhenItsClientGoesInMidStream) {
  std::atomic<bool> ended = false;
  api.on_job = [&](const JobObserver& observer) {
    while (observer({})) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ended = true;
    return Status();
  };
  serve();
  {
    grpc::ClientContext context;
    const auto reader = v1::Sessions::NewStub(channel())->Repair(&context, {});
    v1::JobProgress progress;
    ASSERT_TRUE(reader->Read(&progress));
    context.TryCancel();
  }
  EXPECT_TRUE(wait_until([&] { return ended.load(); }));
}

TEST_F(ServerGrpcTest, TheServerGoesWhileClientsWatchAndJobsRun) {
  api.on_job = [](const JobObserver& observer) {
    while (observer({})) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Status();
  };
  show(v1::IDLE);
  serve();
  grpc::ClientContext watching;
  const auto watcher = v1::Daemon::NewStub(channel())->WatchStatus(&watching, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(watcher->Read(&status));
  grpc::ClientContext repairing;
  const auto job = v1::Sessions::NewStub(channel())->Repair(&repairing, {});
  v1::JobProgress progress;
  ASSERT_TRUE(job->Read(&progress));
  server.reset();
  EXPECT_FALSE(watcher->Read(&status));
  while (job->Read(&progress)) continue;
  EXPECT_FALSE(std::filesystem::exists(socket));
}

TEST_F(ServerGrpcTest, AWatcherThatNeverReadsHoldsNobodyUp) {
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

TEST_F(ServerGrpcTest, AClientWhoseMachineLostItsPowerIsGoneSoonAfter) {
  show(v1::IDLE);
  serve({.socket = socket, .keepalive = milliseconds(200)});
  Line line(folder / "line.sock", socket);
  const auto channel =
      grpc::CreateChannel("unix:" + (folder / "line.sock").string(), grpc::InsecureChannelCredentials());
  grpc::ClientContext context;
  const auto reader = v1::Daemon::NewStub(channel)->WatchStatus(&context, {});
  v1::DaemonStatus status;
  ASSERT_TRUE(reader->Read(&status));
  ASSERT_EQ(server->watchers(), 1U);
  line.cut();
  show(v1::ALIGNING);  // a write that nobody will ever take
  EXPECT_TRUE(wait_until([&] { return server->watchers() == 0; }));
  context.TryCancel();
}

TEST_F(ServerGrpcTest, TooManyWatchersAreRefused) {
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

TEST_F(ServerGrpcTest, AnOversizedRequestNeverReachesTheApi) {
  serve({.socket = socket, .largest_request = 1000});
  v1::RecordRequest request;
  request.set_name(std::string(1001, 'n'));
  v1::RecordingStatus answer;
  grpc::ClientContext context;
  EXPECT_EQ(v1::Capture::NewStub(channel())->Record(&context, request, &answer).error_code(),
            grpc::RESOURCE_EXHAUSTED);
  EXPECT_THAT(api.calls(), IsEmpty());
}

// grpc.health.v1.HealthCheckResponse, whose generated code Debian doesn't ship: field 1 is the status.
const std::string kServing = "\x08\x01";
const std::string kNotServing = "\x08\x02";

std::string health(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  const grpc::Slice empty;
  const grpc::ByteBuffer nothing(&empty, 1);
  grpc::ByteBuffer answer;
  std::promise<void> done;
  stub.UnaryCall(&context, "/grpc.health.v1.Health/Check", {}, &nothing, &answer,
                 [&](const grpc::Status& /*status*/) { done.set_value(); });
  done.get_future().wait();
  grpc::Slice bytes;
  return answer.TrySingleSlice(&bytes).ok() ? std::string(bytes.begin(), bytes.end()) : std::string();
}

TEST_F(ServerGrpcTest, HealthFollowsTheEngine) {
  serve();
  EXPECT_EQ(health(channel()), kNotServing);
  show(v1::IDLE);
  EXPECT_EQ(health(channel()), kServing);
}

TEST_F(ServerGrpcTest, ASecondDaemonIsToldWhoHasTheSocketAndTheFirstGoesOn) {
  serve();
  FakeApi other;
  const auto second = GrpcServer::start(other, {.socket = socket});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().message(), HasSubstr("pid " + std::to_string(::getpid())));
  v1::DaemonStatus status;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::Daemon::NewStub(channel())->GetStatus(&context, {}, &status).ok());
}

TEST_F(ServerGrpcTest, ASocketThatAKilledDaemonLeftBehindIsReplaced) {
  // What SIGKILL leaves: the socket and the file that was locked.
  { const UniqueFd left = unix_socket(socket, ::bind); }
  std::ofstream(socket.string() + ".lock") << "12345678";
  show(v1::LOCKED);
  serve();
  v1::DaemonStatus status;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::Daemon::NewStub(channel())->GetStatus(&context, {}, &status).ok());
  EXPECT_EQ(status.phase(), v1::LOCKED);
}

TEST_F(ServerGrpcTest, AFileInTheSocketsPlaceIsLeftAlone) {
  std::ofstream(socket) << "precious";
  const auto started = GrpcServer::start(api, {.socket = socket});
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("no socket"));
  EXPECT_TRUE(std::filesystem::exists(socket));
}

TEST_F(ServerGrpcTest, TheSocketIsForItsGroupAlone) {
  serve();
  struct stat status {};
  ASSERT_EQ(::stat(socket.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660U);
}

TEST_F(ServerGrpcTest, OverTcpWithoutTlsItRefusesToStart) {
  const auto token = Token::parse("0123456789abcdef");
  ASSERT_TRUE(token.ok());
  const auto started = GrpcServer::start(api, {.tcp_address = "127.0.0.1:0", .token = *token});
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("only TLS is spoken"));
}

/// With a certificate of its own, on a port of its own.
class ServerGrpcTlsTest : public ServerGrpcTest {
 protected:
  void SetUp() override {
    test::make_certificate(folder / "cert.pem", folder / "key.pem");
    const auto tls = TlsIdentity::read(folder / "cert.pem", folder / "key.pem");
    ASSERT_TRUE(tls.ok()) << tls.error().message();
    options.tcp_address = "127.0.0.1:0";
    options.tls = *tls;
  }
  grpc::Status ask(const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                   const std::string& authorization) {
    grpc::ClientContext context;
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
    v1::DaemonStatus status;
    return v1::Daemon::NewStub(
               grpc::CreateChannel("localhost:" + std::to_string(server->tcp_port()), credentials))
        ->GetStatus(&context, {}, &status);
  }
  std::shared_ptr<grpc::ChannelCredentials> trusting() const {
    grpc::SslCredentialsOptions ssl;
    ssl.pem_root_certs = options.tls->certificate;
    return grpc::SslCredentials(ssl);
  }
  GrpcServerOptions options;
};

TEST_F(ServerGrpcTlsTest, WithoutATokenItRefusesToStart) {
  const auto started = GrpcServer::start(api, options);
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("--make-token"));
}

TEST_F(ServerGrpcTlsTest, TheRightTokenIsLetInAndNoOther) {
  options.token = *Token::parse("0123456789abcdef");
  serve(options);
  EXPECT_TRUE(ask(trusting(), "Bearer 0123456789abcdef").ok());
  for (const char* wrong :
       {"", "Bearer 0123456789abcdeF", "Bearer ", "0123456789abcdef", "Bearer 0123456789abcdef0"})
    EXPECT_EQ(ask(trusting(), wrong).error_code(), grpc::UNAUTHENTICATED) << wrong;
  EXPECT_EQ(ask(grpc::InsecureChannelCredentials(), "Bearer 0123456789abcdef").error_code(),
            grpc::UNAVAILABLE);
}

TEST_F(ServerGrpcTlsTest, ATakenPortIsAnErrorAndNotShared) {
  options.token = *Token::parse("0123456789abcdef");
  serve(options);
  options.tcp_address = "127.0.0.1:" + std::to_string(server->tcp_port());
  EXPECT_FALSE(GrpcServer::start(api, options).ok());
}

}  // namespace
}  // namespace emberlock
