// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/grpc_services.h"

#include <memory>
#include <type_traits>
#include <utility>

#include "base/clock.h"
#include "emberlock/v1/services.grpc.pb.h"

namespace emberlock::daemon {
namespace {

using Context = grpc::CallbackServerContext;

grpc::Status too_many(const char* what) {
  return {grpc::StatusCode::RESOURCE_EXHAUSTED,
          std::string("emberlockd: ") + what + ". Try again in a moment"};
}

grpc::Status put(Result<void> result, v1::Empty* /*response*/) { return grpc_status(result); }
template <class Response>
grpc::Status put(Result<Response> result, Response* response) {
  if (!result) return grpc_status(result.error());
  *response = std::move(*result);
  return grpc::Status::OK;
}

template <class Response>
grpc::Status put(const std::shared_ptr<const Response>& found, Response* response) {
  if (!found) return {grpc::StatusCode::NOT_FOUND, kNotFound};
  *response = *found;
  return grpc::Status::OK;
}

/// Runs the call on a worker thread. gRPC keeps request and response until the call is finished.
template <class Response, class Ask>
grpc::ServerUnaryReactor* answer(const GrpcBackend& backend, Context* context, Response* response, Ask ask) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const bool queued = backend.workers.run(
      [ask = std::move(ask), reactor, response] { reactor->Finish(put(ask(), response)); });
  if (!queued) reactor->Finish(too_many("too many calls are waiting"));
  return reactor;
}

template <class Message, class Feed>
grpc::ServerWriteReactor<Message>* watch(const GrpcBackend& backend, Feed feed) {
  auto* stream = new WatchStream<Message, Feed>(backend.pump, std::move(feed));  // deletes itself when done
  if (!backend.pump.add(stream)) stream->Finish(too_many("too many watchers"));
  return stream;
}

template <class Request>
grpc::ServerWriteReactor<v1::Job>* start_job(const GrpcBackend& backend, const Request& request,
                                             Result<std::shared_ptr<JobHandle>> (Api::*ask)(const Request&)) {
  const auto job = std::make_shared<JobWatch>([&pump = backend.pump] { pump.wake(); });
  auto* stream = new JobStream(backend.pump, job);  // deletes itself when it is done
  const bool queued =
      backend.workers.run([job, request, ask, &api = backend.api] { job->begin((api.*ask)(request)); });
  if (!queued)
    stream->Finish(too_many("too many calls are waiting"));
  else if (!backend.pump.add(stream))
    stream->Finish(too_many("too many watchers"));
  return stream;
}

/// Skips the history: a client that wants it asks for the status.
class BriefStatusFeed {
 public:
  explicit BriefStatusFeed(const Board& board) : whole_(board) {}
  Next<v1::DaemonStatus> next(TimePoint now) {
    auto next = whole_.next(now);
    if (next.message) next.message = std::make_shared<const v1::DaemonStatus>(without_history(*next.message));
    return next;
  }

 private:
  StatusFeed whole_;
};

class DaemonService final : public v1::Daemon::CallbackService {
 public:
  explicit DaemonService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* GetStatus(Context* context, const v1::Empty* /*request*/,
                                      v1::DaemonStatus* response) override {
    *response = *backend_.api.board().status();
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }
  grpc::ServerWriteReactor<v1::DaemonStatus>* WatchStatus(Context* /*context*/,
                                                          const v1::Empty* /*request*/) override {
    return watch<v1::DaemonStatus>(backend_, BriefStatusFeed(backend_.api.board()));
  }
  grpc::ServerWriteReactor<v1::Notice>* WatchNotices(Context* /*context*/,
                                                     const v1::WatchNoticesRequest* request) override {
    return watch<v1::Notice>(backend_, NoticeFeed(backend_.api.board(), request->after()));
  }
  grpc::ServerUnaryReactor* Acknowledge(Context* context, const v1::AcknowledgeRequest* request,
                                        v1::Empty* response) override {
    return answer(backend_, context, response,
                  [this, request] { return backend_.api.acknowledge(*request); });
  }
  /// Only over the socket, with its folder's access control, because anyone can use a link.
  grpc::ServerUnaryReactor* OpenConsole(Context* context, const v1::Empty* /*request*/,
                                        v1::ConsoleLink* response) override {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    if (context->peer().rfind("unix:", 0) != 0) {
      reactor->Finish({grpc::StatusCode::PERMISSION_DENIED,
                       "emberlockd: links are given over the Unix socket alone. From elsewhere open "
                       "http_listen's address in a browser, and give the token there"});
      return reactor;
    }
    const auto url = backend_.sessions.make_link(SteadyClock().now());
    if (url) {
      response->set_url(*url);
      response->set_valid_s(ConsoleSessions::kLinkLife.value());
    }
    reactor->Finish(url ? grpc::Status::OK : grpc_status(url.error()));
    return reactor;
  }

 private:
  GrpcBackend backend_;
};

class DevicesService final : public v1::Devices::CallbackService {
 public:
  explicit DevicesService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* List(Context* context, const v1::Empty* /*request*/,
                                 v1::ListDevicesResponse* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.list_devices(); });
  }

 private:
  GrpcBackend backend_;
};

class StrobeService final : public v1::Strobe::CallbackService {
 public:
  explicit StrobeService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Get(Context* context, const v1::Empty* /*request*/,
                                v1::StrobeState* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.strobe(); });
  }
  grpc::ServerUnaryReactor* Apply(Context* context, const v1::StrobeState* request,
                                  v1::StrobeState* response) override {
    return answer(backend_, context, response,
                  [this, request] { return backend_.api.apply_strobe(*request); });
  }

 private:
  GrpcBackend backend_;
};

class SyncService final : public v1::Sync::CallbackService {
 public:
  explicit SyncService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Align(Context* context, const v1::AlignRequest* request,
                                  v1::Empty* response) override {
    return answer(backend_, context, response, [this, request] { return backend_.api.align(*request); });
  }
  grpc::ServerUnaryReactor* Stop(Context* context, const v1::Empty* /*request*/,
                                 v1::Empty* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.stop_sync(); });
  }

 private:
  GrpcBackend backend_;
};

class CaptureService final : public v1::Capture::CallbackService {
 public:
  explicit CaptureService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Record(Context* context, const v1::RecordRequest* request,
                                   v1::RecordingStatus* response) override {
    return answer(backend_, context, response, [this, request] { return backend_.api.record(*request); });
  }
  grpc::ServerUnaryReactor* Stop(Context* context, const v1::Empty* /*request*/,
                                 v1::RecordingStatus* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.stop_recording(); });
  }
  grpc::ServerWriteReactor<v1::Picture>* WatchPictures(Context* /*context*/,
                                                       const v1::WatchPicturesRequest* request) override {
    return watch<v1::Picture>(backend_, PictureFeed(backend_.api.board(), *request));
  }

 private:
  GrpcBackend backend_;
};

class SessionsService final : public v1::Sessions::CallbackService {
 public:
  explicit SessionsService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* List(Context* context, const v1::Empty* /*request*/,
                                 v1::ListSessionsResponse* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.list_sessions(); });
  }
  grpc::ServerUnaryReactor* Get(Context* context, const v1::SessionRequest* request,
                                v1::Manifest* response) override {
    return answer(backend_, context, response, [this, request] { return backend_.api.session(*request); });
  }
  grpc::ServerWriteReactor<v1::Job>* Verify(Context* /*context*/,
                                            const v1::SessionRequest* request) override {
    return start_job(backend_, *request, &Api::verify_session);
  }
  grpc::ServerWriteReactor<v1::Job>* Repair(Context* /*context*/,
                                            const v1::SessionRequest* request) override {
    return start_job(backend_, *request, &Api::repair_session);
  }
  grpc::ServerWriteReactor<v1::Job>* Export(Context* /*context*/, const v1::ExportRequest* request) override {
    return start_job(backend_, *request, &Api::export_session);
  }

 private:
  GrpcBackend backend_;
};

class JobsService final : public v1::Jobs::CallbackService {
 public:
  explicit JobsService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Cancel(Context* context, const v1::CancelJobRequest* request,
                                   v1::Empty* response) override {
    return answer(backend_, context, response, [this, request] { return backend_.api.cancel_job(*request); });
  }

 private:
  GrpcBackend backend_;
};

class ReconstructService final : public v1::Reconstruct::CallbackService {
 public:
  explicit ReconstructService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Start(Context* context, const v1::ReconstructRequest* request,
                                  v1::ReconstructionStatus* response) override {
    return answer(backend_, context, response,
                  [this, request] { return backend_.api.reconstruct(*request); });
  }
  grpc::ServerUnaryReactor* Cancel(Context* context, const v1::Empty* /*request*/,
                                   v1::ReconstructionStatus* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.cancel_reconstruction(); });
  }
  grpc::ServerUnaryReactor* Edit(Context* context, const v1::EditRequest* request,
                                 v1::StylizationStatus* response) override {
    return answer(backend_, context, response,
                  [this, request] { return backend_.api.edit_reconstruction(*request); });
  }
  grpc::ServerUnaryReactor* Finish(Context* context, const v1::Empty* /*request*/,
                                   v1::ReconstructionStatus* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.finish_reconstruction(); });
  }
  grpc::ServerUnaryReactor* Frame(Context* context, const v1::FrameRequest* request,
                                  v1::IterationPreview* response) override {
    return answer(backend_, context, response,
                  [this, request] { return backend_.api.reconstructed_frame(*request); });
  }
  grpc::ServerWriteReactor<v1::IterationPreview>* Watch(Context* /*context*/,
                                                        const v1::Empty* /*request*/) override {
    return watch<v1::IterationPreview>(backend_, IterationFeed(backend_.api.board()));
  }

 private:
  GrpcBackend backend_;
};

class ArService final : public v1::Ar::CallbackService {
 public:
  explicit ArService(GrpcBackend backend) : backend_(backend) {}
  grpc::ServerUnaryReactor* Results(Context* context, const v1::Empty* /*request*/,
                                    v1::ListResultsResponse* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.list_results(); });
  }
  grpc::ServerUnaryReactor* Start(Context* context, const v1::ArRequest* request,
                                  v1::ArStatus* response) override {
    return answer(backend_, context, response, [this, request] { return backend_.api.start_ar(*request); });
  }
  grpc::ServerUnaryReactor* Stop(Context* context, const v1::Empty* /*request*/,
                                 v1::ArStatus* response) override {
    return answer(backend_, context, response, [this] { return backend_.api.stop_ar(); });
  }

 private:
  GrpcBackend backend_;
};

}  // namespace

struct GrpcServices::All {
  explicit All(GrpcBackend b)
      : daemon(b), devices(b), strobe(b), sync(b), capture(b), sessions(b), jobs(b), reconstruct(b), ar(b) {}
  DaemonService daemon;
  DevicesService devices;
  StrobeService strobe;
  SyncService sync;
  CaptureService capture;
  SessionsService sessions;
  JobsService jobs;
  ReconstructService reconstruct;
  ArService ar;
};

GrpcServices::GrpcServices(GrpcBackend backend) : all_(std::make_unique<All>(backend)) {}
GrpcServices::~GrpcServices() = default;

void GrpcServices::add_to(grpc::ServerBuilder& builder) {
  grpc::Service* const services[] = {&all_->daemon, &all_->devices,     &all_->strobe,
                                     &all_->sync,   &all_->capture,     &all_->sessions,
                                     &all_->jobs,   &all_->reconstruct, &all_->ar};
  for (grpc::Service* service : services) builder.RegisterService(service);
}

}  // namespace emberlock::daemon
