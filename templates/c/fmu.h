/* A model as an FMU: one instance, which keeps all that it knows.

   fmu_model.h has the sizes, names and numbers of the model, and the version of FMI; the package writes it. fmu.c has the
   model and the functions of the standard that both versions have, FMI(SetTime) being fmi2SetTime or fmi3SetTime; fmi2.c and
   fmi3.c have the others, and an FMU has one of them. All functions of type int return a status. */
#ifndef MBS_FMU_H
#define MBS_FMU_H

#include "fmu_model.h"
#include "model.h"
#if MBS_FMU_CONTACTS
#include "contacts.h"
#endif

#include <stdbool.h>
#include <stddef.h>

#if MBS_FMU_FMI == 2
#define MBS_FMU_NAME(name) fmi2##name
#define FMU_STATE(before, after) before##FMUstate##after
#define DESERIALIZE DeSerializeFMUstate
#define GET_RATES GetDerivatives
#ifdef FMI2_FUNCTION_PREFIX
#define MBS_FMU_PREFIX FMI2_FUNCTION_PREFIX
#endif
typedef int boolean;
typedef void (*mbs_fmu_logger)(void *environment, const char *name, int status, const char *category, const char *text, ...);
#else
#define MBS_FMU_NAME(name) fmi3##name
#define FMU_STATE(before, after) before##FMUState##after
#define DESERIALIZE DeserializeFMUState
#define GET_RATES GetContinuousStateDerivatives
#ifdef FMI3_FUNCTION_PREFIX
#define MBS_FMU_PREFIX FMI3_FUNCTION_PREFIX
#endif
typedef bool boolean;
typedef void (*mbs_fmu_logger)(void *environment, int status, const char *category, const char *text);
#endif

#if defined(_WIN32)
#define MBS_FMU_EXPORTED __declspec(dllexport)
#elif defined(__GNUC__)
#define MBS_FMU_EXPORTED __attribute__((visibility("default")))
#else
#define MBS_FMU_EXPORTED
#endif
#define MBS_FMU_JOINED(a, b) a##b
#define MBS_FMU_JOIN(a, b) MBS_FMU_JOINED(a, b)

/* Linked statically, functions bear the name of the model in front. */
#ifdef MBS_FMU_PREFIX
#define FMI(name) MBS_FMU_JOIN(MBS_FMU_PREFIX, MBS_FMU_NAME(name))
#define API(type, name) type FMI(name)
#else
#define FMI(name) MBS_FMU_NAME(name)
#define API(type, name) MBS_FMU_EXPORTED type FMI(name)
#endif

typedef const unsigned *references;

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

typedef struct {
    mbs_fmu_point now;
    int known;  /* what follows are the values at `now` */
    int stale;  /* parameters that follow from others are not up to date */
    double rates[MBS_FMU_NX + 1], inputs[MBS_FMU_NW + 1], outputs[MBS_FMU_NO + 1];
    double multipliers[MBS_FMU_NS + 1], report[3], indicators[MBS_FMU_NG + 1];
    double *work; /* of the integrator; null before the first step */
    void *run;    /* of contacts, null before they begin */
    void *environment;
    mbs_fmu_logger logger;
    int logging;
    char name[256];
} mbs_fmu;

/* A new instance; null without memory, and for the token of another FMU. */
mbs_fmu *mbs_fmu_create(const char *name, const char *token, void *environment, mbs_fmu_logger logger, int logging);

int mbs_fmu_fail(const mbs_fmu *f, const char *format, ...);

int mbs_fmu_get(mbs_fmu *f, references at, size_t count, double *values);
int mbs_fmu_set(mbs_fmu *f, references at, size_t count, const double *values);

int mbs_fmu_begin(mbs_fmu *f, double start, int has_tolerance, double tolerance);

/* At an event: put states back, tell whether the motion stops, and the next time of an event (HUGE_VAL: none). */
int mbs_fmu_event(mbs_fmu *f, int *changed, int *stops, double *next);

/* Integrate from `from`, where the instance is, over h; at a stop the time of the instance is earlier. */
int mbs_fmu_step(mbs_fmu *f, double from, double h);

/* results = (d unknowns / d knowns) seeds, or its transpose times seeds of the unknowns. */
int mbs_fmu_slopes(mbs_fmu *f, references unknowns, size_t rows, references knowns, size_t columns, const double *seeds,
                   double *results, int transposed);

#endif
