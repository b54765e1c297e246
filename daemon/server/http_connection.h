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
#include "daemon/server/http_stream.h"
#include "daemon/server/json_api.h"

namespace emberlock::daemon {

/// One connection: requests one after another, each with a deadline, until it becomes a viewer or ends. On
/// the server's thread.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  /// Whether it makes room for others, those first who stand first here.
  enum class Standing {
    stranger,  ///< has shown nothing that is right: in TLS's handshake, in its first head, refused
    known,     ///< was let in, and sends or takes bytes, or is silent
    working,   ///< waits for an answer to its call: it makes no room
  };

  HttpConnection(HttpContext& context, boost::asio::ip::tcp::socket socket);
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection();

  void run();
  /// Ends it, as it makes room.
  void close();
  [[nodiscard]] Standing standing() const { return standing_; }
  /// Who asks, as far as the kernel knows.
  [[nodiscard]] const std::string& peer() const { return peer_; }
  /// Since when it is, or was asked last: larger is later.
  [[nodiscard]] std::uint64_t since() const { return since_; }

 private:
  using Body = boost::beast::http::string_body;
  using Response = boost::beast::http::response<Body>;
  enum class Next { go_on, end };

  /// Who spoke plain HTTP hears, in plain HTTP, that TLS is spoken.
  void point_to_tls();
  void read_header();
  /// Refuses by the head alone, before a body is read.
  void judge();
  void refuse(Refusal refusal);
  enum class Answered { at_once, late };
  void answer_refusal(Refusal refusal, Answered answered);
  void let_in(const std::string& cookie);
  /// A token that the strangers' page's form sent.
  void read_form();
  void read_body();
  void answer();
  void answer_api(std::string_view method);
  void answer_file();
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
  /// Says so to the other side first.
  void end();

  HttpContext& context_;
  const std::string peer_;
  Standing standing_ = Standing::stranger;
  std::uint64_t since_;
  std::string cookie_;               ///< that the console's page sets again
  std::string who_;                  ///< that was let in
  boost::asio::steady_timer delay_;  ///< of an answer to who guesses
  HttpStream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<Body>> parser_;
  HttpTarget target_;
  std::shared_ptr<const Response> answer_;  ///< that is being sent

  std::shared_ptr<Job> job_;
  std::shared_ptr<const std::string> line_;  ///< that is being sent
  bool head_sent_ = false;
};

}  // namespace emberlock::daemon
