#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace emberlock::test {

/// A certificate for "localhost" that vouches for itself, and its key.
inline void make_certificate(const std::filesystem::path& certificate, const std::filesystem::path& key) {
  const std::string command =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 30 -subj /CN=localhost "
      "-addext "
      "subjectAltName=DNS:localhost -out '" +
      certificate.string() + "' -keyout '" + key.string() + "' 2>/dev/null";
  if (std::system(command.c_str()) != 0) throw std::runtime_error("openssl made no certificate");
}

}  // namespace emberlock::test
