#define EMBERLOCK_ISA baseline
#include "recon/render/march_table.inc"
