// SPDX-License-Identifier: Apache-2.0
#include "tests/support/chdk_responder/chdk_device.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "base/random.h"

namespace emberlock::chdk_responder {
namespace {

constexpr std::size_t kHeader = 12;
constexpr std::uint32_t kStorage = 0x00010001;

/// Little-endian bytes, appended one value after the other.
class Bytes {
 public:
  template <class Integer>
  Bytes& add(std::type_identity_t<Integer> value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      bytes_.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
    return *this;
  }
  Bytes& u8(std::uint8_t v) { return add<std::uint8_t>(v); }
  Bytes& u16(std::uint16_t v) { return add<std::uint16_t>(v); }
  Bytes& u32(std::uint32_t v) { return add<std::uint32_t>(v); }
  Bytes& text(std::string_view ascii) {
    if (ascii.empty()) return u8(0);
    u8(static_cast<std::uint8_t>(ascii.size() + 1));
    for (const char c : ascii) u16(static_cast<std::uint8_t>(c));
    return u16(0);
  }
  Bytes& u16s(const std::vector<std::uint16_t>& values) {
    u32(static_cast<std::uint32_t>(values.size()));
    for (const std::uint16_t v : values) u16(v);
    return *this;
  }
  Bytes& u32s(const std::vector<std::uint32_t>& values) {
    u32(static_cast<std::uint32_t>(values.size()));
    for (const std::uint32_t v : values) u32(v);
    return *this;
  }
  Bytes& raw(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

std::uint32_t u32_at(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  return value;
}

std::uint16_t u16_at(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at]) |
                                    std::to_integer<unsigned>(bytes[at + 1]) << 8);
}

std::vector<std::byte> container(std::size_t length, std::uint16_t type, std::uint16_t code,
                                 std::uint32_t transaction, std::span<const std::byte> payload) {
  return Bytes()
      .u32(static_cast<std::uint32_t>(length))
      .u16(type)
      .u16(code)
      .u32(transaction)
      .raw(payload)
      .take();
}

/// Whether this answer is one of those that the fault is meant for.
bool strikes(int& left) {
  if (left == 0) return false;
  if (left > 0) --left;
  return true;
}

std::vector<std::byte> as_bytes(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

/// "name(argument)" -> argument, if the statement calls that.
std::optional<std::string> argument_of(const std::string& statement, const std::string& name) {
  if (statement.rfind(name + "(", 0) != 0 || statement.back() != ')') return {};
  return statement.substr(name.size() + 1, statement.size() - name.size() - 2);
}

std::string unquoted(const std::string& text) {
  return text.size() >= 2 && text.front() == '"' ? text.substr(1, text.size() - 2) : text;
}

int number_of(const std::string& text) {
  int value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

void Device::receive(std::span<const std::byte> bytes, TimePoint now) {
  inbox_.insert(inbox_.end(), bytes.begin(), bytes.end());
  while (inbox_.size() >= kHeader) {
    const std::size_t length = u32_at(inbox_, 0);
    if (length < kHeader || length > (1u << 24)) {  // nothing that a host would send
      inbox_.clear();
      return;
    }
    if (inbox_.size() < length) return;
    const std::vector<std::byte> whole(inbox_.begin(), inbox_.begin() + static_cast<std::ptrdiff_t>(length));
    inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<std::ptrdiff_t>(length));
    handle(whole, now);
  }
}

void Device::handle(std::span<const std::byte> whole, TimePoint now) {
  const std::uint16_t type = u16_at(whole, 4);
  if (type == 2 && awaiting_data_) {
    const Command command = *std::exchange(awaiting_data_, std::nullopt);
    do_command(command, whole.subspan(kHeader), now);
    return;
  }
  if (type != 1) return;
  Command command{u16_at(whole, 6), u32_at(whole, 8), {}};
  for (std::size_t at = kHeader; at + 4 <= whole.size(); at += 4) command.params.push_back(u32_at(whole, at));
  const bool brings_data = command.operation == 0x9999 && (command.param(0) == 7 || command.param(0) == 11);
  if (brings_data) {
    awaiting_data_ = command;
  } else {
    do_command(command, {}, now);
  }
}

void Device::do_command(const Command& command, std::span<const std::byte> data, TimePoint now) {
  ++transactions_;
  live_on(now);
  if (hung_ || strikes(faults.hang)) return;
  const TimePoint ready = now + faults.latency;
  if (strikes(faults.stall)) {
    outbox_.push_back({{}, ready, true});
  } else if (strikes(faults.garbage)) {
    std::vector<std::byte> noise(100);
    for (std::byte& b : noise) b = static_cast<std::byte>(random_bits(options_.seed, 7, draws_++));
    queue(std::move(noise), ready);
  } else if (strikes(faults.busy)) {
    send(command, {0x2019}, ready);
  } else {
    send(command, answer(command, data, now), ready);
  }
}

void Device::send(const Command& command, Answer answer, TimePoint ready) {
  const std::uint32_t transaction = command.transaction + (strikes(faults.wrong_transaction) ? 17 : 0);
  if (answer.data) {
    std::size_t length = kHeader + answer.data->size();
    if (strikes(faults.long_length)) length += 1000;
    if (strikes(faults.short_length)) length -= std::min<std::size_t>(answer.data->size(), 10);
    if (strikes(faults.header_alone)) {
      queue(container(length, 2, command.operation, transaction, {}), ready);
      queue(*answer.data, ready);
    } else {
      queue(container(length, 2, command.operation, transaction, *answer.data), ready);
    }
  }
  const std::vector<std::byte> params = [&] {
    Bytes bytes;
    for (const std::uint32_t p : answer.params) bytes.u32(p);
    return bytes.take();
  }();
  queue(container(kHeader + params.size(), 3, answer.code, transaction, params), ready);
}

void Device::queue(std::vector<std::byte> transfer, TimePoint ready) {
  const bool fills = !transfer.empty() && transfer.size() % options_.packet_bytes == 0;
  outbox_.push_back({std::move(transfer), ready});
  if (fills && !strikes(faults.no_empty_packet)) outbox_.push_back({{}, ready});
}

std::optional<TimePoint> Device::next_ready() const {
  return outbox_.empty() ? std::nullopt : std::optional(outbox_.front().ready);
}

std::optional<Outgoing> Device::take(std::size_t most, TimePoint by) {
  if (outbox_.empty() || outbox_.front().ready > by) return {};
  Outgoing& next = outbox_.front();
  if (next.bytes.size() <= most) {
    Outgoing piece = std::move(next);
    outbox_.pop_front();
    return piece;
  }
  Outgoing piece{{next.bytes.begin(), next.bytes.begin() + static_cast<std::ptrdiff_t>(most)}, next.ready};
  next.bytes.erase(next.bytes.begin(), next.bytes.begin() + static_cast<std::ptrdiff_t>(most));
  return piece;
}

void Device::cancel() {
  inbox_.clear();
  outbox_.clear();
  awaiting_data_.reset();
}

void Device::reset() {
  cancel();
  session_open_ = false;
}

void Device::power_on() {
  reset();
  hung_ = false;
  statements_.clear();
  messages_out_.clear();
  messages_in_.clear();
  record_mode_ = false;
  mode_to_.reset();
  movie_ = 0;
  movie_at_.reset();
  ++phase_draws_;
}

std::vector<std::byte> Device::content(std::uint32_t handle, std::uint32_t offset,
                                       std::uint32_t count) const {
  std::vector<std::byte> bytes(count);
  std::uint64_t word = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t at = offset + i;
    if (i == 0 || at % 8 == 0) word = random_bits(options_.seed, handle, at / 8);
    bytes[i] = static_cast<std::byte>(word >> (at % 8 * 8));
  }
  return bytes;
}

std::uint32_t Device::add_object(StoredObject object) {
  objects_.emplace(next_handle_, std::move(object));
  return next_handle_++;
}

std::vector<std::byte> Device::device_info() const {
  std::vector<std::uint16_t> operations{0x1001, 0x1002, 0x1003, 0x1004, 0x1007, 0x1008, 0x1009};
  if (options_.partial_objects) operations.push_back(0x101b);
  if (options_.chdk) operations.push_back(0x9999);
  return Bytes()
      .u16(100)
      .u32(0x0b)
      .u16(100)
      .text("")
      .u16(0)
      .u16s(operations)
      .u16s({})
      .u16s({})
      .u16s({})
      .u16s({0x300a})
      .text("Canon Inc.")
      .text(options_.model)
      .text("1-6.0.1.0")
      .text(options_.serial)
      .take();
}

std::vector<std::byte> Device::object_info(std::uint32_t handle) const {
  const StoredObject& object = objects_.at(handle);
  Bytes bytes;
  bytes.u32(kStorage).u16(object.format).u16(0).u32(object.bytes).u16(0);
  for (int i = 0; i < 6; ++i) bytes.u32(0);
  bytes.u32(object.folder)
      .u16(0)
      .u32(0)
      .u32(0)
      .text(object.name)
      .text("20261121T220000")
      .text("20261121T220000")
      .text("");
  return bytes.take();
}

Device::Answer Device::answer(const Command& command, std::span<const std::byte> data, TimePoint now) {
  constexpr std::uint16_t kNotOpen = 0x2003, kUnknown = 0x2005, kNoSuchObject = 0x2009, kAlreadyOpen = 0x201e;
  if (command.operation == 0x1001) return {.data = device_info()};
  if (command.operation == 0x1002) {
    if (std::exchange(session_open_, true)) return {kAlreadyOpen};
    return {};
  }
  if (!session_open_) return {kNotOpen};
  if (command.operation == 0x9999 && options_.chdk) return answer_chdk(command, data, now);
  const std::uint32_t handle = command.param(0);
  const auto object = objects_.find(handle);
  switch (command.operation) {
    case 0x1003:
      session_open_ = false;
      return {};
    case 0x1004:
      return {.data = Bytes().u32s({kStorage}).take()};
    case 0x1007: {
      std::vector<std::uint32_t> handles;
      const std::uint32_t folder = command.param(2) == 0xffffffff ? 0 : command.param(2);
      for (const auto& [key, value] : objects_) {
        if (value.folder == folder) handles.push_back(key);
      }
      return {.data = Bytes().u32s(handles).take()};
    }
    case 0x1008:
      if (object == objects_.end()) return {kNoSuchObject};
      return {.data = object_info(handle)};
    case 0x1009:
      if (object == objects_.end()) return {kNoSuchObject};
      return {.data = content(handle, 0, object->second.bytes)};
    case 0x101b: {
      if (!options_.partial_objects) return {kUnknown};
      if (object == objects_.end()) return {kNoSuchObject};
      const std::uint32_t offset = std::min(command.param(1), object->second.bytes);
      const std::uint32_t count = std::min(command.param(2), object->second.bytes - offset);
      return {.params = {count}, .data = content(handle, offset, count)};
    }
    default:
      return {kUnknown};
  }
}

Device::Answer Device::answer_chdk(const Command& command, std::span<const std::byte> data, TimePoint now) {
  switch (command.param(0)) {
    case 0:
      return {.params = {2, 9}};
    case 7: {
      std::string text(reinterpret_cast<const char*>(data.data()), data.size());
      if (text.empty() || text.back() != '\0') return {0x201d};
      text.pop_back();
      start_script(text, now);
      const bool compiles =
          std::count(text.begin(), text.end(), '(') == std::count(text.begin(), text.end(), ')');
      if (!compiles) {
        statements_.clear();
        post(1, 1, ":1: unexpected symbol");
      }
      return {.params = {script_, compiles ? 0u : 1u}};
    }
    case 8:
      step_script(now);
      return {.params = {(statements_.empty() ? 0u : 1u) | (messages_out_.empty() ? 0u : 2u)}};
    case 10:
      return read_message();
    case 11:
      hung_ = hung_ || data.empty();
      if (statements_.empty()) return {.params = {1}};
      messages_in_.emplace_back(reinterpret_cast<const char*>(data.data()), data.size());
      return {.params = {0}};
    case 12: {
      std::vector<std::byte> view = live_view(now);
      const auto size = static_cast<std::uint32_t>(view.size());
      return {.params = {size}, .data = std::move(view)};
    }
    default:
      return {0x2006};
  }
}

Device::Answer Device::read_message() {
  if (messages_out_.empty()) return {.params = {0, 0, 0, 0}, .data = std::vector<std::byte>(1)};
  Message message = std::move(messages_out_.front());
  messages_out_.pop_front();
  const auto length = static_cast<std::uint32_t>(message.data.size());
  if (message.data.empty()) message.data.resize(1);
  return {.params = {message.type, message.subtype, message.script, length}, .data = std::move(message.data)};
}

std::vector<std::byte> Device::live_view(TimePoint now) {
  constexpr std::uint32_t kDescription = 32;
  constexpr std::uint32_t kPixels = kDescription + 2 * 36;
  live_on(now);
  const auto [width, height] = options_.live_view;
  const std::uint32_t start = strikes(faults.bad_live_view) ? 0x7fffffff
                              : record_mode_ && !mode_to_   ? kPixels
                                                            : 0;
  Bytes bytes;
  for (const std::uint32_t word : {2u, 2u, 0u, 0u, 0u, kDescription, kDescription + 36, 0u}) bytes.u32(word);
  for (const int word :
       {options_.live_view_type, static_cast<int>(start), options_.buffer_width, width, height}) {
    bytes.u32(static_cast<std::uint32_t>(word));
  }
  for (int i = 0; i < 4 + 9; ++i) bytes.u32(0);  // margins; the overlay, which wasn't asked for
  if (start != kPixels) return bytes.take();
  const int picture = pictures_++;
  const bool old = options_.live_view_type == 0;
  const auto brightness = [&](int x, int y) {
    if (y == 0 && x == 0) return static_cast<std::uint8_t>(phase_draws_);
    if (y == 0 && x == 1) return static_cast<std::uint8_t>(picture);
    return static_cast<std::uint8_t>(x + 3 * y);
  };
  // The colour is what (U, V) = (10, -20) gives.
  const auto u = static_cast<std::uint8_t>(old ? 10 : 138), v = static_cast<std::uint8_t>(old ? -20 : 108);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < options_.buffer_width; x += old ? 4 : 2) {
      bytes.u8(u).u8(brightness(x, y)).u8(v).u8(brightness(x + 1, y));
      if (old) bytes.u8(brightness(x + 2, y)).u8(brightness(x + 3, y));
    }
  }
  return bytes.take();
}

void Device::start_script(std::string_view text, TimePoint now) {
  statements_.clear();
  sleeping_until_.reset();
  messages_in_.clear();
  ++script_;
  std::string statement;
  for (const char c : std::string(text) + ';') {
    if (c != ';') {
      statement += c;
      continue;
    }
    const std::size_t begin = statement.find_first_not_of(' ');
    if (begin != std::string::npos) statements_.push_back(statement.substr(begin));
    statement.clear();
  }
  step_script(now);
}

void Device::step_script(TimePoint now) {
  while (!statements_.empty() && do_statement(statements_.front(), now)) {
    if (!statements_.empty()) statements_.pop_front();
  }
}

void Device::post(std::uint32_t type, std::uint32_t subtype, std::string_view text) {
  messages_out_.push_back({type, subtype, script_, as_bytes(text)});
}

void Device::post_number(std::uint32_t subtype, std::int32_t number) {
  messages_out_.push_back({2, subtype, script_, Bytes().u32(static_cast<std::uint32_t>(number)).take()});
}

bool Device::do_statement(const std::string& statement, TimePoint now) {
  constexpr std::uint32_t kBoolean = 2, kInteger = 3, kString = 4;
  if (const auto mode = argument_of(statement, "switch_mode_usb")) {
    mode_to_ = *mode == "1";
    const double jitter = 2 * random_uniform(options_.seed, 1, draws_++) - 1;
    mode_at_ = now + options_.mode_change + options_.mode_jitter * jitter;
  } else if (statement == "return get_mode()") {
    post_number(kBoolean, record_mode_ ? 1 : 0);
    post_number(kBoolean, 0);
    post_number(kInteger, 2);
  } else if (statement == "return get_movie_status()") {
    post_number(kInteger, movie_);
  } else if (statement == "click(\"video\")") {
    press_video(now);
  } else if (const auto text = argument_of(statement, "write_usb_msg")) {
    post(3, kString, unquoted(*text));
  } else if (const auto words = argument_of(statement, "error")) {
    post(1, 2, unquoted(*words));
    statements_.clear();
  } else if (const auto pause = argument_of(statement, "sleep")) {
    if (!sleeping_until_) sleeping_until_ = now + milliseconds(number_of(*pause));
    if (now < *sleeping_until_) return false;
    sleeping_until_.reset();
  } else if (statement == "return read_usb_msg(1000)") {
    if (messages_in_.empty()) return false;
    post(2, kString, messages_in_.front());
    messages_in_.pop_front();
  } else {
    post(1, 2, "attempt to call a nil value: " + statement);
    statements_.clear();
  }
  return true;
}

void Device::press_video(TimePoint now) {
  if (!record_mode_ || movie_at_) return;
  if (movie_ == 0) {
    movie_to_ = 4;
    movie_at_ = now + options_.movie_start;
  } else if (movie_ == 4) {
    movie_ = 5;
    movie_to_ = 0;
    movie_at_ = now + options_.movie_saving;
  }
}

void Device::live_on(TimePoint now) {
  step_script(now);
  if (mode_to_ && now >= mode_at_) {
    record_mode_ = *std::exchange(mode_to_, std::nullopt);
    if (record_mode_) ++phase_draws_;
  }
  if (!movie_at_ || now < *movie_at_) return;
  movie_ = movie_to_;
  const TimePoint at = *std::exchange(movie_at_, std::nullopt);
  if (movie_ == 4) {
    movie_since_ = at;
    ++phase_draws_;
    return;
  }
  const double seconds = (at - movie_since_).value();
  const auto bytes = static_cast<std::uint32_t>(seconds * options_.movie_bytes_per_second) + 1000;
  add_object({"MVI_" + std::to_string(1000 + next_handle_) + ".AVI", 0x300a, bytes, 0});
}

}  // namespace emberlock::chdk_responder
