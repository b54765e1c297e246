// SPDX-License-Identifier: Apache-2.0
// Carries the headers that sanitizers' builds precompile: tests/CMakeLists.txt lists them.
