// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include "rig/access.h"

namespace emberlock::test {

/// From when until when a certificate is good, in seconds from now; and the bits of an RSA key, 0: P-256.
struct CertificateKind {
  long from = -3600, until = 3600;
  unsigned rsa_bits = 0;
};

/// Signs certificates, which are good for an hour unless another time is given.
class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& name = "who vouches in tests")
      : key_(EVP_EC_gen("P-256"), EVP_PKEY_free), own_(nullptr, X509_free) {
    own_ = make(name, key_.get(), {{NID_basic_constraints, "critical,CA:TRUE"}}, {});
  }

  [[nodiscard]] std::string pem() const { return pem_of(own_.get()); }
  /// For the DNS name or the address `host`, and this machine's address in numbers if that is "localhost".
  [[nodiscard]] rig::TlsIdentity issue(const std::string& host, const CertificateKind& kind = {}) const {
    const Key key(kind.rsa_bits == 0 ? EVP_EC_gen("P-256") : EVP_RSA_gen(kind.rsa_bits), EVP_PKEY_free);
    const bool address = host.find_first_not_of("0123456789.") == std::string::npos;
    const std::string names =
        (address ? "IP:" : "DNS:") + host + (host == "localhost" ? ",IP:127.0.0.1" : "");
    return {pem_of(make(host, key.get(), {{NID_subject_alt_name, names.c_str()}}, kind).get()),
            pem_of(key.get())};
  }

 private:
  using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
  using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
  struct Extension {
    int nid;
    const char* value;
  };

  Certificate make(const std::string& name, EVP_PKEY* key, std::initializer_list<Extension> extensions,
                   const CertificateKind& kind) const {
    Certificate made(X509_new(), X509_free);
    X509* const issuer = own_ ? own_.get() : made.get();
    X509_set_version(made.get(), 2);
    ASN1_INTEGER_set(X509_get_serialNumber(made.get()), ++serial_);
    X509_gmtime_adj(X509_getm_notBefore(made.get()), kind.from);
    X509_gmtime_adj(X509_getm_notAfter(made.get()), kind.until);
    X509_set_pubkey(made.get(), key);
    X509_NAME_add_entry_by_txt(X509_get_subject_name(made.get()), "CN", MBSTRING_ASC,
                               reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
    X509_set_issuer_name(made.get(), X509_get_subject_name(issuer));
    X509V3_CTX context;
    X509V3_set_ctx_nodb(&context);
    X509V3_set_ctx(&context, issuer, made.get(), nullptr, nullptr, 0);
    for (const Extension& wanted : extensions) {
      X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, wanted.nid, wanted.value);
      X509_add_ext(made.get(), extension, -1);
      X509_EXTENSION_free(extension);
    }
    if (X509_sign(made.get(), key_.get(), EVP_sha256()) == 0)
      throw std::runtime_error("OpenSSL made no certificate");
    return made;
  }
  template <class Write>
  static std::string written(Write write) {
    const std::unique_ptr<BIO, decltype(&BIO_free)> out(BIO_new(BIO_s_mem()), BIO_free);
    write(out.get());
    char* bytes = nullptr;
    const long size = BIO_get_mem_data(out.get(), &bytes);
    return {bytes, static_cast<std::size_t>(size)};
  }
  static std::string pem_of(X509* certificate) {
    return written([&](BIO* out) { PEM_write_bio_X509(out, certificate); });
  }
  static std::string pem_of(EVP_PKEY* key) {
    return written(
        [&](BIO* out) { PEM_write_bio_PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr); });
  }

  Key key_;
  Certificate own_;
  mutable int serial_ = 0;
};

/// `text` as a file that its owner alone may read.
inline void write_secret(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  std::filesystem::permissions(file,
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

}  // namespace emberlock::test
