/* Simulates the model from state to state of its contacts, stops and ropes. Rows of samples (t, q, u) go to the standard
 * output; the states at the start, events and the end go to the standard error.
 *
 *     cc -std=c99 -O2 -ffp-contract=off $(ls *.c | grep -v selftest) -lm -o simulate
 *     ./simulate [end of time in s] [samples] > motion.csv
 *
 * It finds events, decides states, solves impacts and puts states back as `simulate` of the package does. Not in it: impacts
 * of several rough contacts of which some bounce, limits of bounces of several contacts in turn, states of which there are
 * several. The run ends where it meets the first, and says so; contacts.h has all reasons. Programs of one's own call the
 * functions of contacts.h. */
#include "contacts.h"

#include <stdio.h>
#include <stdlib.h>

enum { NX = MBS_CONTACTS_NX };

static void write_row(double t, const double *row)
{
    printf("%.17g", t);
    for (int i = 0; i < NX; ++i)
        printf(",%.17g", row[i]);
    printf("\n");
}

static void write_events(const mbs_contact_run *run)
{
    for (int k = 0; k < run->event_count; ++k) {
        const mbs_contacts_event *one = run->events + k;
        fprintf(stderr, "event,%.17g,%s,%s,%.17g\n", one->time, one->name, one->word, one->impulse);
    }
}

int main(int count, char **given)
{
    enum { ROWS = 256 };
    static mbs_contact_run run;
    static double rows[ROWS * (NX + 1)];
    double t_end = count > 1 ? atof(given[1]) : MBS_CONTACTS_T_END, *work;
    long long samples = count > 2 ? atoll(given[2]) : MBS_CONTACTS_SAMPLES, written = 0;
    if (!(t_end > 0.0) || samples < 2) {
        fprintf(stderr, "usage: %s [end of time in s] [samples, at least 2]\n", given[0]);
        return 2;
    }
    mbs_contacts_begin(&run, 0.0, t_end, samples);
    work = calloc((size_t)mbs_contacts_work(&run), sizeof *work);
    if (!work)
        return 2;
    mbs_contacts_start(&run, mbs_contacts_start_state, work);
    for (int e = 0; e < MBS_CONTACTS_ELEMENTS; ++e)
        fprintf(stderr, "start,0,%s,%s\n", mbs_contacts_names[e], mbs_contacts_word(&run.now.mode, e));
    write_events(&run);
    while (run.status == MBS_CONTACTS_GOES_ON) {
        long long more = mbs_contacts_go(&run, work, rows, ROWS);
        for (long long k = 0; k < more; ++k)
            write_row(t_end / (double)(samples - 1) * (double)(written + k), rows + k * NX);
        written += more;
        write_events(&run);
    }
    if (run.status == MBS_CONTACTS_STOPPED && run.state.t > t_end / (double)(samples - 1) * ((double)(written - 1) + 1e-9))
        write_row(run.state.t, work);
    fprintf(stderr, "end,%.17g,%s\n", run.state.t, mbs_contacts_words(run.status));
    free(work);
    return run.status == MBS_CONTACTS_DONE || run.status == MBS_CONTACTS_STOPPED ? 0 : 1;
}
