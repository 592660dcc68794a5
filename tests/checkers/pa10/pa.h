/* SPDX-License-Identifier: Apache-2.0
 * Names of the library of the Mitsubishi PA-10 that published programs use; the arm's own header is
 * in its place there.
 */
#ifndef PA_H
#define PA_H

typedef struct ANGLE {
  double s1, s2, s3, e1, e2, w1, w2;
} ANGLE;
typedef double MATRIX[3][4];
enum { ARM0 = 0 };
enum { S1 = 1, S2 = 2, S3 = 4, E1 = 8, E2 = 16, W1 = 32, W2 = 64 };
enum { WM_WAIT = 1, MM_XYZNOA = 3 };

int pa_ini_sys(void);
int pa_ter_sys(void);
int pa_opn_arm(int arm);
int pa_cls_arm(int arm);
int pa_sta_arm(int arm);
int pa_ext_arm(int arm);
int pa_stp_arm(int arm);
int pa_sus_arm(int arm);
int pa_rsm_arm(int arm);
int pa_exe_axs(int arm, int axes, const ANGLE* angle, int wait);
int pa_mov_mat(int arm, int mode, MATRIX m, const ANGLE* angle, int wait);

#endif
