/* Looks at switching functions within a step, until it is certain that they keep their sign.

   A function that has one sign at both ends of a piece of a step, and changes at rates known there, is certain to keep it
   if its rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way.
   A piece of which neither is true is halved. So a body that can reach another within a step is looked at ever more closely
   where it comes near, and few looks are taken at what stays away. */
#include "stepper.h"

#define LEAST_PIECE 0x1p-40 /* part of a step that is not halved any more */
#define MOST_LOOKS 1000     /* halvings in a step for one function, which is zero but for round-off if they do not suffice */

/* A function's value at theta, a part of the step, and its rates before and after it. */
typedef struct {
    double theta, value, before, after;
} look;

/* A value at both ends and its changes at the rates there do not say that it keeps its sign. */
static int uncertain(double start, double end, double rise, double fall)
{
    double change = end - start, one = fabs(rise - change), other = fabs(fall - change);
    double bend = one > other || isnan(one) ? one : other, least = start < end ? start : end;
    return least < bend && bend > 0.5 * fabs(change);
}

/* A part of the step at which function i is negative on its side, near the first there is; 2 if it never is. */
static double seen(mbs_run *r, mbs_path along, int i, look a, look b, int *left)
{
    if (b.value < 0.0)
        return b.theta;
    double width = b.theta - a.theta;
    if (!uncertain(a.value, b.value, a.after * width, b.before * width) || !(width > LEAST_PIECE) || (*left)-- <= 0)
        return 2.0;
    double half = 0.5 * width, middle = a.theta + half, probe = MBS_PROBE * half;
    double here = mbs_on_side(r, along, i, middle), before = mbs_on_side(r, along, i, middle - probe);
    double after = mbs_on_side(r, along, i, middle + probe);
    if (before < 0.0)
        return middle - probe;
    look m = {middle, here, (here - before) / probe, (after - here) / probe};
    double found = seen(r, along, i, a, m, left);
    return found > 1.0 ? seen(r, along, i, m, b, left) : found;
}

double mbs_first_seen(mbs_run *r, mbs_path along, int i, double start, double after, double before, double end)
{
    double rise = (after - start) / MBS_PROBE, fall = (end - before) / MBS_PROBE;
    int left = MOST_LOOKS;
    if (!(end < 0.0) && !uncertain(start, end, rise, fall))
        return 2.0;
    look a = {0.0, start, rise, rise}, b = {1.0, end, fall, fall};
    return seen(r, along, i, a, b, &left);
}
