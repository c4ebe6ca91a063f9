"""From CasADi functions to machine code, by way of LLVM: no compiler is asked for."""
