/* A model between the interfaces of FMI and its Programs: one instance, which keeps all that it knows.

   fmu_model.h has the sizes, names and numbers of the model; the package writes it. fmi2.c and fmi3.c are the two
   interfaces; an FMU has one of them. */
#ifndef MBS_FMU_H
#define MBS_FMU_H

#include "fmu_model.h"
#include "model.h"
#if MBS_FMU_CONTACTS
#include "contacts.h"
#endif

#include <stddef.h>

#if defined(_WIN32)
#define MBS_FMU_EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define MBS_FMU_EXPORTED __attribute__((visibility("default")))
#else
#define MBS_FMU_EXPORTED
#endif
#define MBS_FMU_JOINED(a, b) a##b
#define MBS_FMU_JOIN(a, b) MBS_FMU_JOINED(a, b)

/* Value references: time, states (q, u), their rates, inputs, outputs, parameters, event indicators. */
enum {
    MBS_FMU_TIME = 0,
    MBS_FMU_STATES = 1,
    MBS_FMU_RATES = MBS_FMU_STATES + MBS_FMU_NX,
    MBS_FMU_INPUTS = MBS_FMU_RATES + MBS_FMU_NX,
    MBS_FMU_OUTPUTS = MBS_FMU_INPUTS + MBS_FMU_NW,
    MBS_FMU_PARAMETERS = MBS_FMU_OUTPUTS + MBS_FMU_NO,
    MBS_FMU_INDICATORS = MBS_FMU_PARAMETERS + MBS_FMU_NP,
    MBS_FMU_END = MBS_FMU_INDICATORS + MBS_FMU_NG
};

/* The numbers of the status of both interfaces. */
enum { MBS_FMU_OK = 0, MBS_FMU_DISCARD = 2, MBS_FMU_ERROR = 3 };

typedef enum { MBS_FMU_SET_UP, MBS_FMU_BEGINNING, MBS_FMU_RUNNING, MBS_FMU_ENDED } mbs_fmu_phase;

/* What an instance is at a time: all that saving and restoring it copies. Inputs from outside stand behind the parameters. */
typedef struct {
    double time, tolerance;
    double x[MBS_FMU_NX + 1];
    double parameters[MBS_FMU_NP + MBS_FMU_FREE + 1];
    double sides[MBS_FMU_NG + 1]; /* of event indicators: the side of zero on which they were last seen */
    long long phase, stopped;
#if MBS_FMU_CONTACTS
    mbs_contacts_point contacts;
#endif
} mbs_fmu_point;

typedef struct mbs_fmu {
    mbs_fmu_point now;
    int known;  /* what follows are the values at `now` */
    int stale;  /* parameters that follow from others are not up to date */
    double rates[MBS_FMU_NX + 1], inputs[MBS_FMU_NW + 1], outputs[MBS_FMU_NO + 1];
    double multipliers[MBS_FMU_NS + 1], report[3], indicators[MBS_FMU_NG + 1];
    double *work; /* of the integrator; null before the first step */
    void *run;    /* of contacts, null before they begin */
    void (*tell)(const struct mbs_fmu *fmu, int status, const char *category, const char *text);
    void *environment, *logger;
    int logging;
    char name[256];
} mbs_fmu;

/* A new instance; null without memory. Errors are told by `tell`, which has `environment` and `logger` to do so. */
mbs_fmu *mbs_fmu_create(const char *name);
void mbs_fmu_free(mbs_fmu *f);

/* Let all values be those of the export. */
void mbs_fmu_reset(mbs_fmu *f);

/* All functions below return a status. */
int mbs_fmu_fail(const mbs_fmu *f, const char *format, ...);

int mbs_fmu_get(mbs_fmu *f, const unsigned *references, size_t count, double *values);
int mbs_fmu_set(mbs_fmu *f, const unsigned *references, size_t count, const double *values);

int mbs_fmu_begin(mbs_fmu *f, double start, int has_tolerance, double tolerance);
/* Put the start onto the constraints. */
int mbs_fmu_end_of_beginning(mbs_fmu *f);

void mbs_fmu_set_time(mbs_fmu *f, double time);
int mbs_fmu_set_states(mbs_fmu *f, const double *x, size_t count);
int mbs_fmu_get_states(const mbs_fmu *f, double *x, size_t count);
int mbs_fmu_rates(mbs_fmu *f, double *rates, size_t count);
int mbs_fmu_indicators(mbs_fmu *f, double *values, size_t count);

/* After a step of the importing tool: whether states are to be put back onto the constraints. */
int mbs_fmu_step_done(mbs_fmu *f, int *event);
/* At an event: put states back, tell whether the motion stops, and the next time of an event (HUGE_VAL: none). */
int mbs_fmu_event(mbs_fmu *f, int *changed, int *stops, double *next);

/* Integrate from `from`, where the instance is, over h; at a stop the time of the instance is earlier. */
int mbs_fmu_step(mbs_fmu *f, double from, double h);

/* results = (d unknowns / d knowns) seeds, or its transpose times seeds of the unknowns. */
int mbs_fmu_slopes(mbs_fmu *f, const unsigned *unknowns, size_t rows, const unsigned *knowns, size_t columns,
                   const double *seeds, double *results, int transposed);

/* A saved state is a token of the model and the point. */
size_t mbs_fmu_saved_size(void);
int mbs_fmu_save(const mbs_fmu *f, void **saved);
int mbs_fmu_restore(mbs_fmu *f, const char *bytes, size_t size);
int mbs_fmu_serialize(const mbs_fmu *f, const void *saved, void *bytes, size_t size);
int mbs_fmu_deserialize(const mbs_fmu *f, const void *bytes, size_t size, void **saved);

#endif
