// SPDX-License-Identifier: Apache-2.0
// The kernels of lanes_kernel.cpp, one an instruction set (layer: plugin).
#pragma once

#include "candidates.h"
#include "family.h"

namespace robomosp::ik_spherical_wrist {

namespace baseline {
void solve_lanes(const ParallelArm& arm, const Question& question, Candidates& out);
void sines_cosines(const double* q, double* sine, double* cosine);
}  // namespace baseline
namespace avx2 {
void solve_lanes(const ParallelArm& arm, const Question& question, Candidates& out);
void sines_cosines(const double* q, double* sine, double* cosine);
}  // namespace avx2
namespace avx512 {
void solve_lanes(const ParallelArm& arm, const Question& question, Candidates& out);
void sines_cosines(const double* q, double* sine, double* cosine);
}  // namespace avx512

}  // namespace robomosp::ik_spherical_wrist
