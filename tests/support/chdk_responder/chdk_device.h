// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/time_point.h"

// A Canon camera with CHDK, as far as its USB cable shows: what a test plugs in, in process
// (fake_transport.h) or behind QEMU's usbredir (main.cpp). It is written from the same standards as
// drivers/ptp and shares no code with it, so that neither proves the other right by a common mistake.
namespace emberlock::chdk_responder {

struct DeviceOptions {
  std::string serial = "EMBER0001";
  std::string model = "Canon PowerShot E1";
  std::uint16_t usb_vendor = 0x04a9;
  std::uint64_t seed = 1;       ///< of latencies' jitter and of files
  bool chdk = true;             ///< false: 0x9999 isn't known
  bool partial_objects = true;  ///< false: GetPartialObject isn't known
  int live_view_type = 0;       ///< 0 UYVYYY, 3 UYVY
  ImageSize live_view{360, 240};
  int buffer_width = 384;                   ///< pixels from row to row
  Seconds mode_change = milliseconds(300);  ///< on average
  Seconds mode_jitter = milliseconds(50);   ///< to either side, uniform
  Seconds movie_start = milliseconds(150);
  Seconds movie_saving = milliseconds(250);
  std::uint32_t movie_bytes_per_second = 1'000'000;
  std::size_t packet_bytes = 512;
};

/// What it does wrong, each for as many answers as it says; negative: from now on.
struct Faults {
  Seconds latency{};          ///< before every answer
  int hang = 0;               ///< nothing is answered
  int stall = 0;              ///< the pipe is halted instead
  int busy = 0;               ///< "device busy"
  int wrong_transaction = 0;  ///< an answer to another question
  int long_length = 0;        ///< headers announce more than comes
  int short_length = 0;       ///< or less
  int garbage = 0;            ///< random bytes
  int bad_live_view = 0;      ///< a live view that points beyond its end
  int header_alone = 0;       ///< data's header as a transfer of its own: odd, but allowed
  int no_empty_packet = 0;    ///< none behind data that fill their last packet: likewise
};

struct StoredObject {
  std::string name;
  std::uint16_t format = 0;
  std::uint32_t bytes = 0;
  std::uint32_t folder = 0;  ///< a handle; 0: the root
};

/// What waits to be read from the bulk pipe.
struct Outgoing {
  std::vector<std::byte> bytes;
  TimePoint ready;
  bool stalls = false;
};

class Device {
 public:
  explicit Device(DeviceOptions options) : options_(std::move(options)) {}

  [[nodiscard]] const DeviceOptions& options() const { return options_; }
  Faults faults;

  /// Bytes that the host wrote.
  void receive(std::span<const std::byte> bytes, TimePoint now);
  /// Takes at most `most` bytes of what is next to be read; absent: nothing is before `by`. A transfer that
  /// fills its last packet is ended by an empty piece.
  std::optional<Outgoing> take(std::size_t most, TimePoint by);
  /// When the next piece can be read.
  [[nodiscard]] std::optional<TimePoint> next_ready() const;
  /// The request 0x66 of the still image class: all pipes empty, no session.
  void reset();
  /// The request 0x64: what it was about to send is dropped.
  void cancel();
  /// As after the battery was taken out; the card stays.
  void power_on();

  /// The object's bytes from `offset` on: a function of the seed, its handle and the offset.
  [[nodiscard]] std::vector<std::byte> content(std::uint32_t handle, std::uint32_t offset,
                                               std::uint32_t count) const;
  std::uint32_t add_object(StoredObject object);
  [[nodiscard]] const std::map<std::uint32_t, StoredObject>& objects() const { return objects_; }

  /// How often the shutter's phase was drawn: its low byte is the brightness of the live view's first pixel.
  /// The second pixel's is the low byte of the count of pictures.
  [[nodiscard]] int phase_draws() const { return phase_draws_; }
  [[nodiscard]] bool recording_mode() const { return record_mode_; }
  [[nodiscard]] int transactions() const { return transactions_; }
  [[nodiscard]] bool hung_by_empty_message() const { return hung_; }

 private:
  struct Command {
    std::uint16_t operation = 0;
    std::uint32_t transaction = 0;
    std::vector<std::uint32_t> params;
    [[nodiscard]] std::uint32_t param(std::size_t i) const { return i < params.size() ? params[i] : 0; }
  };
  struct Answer {
    std::uint16_t code = 0x2001;
    std::vector<std::uint32_t> params = {};
    std::optional<std::vector<std::byte>> data = {};
  };
  struct Message {
    std::uint32_t type, subtype, script;
    std::vector<std::byte> data;
  };

  void handle(std::span<const std::byte> container, TimePoint now);
  void do_command(const Command& command, std::span<const std::byte> data, TimePoint now);
  Answer answer(const Command& command, std::span<const std::byte> data, TimePoint now);
  Answer answer_chdk(const Command& command, std::span<const std::byte> data, TimePoint now);
  Answer read_message();
  void send(const Command& command, Answer answer, TimePoint ready);
  void queue(std::vector<std::byte> transfer, TimePoint ready);

  [[nodiscard]] std::vector<std::byte> device_info() const;
  [[nodiscard]] std::vector<std::byte> object_info(std::uint32_t handle) const;
  std::vector<std::byte> live_view(TimePoint now);

  void start_script(std::string_view text, TimePoint now);
  void step_script(TimePoint now);
  /// False: it waits and will be tried again.
  bool do_statement(const std::string& statement, TimePoint now);
  void post(std::uint32_t type, std::uint32_t subtype, std::string_view text);
  void post_number(std::uint32_t subtype, std::int32_t number);
  void press_video(TimePoint now);
  /// Lets what was begun come to its end by `now`.
  void live_on(TimePoint now);

  DeviceOptions options_;
  std::vector<std::byte> inbox_;
  std::optional<Command> awaiting_data_;
  std::deque<Outgoing> outbox_;
  bool session_open_ = false;
  bool hung_ = false;
  int transactions_ = 0;

  std::map<std::uint32_t, StoredObject> objects_;
  std::uint32_t next_handle_ = 1;

  std::uint32_t script_ = 0;
  std::deque<std::string> statements_;
  std::optional<TimePoint> sleeping_until_;
  std::deque<Message> messages_out_;
  std::deque<std::string> messages_in_;

  bool record_mode_ = false;
  std::optional<bool> mode_to_;
  TimePoint mode_at_;
  int movie_ = 0;  // as get_movie_status() counts
  int movie_to_ = 0;
  std::optional<TimePoint> movie_at_;
  TimePoint movie_since_;
  int phase_draws_ = 0;
  int pictures_ = 0;
  std::uint64_t draws_ = 0;
};

}  // namespace emberlock::chdk_responder
