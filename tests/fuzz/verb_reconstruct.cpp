// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/target.h"
#include "tests/support/fuzz_verbs.h"

FUZZ_TARGET(verb_reconstruct) { return emberlock::test::fuzz_reconstruct(data, size); }
