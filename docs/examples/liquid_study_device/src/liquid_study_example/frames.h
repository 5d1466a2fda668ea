/* The only place that knows the maker's units and axes, and the last place that limits the force. */
#ifndef FRAMES_H
#define FRAMES_H

#include "liquid_study_device.h"
#include "maker.h"

#include <math.h>
#include <stdatomic.h>

/* Return whether the device may be used, until `leave`. */
static inline int enter(liquid_study_exchange *exchange) {
    exchange->inside = 1;
    atomic_thread_fence(memory_order_seq_cst);
    if (exchange->ended != LIQUID_STUDY_RUNS) {
        exchange->inside = 0;
        return 0;
    }
    return 1;
}

/* Mark the device as no longer in use, and return the answer; if it was closed or lost meanwhile, end the force. */
static inline int32_t leave(liquid_study_exchange *exchange, int32_t answer) {
    const double none[3] = {0.0, 0.0, 0.0};
    if (answer == LIQUID_STUDY_READ_LOST && exchange->ended == LIQUID_STUDY_RUNS) {
        exchange->ended = LIQUID_STUDY_LOST;
    }
    if (exchange->ended != LIQUID_STUDY_RUNS) {
        maker_set_force(none);
    }
    if (exchange->ended == LIQUID_STUDY_RELEASED) {
        exchange->ended = LIQUID_STUDY_FINISHED;
    }
    atomic_thread_fence(memory_order_seq_cst);
    exchange->inside = 0;
    return answer;
}

/* A maker's vector (x toward the operator, y to the right, z up) as one of the hand frame. */
static inline void to_hand(const double of_maker[3], double factor, double of_hand[3]) {
    of_hand[0] = factor * of_maker[1];
    of_hand[1] = factor * of_maker[2];
    of_hand[2] = factor * of_maker[0];
}

static inline void to_maker(const double of_hand[3], double of_maker[3]) {
    of_maker[0] = of_hand[2];
    of_maker[1] = of_hand[0];
    of_maker[2] = of_hand[1];
}

/* Put what may be sent of `force_n` into `sent_n`: nothing of a force that is not finite, no more than the limit. */
static inline void limit_force(const double force_n[3], double limit_n, double sent_n[3]) {
    double size_n = sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] + force_n[2] * force_n[2]);
    double share = size_n <= limit_n ? 1.0 : isfinite(size_n) ? limit_n / size_n : 0.0;
    for (int axis = 0; axis < 3; axis++) {
        sent_n[axis] = share > 0.0 ? share * force_n[axis] : 0.0;
    }
}

/* Give a new sample; position and velocity are in the maker's units. */
static inline void fill_reading(
    liquid_study_exchange *exchange, liquid_study_reading *out, const double position_mm[3],
    const double velocity_mmps[3], int64_t time_ns
) {
    exchange->fresh++;
    exchange->fresh_ns = exchange->now_ns;
    to_hand(position_mm, 1e-3, out->position_m);
    out->buttons = 0;
    if (out->size_bytes >= (int64_t)sizeof *out) { /* a servo of version 1 has a shorter record */
        to_hand(velocity_mmps, 1e-3, out->velocity_mps);
        out->device_time_ns = time_ns;
        out->measured = LIQUID_STUDY_MEASURED_VELOCITY | LIQUID_STUDY_MEASURED_TIME;
    }
}

#endif
