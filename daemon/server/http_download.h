// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <boost/beast/core/error.hpp>
#include <boost/beast/core/file_posix.hpp>
#include <boost/beast/http/basic_file_body.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/serializer.hpp>

namespace emberlock::daemon {

/// A file from its present position on, of which `length` bytes are sent.
struct FilePart : boost::beast::file_posix {
  std::uint64_t length = 0;
  [[nodiscard]] std::uint64_t size(boost::beast::error_code& error) const {
    error = {};
    return length;
  }
};

/// A file that is being sent, or a part of it, read piece by piece.
struct HttpDownload {
  using Body = boost::beast::http::basic_file_body<FilePart>;

  explicit HttpDownload(boost::beast::http::response<Body> answer) : response(std::move(answer)) {}

  boost::beast::http::response<Body> response;
  boost::beast::http::response_serializer<Body> serializer{response};
};

}  // namespace emberlock::daemon
