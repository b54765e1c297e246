// SPDX-License-Identifier: Apache-2.0
#include "recon/export/certificate.h"

#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

#include "recon/export/vdb_header.h"
#include "tests/fuzz/target.h"

namespace {

using namespace emberlock;

/// What is taken for a certificate can be written again, and is the same then.
template <class Certificate>
void check_round_trip(const Certificate& certificate,
                      Result<Certificate> (*parse)(std::string_view, const std::string&)) {
  const auto text = session::certificate_text(certificate, nullptr);
  if (!text) return;  // a text that isn't UTF-8
  const auto again = parse(*text, "input");
  if (!again || !session::place_of_seal(*text, "input")) std::abort();
  if (*session::certificate_text(*again, nullptr) != *text) std::abort();
}

}  // namespace

// A certificate's text, of a session or a volume, and the header of a volume in which it lies.
FUZZ_TARGET(certificate) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  std::istringstream file(bytes);
  const auto found = recon::find_vdb_text(file, recon::kCertificateKey, "input");
  if (found && *found && (*found)->offset + (*found)->text.size() > size) std::abort();
  const std::string& text = found && *found ? (*found)->text : bytes;
  if (const auto place = session::place_of_seal(text, "input"); place) {
    const auto seal =
        session::parse_seal(std::string_view(text).substr(*place, session::kSealLength), "input");
    if (seal && seal->sha256.size() != 64) std::abort();
  }
  if (const auto volume = session::parse_volume_certificate(text, "input"); volume)
    check_round_trip(*volume, session::parse_volume_certificate);
  if (const auto recorded = session::parse_session_certificate(text, "input"); recorded)
    check_round_trip(*recorded, session::parse_session_certificate);
  return 0;
}
