/* Looks at switching functions within a step, until it is certain that they keep their sign.

   A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep it
   if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way.
   A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever more closely
   where it comes near, and few looks are taken at what stays away. */
#include "stepper.h"


/* A function's value at theta, a part of the step, and its rates before and after it. */
typedef struct {
    double theta, value, before, after;
} look;

/* A value at both ends and its changes at the rates there do not say that it keeps its sign, and not all of it is as small
   as `unseen`. */
static int uncertain(double start, double end, double rise, double fall, double unseen)
{
    double change = end - start, one = fabs(rise - change), other = fabs(fall - change);
    double bend = one > other || isnan(one) ? one : other, least = start < end ? start : end;
    if (start <= unseen && end <= unseen && bend <= unseen)
        return 0;
    return least < bend && bend > 0.5 * fabs(change);
}

double mbs_unseen(mbs_run *r, int i)
{
    int own = i - (r->system->ng - r->system->switches);
    if (own >= 0 && r->system->margins[own] != 0.0)
        return MBS_BESIDE * fabs(r->system->margins[own]);
    double size = mbs_largest(r->n, r->x);
    for (int j = 0; j < r->n; ++j)
        r->spare[j] = r->x[j] + MBS_MOVED * (0.5 + fmod(j * MBS_GOLDEN, 1.0)) * size;
    mbs_switching(r, r->state->t, r->spare);
    double beside = r->values[i];
    mbs_switching(r, r->state->t, r->x);
    return MBS_BESIDE * MBS_EPSILON / MBS_MOVED * fabs(beside - r->values[i]);
}

/* The part of the step over which rates in the middle of a piece are measured. */
static double probe_of(double half)
{
    double part = MBS_PROBE * half, most = MBS_MOST_PROBE * half;
    double least = most < MBS_LEAST_PROBE ? most : MBS_LEAST_PROBE;
    return part > least ? part : least;
}

/* A part of the step at which function i is negative on its side, near the first there is; 2 if it never is. */
static double seen(mbs_run *r, mbs_path along, int i, look a, look b, double unseen, int *left)
{
    if (b.value < 0.0)
        return b.theta;
    double width = b.theta - a.theta;
    if (!uncertain(a.value, b.value, a.after * width, b.before * width, unseen) || !(width > MBS_LEAST_PIECE) ||
        (*left)-- <= 0)
        return 2.0;
    double half = 0.5 * width, middle = a.theta + half, probe = probe_of(half);
    double here = mbs_on_side(r, along, i, middle), before = mbs_on_side(r, along, i, middle - probe);
    double after = mbs_on_side(r, along, i, middle + probe);
    if (before < 0.0)
        return middle - probe;
    look m = {middle, here, (here - before) / probe, (after - here) / probe};
    double found = seen(r, along, i, a, m, unseen, left);
    return found > 1.0 ? seen(r, along, i, m, b, unseen, left) : found;
}

/* The state at theta, put onto the constraints. */
static int settled(mbs_run *r, double theta, double *x)
{
    int status = mbs_value(r, theta, x);
    if (status == MBS_RUNNING)
        mbs_settle_sample(r, r->state->t + theta * r->state->h, x);
    return status;
}

double mbs_first_seen(mbs_run *r, mbs_path along, int i, double start, double after, double before, double end)
{
    double rise = (after - start) / MBS_PROBE, fall = (end - before) / MBS_PROBE;
    int left = MBS_MOST_LOOKS;
    if (!(end < 0.0) && !uncertain(start, end, rise, fall, 0.0))
        return 2.0;
    double unseen = mbs_unseen(r, i);
    if (along == mbs_value && start <= unseen && end <= unseen) { /* others may hold it there: off them it is anything */
        along = settled;
        rise = (mbs_on_side(r, along, i, MBS_PROBE) - start) / MBS_PROBE;
        fall = (end - mbs_on_side(r, along, i, 1.0 - MBS_PROBE)) / MBS_PROBE;
    }
    look a = {0.0, start, rise, rise}, b = {1.0, end, fall, fall};
    return seen(r, along, i, a, b, unseen, &left);
}

/* The step in which a function at `now` is sure to change by no more than is allowed, `least` at any rate, with its rate b
   and half of the rate of that, c. */
static double reach(double now, double least, double b, double c)
{
    double part = MBS_MOST_CHANGE * fabs(now), allowed = part > least ? part : least;
    double rate = fabs(b) + sqrt(b * b + 4.0 * fabs(c) * allowed);
    return rate > 0.0 ? 2.0 * allowed / rate : HUGE_VAL;
}

/* The way from t to the next moment over which no step leads, later than round-off tells apart. */
static double to_moment(const mbs_system *s, double t)
{
    int low = 0, high = s->moment_count;
    double here = t + 16.0 * MBS_EPSILON * fabs(t);
    while (low < high) {
        int middle = (low + high) / 2;
        if (s->moments[middle] > here)
            high = middle;
        else
            low = middle + 1;
    }
    return low < s->moment_count ? s->moments[low] - t : HUGE_VAL;
}

double mbs_longest(mbs_run *r)
{
    const mbs_system *s = r->system;
    if (s->switches == 0)
        return to_moment(s, r->state->t);
    double count = mbs_largest(r->n, r->slope) > 0.0 ? MBS_LEAST_STEPS : MBS_STANDING;
    double whole = r->problem->whole > 0.0 ? r->problem->whole : r->problem->t_end - r->problem->t0;
    double longest = whole / count, t = r->state->t, seen = r->past[0];
    double way = to_moment(s, t);
    longest = way < longest ? way : longest;
    if (s->limits == 0)
        return longest;
    double *latest = r->past + 3, *before = latest + s->limits, *largest = before + s->limits;
    double late = t - r->past[1], early = r->past[1] - r->past[2];
    mbs_switching(r, t, r->x);
    for (int i = 0; i < s->limits; ++i) {
        int place = s->limiting[i];
        double now = r->values[s->ng - s->switches + place], b = 0.0, c = 0.0, size = fabs(now);
        largest[i] = seen > 0.0 && largest[i] > size ? largest[i] : size;
        if (seen > 0.0)
            b = (now - latest[i]) / late;
        if (seen > 1.0) {
            c = (b - (latest[i] - before[i]) / early) / (late + early);
            b += c * late;
        }
        double short_of = -s->margins[place]; /* where a function that must not get to zero ends */
        double found = reach(now, short_of > 0.0 ? short_of : MBS_MOST_OF_ALL * largest[i], b, c);
        longest = found < longest ? found : longest;
        before[i] = latest[i];
        latest[i] = now;
    }
    r->past[2] = r->past[1];
    r->past[1] = t;
    r->past[0] = seen < 2.0 ? seen + 1.0 : 2.0;
    return longest;
}
