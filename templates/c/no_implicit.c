/* In the place of implicit.c and stages.c where a model has no derivatives, which collocation methods need. */
#include "stepper.h"

const mbs_stepper mbs_implicit = {0, 0, 0, 0, 0, 0, 0, 0.0};
