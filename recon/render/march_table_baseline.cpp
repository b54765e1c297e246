// SPDX-License-Identifier: Apache-2.0
#define EMBERLOCK_ISA baseline
#include "recon/render/march_table.inc"
