// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_connection.h"

#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/http/chunk_encode.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/sslerr.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/server/errors.h"
#include "daemon/server/metrics.h"
#include "daemon/server/peer.h"
#include "daemon/server/sign_in_page.h"
#include "daemon/server/viewer.h"

namespace emberlock::daemon {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::string_view kApiPath = "/api/v1/";
constexpr std::string_view kWatchPath = "/api/v1/watch";
constexpr std::string_view kJson = "application/json";
constexpr std::string_view kText = "text/plain; charset=utf-8";
constexpr const char* kPolicy =
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; "
    "worker-src 'self' "
    "blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

constexpr std::string_view kExportsPath = "/exports/";
constexpr std::string_view kOpenPath = "/open";
constexpr std::uint64_t kLargestForm = 1024;  // bytes
constexpr std::chrono::seconds kGoodbye{1};   // for the other side to close too
constexpr std::string_view kSpeakTls =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nContent-Length: 50\r\nConnection: close\r\n\r\n"
    "TLS is spoken here: the address begins https://.\r\n";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }
beast::string_view view(std::string_view text) { return {text.data(), text.size()}; }

}  // namespace

HttpConnection::HttpConnection(HttpContext& context, asio::ip::tcp::socket socket)
    : context_(context),
      peer_(peer_of(socket)),
      since_(context.next_turn()),
      delay_(context.loop),
      stream_(std::move(socket), context.tls.get()) {
  context_.connections.insert(this);
  beast::error_code ignored;
  stream_.next_layer().socket().set_option(asio::ip::tcp::no_delay(true), ignored);
}

HttpConnection::~HttpConnection() {
  context_.connections.erase(this);
  end_job();
}

void HttpConnection::close() {
  context_.connections.erase(this);
  delay_.cancel();
  stream_.next_layer().close();
}

void HttpConnection::end() {
  stream_.next_layer().expires_after(kGoodbye);
  stream_.async_shutdown([self = shared_from_this()](beast::error_code /*error*/) { self->close(); });
}

void HttpConnection::run() {
  if (!stream_.is_tls()) return read_header();
  stream_.next_layer().expires_after(context_.patience());
  stream_.async_handshake([self = shared_from_this()](beast::error_code error) {
    if (!error) return self->read_header();
    if (error.category() == asio::error::get_ssl_category() &&
        ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_HTTP_REQUEST)
      return self->point_to_tls();
    self->close();
  });
}

void HttpConnection::point_to_tls() {
  stream_.next_layer().expires_after(context_.patience());
  asio::async_write(stream_.next_layer(), asio::buffer(kSpeakTls),
                    [self = shared_from_this()](beast::error_code /*error*/, std::size_t /*bytes*/) {
                      beast::error_code ignored;
                      self->stream_.next_layer().socket().shutdown(asio::ip::tcp::socket::shutdown_send,
                                                                   ignored);
                      self->close();
                    });
}

void HttpConnection::read_header() {
  parser_.emplace();
  parser_->header_limit(context_.options.largest_header);
  parser_->body_limit(context_.options.largest_body);
  stream_.next_layer().expires_after(context_.patience());
  http::async_read_header(
      stream_, buffer_, *parser_,
      [self = shared_from_this()](beast::error_code error, std::size_t /*bytes*/) {
        if (!error) return self->authorize();
        if (error == http::error::header_limit)
          return self->respond_error(431, "INVALID_ARGUMENT", "the head is too long", Next::end);
        if (error == http::error::body_limit)
          return self->respond_error(413, "INVALID_ARGUMENT", "the body is too long", Next::end);
        if (error.category() == make_error_code(http::error::bad_method).category() &&
            error != http::error::end_of_stream && error != http::error::partial_message)
          return self->respond_error(400, "INVALID_ARGUMENT", "this is no HTTP", Next::end);
        error == http::error::end_of_stream ? self->end() : self->close();
      });
}

void HttpConnection::authorize() {
  const auto& request = parser_->get();
  auto target = parse_target(view(request.target()));
  if (!target) return respond_error(400, "INVALID_ARGUMENT", "no such address", Next::end);
  target_ = *std::move(target);
  if (target_.path == "/healthz") {  // for everybody; nothing else is read for it
    const bool has_body = parser_->chunked() || parser_->content_length().value_or(0) > 0;
    return has_body ? respond_error(413, "INVALID_ARGUMENT", "this takes no body", Next::end) : read_body();
  }
  // A HEAD request doesn't use up a link.
  if (request.method() != http::verb::get) target_.link.clear();
  const HttpHead head{.host = view(request[http::field::host]),
                      .origin = view(request[http::field::origin]),
                      .authorization = view(request[http::field::authorization]),
                      .cookie = view(request[http::field::cookie])};
  HttpAccess access = context_.gate.authorize(head, target_, SteadyClock().now());
  switch (access.verdict) {
    case HttpVerdict::granted:
      standing_ = Standing::authenticated;
      since_ = context_.next_turn();
      who_ = std::move(access.who);
      cookie_ = std::move(access.cookie);
      if (target_.path == kOpenPath && request.method() == http::verb::get) return let_in({});
      return read_body();
    case HttpVerdict::give_cookie:
      return let_in(access.cookie);
    case HttpVerdict::refused: {
      const bool by_form =
          access.refusal == Refusal::nothing_shown || access.refusal == Refusal::unknown_session;
      if (by_form && target_.path == kOpenPath && request.method() == http::verb::post) return read_form();
      return refuse(access.refusal);
    }
  }
}

void HttpConnection::let_in(const std::string& cookie) {
  Response moved = response(303, kText, "");
  moved.set(http::field::location, "/");
  if (!cookie.empty()) moved.set(http::field::set_cookie, cookie);
  respond(std::move(moved), Next::end);
}

void HttpConnection::read_form() {
  if (parser_->content_length().value_or(0) > kLargestForm)
    return respond_error(413, "INVALID_ARGUMENT", "the body is too long", Next::end);
  parser_->body_limit(kLargestForm);
  stream_.next_layer().expires_after(context_.patience());
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](beast::error_code error, std::size_t /*bytes*/) {
                     if (error) return self->close();
                     const auto& request = self->parser_->get();
                     const auto cookie = self->context_.gate.cookie_for_token(
                         token_of_form(request.body()), view(request[http::field::host]),
                         SteadyClock().now());
                     cookie ? self->let_in(*cookie) : self->refuse(Refusal::wrong_token);
                   });
}

/// Delays the answer to a guess; other connections aren't affected.
void HttpConnection::refuse(Refusal refusal) {
  standing_ = Standing::unauthenticated;
  const AuthFailures::Outcome outcome =
      context_.options.failures->note("http", peer_, refusal, SteadyClock().now());
  if (outcome.line) log(LogCategory::daemon).warn("{}", *outcome.line);
  if (outcome.delay == Seconds(0)) return answer_refusal(refusal, Answered::at_once);
  stream_.next_layer().expires_never();
  delay_.expires_after(std::chrono::nanoseconds(static_cast<std::int64_t>(outcome.delay.value() * 1e9)));
  delay_.async_wait([self = shared_from_this(), refusal](beast::error_code error) {
    if (!error) self->answer_refusal(refusal, Answered::late);
  });
}

void HttpConnection::answer_refusal(Refusal refusal, Answered answered) {
  if (refusal == Refusal::foreign_host)
    return respond_error(421, "PERMISSION_DENIED",
                         "this name doesn't lead here: use localhost, or the address in numbers", Next::end);
  if (refusal == Refusal::foreign_origin)
    return respond_error(403, "PERMISSION_DENIED", "another site's page may not ask", Next::end);
  const std::string_view path = target_.path;
  const bool by_browser = path == "/" || path == "/index.html" || path == kOpenPath;
  const TokenField field = context_.gate.has_token() ? TokenField::shown : TokenField::none;
  Response refused =
      by_browser ? response(401, "text/html; charset=utf-8", sign_in_page(refusal, field))
                 : response(401, kJson,
                            error_json("UNAUTHENTICATED",
                                       "this daemon doesn't know who asks: `emberlock console` prints a link "
                                       "for browsers; programs send \"Authorization: Bearer TOKEN\", with "
                                       "what its token_file holds") +
                                '\n');
  refused.set(http::field::www_authenticate, "Bearer realm=\"emberlock\"");
  if (by_browser) {
    refused.set("Content-Security-Policy", kSignInPolicy);
    refused.set("Referrer-Policy",
                "same-origin");  // otherwise a browser omits the origin when it sends the form
  }
  // After a delay the browser may have a new cookie.
  if (refusal == Refusal::unknown_session && by_browser && answered == Answered::at_once)
    refused.set(http::field::set_cookie, HttpGate::no_cookie(view(parser_->get()[http::field::host])));
  respond(std::move(refused), Next::end);
}

void HttpConnection::read_body() {
  stream_.next_layer().expires_after(context_.patience());
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](beast::error_code error, std::size_t /*bytes*/) {
                     if (!error) return self->answer();
                     if (error == http::error::body_limit)
                       return self->respond_error(413, "INVALID_ARGUMENT", "the body is too long", Next::end);
                     self->close();
                   });
}

void HttpConnection::answer() {
  stream_.next_layer().expires_never();  // calls may take as long as devices do
  const http::verb method = parser_->get().method();
  const std::string_view path = target_.path;
  if (path == kWatchPath) return watch();
  if (path.starts_with(kApiPath)) {
    if (method == http::verb::post) return answer_api(path.substr(kApiPath.size()));
    return respond_error(405, "INVALID_ARGUMENT", "methods are called by POST");
  }
  if (method != http::verb::get && method != http::verb::head)
    return respond_error(405, "INVALID_ARGUMENT", "this is read by GET");
  if (path == "/healthz") {
    const bool runs = context_.api.board().status()->phase() != v1::PHASE_UNSPECIFIED;
    return respond(response(runs ? 200 : 503, kText, runs ? "serving\n" : "starting\n"));
  }
  if (path == "/metrics") {
    const std::size_t others = context_.options.other_watchers ? context_.options.other_watchers() : 0;
    return respond(response(200, "text/plain; version=0.0.4; charset=utf-8",
                            metrics_text(*context_.api.board().status(), process_usage(),
                                         {.viewers = context_.viewer_count,
                                          .other_watchers = others,
                                          .refused = context_.options.failures->counts()})));
  }
  if (path.starts_with(kExportsPath)) return answer_export();
  answer_file();
}

void HttpConnection::answer_file() {
  const ConsoleFiles::File* file = context_.console.find(target_.path);
  if (file == nullptr && target_.path == "/")
    return respond(
        response(404, kText, "The console isn't installed here: [server] console names its folder.\n"));
  if (file == nullptr) return respond_error(404, "NOT_FOUND", "there is no such page");
  const bool known = view(parser_->get()[http::field::if_none_match]) == file->tag;
  Response found = response(known ? 304 : 200, file->type, known ? std::string() : file->content);
  found.set(http::field::etag, file->tag);
  found.set(http::field::cache_control, view(file->caching));
  found.set("Content-Security-Policy", kPolicy);
  if (target_.path == "/" && !cookie_.empty()) found.set(http::field::set_cookie, cookie_);
  respond(std::move(found));
}

void HttpConnection::answer_api(std::string_view name) {
  const JsonMethod* method = find_json_method(name);
  if (method == nullptr) return respond_error(404, "UNIMPLEMENTED", "there is no such method");
  if (method->job != nullptr) return start_job(*method);
  call(*method);
}

void HttpConnection::call(const JsonMethod& method) {
  // The connection must be released on the server's thread, the only one that may destroy it.
  standing_ = Standing::working;
  const bool queued = context_.workers.run([self = shared_from_this(), &method]() mutable {
    auto result = method.call(self->context_.api, self->parser_->get().body());
    auto& loop = self->context_.loop;
    asio::post(loop, [self = std::move(self), result = std::move(result)]() mutable {
      if (!result) return self->respond_error(result.error());
      if (result->empty()) return self->respond_error(404, "NOT_FOUND", kNotFound);
      self->respond(self->response(200, kJson, std::move(*result)));
    });
  });
  if (!queued) respond_error(429, "RESOURCE_EXHAUSTED", "too many calls are waiting: try again in a moment");
}

void HttpConnection::watch() {
  if (!beast::websocket::is_upgrade(parser_->get()))
    return respond_error(426, "INVALID_ARGUMENT", "this is a WebSocket");
  context_.make_room_for_a_viewer();
  std::make_shared<Viewer>(context_, who_, std::move(stream_))->run(parser_->release());
}

// ---- jobs: one JSON object per line with the newest progress; the last line is `done` or an error

void HttpConnection::start_job(const JsonMethod& method) {
  if (parser_->get().version() < 11)
    return respond_error(505, "INVALID_ARGUMENT", "jobs are told in chunks: HTTP/1.1", Next::end);
  auto begin = method.job(context_.api, parser_->get().body());
  if (!begin) return respond_error(begin.error());
  job_ = std::make_shared<JobWatch>([weak = weak_from_this(), &loop = context_.loop] {
    asio::post(loop, [weak] {
      if (const auto self = weak.lock()) self->write_progress();
    });
  });
  if (!context_.workers.run([job = job_, begin = std::move(*begin)] { job->begin(begin()); })) {
    job_.reset();
    return respond_error(429, "RESOURCE_EXHAUSTED", "too many calls are waiting: try again in a moment");
  }
  standing_ = Standing::working;
  context_.jobs.insert(job_);
  notice_end();
}

/// Keeps the connection while its job runs, and cancels the job when the client disconnects.
void HttpConnection::notice_end() {
  stream_.next_layer().socket().async_wait(asio::ip::tcp::socket::wait_read,
                                           [self = shared_from_this()](beast::error_code error) {
                                             if (error || !self->job_)
                                               return;  // the bytes belong to the next request
                                             self->end_job();
                                             self->close();
                                           });
}

void HttpConnection::end_job() {
  if (!job_) return;
  job_->leave();
  context_.jobs.erase(job_);
  job_.reset();
}

void HttpConnection::write_progress() {
  if (!job_ || line_) return;
  if (const auto progress = job_->take()) return write_line(to_json(*progress) + '\n');
  const auto ended = job_->ended();
  if (!ended) return;
  end_job();
  if (ended->ok()) return write_end();
  if (!head_sent_) return respond_error(ended->error());
  const Error& error = ended->error();
  write_line(error_json(code_name(error.kind), error.message()) + '\n');
}

/// Ends the stream of a job.
void HttpConnection::write_end() {
  stream_.next_layer().expires_after(context_.patience());
  asio::async_write(
      stream_, http::make_chunk_last(),
      [self = shared_from_this()](beast::error_code /*error*/, std::size_t /*bytes*/) { self->end(); });
}

void HttpConnection::write_line(const std::string& json) {
  std::string bytes;
  if (!std::exchange(head_sent_, true)) {
    bytes =
        "HTTP/1.1 200 OK\r\nContent-Type: application/x-ndjson\r\nCache-Control: "
        "no-store\r\nX-Content-Type-Options: "
        "nosniff\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n";
  }
  bytes += fmt::format("{:x}\r\n{}\r\n", json.size(), json);
  line_ = std::make_shared<const std::string>(std::move(bytes));
  stream_.next_layer().expires_after(context_.patience());
  asio::async_write(stream_, asio::buffer(*line_),
                    [self = shared_from_this()](beast::error_code error, std::size_t /*bytes*/) {
                      self->line_.reset();
                      if (error) {
                        self->end_job();
                        return self->close();
                      }
                      if (!self->job_) return self->write_end();  // the line was an error
                      self->stream_.next_layer().expires_never();
                      self->write_progress();
                    });
}

// ---- answers

HttpConnection::Response HttpConnection::response(unsigned status, std::string_view type,
                                                  std::string content) const {
  Response made{static_cast<http::status>(status), 11, std::move(content)};
  made.set(http::field::content_type, view(type));
  made.set(http::field::cache_control, "no-store");
  made.set("X-Content-Type-Options", "nosniff");
  made.set("Referrer-Policy", "no-referrer");
  return made;
}

void HttpConnection::respond(Response response, Next next) {
  const auto& request = parser_->get();
  const bool only_head = request.method() == http::verb::head;
  const bool ends = next == Next::end || !parser_->is_done() || !request.keep_alive();
  response.keep_alive(!ends);
  response.content_length(response.body().size());
  if (only_head) response.body().clear();
  answer_ = std::make_shared<const Response>(std::move(response));
  if (standing_ == Standing::working) standing_ = Standing::authenticated;
  stream_.next_layer().expires_after(context_.patience());
  http::async_write(stream_, *answer_,
                    [self = shared_from_this(), ends](beast::error_code error, std::size_t /*bytes*/) {
                      self->answer_.reset();
                      if (error) return self->close();
                      if (ends) return self->end();
                      self->read_header();
                    });
}

void HttpConnection::respond_error(unsigned status, std::string_view code, std::string_view message,
                                   Next next) {
  respond(response(status, kJson, error_json(code, message) + '\n'), next);
}

void HttpConnection::respond_error(const Error& error) {
  respond_error(static_cast<unsigned>(http_status(error.kind)), code_name(error.kind), error.message());
}

}  // namespace emberlock::daemon
