/* A device whose library is called: READ asks it for a sample, WRITE gives it a force. Both must take far less than a
 * tick; a library that waits for the device's next sample does not fit here (see mailbox.c). */
#include "frames.h"

#include <stdatomic.h>

static struct {
    double force_limit_n;
    atomic_int open;
} device;

/* Return the context, 0 where the device cannot be opened. */
intptr_t direct_open(double force_limit_n) {
    device.force_limit_n = force_limit_n;
    device.open = maker_open() == 0;
    return device.open ? (intptr_t)&device : 0;
}

void direct_close(intptr_t context) {
    (void)context;
    device.open = 0; /* a servo that hung and goes on sends no more */
    maker_close();
}

int32_t direct_read(intptr_t context, int64_t now_ns, intptr_t reading) {
    double position_mm[3], velocity_mmps[3];
    int64_t time_ns;
    (void)context;
    (void)now_ns;
    if (maker_get(position_mm, velocity_mmps, &time_ns) != 0) {
        return LIQUID_STUDY_READ_LOST;
    }
    fill_reading((liquid_study_reading *)reading, position_mm, velocity_mmps, time_ns);
    return LIQUID_STUDY_READ_NEW;
}

int32_t direct_write(intptr_t context, intptr_t command) {
    liquid_study_command *asked = (liquid_study_command *)command;
    double force_n[3];
    (void)context;
    limit_force(asked->force_n, device.open ? device.force_limit_n : 0.0, asked->sent_n);
    if (!device.open) {
        return LIQUID_STUDY_READ_LOST;
    }
    to_maker(asked->sent_n, force_n);
    return maker_set_force(force_n) == 0 ? 0 : LIQUID_STUDY_READ_LOST;
}
