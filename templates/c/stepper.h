/* Interface between the integration loop and the families of methods; users of a model need runtime.h only. */
#ifndef MBS_STEPPER_H
#define MBS_STEPPER_H

#include "runtime.h"
#include "vectors.h"

typedef struct mbs_run mbs_run;

/* A family of methods. A step goes from (t, x), where the slope is `slope`, to (t_new, x_new) over h. The loop calls
   restart, then for each step attempt (until one is good enough), finish and advance; value in between. */
typedef struct {
    /* Doubles of work space of its own: r->own. */
    long long (*work)(const mbs_problem *problem);
    /* Nothing before x counts: at the start and where an event has ended a step. */
    void (*restart)(mbs_run *r);
    /* Fill x_new and, unless the step is fixed, the error, and coarse where there are two estimates. Any h may
       come, shorter or longer than the one before. */
    int (*attempt)(mbs_run *r, double h, double t_new);
    /* Fill slope_new, the slope at x_new, which has been normalised and projected (then `changed` is not 0). */
    int (*finish)(mbs_run *r, double t_new, int changed);
    /* The step is accepted: x_new and slope_new are about to become x and slope. */
    void (*advance)(mbs_run *r);
    /* Evaluate what the value between the ends of a finished step needs; called once in a step, before the first. */
    int (*extend)(mbs_run *r);
    /* The state at t + theta h in the step that is finished and extended, 0 <= theta <= 1 or
       hardly more. */
    void (*value)(const mbs_run *r, double theta, double *x);
    /* A step that could grow, but by less than this factor, stays as it is. */
    double least_growth;
} mbs_stepper;

extern const mbs_stepper mbs_explicit, mbs_implicit, mbs_adams, mbs_stoermer, mbs_verlet;

/* The problem, its state and the parts of the work space. */
struct mbs_run {
    const mbs_problem *problem;
    const mbs_method *method;
    const mbs_system *system;
    const mbs_stepper *stepper;
    mbs_state *state;
    int n;
    double *x, *x_new, *slope_new, *error, *coarse;
    double *event_x;        /* the state at the event that ends the step, where state->crossing >= 0 */
    double *values, *sides; /* of the switching functions: signs of the sides on which they were last seen */
    double *looks;          /* and their values at both ends of a step, and near them */
    double *here, *here_x, here_time; /* those kept at the end of a step, where the next one starts */
    double *settled, *kept; /* for the states of slopes that are put onto constraints, and for those put there */
    double *stage, *spare, *correction; /* for whoever needs them: nothing stays in them from one call to the next */
    double *past;           /* how many looks, at most 2, were taken at the functions that keep steps short, the times of the
                               latest and of the one before, then their values, and the largest sizes seen */
    double *slope, *own;                /* own follows slope: a first stage at x is row 0 of an array from slope on */
    double *inputs, *multipliers, *rows, *others, *report;
    double *known_x, *known_slope, known_time; /* the state of the latest slope, with `multipliers` and `report`: switching
                                                  functions, and steps that begin there, solve nothing again */
    const double *further; /* the input that some programs have beyond those of all */
    double drift_position, drift_velocity, removed_position, removed_velocity, deviation; /* of the step on trial */
    double residual; /* largest scaled residual of dependent rows in it */
    int watching;    /* there are kinks to look out for */
    int beyond;      /* a slope of the step on trial was taken beyond one, ... */
    int touched;     /* ... or just before one that it is at but for round-off */
    double left;     /* so soon the function at whose event the step starts has left zero, ... */
    int chattering;  /* ... unless it turns back at once ... */
    int flipped;     /* ... and is let to */
    double below;    /* the part of the step at which a stop that is above zero at both its ends is seen below it, or 2 */
    double retaken;  /* the error of an adaptive step that was taken again to just before an event */
};

/* ---- calls.c ---- */

/* Note when and where a run failed; returns `status`. */
int mbs_failed(mbs_run *r, int status, double time, int component);

/* MBS_RUNNING if all values (n) are finite. */
int mbs_all_finite(mbs_run *r, double time, const double *values);

/* Call a program of the system at (t, x), with the inputs that its program for them gives. */
void mbs_call(mbs_run *r, const mbs_program *program, double t, const double *x, double *const *out);

/* Fill known_slope, multipliers and report at (t, x). */
void mbs_evaluate(mbs_run *r, double t, const double *x);

/* The state at t + theta h in the step that is finished, as interpolated. */
int mbs_value(mbs_run *r, double theta, double *x);

/* The cubic through x and x_new with their slopes, at t + theta h. */
void mbs_hermite(const mbs_run *r, double theta, double *x);

/* The size of y in units of noise and the tolerance at x and x_new, in the mean square; `worst`: the component with most
   of it. */
double mbs_scaled_norm(const mbs_run *r, const double *y, const double *x, const double *x_new, double noise, int *worst);

/* ---- constraints.c ---- */

/* Whether there are rows on positions, or on `speeds`. */
int mbs_has_rows(const mbs_system *s, int speeds);

/* The largest |row| on positions, or on `speeds`, at (t, x); the rows stay in r->rows. */
double mbs_violation(mbs_run *r, int speeds, double t, const double *x);

/* The index of the largest of r->rows. */
int mbs_worst_row(const mbs_run *r);

/* Quaternions of x to unit length; `deviation` receives how far the worst was from it. */
void mbs_normalize(mbs_run *r, double t, double *x, double *deviation);

/* Put x back onto the constraints, until |row| is below `goal` or gets no better; fills removed_ and drift_ of
   both levels. */
int mbs_project(mbs_run *r, double t, double *x, double goal);

/* The same of a state beside the step on trial, of which nothing is noted. */
int mbs_project_aside(mbs_run *r, double t, double *x, double goal);

/* The component that settling has moved most, if by more than a tenth of the way from r->x, round-off and what is
   allowed; else -1. Such a step has gone over a kink in the constraints, of which the error estimate knows nothing, or
   settled on another branch of the motion. */
int mbs_moved_far(const mbs_run *r, const double *before, const double *settled, double allowed);

/* Normalise a state between steps and put it back onto the constraints; where that fails it stays as it is. */
void mbs_settle_sample(mbs_run *r, double t, double *x);

/* ---- singular.c, or no_rows.c ---- */

/* Put x onto the constraints as far as round-off lets it be; nothing is recorded of it. */
int mbs_put_onto_rows(mbs_run *r, double t, double *x);

/* `closed` receives x put onto the constraints, if that does not move it far. */
int mbs_closed(mbs_run *r, double t, const double *x, double *closed);

/* The slope at the start of the step, at x put onto the constraints, wherever that is; nothing is noted of it. */
int mbs_slope_on_rows(mbs_run *r, const double *x, double *slope);

/* How near the rows come to dependence: a trial begins; */
void mbs_begin_approach(mbs_run *r);

/* a slope has been evaluated; */
void mbs_note_independence(mbs_run *r, double t);

/* a stage, in whose equations rows are, has been found at (t, x); */
void mbs_look_at_rows(mbs_run *r, double t, const double *x);

/* nothing before the latest slope counts, which is no singular position; */
int mbs_restart_approach(mbs_run *r);

/* the step is accepted; */
void mbs_advance_approach(mbs_run *r);

/* the trial comes neither near unforeseen nor too near; */
int mbs_verify_approach(mbs_run *r, double t);

/* nor does its end, which is on the branch it came by. */
int mbs_verify_end(mbs_run *r, double t);

/* The part of the speeds by which round-off may falsify the step on trial: rows that hold to eps let coordinates be off
   them by eps/s at the distance s, speeds by eps/s^2, and accelerations by eps/s^3. */
double mbs_noise(const mbs_run *r);

/* The trial comes near a singular position and was not made for that. */
int mbs_comes_unforeseen(const mbs_run *r);

/* A trial that failed as others of the step, but not as it came too near, is to be made again with a Jacobian of such
   slopes, and those after it, as with stiff forces; 0 if it is not. */
int mbs_turns_stiff(mbs_run *r);

/* Over which part of a step over h, that failed, to make the next: `otherwise` far from singular positions. */
double mbs_retreat(mbs_run *r, double h, double otherwise);

/* How long to make a step that might be h. */
double mbs_laid(const mbs_run *r, double h);

/* Note which singular positions the step that is finished has passed. */
void mbs_find_singular(mbs_run *r);

/* ---- switching.c, or no_events.c ---- */

/* A way from x on: the continuous extension of a step, or straight on. */
typedef int (*mbs_path)(mbs_run *r, double theta, double *x);

/* The values of the switching functions at (t, x), those of a mode less their margins. */
void mbs_switching(mbs_run *r, double t, const double *x);

/* Keep the `values`, which are those at (t, x), for when they are asked for there again. */
void mbs_keep_switching(mbs_run *r, double t, const double *x);

/* The same at t + theta h on the way `along` a step. */
void mbs_switching_at(mbs_run *r, mbs_path along, double theta);

/* Switching function i at t + theta h on the way `along` a step, times its side. */
double mbs_on_side(mbs_run *r, mbs_path along, int i, double theta);

/* The sign of a value, 0 for zero. */
double mbs_side(double value);

/* Whether the value of function i is beyond zero: a stop is crossed upwards, a kink in both directions. */
int mbs_crossed(const mbs_run *r, int i);
int mbs_any_crossed(const mbs_run *r);

/* Note on which sides of zero the values are. */
void mbs_note_sides(mbs_run *r);

/* Note on which side of zero the switching functions are at the start of a run. */
void mbs_start_events(mbs_run *r);

/* The time at which the slope of (t, x) is taken: slightly before a kink that it is at but for round-off, as a force may jump
   there; `beyond` or `touched` tell of a kink. */
double mbs_time_of_slope(mbs_run *r, double t, const double *x);

/* ---- slopes.c ---- */

/* The slope at (t, x); watches the rank of the rows and how far dependent ones disagree. */
int mbs_derivative(mbs_run *r, double t, const double *x, double *slope);

/* Let the next trial be made for a singular position: slopes are taken at states put onto the constraints. They hardly
   change with what is off them, so implicit methods do without the Jacobian, which tells the contrary, and find their
   stages by iteration; what they know of other slopes does not count. */
void mbs_foresee(mbs_run *r);

/* ---- trials.c ---- */

/* Let the method try the step over h to t_new, again where it turns stiff near a singular position. */
int mbs_attempt(mbs_run *r, double h, double t_new);

/* Settle the end of a trial and find its slope. The end as it was before stays in `spare`. */
int mbs_close_step(mbs_run *r, double t_new);

/* The error of a trial beside so much noise. Of two estimates the finer, e5, counts as e5^2 / sqrt(e5^2 + 0.01 e3^2), with
   the coarser, e3. */
double mbs_error_beside(mbs_run *r, double noise, int *worst);

/* The error of a trial whose `plain` one is known: near a singular position round-off there counts as allowed. */
double mbs_error_allowing(mbs_run *r, double plain, int *worst);

/* Try the step over h to t_new, then settle its end and find its slope. */
int mbs_take(mbs_run *r, double h, double t_new);

/* ---- looks.c, or no_events.c ---- */

/* A part of the way `along` a step at which switching function i has crossed, near the first; 2 if it keeps its sign. Its
   values times its side: at the start, MBS_PROBE after it, as much before the end, and at the end. */
double mbs_first_seen(mbs_run *r, mbs_path along, int i, double start, double after, double before, double end);

/* As far from zero the values of a switching function are round-off all along a piece of the step: without a margin what it
   changes by with the round-off of the largest component in all of them. */
double mbs_unseen(mbs_run *r, int i);

/* The longest step that may be tried: in one the functions that keep steps short may change, as the quadratic through the
   last three looks at them goes, by half their distance from zero, or a tenth of the largest they had, and a run in modes
   is looked at now and then. */
double mbs_longest(mbs_run *r);

/* ---- events.c, or no_events.c ---- */

/* Note of the function at whose event the step starts whether it goes back to where it came from. */
void mbs_begin_watch(mbs_run *r);

/* Whether a step that ended with `status` has no solution because it would lead over a kink. */
int mbs_stuck_at_kink(const mbs_run *r, int status);

/* If a switching function crosses zero in the step just taken, or got stuck at a kink, end the step there:
   state->crossing, t_new, event_x. */
int mbs_find_event(mbs_run *r, int status);

#endif
