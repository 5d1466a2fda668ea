/* Stands in for the library of your device's maker: a handle of 0.2 kg with friction, drawn along by a hand that moves
 * 20 mm to the right and to the left. Replace this file by your maker's library. POSIX only. */
#define _POSIX_C_SOURCE 200809L

#include "maker.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <time.h>

#define MASS_KG 0.2
#define DAMPING_NSPM 0.5
#define HAND_NPM 400.0
#define HAND_NSPM 20.0
#define REACH_M 0.02
#define TURNS_HZ 0.8
#define STEP_S 1e-4
#define LONGEST_S 0.05
#define PI 3.14159265358979323846

static pthread_mutex_t guard = PTHREAD_MUTEX_INITIALIZER;
static double position_m[3], velocity_mps[3], force_n[3];
static int64_t opened_ns, moved_ns;
static atomic_int connected;

static atomic_int running;
static pthread_t thread;
static void (*callback)(void *);
static void *callback_data;

static int64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Move the handle until now; with `guard` held. */
static void move(void) {
    int64_t until_ns = now_ns();
    double left_s = fmin((double)(until_ns - moved_ns) * 1e-9, LONGEST_S);
    while (left_s > 0.0) {
        double step_s = fmin(left_s, STEP_S), at_s = (double)(until_ns - opened_ns) * 1e-9 - left_s;
        for (int axis = 0; axis < 3; axis++) {
            double hand_m = axis == 1 ? REACH_M * sin(2.0 * PI * TURNS_HZ * at_s) : 0.0;
            double pull_n = HAND_NPM * (hand_m - position_m[axis]) - (HAND_NSPM + DAMPING_NSPM) * velocity_mps[axis];
            velocity_mps[axis] += step_s * (pull_n + force_n[axis]) / MASS_KG;
            position_m[axis] += step_s * velocity_mps[axis];
        }
        left_s -= step_s;
    }
    moved_ns = until_ns;
}

int maker_open(void) {
    pthread_mutex_lock(&guard);
    memset(position_m, 0, sizeof position_m);
    memset(velocity_mps, 0, sizeof velocity_mps);
    memset(force_n, 0, sizeof force_n);
    opened_ns = moved_ns = now_ns();
    connected = 1;
    pthread_mutex_unlock(&guard);
    return 0;
}

void maker_close(void) {
    const double nothing_n[3] = {0.0, 0.0, 0.0};
    maker_stop();
    maker_set_force(nothing_n);
    connected = 0;
}

int maker_is_connected(void) { return connected; }

int maker_get(double place_mm[3], double speed_mmps[3], int64_t *time_ns) {
    pthread_mutex_lock(&guard);
    move();
    for (int axis = 0; axis < 3; axis++) {
        place_mm[axis] = 1e3 * position_m[axis];
        speed_mmps[axis] = 1e3 * velocity_mps[axis];
    }
    *time_ns = moved_ns - opened_ns;
    pthread_mutex_unlock(&guard);
    return connected ? 0 : -1;
}

int maker_set_force(const double given_n[3]) {
    pthread_mutex_lock(&guard);
    move();
    memcpy(force_n, given_n, sizeof force_n);
    pthread_mutex_unlock(&guard);
    return connected ? 0 : -1;
}

static void *run(void *unused) {
    int64_t due_ns = now_ns();
    (void)unused;
    while (running) {
        callback(callback_data);
        due_ns += 1000000;
        int64_t wait_ns = due_ns - now_ns();
        if (wait_ns > 0) {
            struct timespec wait = {0, (long)wait_ns};
            nanosleep(&wait, 0);
        } else {
            due_ns = now_ns(); /* late: the next one follows at once */
        }
    }
    return 0;
}

int maker_start(void (*tick)(void *), void *data) {
    callback = tick;
    callback_data = data;
    running = 1;
    if (pthread_create(&thread, 0, run, 0) != 0) {
        running = 0;
        return -1;
    }
    return 0;
}

void maker_stop(void) {
    if (atomic_exchange(&running, 0)) {
        pthread_join(thread, 0);
    }
}

void maker_pull_cable(void) { connected = 0; }

void maker_force_now(double now_n[3]) {
    pthread_mutex_lock(&guard);
    memcpy(now_n, force_n, sizeof force_n);
    pthread_mutex_unlock(&guard);
}
