/* A device whose library owns the 1 kHz thread: it calls `tick` every millisecond, and the servo runs in a thread of its
 * own. Samples and forces change hands in two mailboxes that hold the newest value only; neither thread waits for the
 * other. A force acts at least one tick later than with direct.c: READ says how much later, and the servo permits less
 * damping accordingly. */
#include "frames.h"

#include <stdatomic.h>
#include <string.h>

#define SILENT_TICKS 20 /* without a force for so many ticks, the servo hangs or is gone: zero force */

#define ACTS_NS 500000  /* a force counts as having acted after so long: ticks of a late thread follow at once */

typedef struct {
    double position_mm[3], velocity_mmps[3];
    int64_t time_ns;
    int64_t acted; /* number of the WRITE whose force acted until this sample */
} sample;

typedef struct {
    double force_n[3];
    int64_t number; /* counts WRITEs */
} force;

/* Three places and the index of the newest: the writer fills its own, then exchanges it for the newest; so does the
 * reader. Nothing is read while it is written. */
#define NEW 4u
#define MAILBOX(type)            \
    struct {                     \
        type places[3];          \
        atomic_uint newest;      \
        unsigned written, taken; \
    }

#define RESET(box) ((box).written = 0u, (box).taken = 1u, atomic_store(&(box).newest, 2u))
#define PUT(box, value)                        \
    ((box).places[(box).written] = (value),    \
     (box).written = atomic_exchange(&(box).newest, (box).written | NEW) & 3u)
#define IS_NEW(box) ((atomic_load(&(box).newest) & NEW) != 0u)
#define TAKE(box) ((box).taken = atomic_exchange(&(box).newest, (box).taken) & 3u, (box).places[(box).taken])

static struct {
    MAILBOX(sample) samples;
    MAILBOX(force) forces;
    int64_t written;   /* WRITEs so far; of the servo's thread */
    force acting;      /* of the library's thread, as the following */
    int64_t acting_ns; /* since when, on the device's clock */
    int64_t acted;     /* number of the last force that acted */
    int64_t silent;
    atomic_int lost;
} device;

static void tick(void *unused) {
    sample now;
    double force_n[3] = {0.0, 0.0, 0.0};
    (void)unused;
    if (device.lost || maker_get(now.position_mm, now.velocity_mmps, &now.time_ns) != 0) {
        device.lost = 1; /* for good: a device that answers again gets no force either */
        maker_set_force(force_n);
        return;
    }
    if (now.time_ns - device.acting_ns >= ACTS_NS) {
        device.acted = device.acting.number;
    }
    now.acted = device.acted;
    PUT(device.samples, now);
    if (IS_NEW(device.forces)) {
        device.acting = TAKE(device.forces);
        device.acting_ns = now.time_ns;
        device.silent = 0;
    } else if (++device.silent >= SILENT_TICKS) {
        memset(device.acting.force_n, 0, sizeof device.acting.force_n);
    }
    to_maker(device.acting.force_n, force_n);
    if (maker_set_force(force_n) != 0) {
        device.lost = 1;
    }
}

/* Return 0, or what failed. */
int32_t mailbox_open(intptr_t context) {
    (void)context;
    memset(&device.acting, 0, sizeof device.acting);
    device.written = device.silent = device.acted = device.acting_ns = 0;
    device.lost = 0;
    RESET(device.samples);
    RESET(device.forces);
    if (maker_open() != 0) {
        return -1;
    }
    if (maker_start(tick, 0) != 0) {
        maker_close();
        return -1;
    }
    return 0;
}

void mailbox_close(void) {
    maker_close(); /* ends the thread, then zero force */
}

int32_t mailbox_read(intptr_t context, int64_t now_ns, intptr_t reading) {
    liquid_study_exchange *exchange = (liquid_study_exchange *)context;
    liquid_study_reading *out = (liquid_study_reading *)reading;
    if (!enter(exchange)) {
        return LIQUID_STUDY_READ_LOST;
    }
    exchange->now_ns = now_ns;
    exchange->ticks++;
    if (device.lost) {
        return leave(exchange, LIQUID_STUDY_READ_LOST);
    }
    if (!IS_NEW(device.samples)) {
        return leave(exchange, LIQUID_STUDY_READ_NOTHING_NEW);
    }
    sample newest = TAKE(device.samples);
    fill_reading(exchange, out, newest.position_mm, newest.velocity_mmps, newest.time_ns);
    out->delay_ticks = device.written - newest.acted;
    return leave(exchange, LIQUID_STUDY_READ_NEW);
}

int32_t mailbox_write(intptr_t context, intptr_t command) {
    liquid_study_exchange *exchange = (liquid_study_exchange *)context;
    liquid_study_command *asked = (liquid_study_command *)command;
    if (!enter(exchange)) {
        limit_force(asked->force_n, 0.0, asked->sent_n);
        return LIQUID_STUDY_READ_LOST;
    }
    force next = {.number = ++device.written};
    limit_force(asked->force_n, exchange->force_limit_n, asked->sent_n);
    memcpy(next.force_n, asked->sent_n, sizeof next.force_n);
    PUT(device.forces, next);
    return leave(exchange, device.lost ? LIQUID_STUDY_READ_LOST : 0);
}
