/* In the place of events.c, looks.c and turns.c where a system has no switching functions. */
#include "stepper.h"

void mbs_start_events(mbs_run *r)
{
    (void)r;
}

void mbs_begin_watch(mbs_run *r)
{
    (void)r;
}

double mbs_longest(mbs_run *r)
{
    (void)r;
    return HUGE_VAL;
}

double mbs_time_of_slope(mbs_run *r, double t, const double *x)
{
    (void)r, (void)x;
    return t;
}

int mbs_stuck_at_kink(const mbs_run *r, int status)
{
    (void)r, (void)status;
    return 0;
}

int mbs_find_event(mbs_run *r, int status)
{
    (void)r;
    return status;
}
