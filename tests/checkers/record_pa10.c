/* SPDX-License-Identifier: Apache-2.0
 * The library of the PA-10 that writes down what it is told: angles in radians, matrices of n, o, a
 * and the place in mm. Its signals too: inputs that are asked for and then 0.01 s waited for, again
 * and again, are a wait for a condition. */
#include <math.h>
#include <pa.h>

#include "record.h"

#define DEGREE 57.29577951308232

static int is_open, is_on, polls;

void rmp_user_output(int number, double value);
double rmp_user_input(int number);
void rmp_user_wait(double seconds);

static void fail(const char* what) {
  fprintf(stderr, "%s\n", what);
  exit(1);
}
/* The condition held at once, or after so many polls; without the other inputs its time was over
 * then. */
static void settle(void) {
  if (record_count > 0)
    record_waited(polls > 0, polls == 0 ? -2 : record_is_other ? -1 : polls * 0.01);
  polls = 0;
}

int pa_ini_sys(void) {
  is_open = 1;
  return 0;
}
int pa_ter_sys(void) {
  settle();
  is_open = 0;
  return 0;
}
int pa_opn_arm(int arm) {
  if (!is_open) fail("the arm is opened before the system");
  return arm;
}
int pa_cls_arm(int arm) { return arm; }
int pa_sta_arm(int arm) {
  is_on = 1;
  return arm;
}
int pa_ext_arm(int arm) {
  settle();
  is_on = 0;
  return arm;
}
int pa_stp_arm(int arm) { return arm; }
int pa_sus_arm(int arm) { return arm; }
int pa_rsm_arm(int arm) { return arm; }
int pa_exe_axs(int arm, int axes, const ANGLE* a, int wait) {
  const double q[7] = {a->s1 * DEGREE, a->s2 * DEGREE, a->s3 * DEGREE, a->e1 * DEGREE,
                       a->e2 * DEGREE, a->w1 * DEGREE, a->w2 * DEGREE};
  settle();
  if (!is_on || arm != ARM0 || wait != WM_WAIT || axes != (S1 | S2 | S3 | E1 | E2 | W1 | W2))
    fail("angles of an arm that does not run, of some axes only, or without a wait");
  record_move("joints", "ptp", -1, -1, NULL, q, 7);
  return 0;
}
int pa_mov_mat(int arm, int mode, MATRIX m, const ANGLE* a, int wait) {
  double v[7], trace = m[0][0] + m[1][1] + m[2][2];
  (void)a;
  settle();
  if (!is_on || arm != ARM0 || wait != WM_WAIT || mode != MM_XYZNOA)
    fail("a matrix of an arm that does not run, in another mode, or without a wait");
  v[0] = m[0][3];
  v[1] = m[1][3];
  v[2] = m[2][3];
  /* Signs by the differences across the diagonal; the greatest part says which those are. */
  if (trace > 0) {
    v[3] = sqrt(1 + trace) / 2;
    v[4] = (m[2][1] - m[1][2]) / (4 * v[3]);
    v[5] = (m[0][2] - m[2][0]) / (4 * v[3]);
    v[6] = (m[1][0] - m[0][1]) / (4 * v[3]);
  } else {
    const int i = m[0][0] > m[1][1] ? (m[0][0] > m[2][2] ? 0 : 2) : (m[1][1] > m[2][2] ? 1 : 2);
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double big = sqrt(1 + m[i][i] - m[j][j] - m[k][k]) / 2;
    v[3] = (m[k][j] - m[j][k]) / (4 * big);
    v[4 + i] = big;
    v[4 + j] = (m[j][i] + m[i][j]) / (4 * big);
    v[4 + k] = (m[k][i] + m[i][k]) / (4 * big);
  }
  record_move("pose", "lin", -1, -1, NULL, v, 7);
  return 0;
}
void rmp_user_output(int number, double value) {
  settle();
  record_output(number, value);
}
double rmp_user_input(int number) { return record_input(number); }
void rmp_user_wait(double seconds) {
  if (record_count == 0 || seconds != 0.01) {
    settle();
    record_wait(seconds);
  } else if (++polls == 100000) {
    record_goes_on();
  } else if (polls > 200000) {
    fail("a wait does not end, whatever the inputs are");
  }
}
