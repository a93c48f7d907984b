#pragma once

namespace rover {

// The whole command line program. Returns its exit status: 0; 1 for an internal error, or for
// warnings of `rover check`; 2 for wrong options or input, with one line on stderr that says what
// is wrong, where, and what to do.
int run_program(int argc, const char* const* argv);

}  // namespace rover
