// SPDX-License-Identifier: Apache-2.0
// `emberlock devices clips`: downloads what a camera has filmed onto its card, for `emberlock import`.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "cli/commands.h"
#include "drivers/ptp/clips.h"
#include "drivers/ptp/connection.h"
#include "session/name.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct ClipsArguments {
  std::string id;
  std::string out;
};

/// A clip that was already downloaded and is intact isn't downloaded again.
Status fetch_clip(drivers::PtpSession& session, const drivers::Clip& clip, const fs::path& target) {
  std::error_code ec;
  const bool there = fs::exists(target, ec);
  EMBERLOCK_RETURN_IF_ERROR(there ? drivers::verify_clip(target)
                                  : drivers::download_clip(session, clip, target, progress_bar(clip.name)));
  std::printf("%s: %.1f MB%s\n", target.c_str(), clip.bytes * 1e-6, there ? ", there already" : "");
  return {};
}

Status fetch_clips(const ClipsArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const drivers::PtpConnection connection, drivers::connect_ptp(arguments.id));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<drivers::Clip> clips,
                             drivers::list_clips(*connection.session));
  if (clips.empty()) {
    return Error{ErrorKind::bad_input, "its card shows no movies", arguments.id,
                 "Switch the camera to playback, and try again; many list their card in that mode only"};
  }
  const fs::path folder = fs::path(arguments.out) / connection.id;
  for (const drivers::Clip& clip : clips) {
    if (!session::is_folder_name(clip.name))
      return Error{ErrorKind::device, fmt::format("a movie's name can't be a file's: '{}'", clip.name),
                   arguments.id};
    EMBERLOCK_RETURN_IF_ERROR(fetch_clip(*connection.session, clip, folder / clip.name));
  }
  return {};
}

}  // namespace

void add_clips(const Verb& devices) {
  auto a = std::make_shared<ClipsArguments>();
  const Verb verb =
      devices.add_verb("clips",
                       "Downloads the movies on a USB camera's card, with their checksums. Movies that "
                       "were downloaded before are skipped. The card is only read. `emberlock import "
                       "OUT` makes a session of several cameras' movies.");
  verb.add_option("ID", a->id, "The camera, as `emberlock devices` names it").require();
  verb.add_option("--out", a->out, "Folder for the movies, in a subfolder per camera").require();
  verb.set_action([a] {
    if (const Status done = fetch_clips(*a); !done) fail(done.error());
  });
}

}  // namespace emberlock::cli
