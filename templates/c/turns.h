/* Switches of a run in modes that were decided before: the mode that follows is verified, and the run goes on in it. */
#ifndef MBS_TURNS_H
#define MBS_TURNS_H

#include "runtime.h"

/* The places of a normal and a tangent among all rows, the number of the friction part, which way it slides, and whether
   from rest; of what sticks the last two are 0. */
typedef struct {
    int normal, tangent, part, sense, begins;
} mbs_rub;

/* What acts in a mode: `active` rows have a = 0; `pressing` and `apart` are normals of what touches. */
typedef struct {
    int actives, slidings, stickings, pressings, aparts;
    const int *active;
    const mbs_rub *sliding, *sticking;
    const int *pressing, *apart;
} mbs_acting;

/* The place of a tangent and the way in which it slides, 0 at rest. */
typedef struct {
    int tangent, sign;
} mbs_sign;

/* A switch that was decided: in which mode it ended, by the number of it. What touches: 1 for each element that does;
   `kept` are the rows of constraints and of normals that touch, `rows` all that take part. `cause` is the row whose force
   had come to its limit, and `way` in which it then slides; -1 where a speed had come to zero, and `before` is nothing. */
typedef struct {
    int to, keeps, parts, takes, cause, way;
    const int *touching, *kept, *rows;
    const mbs_sign *signs;
    mbs_acting after, before;
} mbs_turn;

/* By what a switching function of a mode may exceed zero: a part of forces (row < 0), of the model's size (`gap`, which may
   be an angle), or of the speed along a row. */
typedef struct {
    int kind, row;
} mbs_margin;

/* A mode: the problem, whose margins are written, speeds that are zero, elements that are closed, and of each of its
   switching functions how many turns are known, which stand one after the other. */
typedef struct {
    const mbs_problem *problem;
    double *margins;
    const mbs_margin *rules;
    const int *held, *closed, *turns;
    const mbs_turn *turn;
    int holds;
} mbs_mode;

/* The entries of a matrix that may differ from those of `base` (zero without one): their places, counted row by row. */
typedef struct {
    int count, size;
    const int *places;
    const double *values, *base;
    double *whole;
} mbs_entries;

/* What laws ask of a mechanism in no mode: all outputs of that program, those that are used by name, and what they are
   measured by. */
typedef struct {
    const mbs_program *inputs, *laws;
    const double *parameters;
    double *given;
    double *const *outputs;
    const mbs_entries *entries; /* of the matrices among those, by which they are filled in order */
    double *phi, *phidot, *jacobian, *matrix, *exerted, *right, *driven, *coefficients, *reaches, *past_ends, *inverse;
    int matrices, rows, elements;
    const int *normals, *angles; /* of each element the place of its normal, and whether the gap is an angle */
    const double *slides;        /* of each speed 1 in m/s, else 0 */
    double length, speed;        /* of the model, and the largest that was met */
} mbs_laws;

/* A turn that was taken: when, which one in the mode then, after so many samples and steps. */
typedef struct {
    double time;
    long long turn, samples, steps;
} mbs_passage;

/* A run that goes from mode to mode: where it stands, and since when; what was passed, with the states (nq + nu) after and
   the margins of the mode, `width` doubles of room for each. */
typedef struct {
    mbs_laws *laws;
    const mbs_mode *modes;
    mbs_passage *passages;
    double *states, *margins, *room;
    double since, least; /* a turn that comes sooner than `least` after the last one is left to others */
    int mode, most, passed, width;
} mbs_course;

/* Go on as mbs_integrate does, over switches that were decided before. */
long long mbs_follow(mbs_course *course, mbs_state *state, double *work, long long steps, long long rows,
                     double *samples);

/* ---- what contacts.c asks as well ---- */

/* How an element stands. */
enum { MBS_OPEN, MBS_INSIDE, MBS_RESTING, MBS_LEAVING, MBS_CLOSING };

/* Fill in all that the laws ask at a state. */
void mbs_ask(const mbs_course *c, double t, const double *q, const double *u);
int mbs_standing(const mbs_course *c, int element);

/* The largest speed along a row of which a part counts. */
double mbs_speed_along(const mbs_course *c, int row);

/* Rounded up to a power of two, so that it does not hang on digits. */
double mbs_rounded_up(double value);

/* By how much a switching function of a mode with this `largest` force may exceed zero. */
double mbs_margin_of(const mbs_course *c, const mbs_margin *rule, double t, double largest);

/* Note the speeds that a run has come to. */
void mbs_grow_speed(mbs_laws *l, int n, const double *u);

/* Begin in another mode at (t, x), with all that was counted. */
void mbs_enter(const mbs_problem *problem, mbs_state *state, const double *x, double *work);

/* Doubles of room that a course takes. */
long long mbs_room(const mbs_course *course);

#endif
