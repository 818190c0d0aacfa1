#include "apps/vdvr/program.hpp"

int main(int argc, char** argv) { return vdvr::cli::run_program({argv + 1, argv + argc}); }
