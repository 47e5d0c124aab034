/* What the stages of an implicit method solve, and the linear equations of Newton's iteration for it. */
#ifndef MBS_STAGES_H
#define MBS_STAGES_H

#include "stepper.h"

/* E y' = f(t, y) with y = (x, z): without rows of index 2 x' = f(t, x); else x' = F(t, x, z), 0 = G(t, x) with the rows
   on positions and on speeds G and their multipliers z, of which the independent ones take part, the others are zero.
   The parts of the work space: */
typedef struct {
    const mbs_collocation *m;
    int n, rows, size, s;    /* states, multipliers, both together, stages */
    double *memory;          /* for the iteration */
    double *z, *before;      /* stages of the trial and of the step before, each (s x size) as changes from y */
    double *residual, *rest; /* of the stages (s x size) */
    double *multipliers;     /* at the start of the step */
    double *y, *packed;      /* scratch: a stage, and the active parts of two */
    double *by_state, *by_multipliers; /* derivative of f by x (size x n), of F by z (n x rows) */
    double *active;          /* the numbers of the states and of the independent rows; active[size] is their count */
    double *choice;          /* scratch to find them */
    double *single, *pairs, *single_rows, *pair_rows; /* factors of filter E - h J, [alpha E - h J, -beta E; ...] */
} mbs_stages;

/* Doubles of work space, of which the first `memory` are the caller's. */
long long mbs_stages_work(const mbs_problem *problem, int memory);

mbs_stages mbs_stages_of(const mbs_run *r, int memory);

/* Fill p->multipliers: none on positions, on speeds those of the accelerations at x. */
void mbs_first_multipliers(mbs_run *r, const mbs_stages *p);

/* f(t, y); watches for kinks. */
int mbs_stage_values(mbs_run *r, const mbs_stages *p, double t, const double *y, double *values);

/* Take a new derivative of f at (t, x, multipliers), and with it a new choice of independent rows. */
void mbs_stage_jacobian(mbs_run *r, const mbs_stages *p);

/* Factorise for steps over h; 0 if a matrix is singular. */
int mbs_stage_factorise(const mbs_stages *p, double h);

/* rest = the transformed changes for the transformed residuals in rest. */
void mbs_stage_solve(const mbs_stages *p);

/* error (n) = (filter E - h J)^-1 error. */
void mbs_stage_filter(const mbs_stages *p, double *error);

#endif
