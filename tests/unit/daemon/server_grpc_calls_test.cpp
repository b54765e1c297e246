// SPDX-License-Identifier: Apache-2.0
// Calls over gRPC, from a real client to a real server: what is asked arrives, what is wrong is said, and
// nobody who stalls or goes holds the others up.
#include <atomic>
#include <chrono>
#include <future>

#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>

#include "tests/support/grpc_server.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using test::wait_until;
using testing::ElementsAre;
using testing::IsEmpty;

using ServerGrpcCalls = test::GrpcServerTest;

TEST_F(ServerGrpcCalls, CallsAreAskedOfTheApiAndAnsweredByIt) {
  api.on_record = test::recording_of_that_name;
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

TEST_F(ServerGrpcCalls, EachKindOfErrorHasItsCodeAndTheWholeMessage) {
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

TEST_F(ServerGrpcCalls, AStepReachesTheStylizationAndItsRefusalTheCaller) {
  api.on_edit_reconstruction = test::step_with_picture;
  serve();
  const auto reconstruct = v1::Reconstruct::NewStub(channel());
  v1::EditRequest request;
  request.set_operation("{}");
  v1::StylizationStatus answer;
  grpc::ClientContext first;
  const grpc::Status refused = reconstruct->Edit(&first, request, &answer);
  EXPECT_EQ(refused.error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_EQ(refused.error_message(), "step: picture: is missing");
  request.set_picture("voxels");
  grpc::ClientContext second;
  EXPECT_TRUE(reconstruct->Edit(&second, request, &answer).ok());
  EXPECT_EQ(answer.steps(), 3U);
  grpc::ClientContext third;
  v1::ReconstructionStatus finishing;
  EXPECT_TRUE(reconstruct->Finish(&third, {}, &finishing).ok());
  EXPECT_EQ(api.calls().back(), "finish_reconstruction");
}

TEST_F(ServerGrpcCalls, AFrameThatIsNotHeldIsNotFound) {
  api.on_reconstructed_frame = test::twelfth_frame;
  serve();
  const auto reconstruct = v1::Reconstruct::NewStub(channel());
  const auto ask = [&](std::uint64_t frame, v1::IterationPreview& answer) {
    v1::FrameRequest request;
    request.set_frame(frame);
    grpc::ClientContext context;
    return reconstruct->Frame(&context, request, &answer).error_code();
  };
  v1::IterationPreview answer;
  EXPECT_EQ(ask(12, answer), grpc::OK);
  EXPECT_EQ(answer.volume().voxels(), "voxels");
  EXPECT_EQ(ask(13, answer), grpc::NOT_FOUND);
}

TEST_F(ServerGrpcCalls, BeyondTheQueueCallsAreRefusedAndStatusIsStillAnswered) {
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

TEST_F(ServerGrpcCalls, AJobsLastProgressArrivesWhateverItOvertook) {
  api.on_job = test::job_that_tells(1000);
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Sessions::NewStub(channel())->Verify(&context, {});
  v1::Job job;
  while (reader->Read(&job)) continue;
  EXPECT_EQ(job.state(), v1::Job::DONE);
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(ServerGrpcCalls, AJobThatCannotBeginSaysWhy) {
  api.on_begin = Error{ErrorKind::bad_input, "no such session", "x"};
  serve();
  grpc::ClientContext context;
  const auto reader = v1::Sessions::NewStub(channel())->Export(&context, {});
  v1::Job job;
  EXPECT_FALSE(reader->Read(&job));
  EXPECT_EQ(reader->Finish().error_code(), grpc::INVALID_ARGUMENT);
}

TEST_F(ServerGrpcCalls, AJobEndsWhenItsClientGoesInMidStream) {
  test::EndlessJob endless;
  api.on_job = std::ref(endless);
  serve();
  {
    grpc::ClientContext context;
    const auto reader = v1::Sessions::NewStub(channel())->Repair(&context, {});
    v1::Job job;
    ASSERT_TRUE(reader->Read(&job));
    ASSERT_TRUE(wait_until([&] { return endless.begun(); }));
    context.TryCancel();
  }
  EXPECT_TRUE(wait_until([&] { return endless.ended(); }));
}

TEST_F(ServerGrpcCalls, AnOversizedRequestNeverReachesTheApi) {
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

TEST_F(ServerGrpcCalls, HealthFollowsTheEngine) {
  serve();
  EXPECT_EQ(health(channel()), kNotServing);
  show(v1::IDLE);
  EXPECT_EQ(health(channel()), kServing);
}

}  // namespace
}  // namespace emberlock::daemon
