/* In the place of singular.c where a system has no constraint rows, which then never become dependent. */
#include "stepper.h"

void mbs_begin_approach(mbs_run *r)
{
    (void)r;
}

void mbs_note_independence(mbs_run *r, double t)
{
    (void)r, (void)t;
}

int mbs_put_onto_rows(mbs_run *r, double t, double *x)
{
    (void)r, (void)t, (void)x;
    return MBS_RUNNING;
}

int mbs_closed(mbs_run *r, double t, const double *x, double *closed)
{
    (void)t;
    mbs_copy(r->n, x, closed);
    return MBS_RUNNING;
}

int mbs_restart_approach(mbs_run *r)
{
    (void)r;
    return MBS_RUNNING;
}

void mbs_advance_approach(mbs_run *r)
{
    (void)r;
}

int mbs_comes_unforeseen(const mbs_run *r)
{
    (void)r;
    return 0;
}


int mbs_turns_stiff(mbs_run *r)
{
    (void)r;
    return 0;
}

int mbs_verify_approach(mbs_run *r, double t)
{
    (void)r, (void)t;
    return MBS_RUNNING;
}

int mbs_verify_end(mbs_run *r, double t)
{
    (void)r, (void)t;
    return MBS_RUNNING;
}

double mbs_noise(const mbs_run *r)
{
    (void)r;
    return 0.0;
}

double mbs_retreat(mbs_run *r, double h, double otherwise)
{
    (void)r, (void)h;
    return otherwise;
}

double mbs_laid(const mbs_run *r, double h)
{
    (void)r;
    return h;
}

void mbs_find_singular(mbs_run *r)
{
    (void)r;
}
