/* A stand-in for Force Dimension's library, for tests: the functions that the driver uses, and one device that moves
 * its handle by itself. Written from the declarations of dhdc.h and drdc.h (SDK 3.17.5) alone; their lines are given.
 * A call of dhdGetPosition is a millisecond. standin_fault sets a fault; built with LACKS_WATCHDOG, it lacks two functions
 * as an older library does. The environment variable STANDIN_FILE names a file that holds the device's state, so
 * that it outlives its program, as a device does; one program at a time can open it. */
#include <fcntl.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

enum { NONE, NO_DEVICE, UNCALIBRATED, NO_THRESHOLD, WEAK, STAYS_OFF, ERROR, NOT_A_NUMBER, TURNS_OFF, SLOW, GUARDED,
       WRITE_ERROR, SATURATED, STATUS_ERROR, HANGS, UNWATCHED, DEAF, UNMODELLED, PLAIN /* no wrist, synchronous */ };

static struct device {
    volatile int fault;
    int open, closed, stopped, expert, force_on, gravity;
    int time_guard;
    unsigned char watchdog;
    unsigned int buttons;
    long readings;
    double force[3], torque[3], grip, gap;
    double rotation[3][3];
} own = {.time_guard = 0, .gap = 0.012, .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, *at = &own;
#define d (*at)
static int file = -1;

__attribute__((constructor)) static void share(void) {
    const char *path = getenv("STANDIN_FILE");
    if (path == 0 || (file = open(path, O_RDWR)) < 0 || ftruncate(file, sizeof own) < 0) return;
    at = mmap(0, sizeof own, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
}
static int lock(short kind) {
    struct flock all = {.l_type = kind, .l_whence = SEEK_SET};
    return file < 0 ? 0 : fcntl(file, F_SETLK, &all);
}

static double phase(void) { return 2.0 * 3.14159265358979 * 0.001 * (double)d.readings; }

/* for tests */
void standin_fault(int fault) { d.fault = fault; }
void standin_reset(void) {
    int i;
    memset((void *)&d, 0, sizeof d);
    d.gap = 0.012;
    for (i = 0; i < 3; i++) d.rotation[i][i] = 1.0;
}
void standin_press(unsigned int buttons) { d.buttons = buttons; }
void standin_rotate(const double *rotation) { memcpy(d.rotation, rotation, sizeof d.rotation); }
/* force (3), torque (3), grip, force_on, open, closed, stopped, time_guard, watchdog, gravity, readings */
void standin_state(double *out) {
    int i;
    for (i = 0; i < 3; i++) {
        out[i] = d.force[i];
        out[3 + i] = d.torque[i];
    }
    out[6] = d.grip, out[7] = d.force_on, out[8] = d.open, out[9] = d.closed, out[10] = d.stopped;
    out[11] = d.time_guard, out[12] = d.watchdog, out[13] = d.gravity, out[14] = (double)d.readings;
}

const char *dhdErrorGetLastStr(void) { return "stand-in error"; }                         /* dhdc.h 74 */
int dhdGetDeviceCount(void) { return d.fault == NO_DEVICE ? 0 : 1; }                      /* 218 */
int dhdGetSerialNumber(unsigned short *sn, char ID) { (void)ID; *sn = 10233; return 0; }  /* 222 */
int dhdOpen(void) {                                                                       /* 223 */
    if (d.fault == NO_DEVICE || lock(F_WRLCK) < 0) return -1;
    d.open = 1, d.closed = 0;
    return 0;
}
int dhdOpenSerial(int serial) { return serial == 10233 ? dhdOpen() : -1; }                /* 225 */
int dhdClose(char ID) { (void)ID; d.open = 0, d.closed = 1; return lock(F_UNLCK); }                   /* 227 */
int dhdStop(char ID) {                                                                    /* 229 */
    (void)ID;
    if (d.fault == DEAF) return -1;
    d.force_on = 0, d.stopped = 1;
    return 0;
}
int dhdEnableForce(unsigned char val, char ID) {                                          /* 231 */
    (void)ID;
    d.force_on = val && d.fault != STAYS_OFF, d.stopped = 0;
    return 0;
}
int dhdGetSystemType(char ID) { (void)ID; return 35; }                                    /* 233; 35: line 100 */
const char *dhdGetSystemName(char ID) { (void)ID; return "stand-in omega.7"; }            /* 235 */
void dhdGetSDKVersion(int *major, int *minor, int *release, int *revision) {              /* 238 */
    *major = 3, *minor = 17, *release = 5, *revision = 0;
}
int dhdGetStatus(int status[17], char ID) {                                               /* 241 */
    (void)ID;
    memset(status, 0, 17 * sizeof(int));
    if (d.fault == STATUS_ERROR && d.readings > 0) return -1;
    status[0] = status[1] = 1;                          /* power, connected: 167, 168 */
    status[3] = d.fault == UNCALIBRATED;                /* reset: 170 */
    status[5] = d.force_on;                             /* force: 172 */
    status[14] = d.force_on ? 0 : 2;                    /* cause: 181; velocity: 202 */
    return 0;
}
int dhdGetEffectorMass(double *mass, char ID) { (void)ID; *mass = 0.19; return 0; }       /* 244 */
unsigned int dhdGetButtonMask(char ID) { (void)ID; return d.buttons; }                    /* 247 */
bool dhdHasWrist(char ID) { (void)ID; return d.fault != PLAIN; }                           /* 251 */
bool dhdHasActiveWrist(char ID) { (void)ID; return false; }                               /* 252 */
bool dhdHasGripper(char ID) { (void)ID; return true; }                                    /* 253 */
bool dhdHasActiveGripper(char ID) { (void)ID; return true; }                              /* 254 */
int dhdSetGravityCompensation(int val, char ID) { (void)ID; d.gravity = val; return 0; }  /* 259 */
int dhdGetPosition(double *px, double *py, double *pz, char ID) {                         /* 264 */
    if (ID != 0) return -1;
    if (d.fault == GUARDED && d.readings % 2 == 1) {
        d.readings++;
        return 1; /* DHD_TIMEGUARD: 160 */
    }
    d.readings++;
    if (d.fault == SLOW || d.fault == HANGS) {
        struct timespec pause = {d.fault == HANGS ? 1 : 0, 250000000};
        nanosleep(&pause, 0);
    }
    if (d.fault == TURNS_OFF) d.force_on = 0;
    *px = d.fault == NOT_A_NUMBER ? NAN : 0.0; /* toward the participant */
    *py = 0.03 * sin(phase());                 /* right */
    *pz = 0.01;                                /* up */
    return d.fault == ERROR ? -1 : 0;
}
static int push(double fx, double fy, double fz) {
    if (!d.open || d.fault == WRITE_ERROR || d.fault == DEAF) return -1;
    d.force[0] = fx, d.force[1] = fy, d.force[2] = fz;
    return d.fault == SATURATED ? 2 : 0; /* DHD_MOTOR_SATURATED: 161 */
}
int dhdSetForce(double fx, double fy, double fz, char ID) { (void)ID; return push(fx, fy, fz); } /* 266 */
int dhdGetOrientationFrame(double matrix[3][3], char ID) {                                /* 274 */
    (void)ID;
    memcpy(matrix, d.rotation, sizeof d.rotation);
    return 0;
}
int dhdGetGripperGap(double *g, char ID) { (void)ID; *g = d.gap; return 0; }              /* 277 */
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double fg,
                                        char ID) {                                        /* 282 */
    (void)ID;
    d.torque[0] = tx, d.torque[1] = ty, d.torque[2] = tz, d.grip = fg;
    return push(fx, fy, fz);
}
int dhdGetLinearVelocity(double *vx, double *vy, double *vz, char ID) {                   /* 285 */
    (void)ID;
    *vx = *vz = 0.0;
    *vy = 0.03 * 2.0 * 3.14159265358979 * cos(phase());
    return 0;
}
double dhdGetMaxForce(char ID) { (void)ID; return d.fault == WEAK ? 1.5 : -1.0; }         /* 306 */
int dhdEnableExpertMode(void) { d.expert = 1; return 0; }                                 /* 315 */
int dhdDisableExpertMode(void) { d.expert = 0; return 0; }                                /* 316 */
int dhdSetTimeGuard(int us, char ID) { (void)ID; d.time_guard = us; return d.expert ? 0 : -1; } /* 319 */
int dhdGetVelocityThreshold(unsigned int *val, char ID) {                                 /* 321 */
    (void)ID;
    *val = d.fault == NO_THRESHOLD ? 0 : 40;
    return d.expert ? 0 : -1;
}
int dhdGetComMode(char ID) { (void)ID; return d.fault != PLAIN; } /* 230; DHD_COM_MODE_SYNC, ASYNC: 194, 195 */
/* a count of each encoder moves the handle by 10 um along its own axis; the middle is at 1000 counts */
int dhdDeltaEncoderToPosition(int e0, int e1, int e2, double *px, double *py, double *pz, char ID) { /* 331 */
    (void)ID;
    *px = 1e-5 * (e0 - 1000), *py = 1e-5 * (e1 - 1000), *pz = 1e-5 * (e2 - 1000);
    return d.expert && d.fault != UNMODELLED ? 0 : -1;
}
int dhdDeltaPositionToEncoder(double px, double py, double pz, int *e0, int *e1, int *e2, char ID) { /* 332 */
    (void)ID;
    *e0 = 1000 + (int)lround(1e5 * px), *e1 = 1000 + (int)lround(1e5 * py), *e2 = 1000 + (int)lround(1e5 * pz);
    return d.expert && d.fault != UNMODELLED ? 0 : -1;
}
int dhdDeltaEncodersToJointAngles(int e0, int e1, int e2, double *j0, double *j1, double *j2, char ID) { /* 355 */
    (void)ID;
    *j0 = 1e-3 * e0, *j1 = 1e-3 * e1, *j2 = 1e-3 * e2;
    return d.expert && d.fault != UNMODELLED ? 0 : -1;
}
int dhdGetJointAngles(double j[8], char ID) {                                             /* 366 */
    (void)ID;
    memset(j, 0, 8 * sizeof(double));
    return d.expert && d.fault != UNMODELLED ? 0 : -1;
}
/* 0.25 kg along the second axis, less what the free wrist takes off: 0.01^2 / 0.002 = 0.05 kg */
int dhdJointAnglesToInertiaMatrix(double j[8], double inertia[6][6], char ID) {           /* 369 */
    int i;
    (void)ID;
    memset(inertia, 0, 36 * sizeof(double));
    for (i = 0; i < 3; i++) {
        inertia[i][i] = i == 1 && j[1] == 1.0 ? 0.25 : 0.3;
        inertia[3 + i][3 + i] = 0.002;
    }
    inertia[1][5] = inertia[5][1] = 0.01;
    return d.expert && d.fault != UNMODELLED ? 0 : -1;
}
#ifndef LACKS_WATCHDOG
int dhdSetWatchdog(unsigned char val, char ID) { /* 373 */
    (void)ID;
    if (d.fault == UNWATCHED) return -1;
    d.watchdog = val;
    return d.expert ? 0 : -1;
}
int dhdGetWatchdog(unsigned char *val, char ID) { (void)ID; *val = d.watchdog; return d.expert ? 0 : -1; } /* 374 */
#endif
bool drdIsInitialized(char ID) { (void)ID; return d.fault != UNCALIBRATED; }              /* drdc.h 41 */
