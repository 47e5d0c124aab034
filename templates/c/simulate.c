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

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { NX = MBS_CONTACTS_NX };

/* A word of the command line as a number; nan for one that is none. */
static double number(const char *word)
{
    char *end;
    double x = strtod(word, &end);
    return end != word && *end == '\0' ? x : NAN;
}

static int refuse(const char *program, const char *wanted, const char *given)
{
    fprintf(stderr, "%s, not %s\nusage: %s [end of time in s] [samples]\n", wanted, given, program);
    return 2;
}

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
    double t_end = count > 1 ? number(given[1]) : MBS_CONTACTS_T_END, *work;
    double wanted = count > 2 ? number(given[2]) : MBS_CONTACTS_SAMPLES;
    if (count > 3)
        return refuse(given[0], "there are two numbers at most", given[3]);
    if (!(t_end > 0.0 && isfinite(t_end)))
        return refuse(given[0], "the end of time is a positive number of seconds", count > 1 ? given[1] : "that of the model");
    if (!(wanted >= 2.0 && wanted < 1e15 && wanted == floor(wanted)))
        return refuse(given[0], "the number of samples is a whole one from 2 on", count > 2 ? given[2] : "that of the model");
    const long long samples = (long long)wanted;
    long long written = 0;
    mbs_contacts_begin(&run, 0.0, t_end, samples);
    work = calloc((size_t)mbs_contacts_work(&run), sizeof *work);
    if (!work) {
        fprintf(stderr, "there is no memory for the run\n");
        return 1;
    }
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
