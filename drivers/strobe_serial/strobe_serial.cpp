// SPDX-License-Identifier: Apache-2.0
#include "drivers/strobe_serial/strobe_serial.h"

#include <fmt/format.h>

#include "base/clock.h"
#include "drivers/strobe_serial/port.h"
#include "drivers/strobe_serial/serial_strobe.h"

namespace emberlock::drivers {
namespace {

constexpr int kSlowestBaud = 300, kFastestBaud = 4000000;

Result<std::unique_ptr<SerialStrobe>> connect(const std::string& id, const SerialStrobeRequest& request,
                                              std::string& model) {
  EMBERLOCK_ASSIGN_OR_RETURN(auto dialect, make_dialect(request.dialect, request.options));
  const int baud = request.baud.value_or(dialect->framing().baud);
  if (baud < kSlowestBaud || baud > kFastestBaud) {
    return Error{ErrorKind::bad_input, fmt::format("baud is {}", baud), "strobe " + id,
                 fmt::format("give {} to {}", kSlowestBaud, kFastestBaud)};
  }
  const auto opener = [id, baud]() -> Result<std::unique_ptr<Wire>> {
    EMBERLOCK_ASSIGN_OR_RETURN(const strobe_serial::Port port, strobe_serial::find_port(id));
    return strobe_serial::open_port(port, baud);
  };
  auto strobe =
      std::make_unique<SerialStrobe>(id, std::move(dialect), opener, std::make_shared<SteadyClock>());
  EMBERLOCK_ASSIGN_OR_RETURN(model, strobe->greet(request.patience));
  return strobe;
}

}  // namespace

Result<std::vector<StrobeFound>> find_serial_strobes() {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto ports, strobe_serial::list_ports());
  std::vector<StrobeFound> found;
  found.reserve(ports.size());
  for (const auto& port : ports)
    found.push_back(
        {strobe_serial::id_of(port, ports), port.description, port.address, holder_of(port.address)});
  return found;
}

Result<std::unique_ptr<Strobe>> open_serial_strobe(const std::string& id,
                                                   const SerialStrobeRequest& request) {
  std::string model;
  EMBERLOCK_ASSIGN_OR_RETURN(auto strobe, connect(id, request, model));
  return std::unique_ptr<Strobe>(std::move(strobe));
}

Result<StrobeIdentity> identify_strobe(const std::string& id, std::optional<int> baud) {
  // Our controller first, because only it may need time to boot. Then those with *IDN?, which other devices
  // tolerate; Siglent before the general one.
  constexpr StrobeDialect kOrder[] = {StrobeDialect::emberlock, StrobeDialect::siglent_bswv,
                                      StrobeDialect::scpi, StrobeDialect::gardasoft_rt,
                                      StrobeDialect::schott_cv_ls};
  Error last;
  for (const StrobeDialect dialect : kOrder) {
    const Seconds patience(dialect == StrobeDialect::emberlock ? 3 : 1);
    std::string model;
    const auto strobe = connect(id, {.dialect = dialect, .baud = baud, .patience = patience}, model);
    if (strobe) return StrobeIdentity{dialect, model};
    last = strobe.error();
    if (last.kind == ErrorKind::bad_input || !strobe_serial::find_port(id)) return last;
  }
  last.remedy = "check that it is switched on; give its baud rate, if that was changed";
  return last;
}

}  // namespace emberlock::drivers
