/* In the place of multistep.c and pairing.c where no method looks back. */
#include "stepper.h"

const mbs_stepper mbs_adams = {0, 0, 0, 0, 0, 0, 0, 0.0};
const mbs_stepper mbs_stoermer = {0, 0, 0, 0, 0, 0, 0, 0.0};
const mbs_stepper mbs_verlet = {0, 0, 0, 0, 0, 0, 0, 0.0};
