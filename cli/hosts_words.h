// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "emberlock/v1/services.pb.h"
#include "emberlock/v1/status.pb.h"

// What a terminal shows of a rig whose cameras are several hosts'.
namespace emberlock::cli {

/// Another clock: "5.000 s ahead ± 80 us", "120 us behind ± 90 us".
std::string clock_in_words(double ahead_s, double sigma_s);
/// "lab-2:7143: green, connected, 3 cameras, clock 5.000 s ahead ± 80 us, round trip 0.2 ms, 1 part wanting";
/// of one that isn't green also why.
std::string host_line(const v1::HostStatus& host);
/// Another host's part of a recording: "lab-2:7143: whole, 3 cameras, 720 frames, 2 lost". Of one that is
/// missing or short, why.
std::string part_line(const v1::HostPart& part);
/// All of them in few words: "2 other hosts: 1 recording, 1 missing"; empty where there is none.
std::string parts_in_words(const v1::RecordingStatus& recording);
/// Whether a part isn't whole and isn't being recorded.
bool is_wanting(const v1::HostPart& part);
/// Of a listed session: "parts on 2 other hosts, 1 wanting", "led by lab-1"; empty of one host's own.
std::string hosts_in_words(const v1::ListSessionsResponse::Entry& session);

}  // namespace emberlock::cli
