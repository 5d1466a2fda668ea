/* The force of a liquid in the thesis (Rek 2024, chapter 4) in plain C, the yardstick for the time of a tick.

   Velocity, knee, position tail and drag at a fixed rate, without safety layer and device; compiled by plain_c.py.
   Sums over the tail are updated in every tick; they and the elements are divided by `decayed`, their common decay.
   Elements and segments are numbered from 0; number q is in row q % N of its ring. */

#include <math.h>
#include <stdlib.h>

typedef struct {
    double scale, origin_m[3], period_s;
    double alpha;                   /* weight of the newest difference of positions */
    double threshold_mps;           /* speeds above it are lowered */
    double drag_kg_m;               /* 1/2 rho C_d A */
    double scaling, exponent, breaking_cosine, breaking_span_m;
    double decay;                   /* per tick */
    double vertical;                /* 1: the tail follows vertical motion, 0: it does not */
    long length;                    /* N; 0: no tail */
} Parameters;

typedef struct { double e_mps[3], speed_mps, arc_m; long segment; } Element;    /* speed 0: at rest */
typedef struct { double direction[3], speeds_mps; long count; } Segment;        /* direction of its newest element */

typedef struct {
    Parameters of;
    double position_m[3], velocity_mps[3];
    long ticks;                     /* so far; each stores an element */
    Element *elements;
    Segment *segments;
    long first, last;               /* the oldest and the newest segment */
    long reference, scanned;        /* the element to compare with; the first one not yet considered for it */
    long evicted;                   /* moving elements since the last `sum_again` */
    double arc_m, decayed;
    double speeds_mps, squares_m2ps2, interior_mps[3];      /* interior: segments between first and last */
} Liquid;

static double norm(const double *a) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

static Element *element(const Liquid *it, long number) { return &it->elements[number % it->of.length]; }

static Segment *segment(const Liquid *it, long number) { return &it->segments[number % it->of.length]; }

static void add_speed(Liquid *it, Segment *to, double speed_mps, double sign)
{
    to->speeds_mps += sign * speed_mps;
    it->speeds_mps += sign * speed_mps;
    it->squares_m2ps2 += sign * speed_mps * speed_mps;
}

static void add_interior(Liquid *it, const Segment *of, double sign)
{
    for (int k = 0; k < 3; k++) it->interior_mps[k] += sign * of->direction[k] * of->speeds_mps;
}

static void clear_sums(Liquid *it)
{
    it->speeds_mps = it->squares_m2ps2 = it->interior_mps[0] = it->interior_mps[1] = it->interior_mps[2] = 0;
    it->evicted = 0;
    it->decayed = 1;
}

/* Compute the sums again, once in N ticks of motion: rounding errors do not grow, and `decayed` stays above 0. */
static void sum_again(Liquid *it)
{
    double decayed = it->decayed;
    clear_sums(it);
    for (long q = it->first; q <= it->last; q++) segment(it, q)->speeds_mps = 0;
    for (long q = it->ticks > it->of.length ? it->ticks - it->of.length : 0; q < it->ticks; q++) {
        Element *e = element(it, q);
        for (int k = 0; k < 3; k++) e->e_mps[k] *= decayed;
        e->speed_mps *= decayed;
        if (e->speed_mps > 0) add_speed(it, segment(it, e->segment), e->speed_mps, 1);
    }
    for (long q = it->first + 1; q < it->last; q++) add_interior(it, segment(it, q), 1);
}

static void evict_oldest(Liquid *it)
{
    long oldest = it->ticks - it->of.length;
    Segment *from = segment(it, it->first);
    if (element(it, oldest)->speed_mps == 0) return;
    it->evicted++;
    add_speed(it, from, element(it, oldest)->speed_mps, -1);
    if (--from->count > 0) {
        if (it->reference == oldest) {
            do it->reference++; while (element(it, it->reference)->speed_mps == 0);
            if (it->scanned <= it->reference) it->scanned = it->reference + 1;
        }
    } else if (it->first == it->last) {
        from->speeds_mps = 0;
        clear_sums(it);
    } else if (++it->first != it->last) {
        add_interior(it, segment(it, it->first), -1);
    }
}

/* Whether e turns from the youngest element of the segment at least a breaking span earlier, or from its oldest. */
static int turns(Liquid *it, const double *e_mps, double speed_mps)
{
    for (; it->scanned < it->ticks; it->scanned++) {
        if (it->arc_m - element(it, it->scanned)->arc_m < it->of.breaking_span_m) break;
        if (element(it, it->scanned)->speed_mps > 0) it->reference = it->scanned;
    }
    const Element *reference = element(it, it->reference);
    double along = 0;
    for (int k = 0; k < 3; k++) along += e_mps[k] * reference->e_mps[k];
    return along < (it->of.breaking_cosine - 1e-12) * speed_mps * reference->speed_mps;
}

static void store(Liquid *it, const double *v_mps)
{
    double e_mps[3] = {v_mps[0], it->of.vertical * v_mps[1], v_mps[2]}, speed_mps = norm(e_mps);
    it->decayed *= it->of.decay;
    if (it->evicted >= it->of.length) sum_again(it);
    it->arc_m += speed_mps * it->of.period_s;
    int moves = speed_mps >= 1e-3;
    int breaks = moves && segment(it, it->last)->count > 0 && turns(it, e_mps, speed_mps);
    if (it->ticks >= it->of.length) evict_oldest(it);
    if (breaks && segment(it, it->last)->count > 0) {
        if (it->last != it->first) add_interior(it, segment(it, it->last), 1);
        it->last++;
        *segment(it, it->last) = (Segment){{0}, 0, 0};
    }
    Element *e = element(it, it->ticks);
    for (int k = 0; k < 3; k++) e->e_mps[k] = e_mps[k] / it->decayed;
    e->speed_mps = moves ? speed_mps / it->decayed : 0;
    e->arc_m = it->arc_m;
    e->segment = it->last;
    if (!moves) return;
    Segment *to = segment(it, it->last);
    if (to->count++ == 0) {
        it->reference = it->ticks;
        it->scanned = it->ticks + 1;
    }
    for (int k = 0; k < 3; k++) to->direction[k] = e->e_mps[k] / e->speed_mps;
    add_speed(it, to, e->speed_mps, 1);
}

static void subtract_wake(const Liquid *it, double *w_mps)
{
    const Segment *first = segment(it, it->first), *last = segment(it, it->last);
    double wake_mps[3], last_mps = last != first ? last->speeds_mps : 0, gain;
    for (int k = 0; k < 3; k++) {
        double sum_mps = it->interior_mps[k] + first->direction[k] * first->speeds_mps + last->direction[k] * last_mps;
        wake_mps[k] = it->decayed * sum_mps / it->of.scaling;
    }
    double size_mps = norm(wake_mps);
    if (size_mps < 1e-30) return;
    double fill = size_mps * it->speeds_mps / (it->decayed * it->squares_m2ps2), power = it->of.exponent - 1;
    gain = power < 0 ? pow(fill * fill + 0.05 * 0.05, power / 2) : power > 0 ? pow(fill, power) : 1;
    for (int k = 0; k < 3; k++) w_mps[k] -= gain * wake_mps[k];
}

Liquid *create_liquid(const Parameters *of)
{
    Liquid *it = calloc(1, sizeof *it);
    it->of = *of;
    it->elements = calloc(of->length + 1, sizeof *it->elements);
    it->segments = calloc(of->length + 1, sizeof *it->segments);
    it->decayed = 1;
    return it;
}

void free_liquid(Liquid *it)
{
    free(it->elements);
    free(it->segments);
    free(it);
}

/* Write the force at each of n positions of the hand, which follow those of the call before. */
void run(Liquid *it, long n, const double (*hand_m)[3], double (*force_n)[3])
{
    for (long i = 0; i < n; i++, it->ticks++) {
        for (int k = 0; k < 3; k++) {
            double position_m = it->of.origin_m[k] + it->of.scale * hand_m[i][k];
            double before_m = it->ticks > 0 ? it->position_m[k] : position_m;
            it->velocity_mps[k] += it->of.alpha * ((position_m - before_m) / it->of.period_s - it->velocity_mps[k]);
            it->position_m[k] = position_m;
        }
        double speed_mps = norm(it->velocity_mps), excess_mps = speed_mps - it->of.threshold_mps, v_mps[3], w_mps[3];
        double lowered = excess_mps > 0 ? (it->of.threshold_mps + sqrt(1 + 2 * excess_mps) - 1) / speed_mps : 1;
        for (int k = 0; k < 3; k++) v_mps[k] = w_mps[k] = lowered * it->velocity_mps[k];
        if (it->of.length > 0) subtract_wake(it, w_mps);
        double resistance_nspm = it->of.drag_kg_m * norm(w_mps);
        for (int k = 0; k < 3; k++) force_n[i][k] = -resistance_nspm * w_mps[k];
        if (it->of.length > 0) store(it, v_mps);
    }
}
