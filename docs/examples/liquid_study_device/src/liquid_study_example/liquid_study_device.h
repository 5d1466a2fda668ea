/* The contract between the servo of liquid-study and a haptic device, version 2.
 *
 * A device is two C functions and the address of its own memory. The servo calls both once in each tick, from one
 * thread, first READ, then WRITE; 1000 ticks a second by default. docs/device-contract.md explains each rule.
 *
 * SI units. Hand frame: right-handed, x to the right, y up, z toward the participant; its origin is the middle of the
 * workspace. Forces are those on the hand.
 */
#ifndef LIQUID_STUDY_DEVICE_H
#define LIQUID_STUDY_DEVICE_H

#include <stdint.h>

#define LIQUID_STUDY_CONTRACT_VERSION 2

/* What READ returns. */
#define LIQUID_STUDY_READ_NEW 0          /* the record holds a new sample */
#define LIQUID_STUDY_READ_NOTHING_NEW 1  /* no new sample; after 5 ms without one the force fades, after 50 ms a fault */
#define LIQUID_STUDY_READ_LOST (-1)      /* the device is gone: the servo writes zero force and ends */

/* What WRITE returns: 0, LIQUID_STUDY_READ_LOST, or */
#define LIQUID_STUDY_WRITE_SATURATED 1   /* the motors saturated: their force was between 0 and sent_n */

/* Bits of `measured`. */
#define LIQUID_STUDY_MEASURED_VELOCITY 1
#define LIQUID_STUDY_MEASURED_ORIENTATION 2
#define LIQUID_STUDY_MEASURED_GRIPPER 4
#define LIQUID_STUDY_MEASURED_TIME 8

/* Bits of `buttons`: button 1 is bit 0. Button 4 stops the force. */
#define LIQUID_STUDY_BUTTON_STOP 8

/* The servo fills in version, size_bytes, delay_ticks = -1 and measured = 0; READ fills in the rest. */
typedef struct {
    int64_t version;         /* LIQUID_STUDY_CONTRACT_VERSION of the servo */
    int64_t size_bytes;      /* of this record: write nothing beyond it */
    double position_m[3];    /* of the handle */
    int64_t buttons;         /* bit set */
    int64_t delay_ticks;     /* how many WRITEs late a force acts, as measured while running; -1: not measured */
    /* From version 2 on: where size_bytes is at least 136. */
    int64_t measured;        /* which of the following are given, as bits */
    double velocity_mps[3];  /* of the handle, as the device measures it */
    double orientation[4];   /* unit quaternion w, x, y, z: from the handle's frame to the hand frame */
    double gripper_m;        /* opening of the gripper */
    int64_t device_time_ns;  /* time of the sample on the device's own clock */
} liquid_study_reading;

typedef struct {
    int64_t version;         /* LIQUID_STUDY_CONTRACT_VERSION of the servo */
    int64_t size_bytes;      /* of this record */
    double force_n[3];       /* to be sent: finite, within the force limit */
    double sent_n[3];        /* force_n; where the device sends another force, WRITE puts that here */
} liquid_study_command;

/* The begin of a driver's memory, whose address is `context`: study_app.devices.driver fills and reads it. */
typedef struct {
    int64_t now_ns;          /* of the last READ */
    int64_t ended;           /* a value below, or your own cause from LIQUID_STUDY_LOST on: calls are rejected */
    int64_t inside;          /* 1 while a call uses the device */
    int64_t unguarded;       /* 1: the guard process has died: send no force */
    double sent_n[3];        /* the force that acts since the last WRITE */
    double force_limit_n;
    int64_t fresh_ns;        /* of the last READ with a new sample */
    int64_t ticks;           /* READs so far */
    int64_t fresh;           /* of them, how many had a new sample */
} liquid_study_exchange;

#define LIQUID_STUDY_RUNS 0
#define LIQUID_STUDY_RELEASED 1 /* closed by the program, or not open */
#define LIQUID_STUDY_FINISHED 2 /* closed, and the force ended by a call that outlasted that */
#define LIQUID_STUDY_LOST 3

/* READ: fill in the record, and return a code above. `now_ns` is the servo's monotonic clock. */
typedef int32_t (*liquid_study_read)(intptr_t context, int64_t now_ns, intptr_t reading);

/* WRITE: send the force, and return a code above. It is also called with zero force before READ. */
typedef int32_t (*liquid_study_write)(intptr_t context, intptr_t command);

#endif
