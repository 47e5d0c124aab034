/* Rank-revealing solve of generated models. Allocates nothing, keeps no state of its own. */
#define MBS_UNROLLED /* sizes are known at run time alone, and mostly small: unrolled loops take longer to enter */
#include "in_order.h"

/* ---- rows that may depend on each other: Householder QR of A^T with column pivoting ---- */


/* The parts of the factors: `order` holds the row kept k-th as a whole number, `scale` what row j of A was divided by;
   `vectors` and multipliers keep the places in which rows are declared. */
typedef struct {
    int rows, columns;
    const mbs_span *spans;
    double *head;
    mbs_parts part;
} qr;

static qr laid_out(const mbs_pattern *pattern, double *space)
{
    qr f = {pattern->rows, pattern->columns, pattern->spans, space, mbs_parts_of(pattern, space)};
    return f;
}

static mbs_span span_of(const qr *f, int row)
{
    const mbs_span whole = {0, f->columns, 0, f->columns};
    return f->spans ? f->spans[row] : whole;
}

static double *row_of(const qr *f, int k)
{
    return f->part.vectors + (int)f->part.order[k] * f->columns;
}

/* A row that is zero but for rounding (of numbers like those of the longest row) counts as zero: what is left of it has
   no direction. Its length counts as that of the longest row, or one. */
static void scale_rows(const qr *f, const double *matrix, double longest)
{
    for (int j = 0; j < f->rows; ++j) {
        int first = span_of(f, j).first, count = span_of(f, j).end - first;
        double *row = f->part.vectors + j * f->columns, *to = row + first;
        double size = mbs_largest(count, matrix), length = 1.0;
        int empty = size <= MBS_ROUNDING * longest;
        if (empty)
            size = longest > 0.0 ? longest : 1.0;
        mbs_fill(f->columns, 0.0, row);
        for (int i = 0; i < count && !empty; ++i)
            to[i] = matrix[i] / size;
        if (!empty)
            length = sqrt(mbs_dot(count, to, to));
        for (int i = 0; i < count; ++i)
            to[i] /= length;
        f->part.scale[j] = size * length;
        f->part.order[j] = j;
        matrix += count;
    }
}

/* Bring the longest remaining row to place k, those between one place back; returns its length. */
static double take_pivot(const qr *f, int k)
{
    double longest = 0.0, *lengths = f->part.y, *order = f->part.order;
    for (int j = k; j < f->rows; ++j) {
        const double *rest = row_of(f, j) + k;
        lengths[j] = sqrt(mbs_dot(f->columns - k, rest, rest));
        if (lengths[j] > longest)
            longest = lengths[j];
    }
    int chosen = k;
    while (chosen < f->rows - 1 && !(lengths[chosen] >= (1.0 - MBS_TIE) * longest))
        ++chosen;
    double row = order[chosen];
    for (int j = chosen; j > k; --j)
        order[j] = order[j - 1];
    order[k] = row;
    return lengths[chosen];
}

static void keep_longest(const qr *f, double most_kept)
{
    int most = f->rows < f->columns ? f->rows : f->columns, k = 0;
    if (most_kept < most)
        most = (int)ceil(most_kept);
    double tolerance = 100.0 * MBS_EPSILON * (f->rows > f->columns ? f->rows : f->columns);
    double first = 0.0, least = HUGE_VAL, shortest = HUGE_VAL, longest = 0.0;
    for (; k < most; ++k) {
        double length = take_pivot(f, k), *v = row_of(f, k) + k;
        int size = f->columns - k;
        first = k ? first : length;
        if (!(length > tolerance * first))
            break;
        double whole = f->part.scale[(int)f->part.order[k]];
        least = length < least ? length : least;
        shortest = whole < shortest ? whole : shortest;
        longest = whole > longest ? whole : longest;
        mbs_reflection(&f->part, k, length, v);
        while (size > 1 && v[size - 1] == 0.0)
            --size;
        for (int j = k + 1; j < f->rows; ++j) {
            double *other = row_of(f, j) + k;
            mbs_subtract(size, f->part.factors[k] * mbs_dot(size, v, other), v, other);
        }
    }
    f->head[MBS_RANK] = k;
    f->head[MBS_CONDITIONING] = k ? fmin(least, shortest / longest) : 0.0;
}

void mbs_factorise_pivoted(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    qr f = laid_out(pattern, factors);
    int size = 0;
    for (int j = 0; j < f.rows; ++j)
        size += span_of(&f, j).end - span_of(&f, j).first;
    double longest = mbs_largest(size, matrix);
    f.head[MBS_RANK] = NAN;
    f.head[MBS_PIVOTED] = 1.0;
    if (!isfinite(longest))
        return;
    scale_rows(&f, matrix, longest);
    keep_longest(&f, most);
}

void mbs_independent(const mbs_pattern *pattern, double *factors, double *independent)
{
    qr f = laid_out(pattern, factors);
    double rank = f.head[MBS_RANK];
    mbs_fill(f.rows, rank == f.rows, independent);
    for (int k = 0; k < rank && rank < f.rows; ++k)
        independent[(int)f.part.order[k]] = 1.0;
}

/* y = R^-T r over the kept rows; returns the largest |A x - r| of the others. */
static double forward(const qr *f, int rank)
{
    double largest = 0.0, *y = f->part.y;
    for (int k = 0; k < f->rows; ++k) {
        double left = f->part.scaled[(int)f->part.order[k]] - mbs_dot(k < rank ? k : rank, row_of(f, k), y);
        if (k < rank)
            y[k] = left * f->part.inverse[k];
        else if (fabs(left) > largest)
            largest = fabs(left);
    }
    return largest;
}

/* Multipliers = R^-1 y, zero for the rows that were not kept; x = Q (y, 0). */
static void backward(const qr *f, int rank, double *solution, double *multipliers)
{
    double *y = f->part.y;
    mbs_fill(f->columns, 0.0, solution);
    mbs_fill(f->rows, 0.0, multipliers);
    mbs_copy(rank, y, solution);
    for (int k = rank - 1; k >= 0; --k) {
        const double *row = row_of(f, k);
        int size = f->columns - k, j = (int)f->part.order[k];
        double value = y[k] * f->part.inverse[k];
        multipliers[j] = value / f->part.scale[j];
        mbs_subtract(k, value, row, y);
        mbs_subtract(size, f->part.factors[k] * mbs_dot(size, row + k, solution + k), row + k, solution + k);
    }
}

void mbs_substitute_pivoted(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                            double *multipliers, double *report)
{
    qr f = laid_out(pattern, factors);
    double rank = f.head[MBS_RANK];
    if (isnan(rank) || !isfinite(mbs_largest(f.rows, right))) {
        mbs_fill(f.columns, NAN, solution);
        mbs_fill(f.rows, NAN, multipliers);
        mbs_fill(3, NAN, report);
        return;
    }
    for (int j = 0; j < f.rows; ++j)
        f.part.scaled[j] = right[j] / f.part.scale[j];
    double left = forward(&f, (int)rank);
    backward(&f, (int)rank, solution, multipliers);
    report[0] = rank;
    report[1] = f.head[MBS_CONDITIONING];
    report[2] = left > 0.0 ? left / mbs_largest(f.rows, f.part.scaled) : 0.0;
}

/* ---- patterns of any size ---- */

/* Turn four rows by a reflection of `size` elements at once: sums of one row wait for each other. */
static void turn_four(int size, double factor, const double *v, double *const *rows)
{
    double *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], of_a = 0.0, of_b = 0.0, of_c = 0.0, of_d = 0.0;
    for (int i = 0; i < size; ++i) {
        of_a += v[i] * a[i];
        of_b += v[i] * b[i];
        of_c += v[i] * c[i];
        of_d += v[i] * d[i];
    }
    of_a *= factor;
    of_b *= factor;
    of_c *= factor;
    of_d *= factor;
    for (int i = 0; i < size; ++i) {
        a[i] -= of_a * v[i];
        b[i] -= of_b * v[i];
        c[i] -= of_c * v[i];
        d[i] -= of_d * v[i];
    }
}

/* Whether rows may be taken as they come. */
static int fits_in_order(const mbs_pattern *pattern, double most)
{
    return pattern->spans && pattern->rows > 0 && pattern->rows <= pattern->columns && !(most < pattern->rows);
}

/* mbs_keep_in_order, the same sums: each reflection turns all later rows that reach into it. The rows stand in `vectors`,
   with zeros where nothing else is within `low` and `high`, and the squares of their lengths in y. */
static int keep_in_order(const mbs_pattern *pattern, double *space)
{
    mbs_parts parts = mbs_parts_of(pattern, space);
    double longest = 0.0, shortest = MBS_LARGEST, least = HUGE_VAL, *four[4];
    int rows = pattern->rows, columns = pattern->columns;
    for (int k = 0; k < rows; ++k) {
        double *v = parts.vectors + k * columns + k, whole = parts.y[k];
        int size = pattern->spans[k].high - k, count = 0;
        double rest = mbs_dot(size, v, v);
        if (!(rest > MBS_CLEAR * MBS_CLEAR * whole))
            return 0;
        mbs_reflection(&parts, k, sqrt(rest), v);
        longest = whole > longest ? whole : longest;
        shortest = whole < shortest ? whole : shortest;
        least = rest < least * whole ? rest / whole : least;
        for (int j = k + 1; j < rows; ++j) {
            if (pattern->spans[j].low > k)
                continue;
            four[count++] = parts.vectors + j * columns + k;
            if (count == 4) {
                turn_four(size, parts.factors[k], v, four);
                count = 0;
            }
        }
        while (count-- > 0)
            mbs_subtract(size, parts.factors[k] * mbs_dot(size, v, four[count]), v, four[count]);
    }
    space[MBS_RANK] = rows;
    space[MBS_CONDITIONING] = sqrt(least * longest < shortest ? least : shortest / longest);
    space[MBS_PIVOTED] = 0.0;
    return longest < MBS_LARGEST && shortest > MBS_SMALLEST && shortest > MBS_ALIKE * MBS_ALIKE * longest;
}

/* Write the rows of a matrix, of which `matrix` has the elements within the spans, as keep_in_order takes them. */
static void unpack(const mbs_pattern *pattern, const double *matrix, double *space)
{
    mbs_parts parts = mbs_parts_of(pattern, space);
    for (int j = 0; j < pattern->rows; ++j) {
        const mbs_span *span = pattern->spans + j;
        double *row = parts.vectors + j * pattern->columns;
        int count = span->end - span->first;
        mbs_fill(span->first - span->low, 0.0, row + span->low);
        mbs_copy(count, matrix, row + span->first);
        mbs_fill(span->high - span->end, 0.0, row + span->end);
        parts.y[j] = mbs_dot(count, matrix, matrix);
        matrix += count;
    }
}

void mbs_factorise(const mbs_pattern *pattern, const double *matrix, double most, double *factors)
{
    if (fits_in_order(pattern, most)) {
        unpack(pattern, matrix, factors);
        if (keep_in_order(pattern, factors))
            return;
    }
    mbs_factorise_pivoted(pattern, matrix, most, factors);
}

void mbs_substitute(const mbs_pattern *pattern, double *factors, const double *right, double *solution,
                    double *multipliers, double *report)
{
    mbs_substitute_unrolled(pattern, factors, right, solution, multipliers, report);
}

/* ---- some rows ---- */


/* Rows that act fall apart into islands: rows of two of them have no column in common. How they do is kept from call to
   call, as long as the same rows act. In `kept` are the number of islands, whether all rows are taken as one, how many
   doubles the islands keep, and of each island its record: how many rows and columns it has, and how long the record is;
   which these are; where the elements of each row of A, and of C, begin in what follows, of each its place in the row,
   the first one first, and its number in the list of all elements. */
enum { ISLANDS, WHOLE, KEPT, RECORDS };
enum { ROWS, COLUMNS, LENGTH, WHICH };

/* An island: its rows' elements, and what they exert in unit vectors, with zeros that stay from call to call where rows
   have none, and the lengths of that; the factors of a matrix, and the room for right sides, multipliers and x. */
typedef struct {
    mbs_pattern pattern;
    mbs_span *spans, *extent; /* of each row: from `first` to `end` what it has in A, from `low` to `high` in C */
    const int *which, *column, *of_rows, *of_forces;
    double *kind, *residual, *right, *multipliers, *x, *matrix;
    double *unit, *lengths, *large, *solution, *factors;
} island;

enum { OWN, REGULAR, TOGETHER }; /* rows exert their own directions; others; and are found with x */

/* Where the islands that come next stand: their records, the doubles that they keep, the others, and their spans. */
typedef struct {
    const int *record;
    double *space, *room;
    mbs_span *spans, *extent;
} places;

static places places_in(const mbs_rows *rows, double *factors, mbs_span *spans, const int *kept)
{
    double *space = factors + 2 + rows->rows;
    places p = {kept + RECORDS, space, space + kept[KEPT], spans, spans + rows->rows};
    return p;
}

MBS_INLINE int kept_by_island(int rows, int n, int rubs)
{
    return 2 + 2 * rows + n + rows * n + (rubs ? rows * n + rows : 0);
}

/* Where the factors of an island stand, by its kind. */
MBS_INLINE void place_factors(island *s, double *room)
{
    int all = s->pattern.rows + s->pattern.columns;
    s->large = s->factors = room;
    if (*s->kind != OWN) {
        s->solution = room + all * all;
        s->factors = s->solution + 2 * all;
    }
}

MBS_INLINE island island_at(const places *p, int rubs)
{
    int rows = p->record[ROWS], n = p->record[COLUMNS];
    const int *which = p->record + WHICH, *of_rows = which + rows + n;
    double *right = p->space + 2, *x = right + 2 * rows, *matrix = x + n;
    island s = {.pattern = {rows, n, p->spans},
                .spans = p->spans,
                .extent = p->extent,
                .which = which,
                .column = which + rows,
                .of_rows = of_rows,
                .of_forces = of_rows + rows + 1,
                .kind = p->space,
                .residual = p->space + 1,
                .right = right,
                .multipliers = right + rows,
                .x = x,
                .matrix = matrix,
                .unit = matrix + rows * n,
                .lengths = matrix + 2 * rows * n};
    if (!rubs)
        *s.kind = OWN;
    place_factors(&s, p->room);
    return s;
}

MBS_INLINE void pass(places *p, const island *s, int rubs)
{
    int rows = s->pattern.rows, n = s->pattern.columns, all = rows + n;
    p->record += p->record[LENGTH];
    p->space += kept_by_island(rows, n, rubs);
    p->room = s->factors + (*s->kind == TOGETHER ? MBS_FACTORS(all, all) : MBS_FACTORS(rows, n));
    p->spans += rows;
    p->extent += rows;
}

/* While rows are linked: of a row that acts which it is, and the next one of its island; of an island, number `low` and
   `high` of its rows; and columns. */
typedef struct {
    mbs_span *link, *column;
} links;

static int root_of(mbs_span *column, int k)
{
    while (column[k].first != k)
        k = column[k].first = column[column[k].first].first;
    return k;
}

/* Join the columns of a row to those that begin at `root`, -1 for none; returns where all of them begin. */
static int joined(const mbs_rows *rows, int j, mbs_span *column, int root)
{
    for (int k = rows->begins[j]; k < rows->begins[j + 1]; ++k) {
        int own = rows->places[k], before = column[own].first;
        if (root < 0)
            root = root_of(column, own);
        if (before != root) {
            column[root_of(column, before)].first = root;
            column[own].first = root;
        }
    }
    return root;
}

/* Link the rows that act to islands, all to one if they are taken `whole`; returns how many there are. */
static int link_islands(const mbs_rows *rows, const double *acting, links p, int whole)
{
    int count = 0, found = 0, root = -1, most = MBS_MOST_ACTING(rows->rows, rows->columns);
    for (int k = 0; k < rows->columns; ++k) {
        mbs_span alone = {k, -1, 0, 0};
        p.column[k] = alone;
    }
    for (int j = 0; j < rows->rows; ++j)
        if (acting[j] != 0.0) {
            if (count == most)
                return -1;
            root = joined(rows->joins, j, p.column, whole ? root : -1);
            mbs_span row = {j, -1, root, 0};
            p.link[count++] = row;
        }
    for (int k = 0; k < count; ++k) {
        root = p.link[k].low < 0 ? -1 : root_of(p.column, p.link[k].low);
        int number = whole && found ? 0 : root < 0 ? -1 : p.column[root].end;
        if (number < 0) {
            number = found++;
            p.link[number].low = k;
            if (root >= 0)
                p.column[root].end = number;
        } else {
            p.link[p.link[number].high].end = k;
        }
        p.link[number].high = k;
    }
    return found;
}

/* Number the columns of a row in the order in which the rows of their island first have them. */
static int number_columns(const mbs_rows *rows, int j, int number, mbs_span *column, int count, int *which)
{
    for (int k = rows->begins[j]; k < rows->begins[j + 1]; ++k) {
        mbs_span *own = column + rows->places[k];
        if (own->high != number + 1) {
            own->high = number + 1;
            own->low = count;
            which[count++] = rows->places[k];
        }
    }
    return count;
}

/* Write where the elements of an island's rows stand, by their places; returns the end of the record. */
static int *list_elements(const mbs_rows *rows, const int *which, int count, const mbs_span *column, int *begins,
                          int *to)
{
    for (int r = 0; r < count; ++r) {
        begins[r] = (int)(to - begins);
        int *first = to;
        for (int k = rows->begins[which[r]]; k < rows->begins[which[r] + 1]; ++k) {
            int place = column[rows->places[k]].low, *at = to;
            for (; at > first && at[-2] > place; at -= 2) {
                at[0] = at[-2];
                at[1] = at[-1];
            }
            at[0] = place;
            at[1] = k;
            to += 2;
        }
    }
    begins[count] = (int)(to - begins);
    return to;
}

/* Write the record of an island: its rows and columns, and the rows' elements. */
static void record_island(const mbs_rows *rows, const mbs_rows *forces, int number, links p, int *record)
{
    int count = 0, n = 0, *which = record + WHICH;
    for (int k = p.link[number].low; k >= 0; k = p.link[k].end)
        which[count++] = p.link[k].first;
    for (int r = 0; r < count; ++r) {
        n = number_columns(rows, which[r], number, p.column, n, which + count);
        n = forces ? number_columns(forces, which[r], number, p.column, n, which + count) : n;
    }
    int *of_rows = which + count + n, *of_forces = of_rows + count + 1, *to = of_forces + (forces ? count + 1 : 0);
    to = list_elements(rows, which, count, p.column, of_rows, to);
    if (forces)
        to = list_elements(forces, which, count, p.column, of_forces, to);
    record[ROWS] = count;
    record[COLUMNS] = n;
    record[LENGTH] = (int)(to - record);
}

/* Keep how the rows that act fall apart. */
static void keep_islands(const mbs_rows *rows, const mbs_rows *forces, const double *acting, double *factors,
                         mbs_span *spans, int *kept, int whole)
{
    links p = {spans, spans + rows->rows};
    int *record = kept + RECORDS;
    kept[ISLANDS] = link_islands(rows, acting, p, whole);
    kept[WHOLE] = whole;
    kept[KEPT] = 0;
    for (int number = 0; number < kept[ISLANDS]; ++number) {
        record_island(rows, forces, number, p, record);
        kept[KEPT] += kept_by_island(record[ROWS], record[COLUMNS], forces != 0);
        record += record[LENGTH];
    }
    factors[1] = forces != 0;
    mbs_copy(rows->rows, acting, factors + 2);
    mbs_fill(kept[KEPT], 0.0, factors + 2 + rows->rows);
}

/* Write the elements of a row at their places; returns where those stand that are not zero. */
static mbs_span gathered(const int *element, const int *end, const double *from, int n, double *to)
{
    for (const int *k = element; k < end; k += 2)
        to[k[0]] = from[k[1]];
    while (element < end && to[element[0]] == 0.0)
        element += 2;
    while (element < end && to[end[-2]] == 0.0)
        end -= 2;
    mbs_span found = {element < end ? element[0] : n, element < end ? end[-2] + 1 : 0, 0, 0};
    return found;
}

static void gather_island(const island *s, const double *matrix, const double *exerted)
{
    int n = s->pattern.columns;
    for (int r = 0; r < s->pattern.rows; ++r) {
        const int *at = s->of_rows;
        s->extent[r] = gathered(at + at[r], at + at[r + 1], matrix, n, s->matrix + r * n);
        if (exerted) {
            at = s->of_forces;
            mbs_span of = gathered(at + at[r], at + at[r + 1], exerted, n, s->unit + r * n);
            s->extent[r].low = of.first;
            s->extent[r].high = of.end;
        }
    }
}

/* Factorise a matrix of the rows of an island, of which all elements are there, zeros from `width` on. */
static void factorise_within(const island *s, const double *matrix, int width, double most)
{
    int n = s->pattern.columns, rows = s->pattern.rows, in_order = fits_in_order(&s->pattern, most);
    mbs_parts parts = mbs_parts_of(&s->pattern, s->factors);
    mbs_span *spans = s->spans;
    for (int j = 0; j < rows && in_order; ++j) {
        const double *row = matrix + j * n;
        int first = 0, end = width, low = 0;
        while (end > 0 && row[end - 1] == 0.0)
            --end;
        while (first < end && row[first] == 0.0)
            ++first;
        while (low < j && spans[low].high <= first)
            ++low;
        int high = end > j ? end : j + 1;
        for (int k = low; k < j; ++k)
            high = spans[k].high > high ? spans[k].high : high;
        mbs_span span = {first, end, low < first ? low : first, high < n ? high : n};
        spans[j] = span;
        mbs_copy(span.high - span.low, row + span.low, parts.vectors + j * n + span.low);
        parts.y[j] = mbs_dot(end - first, row + first, row + first);
    }
    const mbs_pattern whole = {rows, n, 0};
    if (!in_order || !keep_in_order(&s->pattern, s->factors))
        mbs_factorise_pivoted(&whole, matrix, most, s->factors);
}

/* Whether what a row exerts differs from the row itself. */
static int differs(const island *s, int r)
{
    mbs_span of = s->extent[r];
    const double *row = s->matrix + r * s->pattern.columns, *unit = s->unit + r * s->pattern.columns;
    if (of.first != of.low || of.end != of.high)
        return 1;
    for (int i = of.first; i < of.end; ++i)
        if (row[i] != unit[i])
            return 1;
    return 0;
}

/* Make what rows exert unit vectors, none of them much shorter than the longest, or leave it as it is where multipliers
   are `plain`; returns whether they differ from A, or are plain. */
static int made_units(const island *s, int plain)
{
    int count = s->pattern.rows, n = s->pattern.columns, k = 0;
    double longest = 0.0;
    while (!plain && k < count && !differs(s, k))
        ++k;
    if (k == count)
        return 0;
    for (k = 0; k < count; ++k) {
        const mbs_span *of = s->extent + k;
        const double *unit = s->unit + k * n + of->low;
        int size = of->high > of->low ? of->high - of->low : 0;
        s->lengths[k] = plain ? 1.0 : sqrt(mbs_dot(size, unit, unit));
        longest = s->lengths[k] > longest ? s->lengths[k] : longest;
    }
    double shortest = MBS_SHORTEST * longest > MBS_NEARLY_ZERO ? MBS_SHORTEST * longest : MBS_NEARLY_ZERO;
    for (k = 0; k < count; ++k) {
        if (!(s->lengths[k] > shortest))
            s->lengths[k] = shortest;
        for (int i = s->extent[k].low; i < s->extent[k].high && !plain; ++i)
            s->unit[k * n + i] /= s->lengths[k];
    }
    return 1;
}

/* Return the smallest part of a kept row of A that A C^T leaves, beside its other rows. */
static double least_left(const island *s)
{
    mbs_parts part = mbs_parts_of(&s->pattern, s->factors);
    int n = s->pattern.columns, pivoted = s->factors[MBS_PIVOTED] != 0.0;
    double least = s->factors[MBS_RANK] ? HUGE_VAL : 0.0;
    for (int k = 0; k < s->factors[MBS_RANK]; ++k) {
        int j = pivoted ? (int)part.order[k] : k, first = s->extent[j].first;
        const double *row = s->matrix + j * n + first;
        double length = sqrt(mbs_dot(s->extent[j].end - first, row, row));
        double left = (pivoted ? part.scale[j] : 1.0) / fabs(part.inverse[k]) / length;
        least = left < least ? left : least;
    }
    return least;
}

/* [A 0; E -C^T]: x and multipliers are found together. */
static mbs_pattern together(const island *s)
{
    int count = s->pattern.rows, n = s->pattern.columns, all = count + n;
    mbs_fill(all * all, 0.0, s->large);
    for (int k = 0; k < count; ++k)
        mbs_copy(n, s->matrix + k * n, s->large + k * all);
    for (int i = 0; i < n; ++i) {
        double *row = s->large + (count + i) * all;
        row[i] = 1.0;
        for (int k = 0; k < count; ++k)
            row[n + k] = -s->unit[k * n + i];
    }
    mbs_pattern pattern = {all, all, 0};
    return pattern;
}

static void factorise_own(const island *s, double most) /* of A C^T, with zeros beside it up to n columns */
{
    int count = s->pattern.rows, n = s->pattern.columns;
    mbs_fill(count * n, 0.0, s->large);
    for (int j = 0; j < count; ++j)
        for (int k = 0; k < count; ++k) {
            int first = s->extent[j].first, end = s->extent[j].end;
            first = s->extent[k].low > first ? s->extent[k].low : first;
            end = s->extent[k].high < end ? s->extent[k].high : end;
            if (first < end)
                s->large[j * n + k] = mbs_dot(end - first, s->matrix + j * n + first, s->unit + k * n + first);
        }
    factorise_within(s, s->large, count, most);
}

/* Return whether A, C and A C^T have the same rank: then x is unique, and multipliers of least norm follow from the last.
   Its factors are made again. */
static int same_rank(const island *s, double most)
{
    double rank = s->factors[MBS_RANK];
    const double *both[] = {s->matrix, s->unit};
    const mbs_pattern whole = {s->pattern.rows, s->pattern.columns, 0};
    for (int k = 0; k < 2; ++k) {
        mbs_factorise_pivoted(&whole, both[k], most + k, s->factors);
        double found = s->factors[MBS_RANK];
        if (found > most && 1.0 <= MBS_CLEAR * fabs(mbs_parts_of(&whole, s->factors).inverse[(int)most]))
            found = most; /* by rounding */
        if (found != rank)
            return 0;
    }
    factorise_own(s, most);
    return 1;
}

/* Returns the rank of an island whose rows exert their own directions, or what `exerted` says. */
static double factorise_island(island *s, double *room, int rubs, int plain, double most)
{
    *s->kind = OWN;
    place_factors(s, room);
    if (!rubs || !made_units(s, plain)) {
        factorise_within(s, s->matrix, s->pattern.columns, most);
        return s->factors[MBS_RANK];
    }
    int count = s->pattern.rows, n = s->pattern.columns;
    *s->kind = REGULAR;
    place_factors(s, room);
    if (count <= n) {
        factorise_own(s, most);
        /* what is not finite has no rank and no factors, nor more of it */
        if (isnan(s->factors[MBS_RANK]))
            return s->factors[MBS_RANK];
        if (s->factors[MBS_RANK] == count || same_rank(s, most)) {
            s->factors[MBS_CONDITIONING] = least_left(s); /* what is left of rows is measured by the rows of A */
            return s->factors[MBS_RANK];
        }
    }
    *s->kind = TOGETHER;
    mbs_pattern own = together(s);
    mbs_factorise(&own, s->large, most + n, s->factors);
    return s->factors[MBS_RANK] - n;
}

static int are_same(int n, const double *a, const double *b)
{
#if defined(__GNUC__)
    return __builtin_memcmp(a, b, (unsigned long)n * sizeof *a) == 0;
#else
    int k = 0;
    while (k < n && a[k] == b[k])
        ++k;
    return k == n;
#endif
}

/* Returns the rank of all rows that act, taken as islands or as one `whole`. No more than `most` of an island are kept. */
static double factorise_all(const mbs_rows *rows, const double *matrix, const mbs_rows *forces, const double *exerted,
                            const double *acting, double most, double *factors, mbs_span *spans, int *kept, int whole)
{
    if (!kept[ISLANDS] || kept[WHOLE] != whole || !are_same(rows->rows, acting, factors + 2))
        keep_islands(rows, forces, acting, factors, spans, kept, whole);
    double rank = kept[ISLANDS] < 0 ? NAN : 0.0;
    places p = places_in(rows, factors, spans, kept);
    for (int number = 0; number < kept[ISLANDS]; ++number) {
        island s = island_at(&p, forces != 0);
        gather_island(&s, matrix, forces ? exerted : 0);
        rank += factorise_island(&s, p.room, forces != 0, acting[s.which[0]] == MBS_PLAIN, most);
        pass(&p, &s, forces != 0);
    }
    factors[0] = kept[ISLANDS];
    return rank;
}

/* Islands are independent of each other. Where they have more rank than there should be in all, by rounding, all rows are
   taken as one, the clearest of them first. */
void mbs_factorise_acting(const mbs_rows *rows, const double *matrix, const mbs_rows *forces, const double *exerted,
                          const double *acting, double most, double *factors, mbs_span *spans, int *kept)
{
    if (factorise_all(rows, matrix, forces, exerted, acting, most, factors, spans, kept, 0) > most && factors[0] > 1)
        factorise_all(rows, matrix, forces, exerted, acting, most, factors, spans, kept, 1);
}

/* x and the multipliers of an island. */
static void substitute_island(const island *s, double *report)
{
    int count = s->pattern.rows, n = s->pattern.columns, large = *s->kind == TOGETHER;
    if (*s->kind == OWN) {
        mbs_substitute(&s->pattern, s->factors, s->right, s->x, s->multipliers, report);
        return;
    }
    mbs_pattern both = {count + n, count + n, 0};
    double *wanted = s->large, *unused = wanted + both.rows;
    mbs_fill(both.rows, 0.0, wanted);
    mbs_copy(count, s->right, wanted);
    mbs_substitute(large ? &both : &s->pattern, s->factors, wanted, s->solution, unused, report);
    const double *carried = large ? s->solution + n : s->solution;
    report[0] -= large ? n : 0;
    mbs_fill(n, 0.0, s->x);
    for (int k = 0; k < count; ++k) {
        int first = s->extent[k].low;
        mbs_subtract(s->extent[k].high - first, -carried[k], s->unit + k * n + first, s->x + first);
        s->multipliers[k] = carried[k] / s->lengths[k];
    }
}

/* The largest residual of all islands relative to the largest right side, rows taken as of length one: those of length
   zero count as of the longest one's. */
static double residual_of_all(const places *begin, int islands, int rubs)
{
    double longest = 0.0, left = 0.0, largest = 0.0;
    for (int pass_number = 0; pass_number < 2; ++pass_number) {
        places p = *begin;
        for (int number = 0; number < islands; ++number) {
            island s = island_at(&p, rubs);
            double most = 0.0;
            for (int r = 0; r < s.pattern.rows; ++r) {
                const double *row = s.matrix + r * s.pattern.columns;
                double length = sqrt(mbs_dot(s.pattern.columns, row, row));
                double counted = length > 0.0 ? length : longest > 0.0 ? longest : 1.0;
                longest = pass_number ? longest : fmax(longest, length);
                most = pass_number ? fmax(most, fabs(s.right[r]) / counted) : 0.0;
            }
            left = fmax(left, *s.residual * most);
            largest = fmax(largest, most);
            pass(&p, &s, rubs);
        }
    }
    return left / largest;
}

void mbs_substitute_acting(const mbs_rows *rows, double *factors, mbs_span *spans, int *kept, const double *right,
                           double *solution, double *multipliers, double *report)
{
    int rubs = factors[1] != 0.0, islands = (int)factors[0];
    double rank = islands < 0 ? NAN : 0.0, least = HUGE_VAL, left = 0.0;
    const places begin = places_in(rows, factors, spans, kept);
    places p = begin;
    mbs_fill(rows->columns, 0.0, solution);
    mbs_fill(rows->rows, 0.0, multipliers);
    for (int number = 0; number < islands; ++number) {
        island s = island_at(&p, rubs);
        for (int r = 0; r < s.pattern.rows; ++r)
            s.right[r] = right[s.which[r]];
        substitute_island(&s, report);
        for (int r = 0; r < s.pattern.rows; ++r)
            multipliers[s.which[r]] = s.multipliers[r];
        for (int i = 0; i < s.pattern.columns; ++i)
            solution[s.column[i]] = s.x[i];
        rank += report[0];
        least = report[0] > 0.0 && report[1] < least ? report[1] : least;
        *s.residual = report[2];
        left = report[2] > left ? report[2] : left;
        pass(&p, &s, rubs);
    }
    report[0] = rank;
    report[1] = rank > 0.0 ? least : 0.0;
    report[2] = left > 0.0 && islands > 1 ? residual_of_all(&begin, islands, rubs) : left;
    if (isnan(rank)) {
        mbs_fill(rows->columns, NAN, solution);
        mbs_fill(rows->rows, NAN, multipliers);
        mbs_fill(3, NAN, report);
    }
}
