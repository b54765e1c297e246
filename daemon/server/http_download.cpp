// SPDX-License-Identifier: Apache-2.0
// The part of HttpConnection that sends exported files.
#include "daemon/server/http_download.h"

#include <utility>

#include <boost/beast/http/write.hpp>
#include <unistd.h>

#include "daemon/server/exported_file.h"
#include "daemon/server/http_connection.h"

namespace emberlock::daemon {

namespace beast = boost::beast;
namespace http = beast::http;

void HttpConnection::answer_export() {
  auto exported = open_exported(context_.options.export_folder, target_.path);
  if (!exported) return respond_error(404, "NOT_FOUND", "there is no such exported file");
  beast::error_code error;
  HttpDownload::Body::value_type content;
  beast::file_posix file;
  file.native_handle(::dup(exported->file.get()));
  content.reset(std::move(file), error);
  if (error) return respond_error(500, "INTERNAL", "the exported file can't be read: " + error.message());
  const std::uint64_t size = content.size();
  const Response head = response(200, exported->type, {});
  http::response<HttpDownload::Body> answer(http::response_header<>(head.base()), std::move(content));
  answer.set(http::field::content_disposition, attachment(exported->name));
  answer.content_length(size);
  answer.keep_alive(parser_->get().keep_alive());
  download_ = std::make_shared<HttpDownload>(std::move(answer));
  // Of a HEAD request only the head is sent.
  download_->serializer.split(parser_->get().method() == http::verb::head);
  write_download();
}

/// Each piece has its own deadline: a large file may take long, as long as the client reads.
void HttpConnection::write_download() {
  stream_.next_layer().expires_after(context_.patience());
  http::async_write_some(
      stream_, download_->serializer,
      [self = shared_from_this(), sent = download_](beast::error_code error, std::size_t /*bytes*/) {
        auto& serializer = sent->serializer;
        const bool done = serializer.is_done() || (serializer.split() && serializer.is_header_done());
        if (!error && !done) return self->write_download();
        const bool goes_on = sent->response.keep_alive();
        self->download_.reset();
        if (error) return self->close();
        goes_on ? self->read_header() : self->end();
      });
}

}  // namespace emberlock::daemon
