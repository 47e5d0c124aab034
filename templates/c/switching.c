/* Switching functions: their values, and on which side of zero they are. */
#include "stepper.h"

/* Whether the values at (t, x) are those that were kept. */
static int kept(const mbs_run *r, double t, const double *x)
{
    int same = t == r->here_time;
    for (int i = 0; i < r->n && same; ++i)
        same = x[i] == r->here_x[i];
    return same;
}

void mbs_keep_switching(mbs_run *r, double t, const double *x)
{
    mbs_copy(r->system->ng, r->values, r->here);
    mbs_copy(r->n, x, r->here_x);
    r->here_time = t;
}

void mbs_switching(mbs_run *r, double t, const double *x)
{
    const mbs_system *s = r->system;
    if (kept(r, t, x)) {
        mbs_copy(s->ng, r->here, r->values);
        return;
    }
    if (s->events->n_in > 6) { /* those of a mode ask for its forces */
        mbs_evaluate(r, t, x);
        r->further = r->multipliers;
    }
    mbs_call(r, s->events, t, x, &r->values);
    for (int i = 0; i < s->switches; ++i)
        r->values[s->ng - s->switches + i] -= s->margins[i];
}

double mbs_side(double value)
{
    return (double)((value > 0.0) - (value < 0.0));
}

int mbs_crossed(const mbs_run *r, int i)
{
    return r->sides[i] * r->values[i] < 0.0 && (!r->system->terminal[i] || r->values[i] > 0.0);
}

int mbs_any_crossed(const mbs_run *r)
{
    for (int i = 0; i < r->system->ng; ++i)
        if (mbs_crossed(r, i))
            return 1;
    return 0;
}

void mbs_note_sides(mbs_run *r)
{
    for (int i = 0; i < r->system->ng; ++i)
        if (r->values[i] != 0.0)
            r->sides[i] = mbs_side(r->values[i]);
}

void mbs_start_events(mbs_run *r)
{
    mbs_fill(r->system->ng, 0.0, r->sides);
    mbs_switching(r, r->state->t, r->x);
    mbs_note_sides(r);
    for (int i = 0; i < r->system->switches; ++i)
        if (r->system->margins[i] >= 0.0)
            r->sides[r->system->ng - r->system->switches + i] = -1.0;
}

/* Where the step cannot be interpolated no function has a value, hence none has crossed. */
void mbs_switching_at(mbs_run *r, mbs_path along, double theta)
{
    if (along(r, theta, r->event_x) != MBS_RUNNING)
        mbs_fill(r->n, NAN, r->event_x);
    mbs_switching(r, r->state->t + theta * r->state->h, r->event_x);
}

double mbs_on_side(mbs_run *r, mbs_path along, int i, double theta)
{
    mbs_switching_at(r, along, theta);
    return r->sides[i] * r->values[i];
}

/* Whether (t, x) lies before all kinks, at one (0), or beyond one (-1). */
static int before_kinks(mbs_run *r, double t, const double *x)
{
    int before = 1;
    mbs_switching(r, t, x);
    for (int i = 0; i < r->system->ng; ++i) {
        if (r->system->terminal[i] || r->sides[i] == 0.0 || (i == r->state->origin && r->chattering))
            continue;
        if (mbs_crossed(r, i))
            return -1;
        before = before && r->values[i] != 0.0;
    }
    return before;
}

double mbs_time_of_slope(mbs_run *r, double t, const double *x)
{
    int here = r->watching && !r->beyond ? before_kinks(r, t, x) : 1;
    if (here > 0)
        return t;
    double earlier = t - MBS_JUST_BEFORE * fabs(t);
    if (before_kinks(r, earlier, x) > 0) {
        r->touched = 1;
        return earlier;
    }
    r->beyond = here < 0;
    return t;
}
