#include "rover/cli/program.h"

int main(int argc, char** argv) { return rover::run_program(argc, argv); }
