// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/serializer.hpp>
#include <boost/beast/http/string_body.hpp>

#include "daemon/server/http_context.h"
#include "daemon/server/http_download.h"
#include "daemon/server/http_stream.h"
#include "daemon/server/json_api.h"

namespace emberlock::daemon {

/// One connection: consecutive requests, each with a deadline, until it becomes a viewer or ends. Runs on the
/// server's thread.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  /// Whether it can be evicted; the first ones in this list are evicted first.
  enum class Standing {
    unauthenticated,  ///< no valid secret yet: in the TLS handshake, in its first request, or refused
    authenticated,    ///< let in; sending, receiving or idle
    working,          ///< waits for the answer to its call: can't be evicted
  };

  HttpConnection(HttpContext& context, boost::asio::ip::tcp::socket socket);
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection();

  void run();
  /// Closes the connection, because it was evicted.
  void close();
  [[nodiscard]] Standing standing() const { return standing_; }
  /// The client, as far as the kernel knows it.
  [[nodiscard]] const std::string& peer() const { return peer_; }
  /// Order of its last request (or its start): larger is later.
  [[nodiscard]] std::uint64_t since() const { return since_; }

 private:
  using Body = boost::beast::http::string_body;
  using Response = boost::beast::http::response<Body>;
  enum class Next { go_on, end };

  /// Answers plain HTTP on a TLS port, in plain HTTP, that TLS is required.
  void point_to_tls();
  void read_header();
  /// Refuses a request from its head, before a body is read.
  void authorize();
  void refuse(Refusal refusal);
  enum class Answered { at_once, late };
  void answer_refusal(Refusal refusal, Answered answered);
  void let_in(const std::string& cookie);
  /// Reads a token from the sign-in page's form.
  void read_form();
  void read_body();
  void answer();
  void answer_api(std::string_view method);
  void answer_file();
  void answer_export();
  void write_download();
  void call(const JsonMethod& method);
  void watch();

  void start_job(const JsonMethod& method);
  void notice_end();
  void write_progress();
  void write_line(const std::string& json);
  void write_end();
  void end_job();

  [[nodiscard]] Response response(unsigned status, std::string_view type, std::string content) const;
  void respond(Response response, Next next = Next::go_on);
  void respond_error(unsigned status, std::string_view code, std::string_view message,
                     Next next = Next::go_on);
  void respond_error(const Error& error);
  /// Closes the connection in both directions.
  void end();

  HttpContext& context_;
  const std::string peer_;
  Standing standing_ = Standing::unauthenticated;
  std::uint64_t since_;
  std::string cookie_;               ///< set again with the console's page
  std::string who_;                  ///< the authenticated client
  boost::asio::steady_timer delay_;  ///< of the answer to a guess
  HttpStream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<Body>> parser_;
  HttpTarget target_;
  std::shared_ptr<const Response> answer_;  ///< being sent
  std::shared_ptr<HttpDownload> download_;  ///< being sent

  std::shared_ptr<JobWatch> job_;
  std::shared_ptr<const std::string> line_;  ///< being sent
  bool head_sent_ = false;
};

}  // namespace emberlock::daemon
