/* A model whose contacts, stops and ropes open and close, stick and slide: it goes from state to state by itself.

   contacts_model.h has the sizes, names and numbers of the model; the package writes it. No function allocates memory. */
#ifndef MBS_CONTACTS_H
#define MBS_CONTACTS_H

#include "contacts_model.h"
#include "model.h"
#include "turns.h"

enum {
    MBS_CONTACTS_NX = MBS_CONTACTS_NQ + MBS_CONTACTS_NU,
    MBS_CONTACTS_MOST_EVENTS = 2 * (MBS_CONTACTS_ELEMENTS + MBS_CONTACTS_PARTS) + 2,
    MBS_CONTACTS_WIDEST = MBS_CONTACTS_ROWS > MBS_CONTACTS_NU ? MBS_CONTACTS_ROWS : MBS_CONTACTS_NU
};

/* How a run stands. `mbs_contacts_words` says why one has ended. */
typedef enum {
    MBS_CONTACTS_GOES_ON,
    MBS_CONTACTS_DONE,
    MBS_CONTACTS_STOPPED,      /* a condition of `stop` of the model holds: number state.event */
    MBS_CONTACTS_FAILED,       /* the integrator failed: state.status says how */
    MBS_CONTACTS_NO_STATE,     /* no state of the contacts fulfils the laws, as where friction jams */
    MBS_CONTACTS_TOO_MANY,     /* more contacts touch at once than are searched */
    MBS_CONTACTS_IMPACT,       /* several rough contacts strike together, of which some bounce: not solved here */
    MBS_CONTACTS_STANDS_STILL, /* states and impacts follow each other and time does not go on */
    MBS_CONTACTS_JUMPS,        /* a force jumps to and fro and time does not go on */
    MBS_CONTACTS_PARAMETERS    /* a parameter that was changed is no number, or a mass or the like is not positive */
} mbs_contacts_status;

/* An element or one of its friction parts, by name, the word of its state, or `impact`, and the impulse along the normal
   (N s, or N m s; 0 where none struck). */
typedef struct {
    double time, impulse;
    const char *name, *word;
} mbs_contacts_event;

/* Of each element 0: open, 1: closed, 2: it touches and carries nothing. Of each friction part the way in which it slides, 0
   where it sticks; carried: it does not slide, as others hold it, and exerts its static limit. */
typedef struct {
    int closed[MBS_CONTACTS_ELEMENTS + 1], slip[MBS_CONTACTS_PARTS + 1], carried[MBS_CONTACTS_PARTS + 1];
} mbs_contacts_mode;

/* What a run remembers at a time, but for the state (q, u): what restoring it takes. */
typedef struct {
    mbs_contacts_mode mode;
    double largest, speed;                  /* the largest force as the mode began, and the largest speed that was met */
    double since, last_impact, last_switch; /* times: of the mode .. */
    double bouncing[MBS_CONTACTS_ELEMENTS + 1], left[MBS_CONTACTS_ELEMENTS + 1]; /* since when, and when it last left */
    double block_begun;
    long long switches, block; /* while time stood still; of a block of switches */
} mbs_contacts_point;

/* A run, which is not to be moved. The first entries of its work space hold the state (q, u). */
typedef struct {
    double parameters[MBS_CONTACTS_NP + MBS_CONTACTS_FREE + 1]; /* may be changed before the start */
    double steps; /* part of lengths by which steps may err that others take: lower bounces rest; 0 where it steps itself */
    mbs_contacts_status status;
    mbs_contacts_point now;
    mbs_contacts_event events[MBS_CONTACTS_MOST_EVENTS]; /* of the last switch */
    int event_count;
    mbs_state state;

    mbs_system system;
    mbs_problem problem;
    double numbers[MBS_CONTACTS_NUMBERS + 1], margins[MBS_CONTACTS_SWITCHES + 1];
    int limiting[MBS_CONTACTS_SWITCHES + 1];

    mbs_mode only;
    mbs_laws laws;
    mbs_entries entries[4];
    mbs_course course;
    double values[MBS_CONTACTS_VALUES + 1], given[MBS_CONTACTS_NW + 1], *outputs[MBS_CONTACTS_OUTPUTS];
    double matrix[MBS_CONTACTS_ROWS * MBS_CONTACTS_NU + 1], exerted[MBS_CONTACTS_ROWS * MBS_CONTACTS_NU + 1];
    double jacobian[MBS_CONTACTS_ROWS * MBS_CONTACTS_NU + 1], inverse[MBS_CONTACTS_NU * MBS_CONTACTS_NU + 1];
    double room[MBS_FACTORS(MBS_CONTACTS_ROWS, MBS_CONTACTS_WIDEST)];
    double behind;   /* how long after its last switch the run has stopped */
    long long jumps; /* calls of the integrator while time stood still */
} mbs_contact_run;

/* Let a run be that of the export, from t0 to t_end with evenly spaced samples. */
void mbs_contacts_begin(mbs_contact_run *run, double t0, double t_end, long long samples);

/* Doubles of work space. */
long long mbs_contacts_work(const mbs_contact_run *run);

/* Find the state of the contacts at a start x (q, u). */
void mbs_contacts_start(mbs_contact_run *run, const double *x, double *work);

/* Go on from a state x at the time t0, and from the point to which `now` was restored. */
void mbs_contacts_resume(mbs_contact_run *run, const double *x, double *work);

/* Decide what follows where a switching function of the mode, by its number among all, has become positive at the time t0:
   `work` holds the state before and after, `events` tell of it. */
void mbs_contacts_switch(mbs_contact_run *run, int function, double *work);

/* Go on to the next switch, of which `events` tell, or to the end; write samples as rows (q, u) and return how many. */
long long mbs_contacts_go(mbs_contact_run *run, double *work, double *samples, long long rows);

/* The word of the state of an element, or of its friction part; what a status means. */
const char *mbs_contacts_word(const mbs_contacts_mode *mode, int element);
const char *mbs_contacts_words(mbs_contacts_status status);

#endif
