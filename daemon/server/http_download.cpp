// SPDX-License-Identifier: Apache-2.0
// The part of HttpConnection that sends exported files.
#include "daemon/server/http_download.h"

#include <utility>

#include <boost/beast/http/write.hpp>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/server/exported_file.h"
#include "daemon/server/http_connection.h"
#include "daemon/server/http_range.h"

namespace emberlock::daemon {

namespace beast = boost::beast;
namespace http = beast::http;

namespace {

/// Changes when the file does, so that a client doesn't join parts of two files.
std::string entity_tag(const struct stat& file) {
  return fmt::format("\"{:x}-{:x}-{:x}.{:x}\"", file.st_ino, file.st_size, file.st_mtim.tv_sec,
                     file.st_mtim.tv_nsec);
}

}  // namespace

void HttpConnection::answer_export() {
  auto exported = open_exported(context_.options.export_folder, target_.path);
  if (!exported) return respond_error(404, "NOT_FOUND", "there is no such exported file");
  beast::error_code error;
  FilePart file;
  file.native_handle(::dup(exported->file.get()));
  struct stat is {};
  if (::fstat(exported->file.get(), &is) != 0)
    return respond_error(500, "INTERNAL", "the exported file can't be read");
  const auto size = static_cast<std::uint64_t>(is.st_size);
  const std::string tag = entity_tag(is);
  const auto& request = parser_->get();
  const bool by_get = request.method() == http::verb::get;
  const auto& condition = request[http::field::if_range];
  RangeRequest asked;  // a HEAD request has no ranges
  if (by_get && (condition.empty() || condition == tag))
    asked = parse_range({request[http::field::range].data(), request[http::field::range].size()}, size);
  if (asked.kind == RangeRequest::Kind::unsatisfiable) {
    Response refused = response(416, "text/plain", {});
    refused.set(http::field::content_range, fmt::format("bytes */{}", size));
    return respond(std::move(refused));
  }
  const bool is_part = asked.kind == RangeRequest::Kind::part;
  const ByteRange range = is_part ? asked.range : ByteRange{0, size};
  file.length = range.length;
  file.seek(range.first, error);
  HttpDownload::Body::value_type content;
  if (!error) content.reset(std::move(file), error);
  if (error) return respond_error(500, "INTERNAL", "the exported file can't be read: " + error.message());
  const Response head = response(is_part ? 206 : 200, exported->type, {});
  http::response<HttpDownload::Body> answer(http::response_header<>(head.base()), std::move(content));
  answer.set(http::field::content_disposition, attachment(exported->name));
  answer.set(http::field::accept_ranges, "bytes");
  answer.set(http::field::etag, tag);
  if (is_part)
    answer.set(http::field::content_range,
               fmt::format("bytes {}-{}/{}", range.first, range.first + range.length - 1, size));
  answer.content_length(range.length);
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
