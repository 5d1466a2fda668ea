/* A device whose library is called: READ asks it for a sample, WRITE gives it a force. Both must take far less than a
 * tick; a library that waits for the device's next sample does not fit here (see mailbox.c). */
#include "frames.h"

/* Return 0, or what failed. */
int32_t direct_open(intptr_t context) {
    (void)context;
    return maker_open();
}

void direct_close(void) {
    maker_close(); /* zero force, then let go */
}

int32_t direct_read(intptr_t context, int64_t now_ns, intptr_t reading) {
    liquid_study_exchange *exchange = (liquid_study_exchange *)context;
    double position_mm[3], velocity_mmps[3];
    int64_t time_ns;
    if (!enter(exchange)) {
        return LIQUID_STUDY_READ_LOST;
    }
    exchange->now_ns = now_ns;
    exchange->ticks++;
    if (maker_get(position_mm, velocity_mmps, &time_ns) != 0) {
        return leave(exchange, LIQUID_STUDY_READ_LOST);
    }
    fill_reading(exchange, (liquid_study_reading *)reading, position_mm, velocity_mmps, time_ns);
    return leave(exchange, LIQUID_STUDY_READ_NEW);
}

int32_t direct_write(intptr_t context, intptr_t command) {
    liquid_study_exchange *exchange = (liquid_study_exchange *)context;
    liquid_study_command *asked = (liquid_study_command *)command;
    double force_n[3];
    if (!enter(exchange)) {
        limit_force(asked->force_n, 0.0, asked->sent_n);
        return LIQUID_STUDY_READ_LOST;
    }
    limit_force(asked->force_n, exchange->force_limit_n, asked->sent_n);
    to_maker(asked->sent_n, force_n);
    return leave(exchange, maker_set_force(force_n) == 0 ? 0 : LIQUID_STUDY_READ_LOST);
}
