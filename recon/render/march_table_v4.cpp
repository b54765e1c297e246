// SPDX-License-Identifier: Apache-2.0
#if defined(__x86_64__)
#define EMBERLOCK_ISA v4
#include "recon/render/march_table.inc"
#endif
