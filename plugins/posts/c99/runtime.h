// SPDX-License-Identifier: Apache-2.0
// The C files written beside every program: the functions it calls, and their implementations
// (layer: data processing, plugin posts). Their includes are split so that they are not taken for
// this program's.
#pragma once

namespace robomosp::posts::c_runtime {

inline constexpr const char* kHeader =
    R"(/* What programs of robots call: poses, motions, signals. Lengths in mm, angles in degrees. */
#ifndef RMP_MOTION_H
#define RMP_MOTION_H

)"
    "#"
    R"(include <stddef.h>

#define RMP_MOST_JOINTS 12

typedef struct rmp_position { double x, y, z; } rmp_position;
typedef struct rmp_orientation { double w, x, y, z; } rmp_orientation;
typedef struct rmp_pose { rmp_position pos; rmp_orientation ori; } rmp_pose;
/* Joints of the robot, and additional ones. */
typedef struct rmp_joint { double main[RMP_MOST_JOINTS]; double add[RMP_MOST_JOINTS]; } rmp_joint;
typedef struct rmp_target { rmp_pose pse; int status; double add[RMP_MOST_JOINTS]; } rmp_target;
/* speed [mm/s], speed_ori [deg/s], acc [%], time [s] or -1, blending: c_cp [mm], c_ptp [%];
 * speed_ptp and acc_ptp [%]; pass: does not stop at the target. */
typedef struct rmp_move {
  double speed, speed_ori, acc, time, c_cp, speed_ptp, acc_ptp, c_ptp;
  int pass;
} rmp_move;
typedef int (*rmp_condition)(void);

/* ---- geometry (rmp_motion.c) ---- */
rmp_position rmp_at(double x, double y, double z);
rmp_orientation rmp_turned(double w, double x, double y, double z);
rmp_pose rmp_placed(rmp_position pos, rmp_orientation ori);
rmp_target rmp_aimed(rmp_pose pse, int status, const double *add, size_t count);
rmp_joint rmp_joints(const double *main_joints, size_t count, const double *add, size_t add_count);
rmp_joint rmp_with_main(rmp_joint to, rmp_joint from);
rmp_joint rmp_with_add(rmp_joint to, rmp_joint from);
rmp_position rmp_sum(rmp_position a, rmp_position b, double sign);
rmp_position rmp_cross(rmp_position a, rmp_position b);
double rmp_dot(rmp_position a, rmp_position b);
rmp_orientation rmp_product(rmp_orientation a, rmp_orientation b);
rmp_position rmp_rotated(rmp_orientation o, rmp_position p);
rmp_pose rmp_composed(rmp_pose a, rmp_pose b);
rmp_position rmp_moved(rmp_pose a, rmp_position p);
rmp_pose rmp_inverse(rmp_pose a);
/* Rotation about axis 0, 1 or 2. */
rmp_orientation rmp_about(int axis, double degrees);
double rmp_sin(double degrees);
double rmp_cos(double degrees);
double rmp_tan(double degrees);
double rmp_asin(double x);
double rmp_acos(double x);
double rmp_atan(double x);
double rmp_atan2(double y, double x);
int rmp_trunc(double x);
int rmp_round(double x);
double rmp_slerp(rmp_orientation a, rmp_orientation b, double s, rmp_orientation *out);
/* Points of the arc through `via`; how many chords there are. at(0) is the begin, at(chords) the end. */
int rmp_arc(rmp_pose begin, rmp_pose via, rmp_pose end, int k, rmp_pose *out);

/* ---- the robot (one file for each kind of controller); what fails ends the program with a sentence ---- */
void rmp_open(int argc, char **argv);
void rmp_close(void);
void rmp_ptp_joints(rmp_joint to, rmp_move how, rmp_condition until);
/* The same pose by joints that lead there, for controllers that move straight to poses. */
void rmp_ptp_to(rmp_joint to, rmp_pose pse, rmp_move how, rmp_condition until);
void rmp_ptp_pose(rmp_pose to, rmp_move how, rmp_condition until);
void rmp_lin(rmp_pose to, rmp_move how, rmp_condition until);
void rmp_circle(rmp_pose via, rmp_pose end, rmp_move how, rmp_condition until);
/* By so much, in the axes of the base. */
void rmp_lin_by(rmp_position by, rmp_move how, rmp_condition until);
void rmp_ptp_by(rmp_position by, rmp_move how, rmp_condition until);
/* The pose of the tool with another place. */
rmp_pose rmp_here(rmp_position at);
/* Additional joints, of which those that change are set [degrees or mm]. */
void rmp_additional(const double *values, int count);
void rmp_output(int number, const char *name, double value);
double rmp_state(int number);
double rmp_input(int number, const char *name);
void rmp_wait(double seconds);
/* WAIT FOR: begin (timeout < 0 = none), then over() until the condition holds; 1 = the time is over. */
void rmp_wait_begin(double timeout);
int rmp_wait_over(void);
void rmp_pause(const char *message);
void rmp_halt(void);

#endif
)";

inline constexpr const char* kGeometry = R"(/* Geometry of rmp_motion.h. */
)"
                                         "#"
                                         R"(include "rmp_motion.h"

)"
                                         "#"
                                         R"(include <math.h>
)"
                                         "#"
                                         R"(include <string.h>

#define DEGREE 57.29577951308232

rmp_position rmp_at(double x, double y, double z) {
  rmp_position p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}
rmp_orientation rmp_turned(double w, double x, double y, double z) {
  rmp_orientation o;
  const double n = sqrt(w * w + x * x + y * y + z * z);
  o.w = n > 0 ? w / n : 1;
  o.x = n > 0 ? x / n : 0;
  o.y = n > 0 ? y / n : 0;
  o.z = n > 0 ? z / n : 0;
  return o;
}
rmp_pose rmp_placed(rmp_position pos, rmp_orientation ori) {
  rmp_pose p;
  p.pos = pos;
  p.ori = ori;
  return p;
}
rmp_target rmp_aimed(rmp_pose pse, int status, const double *add, size_t count) {
  rmp_target t;
  size_t i;
  memset(&t, 0, sizeof t);
  t.pse = pse;
  t.status = status;
  for (i = 0; i < count && i < RMP_MOST_JOINTS; ++i) t.add[i] = add[i];
  return t;
}
rmp_joint rmp_joints(const double *main_joints, size_t count, const double *add, size_t add_count) {
  rmp_joint j;
  size_t i;
  memset(&j, 0, sizeof j);
  for (i = 0; i < count && i < RMP_MOST_JOINTS; ++i) j.main[i] = main_joints[i];
  for (i = 0; i < add_count && i < RMP_MOST_JOINTS; ++i) j.add[i] = add[i];
  return j;
}
rmp_joint rmp_with_main(rmp_joint to, rmp_joint from) {
  memcpy(to.main, from.main, sizeof to.main);
  return to;
}
rmp_joint rmp_with_add(rmp_joint to, rmp_joint from) {
  memcpy(to.add, from.add, sizeof to.add);
  return to;
}
rmp_position rmp_sum(rmp_position a, rmp_position b, double sign) {
  return rmp_at(a.x + sign * b.x, a.y + sign * b.y, a.z + sign * b.z);
}
rmp_position rmp_cross(rmp_position a, rmp_position b) {
  return rmp_at(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
double rmp_dot(rmp_position a, rmp_position b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
rmp_orientation rmp_product(rmp_orientation a, rmp_orientation b) {
  return rmp_turned(a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                    a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w);
}
rmp_position rmp_rotated(rmp_orientation o, rmp_position p) {
  const rmp_position v = rmp_at(o.x, o.y, o.z);
  const rmp_position t = rmp_cross(v, p);
  const rmp_position u = rmp_cross(v, t);
  return rmp_at(p.x + 2 * (o.w * t.x + u.x), p.y + 2 * (o.w * t.y + u.y), p.z + 2 * (o.w * t.z + u.z));
}
rmp_position rmp_moved(rmp_pose a, rmp_position p) { return rmp_sum(rmp_rotated(a.ori, p), a.pos, 1); }
rmp_pose rmp_composed(rmp_pose a, rmp_pose b) { return rmp_placed(rmp_moved(a, b.pos), rmp_product(a.ori, b.ori)); }
rmp_pose rmp_inverse(rmp_pose a) {
  const rmp_orientation back = rmp_turned(a.ori.w, -a.ori.x, -a.ori.y, -a.ori.z);
  return rmp_placed(rmp_rotated(back, rmp_at(-a.pos.x, -a.pos.y, -a.pos.z)), back);
}
/* Exact at multiples of 90 degrees. */
double rmp_sin(double degrees) {
  const double r = fmod(degrees, 360.0);
  if (fmod(r, 90.0) == 0.0) {
    const int quarter = ((int)(r / 90.0) + 4) % 4;
    return quarter == 1 ? 1.0 : quarter == 3 ? -1.0 : 0.0;
  }
  return sin(r / DEGREE);
}
double rmp_cos(double degrees) { return rmp_sin(fmod(degrees, 360.0) + 90.0); }
double rmp_tan(double degrees) { return rmp_sin(degrees) / rmp_cos(degrees); }
double rmp_asin(double x) { return asin(x) * DEGREE; }
double rmp_acos(double x) { return acos(x) * DEGREE; }
double rmp_atan(double x) { return atan(x) * DEGREE; }
double rmp_atan2(double y, double x) { return atan2(y, x) * DEGREE; }
int rmp_trunc(double x) { return (int)x; }
int rmp_round(double x) { return (int)(x < 0 ? x - 0.5 : x + 0.5); }
rmp_orientation rmp_about(int axis, double degrees) {
  const double s = rmp_sin(degrees / 2);
  return rmp_turned(rmp_cos(degrees / 2), axis == 0 ? s : 0, axis == 1 ? s : 0, axis == 2 ? s : 0);
}
double rmp_slerp(rmp_orientation a, rmp_orientation b, double s, rmp_orientation *out) {
  double d = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z, angle, p, q;
  if (d < 0) {
    b.w = -b.w;
    b.x = -b.x;
    b.y = -b.y;
    b.z = -b.z;
    d = -d;
  }
  angle = acos(d > 1 ? 1 : d);
  p = angle < 1e-9 ? 1 - s : sin((1 - s) * angle) / sin(angle);
  q = angle < 1e-9 ? s : sin(s * angle) / sin(angle);
  *out = rmp_turned(p * a.w + q * b.w, p * a.x + q * b.x, p * a.y + q * b.y, p * a.z + q * b.z);
  return 2 * angle * DEGREE;
}
int rmp_arc(rmp_pose begin, rmp_pose via, rmp_pose end, int k, rmp_pose *out) {
  const double kError = 0.05; /* of a chord [mm] */
  const rmp_position u = rmp_sum(via.pos, begin.pos, -1), v = rmp_sum(end.pos, begin.pos, -1);
  const rmp_position n = rmp_cross(u, v);
  const double nn = rmp_dot(n, n), uu = rmp_dot(u, u), vv = rmp_dot(v, v);
  rmp_position centre, r, side, unit;
  double radius, sweep, angle, step;
  int chords;
  if (nn < 1e-12 * uu * vv || nn == 0) { /* on one line */
    if (out) *out = k > 1 ? end : k == 1 ? via : begin;
    return 2;
  }
  centre = rmp_cross(rmp_at(uu * v.x - vv * u.x, uu * v.y - vv * u.y, uu * v.z - vv * u.z), n);
  centre = rmp_at(begin.pos.x + centre.x / (2 * nn), begin.pos.y + centre.y / (2 * nn), begin.pos.z + centre.z / (2 * nn));
  r = rmp_sum(begin.pos, centre, -1);
  radius = sqrt(rmp_dot(r, r));
  unit = rmp_at(n.x / sqrt(nn), n.y / sqrt(nn), n.z / sqrt(nn));
  side = rmp_cross(unit, r);
  {
    const rmp_position e = rmp_sum(end.pos, centre, -1);
    sweep = atan2(rmp_dot(e, side), rmp_dot(e, r));
    if (sweep <= 0) sweep += 6.283185307179586;
  }
  step = radius > kError ? 2 * acos(1 - kError / radius) : 1;
  chords = (int)ceil(sweep / step);
  if (chords < 2) chords = 2;
  if (out) {
    angle = sweep * k / chords;
    *out = begin;
    out->pos = rmp_at(centre.x + cos(angle) * r.x + sin(angle) * side.x, centre.y + cos(angle) * r.y + sin(angle) * side.y,
                      centre.z + cos(angle) * r.z + sin(angle) * side.z);
    rmp_slerp(begin.ori, end.ori, (double)k / chords, &out->ori);
    if (k == chords) *out = end;
  }
  return chords;
}
)";

inline constexpr const char* kRobomosp =
    R"(/* rmp_motion.h by a running ROBOMOSP: needs robomosp_client.h and robomosp_client.c of its SDK.
 *   program ADDRESS ROBOT [--token TOKEN] [--real-time] [--input NUMBER=VALUE]... */
#define _POSIX_C_SOURCE 200809L
)"
    "#"
    R"(include <math.h>
)"
    "#"
    R"(include <stdio.h>
)"
    "#"
    R"(include <stdlib.h>
)"
    "#"
    R"(include <string.h>
)"
    "#"
    R"(include <time.h>

)"
    "#"
    R"(include "rmp_motion.h"
)"
    "#"
    R"(include "robomosp_client.h"

#define CYCLE 0.04        /* [s] */
#define JOINT_SPEED 90.0  /* at 100 % [deg/s] */
#define MOST_SIGNALS 4096
#define DEGREE 57.29577951308232

static rmpc_client *client;
static rmpc_handle robot;
static size_t joints;
static double q[RMP_MOST_JOINTS];
static int in_real_time;
static double now, wait_until;
static double inputs[MOST_SIGNALS], outputs[MOST_SIGNALS];
static char is_given[MOST_SIGNALS];

static void fail(const char *what) {
  fprintf(stderr, "%s\n", what);
  rmpc_free(client);
  exit(1);
}
static void check(rmpc_status s) {
  if (s != RMPC_OK) fail(rmpc_message(client));
}
static void pass(double seconds) {
  now += seconds;
  if (in_real_time && seconds > 0) {
    struct timespec t;
    t.tv_sec = (time_t)seconds;
    t.tv_nsec = (long)((seconds - (double)t.tv_sec) * 1e9);
    nanosleep(&t, NULL);
  }
}
void rmp_open(int argc, char **argv) {
  const char *token = NULL;
  size_t count;
  int i;
  if (argc < 3) fail("usage: program ADDRESS ROBOT [--token TOKEN] [--real-time] [--input NUMBER=VALUE]...");
  for (i = 3; i < argc; ++i) {
    int n;
    double v;
    if (strcmp(argv[i], "--real-time") == 0) in_real_time = 1;
    else if (strcmp(argv[i], "--token") == 0 && i + 1 < argc) token = argv[++i];
    else if (strcmp(argv[i], "--input") == 0 && i + 1 < argc && sscanf(argv[++i], "%d=%lf", &n, &v) == 2 && n >= 0 && n < MOST_SIGNALS) {
      inputs[n] = v;
      is_given[n] = 1;
    } else {
      fprintf(stderr, "%s: ", argv[i]);
      fail("no such argument");
    }
  }
  client = rmpc_new();
  if (!client) fail("there is no memory");
  check(rmpc_connect(client, argv[1], token));
  check(rmpc_callf(client, "robot.get", "{'name': %s}", argv[2]));
  check(rmpc_get_handle(client, "", &robot));
  check(rmpc_callf(client, "robot.joint_values", "{'id': %h}", &robot));
  check(rmpc_get_numbers(client, "", q, RMP_MOST_JOINTS, &count));
  joints = count;
}
void rmp_close(void) { rmpc_free(client); }

static void show(double seconds) {
  check(rmpc_callf(client, "robot.set_joints", "{'id': %h, 'q': %v}", &robot, q, joints));
  pass(seconds);
}
/* Steps of a motion, none of them longer than a cycle. */
static int cycles(double seconds) {
  const double n = ceil(seconds / CYCLE);
  return n > 1 ? (n < 1e9 ? (int)n : 1000000000) : 1;
}
static rmp_pose present(void) {
  double p[3], o[4];
  size_t count;
  check(rmpc_callf(client, "robot.fk", "{'id': %h, 'q': %v}", &robot, q, joints));
  check(rmpc_get_numbers(client, "position", p, 3, &count));
  check(rmpc_get_numbers(client, "quaternion", o, 4, &count));
  return rmp_placed(rmp_at(p[0] * 1000, p[1] * 1000, p[2] * 1000), rmp_turned(o[0], o[1], o[2], o[3]));
}
static void solve(rmp_pose to, double *out) {
  const rmp_position n = rmp_rotated(to.ori, rmp_at(1, 0, 0)), o = rmp_rotated(to.ori, rmp_at(0, 1, 0)),
                     a = rmp_rotated(to.ori, rmp_at(0, 0, 1));
  double t[16];
  size_t count;
  t[0] = n.x; t[1] = o.x; t[2] = a.x; t[3] = to.pos.x / 1000;
  t[4] = n.y; t[5] = o.y; t[6] = a.y; t[7] = to.pos.y / 1000;
  t[8] = n.z; t[9] = o.z; t[10] = a.z; t[11] = to.pos.z / 1000;
  t[12] = t[13] = t[14] = 0; t[15] = 1;
  check(rmpc_callf(client, "robot.solve_ik", "{'id': %h, 'target': %m, 'seed': %v}", &robot, t, (size_t)4, (size_t)4, q, joints));
  check(rmpc_get_numbers(client, "q", out, RMP_MOST_JOINTS, &count));
}
static int ended(rmp_condition until) { return until != NULL && until(); }

static void to_joints(const double *to, rmp_move how, rmp_condition until) {
  double from[RMP_MOST_JOINTS], most = 0, seconds;
  int steps, k;
  size_t i;
  memcpy(from, q, sizeof from);
  for (i = 0; i < joints; ++i)
    if (fabs(to[i] - from[i]) > most) most = fabs(to[i] - from[i]);
  seconds = how.time >= 0 ? how.time : most * DEGREE / (JOINT_SPEED * (how.speed_ptp > 0 ? how.speed_ptp : 100) / 100);
  steps = cycles(seconds);
  for (k = 1; k <= steps; ++k) {
    if (ended(until)) return;
    for (i = 0; i < joints; ++i) q[i] = k == steps ? to[i] : from[i] + (to[i] - from[i]) * k / steps;
    show(seconds / steps);
  }
}
void rmp_ptp_joints(rmp_joint to, rmp_move how, rmp_condition until) {
  double values[RMP_MOST_JOINTS];
  size_t i;
  for (i = 0; i < RMP_MOST_JOINTS; ++i) values[i] = to.main[i] / DEGREE;
  to_joints(values, how, until);
}
void rmp_ptp_to(rmp_joint to, rmp_pose pse, rmp_move how, rmp_condition until) {
  (void)pse;
  rmp_ptp_joints(to, how, until);
}
void rmp_ptp_pose(rmp_pose to, rmp_move how, rmp_condition until) {
  double values[RMP_MOST_JOINTS];
  memcpy(values, q, sizeof values);
  solve(to, values);
  to_joints(values, how, until);
}
static double path_seconds(rmp_pose from, rmp_pose to, rmp_move how) {
  const rmp_position way = rmp_sum(to.pos, from.pos, -1);
  rmp_orientation o;
  const double turn = rmp_slerp(from.ori, to.ori, 1, &o);
  double seconds = sqrt(rmp_dot(way, way)) / (how.speed > 0 ? how.speed : 250);
  if (how.speed_ori > 0 && turn / how.speed_ori > seconds) seconds = turn / how.speed_ori;
  return seconds;
}
static rmp_pose between(rmp_pose from, rmp_pose to, double share) {
  const rmp_position way = rmp_sum(to.pos, from.pos, -1);
  rmp_pose at;
  at.pos = rmp_sum(from.pos, way, share);
  rmp_slerp(from.ori, to.ori, share, &at.ori);
  return at;
}
void rmp_lin(rmp_pose to, rmp_move how, rmp_condition until) {
  const rmp_pose from = present();
  const double seconds = how.time >= 0 ? how.time : path_seconds(from, to, how);
  const int steps = cycles(seconds);
  int k;
  for (k = 1; k <= steps; ++k) {
    if (ended(until)) return;
    solve(k < steps ? between(from, to, (double)k / steps) : to, q);
    show(seconds / steps);
  }
}
/* Its chords take their time one after the other, and cycles run on from chord to chord. */
void rmp_circle(rmp_pose via, rmp_pose end, rmp_move how, rmp_condition until) {
  const rmp_pose begin = present();
  const int chords = rmp_arc(begin, via, end, 0, NULL);
  rmp_pose from = begin, to = begin;
  double whole = 0, seconds, before = 0, own;
  int chord, steps, k;
  for (chord = 1; chord <= chords; ++chord) {
    rmp_arc(begin, via, end, chord, &to);
    whole += path_seconds(from, to, how);
    from = to;
  }
  seconds = how.time >= 0 ? how.time : whole;
  steps = cycles(seconds);
  chord = 1;
  from = begin;
  rmp_arc(begin, via, end, chord, &to);
  own = path_seconds(from, to, how);
  for (k = 1; k <= steps; ++k) {
    const double t = whole * k / steps;
    rmp_pose at = end;
    if (ended(until)) return;
    while (chord < chords && t > before + own) {
      before += own;
      from = to;
      rmp_arc(begin, via, end, ++chord, &to);
      own = path_seconds(from, to, how);
    }
    if (k < steps) at = between(from, to, own > 0 ? (t - before) / own : 1);
    solve(at, q);
    show(seconds / steps);
  }
}
static rmp_pose by(rmp_position way) {
  rmp_pose to = present();
  to.pos = rmp_sum(to.pos, way, 1);
  return to;
}
void rmp_lin_by(rmp_position way, rmp_move how, rmp_condition until) { rmp_lin(by(way), how, until); }
void rmp_ptp_by(rmp_position way, rmp_move how, rmp_condition until) { rmp_ptp_pose(by(way), how, until); }
rmp_pose rmp_here(rmp_position at) {
  rmp_pose p = present();
  p.pos = at;
  return p;
}
void rmp_output(int number, const char *name, double value) {
  if (number >= 0 && number < MOST_SIGNALS) outputs[number] = value;
  printf("%.3f output %d %s %.15g\n", now, number, name, value);
}
double rmp_state(int number) { return number >= 0 && number < MOST_SIGNALS ? outputs[number] : 0; }
double rmp_input(int number, const char *name) {
  if (number >= 0 && number < MOST_SIGNALS && is_given[number]) return inputs[number];
  fprintf(stderr, "input %d (%s) has no value: start with --input %d=VALUE\n", number, name, number);
  rmpc_free(client);
  exit(1);
}
void rmp_wait(double seconds) { pass(seconds); }
void rmp_wait_begin(double timeout) { wait_until = timeout < 0 ? -1 : now + timeout; }
int rmp_wait_over(void) {
  if (wait_until >= 0 && now >= wait_until) return 1;
  if (wait_until < 0 && !in_real_time) fail("a condition that inputs do not fulfil is waited for, for ever");
  pass(CYCLE);
  return 0;
}
void rmp_pause(const char *message) { printf("%.3f pause %s\n", now, message); }
void rmp_halt(void) {
  printf("%.3f halt\n", now);
  rmpc_free(client);
  exit(2);
}
)";

inline constexpr const char* kPa10 =
    R"(/* rmp_motion.h by the library of the Mitsubishi PA-10 (pa.h, which comes with the arm).
 * The library's matrices are in RMP_PA10_LENGTH of a mm: check it at your arm (1 = mm, 0.001 = m).
 * Signals are yours: write rmp_user_output() and rmp_user_input(). */
)"
    "#"
    R"(include <stdio.h>
)"
    "#"
    R"(include <stdlib.h>
)"
    "#"
    R"(include <string.h>

)"
    "#"
    R"(include <pa.h>

)"
    "#"
    R"(include "rmp_motion.h"

#ifndef RMP_PA10_LENGTH
#define RMP_PA10_LENGTH 1.0
#endif
#ifndef RMP_PA10_ARM
#define RMP_PA10_ARM ARM0
#endif
#define DEGREE 57.29577951308232

extern void rmp_user_output(int number, double value);
extern double rmp_user_input(int number);
extern void rmp_user_wait(double seconds);

static ANGLE last;
static rmp_pose here;
static int is_here;
static double left;

static void fail(const char *what) {
  fprintf(stderr, "%s\n", what);
  exit(1);
}
void rmp_open(int argc, char **argv) {
  (void)argc;
  (void)argv;
  pa_ini_sys();
  pa_opn_arm(RMP_PA10_ARM);
  pa_sta_arm(RMP_PA10_ARM);
}
void rmp_close(void) {
  pa_ext_arm(RMP_PA10_ARM);
  pa_cls_arm(RMP_PA10_ARM);
  pa_ter_sys();
}
static void no_until(rmp_condition until) {
  if (until != NULL) fail("motions of the PA-10 do not end by a condition");
}
void rmp_ptp_joints(rmp_joint to, rmp_move how, rmp_condition until) {
  (void)how;
  no_until(until);
  last.s1 = to.main[0] / DEGREE;
  last.s2 = to.main[1] / DEGREE;
  last.s3 = to.main[2] / DEGREE;
  last.e1 = to.main[3] / DEGREE;
  last.e2 = to.main[4] / DEGREE;
  last.w1 = to.main[5] / DEGREE;
  last.w2 = to.main[6] / DEGREE;
  is_here = 0;
  pa_exe_axs(RMP_PA10_ARM, S1 | S2 | S3 | E1 | E2 | W1 | W2, &last, WM_WAIT);
}
void rmp_ptp_to(rmp_joint to, rmp_pose pse, rmp_move how, rmp_condition until) {
  rmp_ptp_joints(to, how, until);
  here = pse;
  is_here = 1;
}
static void go(rmp_pose to) {
  const rmp_position n = rmp_rotated(to.ori, rmp_at(1, 0, 0)), o = rmp_rotated(to.ori, rmp_at(0, 1, 0)),
                     a = rmp_rotated(to.ori, rmp_at(0, 0, 1));
  MATRIX t;
  t[0][0] = n.x; t[0][1] = o.x; t[0][2] = a.x; t[0][3] = to.pos.x * RMP_PA10_LENGTH;
  t[1][0] = n.y; t[1][1] = o.y; t[1][2] = a.y; t[1][3] = to.pos.y * RMP_PA10_LENGTH;
  t[2][0] = n.z; t[2][1] = o.z; t[2][2] = a.z; t[2][3] = to.pos.z * RMP_PA10_LENGTH;
  here = to;
  is_here = 1;
  pa_mov_mat(RMP_PA10_ARM, MM_XYZNOA, t, &last, WM_WAIT);
}
void rmp_ptp_pose(rmp_pose to, rmp_move how, rmp_condition until) {
  (void)how;
  no_until(until);
  go(to);
}
void rmp_lin(rmp_pose to, rmp_move how, rmp_condition until) {
  (void)how;
  no_until(until);
  go(to);
}
static rmp_pose present(void) {
  if (!is_here) fail("the pose before this motion is not known: move to a pose first");
  return here;
}
void rmp_circle(rmp_pose via, rmp_pose end, rmp_move how, rmp_condition until) {
  const rmp_pose begin = present();
  const int chords = rmp_arc(begin, via, end, 0, NULL);
  rmp_pose to;
  int k;
  (void)how;
  no_until(until);
  for (k = 1; k <= chords; ++k) {
    rmp_arc(begin, via, end, k, &to);
    go(to);
  }
}
void rmp_lin_by(rmp_position way, rmp_move how, rmp_condition until) {
  rmp_pose to = present();
  (void)how;
  no_until(until);
  to.pos = rmp_sum(to.pos, way, 1);
  go(to);
}
void rmp_ptp_by(rmp_position way, rmp_move how, rmp_condition until) { rmp_lin_by(way, how, until); }
rmp_pose rmp_here(rmp_position at) {
  rmp_pose p = present();
  p.pos = at;
  return p;
}
static double outputs[4096];
void rmp_output(int number, const char *name, double value) {
  (void)name;
  if (number >= 0 && number < 4096) outputs[number] = value;
  rmp_user_output(number, value);
}
double rmp_state(int number) { return number >= 0 && number < 4096 ? outputs[number] : 0; }
double rmp_input(int number, const char *name) {
  (void)name;
  return rmp_user_input(number);
}
void rmp_wait(double seconds) { rmp_user_wait(seconds); }
void rmp_wait_begin(double timeout) { left = timeout; }
int rmp_wait_over(void) {
  if (left >= 0) {
    left -= 0.01;
    if (left < 0) return 1;
  }
  rmp_user_wait(0.01);
  return 0;
}
void rmp_pause(const char *message) {
  pa_sus_arm(RMP_PA10_ARM);
  printf("%s Press Return to go on.\n", message);
  (void)getchar();
  pa_rsm_arm(RMP_PA10_ARM);
}
void rmp_halt(void) {
  pa_stp_arm(RMP_PA10_ARM);
  rmp_close();
  exit(2);
}
)";

/// Appended if a program has additional joints.
inline constexpr const char* kAdditionalRobomosp = R"(
void rmp_additional(const double *values, int count) {
  static double additional[RMP_MOST_JOINTS];
  int i;
  for (i = 0; i < count && i < RMP_MOST_JOINTS; ++i) {
    if (values[i] == additional[i]) continue;
    additional[i] = values[i];
    printf("%.3f additional %d %.15g\n", now, i + 1, values[i]);
  }
}
)";
inline constexpr const char* kAdditionalPa10 = R"(
/* Yours to write, as rmp_user_output(): additional joint `number` (1 is the first) goes to `value`. */
extern void rmp_user_additional(int number, double value);
void rmp_additional(const double *values, int count) {
  static double additional[RMP_MOST_JOINTS];
  int i;
  for (i = 0; i < count && i < RMP_MOST_JOINTS; ++i) {
    if (values[i] == additional[i]) continue;
    additional[i] = values[i];
    rmp_user_additional(i + 1, values[i]);
  }
}
)";
inline const char* additional(const char* runtime) {
  return runtime == kPa10 ? kAdditionalPa10 : kAdditionalRobomosp;
}

}  // namespace robomosp::posts::c_runtime
