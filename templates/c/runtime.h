/* Interface between a generated model, the rank-revealing solve and the integration loop. Nothing here allocates memory. */
#ifndef MBS_RUNTIME_H
#define MBS_RUNTIME_H

#include "constants.h"

/* Storage of large work arrays: static, one for each thread, where the compiler can do that; else on the stack. */
#if defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L && !defined(__STDC_NO_THREADS__)
#define MBS_SCRATCH static _Thread_local
#elif defined(__GNUC__)
#define MBS_SCRATCH static __thread
#elif defined(_MSC_VER)
#define MBS_SCRATCH static __declspec(thread)
#else
#define MBS_SCRATCH
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef void (*mbs_function)(const double *const *in, double *const *out);

typedef struct {
    const char *name;
    int n_in;
    const int *in_sizes;
    int n_out;
    const int *out_sizes;
    mbs_function call;
} mbs_program;

/* Of one row of a matrix: its elements from `first` up to `end` may differ from zero; elimination in the order of the
   rows leaves it some from `low` up to `high`. */
typedef struct {
    int first, end, low, high;
} mbs_span;

typedef struct {
    int rows, columns;
    const mbs_span *spans; /* one for each row; null: rows have all elements, and are taken the longest first */
} mbs_pattern;

/* Rows of a matrix of which a list has the elements that may differ from zero: those of row j from number begins[j] up
   to begins[j + 1], each in its column. Of rows that act `joins` has the columns of row j in all matrices, of those that
   rows only have together the first. */
typedef struct mbs_rows {
    int rows, columns;
    const int *begins, *places;
    const struct mbs_rows *joins;
} mbs_rows;

/* Doubles that the factors of a matrix take. */
#define MBS_FACTORS(rows, columns) ((rows) * ((columns) + 6) + 3)

/* ... and those of a matrix of which some rows act, so many at most. */
#define MBS_MOST_ACTING(rows, columns) ((rows) < 1024 + 4 * (columns) ? (rows) : 1024 + 4 * (columns))
#define MBS_ACTING_FACTORS(rows, columns) \
    (2 + (rows) + MBS_MOST_ACTING(rows, columns) * (2 * (columns) + 16) + 2 * (columns))
#define MBS_RUBBING_FACTORS(rows, columns) \
    (MBS_ACTING_FACTORS(rows, columns) + MBS_MOST_ACTING(rows, columns) * ((columns) + 4) + \
     (MBS_MOST_ACTING(rows, columns) + (columns)) * (2 * (MBS_MOST_ACTING(rows, columns) + (columns)) + 8))

/* Spans beside them, of elements, and of rows and columns, and what is kept of rows that act from call to call, of so many
   elements of all matrices. */
#define MBS_PLACES(rows, columns) (2 * (rows) + (columns))
#define MBS_KEPT(rows, columns, elements) (3 + 8 * (rows) + (columns) + 2 * (elements))

/* Factorise A, of which `matrix` holds the elements within the spans, row after row. At most `most` rows are taken for
   independent. The _pivoted ones do not try first whether the rows are independent as they come; in in_order.h are some
   for small patterns. */
void mbs_factorise(const mbs_pattern *pattern, const double *matrix, double most, double *factors);
void mbs_factorise_pivoted(const mbs_pattern *pattern, const double *matrix, double most, double *factors);

/* Minimum-norm x with A x = r, and the multipliers with x = A^T multipliers.
   report: rank; smallest part of a kept row that others leave, or of the longest that one is long; largest scaled
   residual of a dependent row. */
void mbs_substitute(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                    double *multipliers, double *report);
void mbs_substitute_pivoted(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                            double *multipliers, double *report);

/* The same for the rows that act, those for which `acting` is not zero, MBS_MOST_ACTING of them: of more x is nan. With
   `forces` what rows exert, C, stands in the place of A in x = C^T multipliers: where A C^T is singular x and the
   multipliers, times lengths of C, are of least norm together. Factors have beside them MBS_PLACES `spans`, and what is
   `kept`: MBS_KEPT numbers, zero before the first call. Where these are not, factors are to stay as they are between calls. */
void mbs_factorise_acting(const mbs_rows *rows, const double *matrix, const mbs_rows *forces, const double *exerted,
                          const double *acting, double most, double *factors, mbs_span *spans, int *kept);
void mbs_substitute_acting(const mbs_rows *rows, double *factors, mbs_span *spans, int *kept, const double *right,
                           double *solution, double *multipliers, double *report);

/* independent[j] = 1 for each row j of A that was taken for independent, 0 for the others. */
void mbs_independent(const mbs_pattern *pattern, double *factors, double *independent);

/* Rows of contacts, A: row j has the elements `matrix` from number begins[j] up to begins[j + 1], each in its column of
   `places`, and `squares` of its length. Normals come first, up to rubs[0]; friction part k rubs in the rows from rubs[k]
   up to rubs[k + 1], three at most, and is pressed by the normal presses[k]. */
typedef struct {
    int parts;
    const int *begins, *places;
    const double *matrix, *squares;
    const int *rubs, *presses;
    const double *coefficients; /* of each part */
    double relaxed;             /* by how much more than is due normal impulses are changed */
} mbs_contacts;

/* Bring impulses z and x = A^T z near the laws of contacts with friction, at `speeds` without them; returns the number of
   sweeps: `most`, or those after which none changes the root of twice an energy by more than `settled`. */
long long mbs_sweep(const mbs_contacts *contacts, const double *speeds, double *x, double *z, double settled,
                    long long most);

/* Call a program for many samples. The pointers move on from sample to sample: those of the outputs by the size of
   the output, that of input i by its size if advance[i] is not 0. */
void mbs_map(const mbs_program *program, long long samples, const double **in, const int *advance, double **out);

/* A collocation method: with z_i = u(t + c_i h) - x it solves  W z = h start f(t, x) + h f(t + c h, x + z), and
   x_new = x + end z. */
typedef struct {
    int stages;                 /* those that are not explicit, s */
    const double *c;            /* s */
    const double *w;            /* s x s, row by row, as all matrices: W = T diag(gamma, [alpha -beta; beta alpha]) T^-1 */
    const double *start;        /* s */
    const double *end;          /* s */
    const double *transform;    /* T, s x s */
    const double *inverse;      /* T^-1, s x s */
    double gamma, alpha, beta;  /* where s is even gamma is 0, where it is 1 alpha and beta are */
    double filter;              /* the estimated error e is that of (filter - h J) e = h f(t, x) + error z */
    const double *error;        /* s; null without an estimate */
    const double *dense;        /* s x s: u(t + theta h) = x + sum_i z_i sum_k dense[i][k] theta^(k+1) */
    int hermite;                /* not 0: between its ends a step is the cubic through them, not u */
} mbs_collocation;

/* A method. The tableau is that of an explicit Runge-Kutta method, or of the starter of one that looks back. The last
   stage of a step is the end point: its row of a gives the new state. Stages after it are evaluated only where a step
   is interpolated. */
typedef struct {
    int family;
    int stages;                 /* of a step, the end point among them */
    int all_stages;
    int order;
    int error_order;            /* order of the estimated error, 0 without an estimate */
    int dense_degree;
    const double *a;            /* all_stages x all_stages, row by row */
    const double *c;            /* all_stages */
    const double *error;        /* stages: weights of the error estimate; null without one */
    const double *coarse_error; /* stages: weights of a second estimate of lower order; null without one */
    const double *dense;        /* all_stages x dense_degree: b_i(theta) = sum_k dense[i][k] theta^(k+1) */
    int past;                   /* steps before the present one that a step looks back over */
    const double *position;     /* past + 1 weights of the present and past, the newest first; so are */
    const double *predictor;
    const double *corrector;    /* this one starts with the predicted end */
    const mbs_collocation *collocation; /* null for other families; of what stands above it needs the orders only */
} mbs_method;

/* What is integrated: x = (q, u). The programs a model does not have are null. */
typedef struct {
    const mbs_program *inputs;           /* (t, q, u, parameters) -> inputs */
    const mbs_program *state_derivative; /* (t, q, u, parameters, inputs, modes) -> qdot, udot, multipliers, report */
    const mbs_program *jacobian;         /* (as before) -> d(qdot, udot) / d(q, u), for implicit methods */
    const mbs_program *index_2; /* (as before, multipliers) -> qdot, udot, phi, phidot: the rows as part of the equations,
                                   with 2 ns multipliers, those on positions first; implicit methods solve them instead */
    const mbs_program *index_2_by_state;       /* (as before) -> d(qdot, udot, phi, phidot) / d(q, u) */
    const mbs_program *index_2_by_multipliers; /* (without multipliers) -> d(qdot, udot) / d multipliers */
    const mbs_program *project_position; /* (t, q, u, parameters, inputs, modes) -> phi, correction of q */
    const mbs_program *project_velocity; /* (as before) -> phidot, correction of u */
    const mbs_program *missed;           /* (as before) -> phi, phidot; and, in place of the two before, ... */
    const mbs_program *put_back;         /* ... (as before) -> corrections of q and of u, by one factorisation */
    const mbs_program *normalize;        /* (as before) -> q, deviation */
    const mbs_program *events;           /* (as before) -> values of the switching functions; those of a mode take its
                                            multipliers too */
    const int *terminal;                 /* for each of them 1: the run stops where it becomes positive; 0: a kink, where
                                            it changes sign a step ends and the next one starts afresh */
    const double *parameters;
    const double *modes;
    int nq, nu, ns, nw, ng;
    const int *plain; /* pairs (a, b): q[a]' = u[b] */
    const int *ball;  /* pairs (a, b) of the first indices of a unit quaternion in q and of its angular velocity in u */
    int plains, balls;
    const double *margins; /* for each of the last `switches` switching functions, those of a mode, by how much it may
                              exceed zero: the run stops where it exceeds that, from whichever side it starts; if that is
                              negative, once it has been below it */
    const int *limiting; /* the places among them of those that keep adaptive steps short */
    int switches, limits; /* how many they are, and those */
    const double *moments;  /* times, rising, over which no adaptive step of a run with events leads */
    int moment_count;
} mbs_system;

typedef struct {
    const mbs_method *method;
    const mbs_system *system;
    double t0, t_end;
    double step;          /* fixed step; 0: adaptive steps by rtol and atol */
    double rtol, atol;
    double contradiction; /* largest scaled residual of dependent rows and largest |phidot| / (1 + |u|), of which at
                             least one must hold for rows to count as consistent */
    double closure;       /* largest |phi| / (1 + |q|) that a projection may leave */
    double independent;   /* rows that are so but for singular positions */
    double whole;         /* how long the run is of which this one is or repeats a part, in steps as long; 0: it is none */
    long long max_steps;
    long long samples;    /* from t0 to t_end, both among them: evenly spaced, ... */
    const double *times;  /* ... or at these times, rising; null: evenly spaced */
    int project;          /* not 0: each accepted step and each sample is put back onto the constraints */
    int crosses;          /* not 0: steps lead across singular positions */
} mbs_problem;

/* Where a run stands. The first entries of the work space hold x at time t. */
typedef struct {
    double t, t_new, h, h_next, error;
    double failure_time;
    double drift_position, drift_velocity;     /* largest |phi|, |phidot| of states from which steps started */
    double removed_position, removed_velocity; /* largest |phi|, |phidot| that projection found after a step */
    double quaternion_deviation;               /* largest deviation of a quaternion's length from 1 after a step */
    double least_rank, greatest_rank;
    double conditioning, conditioning_time;    /* smallest of these parts, and when */
    double before, start, latest, end;         /* independence of the rows at the start of the step before, of this one, at
                                                  the latest slope, at the end, */
    double least, greatest, peak, rate;        /* of all slopes in the trial, the largest at the start of a step, and the
                                                  rate at which it went down in the step before */
    double least_time, smooth;                 /* when the least was met; steps that long do where the rows are regular */
    double singular[MBS_PASSED];               /* when the last step of this call passed singular positions, ... */
    long long steps, rejected, evaluations, jacobians, factorisations;
    long long sample;                          /* samples written so far */
    long long grid;                            /* fixed steps: the whole ones until t, or until before t */
    int status, component;
    int event; /* the switching function whose event ended the last step of this call, -1 for none */
    int phase, crossing, origin, extended;
    int passed; /* ... and how many */
    int near, stiff, vain; /* the step is near one; there iteration fails without a Jacobian, ...
                              after so many trials of it that failed, but not as they came too near */
    double doubled[MBS_DOUBLED]; /* when the number of steps was last a power of two, and the times of those before */
} mbs_state;

/* Doubles of work space for mbs_integrate; negative where the method is left out. */
long long mbs_work(const mbs_problem *problem);

/* A run that has begun elsewhere goes on from x0 if then t and t_new of the state are set to that time, `sample`
   to the samples that are written and `grid` to the whole fixed steps until then. */
void mbs_start(const mbs_problem *problem, const double *x0, mbs_state *state, double *work);

/* Go on for at most `steps` steps and `rows` samples, written as rows (q, u); returns how many were written.
   Call again while state->status is MBS_RUNNING: an event ends a call as well, and a singular position. */
long long mbs_integrate(const mbs_problem *problem, mbs_state *state, double *work, long long steps, long long rows,
                        double *samples);

/* Begin runs that differ in `count` parameters and x0 alone, which stand one after the other, and go on with each for at
   most `steps` steps: a state, problem->samples rows and the state (q, u) it reached of each. Run k lasts from spans[2 k]
   to spans[2 k + 1]; where `spans` is null all last as long as the problem. Nothing is written but that and `work`. */
void mbs_integrate_each(const mbs_problem *problem, long long runs, const double *spans, const double *parameters,
                        long long count, const double *x0, mbs_state *states, double *work, long long steps,
                        double *samples, double *ends);

#ifdef __cplusplus
}
#endif

#endif
