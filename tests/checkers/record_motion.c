/* SPDX-License-Identifier: Apache-2.0
 * The robot of rmp_motion.h that writes down what it is told, in place of rmp_robomosp.c. */
#include "record.h"
#include "rmp_motion.h"

static rmp_pose here;
static int is_here, is_waiting, was_false;
static double timeout, outputs[4096];

/* What follows a wait ends it. */
static void settle(void) {
  if (is_waiting) record_waited(was_false, timeout);
  is_waiting = 0;
}
static void to_pose(const char* motion, rmp_pose p, double speed, double share,
                    rmp_condition until) {
  const double v[7] = {p.pos.x, p.pos.y, p.pos.z, p.ori.w, p.ori.x, p.ori.y, p.ori.z};
  record_move("pose", motion, speed, share, until, v, 7);
  here = p;
  is_here = until == NULL;
}
static void by(const char* motion, rmp_position way, double speed, double share,
               rmp_condition until) {
  const double v[7] = {way.x, way.y, way.z, 1, 0, 0, 0};
  settle();
  if (is_here) {
    here.pos = rmp_sum(here.pos, way, 1);
    to_pose(motion, here, speed, share, until);
  } else {
    record_move("step", motion, speed, share, until, v, 7);
  }
}

void rmp_open(int argc, char** argv) {
  (void)argc;
  (void)argv;
}
void rmp_close(void) { settle(); }
void rmp_ptp_joints(rmp_joint to, rmp_move how, rmp_condition until) {
  settle();
  record_move("joints", "ptp", -1, how.speed_ptp, until, to.main, 6);
  is_here = 0;
}
void rmp_ptp_to(rmp_joint to, rmp_pose pse, rmp_move how, rmp_condition until) {
  (void)to;
  rmp_ptp_pose(pse, how, until);
}
void rmp_ptp_pose(rmp_pose to, rmp_move how, rmp_condition until) {
  settle();
  to_pose("ptp", to, -1, how.speed_ptp, until);
}
void rmp_lin(rmp_pose to, rmp_move how, rmp_condition until) {
  settle();
  to_pose("lin", to, how.speed, -1, until);
}
void rmp_circle(rmp_pose via, rmp_pose end, rmp_move how, rmp_condition until) {
  settle();
  to_pose("circle", via, how.speed, -1, NULL);
  to_pose("circle", end, how.speed, -1, until);
}
void rmp_lin_by(rmp_position way, rmp_move how, rmp_condition until) {
  by("lin", way, how.speed, -1, until);
}
void rmp_ptp_by(rmp_position way, rmp_move how, rmp_condition until) {
  by("ptp", way, -1, how.speed_ptp, until);
}
rmp_pose rmp_here(rmp_position at) {
  rmp_pose p = here;
  p.pos = at;
  return p;
}
void rmp_output(int number, const char* name, double value) {
  (void)name;
  settle();
  if (number >= 0 && number < 4096) outputs[number] = value;
  record_output(number, value);
}
double rmp_state(int number) { return number >= 0 && number < 4096 ? outputs[number] : 0; }
double rmp_input(int number, const char* name) {
  (void)name;
  return record_input(number);
}
void rmp_wait(double seconds) {
  settle();
  record_wait(seconds);
}
void rmp_wait_begin(double seconds) {
  settle();
  is_waiting = 1;
  was_false = 0;
  timeout = seconds;
}
int rmp_wait_over(void) {
  was_false = 1;
  if (timeout >= 0) return 1;
  record_goes_on();
  return 0;
}
void rmp_pause(const char* message) {
  (void)message;
  settle();
}
void rmp_halt(void) {
  settle();
  exit(2);
}
