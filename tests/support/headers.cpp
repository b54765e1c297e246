// Carries the headers that sanitizers' builds precompile: tests/CMakeLists.txt lists them.
