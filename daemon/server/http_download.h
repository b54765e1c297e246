// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core/file_posix.hpp>
#include <boost/beast/http/basic_file_body.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/serializer.hpp>

namespace emberlock::daemon {

/// A file that is being sent, read piece by piece.
struct HttpDownload {
  using Body = boost::beast::http::basic_file_body<boost::beast::file_posix>;

  explicit HttpDownload(boost::beast::http::response<Body> answer) : response(std::move(answer)) {}

  boost::beast::http::response<Body> response;
  boost::beast::http::response_serializer<Body> serializer{response};
};

}  // namespace emberlock::daemon
