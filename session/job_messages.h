// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "emberlock/v1/jobs.pb.h"
#include "session/export.h"
#include "session/salvage.h"
#include "session/verify.h"

namespace emberlock::session {

// What came of a job, as it goes to other processes.
v1::JobOutcome to_outcome(const SalvageReport& report);
v1::JobOutcome to_outcome(const SessionCheck& check);  ///< ok: the session is whole
v1::JobOutcome to_outcome(const RepairReport& report);
v1::JobOutcome to_outcome(const ExportReport& report);

SessionCheck from_proto(const v1::VerifyReport& report);
RepairReport from_proto(const v1::RepairReport& report);
ExportReport from_proto(const v1::ExportReport& report);

}  // namespace emberlock::session
