/* Interface between a generated model and its runtime. */
#ifndef MBS_RUNTIME_H
#define MBS_RUNTIME_H

typedef void (*mbs_function)(const double *const *in, double *const *out);

typedef struct {
    const char *name;
    int n_in;
    const int *in_sizes;
    int n_out;
    const int *out_sizes;
    mbs_function call;
} mbs_program;

/* Doubles of work space that mbs_solve needs. */
#define MBS_SOLVE_WORK(rows, columns) ((rows) * (columns) + 6 * (rows) + (columns) + 8)

/* Minimum-norm x with A x = r, A (rows x columns) row by row, and the multipliers with x = A^T multipliers. */
void mbs_solve(int rows, int columns, const double *matrix, const double *right, double *solution,
               double *multipliers, double *report, double *work);

#endif
