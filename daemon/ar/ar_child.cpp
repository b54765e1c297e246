// SPDX-License-Identifier: Apache-2.0
#include "daemon/ar/ar_child.h"

#include <cerrno>
#include <csignal>
#include <iterator>
#include <string_view>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/clock.h"

namespace emberlock::daemon {
namespace {

constexpr const char* kProgram = "the program that draws the flame";

Error broken(std::string what) { return {ErrorKind::device, std::move(what), kProgram, "Start it again"}; }

/// Sends what goes now. False: nobody reads any more.
bool send_some(int fd, std::string_view& bytes) {
  const ssize_t n = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  bytes.remove_prefix(static_cast<std::size_t>(n));
  return true;
}

}  // namespace

Result<ArChild> ArChild::start(const std::vector<std::string>& command, int niceness) {
  EMBERLOCK_ASSIGN_OR_RETURN(ChildProcess process, ChildProcess::spawn_fed(command, niceness));
  return ArChild(std::move(process));
}

Status ArChild::read_answer(std::optional<v1::ChildMessage>& answer) {
  Status parsed;
  read_all(process_.messages(), [&](std::string_view bytes) {
    if (parsed.ok())
      parsed = parser_.add(bytes, [&](v1::ChildMessage&& message) { answer = std::move(message); });
  });
  if (!parsed.ok()) return broken("sent what can't be understood, " + parsed.error().what);
  if (answer && answer->has_failure()) return Error{ErrorKind::bad_input, answer->failure().message()};
  return {};
}

/// What it told itself has been read already.
Error ArChild::why_it_ended() {
  read_all(process_.errors(), [&](std::string_view bytes) { last_words_.add(bytes); });
  const ChildProcess::Exit exit = process_.reap();
  if (exit.signal == SIGKILL) return broken("was killed by SIGKILL: most likely the memory ran out");
  if (exit.signal != 0) return broken(fmt::format("crashed by signal {}", exit.signal));
  const std::string words = last_words_.text();
  return broken(fmt::format("ended with exit code {}{}{}", exit.code, words.empty() ? "" : ": ", words));
}

Result<v1::ChildMessage> ArChild::ask(const v1::ArInput& input, Seconds patience,
                                      const std::function<bool()>& ending) {
  constexpr int kLook = 50;  // ms, between two looks whether it shall end
  const std::string message = session::framed(input);
  std::string_view rest = message;
  const TimePoint until = SteadyClock().now() + patience;
  std::optional<v1::ChildMessage> answer;
  while (!answer) {
    pollfd polled[] = {{process_.exited(), POLLIN, 0},
                       {process_.messages(), POLLIN, 0},
                       {process_.errors(), POLLIN, 0},
                       {rest.empty() ? -1 : process_.input(), POLLOUT, 0}};
    ::poll(polled, std::size(polled), kLook);
    if (ending()) return Error{ErrorKind::refused, "was ended", kProgram};
    if (polled[3].revents != 0 && !send_some(process_.input(), rest)) rest = {};
    if (polled[2].revents != 0)
      read_all(process_.errors(), [&](std::string_view bytes) { last_words_.add(bytes); });
    if (polled[1].revents != 0) EMBERLOCK_RETURN_IF_ERROR(read_answer(answer));
    if (answer) break;
    if (polled[0].revents != 0) {
      EMBERLOCK_RETURN_IF_ERROR(read_answer(answer));  // what it wrote just before it went
      if (!answer) return why_it_ended();
    }
    if (SteadyClock().now() > until)
      return Error{ErrorKind::timed_out, fmt::format("told nothing for {:g} s", patience.value()), kProgram,
                   "Start it again"};
  }
  return std::move(*answer);
}

}  // namespace emberlock::daemon
