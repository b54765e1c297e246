// SPDX-License-Identifier: Apache-2.0
#include "cli/certificate_options.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/clock.h"
#include "cli/reconstruct_arguments.h"

namespace emberlock::cli {
namespace {

/// Those that were given and change the volume, but for what the certificate tells by itself: the input's
/// frame, files, voxels and the device.
void tell_options(const ReconstructArguments& given, v1::Reconstruction& told) {
  const ReconstructArguments usual;
  const auto add = [&](const char* name, const auto& value, const auto& unasked) {
    if (value == unasked) return;
    v1::Reconstruction::Option& option = *told.add_options();
    option.set_name(name);
    option.set_value(fmt::format("{}", value));
  };
  const auto add_optional = [&](const char* name, const std::optional<double>& value) {
    if (value) add(name, *value, std::nan(""));
  };
  add("solver", given.solver, usual.solver);
  add("effects", given.effects, usual.effects);
  add("box", given.box, usual.box);
  add("hold-out", fmt::format("{}", fmt::join(given.held_out, ",")), std::string());
  add("views", given.views, usual.views);
  add("iterations", given.iterations, usual.iterations);
  add("keep-poses", given.keep_poses, usual.keep_poses);
  add("step", given.step, usual.step);
  add("precision", given.precision, usual.precision);
  add_optional("budget", given.budget);
  add_optional("target-rmse", given.target_rmse);
  add_optional("threshold", given.threshold);
  add("shrink", given.shrink, usual.shrink);
  add("background", given.background, usual.background);
  add("smear", given.smear, usual.smear);
  add("demosaic", given.demosaic, usual.demosaic);
  add("quantity", given.quantity, usual.quantity);
  add("emitter", given.emitter, usual.emitter);
  add("lines", given.lines, usual.lines);
  add("errors", given.errors, usual.errors);
  add("seed", given.seed, usual.seed);
  add("cold", given.cold, usual.cold);
  if (given.part)
    add("instants", fmt::format("{}, {:.6f} of a period behind the frame", given.instants, *given.part),
        std::string());
}

std::string words_of(const recon::Certification& certification, Seconds time) {
  std::string words = certification.key ? "signed by " + certification.key->public_key() : "unsigned";
  const v1::VolumeCertificate& certificate = certification.certificate;
  if (certificate.hashes_left_out()) return words + "; without the files' hashes";
  std::uint64_t bytes = 0;
  for (const auto& file : certificate.session().files()) bytes += file.bytes();
  for (const auto& file : certificate.made_from()) bytes += file.bytes();
  return words + fmt::format("; {} files, {:.1f} MB, hashed in {:.2f} s",
                             certificate.session().files_size() + certificate.made_from_size(),
                             static_cast<double>(bytes) / 1e6, time.value());
}

}  // namespace

Option add_key_option(const Verb& verb, std::string& key) {
  return verb.add_option(
      "--key", key,
      "Sign the certificate with this private Ed25519 key (PEM), as `openssl genpkey -algorithm "
      "ed25519 -out FILE` makes it [unsigned]");
}

void add_certificate_options(const Verb& verb, CertificateArguments& a) {
  add_key_option(verb, a.key);
  verb.add_flag("--no-file-hashes", a.no_file_hashes,
                "Leave out of the certificate the hashes of the files that the volume is made of");
}

Result<std::shared_ptr<const SigningKey>> key_of(const std::string& file) {
  if (file.empty()) return std::shared_ptr<const SigningKey>();
  EMBERLOCK_ASSIGN_OR_RETURN(SigningKey key, SigningKey::read(file));
  return std::make_shared<const SigningKey>(std::move(key));
}

Result<Certified> certify(const ReconstructArguments& arguments, const Progress& progress,
                          const std::function<bool()>& stop) {
  const CertificateArguments& asked = arguments.certificate;
  SteadyClock clock;
  const TimePoint begin = clock.now();
  Certified certified;
  EMBERLOCK_ASSIGN_OR_RETURN(certified.certification.key, key_of(asked.key));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::SceneOptions options, scene_options_of(arguments));
  std::vector<std::filesystem::path> further;
  if (!arguments.response.empty()) further.emplace_back(arguments.response);
  const Observer observer = [&](double fraction, std::string_view file) {
    tell(progress, fraction, fmt::format("hashing {}", file));
    return !stop || !stop();
  };
  recon::FileHashes* const hashes = asked.no_file_hashes ? nullptr : asked.hashes.get();
  v1::VolumeCertificate& certificate = certified.certification.certificate;
  EMBERLOCK_ASSIGN_OR_RETURN(certificate,
                             recon::origin_of(arguments.input, options, further, hashes, observer));
  certificate.set_program(asked.program);
  tell_options(arguments, *certificate.mutable_reconstruction());
  certified.words = words_of(certified.certification, clock.now() - begin);
  return certified;
}

}  // namespace emberlock::cli
