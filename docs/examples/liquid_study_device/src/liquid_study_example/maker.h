/* Stands in for the header of your device's maker. Units and axes are a maker's: millimetres; x toward the operator,
 * y to the right, z up. */
#ifndef MAKER_H
#define MAKER_H

#include <stdint.h>

int maker_open(void);   /* 0, or what failed */
void maker_close(void); /* zero force, then let go */
int maker_is_connected(void);
int maker_get(double position_mm[3], double velocity_mmps[3], int64_t *time_ns); /* 0, or the device is gone */
int maker_set_force(const double force_n[3]);                                     /* likewise */
int maker_start(void (*tick)(void *), void *data); /* call `tick` every millisecond from a thread of the library */
void maker_stop(void);
void maker_pull_cable(void);             /* for tests */
void maker_force_now(double force_n[3]); /* for tests: what the motors give */

#endif
