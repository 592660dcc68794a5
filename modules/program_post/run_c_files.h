// SPDX-License-Identifier: Apache-2.0
// Files in C that are compiled beside a posted program to write down what it commands, in place
// of ROBOMOSP's client and of the PA-10's library (layer: application, program_post).
#pragma once

namespace robomosp::program_post::run_c_files {

// Their own includes are split, since they are none of this program.

/// Renames the calls of the program, so that each of them is written down.
inline constexpr const char* kSeen = R"(/* Calls of the program, each followed by a record. */
#define rmp_open rmp_seen_open
#define rmp_close rmp_seen_close
#define rmp_ptp_joints rmp_seen_ptp_joints
#define rmp_ptp_to rmp_seen_ptp_to
#define rmp_ptp_pose rmp_seen_ptp_pose
#define rmp_lin rmp_seen_lin
#define rmp_circle rmp_seen_circle
#define rmp_lin_by rmp_seen_lin_by
#define rmp_ptp_by rmp_seen_ptp_by
#define rmp_additional rmp_seen_additional
#define rmp_output rmp_seen_output
#define rmp_halt rmp_seen_halt
)";

/// What both controllers have in common. Records are lines of standard error that begin with
/// "RMP!", requests begin with "RMP?" and are answered on standard input.
inline constexpr const char* kRecords = R"(
static void seen_numbers(const double *x, size_t n) {
  size_t i;
  for (i = 0; i < n; ++i) fprintf(stderr, " %.17g", x[i]);
  fputc('\n', stderr);
}
void rmp_seen_open(int argc, char **argv) {
  static char buffer[1 << 16];
  setvbuf(stderr, buffer, _IOLBF, sizeof buffer);
  rmp_open(argc, argv);
}
static void seen_over(const char *how) { fprintf(stderr, "RMP! %s %.9g\n", how, seen_time()); }
void rmp_seen_close(void) {
  seen_over("over");
  rmp_close();
}
void rmp_seen_halt(void) {
  seen_over("over");
  fflush(stdout);
  exit(0);
}
void rmp_seen_ptp_joints(rmp_joint to, rmp_move how, rmp_condition until) { rmp_ptp_joints(to, how, until); seen_end(); }
void rmp_seen_ptp_to(rmp_joint to, rmp_pose pse, rmp_move how, rmp_condition until) { rmp_ptp_to(to, pse, how, until); seen_end(); }
void rmp_seen_ptp_pose(rmp_pose to, rmp_move how, rmp_condition until) { rmp_ptp_pose(to, how, until); seen_end(); }
void rmp_seen_lin(rmp_pose to, rmp_move how, rmp_condition until) { rmp_lin(to, how, until); seen_end(); }
void rmp_seen_circle(rmp_pose via, rmp_pose end, rmp_move how, rmp_condition until) { rmp_circle(via, end, how, until); seen_end(); }
void rmp_seen_lin_by(rmp_position by, rmp_move how, rmp_condition until) { rmp_lin_by(by, how, until); seen_end(); }
void rmp_seen_ptp_by(rmp_position by, rmp_move how, rmp_condition until) { rmp_ptp_by(by, how, until); seen_end(); }
void rmp_seen_output(int number, const char *name, double value) {
  rmp_output(number, name, value);
  fprintf(stderr, "RMP! output %.9g %d %.17g\n", seen_time(), number, value);
}
void rmp_seen_additional(const double *values, int count) {
#ifdef RMP_SEEN_ADDITIONAL
  rmp_additional(values, count);
#endif
  fprintf(stderr, "RMP! additional %.9g", seen_time());
  seen_numbers(values, (size_t)(count < RMP_MOST_JOINTS ? count : RMP_MOST_JOINTS));
}
)";

/// ROBOMOSP's client, as far as programs call it.
inline constexpr const char* kClientHeader = R"(#ifndef ROBOMOSP_CLIENT_H
#define ROBOMOSP_CLIENT_H
)"
                                             "#"
                                             R"(include <stddef.h>
typedef struct rmpc_client rmpc_client;
typedef enum rmpc_status { RMPC_OK = 0, RMPC_REFUSED } rmpc_status;
typedef struct rmpc_handle { int number; } rmpc_handle;
rmpc_client *rmpc_new(void);
void rmpc_free(rmpc_client *c);
rmpc_status rmpc_connect(rmpc_client *c, const char *address, const char *token);
rmpc_status rmpc_callf(rmpc_client *c, const char *method, const char *format, ...);
rmpc_status rmpc_get_handle(const rmpc_client *c, const char *path, rmpc_handle *out);
rmpc_status rmpc_get_numbers(const rmpc_client *c, const char *path, double *out, size_t most, size_t *count);
const char *rmpc_message(const rmpc_client *c);
#endif
)";

inline constexpr const char* kRobomosp =
    "#"
    R"(include "rmp_robomosp.c"
)"
    "#"
    R"(include "rmp_motion.c"
)"
    "#"
    R"(include <stdarg.h>

struct rmpc_client { int nothing; };
static struct rmpc_client the_client;
static double seen_answer[64];
static size_t seen_count;
static char seen_message[512];

static double seen_time(void) { return now; }
static void seen_numbers(const double *x, size_t n);
static void seen_end(void) {
  fprintf(stderr, "RMP! end %.9g", now);
  seen_numbers(q, joints);
}
rmpc_client *rmpc_new(void) { return &the_client; }
void rmpc_free(rmpc_client *c) { (void)c; }
rmpc_status rmpc_connect(rmpc_client *c, const char *address, const char *token) {
  (void)c; (void)address; (void)token;
  return RMPC_OK;
}
const char *rmpc_message(const rmpc_client *c) { (void)c; return seen_message; }
rmpc_status rmpc_get_handle(const rmpc_client *c, const char *path, rmpc_handle *out) {
  (void)c; (void)path;
  out->number = 1;
  return RMPC_OK;
}
static rmpc_status seen_ask(void) {
  char line[4096], *at = line;
  fflush(stderr);
  seen_count = 0;
  if (!fgets(line, sizeof line, stdin)) {
    strcpy(seen_message, "nobody answers");
    return RMPC_REFUSED;
  }
  if (strncmp(line, "ok", 2) != 0) {
    strncpy(seen_message, line + 3, sizeof seen_message - 1);
    return RMPC_REFUSED;
  }
  for (at += 2; seen_count < 64;) {
    char *end;
    const double v = strtod(at, &end);
    if (end == at) break;
    seen_answer[seen_count++] = v;
    at = end;
  }
  return RMPC_OK;
}
rmpc_status rmpc_callf(rmpc_client *c, const char *method, const char *format, ...) {
  rmpc_status s = RMPC_OK;
  va_list list;
  (void)c;
  va_start(list, format);
  if (strcmp(method, "robot.joint_values") == 0) {
    fprintf(stderr, "RMP? start\n");
    s = seen_ask();
  } else if (strcmp(method, "robot.get") != 0) {
    (void)va_arg(list, rmpc_handle *);
    if (strcmp(method, "robot.solve_ik") == 0) {
      const double *t = va_arg(list, const double *);
      (void)va_arg(list, size_t);
      (void)va_arg(list, size_t);
      fprintf(stderr, "RMP? ik");
      {
        const double *seed = va_arg(list, const double *);
        const size_t n = va_arg(list, size_t);
        size_t i;
        for (i = 0; i < 12; ++i) fprintf(stderr, " %.17g", t[i]);
        seen_numbers(seed, n);
      }
      s = seen_ask();
    } else {
      const double *values = va_arg(list, const double *);
      const size_t n = va_arg(list, size_t);
      if (strcmp(method, "robot.set_joints") == 0) {
        fprintf(stderr, "RMP! cycle %.9g", now);
        seen_numbers(values, n);
      } else if (strcmp(method, "robot.fk") == 0) {
        fprintf(stderr, "RMP? fk");
        seen_numbers(values, n);
        s = seen_ask();
      } else {
        strcpy(seen_message, "this command is not known here");
        s = RMPC_REFUSED;
      }
    }
  }
  va_end(list);
  return s;
}
/* fk: position, then quaternion. */
rmpc_status rmpc_get_numbers(const rmpc_client *c, const char *path, double *out, size_t most, size_t *count) {
  const size_t from = strcmp(path, "quaternion") == 0 ? 3 : 0;
  const size_t to = strcmp(path, "position") == 0 ? 3 : seen_count;
  size_t i;
  (void)c;
  *count = 0;
  for (i = from; i < to && *count < most; ++i) out[(*count)++] = seen_answer[i];
  return RMPC_OK;
}
)";

/// The PA-10's library, as far as programs call it.
inline constexpr const char* kPaHeader = R"(#ifndef PA_H
#define PA_H
typedef struct ANGLE { double s1, s2, s3, e1, e2, w1, w2; } ANGLE;
typedef double MATRIX[3][4];
enum { ARM0 = 0, S1 = 1, S2 = 2, S3 = 4, E1 = 8, E2 = 16, W1 = 32, W2 = 64, WM_WAIT = 0, MM_XYZNOA = 0 };
int pa_ini_sys(void);
int pa_opn_arm(int arm);
int pa_sta_arm(int arm);
int pa_ext_arm(int arm);
int pa_cls_arm(int arm);
int pa_ter_sys(void);
int pa_exe_axs(int arm, int axes, ANGLE *to, int mode);
int pa_mov_mat(int arm, int mode, MATRIX to, ANGLE *redundant, int wait);
int pa_sus_arm(int arm);
int pa_rsm_arm(int arm);
int pa_stp_arm(int arm);
#endif
)";

inline constexpr const char* kPa10 =
    "#"
    R"(include "rmp_pa10.c"
)"
    "#"
    R"(include "rmp_motion.c"

static double seen_now;
static double seen_inputs[4096];
static char seen_is_given[4096];
static double seen_time(void) { return seen_now; }
static void seen_numbers(const double *x, size_t n);
/* What the library was called with at last is where the motion ends. */
static void seen_end(void) { fprintf(stderr, "RMP! end %.9g\n", seen_now); }
int pa_ini_sys(void) { return 0; }
int pa_opn_arm(int arm) { (void)arm; return 0; }
int pa_sta_arm(int arm) { (void)arm; return 0; }
int pa_ext_arm(int arm) { (void)arm; return 0; }
int pa_cls_arm(int arm) { (void)arm; return 0; }
int pa_ter_sys(void) { return 0; }
int pa_sus_arm(int arm) { (void)arm; return 0; }
int pa_rsm_arm(int arm) { (void)arm; return 0; }
int pa_stp_arm(int arm) { (void)arm; return 0; }
int pa_exe_axs(int arm, int axes, ANGLE *to, int mode) {
  const double x[7] = {to->s1, to->s2, to->s3, to->e1, to->e2, to->w1, to->w2};
  (void)arm; (void)mode;
  if (axes != (S1 | S2 | S3 | E1 | E2 | W1 | W2)) {
    fprintf(stderr, "pa_exe_axs() is called for some axes only\n");
    exit(1);
  }
  fprintf(stderr, "RMP! axes %.9g", seen_now);
  seen_numbers(x, 7);
  return 0;
}
int pa_mov_mat(int arm, int mode, MATRIX to, ANGLE *redundant, int wait) {
  (void)arm; (void)mode; (void)redundant; (void)wait;
  fprintf(stderr, "RMP! pose %.9g %.17g", seen_now, (double)RMP_PA10_LENGTH);
  seen_numbers(&to[0][0], 12);
  return 0;
}
void rmp_user_output(int number, double value) { (void)number; (void)value; }
void rmp_user_wait(double seconds) { seen_now += seconds; }
double rmp_user_input(int number) {
  char line[64];
  double v = 0;
  if (number >= 0 && number < 4096 && seen_is_given[number]) return seen_inputs[number];
  fprintf(stderr, "RMP? input %d\n", number);
  fflush(stderr);
  if (!fgets(line, sizeof line, stdin) || sscanf(line, "ok %lf", &v) != 1) {
    fprintf(stderr, "input %d has no value\n", number);
    exit(1);
  }
  if (number >= 0 && number < 4096) seen_inputs[number] = v, seen_is_given[number] = 1;
  return v;
}
void rmp_user_additional(int number, double value) { (void)number; (void)value; }
)";

}  // namespace robomosp::program_post::run_c_files
