// SPDX-License-Identifier: Apache-2.0
#include "paper/command.h"

int main(int argc, char** argv) { return emberlock::paper::run_command(argc, argv); }
